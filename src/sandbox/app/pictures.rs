//! Files for pictures and videos of the window: in the folder `Pliant` of the user's pictures folder,
//! named after the scene and the simulated time, without overwriting any.

use crate::output::plain_name;
use std::{
    fs, io,
    path::{Path, PathBuf},
};

/// Name of the folder.
const FOLDER: &str = "Pliant";

/// The folder for pictures and videos: `Pliant` in the user's pictures folder, or in the current
/// folder if the system names none. Created if it does not exist.
///
/// # Errors
/// The system's message, with the folder.
pub fn folder() -> Result<PathBuf, String> {
    let parent = dirs::picture_dir().filter(|folder| folder.is_dir());
    let folder = parent.map_or_else(std::env::current_dir, Ok);
    let folder = folder.map_err(|error| error.to_string())?.join(FOLDER);
    let failed = |error: io::Error| format!("cannot create {}: {error}", folder.display());
    fs::create_dir_all(&folder).map_err(failed)?;
    Ok(folder)
}

/// A file in a folder that does not exist yet, for a picture or video of a scene at a simulated time
/// [s]: `bunny-2.35s.png`, or `bunny-2.35s-002.png` if that exists.
#[must_use]
pub fn free_file(folder: &Path, scene: &str, time: f64, extension: &str) -> PathBuf {
    let file = Path::new(scene).file_stem();
    let scene = file.map_or_else(|| scene.into(), |stem| stem.to_string_lossy());
    let stem = format!("{}-{time:.2}s", plain_name(&scene));
    let first = folder.join(format!("{stem}.{extension}"));
    let others = (2..).map(|number| folder.join(format!("{stem}-{number:03}.{extension}")));
    std::iter::once(first)
        .chain(others)
        .find(|path| !path.exists())
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_named_after_scene_and_time_and_overwrites_none() {
        let folder = std::env::temp_dir().join(format!("pliant-pictures-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder for temporary files");
        let name = |scene| {
            let path = free_file(&folder, scene, 2.349, "png");
            fs::write(&path, "").expect("it can be written");
            let name = path.strip_prefix(&folder).expect("it is in the folder");
            name.to_string_lossy().into_owned()
        };
        assert_eq!(name("bunny"), "bunny-2.35s.png");
        assert_eq!(name("bunny"), "bunny-2.35s-002.png");
        assert_eq!(name("bunny"), "bunny-2.35s-003.png");
        assert_eq!(name("a/my scene.ron"), "my-scene-2.35s.png");
        fs::remove_dir_all(&folder).expect("it was made here");
    }
}
