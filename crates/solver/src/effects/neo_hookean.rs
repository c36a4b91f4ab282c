//! Neo-Hookean elasticity.

#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Damping, ElasticKind, PoissonRatio, Topology, YoungsModulus,
    elastic::{Curvature, Elastic, Point, Row},
    kernel::{
        arithmetic::{cross, difference, dot},
        block::{Block, Blocks, LaneRow, Projected, rates, solve_rows},
    },
    lanes::{Columns, Floats, Lanes, Vectors},
    order::Elements,
    topology::{Frames, Tetrahedra},
};
use fearless_simd::prelude::*;
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

/// Tetrahedra resist changes of shape and volume like rubber.
///
/// Neo-Hookean elasticity: two coupled equations on every tetrahedron, with the material's E and ν.
///
/// The energy per volume at rest is the one of Macklin and Müller (*A constraint-based formulation
/// of stable neo-Hookean materials*, 2021), after Smith, de Goes and Kim (2018),
///
/// ½µ(tr FᵀF − 3) + ½λ′(det F − 1 − µ/λ′)², λ′ = λ + µ,
///
/// minus its value at rest. λ′ is chosen to reproduce E and ν at small strains. Neither of their
/// two constraints, √(tr FᵀF) and det F − 1 − µ/λ′, is 0 at rest: two large forces cancel there, to
/// within rounding, and α → 0 crushes an element. The same energy is ½µD² + ½λH² with
///
/// D² = tr FᵀF + J² − 4J, H = J − 1, J = det F,
///
/// both 0 at rest. D² is never negative, by the inequality of arithmetic and geometric means of the
/// squares of F's stretches and of J. D, the strain, is like the length of a spring of zero rest
/// length: it has no gradient at rest. Kernels compute D² from Green's strain G = ½(FᵀF − 1) as 2H²
/// − 4I₂(G) − 8 det G, which, unlike the above, avoids cancellation at small strains for any
/// rotation of the element.
///
/// With the rest volume V₀, D has the compliance 1/(µV₀) and H has 1/(λV₀), in 1/J.
///
/// **Collapsed elements.** With this energy an element of size zero is stress-free as well, and
/// stays so below about a tenth of its length. Therefore, where tr FᵀF < 1, which means compression
/// to below 58 % on average along all three axes, D² has (1 − tr FᵀF)² added, and the energy
/// decreases monotonically from a point to rest. (Smith and others use a logarithm.) As for
/// [volume](crate::Volume), ∇H is that of the rest shape where an element has none.
///
/// **Folded bodies.** Below half of its volume, H of an element is constant at −½, and only D
/// drives the element. Otherwise the elements of a scrambled body would recover their volumes
/// before their shapes, wound around an edge twice, and remain so.
///
/// ```
/// use pliant_solver::{NeoHookean, PoissonRatio, YoungsModulus};
///
/// let foam = NeoHookean {
///     youngs_modulus: YoungsModulus::of(2e4), // Pa
///     poisson_ratio: PoissonRatio::of(0.1),
///     ..NeoHookean::default()
/// };
/// # assert_ne!(foam, NeoHookean::default());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct NeoHookean {
    /// Young's modulus E [Pa], independent of the mesh resolution; default 1e6, soft rubber; ∞ is
    /// rigid.
    pub youngs_modulus: YoungsModulus,
    /// Poisson's ratio ν; default 0.3.
    pub poisson_ratio: PoissonRatio,
    /// Damping τ [s], see [`Multipliers`](crate::effects::Multipliers); default 0.
    pub damping: Damping,
}

/// Lower bound of λ as a fraction of µ, so that 1/λ is finite with ν = 0; ν is then 5e-7.
const MIN_LAMBDA: f64 = 1e-6;

impl NeoHookean {
    /// Lamé's µ and λ [Pa].
    #[must_use]
    pub fn lame(&self) -> [f64; 2] {
        let e = f64::from(self.youngs_modulus.get());
        let nu = f64::from(self.poisson_ratio.get());
        let mu = e / (2.0 * (1.0 + nu));
        let lambda = e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
        [mu, lambda.max(MIN_LAMBDA * mu)]
    }

