//! Appearance of bodies that the user changes.

use bevy::prelude::*;

/// A body that is simulated but not drawn, and that the pointer does not hit.
#[derive(Component, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct HiddenBody;
