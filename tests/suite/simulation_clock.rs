//! The clock: pause, single steps, speed, the catch-up limit, the time budget, and the clocks that
//! systems inside a tick see.

use crate::{
    support::{body, cube, settings},
    support_app::{app_of, cubes, ticks},
};
use bevy::{prelude::*, time::TimeUpdateStrategy};
use pliant::{
    SoftBodyPlugins,
    effect::Stretch,
    simulation::{
        Action, Actions, EndedEarly, PastStarts, SimulationClock, SimulationSettings, SolvePhase,
        SolveSchedule, SolverSystems, StepSchedule, StepSystems, SubstepSchedule, SubstepTime,
        Tick, TickStart, plain, state_hash,
    },
    solver::{self, Compliance, Cut, Particles},
};
use std::{thread, time::Duration};

/// An app whose clock advances by `real` seconds per update.
fn app_at(real: Duration) -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, SoftBodyPlugins::new(Update)));
    app.insert_resource(TimeUpdateStrategy::ManualDuration(real));
    app.finish();
    app.cleanup();
    let _entities = plain::spawn(app.world_mut(), &cubes());
    // No wall clock in what follows, unless a test sets one.
    app.world_mut().resource_mut::<SimulationClock>().limit = None;
    // The first update has no elapsed time.
    app.update();
    app
}

fn tick_time() -> Duration {
    Duration::from_secs_f64(1.0 / 60.0)
}

fn clock(app: &mut App) -> Mut<'_, SimulationClock> {
    app.world_mut().resource_mut::<SimulationClock>()
}

fn updates(app: &mut App, count: usize) {
    (0..count).for_each(|_| app.update());
}

#[test]
fn a_tick_happens_for_each_sixtieth_of_a_second_that_passes() {
    let mut app = app_at(tick_time());
    updates(&mut app, 600);
    assert_eq!(clock(&mut app).tick(), 600);
    assert!((clock(&mut app).time() - 10.0).abs() < 1e-9);
    // A quarter of a tick, rounded up to whole nanoseconds.
    let mut fast = app_at(Duration::from_nanos(4_166_667));
    updates(&mut fast, 600);
    assert_eq!(clock(&mut fast).tick(), 150);
}

#[test]
fn nothing_moves_while_the_clock_is_paused_and_a_step_is_one_tick() {
    let mut app = app_at(tick_time());
    clock(&mut app).paused = true;
    let before = state_hash(app.world_mut());
    updates(&mut app, 100);
    assert_eq!(state_hash(app.world_mut()), before);
    clock(&mut app).step_once();
    updates(&mut app, 100);
    assert_eq!(clock(&mut app).tick(), 1);
    let mut expected = cubes();
    expected.tick();
    assert_eq!(state_hash(app.world_mut()), expected.state_hash());
    clock(&mut app).paused = false;
    updates(&mut app, 10);
    assert_eq!(
        clock(&mut app).tick(),
        11,
        "what passed in the pause is not caught up"
    );
}

#[test]
fn while_the_clock_is_held_no_tick_begins_and_what_passes_is_dropped() {
    let mut app = app_at(tick_time());
    updates(&mut app, 10);
    clock(&mut app).held = true;
    clock(&mut app).step_once();
    updates(&mut app, 100);
    assert_eq!(clock(&mut app).tick(), 10);
    // One or two may be pending, the others are counted as dropped.
    let dropped = clock(&mut app).dropped();
    assert!((98..100).contains(&dropped), "{dropped}");
    clock(&mut app).held = false;
    updates(&mut app, 10);
    // Of 120 ticks those that were not dropped, and the requested step.
    assert_eq!(clock(&mut app).tick(), 121 - dropped);
}

#[test]
fn speed_changes_how_many_ticks_pass_and_not_how_long_they_are() {
    let mut app = app_at(tick_time());
    clock(&mut app).speed = 0.25;
    updates(&mut app, 40);
    assert_eq!(clock(&mut app).tick(), 10);
    clock(&mut app).speed = 2.0;
    updates(&mut app, 10);
    assert_eq!(clock(&mut app).tick(), 30);
    let mut expected = cubes();
    (0..30).for_each(|_| expected.tick());
    assert_eq!(state_hash(app.world_mut()), expected.state_hash());
}

