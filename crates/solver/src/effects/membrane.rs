//! Membrane.

#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Damping, ElasticKind, PoissonRatio, Thickness, Topology, YoungsModulus,
    elastic::{Elastic, Point, Row},
    kernel::{
        arithmetic::{difference, dot},
        block::{Block, Blocks, LaneRow, Projected, rates, solve_rows},
    },
    lanes::{Columns, Floats, Lanes, Vectors},
    order::Elements,
    topology::Facets,
};
use fearless_simd::prelude::*;
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// Isotropic resistance of the surface triangles to strain.
///
/// Membrane: isotropic resistance of triangles to in-plane strain.
///
/// The strain is Green's, ε = ½(FᵀF − 1) with the deformation gradient F of a linear triangle,
/// which is invariant under rotation. In plane stress a sheet of thickness t, Young's modulus E and
/// Poisson's ratio ν stores, for a rest area A,
///
/// ½ A t [E/(2(1 − ν)) s² + E/(2(1 + ν)) (d² + γ²)],
///
/// with s = ε₁₁ + ε₂₂, d = ε₁₁ − ε₂₂ and γ = 2ε₁₂. These three are the equations of an element,
/// with the compliances 2(1 − ν)/(EtA) and twice 2(1 + ν)/(EtA). (This is the Saint
/// Venant–Kirchhoff material: accurate in E and ν at small strains, stiffer under large tension,
/// softer under compression.) λ/h² is an energy in N·m.
///
/// FᵀF is compared with its rest value as the kernel computes it, so that a body in its rest shape
/// does not move at all.
///
/// ```
/// use pliant_solver::{Membrane, PoissonRatio, Thickness, YoungsModulus};
///
/// // A balloon of latex, 0.2 mm thick.
/// let latex = Membrane {
///     youngs_modulus: YoungsModulus::of(2e6), // Pa
///     poisson_ratio: PoissonRatio::of(0.45),
///     thickness: Thickness::of(2e-4), // m
///     ..Membrane::default()
/// };
/// # assert_ne!(latex, Membrane::default());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Membrane {
    /// Young's modulus E [Pa]; default 1e6, soft rubber.
    pub youngs_modulus: YoungsModulus,
    /// Poisson's ratio ν; default 0.3.
    pub poisson_ratio: PoissonRatio,
    /// Thickness t [m]; default 1e-3. It does not affect the mass.
    pub thickness: Thickness,
    /// Damping τ [s], see [`Multipliers`](crate::effects::Multipliers); default 0.
    pub damping: Damping,
}

impl Membrane {
    /// Compliances of the three equations times the area of an element [m/N].
    #[must_use]
    pub fn compliances(&self) -> [f64; 3] {
        let [modulus, ratio, thickness] = [
            self.youngs_modulus.get(),
            self.poisson_ratio.get(),
            self.thickness.get(),
        ]
        .map(f64::from);
        let half = 0.5 * modulus * thickness;
        [1.0 - ratio, 1.0 + ratio, 1.0 + ratio].map(|factor| factor / half)
    }
}

impl Elastic<3, 3> for Membrane {
    const KIND: ElasticKind = ElasticKind::Membrane;
    const UNIT: &'static str = "1/(N·m)";
    type Kernel<'a> = Kernel<'a, true>;

    fn elements(topology: &Topology) -> &Elements<3> {
        &topology.facets().elements
    }

    fn kernel<'a>(&self, topology: &'a Topology, h: f32) -> Kernel<'a, true> {
        Kernel::new(topology, self.compliances(), self.damping, h)
    }

    fn rows(&self, topology: &Topology, index: usize, points: [Point; 3]) -> [Row<3>; 3] {
        rows::<true>(topology, index, points, self.compliances())
    }

    fn damping(&self) -> Damping {
        self.damping
    }

    fn is_rigid(&self) -> bool {
        self.compliances() == [0.0; 3]
    }
}

/// Where the square of a principal stretch of F is below this, the gradients of the strain, which
/// shrink with it, are too short to divide by.
const FLOOR: f32 = 0.1;

/// Below this fraction of its squared rest length, the image of a direction is undefined.
const VANISHED: f32 = 1e-6;

