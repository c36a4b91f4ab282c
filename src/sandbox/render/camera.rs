//! The camera: glides to its [controlled](crate::sandbox::input::steer) goal. The view is shifted
//! so that its center is the center of the area that the panel leaves free.

use crate::render::Drawn;
use crate::sandbox::{
    render::orbit::Orbit,
    state::view::{ViewCommand, ViewSettings},
};
use bevy::{camera::SubCameraView, prelude::*, window::PrimaryWindow};

/// Time constant of the camera motion [s].
const GLIDE: f32 = 0.07;

/// Maximum time of a step of the motion [s]: a frame of a slow renderer.
const MAX_STEP: f32 = 0.15;

/// The camera's orbit: current and goal.
#[derive(Component, Debug, Clone, Copy, Default)]
pub struct OrbitCamera {
    /// Current orbit.
    pub now: Orbit,
    /// Goal, set by user input.
    pub goal: Orbit,
    /// Shift of the view to the left [px]: half of the width that the panel covers on the right.
    shift: f32,
}

impl OrbitCamera {
    /// A camera at rest.
    #[must_use]
    pub fn at(orbit: Orbit) -> Self {
        Self {
            now: orbit,
            goal: orbit,
            shift: 0.0,
        }
    }
}

/// Systems that move the camera, in `Update`.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct CameraSystems;

/// Moves the camera.
pub struct CameraPlugin;

impl Plugin for CameraPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(Update, (frame_all, glide).chain().in_set(CameraSystems));
    }
}

fn frame_all(
    mut commands: MessageReader<ViewCommand>,
    bodies: Query<&Drawn>,
    settings: Res<ViewSettings>,
    window: Single<&Window, With<PrimaryWindow>>,
    mut camera: Single<&mut OrbitCamera>,
) {
    if !commands
        .read()
        .any(|command| *command == ViewCommand::FrameAll)
    {
        return;
    }
    let free = (window.width() - settings.panel_width).max(1.0);
    if let Some((low, high)) = bounds(&bodies) {
        camera.goal = camera
            .goal
            .framing(low, high, free / window.height().max(1.0));
    }
}

/// Bounding box of all bodies [m].
fn bounds(bodies: &Query<&Drawn>) -> Option<(Vec3, Vec3)> {
    bodies
        .iter()
        .map(|drawn| (drawn.low, drawn.high))
        .filter(|(low, high)| low.is_finite() && high.is_finite())
        .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

fn glide(
    time: Res<Time<Real>>,
    settings: Res<ViewSettings>,
    window: Single<&Window, With<PrimaryWindow>>,
    mut camera: Single<(&mut OrbitCamera, &mut Transform, &mut Camera)>,
) {
    let (orbit, transform, camera) = &mut *camera;
    // The first frame after a rest has the duration of the rest.
    let seconds = time.delta_secs().min(MAX_STEP);
    let fraction = 1.0 - (-seconds / GLIDE).exp();
    let now = orbit.now.towards(orbit.goal, fraction);
    // Stops within a fraction of a pixel, so that nothing is recomputed.
    let now = if now.is_near(orbit.goal) {
        orbit.goal
    } else {
        now
    };
    if now != orbit.now {
        orbit.now = now;
    }
    transform.set_if_neq(now.transform());
    let goal = settings.shift();
    let shift = orbit.shift + (goal - orbit.shift) * fraction;
    orbit.shift = if (goal - shift).abs() < 0.5 {
        goal
    } else {
        shift
    };
    let view = shifted_view(window.physical_size(), orbit.shift * window.scale_factor());
    if camera.sub_camera_view != view {
        camera.sub_camera_view = view;
    }
}

/// The view shifted left by a number of physical pixels, without rotating the camera.
fn shifted_view(size: UVec2, shift: f32) -> Option<SubCameraView> {
    (shift.round() != 0.0 && size.min_element() > 0).then(|| SubCameraView {
        full_size: size,
        offset: Vec2::new(shift.round(), 0.0),
        size,
    })
}
