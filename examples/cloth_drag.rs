//! A cloth hangs by two corners; drag it with the mouse: `cargo run --release --example cloth_drag`

use bevy::{prelude::*, window::PrimaryWindow};
use pliant::{
    prelude::*,
    render::SoftBodyMeshPlugin,
    solver::{ParticleIndex, SurfacePoint},
};
use std::f32::consts::FRAC_PI_2;

fn main() -> AppExit {
    App::new()
        .add_plugins((
            DefaultPlugins,
            SoftBodyPlugins::default(),
            SoftBodyMeshPlugin,
        ))
        .add_systems(Startup, setup)
        .add_systems(Update, drag)
        .run()
}

fn setup(mut commands: Commands, mut materials: ResMut<Assets<StandardMaterial>>) -> Result {
    let cloth = SoftBody::cloth(Vec2::splat(1.5), UVec2::splat(20))
        .rotated(Quat::from_rotation_x(FRAC_PI_2)) // upright, its first row on top
        .at(Vec3::Y)
        .density(Density::of(0.2)) // kg/m²
        .pinned([0, 20]); // the corners of the first row
    let look = StandardMaterial {
        base_color: Color::srgb(0.2, 0.5, 0.8),
        double_sided: true,
        cull_mode: None,
        ..default()
    };
    commands.spawn((
        cloth.build(),
        Stretch::default(),
        MeshMaterial3d(materials.add(look)),
    ));
    commands.spawn((
        DirectionalLight::default(),
        Transform::from_xyz(1.0, 2.0, 3.0).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    commands.spawn((
        Camera3d::default(),
        Transform::from_xyz(0.0, 1.0, 4.0).looking_at(Vec3::Y, Vec3::Y),
    ));
    Ok(())
}

/// Holds the particle under the pointer, and moves it in the plane that faces the camera.
fn drag(
    buttons: Res<ButtonInput<MouseButton>>,
    window: Single<&Window, With<PrimaryWindow>>,
    camera: Single<(&Camera, &GlobalTransform)>,
    cloth: Single<(Entity, &Particles)>,
    mut actions: ResMut<Actions>,
    mut depth: Local<f32>,
) {
    let ((camera, view), (body, particles)) = (*camera, *cloth);
    let ray = window
        .cursor_position()
        .and_then(|at| camera.viewport_to_world(view, at).ok());
    let Some(ray) = ray else { return };
    if buttons.just_pressed(MouseButton::Left) {
        let off = |x: Vec3| (x - ray.origin).reject_from(*ray.direction).length();
        let at = |i: usize| particles.position(i).as_vec3();
        let nearest = (0..particles.len()).min_by(|&a, &b| off(at(a)).total_cmp(&off(at(b))));
        if let Some(i) = nearest.filter(|&i| off(at(i)) < 0.1) {
            *depth = (at(i) - ray.origin).dot(*ray.direction);
            let point = SurfacePoint::new(&[(ParticleIndex(i as u32), 1.0)]).expect("one particle");
            actions.push(Action::Grab {
                body,
                point,
                target: ray.get_point(*depth),
            });
        }
    } else if buttons.pressed(MouseButton::Left) {
        actions.push(Action::MoveGrab {
            body,
            target: ray.get_point(*depth),
        });
    } else if buttons.just_released(MouseButton::Left) {
        actions.push(Action::Release { body });
    }
}
