//! Coupling with the rigid bodies of avian3d.

use avian3d::prelude::{
    self as avian, Gravity, LinearVelocity, PhysicsPlugins, Position, RigidBody,
};
use bevy::{math::DVec3, prelude::*, time::TimeUpdateStrategy};
use pliant::{
    avian::AvianPlugin,
    prelude::*,
    simulation::SimulationSettings,
    solver::{Collider, Damping, measure},
};
use std::time::Duration;

fn app(gravity: f32) -> App {
    let mut app = App::new();
    let mut settings = SimulationSettings::default();
    settings
        .0
        .set_gravity(Vec3::NEG_Y * gravity)
        .expect("sound");
    let tick = Duration::from_secs_f64(1.0 / 60.0);
    app.add_plugins((MinimalPlugins, TransformPlugin))
        .add_plugins(PhysicsPlugins::default())
        .add_plugins((
            SoftBodyPlugins::new(FixedPostUpdate),
            AvianPlugin::default(),
        ))
        .insert_resource(settings)
        .insert_resource(Gravity(Vec3::NEG_Y * gravity))
        .insert_resource(Time::<Fixed>::from_duration(tick))
        .insert_resource(TimeUpdateStrategy::ManualDuration(tick));
    app.finish();
    app
}

fn jelly(at: Vec3) -> impl Bundle {
    (
        SoftBody::cuboid(Vec3::new(0.6, 0.3, 0.6), UVec3::new(6, 3, 6))
            .at(at)
            .build(),
        Stretch {
            compliance: Compliance::of(1e-5),
            damping: Damping::of(0.05),
            ..default()
        },
        Volume::default(),
        Contact::default(),
    )
}

fn block(at: Vec3, velocity: Vec3) -> impl Bundle {
    (
        RigidBody::Dynamic,
        avian::Collider::cuboid(0.3, 0.3, 0.3),
        avian::ColliderDensity(300.0),
        Transform::from_translation(at),
        LinearVelocity(velocity),
    )
}

fn momentum(app: &mut App, mass: f64) -> DVec3 {
    let world = app.world_mut();
    let mut soft = world.query_filtered::<&Particles, With<Stretch>>();
    let soft: DVec3 = soft.iter(world).map(measure::momentum).sum();
    let mut rigid = world.query_filtered::<&LinearVelocity, With<RigidBody>>();
    soft + rigid
        .iter(world)
        .map(|it| it.0.as_dvec3() * mass)
        .sum::<DVec3>()
}

/// A crate of 8 kg falls 0.2 m on a jelly and comes to rest: between 3 s and 4 s it moves by less
/// than a tenth of its contact's thickness, and its speed is below what gravity adds in a substep,
/// 0.016 m/s.
#[test]
fn a_crate_comes_to_rest_on_a_jelly() {
    let mut app = app(9.81);
    app.world_mut()
        .spawn((jelly(Vec3::Y * 0.15), Ground::default()));
    let body = app
        .world_mut()
        .spawn(block(Vec3::Y * 0.65, Vec3::ZERO))
        .id();
    (0..180).for_each(|_| app.update());
    let position = |app: &App| app.world().get::<Position>(body).expect("stepped").0;
    let before = position(&app);
    assert!((0.4..0.5).contains(&before.y), "{before} m");
    (0..60).for_each(|_| app.update());
    let moved = position(&app).distance(before);
    assert!(moved < 5e-4, "{moved} m");
    let speed = app
        .world()
        .get::<LinearVelocity>(body)
        .expect("stepped")
        .length();
    assert!(speed < 0.016, "{speed} m/s");
}

/// Without gravity, a block of 8.1 kg hits a jelly of 108 kg at 2 m/s, off its center: the sum of
/// their momenta stays. Velocities of 108 kg are rounded to 6e-8 of some 0.3 m/s; the rest is
/// rounding of positions in ten substeps per tick, 1e-7 m of 1/600 s each, over 60 ticks.
#[test]
fn an_impact_conserves_momentum() {
    let mut app = app(0.0);
    app.world_mut().spawn(jelly(Vec3::ZERO));
    let start = Vec3::new(0.1, 0.5, 0.05);
    let body = app.world_mut().spawn(block(start, Vec3::NEG_Y * 2.0)).id();
    let mass = 8.1;
    let before = DVec3::NEG_Y * 2.0 * mass;
    (0..60).for_each(|_| app.update());
    let velocity = app.world().get::<LinearVelocity>(body).expect("stepped").0;
    assert!(velocity.y > -1.0, "it was stopped: {velocity} m/s");
    let after = momentum(&mut app, mass);
    let error = after.distance(before) / before.length();
    assert!(error < 1e-3, "{after} after {before} kg·m/s");
}

/// A static floor of Avian's holds a soft body; where it is moved away, the body falls.
#[test]
fn a_static_body_holds_a_soft_one_until_it_is_despawned() {
    let mut app = app(9.81);
    let floor = (
        RigidBody::Static,
        avian::Collider::cuboid(4.0, 0.2, 4.0),
        Transform::from_xyz(0.0, -0.1, 0.0),
    );
    let floor = app.world_mut().spawn(floor).id();
    let body = app
        .world_mut()
        .spawn((jelly(Vec3::Y * 0.2), Collide::default()))
        .id();
    (0..120).for_each(|_| app.update());
    let lowest = |app: &App| {
        let particles = app.world().get::<Particles>(body).expect("a body");
        let heights = particles.positions.iter().map(|x| x.y);
        heights.fold(f32::INFINITY, f32::min)
    };
    assert!((0.0..0.03).contains(&lowest(&app)), "{} m", lowest(&app));
    app.world_mut().despawn(floor);
    (0..60).for_each(|_| app.update());
    assert!(lowest(&app) < -1.0, "{} m", lowest(&app));
}

/// A half-space has no surface: a warning, and nothing else.
#[test]
fn a_collider_without_a_surface_is_left_out() {
    let mut app = app(9.81);
    app.world_mut().spawn((
        RigidBody::Static,
        avian::Collider::half_space(Vec3::Y),
        Transform::default(),
    ));
    app.world_mut()
        .spawn((jelly(Vec3::Y * 0.15), Ground::default()));
    (0..5).for_each(|_| app.update());
    let world = app.world_mut();
    assert_eq!(world.query::<&Collider>().iter(world).count(), 0);
}
