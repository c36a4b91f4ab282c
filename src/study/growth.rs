//! How cost grows with size.

use super::{Study, pareto, results::ProblemResult, setting::Setting, words::number};
use std::collections::BTreeMap;

/// Exponent of time over constraints, at each setting that was timed on two meshes or more of one
/// machine: the middle of them.
#[must_use]
pub fn exponent(result: &ProblemResult) -> Option<f64> {
    let mut by_setting: BTreeMap<(Setting, &str), Vec<(f64, f64)>> = BTreeMap::new();
    for case in &result.cases {
        let constraints = case.case.constraints() as f64;
        for point in &case.points {
            if let (Some(ms), Some(machine)) = (point.ms, &point.machine) {
                let line = by_setting.entry((point.setting, machine)).or_default();
                line.push((constraints, ms.median));
            }
        }
    }
    let mut exponents: Vec<f64> = by_setting
        .values()
        .filter_map(|line| pareto::exponent(line))
        .collect();
    exponents.sort_by(f64::total_cmp);
    exponents.get(exponents.len() / 2).copied()
}

/// The exponent in words, with the sizes that it is of.
#[must_use]
pub(super) fn sentence(_study: &Study, result: &ProblemResult) -> Option<String> {
    let exponent = exponent(result)?;
    let sizes = || result.cases.iter().map(|case| case.case.constraints());
    Some(format!(
        "At a fixed setting, time scales with the number of constraints to the power {} ({} to {} constraints).",
        number(exponent),
        sizes().min()?,
        sizes().max()?
    ))
}
