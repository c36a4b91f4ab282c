//! The order of elimination of a body, which is kept while its pins change.

use super::{Workspace, elimination, work_in};
use crate::{Effects, Topology, TopologyId};

/// The order of elimination without pins, and for which kinds of elements on which topology; `None` if a
/// factorization would exceed the limit.
#[derive(Debug, Clone)]
pub(super) struct Known {
    kinds: u32,
    topology: TopologyId,
    ordered: Option<Ordered>,
}

#[derive(Debug, Clone)]
pub(super) struct Ordered {
    /// Multiplications of a factorization.
    pub work: u64,
    /// All particles.
    pub order: Vec<u32>,
}

impl Known {
    fn of(topology: &Topology, effects: &Effects) -> Self {
        let ordered = elimination(topology, effects).ok().map(|found| Ordered {
            work: work_in(&found),
            order: found.iter().map(|(particle, _)| *particle).collect(),
        });
        Self {
            kinds: super::kinds_of(effects),
            topology: topology.id(),
            ordered,
        }
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        self.ordered
            .as_ref()
            .map_or(0, |it| size_of_val(&it.order[..]))
    }
}

impl Workspace {
    /// The order of elimination without pins; `None` if a factorization would exceed the limit. It is kept.
    pub(super) fn ordered(&mut self, topology: &Topology, effects: &Effects) -> Option<&Ordered> {
        let wanted = (super::kinds_of(effects), topology.id());
        let known = self.known.take();
        let known = known.filter(|known| (known.kinds, known.topology) == wanted);
        let known = known.unwrap_or_else(|| Known::of(topology, effects));
        self.known.insert(known).ordered.as_ref()
    }
}
