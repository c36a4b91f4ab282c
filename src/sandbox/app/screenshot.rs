//! The screenshot key: a picture of the window, panel and all, in the working folder.
//!
//! Also how a captured image becomes a file, which the picture without a window shares.

use crate::sandbox::render::view::ViewCommand;
use crate::scene::CurrentScene;
use bevy::{
    prelude::*,
    render::view::screenshot::{Screenshot, ScreenshotCaptured},
};
use std::path::{Path, PathBuf};

/// A picture was written, or could not be.
#[derive(Message, Debug, Clone)]
pub struct ScreenshotSaved {
    /// The file.
    pub path: PathBuf,
    /// What went wrong, for the user.
    pub error: Option<String>,
}

/// Takes pictures of the window.
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
    let path = free_path(&name, "png", |path| path.exists());
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

/// The first of name-001.png, name-002.png, … (for `png`) that is not taken.
pub(in crate::sandbox) fn free_path(
    name: &str,
    extension: &str,
    taken: impl Fn(&Path) -> bool,
) -> PathBuf {
    let plain: String = name
        .chars()
        .map(|c| {
            if c.is_alphanumeric() || c == '-' || c == '_' {
                c
            } else {
                '-'
            }
        })
        .collect();
    (1..)
        .map(|n| PathBuf::from(format!("{plain}-{n:03}.{extension}")))
        .find(|path| !taken(path))
        .unwrap_or_default()
}

/// Writes an image as a file of the kind that its name says.
///
/// # Errors
/// What was wrong with the file or the image, for the user.
pub(in crate::sandbox) fn save(image: &Image, path: &Path) -> Result<(), String> {
    let pixels = image
        .clone()
        .try_into_dynamic()
        .map_err(|error| error.to_string())?;
    // Opacity is no part of a picture of a window.
    pixels
        .to_rgb8()
        .save(path)
        .map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_screenshot_never_overwrites_another() {
        let taken = ["bunny-001.png", "bunny-002.png"].map(PathBuf::from);
        let path = free_path("bunny", "png", |path| taken.iter().any(|t| t == path));
        assert_eq!(path, Path::new("bunny-003.png"));
    }

    #[test]
    fn a_scene_from_a_path_gives_a_name_without_folders() {
        assert_eq!(
            free_path("a/b: c", "png", |_| false),
            Path::new("a-b--c-001.png")
        );
    }
}
