//! Events of the window.

use bevy::prelude::*;
use std::path::PathBuf;

/// A scene was opened, or failed to open.
#[derive(Message, Debug, Clone)]
pub struct SceneLoaded {
    /// Its name.
    pub name: String,
    /// Error message for the user, if it failed.
    pub error: Option<String>,
}

/// A screenshot was written, or failed to be.
#[derive(Message, Debug, Clone)]
pub struct ScreenshotSaved {
    /// The file.
    pub path: PathBuf,
    /// Error message for the user, if it failed.
    pub error: Option<String>,
}
