//! Shortest useful substep in single precision.
//!
//! The shape of an element is rounded to ε of its size, so that projecting its constraint moves a
//! particle by a spurious d = ε s w‖∇C‖ / (Σ w‖∇C‖² + α/h²), with s the size that C is measured
//! against. In a substep gravity moves it by h²g. Where d > h²g, multipliers and forces are mostly
//! rounding. Motion still averages over it, as d has either sign, but more substeps do not improve
//! the result. A soft element does not reach that limit: with α > εsw‖∇C‖/g, d decreases with h² as
//! well.

use crate::{
    Body, Topology,
    elastic::{Elastic, Point, Visit},
};

/// Half an ulp of an f32, as a relative value.
const HALF_ULP: f64 = 0.5 * f32::EPSILON as f64;

/// Shortest substep [s] in which gravity of this strength [m/s²] still moves the particles of a
/// body more than rounding does; 0 if any length does, ∞ without gravity or movable particles.
#[must_use]
pub fn shortest_substep(body: &Body, gravity: f64) -> f64 {
    let mut shortest = Shortest {
        topology: &body.topology,
        body,
        gravity,
        square: 0.0,
    };
    body.effects.visit(&mut shortest);
    shortest.square.sqrt()
}

/// Maximum number of substeps per tick that single precision resolves for all of these bodies, at
/// least 1; `None` if there is no limit, or without gravity.
#[must_use]
pub fn max_substeps(bodies: &[Body], tick_seconds: f64, gravity: f64) -> Option<u32> {
    if gravity <= 0.0 {
        return None;
    }
    let each = bodies.iter().map(|body| shortest_substep(body, gravity));
    let shortest = each.fold(0.0, f64::max);
    (shortest > 0.0).then(|| ((tick_seconds / shortest) as u32).max(1))
}

struct Shortest<'a> {
    topology: &'a Topology,
    body: &'a Body,
    gravity: f64,
    /// h² [s²].
    square: f64,
}

impl Visit for Shortest<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        let particles = &self.body.particles;
        for (index, corners) in E::elements(self.topology).corners().enumerate() {
            let points = corners.map(|i| {
                let rest = self.topology.rest[i as usize].as_dvec3();
                let w = f64::from(particles.positions[i as usize].w);
                Point { x: rest, w, rest }
            });
            for row in effect.linear_rows(self.topology, index, points) {
                let terms = row.gradients.iter().zip(&points);
                let (mut weight, mut most) = (0.0, 0.0_f64);
                for (gradient, point) in terms {
                    weight += point.w * gradient.length_squared();
                    most = most.max(point.w * gradient.length());
                }
                if weight > 0.0 {
                    let noise = HALF_ULP * row.scale.abs() * most / self.gravity;
                    self.square = self.square.max((noise - row.compliance) / weight);
                }
            }
        }
    }
}
