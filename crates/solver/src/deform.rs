//! Deformations for stress tests: squashed, flat, scrambled, inverted.
//!
//! They move the particles that are not pinned and set their velocities to zero; rest shapes do not
//! change. [`reset_shape`] returns a body to its rest shape.

pub use crate::kernel::random::Random;

use super::{Particles, Topology, topology::bounds};
use crate::kernel::fit::rotation_between;
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// A deformation of the current state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub enum Deformation {
    /// Scales heights above the lowest point by a factor (0 is flat, 1 changes nothing).
    Squash(f32),
    /// Projects onto the vertical line through the middle; heights do not change.
    Line,
    /// Moves every particle to a random position in the bounding box, by a seed.
    Shuffle(u32),
    /// Swaps left and right, so that every tetrahedron is inverted.
    Mirror,
    /// Scales all distances from the middle by a factor.
    Scale(f32),
}

/// Applies a deformation; a factor that is not finite changes nothing.
pub fn deform(particles: &mut Particles, deformation: Deformation) {
    let (low, high) = bounds(particles.positions.iter().map(|x| x.truncate()));
    let middle = (low + high) / 2.0;
    let mut random = Random::new(match deformation {
        Deformation::Shuffle(seed) => seed,
        _ => 0,
    });
    for x in &mut particles.positions {
        let place = x.truncate();
        let moved = match deformation {
            Deformation::Squash(factor) if factor.is_finite() => {
                Vec3::new(place.x, low.y + (place.y - low.y) * factor, place.z)
            }
            Deformation::Scale(factor) if factor.is_finite() => middle + (place - middle) * factor,
            Deformation::Squash(_) | Deformation::Scale(_) => place,
            Deformation::Shuffle(_) => {
                let fraction = Vec3::new(random.next(), random.next(), random.next());
                low + (high - low) * fraction
            }
            Deformation::Line => Vec3::new(middle.x, place.y, middle.z),
            Deformation::Mirror => Vec3::new(2.0 * middle.x - place.x, place.y, place.z),
        };
        if x.w > 0.0 {
            *x = moved.extend(x.w);
        }
    }
    particles.settle();
}

/// Moves a body to its rest shape at its present place: about its present mean position, turned by
/// the best rotation of the rest shape onto its present one (least squares over the particles), and
/// raised if it would reach below its present lowest point. Velocities are zero afterwards. Pinned
/// particles stay; plastic flow of rest values is kept.
pub fn reset_shape(particles: &mut Particles, topology: &Topology) {
    let count = particles.len();
    if count == 0 || count != topology.rest.len() {
        return;
    }
    let rest = || topology.rest.iter().map(|x| x.as_dvec3());
    let now: Vec<DVec3> = (0..count).map(|i| particles.position(i)).collect();
    let mean = |sum: DVec3| sum / count as f64;
    let rest_middle = mean(rest().fold(DVec3::ZERO, |sum, x| sum + x));
    let middle = mean(now.iter().fold(DVec3::ZERO, |sum, &x| sum + x));
    let rotation = rotation_between(
        rest().map(|x| x - rest_middle),
        now.iter().map(|&x| x - middle),
    );
    let goal = |x: DVec3| middle + rotation * (x - rest_middle);
    let lowest = |low: f64, x: DVec3| low.min(x.y);
    let before = now.iter().copied().fold(f64::INFINITY, lowest);
    let after = rest().map(goal).fold(f64::INFINITY, lowest);
    let raised = DVec3::Y * (before - after).max(0.0);
    for (x, rest) in particles.positions.iter_mut().zip(rest()) {
        let moved = (goal(rest) + raised).as_vec3();
        if x.w > 0.0 && moved.is_finite() {
            *x = moved.extend(x.w);
        }
    }
    particles.settle();
}
