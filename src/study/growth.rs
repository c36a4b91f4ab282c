//! Scaling of cost with size.

use super::{numbers::number, pareto, results::ProblemResult, setting::Setting};
use std::collections::BTreeMap;

/// Exponent of time over constraints: the median over all settings that were timed on at least two
/// meshes on one machine.
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

/// The exponent with the sizes that it was measured on.
#[must_use]
pub(super) fn fact(result: &ProblemResult) -> Option<[String; 2]> {
    let exponent = exponent(result)?;
    let sizes = || result.cases.iter().map(|case| case.case.constraints());
    Some([
        format!(
            "Power of the number of constraints ({} to {}) that time scales with",
            sizes().min()?,
            sizes().max()?
        ),
        number(exponent),
    ])
}
