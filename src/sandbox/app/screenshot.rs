//! The screenshot key: saves an image of the window, including the panel, in the working folder.
//!
//! Also converts captured images to files, for images without a window.

use crate::{
    sandbox::state::{event::ScreenshotSaved, view::ViewCommand},
    scene::CurrentScene,
};
use bevy::{
    prelude::*,
    render::view::screenshot::{Screenshot, ScreenshotCaptured},
};
use std::path::Path;

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
    mut commands: Commands,
) {
    if !orders.read().any(|order| *order == ViewCommand::Screenshot) {
        return;
    }
    let name = scene.map_or_else(|| "pliant".to_owned(), |scene| scene.name.clone());
    let path = crate::output::free_path(&name, "png", |path| path.exists());
    commands.spawn(Screenshot::primary_window()).observe(
        move |captured: On<ScreenshotCaptured>, mut saved: MessageWriter<ScreenshotSaved>| {
            let error = save(&captured.image, &path).err();
            saved.write(ScreenshotSaved {
                path: path.clone(),
                error,
            });
        },
    );
}

/// Writes an image as a file, in the format given by its extension.
///
/// # Errors
/// What is wrong with the file or the image, as a message for the user.
pub(in crate::sandbox) fn save(image: &Image, path: &Path) -> Result<(), String> {
    let pixels = image
        .clone()
        .try_into_dynamic()
        .map_err(|error| error.to_string())?;
    // A screenshot has no alpha channel.
    pixels
        .to_rgb8()
        .save(path)
        .map_err(|error| error.to_string())
}
