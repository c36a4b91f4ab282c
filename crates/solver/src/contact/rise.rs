//! The speed at which what is inside a surface comes out of it.

/// Time constant τ [s] with which particles that start a substep below the ground or in a collider rise:
/// a fraction h/τ of their depth per substep.
///
/// Moved to the surface at once, a body that starts half below the ground would gain a velocity
/// inversely proportional to the substep: half a meter in 1/600 s is 300 m/s.
const RISE_TIME: f64 = 0.4;

/// They rise at this speed [m/s] at most, the largest recovery speed of a contact: a ball of gravel in a
/// mountain is not shot out of it.
const RISE_SPEED: f64 = 10.0;

/// How far particles rise in a substep that start it below the ground or in a collider.
#[derive(Debug, Clone, Copy)]
pub struct Rise {
    /// Fraction of the depth.
    pub fraction: f64,
    /// The most [m].
    pub most: f64,
}

impl Rise {
    /// In a substep of `h` seconds.
    pub fn in_substep(h: f32) -> Self {
        let h = f64::from(h);
        Self {
            fraction: (h / RISE_TIME).min(1.0),
            most: h * RISE_SPEED,
        }
    }

    /// From this depth [m].
    pub fn from_depth(self, depth: f64) -> f64 {
        (depth * self.fraction).min(self.most)
    }
}
