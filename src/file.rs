//! Files that are replaced only when their new content is complete.

use std::{
    ffi::OsString,
    fs::{self, File},
    io::{self, Write as _},
    path::{Path, PathBuf},
};

/// Writes a file beside its place and renames it: a file that was there is replaced by a complete
/// one, or stays as it is. Links are followed. What is not a regular file, such as `/dev/stdout`, and
/// a file in a folder in which no other can be made, are written directly.
///
/// # Errors
/// Of the system; a file that was there is unchanged, unless it is written directly.
pub fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    // Where the system shows its devices, the file behind a name is not one to be renamed.
    if path.starts_with("/dev") || path.starts_with("/proc") {
        return fs::write(path, bytes);
    }
    // A link stays a link to the new content.
    let place = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let found = fs::metadata(&place).ok();
    match &found {
        Some(found) if found.is_dir() => return Err(io::Error::other("it is a folder")),
        Some(found) if !found.is_file() => return fs::write(&place, bytes),
        Some(found) if found.permissions().readonly() => {
            return Err(io::Error::other("it is read-only"));
        }
        _ => {}
    }
    let beside = beside(&place);
    let mut file = match File::create_new(&beside) {
        // In a folder in which nothing can be made, only the file itself can be written.
        Err(error) if error.kind() == io::ErrorKind::PermissionDenied => {
            return fs::write(&place, bytes);
        }
        made => made?,
    };
    let replaced = file
        .write_all(bytes)
        .and_then(|()| file.sync_all())
        .and_then(|()| match found {
            Some(found) => fs::set_permissions(&beside, found.permissions()),
            None => Ok(()),
        })
        .and_then(|()| fs::rename(&beside, &place));
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
        let writable = fs::metadata(&path).expect("it is there").permissions();
        let mut readonly = writable.clone();
        readonly.set_readonly(true);
        fs::set_permissions(&path, readonly).expect("it is ours");
        assert!(replace(&path, b"after").is_err());
        assert_eq!(fs::read(&path).expect("it is there"), b"before");
        fs::set_permissions(&path, writable).expect("it is ours");
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
