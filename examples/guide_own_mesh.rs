//! A mesh file as a soft body, in a Bevy app: `cargo run --release --example guide_own_mesh`

use bevy::prelude::*;
use pliant::{
    mesh::{BuildOptions, build, read},
    prelude::*,
    render::SoftBodyMeshPlugin,
    simulation::BodySkin,
    solver::{Damping, Substeps},
};
use std::sync::Arc;

/// An OBJ, glTF, Gmsh, TetGen or Medit file.
const FILE: &str = "assets/meshes/teapot.obj";

fn main() -> AppExit {
    let soft_bodies = (SoftBodyPlugins::default(), SoftBodyMeshPlugin);
    App::new()
        .add_plugins((DefaultPlugins, soft_bodies))
        .add_systems(Startup, setup)
        .run()
}

fn setup(
    mut commands: Commands,
    mut materials: ResMut<Assets<StandardMaterial>>,
    mut settings: ResMut<SimulationSettings>,
) -> Result {
    settings.substeps = Substeps::of(20); // per tick
    let options = BuildOptions {
        size: Some(0.6), // longest side [m]
        cells: Some(8),  // cells of the lattice along it
        ..default()
    };
    let mesh = build(read::file(FILE.as_ref())?, &options)?;
    for note in &mesh.notes {
        info!("{FILE}: {note}");
    }
    let body = SoftBody::shape(mesh.shape).at(Vec3::Y * 0.6); // m
    let stretch = Stretch {
        compliance: Compliance::of(1e-3), // m/N
        damping: Damping::of(0.02),       // s
        ..default()
    };
    let material = MeshMaterial3d(materials.add(Color::srgb(0.2, 0.6, 0.5)));
    let (volume, ground) = (Volume::default(), Ground::default());
    let mut body = commands.spawn((body.try_build()?, stretch, volume, ground, material));
    // The surface of the file follows the tetrahedra that fill it.
    if let Some(skin) = mesh.skin {
        body.insert(BodySkin(Arc::new(skin)));
    }
    let light = Transform::from_xyz(1.0, 3.0, 2.0).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((DirectionalLight::default(), light));
    commands.spawn((Camera3d::default(), Transform::from_xyz(0.0, 0.5, 2.0)));
    Ok(())
}
