//! Workspace for copies of a body.

use crate::{
    ElasticKind,
    kernel::copies::{CopiedMultipliers, Copies},
};

/// Workspace of a group of copies; that of the first is used. No part of the state of a body: copies
/// are empty, and any two are equal.
#[derive(Debug, Default)]
pub struct Workspace {
    pub copies: Copies,
    /// Multipliers of each elastic effect; empty where they are not stored.
    pub multipliers: [CopiedMultipliers; ElasticKind::COUNT],
}

impl Clone for Workspace {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl PartialEq for Workspace {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Workspace {
    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        let columns = self.multipliers.iter();
        self.copies.bytes() + columns.map(|it| size_of_val(&it[..])).sum::<usize>()
    }
}
