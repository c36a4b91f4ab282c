//! A scene without a window: the same systems, stepped as fast as they go, judged at the end.

use super::{
    BuiltScene, Scene,
    overrides::{Override, OverrideError},
    spawn::spawn,
};
use crate::{
    SoftBodyPlugins,
    simulation::{
        EnergyLedger, Measuring, SimulationSettings, SolverThreads, Statistics, plain,
        statistics::{measure, state_hash},
        system_names, tick,
    },
    solver::Threads,
};
use bevy::prelude::*;

/// What to change before a scene runs, and for how long.
#[derive(Debug, Clone, Default)]
pub struct RunOptions {
    /// Simulated time [s]; none takes the acceptance's.
    pub seconds: Option<f64>,
    /// What is set before the first tick.
    pub set: Vec<Override>,
    /// Threads to step bodies on; none takes one on each core. They change no bit.
    pub threads: Option<Threads>,
    /// Whether to keep the energy ledger; default false.
    pub ledger: bool,
    /// What must hold at the end; none checks only that the state is finite and pins are still.
    pub acceptance: Option<super::Acceptance>,
}

/// Real time of a tick [ms].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct TickTimes {
    /// In the solver.
    pub solver: f64,
    /// For figures of the state.
    pub measuring: f64,
    /// In the ECS around them.
    pub ecs: f64,
}

/// A run and its outcome.
#[derive(Debug)]
pub struct Run {
    /// Figures before the first tick and after each.
    pub history: Vec<Statistics>,
    /// Real time of each tick.
    pub times: Vec<TickTimes>,
    /// What did not hold, a sentence each.
    pub reasons: Vec<String>,
    /// What the systems in the substep are for, in the order in which they run.
    pub systems: Vec<&'static str>,
    /// The energy ledger of the run, if it was kept.
    pub ledger: Option<EnergyLedger>,
    /// Settings that it ran with.
    pub settings: crate::solver::Settings,
    /// Hash of the state at the end.
    pub state_hash: u64,
    /// The world at the end.
    pub world: crate::solver::World,
    /// Simulated time [s].
    pub seconds: f64,
}

impl Run {
    /// Whether everything held.
    #[must_use]
    pub fn accepted(&self) -> bool {
        self.reasons.is_empty()
    }

    /// The most pairs of an edge and a triangle that crossed after any tick; `None` if no body can touch.
    #[must_use]
    pub fn crossings(&self) -> Option<usize> {
        self.history.iter().filter_map(|row| row.crossings).max()
    }

    /// Real time of a tick, the median of each part.
    #[must_use]
    pub fn median_times(&self) -> TickTimes {
        let median = |part: fn(&TickTimes) -> f64| {
            let mut sorted: Vec<f64> = self.times.iter().map(part).collect();
            sorted.sort_by(f64::total_cmp);
            sorted.get(sorted.len() / 2).copied().unwrap_or_default()
        };
        TickTimes {
            solver: median(|times| times.solver),
            measuring: median(|times| times.measuring),
            ecs: median(|times| times.ecs),
        }
    }
}

impl Scene {
    /// Options that judge a run by the scene's own acceptance.
    #[must_use]
    pub fn run_options(&self) -> RunOptions {
        RunOptions {
            acceptance: Some(self.acceptance.clone()),
            ..RunOptions::default()
        }
    }
}

/// An app without a window in which a scene is ready to be stepped.
pub fn headless(built: &BuiltScene) -> App {
    let mut app = App::new();
    app.add_plugins(SoftBodyPlugins::default());
    app.finish();
    app.cleanup();
    spawn(built, app.world_mut());
    app
}

/// Runs a scene; `progress` is told the share that is done, from 0 to 1, after each tick.
///
/// # Errors
/// [`OverrideError`] if something cannot be set; nothing has run then.
pub fn run(
    built: &BuiltScene,
    options: &RunOptions,
    progress: impl FnMut(f64),
) -> Result<Run, OverrideError> {
    let mut app = headless(built);
    prepare(&mut app, options)?;
    Ok(run_in(&mut app, options, progress))
}

/// Makes an app in which a scene is ready run as the options say.
///
/// # Errors
/// [`OverrideError`] if something cannot be set.
pub fn prepare(app: &mut App, options: &RunOptions) -> Result<(), OverrideError> {
    let world = app.world_mut();
    for change in &options.set {
        change.apply(world)?;
    }
    if let Some(threads) = &options.threads {
        world.insert_resource(SolverThreads(threads.clone()));
    }
    world.insert_resource(Measuring(true));
    world.insert_resource(EnergyLedger::kept(options.ledger));
    Ok(())
}

/// Runs the scene in an app that has been prepared, as [`run`] does.
pub fn run_in(app: &mut App, options: &RunOptions, mut progress: impl FnMut(f64)) -> Run {
    let world = app.world_mut();
    let settings = **world.resource::<SimulationSettings>();
    let start = plain::capture(world);
    let acceptance = options.acceptance.as_ref();
    let seconds = options
        .seconds
        .or(acceptance.map(|acceptance| acceptance.seconds))
        .unwrap_or(DEFAULT_SECONDS);
    let ticks = (seconds * settings.rate.get()).round().max(1.0) as u64;
    let mut history = vec![measure(world)];
    let mut times = Vec::new();
    for done in 1..=ticks {
        tick(world);
        let profile = world.resource::<crate::simulation::Profile>();
        let [solver, measuring, ecs] = [profile.solver(), profile.measuring(), profile.ecs()]
            .map(|spent| spent.as_secs_f64() * 1e3);
        times.push(TickTimes {
            solver,
            measuring,
            ecs,
        });
        history.push(world.resource::<Statistics>().clone());
        progress(done as f64 / ticks as f64);
    }
    let end = plain::capture(world);
    let nothing = super::Acceptance {
        seconds,
        checks: Vec::new(),
    };
    Run {
        reasons: acceptance.unwrap_or(&nothing).judge(&start, &end, &history),
        history,
        times,
        systems: system_names(world),
        ledger: world.remove_resource().filter(|_| options.ledger),
        settings,
        state_hash: state_hash(world),
        world: end,
        seconds,
    }
}

/// Simulated time if neither a scene nor a user says [s].
const DEFAULT_SECONDS: f64 = 5.0;