#[test]
fn the_clock_stays_finite_at_an_invalid_speed() {
    let mut app = app_at(tick_time());
    for speed in [f64::NAN, -3.0, f64::INFINITY, 1e300] {
        clock(&mut app).speed = speed;
        updates(&mut app, 3);
    }
    assert!(clock(&mut app).time().is_finite());
}

#[test]
fn ticks_that_cannot_be_caught_up_are_dropped_and_counted() {
    // Ten ticks are due in each update; four of them are run, and one more may be pending.
    let mut app = app_at(tick_time() * 10);
    clock(&mut app).catch_up = tick_time() * 4;
    updates(&mut app, 20);
    let (done, dropped) = (clock(&mut app).tick(), clock(&mut app).dropped());
    // Whether the additional one remains depends on the rounding of real time to nanoseconds.
    assert!((80..=100).contains(&done), "{done} done");
    assert!(
        (195..=200).contains(&(done + dropped)),
        "{done} done, {dropped} dropped"
    );
    app.insert_resource(TimeUpdateStrategy::ManualDuration(tick_time()));
    updates(&mut app, 20);
    // At its own rate again immediately: a hitch is not made up for.
    assert!(clock(&mut app).tick() <= done + 22);
    assert_eq!(clock(&mut app).dropped(), dropped);
}

/// Makes every iteration take longer than the budget.
fn stall() {
    thread::sleep(Duration::from_millis(1));
}

/// An app in which a tick of four substeps takes more real time than the budget of an update.
fn slow_app() -> App {
    let mut app = app_at(tick_time());
    app.add_systems(SolveSchedule, stall.in_set(SolvePhase::User));
    clock(&mut app).budget = Some(Duration::from_micros(100));
    app
}

#[test]
fn a_tick_that_is_spread_over_updates_gives_the_bits_of_one_that_is_not() {
    let mut app = slow_app();
    let mut seen_mid_tick = false;
    let mut count = 0;
    while clock(&mut app).tick() < 10 || clock(&mut app).mid_tick() {
        app.update();
        if clock(&mut app).mid_tick() {
            seen_mid_tick = true;
            assert_eq!(clock(&mut app).overstep(), 0.0);
        }
        count += 1;
        assert!(count < 1000);
    }
    assert!(seen_mid_tick && count > 20, "{count} updates");
    let done = clock(&mut app).tick();
    let mut expected = cubes();
    (0..done).for_each(|_| expected.tick());
    assert_eq!(state_hash(app.world_mut()), expected.state_hash());
}

fn until_mid_tick(app: &mut App) {
    for _ in 0..100 {
        app.update();
        if clock(app).mid_tick() {
            return;
        }
    }
    panic!("never in the middle of a tick");
}

#[test]
fn settings_written_in_the_middle_of_a_tick_wait_for_the_next() {
    let mut app = slow_app();
    until_mid_tick(&mut app);
    let tick = clock(&mut app).tick();
    app.world_mut()
        .insert_resource(SimulationSettings(settings(1.6, 60.0, 7, 1)));
    while clock(&mut app).tick() == tick {
        app.update();
    }
    let mut expected = cubes();
    (0..=tick).for_each(|_| expected.tick());
    assert_eq!(state_hash(app.world_mut()), expected.state_hash());
    expected.settings = settings(1.6, 60.0, 7, 1);
    expected.tick();
    while clock(&mut app).tick() == tick + 1 {
        app.update();
    }
    assert_eq!(state_hash(app.world_mut()), expected.state_hash());
}

#[test]
fn a_body_that_comes_in_the_middle_of_a_tick_breaks_nothing() {
    let mut app = slow_app();
    until_mid_tick(&mut app);
    let newcomer = plain::spawn_body(app.world_mut(), &cubes().bodies[1]);
    let with_new_effect = plain::spawn_body(app.world_mut(), &cubes().bodies[0]);
    app.world_mut()
        .entity_mut(with_new_effect)
        .insert(pliant::effect::Collide::default());
    updates(&mut app, 60);
    for body in [newcomer, with_new_effect] {
        let particles = app.world().get::<Particles>(body).expect("a body");
        assert!(particles.first_not_finite().is_none());
    }
}

