//! Pinned vertices that an app moves.

#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{Topology, VertexIndex};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// Where pinned vertices are at the end of the next tick [m]. They move there at constant velocity,
/// evenly over the substeps, so that what hangs on them is pulled and not struck. Afterwards they stay
/// until the targets change. Of two targets of a vertex, the last one counts.
///
/// Vertices that are not pinned and targets that are not finite are ignored. A body whose pins are not at
/// their targets wakes.
///
/// ```
/// use glam::Vec3;
/// use pliant_solver::{PinTargets, VertexIndex};
///
/// let both = PinTargets::of(VertexIndex(0), Vec3::Y).and(VertexIndex(9), Vec3::X); // m
/// assert_eq!(both.0.len(), 2);
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(opaque),
    reflect(Component, Clone, Debug, Default, PartialEq),
    type_path = "pliant::effect"
)]
pub struct PinTargets(pub Vec<(VertexIndex, Vec3)>);

impl PinTargets {
    /// A target [m] for one vertex.
    #[must_use]
    pub fn of(vertex: VertexIndex, target: Vec3) -> Self {
        Self(vec![(vertex, target)])
    }

    /// With a target [m] for another vertex.
    #[must_use]
    pub fn and(mut self, vertex: VertexIndex, target: Vec3) -> Self {
        self.0.push((vertex, target));
        self
    }

    /// The first target that is not finite.
    #[must_use]
    pub fn first_not_finite(&self) -> Option<(VertexIndex, Vec3)> {
        self.0
            .iter()
            .copied()
            .find(|(_, target)| !target.is_finite())
    }

    /// The particles of a body that are pinned, with their targets [m].
    pub(crate) fn of_pins(
        &self,
        topology: &Topology,
        is_pinned: impl Fn(usize) -> bool,
    ) -> impl Iterator<Item = (usize, DVec3)> {
        let all = self.0.iter();
        all.filter(|(vertex, target)| vertex.index() < topology.particles() && target.is_finite())
            .map(|(vertex, target)| (topology.particle(*vertex), target.as_dvec3()))
            .filter(move |(i, _)| is_pinned(*i))
    }

    /// Whether a pin of a body with particles `at` these positions [m] is not at its target, but for
    /// rounding.
    pub(crate) fn lead_away(
        &self,
        topology: &Topology,
        is_pinned: impl Fn(usize) -> bool,
        at: impl Fn(usize) -> DVec3,
    ) -> bool {
        let mut pins = self.of_pins(topology, is_pinned);
        pins.any(|(i, target)| at(i).distance(target) > 1e-6 * target.length().max(1.0))
    }
}
