//! The reference overlay, without a window: it is the reference of its body at the same tick,
//! changes no bit of the simulation, restarts when necessary, and is removed completely.

use crate::{
    support::{self, cube, elastic, elastic_on_ground, settings, with, world},
    support_app::{cubes, systems},
};
use bevy::{prelude::*, time::TimeUpdateStrategy};
use pliant::{
    SoftBodyPlugins,
    sandbox::{
        lab::reference_overlay::{
            ReferenceCommand, ReferenceOverlay, ReferenceOverlayPlugin,
            bodies::{Moment, ReferenceBodies, Seen},
            pace::{LEAST, MOST, fitting},
        },
        state::selection::{Scope, Selection},
    },
    simulation::{
        Action, Actions, Asleep, SimulationClock, SimulationSettings, StepSchedule, plain,
        state_hash,
    },
    solver::{
        self, Collide, Collider, ColliderShape, Grab, ParticleIndex, Particles, Path, Pose,
        Settings, Substeps, SurfacePoint, VertexIndex, deform::Deformation, reference,
    },
    study::PROJECTIONS,
};
use std::{
    thread,
    time::{Duration, Instant},
};

/// An app with one tick per update, and its bodies.
fn app_of(world: &solver::World) -> (App, Vec<Entity>) {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, SoftBodyPlugins::new(PostUpdate)))
        .add_plugins(ReferenceOverlayPlugin)
        .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_nanos(
            1_000_000_000 / 60 + 1,
        )));
    app.finish();
    app.cleanup();
    let (bodies, _) = plain::spawn(app.world_mut(), world);
    // The first update has no elapsed time.
    app.update();
    (app, bodies)
}

fn command(app: &mut App, command: ReferenceCommand) {
    app.world_mut().write_message(command);
}

fn reference_overlay(app: &App) -> &ReferenceOverlay {
    app.world().resource::<ReferenceOverlay>()
}

fn tick(app: &App) -> u64 {
    app.world().resource::<SimulationClock>().tick()
}

/// An update, and time for the reference overlays to process it.
fn update(app: &mut App) {
    app.update();
    // A minute is a thousand times the usual duration.
    let started = Instant::now();
    while started.elapsed() < Duration::from_secs(60) {
        app.world_mut().resource_mut::<SimulationClock>().paused = true;
        app.update();
        app.world_mut().resource_mut::<SimulationClock>().paused = false;
        let wanted = tick(app);
        match app.world().get_resource::<ReferenceOverlay>() {
            Some(reference_overlay)
                if reference_overlay
                    .compared()
                    .is_none_or(|done| done.tick < wanted) =>
            {
                thread::sleep(Duration::from_millis(1));
            }
            _ => return,
        }
    }
    panic!("the reference_overlay has not come to tick {}", tick(app));
}

fn updates(app: &mut App, count: usize) {
    (0..count).for_each(|_| update(app));
}

/// The bodies that have a reference overlay.
fn followed(app: &App) -> Vec<Entity> {
    let compared = reference_overlay(app).compared().expect("it was compared");
    let mut bodies: Vec<_> = compared.gaps.iter().map(|(body, _)| *body).collect();
    bodies.sort_unstable();
    bodies
}

fn push(app: &mut App, action: Action) {
    app.world_mut().resource_mut::<Actions>().push(action);
}

/// The same bits with and without: a reference overlay only reads.
#[test]
fn a_reference_overlay_changes_no_bit_of_the_simulation() {
    let mut expected = cubes();
    let (mut app, _) = app_of(&expected);
    command(&mut app, ReferenceCommand::Toggle);
    while tick(&app) < 90 {
        update(&mut app);
    }
    assert!(
        reference_overlay(&app)
            .compared()
            .expect("there")
            .distance
            .largest
            > 0.0
    );
    (0..90).for_each(|_| expected.tick());
    assert_eq!(state_hash(app.world_mut()), expected.state_hash());
}

