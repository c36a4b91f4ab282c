//! Films of the view without the panel, as GIF: frames at a fixed rate of simulated time, encoded on
//! another thread.
//!
//! While a film is taken, the simulation advances by the time of one film frame for each frame that is
//! drawn, so that the film runs evenly however slowly frames are drawn. At a speed other than 1× the
//! film has that speed.

mod encoder;

pub use encoder::{Encoder, Pixels, RATE};

use super::{
    pictures,
    plain_view::{self, PlainView},
    screenshot,
};
use crate::{
    sandbox::{
        render::readiness::PipelinesReady,
        state::view::ViewSettings,
        ui::message::{Notices, capitalised},
    },
    scene::CurrentScene,
    simulation::SimulationClock,
};
use bevy::{
    app::AppExit,
    ecs::message::MessageCursor,
    prelude::*,
    render::view::screenshot::{Screenshot, ScreenshotCaptured},
    window::ExitSystems,
};
use std::time::Duration;

/// Longest film [s].
pub const MAX_SECONDS: u64 = 20;
/// Maximum width of a film [px].
const MAX_WIDTH: f32 = 720.0;
/// Frames before the first one is taken, for the pipelines of its camera.
const WARM_UP: u32 = 6;
/// Frames that wait for the encoder at which the film waits too.
const MAX_WAITING: usize = 12;

/// The film that is taken or encoded.
#[derive(Resource, Debug, Default)]
pub struct FilmStatus(Stage);

#[derive(Debug, Default)]
enum Stage {
    #[default]
    Off,
    /// The camera is there; its pipelines may not be.
    Preparing {
        camera: Entity,
        frames: u32,
        encoder: Encoder,
    },
    /// Frames are taken.
    Taking {
        camera: Entity,
        start: u64,
        taken: u64,
        encoder: Encoder,
    },
    /// The last frames are encoded.
    Encoding { encoder: Encoder },
}

impl FilmStatus {
    /// Text and tooltip of the badge, while there is a film.
    pub(super) fn words(&self) -> Option<(String, String)> {
        let help = |encoder: &Encoder| {
            format!(
                "Film of the view to {}, at {RATE} frames per simulated second and at most \
                 {MAX_SECONDS} s. Click or press F10 to end.",
                encoder.path().display()
            )
        };
        match &self.0 {
            Stage::Off => None,
            Stage::Preparing { encoder, .. } => Some(("Film …".to_owned(), help(encoder))),
            Stage::Taking { taken, encoder, .. } => {
                let seconds = *taken as f64 / RATE as f64;
                let text = format!("Film {seconds:.1} of {MAX_SECONDS} s, {taken} frames");
                Some((text, help(encoder)))
            }
            Stage::Encoding { encoder } => {
                let text = format!("Film: {} frames to encode", encoder.waiting());
                Some((text, help(encoder)))
            }
        }
    }

    /// Whether frames are taken, or about to be.
    #[must_use]
    pub const fn is_on(&self) -> bool {
        matches!(self.0, Stage::Preparing { .. } | Stage::Taking { .. })
    }
}

/// Takes films.
pub struct FilmPlugin;

impl Plugin for FilmPlugin {
    fn build(&self, app: &mut App) {
        plain_view::build(app);
        app.init_resource::<FilmStatus>().add_systems(
            Last,
            (take, finish, tell, finish_with_window.after(ExitSystems)).chain(),
        );
    }
}

/// Starts a film, or ends the one that is taken.
pub(super) fn toggle(world: &mut World) {
    match world.resource::<FilmStatus>().0 {
        Stage::Off => begin(world),
        Stage::Preparing { .. } | Stage::Taking { .. } => end(world),
        // Saved in a moment.
        Stage::Encoding { .. } => {}
    }
}

fn begin(world: &mut World) {
    let scene = world.get_resource::<CurrentScene>();
    let name = scene.map_or_else(|| "pliant".to_owned(), |scene| scene.name.clone());
    let time = world.resource::<SimulationClock>().time();
    let begun = pictures::folder().and_then(|folder| {
        let path = pictures::free_file(&folder, &name, time, "gif");
        let camera = plain_view::spawn(world, MAX_WIDTH).ok_or("the window has no view")?;
        let encoder = Encoder::create(&path).inspect_err(|_| {
            world.despawn(camera);
        })?;
        Ok::<_, String>((camera, encoder))
    });
    match begun {
        Ok((camera, encoder)) => {
            world.resource_mut::<FilmStatus>().0 = Stage::Preparing {
                camera,
                frames: 0,
                encoder,
            };
        }
        Err(error) => {
            let text = format!("Cannot take a film: {error}");
            world.resource_mut::<Notices>().error(text);
        }
    }
}