#[test]
fn an_effect_that_comes_in_the_middle_of_a_tick_breaks_nothing() {
    let (mut app, bodies) = {
        let mut world = cubes();
        world.bodies[0].effects.stretch = None;
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, SoftBodyPlugins::new(Update)));
        app.insert_resource(TimeUpdateStrategy::ManualDuration(tick_time()));
        app.add_systems(SolveSchedule, stall.in_set(SolvePhase::User));
        let (bodies, _) = plain::spawn(app.world_mut(), &world);
        clock(&mut app).budget = Some(Duration::from_micros(100));
        (app, bodies)
    };
    until_mid_tick(&mut app);
    app.world_mut().entity_mut(bodies[0]).insert(Stretch {
        compliance: Compliance::new(1e-4).expect("sound"),
        ..Stretch::default()
    });
    updates(&mut app, 60);
    assert!(clock(&mut app).tick() > 3);
}

#[derive(Resource, Default)]
struct Seen {
    ticks: Vec<(f64, f64)>,
    substeps: Vec<(f64, f64)>,
}

fn look_at_tick(time: Res<Time>, own: Res<Time<Tick>>, mut seen: ResMut<Seen>) {
    assert_eq!(time.elapsed(), own.elapsed());
    seen.ticks
        .push((time.delta_secs_f64(), time.elapsed_secs_f64()));
}

fn look_at_substep(time: Res<Time>, own: Res<Time<SubstepTime>>, mut seen: ResMut<Seen>) {
    assert_eq!(time.elapsed(), own.elapsed());
    seen.substeps
        .push((time.delta_secs_f64(), time.elapsed_secs_f64()));
}

#[test]
fn a_tick_and_a_substep_have_clocks_of_their_own() {
    let (mut app, ..) = app_of(&cubes());
    app.init_resource::<Seen>();
    app.add_systems(StepSchedule, look_at_tick.before(StepSystems::Wake));
    app.add_systems(
        SubstepSchedule,
        look_at_substep.before(SolverSystems::Presolve),
    );
    ticks(&mut app, 3);
    let seen = app.world().resource::<Seen>();
    assert_eq!((seen.ticks.len(), seen.substeps.len()), (3, 12));
    // Durations are whole nanoseconds.
    let near = |a: f64, b: f64| (a - b).abs() < 20e-9;
    for (n, (delta, elapsed)) in (1..).zip(&seen.ticks) {
        assert!(near(*delta, 1.0 / 60.0) && near(*elapsed, f64::from(n) / 60.0));
    }
    for (n, (delta, elapsed)) in (1..).zip(&seen.substeps) {
        assert!(near(*delta, 1.0 / 240.0) && near(*elapsed, f64::from(n) / 240.0));
    }
    let outside = app.world().resource::<Time>().elapsed();
    assert_eq!(outside, Duration::ZERO, "between ticks no clock runs");
}

#[derive(Resource, Default)]
struct Early(Vec<EndedEarly>);

#[test]
fn an_action_does_not_wait_for_the_end_of_a_long_tick() {
    let mut app = slow_app();
    app.init_resource::<Early>()
        .add_observer(|ended: On<EndedEarly>, mut early: ResMut<Early>| early.0.push(*ended));
    clock(&mut app).patience = Some(Duration::ZERO);
    until_mid_tick(&mut app);
    assert!(app.world().resource::<Early>().0.is_empty());
    let (tick, time) = (clock(&mut app).tick(), clock(&mut app).time());
    let action = Action::SetSetting {
        name: "substeps".to_owned(),
        value: 7.0,
    };
    app.world_mut().resource_mut::<Actions>().push(action);
    app.update();
    let substeps = app.world().resource::<SimulationSettings>().substeps;
    assert_eq!(substeps.get(), 7);
    assert_eq!(clock(&mut app).tick(), tick + 1);
    let [ended] = app.world().resource::<Early>().0[..] else {
        panic!("one tick ended early");
    };
    assert!(ended.tick == tick && (1..4).contains(&ended.substeps));
    // Four substeps per tick: the time is that of the substeps that were computed.
    let expected = time + f64::from(ended.substeps) / 240.0;
    assert!((clock(&mut app).time() - expected).abs() < 1e-12);
}

