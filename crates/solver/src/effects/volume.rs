//! Volume.

#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Compliance, Damping, ElasticKind, Particles, RepairTime, Stiffness, Topology,
    elastic::{Elastic, Point, Row},
    kernel::{
        arithmetic::{Arithmetic, cross, difference, dot, scaled},
        block::{Ask, Block, Blocks, Projected, Resources, any},
        geometry::volume_and_gradients,
    },
    lanes::{Columns, Floats, Lanes, Vectors},
    order::Elements,
    topology::{self, Tetrahedra},
};
use fearless_simd::prelude::*;
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// Tetrahedra resist changes of volume.
///
/// Volume: C = V − V₀ [m³] on every tetrahedron, V = (x₁−x₀)×(x₂−x₀)·(x₃−x₀)/6 signed.
///
/// λ/h² is the pressure of the element in Pa, and the compliance is in m⁵/N. (With C = 6(V−V₀), as
/// in some texts, the same number would mean a material 36 times as soft.) The sign of V matters: a
/// mirrored element has V = −V₀ and is driven through the flat state back to V₀, which its absolute
/// value would not do.
///
/// ```
/// use pliant_solver::{Stiffness, Volume};
///
/// // Foam, which can be compressed.
/// let foam = Volume { bulk_modulus: Stiffness::of(1e4), ..Volume::default() }; // Pa
/// # assert_ne!(foam, Volume::default());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Volume {
    /// Compliance of each tetrahedron [m⁵/N]; default 0, incompressible.
    pub compliance: Compliance,
    /// Bulk modulus K [Pa], independent of the mesh resolution: an element of rest volume V₀ adds
    /// V₀/K to its compliance. Default ∞, which adds nothing.
    pub bulk_modulus: Stiffness,
    /// Damping τ [s], see [`Multipliers`](crate::effects::Multipliers); default 0. With one iteration per
    /// substep, more than about 0.05 s on nearly incompressible elements causes jitter instead of
    /// damping.
    pub damping: Damping,
    /// Time constant T for [recovering](crate::repair) collapsed or inverted tetrahedra [s];
    /// default 0.05, ∞ disables recovery.
    pub repair: RepairTime,
}

/// Coefficients for a substep of given length.
#[derive(Debug, Clone, Copy)]
pub struct Coefficients {
    /// α/h² [m⁴/kg].
    alpha: f32,
    /// 1/(K h²) [m/kg], multiplied by V₀.
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

/// Below this fraction of |V₀|^(4/3), the mean squared gradient of a tetrahedron is too small to
/// divide by. A regular one at rest has 0.36; uniformly shrunk, it reaches this at 0.41 of its
/// size.
const FLOOR: f32 = 0.01;

/// Below this fraction of that lower bound, the gradients have no direction.
const VANISHED: f32 = 1e-4;

/// ∇V for each corner [m²].
#[inline(always)]
pub(crate) fn gradients([x0, x1, x2, x3]: [DVec3; 4]) -> [DVec3; 4] {
    let (a, b, c) = (x1 - x0, x2 - x0, x3 - x0);
    let (g1, g2, g3) = (b.cross(c) / 6.0, c.cross(a) / 6.0, a.cross(b) / 6.0);
    [-(g1 + g2 + g3), g1, g2, g3]
}

/// Whether any tetrahedron has less than `fraction` of its rest volume, or will have at the
/// position predicted by inertia for the next substep.
pub(crate) fn any_below(
    fraction: f32,
    topology: &Topology,
    particles: &Particles,
    resources: Resources,
) -> bool {
    let tetrahedra = &topology.tetrahedra;
    any(
        &tetrahedra.elements,
        (&particles.positions, &particles.displacements),
        resources,
        &Below {
            fraction,
            tetrahedra,
        },
    )
}

struct Below<'a> {
    fraction: f32,
    tetrahedra: &'a Tetrahedra,
}

