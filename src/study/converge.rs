//! The converged solution on a mesh, in f64.
//!
//! At rest: the [static equilibrium](equilibrium) by Newton's method, which needs no time steps and
//! takes less than a second. Where that does not apply, for example on a ground or with pressure:
//! the f64 reference at h and h/2, with multipliers that are kept from substep to substep, so that
//! the state of rest satisfies the equations and depends neither on h nor on the number of
//! iterations; the difference between the two estimates the error of the search for rest.
//!
//! In motion: the f64 reference at h, h/2 and h/4, extrapolated to h → 0 (Richardson 1911), with
//! the observed order of convergence.

use super::{
    StudyError,
    observe::{Observe, Observed, distance},
    problem::{Case, ReferenceSettings},
    setting::Setting,
    state::Solver,
};
use crate::solver::equilibrium::{self, Equilibrium};
use serde::{Deserialize, Serialize};

/// A converged solution.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Converged {
    /// The observed values, as h → 0.
    #[serde(deserialize_with = "super::nan::numbers")]
    pub values: Vec<f64>,
    /// Observed order of convergence; none if refinement changes nothing.
    pub order: Option<f64>,
    /// Distance of the finest run from this solution, in the unit of the observed values. Smaller
    /// errors cannot be resolved.
    #[serde(deserialize_with = "super::nan::number")]
    pub uncertainty: f64,
    /// Whether every run came to rest, where rest is observed.
    pub settled: bool,
    /// Substeps of the finest run; 0 where there was none.
    pub substeps: u32,
    /// The method that found it.
    #[serde(default)]
    pub found_by: FoundBy,
}

/// How a converged solution was found.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FoundBy {
    /// By time steps of the f64 reference.
    #[default]
    Stepping,
    /// As the static equilibrium, by Newton's method.
    Equilibrium {
        /// Residual force over applied force.
        residual: f64,
    },
}

/// Differences below this fraction of the observed values count as none: the search for rest ends
/// at about 1e-7 of a body's size.
const SAME: f64 = 1e-7;

/// Range of observed orders that count as first order.
pub const FIRST_ORDER: std::ops::RangeInclusive<f64> = 0.8..=1.2;

/// By Newton's method where that applies, otherwise by the f64 reference.
///
/// # Errors
/// [`StudyError::Value`] for settings out of their range.
pub fn converge(case: &Case) -> Result<Converged, StudyError> {
    by_equilibrium(case).map_or_else(|| by_stepping(case), Ok)
}

/// Whether the solution is a static equilibrium, found without the f64 reference.
#[must_use]
pub fn has_equilibrium(case: &Case) -> bool {
    let Observe::Rest { quantity, .. } = &case.problem.observe else {
        return false;
    };
    let body = case.world.bodies.get(quantity.subject().0);
    body.is_some_and(|body| equilibrium::refusal(body, &case.world.settings).is_none())
}

/// The static equilibrium; `None` where nothing at rest is observed, or none was found.
#[must_use]
pub fn by_equilibrium(case: &Case) -> Option<Converged> {
    let Observe::Rest { quantity, .. } = &case.problem.observe else {
        return None;
    };
    let (body, _) = quantity.subject();
    let Equilibrium {
        x,
        neighbor,
        residual,
        ..
    } = equilibrium::find(case.world.bodies.get(body)?, &case.world.settings).ok()?;
    let mut state = case.start.clone();
    let mut observed = |x| {
        state.bodies[body].x = x;
        case.problem
            .observe
            .at_rest(&state, &case.start, &case.world)
    };
    let (value, beside) = (observed(x)?, observed(neighbor)?);
    // Rounding of positions limits the accuracy, whatever residual the search reaches.
    let rounding = f64::EPSILON * case.start.reach();
    Some(Converged {
        values: vec![value],
        order: None,
        uncertainty: (value - beside).abs().max(rounding),
        settled: true,
        substeps: 0,
        found_by: FoundBy::Equilibrium { residual },
    })
}