/// A world with a grab, a slider that is moved, a pin and a moving collider, by tick.
fn eventful() -> solver::World {
    let effects = solver::Effects {
        collide: Some(Collide::default()),
        ..elastic_on_ground()
    };
    let mut world = world(
        settings(9.81, 60.0, 3, 2),
        with(support::body("cube", cube(0.4, 2), 1000.0), effects),
    );
    world.bodies[0].translate(Vec3::new(0.0, 0.5, 0.0));
    let path = Path::Oscillate {
        travel: Vec3::new(0.6, 0.0, 0.0),
        period: 1.0,
    };
    let start = Pose::at(Vec3::new(-0.5, 0.3, 0.0).as_dvec3());
    let ball = ColliderShape::Sphere { radius: 0.1 };
    world.colliders = vec![Collider::moving(ball, start, path).expect("sound")];
    world
}

fn happen(world: &mut solver::World, tick: u64) {
    let body = &mut world.bodies[0];
    match tick {
        5 => {
            let point = SurfacePoint::new(&[(ParticleIndex(0), 1.0)]).expect("sound");
            let target = body.particles.positions[0].truncate();
            body.effects.grab = Some(Grab::on(point, target, 64.0, 0.7, 9.81));
        }
        6..20 => {
            if let Some(grab) = &mut body.effects.grab {
                grab.target += Vec3::new(0.01, 0.02, 0.0);
            }
        }
        20 => body.effects.grab = None,
        22 => body.effects.stretch = support::stretch(1e-4),
        25 => {
            body.pins = [3].map(VertexIndex).to_vec();
            body.update_masses();
        }
        30 => {
            world.settings.substeps = Substeps::new(5).expect("sound");
        }
        _ => {}
    }
}

/// Eight times the substeps.
fn finer(settings: &Settings) -> Settings {
    let substeps = Substeps::new(8 * settings.substeps.get()).expect("sound");
    Settings {
        substeps,
        ..*settings
    }
}

#[test]
fn a_reference_overlay_is_the_reference_under_the_same_grab_sliders_pins_and_colliders() {
    let mut fast = eventful();
    let body = Entity::from_raw_u32(1).expect("a number");
    let mut reference_overlays = ReferenceBodies::begin(&fast, &[body], finer(&fast.settings));
    let mut fine = fast.clone();
    fine.settings = finer(&fast.settings);
    let mut reference = reference::World::of(&fine);
    reference.project(PROJECTIONS);
    for tick in 1..=60 {
        happen(&mut fast, tick);
        // A reference created from the body, except for the state.
        let fresh = reference::Body::of(&fast.bodies[0]);
        let old = std::mem::replace(&mut reference.bodies[0], fresh);
        let now = &mut reference.bodies[0];
        (now.x, now.p, now.v) = (old.x, old.p, old.v);
        reference.settings = finer(&fast.settings);
        reference.tick();
        // The effects in force are recorded before the tick: at its end the grab has reached its
        // target.
        let effects = fast.bodies[0].effects;
        fast.tick();
        let moment = Moment {
            tick,
            settings: fast.settings,
            colliders: fast.colliders.clone(),
            room: 1.0,
            bodies: vec![Seen {
                body,
                effects,
                positions: fast.bodies[0].particles.positions.clone(),
                asleep: false,
            }],
        };
        let finer = finer(&fast.settings);
        assert!(reference_overlays.follow(&moment, finer));
        let comparison = reference_overlays.compare(tick, finer.substeps.get(), &moment.bodies);
        let (_, gaps) = &comparison.gaps[0];
        let places = reference.bodies[0]
            .x
            .iter()
            .zip(&moment.bodies[0].positions);
        for (gap, (reference, x)) in gaps.iter().zip(places) {
            // The same operations in the same order: the same bits.
            assert_eq!(
                *gap,
                (*reference - x.truncate().as_dvec3()).as_vec3(),
                "{tick}"
            );
        }
        if tick == 60 {
            assert!(comparison.distance.rms > 0.0);
        }
    }
}

