//! Strands of hair on a ball.

use glam::{DVec3, Vec3};
use pliant_solver::RestShape;

/// Measures of a head of hair.
#[derive(Debug, Clone, Copy)]
pub struct Hair {
    /// Radius of the ball [m].
    pub radius: f32,
    /// Largest angle of a root from the top [°].
    pub coverage: f32,
    /// Number of strands.
    pub strands: u32,
    /// Length of a strand along its axis [m].
    pub length: f32,
    /// Segments of a strand.
    pub segments: u32,
    /// Radius of the curls [m].
    pub curl: f32,
    /// Turns of a curl.
    pub turns: f32,
}

/// Fraction of a strand over which its curl grows to its radius.
const GROWTH: f64 = 0.3;

/// Strands that leave the ball at right angles, with roots that cover it evenly (a Fibonacci
/// lattice). The first segment of each is straight.
pub fn grow(hair: &Hair) -> RestShape {
    let nodes = hair.segments + 1;
    let golden = core::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let lowest = libm::cos(f64::from(hair.coverage).to_radians());
    let mut shape = RestShape::default();
    for strand in 0..hair.strands {
        let part = (f64::from(strand) + 0.5) / f64::from(hair.strands);
        let y = 1.0 - part * (1.0 - lowest);
        let around = golden * f64::from(strand);
        let flat = (1.0 - y * y).max(0.0).sqrt();
        let out = DVec3::new(flat * libm::cos(around), y, flat * libm::sin(around));
        let (u, v) = out.any_orthonormal_pair();
        let place = |k: u32| -> Vec3 {
            let t = f64::from(k.saturating_sub(1)) / f64::from(hair.segments.max(2) - 1);
            let along = f64::from(k) / f64::from(hair.segments) * f64::from(hair.length);
            let angle = core::f64::consts::TAU * f64::from(hair.turns) * t;
            let curl = f64::from(hair.curl) * (t / GROWTH).min(1.0);
            let aside = u * (libm::cos(angle) * curl) + v * (libm::sin(angle) * curl);
            (out * (f64::from(hair.radius) + along) + aside).as_vec3()
        };
        let first = strand * nodes;
        shape.vertices.extend((0..nodes).map(place));
        let edges = (first..first + hair.segments).map(|i| [i, i + 1]);
        shape.edges.extend(edges);
    }
    shape
}
