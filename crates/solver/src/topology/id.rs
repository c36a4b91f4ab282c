//! Which mesh a topology is of.

use std::sync::atomic::{AtomicU64, Ordering};

/// Tells a topology from all others that were ever made in this process, for what is kept beside a body and follows from
/// its elements.
///
/// A copy has the same one, and so has a topology whose rest values have [flowed](crate::Plasticity): its elements are
/// the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TopologyId(u64);

impl TopologyId {
    fn next() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

/// The identity of a topology; it makes no difference between those that are equal.
#[derive(Debug, Clone)]
pub struct Identity(TopologyId);

impl Identity {
    /// Which topology it is of.
    #[must_use]
    pub fn id(&self) -> TopologyId {
        self.0
    }
}

impl Default for Identity {
    fn default() -> Self {
        Self(TopologyId::next())
    }
}

impl PartialEq for Identity {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}
