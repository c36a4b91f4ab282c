//! Names, folders and writing of files that a user saves. A file is written beside its place and
//! then renamed, so that a full disk damages nothing; no file is replaced unless that was asked for.

use crate::file;
use std::{
    fs, io,
    path::{Path, PathBuf},
};

/// Longest file name [bytes] that file systems take, without the ending of a temporary file.
const MAX_NAME: usize = 200;

/// Why a file was not written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// There is a file of this name.
    #[error("{0} exists")]
    Exists(PathBuf),
    /// The system refuses.
    #[error("cannot write {path}: {error}")]
    System {
        /// The file.
        path: PathBuf,
        /// Message of the system.
        error: io::Error,
    },
}

/// The folder that is proposed for a file: that of the scene file that is open, or else `Pliant` in
/// the user's documents.
pub fn folder(scene_file: Option<&Path>) -> PathBuf {
    if let Some(folder) = scene_file.and_then(Path::parent) {
        return std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    }
    let documents = dirs::document_dir().filter(|folder| folder.is_dir());
    let parent = documents.map_or_else(std::env::current_dir, Ok);
    parent.unwrap_or_default().join("Pliant")
}

/// The file name for what the user typed, with its ending.
///
/// # Errors
/// What is wrong with it, in a sentence.
pub fn file_name(typed: &str, extension: &str) -> Result<String, String> {
    let name = typed.trim();
    let ending = format!(".{extension}");
    let tail = name.len().checked_sub(ending.len());
    let tail = tail.filter(|at| *at > 0).and_then(|at| name.get(at..));
    let has_ending = tail.is_some_and(|tail| tail.eq_ignore_ascii_case(&ending));
    let stem = match has_ending {
        true => &name[..name.len() - ending.len()],
        false => name,
    };
    if stem.is_empty() {
        return Err("Enter a name".to_owned());
    }
    let reserved = |c: &char| c.is_control() || "/\\<>:\"|?*".contains(*c);
    if let Some(c) = stem.chars().find(reserved) {
        let shown = c.escape_default();
        return Err(format!(
            "A name cannot contain “{shown}”: files are saved in the folder shown below"
        ));
    }
    if stem.starts_with('.') {
        return Err("A name cannot begin with a dot".to_owned());
    }
    let name = match has_ending {
        true => name.to_owned(),
        false => format!("{name}{ending}"),
    };
    if name.len() > MAX_NAME {
        let length = name.len();
        return Err(format!(
            "The name has {length} bytes, but at most {MAX_NAME} are possible"
        ));
    }
    Ok(name)
}

/// A name in a folder that no file has yet: `name`, or `name 2` and so on.
pub fn free_name(folder: &Path, name: &str, extension: &str) -> String {
    let taken = |name: &str| folder.join(format!("{name}.{extension}")).exists();
    let numbered = (2_u32..).map(|number| format!("{name} {number}"));
    let mut all = std::iter::once(name.to_owned()).chain(numbered);
    all.find(|name| !taken(name)).unwrap_or_default()
}

/// Writes a [whole file](file::replace). Creates the folder. Only replaces a file if
/// `replace`.
///
/// # Errors
/// [`WriteError`]; an existing file is unchanged in this case.
pub fn write(path: &Path, bytes: &[u8], replace: bool) -> Result<(), WriteError> {
    let failed = |error| WriteError::System {
        path: path.to_owned(),
        error,
    };
    if path.exists() && !replace {
        return Err(WriteError::Exists(path.to_owned()));
    }
    if path.is_dir() {
        return Err(failed(io::Error::other("it is a folder")));
    }
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(failed)?;
    }
    file::replace(path, bytes).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder_for(test: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("pliant-{test}-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder for temporary files");
        folder
    }

    #[test]
    fn names_get_their_ending_and_unusable_ones_a_reason() {
        let name = |typed| file_name(typed, "ron");
        assert_eq!(name("bunny").as_deref(), Ok("bunny.ron"));
        assert_eq!(name("  my scene ").as_deref(), Ok("my scene.ron"));
        assert_eq!(name("bunny.ron").as_deref(), Ok("bunny.ron"));
        assert_eq!(name("Bunny.RON").as_deref(), Ok("Bunny.RON"));
        assert_eq!(name("v1.2").as_deref(), Ok("v1.2.ron"));
        assert_eq!(name("Größe ½").as_deref(), Ok("Größe ½.ron"));
        for nothing in ["", "   ", "\t"] {
            assert_eq!(name(nothing), Err("Enter a name".to_owned()));
        }
        for (bad, what) in [
            ("a/b", "/"),
            ("../x", "/"),
            ("a\\b", "\\\\"),
            ("a\nb", "\\n"),
        ] {
            let error = name(bad).expect_err("it is no name");
            assert!(error.contains(&format!("“{what}”")), "{bad:?}: {error}");
        }
        for hidden in [".", "..", ".ron", ".hidden"] {
            assert!(name(hidden).is_err(), "{hidden}");
        }
        assert!(name(&"x".repeat(300)).is_err_and(|error| error.contains("304 bytes")));
    }

    #[test]
    fn an_existing_file_is_replaced_only_if_that_was_asked_for() {
        let folder = folder_for("replace");
        let path = folder.join("new folder").join("a.ron");
        write(&path, b"first", false).expect("it is new, and so is its folder");
        let error = write(&path, b"second", false).expect_err("it exists");
        assert!(matches!(error, WriteError::Exists(_)), "{error}");
        assert_eq!(fs::read(&path).expect("there"), b"first");
        write(&path, b"second", true).expect("it may be replaced");
        assert_eq!(fs::read(&path).expect("there"), b"second");
        let left = fs::read_dir(path.parent().expect("a folder")).expect("there");
        assert_eq!(left.count(), 1, "no temporary file is left");
        assert_eq!(
            free_name(path.parent().expect("a folder"), "a", "ron"),
            "a 2"
        );
        fs::remove_dir_all(&folder).expect("it was made here");
    }

    #[test]
    fn what_the_system_refuses_is_said_and_leaves_nothing() {
        let folder = folder_for("refuse");
        let file = folder.join("file");
        fs::write(&file, "").expect("it can be written");
        for path in [file.join("below a file.ron"), folder.clone()] {
            let error = write(&path, b"text", true).expect_err("no such place");
            let text = error.to_string();
            assert!(text.starts_with("cannot write"), "{text}");
        }
        assert_eq!(fs::read_dir(&folder).expect("there").count(), 1);
        fs::remove_dir_all(&folder).expect("it was made here");
    }
}
