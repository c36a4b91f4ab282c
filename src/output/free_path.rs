//! File names that do not overwrite existing files.

use std::path::{Path, PathBuf};

/// The name without characters that file systems reserve, such as those that separate folders.
pub fn plain_name(name: &str) -> String {
    let is_plain = |c: &char| c.is_alphanumeric() || matches!(c, '-' | '_');
    let plain = |c| Some(c).filter(is_plain).unwrap_or('-');
    name.chars().map(plain).collect()
}

/// The first name of name-001.png, name-002.png, … (for `png`) that is not taken.
pub fn free_path(name: &str, extension: &str, taken: impl Fn(&Path) -> bool) -> PathBuf {
    let plain = plain_name(name);
    (1..)
        .map(|n| PathBuf::from(format!("{plain}-{n:03}.{extension}")))
        .find(|path| !taken(path))
        .unwrap_or_default()
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
