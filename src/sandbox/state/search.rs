//! The search of the panel.

use bevy::prelude::*;

/// The search of the panel.
#[derive(Resource, Debug, Clone, PartialEq, Eq, Default)]
pub struct PanelSearch {
    /// The text; empty shows the whole panel.
    pub text: String,
    /// Whether the field is shown.
    pub open: bool,
    /// Whether the field takes the keyboard focus in the next frame.
    pub focus: bool,
}
