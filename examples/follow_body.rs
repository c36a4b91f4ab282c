//! A lamp follows a bouncing ball: `cargo run --release --example follow_body`

use bevy::prelude::*;
use pliant::{
    prelude::*,
    render::SoftBodyMeshPlugin,
    simulation::SoftBodySystems,
    solver::{Restitution, measure},
};

#[derive(Component)]
struct Follows(Entity);

fn main() -> AppExit {
    App::new()
        .add_plugins((
            DefaultPlugins,
            SoftBodyPlugins::default(),
            SoftBodyMeshPlugin,
        ))
        .add_systems(Startup, setup)
        .add_systems(
            PostUpdate,
            follow
                .after(SoftBodySystems::Last)
                .before(TransformSystems::Propagate),
        )
        .run()
}

fn setup(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let ball = SoftBody::sphere(0.4, 8).at(Vec3::Y * 2.0); // m
    let ball = commands.spawn((
        ball.density(Density::of(100.0)).build(), // kg/m³
        Stretch {
            compliance: Compliance::of(1e-5), // m/N
            ..default()
        },
        Volume::default(),
        Ground {
            restitution: Restitution::of(0.9),
            ..default()
        },
        MeshMaterial3d(materials.add(Color::srgb(0.9, 0.7, 0.2))),
    ));
    let ball = ball.id();
    commands.spawn((PointLight::default(), Transform::default(), Follows(ball)));
    commands.spawn((
        Mesh3d(meshes.add(Plane3d::default().mesh().size(10.0, 10.0))),
        MeshMaterial3d(materials.add(Color::WHITE)),
    ));
    commands.spawn((
        Camera3d::default(),
        Transform::from_xyz(0.0, 2.0, 6.0).looking_at(Vec3::Y, Vec3::Y),
    ));
}

/// Keeps the followers of a body one meter above its center of mass.
fn follow(bodies: Query<&Particles>, mut followers: Query<(&mut Transform, &Follows)>) {
    for (mut transform, &Follows(body)) in &mut followers {
        if let Ok(particles) = bodies.get(body) {
            transform.translation = measure::center_of_mass(particles).as_vec3() + Vec3::Y;
        }
    }
}