/// Runs the f64 reference. A state of rest is first approximated by the fast solver and then
/// refined by the f64 reference, which is faster and does not change the result.
///
/// # Errors
/// [`StudyError::Value`] for settings out of their range.
pub fn by_stepping(case: &Case) -> Result<Converged, StudyError> {
    let ReferenceSettings {
        substeps,
        iterations,
        keeps_multipliers,
    } = case.problem.converged;
    let observe = &case.problem.observe;
    if !(observe.is_static() && keeps_multipliers) {
        let (mut seen, mut nearer) = (Vec::new(), None);
        for factor in [1, 2, 4] {
            let setting = Setting::xpbd(substeps * factor, iterations);
            let mut solver = Solver::reference(&setting.applied(&case.world)?);
            // The state of rest for a finer step is near that for a coarser one.
            if let Some(state) = nearer.take() {
                solver.place(&state);
            }
            seen.push(observe.run(&mut solver, &case.start, &case.world));
            nearer = Some(solver.state()).filter(|state| observe.is_static() && state.finite());
        }
        return Ok(limit(&seen, substeps * 4));
    }
    let mut solver = Solver::fast(Setting::xpbd(ROUGH.0, ROUGH.1).applied(&case.world)?);
    observe.run(&mut solver, &case.start, &case.world);
    let mut seen = Vec::new();
    for factor in [1, 2] {
        let setting = Setting::xpbd(substeps * factor, iterations);
        let nearer = solver.state();
        solver = Solver::relaxed_reference(&setting.applied(&case.world)?);
        if nearer.finite() {
            solver.place(&nearer);
        }
        seen.push(observe.run(&mut solver, &case.start, &case.world));
    }
    Ok(Converged {
        uncertainty: distance(&seen[0].values, &seen[1].values),
        values: seen[1].values.clone(),
        order: None,
        settled: seen.iter().all(|observed| observed.settled),
        substeps: substeps * 2,
        found_by: FoundBy::Stepping,
    })
}

/// Substeps and iterations of the first approximation by the fast solver.
const ROUGH: (u32, u32) = (16, 4);

/// Extrapolates the results at h, h/2 and h/4.
fn limit(seen: &[Observed], substeps: u32) -> Converged {
    let values = |place: usize| &seen[place].values[..];
    let first = distance(values(0), values(1));
    let second = distance(values(1), values(2));
    let size = distance(values(2), &vec![0.0; values(2).len()]);
    let order = (second > SAME * size && first > 0.0).then(|| (first / second).log2());
    // First order is assumed within its range. Above it, the observed order is used; below it, the
    // remaining change cannot be estimated.
    let factor = match order {
        Some(order) if FIRST_ORDER.contains(&order) => 1.0,
        Some(order) if order > *FIRST_ORDER.end() => 1.0 / (order.min(4.0).exp2() - 1.0),
        _ => 0.0,
    };
    let extrapolated: Vec<f64> = values(2)
        .iter()
        .zip(values(1))
        .map(|(fine, coarse)| fine + factor * (fine - coarse))
        .collect();
    Converged {
        uncertainty: second * if factor > 0.0 { factor } else { 1.0 },
        values: extrapolated,
        order,
        settled: seen.iter().all(|observed| observed.settled),
        substeps,
        found_by: FoundBy::Stepping,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn observed(value: f64) -> Observed {
        Observed {
            values: vec![value],
            settled: true,
            seconds: 1.0,
        }
    }

    #[test]
    fn an_error_that_falls_with_h_is_extrapolated_away() {
        let seen = [0.4, 0.2, 0.1].map(|h| observed(3.0 + 0.5 * h));
        let limit = limit(&seen, 4);
        // Rounding of numbers near 3.
        assert!((limit.values[0] - 3.0).abs() < 1e-14);
        assert!((limit.order.expect("it converges") - 1.0).abs() < 1e-12);
        assert!((limit.uncertainty - 0.05).abs() < 1e-14);
    }

    #[test]
    fn what_does_not_change_has_no_order_and_what_does_not_converge_is_left_as_it_is() {
        let same = limit(&[1.0, 1.0, 1.0].map(observed), 4);
        assert_eq!((same.order, same.values[0]), (None, 1.0));
        let wild = limit(&[1.0, 1.1, 1.3].map(observed), 4);
        assert_eq!(wild.values[0], 1.3);
        assert!((wild.uncertainty - 0.2).abs() < 1e-12);
    }
}