impl Ask<4> for Below<'_> {
    type Notes = ();

    #[inline(always)]
    fn holds<L: Lanes>(&self, simd: L, block: &Block<4>, x: &[Columns<L>; 4], (): &mut ()) -> bool {
        let rest_volume = block.column(simd, &self.tetrahedra.rest_volume);
        let (a, b, c) = (
            difference(&x[1], &x[0]),
            difference(&x[2], &x[0]),
            difference(&x[3], &x[0]),
        );
        let volume = dot(&a, &cross(&b, &c));
        let last = simd.number(0.0);
        // Lanes without a constraint repeat the last, but their rest volumes are 0.
        let used = rest_volume.abs().simd_gt(last);
        let ratio = volume / used.select(rest_volume, simd.number(1.0));
        let ratio = used.select(ratio, simd.number(f32::INFINITY));
        ratio.simd_lt(self.fraction * 6.0).any_true()
    }
}

impl Elastic<4, 1> for Volume {
    const KIND: ElasticKind = ElasticKind::Volume;
    const UNIT: &'static str = "m⁵/N";
    type Kernel<'a> = Kernel<'a>;

    fn elements(topology: &Topology) -> &Elements<4> {
        &topology.tetrahedra.elements
    }

    fn kernel<'a>(&self, topology: &'a Topology, h: f32) -> Kernel<'a> {
        Kernel {
            tetrahedra: &topology.tetrahedra,
            rest: &topology.rest,
            coefficients: self.coefficients(h),
        }
    }

    #[inline(always)]
    fn rows(&self, topology: &Topology, index: usize, points: [Point; 4]) -> [Row<4>; 1] {
        let rest_volume = topology.tetrahedra.rest_volume[index];
        let scale = f64::from(topology.tetrahedra.gradient_scale[index]);
        let weight = |gradients: &[DVec3; 4]| -> f64 {
            let terms = gradients.iter().zip(&points);
            terms.map(|(g, point)| point.w * g.length_squared()).sum()
        };
        let x = points.map(|point| point.x);
        let least = f64::from(FLOOR) * scale * points.iter().map(|point| point.w).sum::<f64>();
        let mut along = gradients(x);
        if weight(&along) < f64::from(VANISHED) * least {
            along = gradients(points.map(|point| point.rest));
        }
        [Row {
            error: topology::volume(x) - f64::from(rest_volume),
            gradients: along,
            compliance: self.compliance_of(rest_volume),
            scale: f64::from(rest_volume),
            least,
        }]
    }

    fn damping(&self) -> Damping {
        self.damping
    }

    fn is_rigid(&self) -> bool {
        self.compliance_of(1.0) == 0.0
    }
}

/// Tetrahedra with the data for their projection.
///
/// The step has the length C/‖∇C‖, so an element that has collapsed towards a line, whose gradient
/// vanishes, would be thrown far away. Two guards prevent this, both relative to the element's own
/// size: the denominator has a lower bound, its value at a gradient of a tenth of |V₀|^(2/3), which
/// leaves healthy elements bitwise unaffected; and where the gradients have no direction, those of
/// the rest shape are used.
#[derive(Debug, Clone, Copy)]
pub struct Kernel<'a> {
    tetrahedra: &'a Tetrahedra,
    rest: &'a [Vec3],
    coefficients: Coefficients,
}

