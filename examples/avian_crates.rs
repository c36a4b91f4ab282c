//! Rigid bodies of `avian3d` on soft ones: a crate on a jelly, a ball on a cloth.
//! `cargo run --release --example avian_crates --features avian`

use avian3d::prelude::*;
use bevy::{prelude::*, time::TimeUpdateStrategy};
use pliant::{avian::AvianPlugin, prelude::*, solver::Damping};
use std::time::Duration;

fn main() {
    let step = TimeUpdateStrategy::ManualDuration(Duration::from_secs_f64(1.0 / 60.0));
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin, PhysicsPlugins::default()))
        .add_plugins((
            SoftBodyPlugins::new(FixedPostUpdate),
            AvianPlugin::default(),
        ))
        .insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(step)
        .add_systems(Startup, setup)
        .add_systems(Update, report);
    app.finish();
    (0..240).for_each(|_| app.update());
}

fn setup(mut commands: Commands) {
    commands.spawn((
        SoftBody::cuboid(Vec3::new(0.6, 0.3, 0.6), UVec3::new(6, 3, 6)) // m
            .at(Vec3::Y * 0.15)
            .build(),
        Stretch {
            compliance: Compliance::of(1e-5), // m/N
            damping: Damping::of(0.05),       // s
            ..default()
        },
        Volume::default(),
        Ground::default(),
        Contact::default(),
    ));
    commands.spawn((
        SoftBody::cloth(Vec2::ONE, UVec2::splat(16)) // m
            .at(Vec3::new(1.5, 0.6, 0.0))
            .pinned([0, 16, 272, 288])
            .build(),
        Stretch::default(),
        Contact::default(),
    ));
    let density = ColliderDensity(300.0); // kg/m³
    let cube = Collider::cuboid(0.3, 0.3, 0.3); // m
    let ball = Collider::sphere(0.1);
    for (x, shape) in [(0.0, cube), (1.5, ball)] {
        let place = Transform::from_xyz(x, 0.8, 0.0);
        commands.spawn((RigidBody::Dynamic, shape, density, place));
    }
}

fn report(bodies: Query<(&Position, &LinearVelocity)>, mut frame: Local<u32>) {
    *frame += 1;
    if frame.is_multiple_of(60) {
        for (name, (x, v)) in ["crate", "ball"].iter().zip(&bodies) {
            println!("{name} at {:.3} m, {:.3} m/s", x.y, v.length()); // every second
        }
    }
}
