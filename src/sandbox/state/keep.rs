//! Keeping work: files that were opened, and what is being written.

use bevy::prelude::*;
use std::path::{Path, PathBuf};

/// Maximum number of recent files.
const MAX_RECENT: usize = 10;

/// A request of the File menu or its keys.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum KeepRequest {
    /// Ask for a file to open.
    OpenCard,
    /// Open a scene, a snapshot or a mesh file.
    Open(PathBuf),
    /// Save the scene into its own file; ask for a name if it has none.
    Save,
    /// Ask for a name, and save.
    SaveAs(FileKind),
    /// Start or end a recording.
    Record,
    /// Save a picture without panel and figures.
    PlainPicture,
}

/// A kind of file that a state is saved in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// A scene file: how the scene begins.
    Scene,
    /// A snapshot: the state of this moment.
    Snapshot,
}

impl FileKind {
    /// Ending of its files.
    #[must_use]
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Scene => "ron",
            Self::Snapshot => "snap",
        }
    }
}

/// A file that was opened or saved.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecentFile {
    /// Its absolute path.
    pub path: PathBuf,
    /// Whether it still exists.
    pub exists: bool,
}

/// The files that were opened or saved last, newest first.
#[derive(Resource, Debug, Clone, Default, PartialEq, Eq)]
pub struct RecentFiles(Vec<RecentFile>);

impl RecentFiles {
    /// The files of a list of paths, newest first.
    #[must_use]
    pub fn of(paths: &[String]) -> Self {
        let mut recent = Self::default();
        for path in paths.iter().rev().filter(|path| !path.is_empty()) {
            recent.note(Path::new(path));
        }
        recent
    }

    /// Moves a file to the front. A relative path is completed.
    pub fn note(&mut self, path: &Path) {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let exists = path.exists();
        self.0.retain(|file| file.path != path);
        self.0.insert(0, RecentFile { path, exists });
        self.0.truncate(MAX_RECENT);
    }

    /// Removes a file.
    pub fn forget(&mut self, path: &Path) {
        self.0.retain(|file| file.path != path);
    }

    /// Looks again which files exist; true if that has changed.
    pub fn refresh(&mut self) -> bool {
        let before = self.0.clone();
        for file in &mut self.0 {
            file.exists = file.path.exists();
        }
        self.0 != before
    }

    /// The files, newest first.
    #[must_use]
    pub fn files(&self) -> &[RecentFile] {
        &self.0
    }

    /// Paths of the files, newest first.
    #[must_use]
    pub fn paths(&self) -> Vec<String> {
        let paths = self.0.iter();
        paths
            .map(|file| file.path.to_string_lossy().into_owned())
            .collect()
    }
}

/// A recording under way.
#[derive(Resource, Debug, Clone, Default, PartialEq)]
pub struct RecordingStatus {
    /// The file; `None` while nothing is recorded.
    pub file: Option<PathBuf>,
    /// Recorded simulated time [s].
    pub seconds: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_opened_again_comes_first_and_the_list_is_short() {
        let mut recent = RecentFiles::default();
        for number in 0..20 {
            recent.note(Path::new(&format!("/tmp/{number}.ron")));
        }
        recent.note(Path::new("/tmp/15.ron"));
        let paths = recent.paths();
        assert_eq!(paths.len(), MAX_RECENT);
        assert_eq!(&paths[..2], ["/tmp/15.ron", "/tmp/19.ron"]);
        assert_eq!(
            paths.iter().filter(|path| *path == "/tmp/15.ron").count(),
            1
        );
        assert_eq!(RecentFiles::of(&paths).paths(), paths);
    }

    #[test]
    fn a_file_that_is_gone_is_marked() {
        let path = std::env::temp_dir().join(format!("pliant-recent-{}.ron", std::process::id()));
        std::fs::write(&path, "").expect("it can be written");
        let mut recent = RecentFiles::default();
        recent.note(&path);
        assert!(!recent.refresh());
        std::fs::remove_file(&path).expect("it was made here");
        assert!(recent.refresh());
        assert!(!recent.files()[0].exists);
        recent.forget(&path);
        assert!(recent.files().is_empty());
    }
}
