//! Candidates that may act in a substep, and what has become of them.

use super::{closest::Kind, gaps::Pairs};
use crate::lanes::Instructions;
use std::ops::Range;

/// A candidate that may act in the substep.
#[derive(Debug, Clone, Copy)]
pub(super) struct Open {
    /// Indices of the corners in the pieces.
    pub corners: [u32; 4],
    /// Index of the candidate, until truncation finds new ones.
    pub candidate: u32,
    /// Lower bound of the gap at the start of the substep [m], and that less the distance to maintain.
    pub gap: f32,
    pub room: f32,
    /// What has become of it.
    pub row: OpenRow,
}

/// The row of a candidate that may act.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum OpenRow {
    /// It was not needed so far.
    Unknown,
    /// There is none.
    None,
    /// The one with this index among those of its kind of contact.
    Some(u32),
}

/// The open candidates of a batch.
#[derive(Debug, Clone, Copy)]
pub(super) struct OpenBatch {
    /// Number of its batch, until truncation finds new ones.
    pub batch: usize,
    pub kind: Kind,
    /// The first among those of the part, and their number.
    pub first: u32,
    pub count: u32,
    /// The smallest room [m].
    pub least: f32,
    /// Whether one has a row.
    pub has_rows: bool,
}

impl OpenBatch {
    /// Its candidates among those of the part.
    pub fn range(&self) -> Range<usize> {
        self.first as usize..(self.first + self.count) as usize
    }
}

/// The open candidates of some batches, found by one thread; reused.
#[derive(Debug, Default)]
pub(super) struct NearPart {
    /// Its batches.
    pub batches: Range<usize>,
    /// The open candidates of each.
    pub opened: Vec<OpenBatch>,
    pub open: Vec<Open>,
    /// Lower bound of the gap of each of its candidates [m].
    pub gaps: Vec<f32>,
    pub pairs: Pairs,
    /// Candidates of a batch whose gaps are computed.
    pub picked: Vec<u32>,
    pub instructions: Instructions,
}