#[test]
fn without_patience_an_action_waits_for_the_whole_tick() {
    let mut app = slow_app();
    until_mid_tick(&mut app);
    let (tick, time) = (clock(&mut app).tick(), clock(&mut app).time());
    let action = Action::SetSetting {
        name: "substeps".to_owned(),
        value: 7.0,
    };
    app.world_mut().resource_mut::<Actions>().push(action);
    for _ in 0..100 {
        app.update();
        if app.world().resource::<SimulationSettings>().substeps.get() == 7 {
            break;
        }
    }
    assert_eq!(clock(&mut app).tick(), tick + 1);
    let passed = clock(&mut app).time() - time;
    assert!((passed - 1.0 / 60.0).abs() < 1e-12, "{passed} s");
}

/// An app in a schedule with frames of this length.
fn app_in(plugins: SoftBodyPlugins, fixed: f64, frame: Duration) -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, plugins));
    app.insert_resource(Time::<Fixed>::from_hz(fixed));
    app.insert_resource(TimeUpdateStrategy::ManualDuration(frame));
    app.finish();
    app.cleanup();
    let _entities = plain::spawn(app.world_mut(), &cubes());
    // No wall clock in what follows: ticks are cheap, but the machine may be busy.
    clock(&mut app).limit = None;
    app.update();
    app
}

/// What is drawn advances by a frame in each frame.
#[test]
fn drawing_between_ticks_is_even_at_any_frame_rate() {
    let in_frames = || SoftBodyPlugins::default();
    let in_fixed = || SoftBodyPlugins::new(FixedPostUpdate);
    for plugins in [in_frames as fn() -> SoftBodyPlugins, in_fixed] {
        for rate in [30.0, 60.0, 144.0] {
            let frame = Duration::from_secs_f64(1.0 / rate);
            let mut app = app_in(plugins(), 60.0, frame);
            updates(&mut app, 10);
            let drawn = |app: &mut App| {
                let clock = clock(app);
                clock.tick() as f64 + f64::from(clock.overstep())
            };
            let mut before = drawn(&mut app);
            for _ in 0..300 {
                app.update();
                let now = drawn(&mut app);
                let off = (now - before - 60.0 / rate).abs();
                // Fractions are in f32, and frames are whole nanoseconds.
                assert!(
                    off < 1e-5,
                    "{rate} frames per second: {before} to {now} ticks"
                );
                before = now;
            }
        }
    }
}

#[test]
fn simulated_time_follows_real_time_in_fixed_schedules_of_other_rates() {
    for fixed in [10.0, 64.0] {
        let frame = Duration::from_secs_f64(1.0 / 60.0);
        let mut app = app_in(SoftBodyPlugins::new(FixedPostUpdate), fixed, frame);
        updates(&mut app, 600);
        let behind = 10.0 - clock(&mut app).time();
        assert!(
            (-1e-9..1.0 / fixed + 2.0 / 60.0).contains(&behind),
            "at {fixed} Hz: {behind} s"
        );
        assert_eq!(clock(&mut app).dropped(), 0);
    }
}

/// A hitch is caught up as far as `catch_up` goes, and ticks that take long are not begun after the
/// limit.
#[test]
fn a_hitch_stays_short_and_slow_ticks_are_slow_motion() {
    let frame = Duration::from_secs_f64(1.0 / 60.0);
    for hitch in [0.25, 10.0] {
        let mut app = app_in(SoftBodyPlugins::default(), 64.0, frame);
        updates(&mut app, 60);
        let before = clock(&mut app).tick();
        app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs_f64(
            hitch,
        )));
        app.update();
        // Bevy shortens a frame to 0.25 s.
        let caught_up = clock(&mut app).tick() - before;
        assert!((14..=16).contains(&caught_up), "{caught_up} ticks");
    }
    let mut app = app_in(SoftBodyPlugins::default(), 64.0, frame * 6);
    clock(&mut app).limit = SimulationClock::default().limit;
    let sleep = || thread::sleep(Duration::from_millis(20));
    app.add_systems(StepSchedule, sleep.before(StepSystems::Wake));
    for _ in 0..10 {
        let before = clock(&mut app).tick();
        app.update();
        let done = clock(&mut app).tick() - before;
        // Three of 20 ms end after the limit of 50 ms; on a busy machine it is fewer.
        assert!((1..=3).contains(&done), "{done} ticks in a frame");
    }
    assert!(clock(&mut app).dropped() > 0, "the others are dropped");
}

