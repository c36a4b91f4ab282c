//! Convergence of a scene with its substeps, compared with its finest run.
//!
//! The study compares with the f64 reference, which knows the effects of the crate only. A scene with
//! effects of an app has none, so it is compared with itself: it runs with its own substeps, with twice
//! as many, and so on. That tells the error that finer steps remove, its order, and an estimate of what
//! is left. It does not tell what the iterations and the rounding to f32 leave in all of the runs: the
//! excess compliance of a solver that has not converged within a substep.

use super::{Solver, State, StudyError};
use crate::{
    scene::{BuiltScene, run::headless},
    simulation::{Profile, SolverThreads, plain::capture, tick},
    solver::{Substeps, Threads},
};
use std::ops::ControlFlow;

/// Options of a refinement.
#[derive(Debug, Clone)]
pub struct Refine {
    /// Simulated time [s], above 0; default 1.
    pub seconds: f64,
    /// Number of runs, each with twice the substeps of the one before, at least 2; default 5. Runs
    /// beyond the maximum number of substeps are left out.
    pub runs: usize,
    /// Solver threads; defaults to one per core.
    pub threads: Option<Threads>,
}

impl Default for Refine {
    fn default() -> Self {
        Self {
            seconds: 1.0,
            runs: 5,
            threads: None,
        }
    }
}

/// A run of a refinement.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct RefinedRun {
    /// Substeps per tick.
    pub substeps: u32,
    /// Mean real time of a tick [ms].
    pub ms: f64,
    /// RMS distance of the particles from the finest run at the end [m], 0 for the finest; `None` if
    /// a body diverged, appeared, disappeared or tore in one of them.
    pub to_finest: Option<f64>,
    /// The same from the next finer run; `None` also for the finest.
    pub to_next: Option<f64>,
    /// Observed order: the logarithm to base 2 of `to_next` over that of the next finer run.
    pub order: Option<f64>,
}

/// The runs of a scene, from coarse to fine.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Refinement {
    /// Simulated time [s].
    pub seconds: f64,
    /// The runs.
    pub runs: Vec<RefinedRun>,
    /// Estimated RMS distance of the finest run from the limit of ever more substeps [m], by
    /// Richardson's extrapolation with the last observed order; `None` if that is below 0.5, as the
    /// runs do not converge yet.
    pub left: Option<f64>,
}

/// Runs a scene with ever more substeps, with its bodies awake. `progress` is called after each run
/// with the completed fraction, from 0 to 1, and may end the refinement, which then has no result.
///
/// # Errors
/// [`StudyError::NotRefined`] if fewer than two runs are possible or the time is not above 0.
pub fn refine(
    built: &BuiltScene,
    options: &Refine,
    mut progress: impl FnMut(f64) -> ControlFlow<()>,
) -> Result<Option<Refinement>, StudyError> {
    let settings = &built.world.settings;
    let ticks = options.seconds * settings.rate.get();
    let doubled = (0..options.runs).map_while(|run| {
        let factor = 1_u32.checked_shl(run as u32)?;
        Substeps::new(settings.substeps.get().checked_mul(factor)?).ok()
    });
    let all: Vec<Substeps> = doubled.collect();
    if all.len() < 2 || !(ticks.is_finite() && ticks > 0.0) {
        return Err(StudyError::NotRefined {
            seconds: options.seconds,
            runs: all.len(),
        });
    }
    let ticks = ticks.round().max(1.0) as u64;
    // The cost of a run is in proportion to its substeps.
    let whole: u32 = all.iter().map(|it| it.get()).sum();
    let (mut ends, mut times, mut done) = (Vec::new(), Vec::new(), 0);
    for &substeps in &all {
        let mut built = built.clone();
        built.world.settings.substeps = substeps;
        built.world.sleep.enabled = false;
        let (end, ms) = run(&built, options, ticks);
        ends.push(end);
        times.push(ms);
        done += substeps.get();
        if progress(f64::from(done) / f64::from(whole)).is_break() {
            return Ok(None);
        }
    }
    let finest = ends.last().cloned().flatten();
    let distance = |a: &Option<State>, b: &Option<State>| rms(a.as_ref()?, b.as_ref()?);
    let steps: Vec<_> = ends.windows(2).map(|it| distance(&it[0], &it[1])).collect();
    let order = |run: usize| {
        let (coarse, fine) = ((*steps.get(run)?)?, (*steps.get(run + 1)?)?);
        (coarse > 0.0 && fine > 0.0).then(|| (coarse / fine).log2())
    };
    let runs = all.iter().zip(&ends).zip(&times).enumerate();
    let runs = runs.map(|(number, ((substeps, end), ms))| RefinedRun {
        substeps: substeps.get(),
        ms: *ms,
        to_finest: distance(end, &finest),
        to_next: steps.get(number).copied().flatten(),
        order: order(number),
    });
    let last = (all.len().checked_sub(3)).and_then(order);
    let left = last.filter(|order| *order >= 0.5).and_then(|order| {
        let step = steps.last().copied().flatten()?;
        Some(step / (order.exp2() - 1.0))
    });
    Ok(Some(Refinement {
        seconds: ticks as f64 / settings.rate.get(),
        runs: runs.collect(),
        left,
    }))
}

/// The end of a run, unless a body diverged, and the mean real time of a tick [ms].
fn run(built: &BuiltScene, options: &Refine, ticks: u64) -> (Option<State>, f64) {
    let mut app = headless(built);
    if let Some(threads) = &options.threads {
        app.insert_resource(SolverThreads(threads.clone()));
    }
    let world = app.world_mut();
    let mut spent = 0.0;
    for _ in 0..ticks {
        tick(world);
        spent += world.resource::<Profile>().tick().as_secs_f64();
    }
    let end = capture(world);
    let is_sound = end.bodies.iter().all(|body| body.quarantine.is_none());
    let state = is_sound.then(|| Solver::fast(end).state());
    (state, spent * 1e3 / ticks as f64)
}

/// Root mean square of the distances of the particles; `None` if there are others.
fn rms(one: &State, other: &State) -> Option<f64> {
    let counts = |state: &State| -> Vec<usize> {
        let bodies = state.bodies.iter();
        bodies.map(|body| body.x.len()).collect()
    };
    if counts(one) != counts(other) {
        return None;
    }
    let bodies = one.bodies.iter().zip(&other.bodies);
    let both = bodies.flat_map(|(a, b)| a.x.iter().zip(&b.x));
    let (mut sum, mut count) = (0.0, 0_usize);
    for (a, b) in both {
        sum += a.distance_squared(*b);
        count += 1;
    }
    let rms = (sum / count.max(1) as f64).sqrt();
    rms.is_finite().then_some(rms)
}
