//! Volume: C = V − V₀ [m³] on every tetrahedron, V = (x₁−x₀)×(x₂−x₀)·(x₃−x₀)/6 signed.
//!
//! λ/h² is the element's pressure in Pa, and the compliance is in m⁵/N. (With C = 6(V−V₀),
//! as some texts have it, the same number would mean a material 36 times as soft.) The sign of V
//! matters: a mirrored element has V = −V₀ and is driven through flat back to V₀, which its
//! absolute value would never do.

use super::{Multipliers, at, push};
use crate::solver::{Compliance, Damping, Stiffness, topology::Tetrahedra};
use glam::{Vec3, Vec4};
use serde::{Deserialize, Serialize};

/// Tetrahedra resist a change of volume.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Volume {
    /// Compliance of each tetrahedron [m⁵/N]; default 0, incompressible.
    pub compliance: Compliance,
    /// Bulk modulus K [Pa], which does not depend on how finely the body is divided: an element of
    /// rest volume V₀ adds V₀/K to its compliance. Default ∞, which adds nothing.
    pub bulk_modulus: Stiffness,
    /// Damping τ [s], see the [module](super); default 0. With one sweep a substep, more than some
    /// 0.05 s on nearly incompressible elements does not calm a body but makes it flutter.
    pub damping: Damping,
}

/// The parameters as a substep of a given length needs them.
#[derive(Debug, Clone, Copy)]
pub struct Coefficients {
    /// α/h² [m⁴/kg].
    alpha: f32,
    /// 1/(K h²) [m/kg], to be multiplied by V₀.
    alpha_per_volume: f32,
    /// γ = τ/h.
    gamma: f32,
}

impl Volume {
    /// For a substep of `h` seconds.
    #[must_use]
    pub fn coefficients(&self, h: f32) -> Coefficients {
        let per_step = 1.0 / (h * h);
        Coefficients {
            alpha: self.compliance.get() * per_step,
            alpha_per_volume: per_step / self.bulk_modulus.get(),
            gamma: self.damping.get() / h,
        }
    }

    /// Compliance [m⁵/N] of a tetrahedron of the given rest volume [m³].
    #[must_use]
    pub fn compliance_of(&self, rest_volume: f32) -> f64 {
        f64::from(self.compliance.get())
            + f64::from(rest_volume.abs()) / f64::from(self.bulk_modulus.get())
    }
}

/// Below this share of |V₀|^(4/3), the mean squared gradient of a tetrahedron is too small to
/// divide by. A regular one at rest has 0.36; uniformly shrunk, it gets here at 0.41 of its size.
const FLOOR: f32 = 0.01;

/// Below this share of the floor there is no direction left in the gradients.
const VANISHED: f32 = 1e-4;

/// Signed volume [m³] and its four gradients [m²] by cross products.
#[must_use]
pub fn volume_and_gradients([x0, x1, x2, x3]: [Vec3; 4]) -> (f32, [Vec3; 4]) {
    const SIXTH: f32 = 1.0 / 6.0;
    let (a, b, c) = (x1 - x0, x2 - x0, x3 - x0);
    let bc = b.cross(c);
    let (g1, g2, g3) = (bc * SIXTH, c.cross(a) * SIXTH, a.cross(b) * SIXTH);
    (a.dot(bc) * SIXTH, [-(g1 + g2 + g3), g1, g2, g3])
}

/// One sweep over all tetrahedra.
///
/// The step is C/‖∇C‖ long, so an element that has collapsed towards a line, whose gradient
/// vanishes, would be thrown far away. Two guards, both relative to the element's own size:
/// the denominator is kept above what a gradient of a tenth of |V₀|^(2/3) gives, which leaves
/// healthy elements as they are to the bit; and where no direction is left, the gradient of the
/// rest shape is used.
pub fn solve(
    positions: &mut [Vec4],
    previous: &[Vec4],
    tetrahedra: &Tetrahedra,
    rest: &[Vec3],
    coefficients: Coefficients,
    mut multipliers: Multipliers,
) {
    let Coefficients {
        alpha,
        alpha_per_volume,
        gamma,
    } = coefficients;
    let columns = tetrahedra
        .corners
        .iter()
        .zip(&tetrahedra.rest_volume)
        .zip(&tetrahedra.gradient_scale);
    for (index, ((corners, &rest_volume), &scale)) in columns.enumerate() {
        let w = corners.map(|i| positions[i as usize].w);
        let total = w[0] + w[1] + w[2] + w[3];
        if total == 0.0 {
            continue;
        }
        let x = corners.map(|i| at(positions, i));
        let (volume, mut gradients) = volume_and_gradients(x);
        let mut weight = weighted_square(&gradients, &w);
        let floor = FLOOR * scale * total;
        if weight < VANISHED * floor {
            gradients = volume_and_gradients(corners.map(|i| rest[i as usize])).1;
            weight = weighted_square(&gradients, &w);
        }
        let weight = weight.max(floor);

        let error = volume - rest_volume;
        let alpha = alpha + alpha_per_volume * rest_volume.abs();
        let lambda = multipliers.get(index);
        let damped = if gamma > 0.0 {
            let moved: f32 = (0..4)
                .map(|k| gradients[k].dot(x[k] - at(previous, corners[k])))
                .sum();
            gamma * moved
        } else {
            0.0
        };
        let change = -(error + alpha * lambda + damped) / ((1.0 + gamma) * weight + alpha);
        multipliers.set(index, lambda + change);
        for k in 0..4 {
            push(positions, corners[k], change, gradients[k]);
        }
    }
}

/// Σ w‖∇C‖².
fn weighted_square(gradients: &[Vec3; 4], w: &[f32; 4]) -> f32 {
    w[0] * gradients[0].length_squared()
        + w[1] * gradients[1].length_squared()
        + w[2] * gradients[2].length_squared()
        + w[3] * gradients[3].length_squared()
}
