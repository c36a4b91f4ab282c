//! Runs a scene without a window: the same systems, stepped as fast as possible, and checked at the
//! end.

use super::{
    BuiltScene, Scene,
    overrides::{Override, OverrideError},
    spawn::{copy_look, spawn},
    touched::Touched,
};

pub use super::touched::{PairOfRun, SurfaceOfRun};

use crate::{
    SoftBodyPlugins,
    effect::EffectRegistry,
    simulation::{
        EnergyLedger, Measuring, RecordContacts, SimulationSettings, SolverThreads, Statistics,
        plain::{self, bodies_in_order},
        state_hash, system_names, tick,
    },
    solver::Threads,
};
use bevy::prelude::*;
use std::ops::ControlFlow;

/// Options of a run.
#[derive(Debug, Clone, Default)]
pub struct RunOptions {
    /// Simulated time [s]; defaults to that of the acceptance criteria.
    pub seconds: Option<f64>,
    /// Overrides that are applied before the first tick.
    pub set: Vec<Override>,
    /// Solver threads; defaults to one per core. Results are bit-identical for any number.
    pub threads: Option<Threads>,
    /// Whether to track the energy ledger; default false.
    pub ledger: bool,
    /// Whether to record the forces of ground and colliders on bodies; default false.
    pub contacts: bool,
    /// Acceptance criteria; without them, only a finite state and unmoved pins are checked.
    pub acceptance: Option<super::Acceptance>,
}

/// Real time per tick [ms].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[non_exhaustive]
pub struct TickTimes {
    /// Time of the solver.
    pub solver: f64,
    /// Time of taking statistics.
    pub measuring: f64,
    /// Time of the ECS around them.
    pub ecs: f64,
}

/// Result of a run.
#[derive(Debug)]
#[non_exhaustive]
pub struct Run {
    /// Statistics before the first tick and after each.
    pub history: Vec<Statistics>,
    /// Real time of each tick.
    pub times: Vec<TickTimes>,
    /// Number of acceptance criteria of the scene that were judged. Without any, only that the state is
    /// finite, that pins did not move and that no surfaces cross.
    pub criteria: usize,
    /// Violated criteria, in one sentence each.
    pub reasons: Vec<String>,
    /// Names of the systems of a substep, in order.
    pub systems: Vec<&'static str>,
    /// Advice of effects on bodies at the end, one sentence each, as the panel shows it.
    pub notes: Vec<String>,
    /// Energy ledger of the run, if it was tracked.
    pub ledger: Option<EnergyLedger>,
    /// Settings of the run.
    pub settings: crate::solver::Settings,
    /// Bodies that touched each other, in the order in which they first did.
    pub touched: Vec<PairOfRun>,
    /// Bodies that touched a collider or the ground, in the order in which they first did; empty unless
    /// contacts were recorded.
    pub touched_surfaces: Vec<SurfaceOfRun>,
    /// Hash of the final state.
    pub state_hash: u64,
    /// The final world.
    pub world: crate::solver::World,
    /// Requested simulated time [s].
    pub seconds: f64,
    /// Whether it ended before that time, in which case nothing was judged.
    pub stopped: bool,
}

impl Run {
    /// Whether it was completed and all criteria hold.
    #[must_use]
    pub fn accepted(&self) -> bool {
        self.reasons.is_empty() && !self.stopped
    }

    /// Maximum number of crossings of an edge and a triangle after any tick; `None` if no body has
    /// contacts.
    #[must_use]
    pub fn crossings(&self) -> Option<usize> {
        self.history.iter().filter_map(|row| row.crossings).max()
    }

    /// Smallest distance of two surfaces in contact after any tick [m]; `None` if nothing came near.
    #[must_use]
    pub fn smallest_gap(&self) -> Option<f64> {
        let gaps = self.history.iter().filter_map(|row| row.smallest_gap);
        gaps.min_by(f64::total_cmp)
    }

    /// Median real time per tick, of each part.
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
    /// Options with the scene's own acceptance criteria.
    #[must_use]
    pub fn run_options(&self) -> RunOptions {
        RunOptions {
            acceptance: Some(self.acceptance.clone()),
            ..RunOptions::default()
        }
    }
}

