//! Workspace for copies of a body.

use crate::{
    ElasticKind,
    kernel::copies::{CopiedMultipliers, Copies},
};

/// Workspace of a group of copies; that of the first is used, most bodies have none. No part of the
/// state of a body: copies are empty, and any two are equal.
#[derive(Debug, Default)]
pub struct Workspace(Option<Box<Columns>>);

/// Columns for all copies.
#[derive(Debug, Default)]
pub struct Columns {
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
    /// The columns, which are allocated if there are none.
    pub fn columns(&mut self) -> &mut Columns {
        self.0.get_or_insert_default()
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        self.0.as_ref().map_or(0, |columns| {
            let multipliers = columns.multipliers.iter();
            size_of::<Columns>()
                + columns.copies.bytes()
                + multipliers.map(|it| size_of_val(&it[..])).sum::<usize>()
        })
    }
}