impl Blocks<4, 1> for Kernel<'_> {
    const APART: bool = true;

    fn elements(&self) -> &Elements<4> {
        &self.tetrahedra.elements
    }

    fn damped(&self) -> bool {
        self.coefficients.gamma > 0.0
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
        const SIXTH: f32 = 1.0 / 6.0;
        let Coefficients {
            alpha,
            alpha_per_volume,
            gamma,
        } = self.coefficients;
        let rest_volume = block.column(simd, &self.tetrahedra.rest_volume);
        let scale = block.column(simd, &self.tetrahedra.gradient_scale);
        let (a, b, c) = (
            difference(&x[1], &x[0]),
            difference(&x[2], &x[0]),
            difference(&x[3], &x[0]),
        );
        // Gradients times 6 for the corners 1 to 3; that of corner 0 is minus their sum.
        let bc = cross(&b, &c);
        let volume = dot(&a, &bc) * SIXTH;
        let mut gradients = [bc, cross(&c, &a), cross(&a, &b)];
        let mut weight = weighted_square::<L>(&gradients, x);
        let floor = scale * (x[0][3] + x[1][3] + (x[2][3] + x[3][3])) * FLOOR;
        if weight.simd_lt(floor * VANISHED).any_true() {
            gradients = self.open::<L>(block, gradients, weight, floor);
            weight = weighted_square::<L>(&gradients, x);
        }
        let alpha = rest_volume.abs() * alpha_per_volume + alpha;
        let mut error = rest_volume - volume;
        let mut denominator = weight.max(floor) * (1.0 + gamma) + alpha;
        let moves = denominator.simd_gt(0.0);
        if moves.any_false() {
            // All four corners are pinned.
            error = moves.select(error, simd.number(0.0));
            denominator = moves.select(denominator, simd.number(1.0));
        }
        if let Some([lambda]) = lambda {
            error -= alpha * lambda;
        }
        if let Some(moved) = moved {
            // By the gradients in the middle of the way: a rotation does not change the volume.
            let [_, da, db, dc] = moved;
            let [a, b, c] = [(&a, da), (&b, db), (&c, dc)].map(
                #[inline(always)]
                |(side, way)| halfway_of::<L>(side, way),
            );
            let changed =
                dot(da, &cross(&b, &c)) + dot(db, &cross(&c, &a)) + dot(dc, &cross(&a, &b));
            error -= changed * (SIXTH * gamma);
        }
        let change = error / denominator;
        let step = change * SIXTH;
        let first = sum(&gradients);
        let [g1, g2, g3] = &gradients;
        Projected {
            moves: [
                scaled(&first, -(x[0][3] * step)),
                scaled(g1, x[1][3] * step),
                scaled(g2, x[2][3] * step),
                scaled(g3, x[3][3] * step),
            ],
            change: [change],
        }
    }
}

/// A side in the middle of its way.
#[inline(always)]
fn halfway_of<L: Lanes>(side: &Vectors<L>, way: &Vectors<L>) -> Vectors<L> {
    [
        side[0] - way[0] * 0.5,
        side[1] - way[1] * 0.5,
        side[2] - way[2] * 0.5,
    ]
}

impl Kernel<'_> {
    /// Gradients of the rest shape, times 6, for elements of a block without gradients.
    #[cold]
    fn open<L: Lanes>(
        &self,
        block: &Block<4>,
        gradients: [[Floats<L>; 3]; 3],
        weight: Floats<L>,
        floor: Floats<L>,
    ) -> [[Floats<L>; 3]; 3] {
        let mut gradients = gradients;
        for (lane, _, corners) in block.constraints::<L>() {
            if weight[lane] < VANISHED * floor[lane] {
                let rest = corners.map(|i| self.rest[i.particle() as usize]);
                let [_, g1, g2, g3] = volume_and_gradients(rest).1;
                for (gradient, rest) in gradients.iter_mut().zip([g1, g2, g3]) {
                    for (axis, column) in gradient.iter_mut().enumerate() {
                        column[lane] = 6.0 * rest[axis];
                    }
                }
            }
        }
        gradients
    }
}

/// g1 + g2 + g3.
#[inline(always)]
fn sum<F: Arithmetic>([g1, g2, g3]: &[[F; 3]; 3]) -> [F; 3] {
    [
        g1[0] + g2[0] + g3[0],
        g1[1] + g2[1] + g3[1],
        g1[2] + g2[2] + g3[2],
    ]
}

/// Σ w‖∇V‖² from gradients times 6.
#[inline(always)]
fn weighted_square<L: Lanes>(gradients: &[[Floats<L>; 3]; 3], x: &[Columns<L>; 4]) -> Floats<L> {
    let first = sum(gradients);
    let [g1, g2, g3] = gradients;
    (x[0][3] * dot(&first, &first)
        + x[1][3] * dot(g1, g1)
        + x[2][3] * dot(g2, g2)
        + x[3][3] * dot(g3, g3))
        * (1.0 / 36.0)
}
