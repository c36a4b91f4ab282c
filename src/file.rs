//! Files that are replaced only when their new content is complete.

use std::{
    ffi::OsString,
    fs::{self, File},
    io::{self, Write as _},
    path::{Path, PathBuf},
};

/// Writes a file beside its place and renames it: a file that was there is replaced by a complete
/// one, or stays as it is. Links are followed. What is not a regular file, such as `/dev/stdout`, is
/// written directly.
///
/// # Errors
/// Of the system; a file that was there is unchanged in this case.
pub fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    // A link stays a link to the new content.
    let place = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    match fs::metadata(&place) {
        Ok(found) if found.is_dir() => return Err(io::Error::other("it is a folder")),
        Ok(found) if !found.is_file() => return fs::write(&place, bytes),
        _ => {}
    }
    let beside = beside(&place);
    let written = File::create(&beside).and_then(|mut file| {
        file.write_all(bytes)?;
        file.sync_all()
    });
    let replaced = written.and_then(|()| fs::rename(&beside, &place));
    if replaced.is_err() {
        // What could not be finished is of no use; that it cannot be removed changes nothing.
        let _ = fs::remove_file(&beside);
    }
    replaced
}

/// The temporary file of a file.
#[must_use]
pub fn beside(path: &Path) -> PathBuf {
    let mut name = path.file_name().map_or_else(OsString::new, OsString::from);
    name.push(format!(".{}.part", std::process::id()));
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        let name = format!("pliant-file-{}-{name}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        fs::create_dir_all(&folder).expect("a folder for temporary files");
        folder
    }

    #[test]
    fn a_file_is_replaced_as_a_whole_and_nothing_else_is_left() {
        let folder = folder("replaced");
        let path = folder.join("a.csv");
        replace(&path, b"before").expect("it can be written");
        replace(&path, b"after").expect("it can be written");
        assert_eq!(fs::read(&path).expect("it is there"), b"after");
        assert_eq!(fs::read_dir(&folder).expect("a folder").count(), 1);
        fs::remove_dir_all(folder).expect("it was made here");
    }

    #[test]
    fn a_file_that_cannot_be_written_stays_as_it_is() {
        let folder = folder("kept");
        let path = folder.join("a.snap");
        fs::write(&path, "before").expect("it can be written");
        // What is written beside it cannot be: there is a folder of this name.
        fs::create_dir(beside(&path)).expect("it can be made");
        assert!(replace(&path, b"after").is_err());
        assert_eq!(fs::read(&path).expect("it is there"), b"before");
        assert!(replace(&folder, b"after").is_err(), "a folder is no file");
        fs::remove_dir_all(folder).expect("it was made here");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link_to_the_new_content() {
        let folder = folder("linked");
        let (path, link) = (folder.join("a.csv"), folder.join("link.csv"));
        fs::write(&path, "before").expect("it can be written");
        std::os::unix::fs::symlink(&path, &link).expect("it can be linked");
        replace(&link, b"after").expect("it can be written");
        assert_eq!(fs::read(&path).expect("it is there"), b"after");
        assert!(link.is_symlink());
        fs::remove_dir_all(folder).expect("it was made here");
    }
}