/// Distance to the reference overlay after half a second of a fall and a landing.
fn rms(substeps: u32) -> f64 {
    let body = with(
        support::body("cube", cube(0.4, 2), 1000.0),
        elastic_on_ground(),
    );
    let mut fast = world(settings(9.81, 60.0, substeps, 1), body);
    fast.bodies[0].effects.stretch = support::stretch(1e-3);
    fast.bodies[0].translate(Vec3::new(0.0, 0.3, 0.0));
    let body = Entity::from_raw_u32(1).expect("a number");
    let fine = Settings {
        substeps: Substeps::new(256).expect("sound"),
        ..fast.settings
    };
    let mut reference_overlays = ReferenceBodies::begin(&fast, &[body], fine);
    let mut moment = Moment {
        tick: 0,
        settings: fast.settings,
        colliders: Vec::new(),
        room: 1.0,
        bodies: Vec::new(),
    };
    for _ in 0..30 {
        fast.tick();
        moment.bodies = vec![Seen {
            body,
            effects: fast.bodies[0].effects,
            positions: fast.bodies[0].particles.positions.clone(),
            asleep: false,
        }];
        reference_overlays.follow(&moment, fine);
    }
    reference_overlays
        .compare(30, 256, &moment.bodies)
        .distance
        .rms
}

#[test]
fn a_body_with_more_substeps_is_nearer_to_its_reference_overlay() {
    let (coarse, fine) = (rms(2), rms(16));
    assert!(fine < coarse / 2.0, "{coarse} m, {fine} m");
}

#[test]
fn while_there_is_no_reference_overlay_there_is_no_system_and_nothing_is_kept() {
    let (mut app, _) = app_of(&cubes());
    updates(&mut app, 3);
    let before = systems(&app, StepSchedule).len();
    for _ in 0..2 {
        command(&mut app, ReferenceCommand::Toggle);
        updates(&mut app, 3);
        assert_eq!(systems(&app, StepSchedule).len(), before + 1);
        assert_eq!(followed(&app).len(), 2);
        command(&mut app, ReferenceCommand::Toggle);
        updates(&mut app, 3);
        assert_eq!(systems(&app, StepSchedule).len(), before);
        assert!(!app.world().contains_resource::<ReferenceOverlay>());
        assert!(!app.world().resource::<SimulationClock>().held);
    }
}

#[test]
fn deforming_a_body_restarts_its_reference_overlay() {
    let (mut app, bodies) = app_of(&cubes());
    command(&mut app, ReferenceCommand::Toggle);
    updates(&mut app, 20);
    assert!(reference_overlay(&app).trail().iter().len() >= 20);
    push(
        &mut app,
        Action::Deform {
            body: bodies[0],
            deformation: Deformation::Squash(0.5),
        },
    );
    updates(&mut app, 2);
    let len = reference_overlay(&app).trail().iter().len();
    assert!((1..=3).contains(&len), "{len} ticks are on the plot");
}

#[test]
fn moving_a_body_between_ticks_restarts_its_reference_overlay() {
    let (mut app, bodies) = app_of(&cubes());
    command(&mut app, ReferenceCommand::Toggle);
    updates(&mut app, 20);
    let mut particles = app.world_mut().get_mut::<Particles>(bodies[1]);
    for x in &mut particles.as_mut().expect("a body").positions {
        x.x += 1.0;
    }
    updates(&mut app, 2);
    let reference_overlay = reference_overlay(&app);
    assert!(reference_overlay.trail().iter().len() <= 3);
    let distance = reference_overlay.compared().expect("there").distance;
    assert!(distance.largest < 0.5, "it came along: {distance:?}");
}

#[test]
fn reference_overlays_are_added_and_removed_with_their_bodies() {
    let (mut app, bodies) = app_of(&cubes());
    command(&mut app, ReferenceCommand::Toggle);
    updates(&mut app, 5);
    let mut all = bodies.clone();
    all.sort_unstable();
    assert_eq!(followed(&app), all);
    push(&mut app, Action::Despawn { body: bodies[0] });
    updates(&mut app, 5);
    assert_eq!(followed(&app), bodies[1..]);
    let third = cubes().bodies.remove(0);
    let third = plain::spawn_body(app.world_mut(), &third);
    updates(&mut app, 5);
    let mut wanted = vec![bodies[1], third];
    wanted.sort_unstable();
    assert_eq!(followed(&app), wanted);
}

#[test]
fn a_body_that_is_chosen_has_the_reference_overlay_alone() {
    let (mut app, bodies) = app_of(&cubes());
    app.world_mut().resource_mut::<Selection>().0 = Scope::body(bodies[1]);
    command(&mut app, ReferenceCommand::Toggle);
    updates(&mut app, 5);
    assert_eq!(followed(&app), bodies[1..]);
    app.world_mut().resource_mut::<Selection>().0 = Scope::body(bodies[0]);
    updates(&mut app, 5);
    assert_eq!(followed(&app), bodies[..1], "another is chosen");
}

