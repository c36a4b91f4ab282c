//! Identity of a mesh.

use std::sync::atomic::{AtomicU64, Ordering};

/// Identifies a topology among all that were ever created in this process, for cached data of a
/// body that is derived from its elements.
///
/// Copies have the same identity, as have topologies after plastic [flow](crate::Plasticity): the
/// elements are the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TopologyId(u64);

impl TopologyId {
    fn next() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

/// Identity of a topology; ignored in comparisons.
#[derive(Debug, Clone)]
pub struct Identity(TopologyId);

impl Identity {
    /// Identity of the topology.
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
