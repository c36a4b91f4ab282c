//! A body that diverges is quarantined and reported, and the others are not affected.

use crate::{
    support::{bits, state_bits},
    support_app::{app_of, cubes, ticks},
};
use bevy::{ecs::message::Messages, math::DVec3, prelude::*};
use pliant::{
    simulation::{
        BodyQuarantined, Quarantined, SimulationSettings, SolvePhase, SolveSchedule, plain,
    },
    solver::{
        Collider, ColliderShape, Grab, ParticleIndex, Particles, Pose, Quarantine, SurfacePoint,
        VertexIndex, World,
    },
};

/// Corrupts a body before tick 30 of 60.
fn spoilt(spoil: impl Fn(&mut Particles)) -> (App, Vec<Entity>, Particles) {
    let (mut app, bodies, _) = app_of(&cubes());
    ticks(&mut app, 30);
    let last_finite = particles(&app, bodies[0]).clone();
    spoil(
        &mut app
            .world_mut()
            .get_mut::<Particles>(bodies[0])
            .expect("a body"),
    );
    ticks(&mut app, 30);
    (app, bodies, last_finite)
}

fn particles(app: &App, body: Entity) -> &Particles {
    app.world().get::<Particles>(body).expect("a body")
}

fn quarantine(app: &App, body: Entity) -> Option<&Quarantine> {
    app.world()
        .get::<Quarantined>(body)
        .map(|quarantined| &quarantined.0)
}

fn messages(app: &mut App) -> Vec<String> {
    app.world_mut()
        .resource_mut::<Messages<BodyQuarantined>>()
        .drain()
        .map(|message| message.text)
        .collect()
}

/// The second cube after the same time without the first.
fn undisturbed() -> World {
    let mut world = cubes();
    world.bodies.remove(0);
    (0..60).for_each(|_| world.tick());
    world
}

#[track_caller]
fn assert_other_undisturbed(app: &App, other: Entity) {
    let expected = undisturbed();
    let (state, expected) = (particles(app, other), &expected.bodies[0].particles);
    assert_eq!(state_bits(state), state_bits(expected));
    assert!(quarantine(app, other).is_none());
}

#[test]
fn a_nan_written_into_a_position_quarantines_that_body_alone_and_names_it() {
    let (mut app, bodies, last_finite) = spoilt(|particles| particles.positions[3].y = f32::NAN);
    let expected = Quarantine::new(VertexIndex(3), "input");
    assert_eq!(quarantine(&app, bodies[0]), Some(&expected));
    let frozen = particles(&app, bodies[0]);
    // At the start of the last finite tick, and at rest.
    assert!(frozen.first_not_finite().is_none());
    assert!(frozen.is_still());
    let farthest = frozen
        .positions
        .iter()
        .zip(&last_finite.positions)
        .map(|(a, b)| a.distance(*b))
        .fold(0.0, f32::max);
    // A sixtieth of a second at less than 4 m/s.
    assert!(farthest < 0.07, "frozen {farthest} m from where it was");
    let messages = messages(&mut app);
    assert_eq!(messages.len(), 1, "{messages:?}");
    for word in ["dropped", "vertex 3", "input"] {
        assert!(messages[0].contains(word), "{}", messages[0]);
    }
    assert_other_undisturbed(&app, bodies[1]);
}

#[test]
fn infinite_velocities_are_caught_like_positions() {
    let (app, bodies, _) = spoilt(|particles| particles.displacements[5].x = f32::INFINITY);
    let expected = Quarantine::new(VertexIndex(5), "input");
    assert_eq!(quarantine(&app, bodies[0]), Some(&expected));
    assert_other_undisturbed(&app, bodies[1]);
}

#[test]
fn the_stage_that_overflowed_is_named_by_its_effect() {
    // Each number is finite; results computed from them are not.
    type Spoil = fn(&mut Particles);
    let fast: Spoil = |particles| {
        let v = particles.velocity(2);
        particles.set_velocity(2, v.with_y(f32::MAX));
    };
    let far: Spoil = |particles| particles.positions[2].x = 1e30;
    for (spoil, stage) in [(fast, "stretch"), (far, "stretch")] {
        let (mut app, bodies, _) = spoilt(spoil);
        let found = quarantine(&app, bodies[0]).expect("it overflows").clone();
        assert_eq!(found.stage, stage);
        let messages = messages(&mut app);
        assert!(messages[0].contains(stage), "{}", messages[0]);
        assert!(particles(&app, bodies[0]).first_not_finite().is_none());
        assert_other_undisturbed(&app, bodies[1]);
    }
}

#[test]
fn a_volume_that_overflows_is_named() {
    let mut world = cubes();
    world.bodies[0].effects.stretch = None;
    // Products of two lengths overflow.
    for x in &mut world.bodies[0].particles.positions {
        *x *= Vec4::new(1e20, 1e20, 1e20, 1.0);
    }
    let (mut app, bodies, _) = app_of(&world);
    ticks(&mut app, 1);
    let found = quarantine(&app, bodies[0]).expect("its gradients overflow");
    assert_eq!(found.stage, "volume");
    world.tick();
    assert_eq!(
        world.bodies[0].quarantine.as_ref(),
        Some(found),
        "with Bevy and without"
    );
}