/// Rates of a fixed schedule [Hz], and the time by which drawing is behind with 60 ticks per second [s].
const FIXED: [(f64, f64); 8] = [
    (10.0, 0.1),
    (20.0, 0.05),
    (30.0, 1.0 / 30.0),
    (50.0, 1.0 / 50.0 + 1.0 / 60.0),
    (60.0, 1.0 / 60.0),
    (64.0, 1.0 / 64.0 + 1.0 / 60.0),
    (120.0, 1.0 / 60.0),
    (240.0, 1.0 / 60.0),
];

/// A body that moves by 1 m/s along x, from 0, in a fixed schedule.
fn moving(fixed: f64, frame: Duration) -> (App, Entity) {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, SoftBodyPlugins::new(FixedPostUpdate)));
    app.insert_resource(Time::<Fixed>::from_hz(fixed));
    app.insert_resource(TimeUpdateStrategy::ManualDuration(frame));
    app.finish();
    app.cleanup();
    let mut cube = body("cube", cube(0.4, 1), 1000.0);
    cube.set_velocity(Vec3::X);
    let world = solver::World {
        settings: settings(0.0, 60.0, 4, 2),
        bodies: vec![cube],
        ..solver::World::default()
    };
    let (bodies, _) = plain::spawn(app.world_mut(), &world);
    clock(&mut app).limit = None;
    app.update();
    (app, bodies[0])
}

/// The drawn x of the middle of a body [m].
fn drawn_x(app: &App, body: Entity) -> f64 {
    let at = app.world().resource::<SimulationClock>().drawn();
    let body = app.world().entity(body);
    let (past, start, now) = body.components::<(&PastStarts, &TickStart, &Particles)>();
    let x = past.positions(at, start, now).map(|p| f64::from(p.x));
    x.sum::<f64>() / now.len() as f64
}

/// Time of the frames [s].
fn passed(app: &App) -> f64 {
    app.world().resource::<Time<Virtual>>().elapsed_secs_f64()
}

/// A body is drawn where it was a constant time ago, in every frame, also in that of a hitch, of which
/// Bevy makes up 0.25 s.
#[test]
fn drawing_is_even_in_fixed_schedules_of_any_rate() {
    for (fixed, latency) in FIXED {
        for rate in [30.0, 60.0, 144.0] {
            let frame = Duration::from_secs_f64(1.0 / rate);
            let (mut app, body) = moving(fixed, frame);
            let mut before = (0.0, 0.0);
            for number in 0..(4.0 * rate) as u32 {
                let real = match number {
                    60 => Duration::from_millis(250),
                    80 => Duration::from_secs(10),
                    _ => frame,
                };
                app.insert_resource(TimeUpdateStrategy::ManualDuration(real));
                let ticks = clock(&mut app).tick();
                app.update();
                let ticks = clock(&mut app).tick() - ticks;
                let what = format!("{fixed} Hz, {rate} frames per second, frame {number}");
                // Those of the frame, and of a step that had begun.
                let most = (real.as_secs_f64().min(0.25) + 1.0 / fixed) * 60.0 + 1.0;
                assert!(ticks as f64 <= most, "{what}: {ticks} ticks");
                let expected = (passed(&app) - latency).max(0.0);
                let x = drawn_x(&app, body);
                // The speed is rounded by up to 6e-8 in each of about 1000 substeps, which is 6e-5 of at
                // most 5 m, growing from 0.
                let off = (x - expected).abs();
                assert!(off < 1.5e-4, "{what}: {x} m, expected {expected} m");
                // That part of the longest frame, and 2.4e-7 m in each of four operations for two
                // frames. Without a frame of 1/144 s it is 7e-3 m.
                let off = (x - before.0 - (expected - before.1)).abs();
                assert!(off < 2e-5, "{what}: {off} m too much or too little");
                before = (x, expected);
            }
            assert_eq!(clock(&mut app).dropped(), 0, "{fixed} Hz, {rate}");
        }
    }
}