/// The equations of a triangle: s, d and γ, or ε₁₁, ε₂₂ and γ.
pub(super) fn rows<const ISOTROPIC: bool>(
    topology: &Topology,
    index: usize,
    points: [Point; 3],
    compliances: [f64; 3],
) -> [Row<3>; 3] {
    let facets = topology.facets();
    let [p, q, r, s] = [0, 1, 2, 3].map(|k: usize| f64::from(facets.inverse[k][index]));
    let columns = |x: [DVec3; 3]| {
        let (a, b) = (x[1] - x[0], x[2] - x[0]);
        [a * p + b * r, a * q + b * s]
    };
    let x = points.map(|point| point.x);
    let (a, b) = (x[1] - x[0], x[2] - x[0]);
    let [aa, bb, ab] = [(0, a.dot(a)), (1, b.dot(b)), (2, a.dot(b))]
        .map(|(k, now): (usize, f64)| now - f64::from(facets.metric[k][index]));
    let warp = 0.5 * (p * p * aa + 2.0 * p * r * ab + r * r * bb);
    let weft = 0.5 * (q * q * aa + 2.0 * q * s * ab + s * s * bb);
    let bias = p * q * aa + (p * s + q * r) * ab + r * s * bb;

    let rest = columns(points.map(|point| point.rest));
    let mut images = columns(x);
    for (image, rest) in images.iter_mut().zip(rest) {
        if image.length_squared() < VANISHED.into() {
            *image = rest;
        }
    }
    let [f, g] = images;
    let gradients = |to_a: DVec3, to_b: DVec3| [-(to_a + to_b), to_a, to_b];
    let [w0, w1, w2] = points.map(|point| point.w);
    let [along, across] = [(p, r), (q, s)]
        .map(|(a, b)| f64::from(FLOOR) * (w1 * a * a + w2 * b * b + w0 * (a + b) * (a + b)));
    let shear = (
        bias,
        gradients(f * q + g * p, f * s + g * r),
        along + across,
    );
    let equations = if ISOTROPIC {
        let sum = gradients(f * p + g * q, f * r + g * s);
        let apart = gradients(f * p - g * q, f * r - g * s);
        [
            (warp + weft, sum, along + across),
            (warp - weft, apart, along + across),
            shear,
        ]
    } else {
        [
            (warp, gradients(f * p, f * r), along),
            (weft, gradients(g * q, g * s), across),
            shear,
        ]
    };
    let area = f64::from(facets.area[index]);
    let mut number = 0;
    equations.map(|(error, gradients, least)| {
        number += 1;
        Row {
            error,
            gradients,
            compliance: compliances[number - 1] / area,
            scale: 1.0,
            least,
        }
    })
}

/// Triangles with the data for their projection; `ISOTROPIC` ones solve for s, d and γ, others for
/// ε₁₁, ε₂₂ and γ.
///
/// The gradients of a strain shrink with the triangle, and on a line all three coincide. The
/// denominators have a lower bound, their value at a third of the size; healthy triangles that are
/// not very slender are bitwise unaffected. Where the image of warp or weft has no direction, that
/// of the rest shape is used, so that a triangle that has collapsed to a point opens, always in the
/// same way.
#[derive(Debug, Clone, Copy)]
pub struct Kernel<'a, const ISOTROPIC: bool> {
    facets: &'a Facets,
    rest: &'a [Vec3],
    /// α A/h² of each equation [m/N/s²].
    alphas: [f32; 3],
    /// γ = τ/h.
    gamma: f32,
}

impl<'a, const ISOTROPIC: bool> Kernel<'a, ISOTROPIC> {
    /// With compliances times area [m/N], for a substep of `h` seconds.
    pub(super) fn new(
        topology: &'a Topology,
        compliances: [f64; 3],
        damping: Damping,
        h: f32,
    ) -> Self {
        let square = f64::from(h) * f64::from(h);
        Self {
            facets: topology.facets(),
            rest: &topology.rest,
            alphas: compliances.map(|compliance| (compliance / square) as f32),
            gamma: damping.get() / h,
        }
    }

    /// Images of warp and weft in the rest shape, for triangles of a block where they are
    /// undefined.
    #[cold]
    fn open<L: Lanes>(
        &self,
        block: &Block<3>,
        images: [[Floats<L>; 3]; 2],
        squares: [Floats<L>; 2],
    ) -> [[Floats<L>; 3]; 2] {
        let mut images = images;
        for (lane, index, corners) in block.constraints::<L>() {
            let x = corners.map(|corner| self.rest[corner.particle() as usize]);
            let (a, b) = (x[1] - x[0], x[2] - x[0]);
            for (k, image) in images.iter_mut().enumerate() {
                if squares[k][lane] < VANISHED {
                    let (to_a, to_b) = (
                        self.facets.inverse[k][index],
                        self.facets.inverse[k + 2][index],
                    );
                    let rest = a * to_a + b * to_b;
                    for (axis, column) in image.iter_mut().enumerate() {
                        column[lane] = rest[axis];
                    }
                }
            }
        }
        images
    }
}

