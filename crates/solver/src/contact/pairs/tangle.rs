//! Two surfaces that cross.

use super::bounds::Bounds;
use glam::DVec3;

/// Two surfaces that cross, or one that crosses itself.
#[derive(Debug, Clone)]
pub(super) struct Tangle {
    /// Indices of the members, in ascending order.
    pub members: [u32; 2],
    /// Box around the crossings, and the corners of pairs that are left out.
    pub bounds: Bounds,
    /// Direction in which the first one leaves the second, a unit vector.
    pub direction: DVec3,
    /// λ [kg·m].
    pub multiplier: f64,
}
