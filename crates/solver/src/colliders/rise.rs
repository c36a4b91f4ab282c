//! The speed at which what is inside a surface comes out of it.

use crate::Topology;

/// Time constant τ [s] with which particles that start a substep below the ground or in a collider rise:
/// a fraction h/τ of their depth per substep.
///
/// Moved to the surface at once, a body that starts half below the ground would gain a velocity
/// inversely proportional to the substep: half a meter in 1/600 s is 300 m/s.
const RISE_TIME: f64 = 0.4;

/// Below this depth in a collider, as a fraction of the size of the body, particles rise at a steady speed:
/// a fraction of what is left would never end.
const LAST: f64 = 0.1;

/// Particles rise by at most this fraction of their depth in a substep: what is on the surface up to rounding is neither
/// inside nor outside, and the next pass could take it for either.
const NEARLY: f64 = 0.999;

/// Fraction of its depth by which a particle rises that starts a substep of `h` seconds below the ground
/// or in a collider.
pub(crate) fn rise(h: f32) -> f64 {
    (f64::from(h) / RISE_TIME).min(1.0)
}

/// How far particles rise in a substep that start it in a collider.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rise {
    /// Size of the body at rest, to the centers of grains [m].
    size: f64,
    fraction: f64,
}

impl Rise {
    /// Of a body, in a substep of `h` seconds.
    pub fn of(topology: &Topology, h: f32) -> Self {
        let [low, high] = topology.bounds;
        Self {
            size: (high - low).max_element().into(),
            fraction: rise(h),
        }
    }

    /// From this depth [m]: in τ at most by the size of the body, however deep it is.
    pub fn at(self, depth: f64) -> f64 {
        let most = if self.size > 0.0 {
            self.size
        } else {
            f64::INFINITY
        };
        let counted = depth.max(LAST * self.size).min(most);
        (counted * self.fraction).min(NEARLY * depth)
    }
}
