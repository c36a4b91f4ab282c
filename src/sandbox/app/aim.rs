//! Points the camera at a scene.

use crate::{
    sandbox::{
        app::time::SceneContext,
        render::{
            camera::{Framed, OrbitCamera},
            framing::Subject,
            free_area::FreeArea,
            orbit::Orbit,
        },
        state::view::ViewSettings,
    },
    scene::{BuiltScene, CameraSpec},
};
use bevy::{prelude::*, window::PrimaryWindow};

/// Camera motion when a scene is opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Camera {
    /// Moves at once.
    Jump,
    /// Glides.
    Glide,
}

/// Points the camera at a scene that is open again.
pub(super) fn look_again(world: &mut World, scene: &SceneContext) {
    let hint = scene.current.scene.camera;
    look(world, &scene.beginning, hint, Camera::Glide);
}

/// Frames the scene from the direction that it names.
pub(super) fn look(
    world: &mut World,
    built: &BuiltScene,
    direction: Option<CameraSpec>,
    camera: Camera,
) {
    let view = world.get_resource::<ViewSettings>();
    let view = view.cloned().unwrap_or_default();
    let mut windows = world.query_filtered::<&Window, With<PrimaryWindow>>();
    let size = windows.single(world).map_or(WINDOW, Window::size);
    let area = FreeArea::new(&view, size);
    let direction = direction.map_or_else(Orbit::default, |it| Orbit::look(it.eye, it.target));
    let points = Subject::with_motion(built).points;
    let mut framed = Framed::default();
    let mut cameras = world.query::<&mut OrbitCamera>();
    let Ok(mut orbit) = cameras.single_mut(world) else {
        return;
    };
    framed.begin(&mut orbit, direction, points, area);
    if camera == Camera::Jump {
        orbit.now = orbit.goal;
    }
    world.insert_resource(framed);
}

/// Size of a window that cannot be asked [px].
const WINDOW: Vec2 = Vec2::new(1280.0, 800.0);
