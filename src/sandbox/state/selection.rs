//! Selection of bodies.

use bevy::prelude::*;
use std::collections::BTreeSet;

/// The bodies whose parameters are shown and changed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Scope {
    /// All bodies at once.
    #[default]
    All,
    /// Some bodies, by their keys: the bits of their entities. Never empty.
    Bodies(BTreeSet<u64>),
}

impl Scope {
    /// One body.
    #[must_use]
    pub fn body(body: Entity) -> Self {
        Self::key(body.to_bits())
    }

    /// One body, by its key.
    #[must_use]
    pub fn key(key: u64) -> Self {
        Self::Bodies(BTreeSet::from([key]))
    }

    /// Several bodies; all for none.
    #[must_use]
    pub fn of(keys: impl IntoIterator<Item = u64>) -> Self {
        let keys: BTreeSet<u64> = keys.into_iter().collect();
        if keys.is_empty() {
            Self::All
        } else {
            Self::Bodies(keys)
        }
    }

    /// Whether it includes a body.
    #[must_use]
    pub fn contains(&self, body: Entity) -> bool {
        self.contains_key(body.to_bits())
    }

    /// Whether it includes the body with a key.
    #[must_use]
    pub fn contains_key(&self, key: u64) -> bool {
        match self {
            Self::All => true,
            Self::Bodies(keys) => keys.contains(&key),
        }
    }

    /// Whether a body is selected by itself, and not only as one of all.
    #[must_use]
    pub fn names(&self, key: u64) -> bool {
        matches!(self, Self::Bodies(keys) if keys.contains(&key))
    }

    /// Keys of the bodies that are selected by themselves, in order.
    pub fn keys(&self) -> impl Iterator<Item = u64> + '_ {
        let keys = match self {
            Self::All => None,
            Self::Bodies(keys) => Some(keys),
        };
        keys.into_iter().flatten().copied()
    }

    /// The key of the body, if exactly one is selected.
    #[must_use]
    pub fn single(&self) -> Option<u64> {
        let mut keys = self.keys();
        keys.next().filter(|_| keys.next().is_none())
    }

    /// With a body added, or removed if it was selected; all if none is left.
    #[must_use]
    pub fn toggled(&self, key: u64) -> Self {
        let others = self.keys().filter(|other| *other != key);
        Self::of(others.chain((!self.names(key)).then_some(key)))
    }

    /// Without the bodies that do not satisfy `exists`; all if none is left.
    #[must_use]
    pub fn retained(&self, exists: impl Fn(u64) -> bool) -> Self {
        Self::of(self.keys().filter(|key| exists(*key)))
    }
}

/// The bodies that the panel shows and the instruments measure.
#[derive(Resource, Debug, Clone, PartialEq, Eq, Default)]
pub struct Selection(pub Scope);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn toggling_adds_and_removes_and_the_last_one_gives_all() {
        let one = Scope::All.toggled(3);
        assert_eq!(one, Scope::key(3));
        assert_eq!(one.single(), Some(3));
        let two = one.toggled(5);
        assert_eq!(two, Scope::of([5, 3]));
        assert_eq!(two.single(), None);
        assert_eq!(two.toggled(3), Scope::key(5));
        assert_eq!(one.toggled(3), Scope::All);
    }

    #[test]
    fn all_contains_every_body_but_names_none() {
        assert!(Scope::All.contains_key(7));
        assert!(!Scope::All.names(7));
        assert_eq!(Scope::of([1, 2]).retained(|key| key == 2), Scope::key(2));
        assert_eq!(Scope::key(1).retained(|_| false), Scope::All);
    }
}