impl<const ISOTROPIC: bool> Blocks<3, 3> for Kernel<'_, ISOTROPIC> {
    fn elements(&self) -> &Elements<3> {
        &self.facets.elements
    }

    fn damped(&self) -> bool {
        self.gamma > 0.0
    }

    #[inline(always)]
    fn project<L: Lanes>(
        &self,
        simd: L,
        block: &Block<3>,
        x: &[Columns<L>; 3],
        moved: Option<&[Vectors<L>; 3]>,
        lambda: Option<[Floats<L>; 3]>,
    ) -> Projected<L, 3, 3> {
        let rows = self.lane_rows(simd, block, x);
        let rates = rates(
            simd,
            x,
            moved,
            #[inline(always)]
            |x| self.lane_rows(simd, block, x),
        );
        solve_rows(simd, &rows, x, rates, lambda, self.gamma)
    }
}

impl<const ISOTROPIC: bool> Kernel<'_, ISOTROPIC> {
    #[inline(always)]
    fn lane_rows<L: Lanes>(
        &self,
        simd: L,
        block: &Block<3>,
        x: &[Columns<L>; 3],
    ) -> [LaneRow<L, 3>; 3] {
        let zero = simd.number(0.0);
        let p = block.column(simd, &self.facets.inverse[0]);
        let q = block.column(simd, &self.facets.inverse[1]);
        let r = block.column(simd, &self.facets.inverse[2]);
        let s = block.column(simd, &self.facets.inverse[3]);
        let (a, b) = (difference(&x[1], &x[0]), difference(&x[2], &x[0]));
        let aa = dot(&a, &a) - block.column(simd, &self.facets.metric[0]);
        let bb = dot(&b, &b) - block.column(simd, &self.facets.metric[1]);
        let ab = dot(&a, &b) - block.column(simd, &self.facets.metric[2]);
        let warp = (p * p * aa + p * r * ab * 2.0 + r * r * bb) * 0.5;
        let weft = (q * q * aa + q * s * ab * 2.0 + s * s * bb) * 0.5;
        let bias = p * q * aa + (p * s + q * r) * ab + r * s * bb;

        let mut images = [[zero; 3]; 2];
        for axis in 0..3 {
            images[0][axis] = a[axis] * p + b[axis] * r;
            images[1][axis] = a[axis] * q + b[axis] * s;
        }
        let squares = [dot(&images[0], &images[0]), dot(&images[1], &images[1])];
        if squares[0].min(squares[1]).simd_lt(VANISHED).any_true() {
            images = self.open::<L>(block, images, squares);
        }
        let [w0, w1, w2] = [x[0][3], x[1][3], x[2][3]];
        let along = (w1 * p * p + w2 * r * r + w0 * (p + r) * (p + r)) * FLOOR;
        let across = (w1 * q * q + w2 * s * s + w0 * (q + s) * (q + s)) * FLOOR;
        let both = along + across;
        let area = block.column(simd, &self.facets.area);
        let equations = if ISOTROPIC {
            [
                (warp + weft, [p, q], [r, s], both),
                (warp - weft, [p, -q], [r, -s], both),
                (bias, [q, p], [s, r], both),
            ]
        } else {
            [
                (warp, [p, zero], [r, zero], along),
                (weft, [zero, q], [zero, s], across),
                (bias, [q, p], [s, r], both),
            ]
        };
        let mut rows = [const { None }; 3];
        for k in 0..3 {
            let (error, to_a, to_b, least) = equations[k];
            rows[k] = Some(LaneRow {
                error,
                gradients: gradients(simd, &images, to_a, to_b),
                alpha: simd.number(self.alphas[k]) / area,
                least,
            });
        }
        let [Some(first), Some(second), Some(third)] = rows else {
            unreachable!("every row has been made");
        };
        [first, second, third]
    }
}

/// Gradients at the three corners, from the contributions of the sides to either image.
#[inline(always)]
fn gradients<L: Lanes>(
    simd: L,
    [f, g]: &[[Floats<L>; 3]; 2],
    to_a: [Floats<L>; 2],
    to_b: [Floats<L>; 2],
) -> [[Floats<L>; 3]; 3] {
    let mut gradients = [[simd.number(0.0); 3]; 3];
    for axis in 0..3 {
        gradients[1][axis] = f[axis] * to_a[0] + g[axis] * to_a[1];
        gradients[2][axis] = f[axis] * to_b[0] + g[axis] * to_b[1];
        gradients[0][axis] = -(gradients[1][axis] + gradients[2][axis]);
    }
    gradients
}