    /// Compliances of D and H [1/J] of a tetrahedron of the given rest volume [m³].
    #[must_use]
    pub fn compliances_of(&self, rest_volume: f32) -> [f64; 2] {
        let [mu, lambda] = self.lame();
        let rest_volume = f64::from(rest_volume.abs());
        [1.0 / (mu * rest_volume), 1.0 / (lambda * rest_volume)]
    }
}

/// Below this fraction of |V₀|^(−2/3), the mean squared gradient of H is too small to divide by, as
/// for [volume](crate::Volume).
const FLOOR: f32 = 0.01;

/// Below this fraction of that lower bound, the gradients have no direction.
const VANISHED: f32 = 1e-4;

/// Lower bound of D in denominators: D is then within the rounding of its coordinates.
const MIN_STRAIN: f32 = 1e-7;

/// Lower bound of H.
const MIN_VOLUME: f32 = -0.5;

/// Upper bound of compliances [1/J, times 1/s²], so that products with them are finite.
const SOFTEST: f32 = 1e30;

/// D and J − 1 of F = 1 + `h`, and their derivatives with respect to F.
#[must_use]
#[inline(always)]
pub fn strains(h: DMat3) -> ([f64; 2], [DMat3; 2]) {
    let green = h + h.transpose() + h.transpose() * h;
    let volume = trace(h) + minors(h) + h.determinant();
    let added = (-2.0 - trace(green)).max(0.0);
    let square = 2.0 * volume * volume - minors(green) - green.determinant() + added * added;
    let shear = square.max(0.0).sqrt();
    let f = DMat3::IDENTITY + h;
    let cofactors = cofactors(f);
    let slope = f * (1.0 - 2.0 * added) + cofactors * (volume - 1.0);
    let by_shear = slope * (1.0 / shear.max(MIN_STRAIN.into()));
    ([shear, volume], [by_shear, cofactors])
}

#[inline(always)]
fn cofactors(f: DMat3) -> DMat3 {
    DMat3::from_cols(
        f.y_axis.cross(f.z_axis),
        f.z_axis.cross(f.x_axis),
        f.x_axis.cross(f.y_axis),
    )
}

#[inline(always)]
fn inner(a: DMat3, b: DMat3) -> f64 {
    a.x_axis.dot(b.x_axis) + a.y_axis.dot(b.y_axis) + a.z_axis.dot(b.z_axis)
}

#[inline(always)]
fn trace(m: DMat3) -> f64 {
    m.x_axis.x + m.y_axis.y + m.z_axis.z
}

/// Sum of the principal minors.
#[inline(always)]
fn minors(m: DMat3) -> f64 {
    let DMat3 {
        x_axis: a,
        y_axis: b,
        z_axis: c,
    } = m;
    (a.x * b.y - a.y * b.x) + (a.x * c.z - a.z * c.x) + (b.y * c.z - b.z * c.y)
}

/// Gradients for each corner of a quantity with the derivative `slope` with respect to F.
#[inline(always)]
fn gradients(slope: DMat3, inverse: [DVec3; 3]) -> [DVec3; 4] {
    let (g1, g2, g3) = (slope * inverse[0], slope * inverse[1], slope * inverse[2]);
    [-(g1 + g2 + g3), g1, g2, g3]
}

impl Elastic<4, 2> for NeoHookean {
    const KIND: ElasticKind = ElasticKind::NeoHookean;
    const UNIT: &'static str = "1/J";
    type Kernel<'a> = Kernel<'a>;

    fn elements(topology: &Topology) -> &Elements<4> {
        &topology.tetrahedra.elements
    }

