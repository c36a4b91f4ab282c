//! Which bodies are meant.

use bevy::prelude::*;

/// Whose parameters are shown and changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scope {
    /// All bodies at once.
    #[default]
    All,
    /// One body, by its key.
    Body(u64),
}

impl Scope {
    /// Whether it has a body in it.
    #[must_use]
    pub fn contains(self, body: Entity) -> bool {
        match self {
            Self::All => true,
            Self::Body(key) => body.to_bits() == key,
        }
    }
}

/// The bodies that the panel shows, and that instruments look at.
#[derive(Resource, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Selection(pub Scope);
