//! What a run's figures say against its result: inverted elements, a solver that has not converged,
//! substeps that single precision does not resolve.

use crate::{
    scene::run::Run,
    solver::{
        effective::{CLOSE, MAX_SUBSTEPS},
        measure,
    },
};

/// Residual above which a run is said not to be converged: strains of 1 % are seen by eye.
const RESIDUAL: f64 = 0.01;

/// Elastic energy below this fraction of the others is rounding: strains of a millionth, as positions
/// in single precision have them, hold less.
const ROUNDING: f64 = 1e-6;

/// Warnings about the state at the end of a run, one sentence each, with what to set.
///
/// A run may be accepted and have warnings: its criteria are the scene's own.
#[must_use]
pub fn warnings(run: &Run) -> Vec<String> {
    [unresolved_substeps(run), inverted(run), not_converged(run)]
        .into_iter()
        .flatten()
        .collect()
}

/// Substeps that are too short for single precision.
fn unresolved_substeps(run: &Run) -> Option<String> {
    let substeps = run.settings.substeps.get();
    let most = run.world.resolved_substeps()?;
    (substeps > most).then(|| {
        format!(
            "single precision resolves at most {most} substeps here: beyond that, rounding moves particles by \
             more than gravity does per substep, and forces are mostly noise"
        )
    })
}

/// Inverted tetrahedra, by body.
fn inverted(run: &Run) -> Option<String> {
    let bodies = run.world.bodies.iter().filter_map(|body| {
        let all = body.topology.tetrahedra.rest_volume.len();
        let inverted = measure::inverted(&body.topology, &body.particles.positions);
        (inverted > 0).then(|| format!("'{}' has {inverted} of {all} tetrahedra", body.name))
    });
    let bodies: Vec<_> = bodies.collect();
    let more = doubled(run);
    let recovers = run
        .world
        .bodies
        .iter()
        .all(|body| body.effects.neo_hookean.is_some());
    let other = match recovers {
        true => "fewer cells",
        false => "fewer cells, or the effect neo_hookean, which recovers from inversion",
    };
    (!bodies.is_empty()).then(|| format!("{} inverted: try {more}{other}", bodies.join(", ")))
}

/// A solver that holds much less than the requested stiffness, or leaves large residuals.
fn not_converged(run: &Run) -> Option<String> {
    let last = run.history.last()?;
    let requested = last.elastic_sum();
    let held = requested - last.unresolved;
    // Without load, as in free fall, the elastic energy is that of rounding.
    let is_loaded = requested > ROUNDING * (last.kinetic + last.potential.abs());
    let is_soft = is_loaded && last.unresolved > (CLOSE - 1.0) * held;
    let is_off = last.residual >= RESIDUAL;
    if !last.finite || !is_soft && !is_off {
        return None;
    }
    let found = match is_soft {
        true => format!(
            "the solver holds {:.1} % of the elastic energy that the requested materials would store at these strains, \
             so that bodies are softer than requested",
            100.0 * held / requested
        ),
        false => format!(
            "the constraints are off by {:.1} % of their lengths and volumes (root mean square residual)",
            100.0 * last.residual
        ),
    };
    let excess = match is_soft {
        true => (requested / held - 1.0) / (CLOSE - 1.0),
        false => last.residual / RESIDUAL,
    };
    Some(format!("{found}: {}", remedy(run, excess)))
}

/// What to set so that an error decreases by a factor. It decreases with the square of the substeps,
/// or with damping as they do.
fn remedy(run: &Run, factor: f64) -> String {
    let substeps = (f64::from(run.settings.substeps.get()) * factor.sqrt()).ceil();
    match substeps <= f64::from(max_substeps(run)) {
        true => format!("try --set substeps={substeps:.0}, or softer materials"),
        false => {
            "use softer materials, fewer cells, or the direct solver (effect direct)".to_owned()
        }
    }
}

/// Twice the substeps as a remedy, where they are resolved; otherwise empty.
fn doubled(run: &Run) -> String {
    let twice = run.settings.substeps.get().saturating_mul(2);
    match twice <= max_substeps(run) {
        true => format!("--set substeps={twice}, "),
        false => String::new(),
    }
}

/// Largest number of substeps that is recommended.
fn max_substeps(run: &Run) -> u32 {
    let resolved = run.world.resolved_substeps();
    resolved.map_or(MAX_SUBSTEPS, |most| most.min(MAX_SUBSTEPS))
}
