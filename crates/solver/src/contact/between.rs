//! Kinds of contact.

/// Kind of contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Between {
    /// Between different bodies.
    Bodies,
    /// Of a body with itself.
    Itself,
    /// Of a body with colliders that are meshes.
    Colliders,
}

/// Number of kinds of contact.
pub(super) const KINDS: usize = 3;