/// A speed at which ticks and steps of the schedule do not fit leaves nothing behind.
#[test]
fn drawing_is_even_after_the_speed_has_changed() {
    for (fixed, _) in FIXED {
        let frame = Duration::from_secs_f64(1.0 / 144.0);
        let (mut app, body) = moving(fixed, frame);
        for (speed, settle) in [(1.0, 50), (0.7, 50), (1.0, 50), (2.0, 50), (0.5, 100)] {
            clock(&mut app).speed = speed;
            // What is drawn is behind by another time at first.
            updates(&mut app, settle);
            let mut before = drawn_x(&app, body);
            for number in 0..100 {
                app.update();
                let x = drawn_x(&app, body);
                // As above, at up to 6 m.
                let off = (x - before - speed * frame.as_secs_f64()).abs();
                assert!(
                    off < 4e-6,
                    "{fixed} Hz, speed {speed}, frame {number}: {off} m"
                );
                before = x;
            }
        }
    }
}

/// A body that comes apart has particles in other places of the list, in the states before too.
#[test]
fn a_body_that_is_cut_is_drawn_where_it_was() {
    let frame = Duration::from_secs_f64(1.0 / 60.0);
    let (mut app, _) = moving(10.0, frame);
    let mut block = body("block", cube(0.4, 4), 1000.0);
    block.set_velocity(Vec3::X);
    let block = plain::spawn_body(app.world_mut(), &block);
    updates(&mut app, 60);
    let particles = |app: &App| app.world().get::<Particles>(block).expect("there").clone();
    let before = particles(&app).len();
    let cut = Cut {
        eye: Vec3::new(1.0, 9.0, 0.0),
        rays: [Vec3::new(-1.0, -1.0, -0.01), Vec3::new(1.0, -1.0, 0.01)],
    };
    app.world_mut()
        .resource_mut::<Actions>()
        .push(Action::Cut { body: block, cut });
    for _ in 0..12 {
        app.update();
        let at = app.world().resource::<SimulationClock>().drawn();
        let entity = app.world().entity(block);
        let (past, start, now) = entity.components::<(&PastStarts, &TickStart, &Particles)>();
        let drawn = past.positions(at, start, now);
        let off = drawn.zip(&now.positions).map(|(a, b)| a.distance(*b));
        let off = off.fold(0.0, f32::max);
        // What it moves in a step of the schedule and a tick; it is four cells of 0.1 m wide.
        assert!(off < 0.12, "{off} m");
    }
    assert!(particles(&app).len() > before, "it was cut");
}

/// States are kept where drawing needs them, and those of a body that is put elsewhere are not drawn.
#[test]
fn past_states_are_kept_only_for_drawing_and_end_with_the_state_they_led_to() {
    let frame = Duration::from_secs_f64(1.0 / 60.0);
    for (fixed, states) in [
        (10.0, 5),
        (30.0, 1),
        (50.0, 2),
        (60.0, 0),
        (64.0, 1),
        (240.0, 0),
    ] {
        let (mut app, body) = moving(fixed, frame);
        updates(&mut app, 60);
        let past = app.world().get::<PastStarts>(body).expect("a body");
        assert_eq!(past.len(), states, "{fixed} Hz");
    }
    let (mut app, body) = moving(10.0, frame);
    updates(&mut app, 60);
    let mut elsewhere = app.world().get::<Particles>(body).expect("a body").clone();
    for i in 0..elsewhere.len() {
        let x = elsewhere.position(i);
        elsewhere.set_position(i, x + bevy::math::DVec3::X * 7.0);
    }
    let start = app.world().get::<TickStart>(body).expect("a body").clone();
    app.world_mut().entity_mut(body).insert((elsewhere, start));
    assert!(
        app.world()
            .get::<PastStarts>(body)
            .expect("a body")
            .is_empty()
    );
}
