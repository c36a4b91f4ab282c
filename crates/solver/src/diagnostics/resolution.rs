//! How short a substep may be in single precision.
//!
//! The shape of an element is rounded to ε of its size, so that a projection of its constraint moves a
//! particle by d = ε s w‖∇C‖ / (Σ w‖∇C‖² + α/h²) for nothing, s being what C is measured against. In a
//! substep gravity moves it by h²g. Where d > h²g, multipliers and forces are mostly rounding. Motion
//! still averages over it, as d has either sign, but no further substep makes an answer better. A soft
//! element never comes to that: with α > εsw‖∇C‖/g, d falls with h² as well.

use crate::{
    Body, Topology,
    elastic::{Elastic, Point, Visit},
};

/// Half of the last digit of an f32, relative to it.
const HALF_ULP: f64 = 0.5 * f32::EPSILON as f64;

/// The shortest substep [s] in which gravity of this strength [m/s²] still moves a body's particles by
/// more than rounding does; 0 if all are, ∞ without gravity or with nothing that moves.
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

/// The most substeps a tick that single precision resolves for all of these bodies, at least 1; `None` if any
/// number of them, or without gravity.
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
