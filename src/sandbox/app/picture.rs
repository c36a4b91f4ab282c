//! Renders an image of a scene without a window, in the same studio: of any size, or as a small one
//! for the scene browser.
//!
//! Needs a graphics adapter but no display. Draws the given state without stepping it.

use crate::{
    SoftBodyPlugins,
    sandbox::{
        app::{
            display::{self, NoDisplay},
            screenshot,
        },
        panel::browser::card::PICTURE,
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
    asset::RenderAssetUsages,
    camera::RenderTarget,
    log::LogPlugin,
    prelude::*,
    render::{
        RenderApp, RenderPlugin,
        pipelined_rendering::PipelinedRenderingPlugin,
        render_resource::{Extent3d, PipelineCache, TextureDimension, TextureFormat},
        view::screenshot::{Screenshot, ScreenshotCaptured},
    },
    window::ExitCondition,
    winit::WinitPlugin,
};
use std::{
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

/// Frames to wait for the image from the graphics card before giving up.
const PATIENCE: u32 = 600;

/// Time to wait for shaders before giving up.
const LOADING: Duration = Duration::from_secs(60);

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
    /// The shaders were not loaded in time.
    #[error("the shaders of the bodies were not loaded within a minute; try again")]
    NoShaders,
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
    write(&render(built, camera, size)?, path)
}

/// Renders a picture for the scene browser: at twice the size, then averaged over squares of four
/// pixels. `camera` gives the direction; all bodies are framed.
///
/// # Errors
/// As for [`picture`].
pub fn thumbnail(
    built: &BuiltScene,
    camera: Option<CameraSpec>,
    path: &Path,
) -> Result<(), PictureError> {
    let size = 2 * UVec2::from_array(PICTURE);
    write(&halved(&render(built, camera, size)?), path)
}

/// An image of half the width and height, with the mean of each square of four pixels.
fn halved(image: &Image) -> Image {
    let size = image.size() / 2;
    let row = 4 * image.size().x as usize;
    let pixels = image.data.as_deref().unwrap_or_default();
    let mut data = Vec::with_capacity(4 * size.element_product() as usize);
    for y in 0..size.y as usize {
        for x in 0..size.x as usize {
            let first = 2 * y * row + 8 * x;
            for channel in first..first + 4 {
                let four = [channel, channel + 4, channel + row, channel + row + 4];
                let sum: u32 = four
                    .iter()
                    .map(|&at| pixels.get(at).copied().map_or(0, u32::from))
                    .sum();
                data.push(((sum + 2) / 4) as u8);
            }
        }
    }
    let extent = Extent3d {
        width: size.x,
        height: size.y,
        ..default()
    };
    let format = image.texture_descriptor.format;
    let usage = RenderAssetUsages::default();
    Image::new(extent, TextureDimension::D2, data, format, usage)
}

fn write(image: &Image, path: &Path) -> Result<(), PictureError> {
    screenshot::save_small(image, path).map_err(|reason| PictureError::NotWritten {
        path: path.to_owned(),
        reason,
    })
}

fn render(
    built: &BuiltScene,
    camera: Option<CameraSpec>,
    size: UVec2,
) -> Result<Image, PictureError> {
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
    wait_for_shaders(&mut app)?;
    capture(&mut app, target)
}

/// The view from a direction that shows all bodies in their current state.
fn orbit(built: &BuiltScene, camera: Option<CameraSpec>, size: UVec2) -> Orbit {
    let direction = camera.map_or_else(Orbit::default, |it| Orbit::look(it.eye, it.target));
    direction.fitting(&Subject::of(built).points, &FreeArea::whole(size.as_vec2()))
}

/// Draws frames until nothing waits for its shader, which is loaded beside them: bodies would be
/// missing in the image.
fn wait_for_shaders(app: &mut App) -> Result<(), PictureError> {
    let started = Instant::now();
    while started.elapsed() < LOADING {
        app.update();
        let world = app.sub_app(RenderApp).world();
        let mut waiting = world.resource::<PipelineCache>().waiting_pipelines();
        if waiting.next().is_none() {
            return Ok(());
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    Err(PictureError::NoShaders)
}

/// The captured image.
#[derive(Resource)]
struct Outcome(Image);

fn capture(app: &mut App, target: Handle<Image>) -> Result<Image, PictureError> {
    app.world_mut().spawn(Screenshot::image(target)).observe(
        move |captured: On<ScreenshotCaptured>, mut commands: Commands| {
            commands.insert_resource(Outcome(captured.image.clone()));
        },
    );
    for _ in 0..PATIENCE {
        app.update();
        if let Some(Outcome(image)) = app.world_mut().remove_resource::<Outcome>() {
            return Ok(image);
        }
    }
    Err(PictureError::NoAnswer)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_halved_image_has_the_mean_of_four_pixels() {
        let image = Image::new(
            Extent3d {
                width: 4,
                height: 2,
                ..default()
            },
            TextureDimension::D2,
            (0..32).collect(),
            TextureFormat::Rgba8UnormSrgb,
            RenderAssetUsages::default(),
        );
        let half = halved(&image);
        assert_eq!(half.size(), UVec2::new(2, 1));
        // (0 + 4 + 16 + 20)/4 = 10 in the first channel of the first square.
        let expected = [10, 11, 12, 13, 18, 19, 20, 21];
        assert_eq!(half.data.as_deref(), Some(&expected[..]));
    }
}
