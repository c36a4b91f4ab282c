//! Runs a scene with effects of an app, whose systems only Bevy can run.

use super::{
    Figure, Member, Outcome, Outside, TortureError,
    run::{COMPARED, Crews, slowest},
    watch::Watch,
};
use crate::{
    scene::{BuiltScene, run::headless},
    simulation::{SolverThreads, plain::capture, state_hash, tick},
    solver::Threads,
};
use bevy::app::App;
use std::time::Instant;

/// Runs a scene for some simulated time [s], then repeats its first ticks with each of `crews`.
pub(super) fn run_in_app(
    (number, member): (usize, &Member),
    (built, seconds): (&BuiltScene, f64),
    crews: &Crews,
) -> Result<Outcome, TortureError> {
    let mut app = app(built, &Threads::default());
    let mut world = capture(app.world_mut());
    let mut watch = Watch::new(&world, Outside::Work, false);
    let mut times = Vec::new();
    let (mut early, mut ticks) = (None, 0);
    let end = seconds * (1.0 - 1e-9);
    while world.time < end {
        let clock = Instant::now();
        tick(app.world_mut());
        times.push(clock.elapsed().as_secs_f64());
        ticks += 1;
        world = capture(app.world_mut());
        watch.see(&world);
        if ticks == COMPARED {
            early = Some(state_hash(app.world_mut()));
        }
    }
    let expected = early.unwrap_or_else(|| state_hash(app.world_mut()));
    let mut figures = watch.figures();
    figures.push(Figure::none(
        "runs with other bits",
        different(built, crews, ticks.min(COMPARED), expected),
        "runs",
    ));
    Ok(Outcome {
        number,
        member: *member,
        figures,
        slowest: slowest(&times),
        seconds: times.iter().sum(),
        watch: None,
        world: None,
    })
}

fn app(built: &BuiltScene, threads: &Threads) -> App {
    let mut app = headless(built);
    app.insert_resource(SolverThreads(threads.clone()));
    app
}

/// Number of repeated runs, with other threads, whose state differs.
fn different(built: &BuiltScene, crews: &Crews, ticks: usize, expected: u64) -> usize {
    let differs = |threads: &&Threads| {
        let mut app = app(built, threads);
        (0..ticks).for_each(|_| tick(app.world_mut()));
        state_hash(app.world_mut()) != expected
    };
    crews.all().iter().filter(differs).count()
}
