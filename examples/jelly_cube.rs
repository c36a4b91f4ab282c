//! A jelly cube falls onto the ground, in a Bevy app of one's own: `cargo run --release --example jelly_cube`

use bevy::prelude::*;
use pliant::{mesh::Primitive, prelude::*, render::SoftBodyMeshPlugin};
use std::sync::Arc;

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
) -> Result {
    let cube = Primitive::Box {
        size: Vec3::splat(1.0), // m
        cells: UVec3::splat(5),
    };
    let mut shape = cube.build()?.shape;
    for vertex in &mut shape.vertices {
        *vertex = Quat::from_rotation_z(0.4) * *vertex + Vec3::Y * 2.0;
    }
    commands.spawn((
        SoftBody(Arc::new(Topology::new(shape)?)),
        BodyDensity(Density::new(1000.0)?), // kg/m³
        Stretch {
            compliance: Compliance::new(1e-4)?, // m/N
            damping: Damping::new(0.02)?,       // s
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
    Ok(())
}