/// Ends the film that is taken, if there is one.
pub(super) fn stop(world: &mut World) {
    if world.resource::<FilmStatus>().is_on() {
        end(world);
    }
}

fn end(world: &mut World) {
    let stage = std::mem::take(&mut world.resource_mut::<FilmStatus>().0);
    world.resource_mut::<SimulationClock>().film_step = None;
    world.resource_mut::<FilmStatus>().0 = match stage {
        Stage::Preparing {
            camera, encoder, ..
        } => {
            world.despawn(camera);
            encoder.abandon();
            Stage::Off
        }
        Stage::Taking {
            camera,
            mut encoder,
            ..
        } => {
            world.despawn(camera);
            encoder.end();
            Stage::Encoding { encoder }
        }
        other => other,
    };
}

/// Tells the panel whether a film is taken.
fn tell(status: Res<FilmStatus>, mut view: ResMut<ViewSettings>) {
    if view.films != status.is_on() {
        view.films = status.is_on();
    }
}

/// Takes a frame whenever the simulation has advanced by one.
fn take(world: &mut World) {
    let ready = world
        .get_resource::<PipelinesReady>()
        .is_none_or(PipelinesReady::get);
    let steps = world.resource::<SimulationClock>().film_steps();
    let mut status = world.resource_mut::<FilmStatus>();
    let mut step = None;
    let due = match &mut status.0 {
        Stage::Preparing { frames, .. } => {
            *frames += 1;
            if *frames < WARM_UP || !ready {
                return;
            }
            // The first frame is the picture of now.
            let stage = std::mem::take(&mut status.0);
            if let Stage::Preparing {
                camera, encoder, ..
            } = stage
            {
                status.0 = Stage::Taking {
                    camera,
                    start: steps,
                    taken: 0,
                    encoder,
                };
            }
            true
        }
        Stage::Taking { start, taken, .. } => steps.saturating_sub(*start) >= *taken,
        Stage::Off | Stage::Encoding { .. } => return,
    };
    let Stage::Taking {
        camera,
        taken,
        encoder,
        ..
    } = &mut status.0
    else {
        return;
    };
    if encoder.failed() || *taken >= MAX_SECONDS * RATE {
        end(world);
        return;
    }
    // Frames that have been captured are encoded first.
    if encoder.waiting() <= MAX_WAITING {
        step = Some(Duration::from_secs(1) / RATE as u32);
    }
    let shot = encoder.inlet().filter(|_| due).map(|inlet| {
        let number = *taken;
        *taken += 1;
        (*camera, inlet, number)
    });
    // A step of zero length: the simulation waits for the encoder.
    world.resource_mut::<SimulationClock>().film_step = Some(step.unwrap_or(Duration::MAX / 4));
    if let Some((camera, inlet, number)) = shot
        && let Some(image) = world
            .get::<PlainView>(camera)
            .map(|view| view.image.clone())
    {
        inlet.announce();
        world
            .spawn(Screenshot::image(image))
            .observe(move |captured: On<ScreenshotCaptured>| {
                inlet.send(number, screenshot::rgb(&captured.image));
            });
    }
}

/// Reports a film that is written.
fn finish(world: &mut World) {
    let mut status = world.resource_mut::<FilmStatus>();
    let done = matches!(&status.0, Stage::Encoding { encoder } if encoder.is_finished());
    if !done {
        return;
    }
    if let Stage::Encoding { encoder } = std::mem::take(&mut status.0) {
        let path = encoder.path().to_owned();
        let result = encoder.finish();
        let mut notices = world.resource_mut::<Notices>();
        match result {
            Ok(frames) => {
                let seconds = f64::from(frames) / RATE as f64;
                notices.info(format!(
                    "Saved {}: {seconds:.1} s, {frames} frames",
                    path.display()
                ));
            }
            Err(error) => notices.error(format!(
                "Cannot save the film {}: {}",
                path.display(),
                capitalised(&error)
            )),
        }
    }
}

/// Completes the film when the window closes.
fn finish_with_window(world: &mut World, mut read: Local<MessageCursor<AppExit>>) {
    let exits = read.read(world.resource::<Messages<AppExit>>()).count();
    if exits == 0 {
        return;
    }
    stop(world);
    let stage = std::mem::take(&mut world.resource_mut::<FilmStatus>().0);
    if let Stage::Encoding { mut encoder } = stage {
        encoder.cut();
        if let Err(error) = encoder.finish() {
            error!("the film was not saved: {error}");
        }
    }
}
