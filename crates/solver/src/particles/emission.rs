//! What the emitters of a body have emitted.

use serde::{Deserialize, Serialize};

/// State of the emitters of a body, and where it comes from if it is a copy.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Emission {
    /// Of its [`Emitter`](crate::Emitter).
    pub grains: Flow,
    /// Of its [`BodyEmitter`](crate::BodyEmitter).
    pub copies: Flow,
    /// Age of each grain [ticks].
    pub(crate) ages: Vec<u32>,
    /// The emitter of bodies that it comes from.
    pub(crate) origin: Option<Origin>,
}

/// What an emitter has emitted, and what is due.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Flow {
    /// Ticks in which it acted.
    pub(crate) ticks: u64,
    /// How many were due.
    pub(crate) due: u64,
    /// How many were emitted.
    pub(crate) emitted: u64,
    /// Part of the next one that is due, as a multiple of 1/f in fixed point.
    pub(crate) phase: u64,
}

/// Where a copy of a body comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Origin {
    /// Number of the body with the emitter, from 0, in the order of spawning.
    pub source: u32,
    /// [`Flow::ticks`] of the emitter when the copy left it.
    pub birth: u64,
}

impl Flow {
    /// How many were emitted.
    #[must_use]
    pub const fn emitted(&self) -> u64 {
        self.emitted
    }

    /// How many are due and wait for a place.
    #[must_use]
    pub const fn waiting(&self) -> u64 {
        self.due - self.emitted
    }

    /// Drops what waits.
    pub(crate) fn drop_waiting(&mut self) {
        self.due = self.emitted;
    }
}

impl Emission {
    /// Number of the body that this one is a copy of, from 0, in the order of spawning; `None` if it
    /// was not emitted, or that one was removed.
    #[must_use]
    pub fn source(&self) -> Option<u32> {
        self.origin.map(|origin| origin.source)
    }

    /// Forgets a body that was removed, by its number, and renumbers later ones.
    pub fn forget_body(&mut self, number: u32) {
        self.origin = self.origin.filter(|origin| origin.source != number);
        if let Some(origin) = &mut self.origin {
            origin.source -= u32::from(origin.source > number);
        }
    }

    /// Memory use in bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.ages[..])
    }
}
