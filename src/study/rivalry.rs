//! Substeps versus iterations at the same number of projections.

use super::{
    Study,
    closed_form::Reference,
    numbers::{number, percent},
    results::{CaseResult, ProblemResult},
    setting::Method,
};
use crate::output::document::Block;
use std::collections::BTreeMap;

/// For each number of projections: errors with the most substeps and with the most iterations. Only
/// settled points, where both were tried.
#[must_use]
pub fn pairs(case: &CaseResult) -> Vec<(u64, f64, f64)> {
    let mut by_projections: BTreeMap<u64, Vec<(u32, f64)>> = BTreeMap::new();
    for point in &case.points {
        let counts = point.setting.method == Method::Xpbd && point.settled();
        if let Some(error) = point.error.filter(|error| counts && error.is_finite()) {
            let all = by_projections
                .entry(point.projections_per_tick)
                .or_default();
            all.push((point.setting.substeps, error));
        }
    }
    by_projections
        .into_iter()
        .filter_map(|(projections, mut all)| {
            all.sort_by_key(|(substeps, _)| *substeps);
            match all[..] {
                [(_, few), .., (_, many)] => Some((projections, many, few)),
                _ => None,
            }
        })
        .collect()
}

/// Mean of log₁₀(error with substeps / error with iterations): negative where substeps win. Errors
/// below the uncertainty of the reference are replaced by it.
#[must_use]
pub fn advantage(case: &CaseResult) -> Option<f64> {
    let least = case.doubt().unwrap_or(0.0).max(1e-9);
    let pairs = pairs(case);
    let logs = pairs
        .iter()
        .map(|&(_, many, few)| (many.max(least) / few.max(least)).log10());
    (!pairs.is_empty()).then(|| logs.sum::<f64>() / pairs.len() as f64)
}

/// Comparison at equal projections for each problem, and by compliance for the chains.
pub(super) fn tables(study: &Study) -> Vec<Block> {
    let rows: Vec<_> = study.problems.iter().filter_map(row).collect();
    let mut blocks = vec![Block::table(
        "Error at equal projections: most substeps against most iterations",
        &[
            "problem",
            "substeps better at [projections per tick]",
            "iterations better at",
            "largest budget",
            "error with substeps",
            "error with iterations",
        ],
        rows,
    )];
    let chains = chains(study);
    if !chains.is_empty() {
        blocks.push(Block::table(
            "Hanging chains: error with substeps over error with iterations at equal projections, \
             geometric mean over all budgets",
            &["compliance [m/N]", "ratio", "better"],
            chains,
        ));
    }
    blocks
}

fn row(problem: &ProblemResult) -> Option<Vec<String>> {
    let pairs = pairs(problem.finest_with_errors()?);
    let better = |is_better: fn(f64, f64) -> bool| {
        let budgets = pairs.iter().filter(|(_, many, few)| is_better(*many, *few));
        let names: Vec<String> = budgets.map(|(budget, ..)| budget.to_string()).collect();
        match names.len() {
            0 => "none".to_owned(),
            all if all == pairs.len() => "all".to_owned(),
            _ => names.join(", "),
        }
    };
    let (largest, many, few) = *pairs.last()?;
    Some(vec![
        problem.problem.title.clone(),
        better(|many, few| many < few),
        better(|many, few| few < many),
        largest.to_string(),
        percent(many),
        percent(few),
    ])
}

/// The chains by compliance, with their [`advantage`].
fn chains(study: &Study) -> Vec<Vec<String>> {
    let mut chains: Vec<(f64, f64)> = study
        .problems
        .iter()
        .filter_map(|problem| match problem.problem.reference {
            Reference::HangingChain { compliance, .. } => {
                Some((compliance, advantage(problem.finest_with_errors()?)?))
            }
            _ => None,
        })
        .collect();
    chains.sort_by(|a, b| a.0.total_cmp(&b.0));
    let rows = chains.into_iter().map(|(compliance, advantage)| {
        let better = if advantage < 0.0 {
            "substeps"
        } else {
            "iterations"
        };
        vec![
            number(compliance),
            number(10_f64.powf(advantage)),
            better.to_owned(),
        ]
    });
    rows.collect()
}
