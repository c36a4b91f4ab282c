//! A jelly cube falls onto the ground, in a Bevy app: `cargo run --release --example jelly_cube`

use bevy::prelude::*;
use pliant::{prelude::*, render::SoftBodyMeshPlugin, solver::Damping};

fn main() -> AppExit {
    App::new()
        .add_plugins((
            DefaultPlugins,
            SoftBodyPlugins::default(),
            SoftBodyMeshPlugin,
        ))
        .add_systems(Startup, setup)
        .run()
}

fn setup(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let cube = SoftBody::cuboid(Vec3::ONE, UVec3::splat(5)); // m
    commands.spawn((
        cube.rotated(Quat::from_rotation_z(0.4))
            .at(Vec3::Y * 2.0)
            .build(),
        Stretch {
            compliance: Compliance::of(1e-4), // m/N
            damping: Damping::of(0.02),       // s
            ..default()
        },
        Volume::default(),
        Ground::default(),
        MeshMaterial3d(materials.add(Color::srgb(0.9, 0.3, 0.2))),
    ));
    commands.spawn((
        Mesh3d(meshes.add(Plane3d::default().mesh().size(10.0, 10.0))),
        MeshMaterial3d(materials.add(Color::srgb(0.6, 0.6, 0.6))),
    ));
    commands.spawn((
        DirectionalLight {
            shadow_maps_enabled: true,
            ..default()
        },
        Transform::from_xyz(2.0, 5.0, 3.0).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    commands.spawn((
        Camera3d::default(),
        Transform::from_xyz(0.0, 2.0, 5.0).looking_at(Vec3::Y * 0.7, Vec3::Y),
    ));
}