    fn kernel<'a>(&self, topology: &'a Topology, h: f32) -> Kernel<'a> {
        Kernel {
            tetrahedra: &topology.tetrahedra,
            frames: topology.frames(),
            per_modulus: self
                .lame()
                .map(|modulus| (1.0 / (modulus * f64::from(h) * f64::from(h))) as f32),
            gamma: self.damping.get() / h,
        }
    }

    #[inline(always)]
    fn rows(&self, topology: &Topology, index: usize, points: [Point; 4]) -> [Row<4>; 2] {
        let frames = topology.frames();
        let [a, b, c, d] = points;
        let x = [a.x, b.x, c.x, d.x];
        let (errors, slopes) = strains(frames.displacement_gradient(index, x));
        let inverse = frames.inverse_of(index);
        let (shear, mut volume) = (gradients(slopes[0], inverse), gradients(slopes[1], inverse));
        let scale = f64::from(frames.gradient_scale[index]);
        let least = f64::from(FLOOR) * scale * (a.w + b.w + c.w + d.w);
        let mut weight = 0.0;
        for corner in 0..4 {
            weight += points[corner].w * volume[corner].length_squared();
        }
        if weight < f64::from(VANISHED) * least {
            volume = gradients(DMat3::IDENTITY, inverse);
        } else if errors[1] < MIN_VOLUME.into() {
            volume = [DVec3::ZERO; 4];
        }
        let [alpha_shear, alpha_volume] =
            self.compliances_of(topology.tetrahedra.rest_volume[index]);
        [
            Row {
                error: errors[0],
                gradients: shear,
                compliance: alpha_shear,
                scale: 1.0,
                least: 0.0,
            },
            Row {
                error: errors[1].max(MIN_VOLUME.into()),
                gradients: volume,
                compliance: alpha_volume,
                scale: 1.0,
                least,
            },
        ]
    }

    /// ½µD² is µ tr ε² for small strains ε, and ½λH² is ½λ(tr ε)².
    fn linear_rows(&self, topology: &Topology, index: usize, _: [Point; 4]) -> Vec<Row<4>> {
        let inverse = topology.frames().inverse_of(index);
        let [alpha_shear, alpha_volume] =
            self.compliances_of(topology.tetrahedra.rest_volume[index]);
        let row = |slope: DMat3, compliance: f64| Row {
            error: 0.0,
            gradients: gradients(slope, inverse),
            compliance,
            scale: 1.0,
            least: 0.0,
        };
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let along = axes.map(|axis| row(DMat3::from_diagonal(axis), 0.5 * alpha_shear));
        // γ = 2ε for each pair of axes: 2ε² for the two entries, so ½γ².
        let across = [0, 1, 2].map(|k: usize| {
            let (a, b) = (axes[k], axes[(k + 1) % 3]);
            let slope = DMat3::from_cols(b * a.x, b * a.y, b * a.z)
                + DMat3::from_cols(a * b.x, a * b.y, a * b.z);
            row(slope, alpha_shear)
        });
        let mut rows = [along, across].concat();
        rows.push(row(DMat3::IDENTITY, alpha_volume));
        rows
    }

    /// ½µD² + ½λH² has the second derivatives µ(1 + ∇J∇Jᵀ + (J − 2)∇²J) + λ(∇J∇Jᵀ + H∇²J) by F, and
    /// ∇²J of two corners with the gradients Gᵢ and Gⱼ of their shape functions is −F(Gᵢ × Gⱼ)×.
    #[inline(always)]
    fn curvature(
        &self,
        topology: &Topology,
        index: usize,
        points: [Point; 4],
    ) -> Option<Curvature<4, 2>> {
        let frames = topology.frames();
        let [a, b, c, d] = points;
        let h = frames.displacement_gradient(index, [a.x, b.x, c.x, d.x]);
        let f = DMat3::IDENTITY + h;
        let volume = trace(h) + minors(h) + h.determinant();
        let [of_shear, of_volume] = self.compliances_of(topology.tetrahedra.rest_volume[index]);
        let (of_shear, of_volume) = (1.0 / of_shear, 1.0 / of_volume);
        let inverse = frames.inverse_of(index);
        let shape = gradients(DMat3::IDENTITY, inverse);
        let mixed = of_shear * (volume - 1.0) + of_volume * volume;
        let (mut even, mut odd) = ([[0.0; 4]; 4], [[DVec3::ZERO; 4]; 4]);
        for i in 0..4 {
            for j in 0..=i {
                even[i][j] = of_shear * shape[i].dot(shape[j]);
                even[j][i] = even[i][j];
            }
            for j in 0..i {
                odd[i][j] = f * shape[i].cross(shape[j]) * mixed;
                odd[j][i] = -odd[i][j];
            }
        }
        Some(Curvature {
            along: [0.0, of_shear + of_volume],
            even,
            odd,
            // Beyond, H is constant.
            is_far: volume <= MIN_VOLUME.into(),
        })
    }

    #[inline(always)]
    fn foresee(
        &self,
        topology: &Topology,
        index: usize,
        points: [Point; 4],
        steps: [DVec3; 4],
    ) -> Option<[f64; 2]> {
        let frames = topology.frames();
        let [a, b, c, d] = points;
        let h = frames.displacement_gradient(index, [a.x, b.x, c.x, d.x]);
        let f = DMat3::IDENTITY + h;
        let by = [
            steps[1] - steps[0],
            steps[2] - steps[0],
            steps[3] - steps[0],
        ];
        let change = frames.gradient(index, by);
        let ([shear, volume], _) = strains(h);
        let first = inner(cofactors(f), change);
        let second = inner(f, cofactors(change));
        let half_square = inner(f, change)
            + 0.5 * inner(change, change)
            + (volume - 1.0) * (first + second)
            + 0.5 * first * first;
        let square = shear * shear + 2.0 * half_square;
        Some([square.max(0.0).sqrt(), volume + first + second])
    }

    fn damping(&self) -> Damping {
        self.damping
    }

    fn is_rigid(&self) -> bool {
        self.youngs_modulus.get() == f32::INFINITY
    }
}

