//! Selection of bodies.

use bevy::prelude::*;

/// The bodies whose parameters are shown and changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scope {
    /// All bodies at once.
    #[default]
    All,
    /// One body, by its key.
    Body(u64),
}

impl Scope {
    /// Whether it includes a body.
    #[must_use]
    pub fn contains(self, body: Entity) -> bool {
        match self {
            Self::All => true,
            Self::Body(key) => body.to_bits() == key,
        }
    }
}

/// The bodies that the panel shows and the instruments measure.
#[derive(Resource, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Selection(pub Scope);