/// Creates an app without a window that contains a scene, with the plugins of its effects of an app.
pub fn headless(built: &BuiltScene) -> App {
    let mut app = App::new();
    app.add_plugins(SoftBodyPlugins::default());
    built.own_effects.add_to(&mut app);
    app.add_observer(copy_look);
    app.finish();
    app.cleanup();
    spawn(built, app.world_mut());
    app
}

/// Runs a scene; `progress` is called after each tick with the completed fraction, from 0 to 1.
///
/// # Errors
/// [`OverrideError`] if an override is invalid; nothing has run in this case.
pub fn run(
    built: &BuiltScene,
    options: &RunOptions,
    mut progress: impl FnMut(f64),
) -> Result<Run, OverrideError> {
    let mut app = headless(built);
    prepare(&mut app, options)?;
    Ok(run_in(&mut app, options, |fraction, _| {
        progress(fraction);
        ControlFlow::Continue(())
    }))
}

/// Prepares an app that contains a scene for a run with the given options.
///
/// # Errors
/// [`OverrideError`] if an override is invalid.
pub fn prepare(app: &mut App, options: &RunOptions) -> Result<(), OverrideError> {
    let world = app.world_mut();
    for change in &options.set {
        change.apply(world)?;
    }
    if let Some(threads) = &options.threads {
        world.insert_resource(SolverThreads(threads.clone()));
    }
    world.insert_resource(Measuring(true));
    world.insert_resource(RecordContacts(options.contacts));
    world.insert_resource(EnergyLedger::kept(options.ledger));
    Ok(())
}

/// Runs the scene in a prepared app, as [`run`] does. `progress` is called after each tick, with the
/// fraction that is done and the world of the app, and can end it early.
pub fn run_in(
    app: &mut App,
    options: &RunOptions,
    mut progress: impl FnMut(f64, &mut World) -> ControlFlow<()>,
) -> Run {
    let world = app.world_mut();
    let settings = **world.resource::<SimulationSettings>();
    let start = plain::capture(world);
    let acceptance = options.acceptance.as_ref();
    let seconds = options
        .seconds
        .or(acceptance.map(|acceptance| acceptance.seconds))
        .unwrap_or(DEFAULT_SECONDS);
    let ticks = (seconds * settings.rate.get()).round().max(1.0) as u64;
    let mut history = vec![Statistics::measure(world)];
    let mut times = Vec::new();
    let mut touched = Touched::default();
    let mut stopped = false;
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
        touched.add(world);
        if progress(done as f64 / ticks as f64, world).is_break() && done < ticks {
            stopped = true;
            break;
        }
    }
    let end = plain::capture(world);
    let (touched, touched_surfaces) = touched.finish(settings.tick_seconds());
    let nothing = super::Acceptance {
        seconds,
        checks: Vec::new(),
    };
    let judged = acceptance.filter(|_| !stopped).unwrap_or(&nothing);
    Run {
        criteria: judged.count(),
        reasons: judged.judge(&start, &end, &history),
        stopped,
        history,
        times,
        systems: system_names(world),
        notes: notes(world),
        ledger: world.remove_resource().filter(|_| options.ledger),
        settings,
        touched,
        touched_surfaces,
        state_hash: state_hash(world),
        world: end,
        seconds,
    }
}

/// Notes of the effects, each with the bodies that it is about.
fn notes(world: &mut World) -> Vec<String> {
    let bodies = bodies_in_order(world);
    let settings = world.resource::<SimulationSettings>();
    let mut notes = Vec::new();
    for info in world.resource::<EffectRegistry>().iter() {
        let mut found: Vec<(String, Vec<&str>)> = Vec::new();
        for &body in &bodies {
            let body = world.entity(body);
            let Some(note) = (info.note)(&body, settings) else {
                continue;
            };
            let name = body.get::<Name>().map_or("body", Name::as_str);
            match found.iter_mut().find(|(same, _)| *same == note) {
                Some((_, names)) => names.push(name),
                None => found.push((note, vec![name])),
            }
        }
        notes.extend(found.into_iter().map(|(note, names)| {
            let more = match names.len() - 1 {
                0 => String::new(),
                more => format!(" and {more} more"),
            };
            format!("{} of '{}'{more}: {note}", info.name, names[0])
        }));
    }
    notes
}

/// Simulated time if neither the scene nor the user sets it [s].
const DEFAULT_SECONDS: f64 = 5.0;
