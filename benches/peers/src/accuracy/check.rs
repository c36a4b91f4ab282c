//! Checks that a trial at rest holds all constraints of the problem and kept its pins.

use super::{problems::Problem, solvers::Trial};

/// Maximum displacement of a pin [m].
const MAX_SLIP: f64 = 1e-6;

/// Checks a trial.
///
/// # Errors
/// The reason why it is rejected, in a few words.
pub fn check(problem: &Problem, trial: &mut dyn Trial) -> Result<(), String> {
    let counts = trial.counts();
    let (edges, tetrahedra) = problem.constraints();
    if (counts.edges, counts.tetrahedra) != (edges, tetrahedra) {
        return Err(format!(
            "holds {} edges and {} tetrahedra, not {edges} and {tetrahedra}",
            counts.edges, counts.tetrahedra
        ));
    }
    let mut positions = Vec::new();
    trial.positions(&mut positions);
    let rest = &problem.shape.vertices;
    if positions.len() != rest.len() {
        return Err(format!("has {} particles", positions.len()));
    }
    if !positions.iter().all(|x| x.is_finite()) {
        return Err("not finite".into());
    }
    let slip = |&pin: &u32| positions[pin as usize].distance(rest[pin as usize].as_dvec3());
    if problem.pins.iter().map(slip).any(|slip| slip > MAX_SLIP) {
        return Err("a pin moved".into());
    }
    Ok(())
}
