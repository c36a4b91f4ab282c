//! Stretch: C = ‖x₁ − x₀‖ − L₀ [m] on every edge.
//!
//! λ/h² is the force that the edge pulls with, in N (negative when it pulls). Compliance is in
//! m/N: an edge under a force F settles at C = αF.

use super::{Multipliers, at, push};
use crate::solver::{Compliance, Damping, Stiffness, topology::Edges};
use glam::{Vec3, Vec4};
use serde::{Deserialize, Serialize};

/// Edges resist a change of length.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Stretch {
    /// Compliance of each edge [m/N]; default 0, rigid.
    pub compliance: Compliance,
    /// Axial stiffness EA [N], which does not depend on how finely a rope is divided: an edge of
    /// rest length L₀ adds L₀/EA to its compliance. Default ∞, which adds nothing.
    pub axial_stiffness: Stiffness,
    /// Damping τ [s], see the [module](super); default 0.
    pub damping: Damping,
}

/// The parameters as a substep of a given length needs them.
#[derive(Debug, Clone, Copy)]
pub struct Coefficients {
    /// α/h² [1/kg].
    alpha: f32,
    /// 1/(EA h²) [1/(kg·m)], to be multiplied by L₀.
    alpha_per_length: f32,
    /// γ = τ/h.
    gamma: f32,
}

impl Stretch {
    /// For a substep of `h` seconds.
    #[must_use]
    pub fn coefficients(&self, h: f32) -> Coefficients {
        let per_step = 1.0 / (h * h);
        Coefficients {
            alpha: self.compliance.get() * per_step,
            alpha_per_length: per_step / self.axial_stiffness.get(),
            gamma: self.damping.get() / h,
        }
    }

    /// Compliance [m/N] of an edge of the given rest length [m].
    #[must_use]
    pub fn compliance_of(&self, rest_length: f32) -> f64 {
        f64::from(self.compliance.get())
            + f64::from(rest_length) / f64::from(self.axial_stiffness.get())
    }
}

/// One sweep over all edges.
///
/// An edge of length zero has no direction; it is pushed apart along the direction that it has
/// in the rest shape, so that a body squeezed to a point opens, always in the same way. If it
/// has no length at rest either, it is left alone.
pub fn solve(
    positions: &mut [Vec4],
    previous: &[Vec4],
    edges: &Edges,
    rest: &[Vec3],
    coefficients: Coefficients,
    mut multipliers: Multipliers,
) {
    let Coefficients {
        alpha,
        alpha_per_length,
        gamma,
    } = coefficients;
    for (index, (&[a, b], &rest_length)) in edges.ends.iter().zip(&edges.rest_length).enumerate() {
        let weight = positions[a as usize].w + positions[b as usize].w;
        if weight == 0.0 {
            continue;
        }
        let d = at(positions, b) - at(positions, a);
        let length = d.length();
        let direction = if length > 0.0 {
            d / length
        } else {
            (rest[b as usize] - rest[a as usize]).normalize_or_zero()
        };
        let strain = length - rest_length;
        let alpha = alpha + alpha_per_length * rest_length;
        let lambda = multipliers.get(index);
        let damped = if gamma > 0.0 {
            let moved = d - (at(previous, b) - at(previous, a));
            gamma * direction.dot(moved)
        } else {
            0.0
        };
        let change = -(strain + alpha * lambda + damped) / ((1.0 + gamma) * weight + alpha);
        multipliers.set(index, lambda + change);
        push(positions, a, change, -direction);
        push(positions, b, change, direction);
    }
}
