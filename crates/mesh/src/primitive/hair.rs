//! Strands of hair on a ball.

use glam::DVec3;
use pliant_solver::RestShape;

use crate::Strands;

/// Strands that leave a ball of a radius [m] at right angles, with roots that cover it evenly within
/// the coverage (a Fibonacci lattice).
pub fn grow(radius: f32, strands: &Strands) -> RestShape {
    let golden = core::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let lowest = libm::cos(f64::from(strands.coverage).to_radians());
    let mut shape = RestShape::default();
    for strand in 0..strands.count {
        let part = (f64::from(strand) + 0.5) / f64::from(strands.count);
        let y = 1.0 - part * (1.0 - lowest);
        let around = golden * f64::from(strand);
        let flat = (1.0 - y * y).max(0.0).sqrt();
        let out = DVec3::new(flat * libm::cos(around), y, flat * libm::sin(around));
        strands.add(&mut shape, DVec3::ZERO, out, f64::from(radius));
    }
    shape
}
