//! Isometric bend.

#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Damping, ElasticKind, FlexuralRigidity, Topology,
    elastic::{Elastic, Point, Row},
    kernel::{
        arithmetic::{difference, dot},
        block::{Block, Blocks, LaneRow, Projected, rates, solve_rows},
    },
    lanes::{Columns, Floats, Lanes, Vectors},
    order::Elements,
    topology::{Hinges, hinges::Cotangents},
};
use fearless_simd::prelude::*;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Hinges resist bending by a quadratic energy, for cloth that hardly stretches.
///
/// Isometric bend: C = ‖Σ kᵢxᵢ‖ − C₀ [m] on every hinge, with cotangent weights kᵢ.
///
/// Where a sheet hardly stretches, its bending energy is quadratic in positions (Bergou, Wardetzky,
/// Harmon, Zorin and Grinspun, *A Quadratic Bending Model for Inextensible Surfaces*, 2006): the
/// weights are constants of the rest shape and no angle is computed. A hinge costs three quarters
/// of one of [bend](crate::Bend) (2.6 ms versus 3.5 ms per tick on a cloth of 40² cells with 20
/// substeps, one thread of a Xeon with AVX2). For a small fold θ over an edge e, C is eθ and the
/// compliance is (A₀ + A₁)/B, so that both effects have the same stiffness there. It is softer in a
/// sharp fold, where C is 2e sin(θ/2), and does not distinguish the two sides of a fold: a surface
/// that is not flat at rest may snap through.
///
/// ```
/// use pliant_solver::{FlexuralRigidity, IsometricBend, Stretch};
///
/// // A cloth that does not stretch and hardly resists folds.
/// let cloth = (
///     Stretch::default(),
///     IsometricBend { stiffness: FlexuralRigidity::of(1e-5), ..IsometricBend::default() }, // N·m
/// );
/// # assert_ne!(cloth.1, IsometricBend::default());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct IsometricBend {
    /// Flexural rigidity B [N·m], as of [`Bend`](super::bend::Bend); default 1e-3.
    pub stiffness: FlexuralRigidity,
    /// Damping τ [s], see [`Multipliers`](crate::effects::Multipliers); default 0.
    pub damping: Damping,
}

impl IsometricBend {
    /// Compliance [m/N] of a hinge whose triangles have this total area [m²].
    #[must_use]
    pub fn compliance_of(&self, area: f32) -> f64 {
        f64::from(area) / f64::from(self.stiffness.get())
    }
}

impl Elastic<4, 1> for IsometricBend {
    const KIND: ElasticKind = ElasticKind::IsometricBend;
    const UNIT: &'static str = "m/N";
    type Kernel<'a> = Kernel<'a>;

    fn elements(topology: &Topology) -> &Elements<4> {
        &topology.hinges().elements
    }

    fn kernel<'a>(&self, topology: &'a Topology, h: f32) -> Kernel<'a> {
        Kernel {
            hinges: topology.hinges(),
            cotangents: topology.cotangents(),
            alpha: 1.0 / (h * h) / self.stiffness.get(),
            gamma: self.damping.get() / h,
        }
    }

    fn rows(&self, topology: &Topology, index: usize, points: [Point; 4]) -> [Row<4>; 1] {
        let cotangents = topology.cotangents();
        let [k1, k2, k3] = [0, 1, 2].map(|k: usize| f64::from(cotangents.weights[k][index]));
        let weights = [-(k1 + k2 + k3), k1, k2, k3];
        let [x0, x1, x2, x3] = points.map(|point| point.x);
        let d = (x1 - x0) * k1 + (x2 - x0) * k2 + (x3 - x0) * k3;
        let length = d.length();
        // A flat hinge has no preferred side.
        let direction = if length > 0.0 {
            d / length
        } else {
            DVec3::ZERO
        };
        [Row {
            error: length - f64::from(cotangents.rest[index]),
            gradients: weights.map(|k| direction * k),
            compliance: self.compliance_of(cotangents.area[index]),
            scale: f64::from(cotangents.scale[index]),
            least: 0.0,
        }]
    }

    fn damping(&self) -> Damping {
        self.damping
    }

    fn is_rigid(&self) -> bool {
        self.compliance_of(1.0) == 0.0
    }
}

/// Hinges with the data for their projection.
#[derive(Debug, Clone, Copy)]
pub struct Kernel<'a> {
    hinges: &'a Hinges,
    cotangents: &'a Cotangents,
    /// 1/(B h²) [1/(kg·m²)], multiplied by an area.
    alpha: f32,
    /// γ = τ/h.
    gamma: f32,
}

impl Blocks<4, 1> for Kernel<'_> {
    fn elements(&self) -> &Elements<4> {
        &self.hinges.elements
    }

    fn damped(&self) -> bool {
        self.gamma > 0.0
    }

    #[inline(always)]
    fn project<L: Lanes>(
        &self,
        simd: L,
        block: &Block<4>,
        x: &[Columns<L>; 4],
        moved: Option<&[Vectors<L>; 4]>,
        lambda: Option<[Floats<L>; 1]>,
    ) -> Projected<L, 4, 1> {
        let row = self.row(simd, block, x);
        let rates = rates(
            simd,
            x,
            moved,
            #[inline(always)]
            |x| [self.row(simd, block, x)],
        );
        solve_rows(simd, &[row], x, rates, lambda, self.gamma)
    }
}

impl Kernel<'_> {
    #[inline(always)]
    fn row<L: Lanes>(&self, simd: L, block: &Block<4>, x: &[Columns<L>; 4]) -> LaneRow<L, 4> {
        let zero = simd.number(0.0);
        let [k1, k2, k3] =
            [0, 1, 2].map(|k: usize| block.column(simd, &self.cotangents.weights[k]));
        let ways = [
            difference(&x[1], &x[0]),
            difference(&x[2], &x[0]),
            difference(&x[3], &x[0]),
        ];
        let mut d = [zero; 3];
        for axis in 0..3 {
            d[axis] = ways[0][axis] * k1 + ways[1][axis] * k2 + ways[2][axis] * k3;
        }
        let length = dot(&d, &d).sqrt();
        let sided = length.simd_gt(zero);
        let inverse = sided.select(
            simd.number(1.0) / sided.select(length, simd.number(1.0)),
            zero,
        );
        let mut gradients = [[zero; 3]; 4];
        let k0 = -(k1 + k2 + k3);
        for axis in 0..3 {
            let direction = d[axis] * inverse;
            gradients[0][axis] = direction * k0;
            gradients[1][axis] = direction * k1;
            gradients[2][axis] = direction * k2;
            gradients[3][axis] = direction * k3;
        }
        LaneRow {
            error: length - block.column(simd, &self.cotangents.rest),
            gradients,
            alpha: block.column(simd, &self.cotangents.area) * self.alpha,
            least: zero,
        }
    }
}
