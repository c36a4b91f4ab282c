//! What has happened in the window.

use bevy::prelude::*;
use std::path::PathBuf;

/// A scene was opened, or could not be.
#[derive(Message, Debug, Clone)]
pub struct SceneLoaded {
    /// Its name.
    pub name: String,
    /// Why it could not be opened, for the user.
    pub error: Option<String>,
}

/// A picture was written, or could not be.
#[derive(Message, Debug, Clone)]
pub struct ScreenshotSaved {
    /// The file.
    pub path: PathBuf,
    /// What went wrong, for the user.
    pub error: Option<String>,
}
