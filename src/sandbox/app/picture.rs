//! Renders an image of a scene without a window, in the same studio.
//!
//! Needs a graphics adapter but no display. Draws the given state without stepping it.

use crate::{
    SoftBodyPlugins,
    sandbox::{
        app::{
            display::{self, NoDisplay},
            screenshot,
        },
        render::{
            bodies::BodiesPlugin,
            camera::OrbitCamera,
            colliders::CollidersPlugin,
            framing::Subject,
            free_area::FreeArea,
            orbit::Orbit,
            stage::{self, FloorHeight, StagePlugin},
        },
        state::view::ViewSettings,
    },
    scene::{self, BuiltScene, CameraSpec},
    simulation::SimulationClock,
};
use bevy::{
    app::PluginsState,
    camera::RenderTarget,
    log::LogPlugin,
    prelude::*,
    render::{
        RenderPlugin,
        pipelined_rendering::PipelinedRenderingPlugin,
        render_resource::TextureFormat,
        view::screenshot::{Screenshot, ScreenshotCaptured},
    },
    window::ExitCondition,
    winit::WinitPlugin,
};
use std::path::{Path, PathBuf};

/// Frames to wait for the image from the graphics card before giving up.
const PATIENCE: u32 = 600;

/// Reason why no image could be rendered.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// There is no graphics adapter.
    #[error(transparent)]
    NoAdapter(#[from] NoDisplay),
    /// The file could not be written.
    #[error("cannot write the image {}: {reason}", path.display())]
    NotWritten {
        /// The file.
        path: PathBuf,
        /// Message of the system.
        reason: String,
    },
    /// The graphics card did not return the image.
    #[error("the graphics adapter did not return the image; try again")]
    NoAnswer,
}

/// Renders the current state of a scene's world and writes the image to `path`, in the format given
/// by its extension (PNG). Frames all bodies, seen from the direction of `camera` if given.
///
/// # Errors
/// [`PictureError`] if there is no adapter, or the file cannot be written.
pub fn picture(
    built: &BuiltScene,
    camera: Option<CameraSpec>,
    path: &Path,
    size: UVec2,
) -> Result<(), PictureError> {
    display::check_adapter()?;
    let mut app = App::new();
    app.add_plugins(
        DefaultPlugins
            .set(WindowPlugin {
                primary_window: None,
                exit_condition: ExitCondition::DontExit,
                ..default()
            })
            .set(RenderPlugin {
                synchronous_pipeline_compilation: true,
                ..default()
            })
            .disable::<WinitPlugin>()
            .disable::<LogPlugin>()
            .disable::<PipelinedRenderingPlugin>(),
    )
    .add_plugins(SoftBodyPlugins::default())
    .add_plugins((StagePlugin, BodiesPlugin, CollidersPlugin))
    .init_resource::<ViewSettings>();
    while app.plugins_state() == PluginsState::Adding {
        bevy::tasks::tick_global_task_pools_on_main_thread();
    }
    app.finish();
    app.cleanup();

    app.world_mut().resource_mut::<SimulationClock>().paused = true;
    app.insert_resource(FloorHeight::of(built));
    let target = app
        .world_mut()
        .resource_mut::<Assets<Image>>()
        .add(Image::new_target_texture(
            size.x,
            size.y,
            TextureFormat::Rgba8UnormSrgb,
            None,
        ));
    let eye = app
        .world_mut()
        .spawn((
            OrbitCamera::default(),
            stage::lens(),
            Msaa::Sample4,
            RenderTarget::Image(target.clone().into()),
        ))
        .id();
    scene::spawn(built, app.world_mut());
    // The first frame creates the surfaces of the bodies.
    app.update();
    let orbit = orbit(built, camera, size);
    app.world_mut()
        .entity_mut(eye)
        .insert((OrbitCamera::at(orbit), orbit.transform()));
    app.update();
    capture(&mut app, target, path)
}

/// The view from a direction that shows all bodies in their current state.
fn orbit(built: &BuiltScene, camera: Option<CameraSpec>, size: UVec2) -> Orbit {
    let direction = camera.map_or_else(Orbit::default, |it| Orbit::look(it.eye, it.target));
    direction.fitting(&Subject::of(built).points, &FreeArea::whole(size.as_vec2()))
}

/// Result of the capture.
#[derive(Resource)]
struct Outcome(Result<(), String>);

fn capture(app: &mut App, target: Handle<Image>, path: &Path) -> Result<(), PictureError> {
    let file = path.to_owned();
    app.world_mut().spawn(Screenshot::image(target)).observe(
        move |captured: On<ScreenshotCaptured>, mut commands: Commands| {
            commands.insert_resource(Outcome(screenshot::save(&captured.image, &file)));
        },
    );
    for _ in 0..PATIENCE {
        app.update();
        if let Some(Outcome(outcome)) = app.world_mut().remove_resource::<Outcome>() {
            let path = path.to_owned();
            return outcome.map_err(|reason| PictureError::NotWritten { path, reason });
        }
    }
    Err(PictureError::NoAnswer)
}
