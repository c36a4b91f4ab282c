//! What the name of a scene refers to: a built-in one, a file, or nothing.

use super::{SceneError, registry};
use crate::mesh::read;
use std::{
    fs,
    path::{Path, PathBuf},
};

/// Whether a file is a mesh, by the ending of its name.
pub(super) fn is_mesh(path: &Path) -> bool {
    let ending = path.extension().map(|it| it.to_ascii_lowercase());
    ending.is_some_and(|ending| read::ENDINGS.iter().any(|other| ending == *other))
}

/// The error of a name that is neither a built-in scene nor a file.
pub(crate) fn unknown(name: &str) -> Option<SceneError> {
    let path = Path::new(name);
    let is_known = registry::find(name).is_some() || !matches!(path.try_exists(), Ok(false));
    (!is_known).then(|| SceneError::Unknown {
        name: name.to_owned(),
        valid: registry::names(),
        files: readable_beside(path),
    })
}

/// Paths of the scenes, snapshots and meshes in the folder of a path, by the endings of their names.
fn readable_beside(path: &Path) -> Vec<String> {
    let folder = match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    let files = fs::read_dir(folder).into_iter().flatten().flatten();
    let paths = files.map(|file| path.with_file_name(file.file_name()));
    let is_other = |path: &PathBuf| {
        path.extension()
            .is_some_and(|it| it == "ron" || it == "snap")
    };
    let readable = paths.filter(|path| is_mesh(path) || is_other(path));
    let mut names: Vec<String> = readable.map(|path| path.display().to_string()).collect();
    names.sort();
    names
}
