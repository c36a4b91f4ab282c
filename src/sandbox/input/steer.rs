//! Camera control: the right button orbits, the middle button (or shift and the right button) pans,
//! and the wheel zooms.
//!
//! The camera moves only while it owns the pointer, and zooms only while nothing else owns it.

use super::pointer::{Pointer, PointerOwner, PointerSystems};
use crate::sandbox::{
    render::camera::{CameraSystems, OrbitCamera},
    state::view::Followed,
};
use bevy::{prelude::*, window::PrimaryWindow};

/// Lets the user control the camera.
pub struct SteerPlugin;

impl Plugin for SteerPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(Update, steer.after(PointerSystems).before(CameraSystems));
    }
}

fn steer(
    pointer: Res<Pointer>,
    mut moves: MessageReader<CursorMoved>,
    mouse: Res<ButtonInput<MouseButton>>,
    keys: Res<ButtonInput<KeyCode>>,
    window: Single<&Window, With<PrimaryWindow>>,
    mut camera: Single<&mut OrbitCamera>,
    mut followed: ResMut<Followed>,
) {
    let shift = keys.any_pressed([KeyCode::ShiftLeft, KeyCode::ShiftRight]);
    let right = mouse.pressed(MouseButton::Right);
    let middle = mouse.pressed(MouseButton::Middle);
    // Of the cursor, not of the device: remote desktops and virtual machines report no motion.
    let motion: Vec2 = moves.read().filter_map(|it| it.delta).sum();
    if pointer.owner == PointerOwner::Camera && motion != Vec2::ZERO {
        if middle || (right && shift) {
            camera.goal = camera.goal.panned(motion, window.height());
            followed.set_if_neq(Followed(None));
        } else if right {
            camera.goal = camera.goal.turned(motion);
        }
    }
    let free = matches!(pointer.owner, PointerOwner::None | PointerOwner::Camera);
    if free && pointer.wheel != 0.0 {
        camera.goal = camera.goal.zoomed(pointer.wheel);
    }
}