#[test]
fn a_users_system_that_writes_nan_is_named_as_such() {
    fn spoil(mut bodies: Query<&mut Particles>) {
        for mut particles in &mut bodies {
            if particles.positions[0].x < 1.0 {
                particles.positions[0].z = f32::NAN;
            }
        }
    }
    let (mut app, bodies, _) = app_of(&cubes());
    app.add_systems(SolveSchedule, spoil.in_set(SolvePhase::User));
    ticks(&mut app, 60);
    let expected = Quarantine::new(VertexIndex(0), "a user's system");
    assert_eq!(quarantine(&app, bodies[0]), Some(&expected));
    assert_other_undisturbed(&app, bodies[1]);
}

#[test]
fn a_body_in_quarantine_stays_there_to_the_bit_whatever_pulls_at_it() {
    let (mut app, bodies, _) = spoilt(|particles| particles.positions[0].x = f32::NAN);
    let frozen = bits(&particles(&app, bodies[0]).positions);
    let point = SurfacePoint::new(&[(ParticleIndex(0), 1.0)]).expect("sound");
    let grab = Grab::on(point, Vec3::splat(9.0), 1.0, 1.0, 9.81);
    app.world_mut().entity_mut(bodies[0]).insert(grab);
    ticks(&mut app, 30);
    assert_eq!(bits(&particles(&app, bodies[0]).positions), frozen);
}

#[test]
fn the_plain_world_quarantines_the_same_bodies_with_the_same_words() {
    let mut world = cubes();
    let (mut app, bodies, _) = app_of(&world);
    (0..10).for_each(|_| world.tick());
    ticks(&mut app, 10);
    for particles in [
        &mut world.bodies[0].particles,
        &mut *app
            .world_mut()
            .get_mut::<Particles>(bodies[0])
            .expect("a body"),
    ] {
        particles.positions[7].z = f32::NEG_INFINITY;
    }
    (0..10).for_each(|_| world.tick());
    ticks(&mut app, 10);
    assert_eq!(
        quarantine(&app, bodies[0]),
        world.bodies[0].quarantine.as_ref()
    );
    let captured = plain::capture(app.world_mut());
    assert_eq!(captured.state_hash(), world.state_hash());
}

#[test]
fn a_column_that_is_too_short_or_too_long_quarantines_that_body_alone() {
    type Column = fn(&mut Particles) -> &mut Vec<Vec4>;
    let columns: [Column; 3] = [
        |it| &mut it.positions,
        |it| &mut it.displacements,
        |it| &mut it.carry,
    ];
    for column in columns {
        for is_short in [true, false] {
            let spoil = |particles: &mut Particles| {
                if is_short {
                    column(particles).pop();
                } else {
                    column(particles).push(Vec4::ONE);
                }
            };
            let (app, bodies, before) = spoilt(spoil);
            let found = quarantine(&app, bodies[0]).expect("it cannot be stepped");
            assert_eq!(found.stage, "input");
            let after = particles(&app, bodies[0]);
            assert_eq!(after.positions.len(), before.positions.len());
            assert_eq!(after.first_unfit(before.len()), None);
            assert_other_undisturbed(&app, bodies[1]);
            let mut world = cubes();
            (0..30).for_each(|_| world.tick());
            spoil(&mut world.bodies[0].particles);
            world.tick();
            assert_eq!(
                world.bodies[0].quarantine.as_ref(),
                Some(found),
                "with Bevy and without"
            );
        }
    }
}

#[test]
fn gravity_that_is_not_finite_leaves_the_last_one_in_force() {
    let run = |gravity: Option<f32>| {
        let (mut app, ..) = app_of(&cubes());
        ticks(&mut app, 10);
        if let Some(gravity) = gravity {
            let mut settings = app.world_mut().resource_mut::<SimulationSettings>();
            settings.0.gravity.y = gravity;
        }
        ticks(&mut app, 10);
        plain::capture(app.world_mut()).state_hash()
    };
    let expected = run(None);
    assert_eq!(run(Some(f32::NAN)), expected);
    assert_eq!(run(Some(f32::INFINITY)), expected);
}

#[test]
fn a_collider_that_is_nowhere_touches_nothing() {
    let run = |collider: Option<DVec3>| {
        let (mut app, ..) = app_of(&cubes());
        if let Some(place) = collider {
            let ball = ColliderShape::Sphere { radius: 1.0 };
            let mut collider = Collider::new(ball, Pose::default()).expect("sound");
            collider.start.translation = place;
            app.world_mut().spawn(collider);
        }
        ticks(&mut app, 20);
        plain::capture(app.world_mut())
    };
    let mut without = run(None);
    let mut nowhere = run(Some(DVec3::new(0.0, f64::NAN, 0.0)));
    nowhere.colliders.clear();
    without.colliders.clear();
    assert_eq!(nowhere.state_hash(), without.state_hash());
    let nan = Pose::at(DVec3::NAN);
    let ball = ColliderShape::Sphere { radius: 1.0 };
    let error = Collider::new(ball, nan).expect_err("no place").to_string();
    assert!(error.contains("position"), "{error}");
}
