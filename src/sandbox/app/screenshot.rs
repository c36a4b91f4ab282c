//! The screenshot key: saves an image of the window, including the panel, in the [folder for
//! pictures](super::pictures).
//!
//! Also converts captured images to files, for images without a window.

use super::{film::Pixels, pictures};
use crate::{
    file,
    sandbox::state::{event::ScreenshotSaved, view::ViewCommand},
    scene::CurrentScene,
    simulation::SimulationClock,
};
use bevy::{
    prelude::*,
    render::view::screenshot::{Screenshot, ScreenshotCaptured},
};
use image::{
    ImageFormat,
    codecs::png::{CompressionType, FilterType, PngEncoder},
};
use std::{io::Cursor, path::Path};

/// Saves screenshots of the window.
pub struct ScreenshotPlugin;

impl Plugin for ScreenshotPlugin {
    fn build(&self, app: &mut App) {
        app.add_message::<ScreenshotSaved>()
            .add_systems(Update, obey);
    }
}

fn obey(
    mut orders: MessageReader<ViewCommand>,
    scene: Option<Res<CurrentScene>>,
    clock: Res<SimulationClock>,
    mut commands: Commands,
) {
    if !orders.read().any(|order| *order == ViewCommand::Screenshot) {
        return;
    }
    let name = scene.map_or_else(|| "pliant".to_owned(), |scene| scene.name.clone());
    let time = clock.time();
    commands.spawn(Screenshot::primary_window()).observe(
        move |captured: On<ScreenshotCaptured>, mut saved: MessageWriter<ScreenshotSaved>| {
            // The file is chosen only now, so that two screenshots in one frame get two files.
            let (path, error) = match pictures::folder() {
                Ok(folder) => {
                    let path = pictures::free_file(&folder, &name, time, "png");
                    let error = save(&captured.image, &path).err();
                    (path, error)
                }
                Err(error) => (format!("{name}.png").into(), Some(error)),
            };
            saved.write(ScreenshotSaved { path, error });
        },
    );
}

/// The pixels of a captured image.
///
/// # Errors
/// What is wrong with the image, as a message for the user.
pub(super) fn rgb(image: &Image) -> Result<Pixels, String> {
    let picture = image
        .clone()
        .try_into_dynamic()
        .map_err(|error| error.to_string())?
        .to_rgb8();
    Ok(Pixels {
        width: picture.width(),
        height: picture.height(),
        rgb: picture.into_raw(),
    })
}

/// Writes an image as a file, in the format given by its extension.
///
/// # Errors
/// What is wrong with the file or the image, as a message for the user.
pub(in crate::sandbox) fn save(image: &Image, path: &Path) -> Result<(), String> {
    save_packed(image, path, CompressionType::Fast)
}

/// As [`save`], with a PNG that is packed as small as the encoder can, which takes time: the pictures
/// of the scenes are part of the program.
pub(super) fn save_small(image: &Image, path: &Path) -> Result<(), String> {
    save_packed(image, path, CompressionType::Best)
}

fn save_packed(image: &Image, path: &Path, packing: CompressionType) -> Result<(), String> {
    let pixels = image
        .clone()
        .try_into_dynamic()
        .map_err(|error| error.to_string())?;
    // A screenshot has no alpha channel.
    let pixels = pixels.to_rgb8();
    let format = ImageFormat::from_path(path).map_err(|error| error.to_string())?;
    let mut bytes = Vec::new();
    let encoded = match format {
        ImageFormat::Png => pixels.write_with_encoder(PngEncoder::new_with_quality(
            &mut bytes,
            packing,
            FilterType::Adaptive,
        )),
        _ => pixels.write_to(&mut Cursor::new(&mut bytes), format),
    };
    encoded.map_err(|error| error.to_string())?;
    file::replace(path, &bytes).map_err(|error| error.to_string())
}
