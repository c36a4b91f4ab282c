//! Workspace for bodies whose particles are stepped in lanes.

use crate::{
    ElasticKind,
    kernel::{
        copies::{CopiedMultipliers, Copies},
        strips::StripColumns,
    },
};

/// Workspace of a group of copies, that of the first of them, or of a body in strips; most bodies have
/// none. No part of the state of a body: copies are empty, and any two are equal.
#[derive(Debug, Default)]
pub struct Workspace(Option<Box<Columns>>);

/// Columns in lanes.
#[derive(Debug, Default)]
pub struct Columns {
    pub copies: Copies,
    /// Multipliers of each elastic effect for all copies; empty where they are not stored.
    pub multipliers: [CopiedMultipliers; ElasticKind::COUNT],
    pub strips: StripColumns,
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
                + columns.strips.bytes()
                + multipliers.map(|it| size_of_val(&it[..])).sum::<usize>()
        })
    }
}
