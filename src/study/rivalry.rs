//! Substeps against iterations: the same projections, spent on the one or the other.

use super::{
    Study,
    closed_form::Reference,
    results::{CaseResult, ProblemResult},
    setting::Method,
    words::{number, percent},
};
use std::collections::BTreeMap;

/// Of equal projections, errors of the most substeps and of the most iterations, by projections.
/// Only of points that settled, where both were tried.
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

/// Mean of log₁₀(error with substeps / error with iterations): below 0 substeps win. Errors below
/// what is known of the reference are taken for that.
#[must_use]
pub fn advantage(case: &CaseResult) -> Option<f64> {
    let least = case.doubt().unwrap_or(0.0).max(1e-9);
    let pairs = pairs(case);
    let logs = pairs
        .iter()
        .map(|&(_, many, few)| (many.max(least) / few.max(least)).log10());
    (!pairs.is_empty()).then(|| logs.sum::<f64>() / pairs.len() as f64)
}

/// One sentence a problem, and the crossover of chains.
pub(super) fn sentences(study: &Study) -> Vec<String> {
    let mut sentences: Vec<String> = crossover(study).into_iter().collect();
    for problem in &study.problems {
        sentences.extend(sentence(problem));
    }
    sentences
}

fn sentence(problem: &ProblemResult) -> Option<String> {
    let case = problem.finest_with_errors()?;
    let pairs = pairs(case);
    let wins = |substeps: bool| -> Vec<String> {
        pairs
            .iter()
            .filter(|(_, many, few)| if substeps { many < few } else { few < many })
            .map(|(projections, ..)| projections.to_string())
            .collect()
    };
    let (substeps, iterations) = (wins(true), wins(false));
    let (largest, many, few) = *pairs.last()?;
    let verdict = match (substeps.len(), iterations.len()) {
        (0, 0) => "make no difference".to_owned(),
        (_, 0) => "win at every budget".to_owned(),
        (0, _) => "lose at every budget".to_owned(),
        _ => format!(
            "win at {} projections per tick, iterations at {}",
            substeps.join(", "),
            iterations.join(", ")
        ),
    };
    Some(format!(
        "{}: at equal projections, substeps {verdict}. At {largest} per tick, the error is {} with the \
         most substeps and {} with the most iterations.",
        problem.problem.title,
        percent(many),
        percent(few)
    ))
}

/// Where the chains go from one to the other, by compliance.
fn crossover(study: &Study) -> Option<String> {
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
    let (first, last) = (chains.first()?, chains.last()?);
    let Some(pair) = chains
        .windows(2)
        .find(|pair| (pair[0].1 < 0.0) != (pair[1].1 < 0.0))
    else {
        let winner = if first.1 < 0.0 {
            "substeps"
        } else {
            "iterations"
        };
        return Some(format!(
            "Hanging chain: from {} to {} m/N, {winner} are more efficient at equal projections; there \
             is no crossover.",
            number(first.0),
            number(last.0)
        ));
    };
    let [(a, f), (b, g)] = [pair[0], pair[1]];
    let (winner, loser) = if f < 0.0 {
        ("substeps", "iterations")
    } else {
        ("iterations", "substeps")
    };
    // Between logarithms of compliances, by a straight line; from 0 there is none.
    let share = f / (f - g);
    let place = if a > 0.0 {
        format!("about {} m/N", number(a * (b / a).powf(share)))
    } else {
        format!("somewhere below {} m/N", number(b))
    };
    Some(format!(
        "Hanging chain: at equal projections, {winner} are more efficient below {place} and {loser} \
         above, on average over all budgets."
    ))
}
