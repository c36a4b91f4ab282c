//! The figure of projections per second: what it counts, and when it is absent.

use crate::support_app::cubes;
use bevy::{prelude::*, time::TimeUpdateStrategy};
use pliant::{
    SoftBodyPlugins,
    sandbox::lab::throughput::{Throughput, ThroughputPlugin},
    simulation::{Asleep, Profile, SimulationClock, SoftBody, TickStart, plain},
    solver::Particles,
};
use std::time::Duration;

#[test]
fn equal_ticks_give_their_own_rate_from_the_first_on() {
    let mut throughput = Throughput::default();
    throughput.refresh();
    assert_eq!(throughput.per_second(), None, "no tick, no figure");
    for _ in 0..100 {
        throughput.tick(20_000.0, 1e-4);
        throughput.refresh();
        let rate = throughput.per_second().expect("ticks were made");
        // Each of a few hundred operations rounds by at most 1e-16.
        assert!((rate / 2e8 - 1.0).abs() < 1e-13, "{rate}");
    }
}

#[test]
fn one_slow_tick_moves_the_figure_a_little_and_many_move_it_there() {
    let mut throughput = Throughput::default();
    (0..200).for_each(|_| throughput.tick(20_000.0, 1e-4));
    throughput.tick(20_000.0, 2e-4);
    throughput.refresh();
    let rate = throughput.per_second().expect("ticks were made");
    assert!((1.8e8..2e8).contains(&rate), "{rate}");
    (0..200).for_each(|_| throughput.tick(20_000.0, 2e-4));
    throughput.refresh();
    let rate = throughput.per_second().expect("ticks were made");
    // 0.96^200 = 3e-4 of the previous value remains.
    assert!((rate / 1e8 - 1.0).abs() < 1e-3, "{rate}");
}

/// The sandbox's measurement of two cubes, one tick per update.
fn app() -> (App, Vec<Entity>) {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, SoftBodyPlugins::new(PostUpdate)))
        .add_plugins(ThroughputPlugin)
        .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_nanos(
            1_000_000_000 / 60 + 1,
        )));
    app.finish();
    app.cleanup();
    let (bodies, _) = plain::spawn(app.world_mut(), &cubes());
    // The first update has no elapsed time, and in the first tick everything has changed, so that
    // no body sleeps.
    (0..3).for_each(|_| app.update());
    (app, bodies)
}

/// Runs ticks for half a second, longer than the figure's refresh interval, and counts only these.
/// Returns the shortest and the longest real time per tick [s].
fn half_a_second(app: &mut App) -> (f64, f64) {
    app.world_mut().resource_mut::<Throughput>().clear();
    let mut range = (f64::INFINITY, 0.0_f64);
    for _ in 0..30 {
        app.update();
        let seconds = app.world().resource::<Profile>().solver().as_secs_f64();
        range = (range.0.min(seconds), range.1.max(seconds));
    }
    range
}

/// Puts a body to sleep: stopped, because a moving body would wake immediately.
fn put_to_sleep(app: &mut App, body: Entity) {
    let mut entity = app.world_mut().entity_mut(body);
    let start = Particles::clone(entity.get::<TickStart>().expect("a body"));
    let mut particles = entity.get_mut::<Particles>().expect("a body");
    *particles = start;
    particles.stop();
    entity.insert(Asleep);
}

/// The sleeping body, if any.
fn sleeper(app: &mut App) -> Option<Entity> {
    let mut sleepers = app.world_mut().query_filtered::<Entity, With<Asleep>>();
    sleepers.iter(app.world()).next()
}

fn figure(app: &App) -> Option<f64> {
    app.world().resource::<Throughput>().per_second()
}

#[test]
fn the_figure_counts_the_constraints_of_bodies_that_are_awake() {
    for awake in [2, 1] {
        let (mut app, bodies) = app();
        let asleep = (awake == 1).then_some(bodies[1]);
        if let Some(body) = asleep {
            put_to_sleep(&mut app, body);
        }
        let (shortest, longest) = half_a_second(&mut app);
        assert_eq!(asleep, sleeper(&mut app), "nothing else slept or woke");
        let body = app.world().get::<SoftBody>(bodies[0]).expect("a body");
        let constraints = body.edges.ends().len() + body.tetrahedra.corners().len();
        // Four substeps of two iterations.
        let a_tick = (awake * constraints * 4 * 2) as f64;
        let rate = figure(&app).expect("bodies are stepped");
        // At most each of the eight particles of a cube touches the ground, in each contact pass.
        let touching = (awake * 8 * 4 * 2) as f64;
        let between = a_tick / longest..=(a_tick + touching) / shortest;
        assert!(between.contains(&rate), "{rate} is not in {between:?}");
    }
}

#[test]
fn there_is_no_figure_while_time_stands_or_all_bodies_sleep() {
    let (mut app, bodies) = app();
    half_a_second(&mut app);
    assert!(figure(&app).is_some());
    app.world_mut().resource_mut::<SimulationClock>().paused = true;
    app.update();
    assert_eq!(figure(&app), None);
    app.world_mut().resource_mut::<SimulationClock>().paused = false;
    half_a_second(&mut app);
    assert!(figure(&app).is_some());
    bodies
        .into_iter()
        .for_each(|body| put_to_sleep(&mut app, body));
    app.update();
    assert_eq!(figure(&app), None);
}