#[test]
fn a_body_in_quarantine_loses_its_reference_overlay_and_the_others_keep_theirs() {
    let (mut app, bodies) = app_of(&cubes());
    command(&mut app, ReferenceCommand::Toggle);
    updates(&mut app, 10);
    let mut particles = app.world_mut().get_mut::<Particles>(bodies[0]);
    particles.as_mut().expect("a body").displacements[0].x = f32::NAN;
    updates(&mut app, 5);
    assert_eq!(followed(&app), bodies[1..]);
    let reference_overlay = reference_overlay(&app);
    assert!(
        reference_overlay.trail().iter().len() >= 15,
        "it did not begin again"
    );
    let distance = reference_overlay.compared().expect("there").distance;
    assert!(distance.largest.is_finite(), "{distance:?}");
}

#[test]
fn a_reference_overlay_of_a_sleeping_body_comes_to_rest_too_and_is_stepped_no_more() {
    let mut fast = world(
        settings(9.81, 60.0, 4, 1),
        with(support::body("cube", cube(0.4, 1), 1000.0), elastic()),
    );
    fast.sleep.enabled = true;
    fast.settings
        .set_gravity(Vec3::ZERO)
        .expect("a sound gravity");
    let (mut app, bodies) = app_of(&fast);
    command(&mut app, ReferenceCommand::Toggle);
    // At rest from the start: it sleeps after half a second, and so does its reference overlay.
    updates(&mut app, 60);
    assert!(app.world().entity(bodies[0]).contains::<Asleep>());
    let compared = reference_overlay(&app).compared().expect("there");
    assert_eq!(compared.tick, tick(&app), "it is compared all the same");

    let body = Entity::from_raw_u32(1).expect("a number");
    let mut reference_overlays = ReferenceBodies::begin(&fast, &[body], fast.settings);
    let moment = Moment {
        tick: 0,
        settings: fast.settings,
        colliders: Vec::new(),
        room: 1.0,
        bodies: vec![Seen {
            body,
            effects: fast.bodies[0].effects,
            positions: fast.bodies[0].particles.positions.clone(),
            asleep: true,
        }],
    };
    let stepped = (0..60).filter(|_| reference_overlays.follow(&moment, fast.settings));
    // Half a second at 60 ticks per second, and one for rounding.
    assert!((30..=31).contains(&stepped.count()));
}

#[test]
fn bodies_wait_for_reference_overlays_that_do_not_keep_pace() {
    // 1331 particles and 80 substeps of the reference overlay: tens of milliseconds per tick.
    let heavy = world(
        settings(9.81, 60.0, 20, 1),
        with(support::body("cube", cube(0.4, 10), 1000.0), elastic()),
    );
    let (mut app, _) = app_of(&heavy);
    command(&mut app, ReferenceCommand::Toggle);
    let mut held = 0;
    for _ in 0..200 {
        app.update();
        let done = reference_overlay(&app)
            .compared()
            .map_or(0, |done| done.tick);
        // One that may be in progress, and the maximum of an update within a quarter of a second.
        let most = 1 + 16;
        assert!(tick(&app) - done <= most, "{} and {done}", tick(&app));
        held += usize::from(app.world().resource::<SimulationClock>().held);
    }
    assert!(held > 100, "held in {held} of 200 updates");
    assert!(reference_overlay(&app).holds());
}

#[test]
fn the_work_budget_limits_the_number_of_reference_overlays() {
    let world = cubes();
    let (all, seconds) = fitting(&world, 1e9);
    assert_eq!(all, 2);
    assert!(seconds > 0.0);
    assert_eq!(fitting(&world, 0.0).0, 1, "the first always has one");
}

#[test]
fn the_reference_overlay_has_many_times_the_substeps_of_its_body() {
    let (mut app, _) = app_of(&cubes());
    command(&mut app, ReferenceCommand::Toggle);
    updates(&mut app, 5);
    let of = app.world().resource::<SimulationSettings>().substeps.get();
    let times = reference_overlay(&app).compared().expect("there").substeps / of;
    assert!(times.is_power_of_two() && (LEAST..=MOST).contains(&times));
}
