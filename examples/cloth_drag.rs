//! A cloth hangs by two corners; drag it with the mouse: `cargo run --release --example cloth_drag`

use bevy::{prelude::*, window::PrimaryWindow};
use pliant::{prelude::*, render::*};
use std::f32::consts::FRAC_PI_2;

fn main() -> AppExit {
    let soft_bodies = (SoftBodyPlugins::default(), SoftBodyMeshPlugin);
    App::new()
        .add_plugins((DefaultPlugins, soft_bodies))
        .add_systems(Startup, setup)
        .add_systems(Update, drag)
        .run()
}

fn setup(mut commands: Commands, mut materials: ResMut<Assets<StandardMaterial>>) {
    let cloth = SoftBody::cloth(Vec2::splat(1.5), UVec2::splat(20))
        .rotated(Quat::from_rotation_x(FRAC_PI_2)) // upright, its first row on top
        .at(Vec3::Y)
        .pinned([0, 20]); // the corners of the first row
    let mut material = StandardMaterial::from(Color::srgb(0.2, 0.5, 0.8));
    (material.double_sided, material.cull_mode) = (true, None);
    let material = MeshMaterial3d(materials.add(material));
    commands.spawn((cloth.build(), Stretch::default(), material));
    let light = Transform::from_xyz(1.0, 3.0, 2.0).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((DirectionalLight::default(), light));
    commands.spawn((Camera3d::default(), Transform::from_xyz(0.0, 1.0, 4.0)));
}

/// Grabs the point under the pointer and moves it at its distance from the camera.
fn drag(
    buttons: Res<ButtonInput<MouseButton>>,
    window: Single<&Window, With<PrimaryWindow>>,
    camera: Single<(&Camera, &GlobalTransform)>,
    soft_bodies: SoftBodyRayCast,
    mut actions: ResMut<Actions>,
    mut grabbed: Local<Option<SoftBodyHit>>,
) {
    // Also outside of the window.
    if !buttons.pressed(MouseButton::Left)
        && let Some(hit) = grabbed.take()
    {
        actions.push(Action::Release { body: hit.body });
    }
    let at = window.cursor_position();
    let ray = at.and_then(|at| camera.0.viewport_to_world(camera.1, at).ok());
    let Some(ray) = ray else { return };
    if buttons.just_pressed(MouseButton::Left) {
        *grabbed = soft_bodies.cast(ray, 0.0);
        if let Some(hit) = &*grabbed {
            actions.push(hit.grab());
        }
    }
    if let Some(hit) = &*grabbed {
        let (body, target) = (hit.body, ray.get_point(hit.distance));
        actions.push(Action::MoveGrab { body, target });
    }
}