/// Tetrahedra with the data for their projection.
#[derive(Debug, Clone, Copy)]
pub struct Kernel<'a> {
    tetrahedra: &'a Tetrahedra,
    frames: &'a Frames,
    /// 1/(µh²) and 1/(λh²) [m/kg], divided by V₀.
    per_modulus: [f32; 2],
    /// γ = τ/h.
    gamma: f32,
}

impl Blocks<4, 2> for Kernel<'_> {
    fn elements(&self) -> &Elements<4> {
        &self.tetrahedra.elements
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
        lambda: Option<[Floats<L>; 2]>,
    ) -> Projected<L, 4, 2> {
        let rows = self.lane_rows(simd, block, x, lambda.as_ref());
        let rates = rates(
            simd,
            x,
            moved,
            #[inline(always)]
            |x| self.lane_rows(simd, block, x, None),
        );
        solve_rows(simd, &rows, x, rates, lambda, self.gamma)
    }
}

impl Kernel<'_> {
    #[inline(always)]
    fn lane_rows<L: Lanes>(
        &self,
        simd: L,
        block: &Block<4>,
        x: &[Columns<L>; 4],
        lambda: Option<&[Floats<L>; 2]>,
    ) -> [LaneRow<L, 4>; 2] {
        let zero = simd.number(0.0);
        let one = simd.number(1.0);
        let mut inverse = [[zero; 3]; 3];
        // F − 1, column by column.
        let mut h = [[zero; 3]; 3];
        for k in 0..3 {
            let mut strained = difference(&x[k + 1], &x[0]);
            for axis in 0..3 {
                strained[axis] -= block.column(simd, &self.frames.edges[k][axis]);
                inverse[k][axis] = block.column(simd, &self.frames.inverse[k][axis]);
            }
            for column in 0..3 {
                for axis in 0..3 {
                    h[column][axis] += strained[axis] * inverse[k][column];
                }
            }
        }
        // 2G, by its diagonal and off-diagonal entries.
        let [a, b, c] = &h;
        let (xx, yy, zz) = (
            a[0] * 2.0 + dot(a, a),
            b[1] * 2.0 + dot(b, b),
            c[2] * 2.0 + dot(c, c),
        );
        let (xy, xz, yz) = (
            a[1] + b[0] + dot(a, b),
            a[2] + c[0] + dot(a, c),
            b[2] + c[1] + dot(b, c),
        );
        let green_minors = (xx * yy - xy * xy) + (xx * zz - xz * xz) + (yy * zz - yz * yz);
        let green_determinant =
            xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
        let minors =
            (a[0] * b[1] - a[1] * b[0]) + (a[0] * c[2] - a[2] * c[0]) + (b[1] * c[2] - b[2] * c[1]);
        let volume = a[0] + b[1] + c[2] + minors + dot(a, &cross(b, c));
        let added = (simd.number(-2.0) - (xx + yy + zz)).max(0.0);
        let square = volume * volume * 2.0 - green_minors - green_determinant + added * added;
        let shear = square.max(0.0).sqrt();

        let mut f = h;
        for (axis, column) in f.iter_mut().enumerate() {
            column[axis] += 1.0;
        }
        let [a, b, c] = &f;
        let cofactors = [cross(b, c), cross(c, a), cross(a, b)];
        let over = one / shear.max(MIN_STRAIN);
        let (straight, crossed) = ((one - added * 2.0) * over, (volume - 1.0) * over);
        let mut slope = f;
        for column in 0..3 {
            for axis in 0..3 {
                slope[column][axis] =
                    f[column][axis] * straight + cofactors[column][axis] * crossed;
            }
        }
        let along_shear = lane_gradients(simd, &slope, &inverse);
        let mut along_volume = lane_gradients(simd, &cofactors, &inverse);
        let mut weight = zero;
        for corner in 0..4 {
            weight += x[corner][3] * dot(&along_volume[corner], &along_volume[corner]);
        }
        let scale = block.column(simd, &self.frames.gradient_scale);
        let floor = scale * (x[0][3] + x[1][3] + (x[2][3] + x[3][3])) * FLOOR;
        let vanished = weight.simd_lt(floor * VANISHED);
        let folded = volume.simd_lt(MIN_VOLUME);
        for axis in 0..3 {
            let sum = inverse[0][axis] + inverse[1][axis] + inverse[2][axis];
            for corner in 0..4 {
                let rest = if corner == 0 {
                    -sum
                } else {
                    inverse[corner - 1][axis]
                };
                let own = folded.select(zero, along_volume[corner][axis]);
                along_volume[corner][axis] = vanished.select(rest, own);
            }
        }
        let rest_volume = block.column(simd, &self.tetrahedra.rest_volume).abs();
        let [alpha_shear, alpha_volume] = self
            .per_modulus
            .map(|per_modulus| (simd.number(per_modulus) / rest_volume).min(SOFTEST));
        // Without a gradient it is inactive: its multiplier does not change.
        let silent = match lambda {
            Some(lambda) => -(alpha_volume * lambda[1]),
            None => zero,
        };
        let error = folded.select(silent, volume);
        [
            LaneRow {
                error: shear,
                gradients: along_shear,
                alpha: alpha_shear,
                least: zero,
            },
            LaneRow {
                error: vanished.select(volume.max(MIN_VOLUME), error),
                gradients: along_volume,
                alpha: alpha_volume,
                least: floor,
            },
        ]
    }
}

/// Gradients for each corner of a quantity with the derivative `slope` with respect to F, column by
/// column.
#[inline(always)]
fn lane_gradients<L: Lanes>(
    simd: L,
    slope: &[[Floats<L>; 3]; 3],
    inverse: &[[Floats<L>; 3]; 3],
) -> [[Floats<L>; 3]; 4] {
    let mut gradients = [[simd.number(0.0); 3]; 4];
    for axis in 0..3 {
        for k in 0..3 {
            gradients[k + 1][axis] = slope[0][axis] * inverse[k][0]
                + slope[1][axis] * inverse[k][1]
                + slope[2][axis] * inverse[k][2];
        }
        gradients[0][axis] = -(gradients[1][axis] + gradients[2][axis] + gradients[3][axis]);
    }
    gradients
}
