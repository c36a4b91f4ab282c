//! The scene browser.

use bevy::prelude::*;

/// Whether the scene browser is open.
#[derive(Resource, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Browser {
    /// Whether it is open.
    pub open: bool,
}
