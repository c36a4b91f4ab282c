//! Bend.

#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Damping, ElasticKind, FlexuralRigidity, Particles, Topology,
    elastic::{Elastic, Point, Row},
    kernel::{
        arithmetic::{cross, difference, dot},
        block::{Ask, Block, Blocks, LaneRow, Projected, Resources, any, rates, solve_rows},
    },
    lanes::{Columns, Floats, Lanes, Vectors, arc_tangent},
    order::{Corner, Elements},
    topology::{
        Hinges,
        hinges::{angle, normals},
    },
};
use fearless_simd::prelude::*;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::f32::consts::{PI, TAU};

/// Hinges resist changes of their angle.
///
/// Bend: C = θ − θ₀ [rad] on every hinge, with θ the angle between the normals of its two
/// triangles.
///
/// λ/h² is the moment about the edge of the hinge in N·m. A hinge of flexural rigidity B [N·m] has
/// the stiffness B e²/(A₀ + A₁) [N·m], with the length e of the edge and the areas of its triangles
/// at rest. This is the discrete shell of Grinspun and others (2003) with the factor for which a
/// developable sheet stores ½Bκ² per area: exact where edges run along and across the bend, and
/// exact on average over its directions on a mesh of equilateral triangles.
///
/// The angle is computed with `atan2`, so that its sign tells the side of the fold; the gradient is
/// that of Bridson, Marino and Fedkiw (2003). The difference to the rest angle is wrapped to the
/// shorter way around: it does not jump when a fold passes ±π, only when it is π away from rest.
///
/// ```
/// use pliant_solver::{Bend, FlexuralRigidity};
///
/// // A sheet of rubber 1 mm thick: E = 1 MPa, ν = 0.5.
/// let (e, nu, t) = (1e6_f32, 0.5, 1e-3_f32);
/// let rubber = Bend {
///     stiffness: FlexuralRigidity::of(e * t.powi(3) / (12.0 * (1.0 - nu * nu))), // N·m
///     ..Bend::default()
/// };
/// # assert_ne!(rubber, Bend::default());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Bend {
    /// Flexural rigidity B [N·m], Et³/(12(1 − ν²)) for a sheet of thickness t, independent of the
    /// mesh resolution; default 1e-3, like some felt.
    pub stiffness: FlexuralRigidity,
    /// Damping τ [s], see [`Multipliers`](crate::effects::Multipliers); default 0.
    pub damping: Damping,
}

/// Coefficients for a substep of given length.
#[derive(Debug, Clone, Copy)]
pub struct Coefficients {
    /// 1/(B h²) [1/(kg·m²)], multiplied by the flexibility of a hinge.
    alpha: f32,
    /// γ = τ/h.
    gamma: f32,
}

impl Bend {
    /// For a substep of `h` seconds.
    #[must_use]
    pub fn coefficients(&self, h: f32) -> Coefficients {
        Coefficients {
            alpha: 1.0 / (h * h) / self.stiffness.get(),
            gamma: self.damping.get() / h,
        }
    }

    /// Compliance [1/(N·m)] of a hinge of the given flexibility (A₀ + A₁)/e².
    #[must_use]
    pub fn compliance_of(&self, flexibility: f32) -> f64 {
        f64::from(flexibility) / f64::from(self.stiffness.get())
    }
}

impl Elastic<4, 1> for Bend {
    const KIND: ElasticKind = ElasticKind::Bend;
    const UNIT: &'static str = "1/(N·m)";
    type Kernel<'a> = Kernel<'a>;

    fn elements(topology: &Topology) -> &Elements<4> {
        &topology.hinges().elements
    }

    fn kernel<'a>(&self, topology: &'a Topology, h: f32) -> Kernel<'a> {
        Kernel {
            hinges: topology.hinges(),
            coefficients: self.coefficients(h),
        }
    }

    fn rows(&self, topology: &Topology, index: usize, points: [Point; 4]) -> [Row<4>; 1] {
        let hinges = topology.hinges();
        let x = points.map(|point| point.x);
        [Row {
            error: wrapped(angle(x) - f64::from(hinges.rest_angle[index])),
            gradients: gradients(
                x,
                [0, 1].map(|kind: usize| hinges.floors[kind][index].into()),
            ),
            compliance: self.compliance_of(hinges.flexibility[index]),
            scale: 1.0,
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

/// Difference of two angles [rad], wrapped to the shorter way around.
pub(super) fn wrapped(error: f64) -> f64 {
    if error > PI.into() {
        error - f64::from(TAU)
    } else if error < (-PI).into() {
        error + f64::from(TAU)
    } else {
        error
    }
}

/// Gradients of the angle of a hinge [1/m], with lower bounds for the squared lengths of normals
/// and edge.
fn gradients(x: [DVec3; 4], [min_normal, min_edge]: [f64; 2]) -> [DVec3; 4] {
    let [n1, n2] = normals(x);
    let edge = x[1] - x[0];
    let length = edge.length_squared().max(min_edge).sqrt();
    let u1 = n1 / n1.length_squared().max(min_normal);
    let u2 = n2 / n2.length_squared().max(min_normal);
    let over_1 = (x[2] - x[0]).dot(edge) / length;
    let over_2 = (x[3] - x[0]).dot(edge) / length;
    [
        u1 * (length - over_1) + u2 * (length - over_2),
        u1 * over_1 + u2 * over_2,
        u1 * -length,
        u2 * -length,
    ]
}

/// Whether `counts` holds for the particles of any of the hinges whose normals have an angle with a
/// cosine below `cosine`, which is not positive, or so close to it that single precision cannot
/// tell; degenerate hinges are among them.
pub(crate) fn any_folded(
    cosine: f32,
    hinges: &Hinges,
    particles: &Particles,
    resources: Resources,
    counts: impl Fn([u32; 4]) -> bool + Sync,
) -> bool {
    let now = (&particles.positions[..], &particles.carry[..]);
    let folded = Folded { cosine, counts };
    any(&hinges.elements, now, resources, &folded)
}

/// Bound of the rounding error of n₁·n₂ − cos θ ‖n₁‖‖n₂‖ relative to ‖e‖²‖a‖‖b‖, where n₁ = e × a
/// and n₂ = b × e: each of the two terms has less than 40 roundings of 2⁻²⁴, in all 5e-6.
const FOLD_ERROR: f32 = 1e-5;

struct Folded<F> {
    cosine: f32,
    counts: F,
}

impl<F: Fn([u32; 4]) -> bool + Sync> Ask<4> for Folded<F> {
    type Notes = ();

    #[inline(always)]
    fn holds<L: Lanes>(&self, simd: L, block: &Block<4>, x: &[Columns<L>; 4], (): &mut ()) -> bool {
        let edge = difference(&x[1], &x[0]);
        let (first, second) = (difference(&x[2], &x[0]), difference(&x[3], &x[0]));
        let (n1, n2) = (cross(&edge, &first), cross(&second, &edge));
        // The product of the squares would overflow for edges of kilometers.
        let bound = dot(&n1, &n1).sqrt() * dot(&n2, &n2).sqrt() * self.cosine;
        let size = dot(&edge, &edge) * (dot(&first, &first) * dot(&second, &second)).sqrt();
        let is_open = (dot(&n1, &n2) - bound).simd_gt(size * FOLD_ERROR);
        if !is_open.any_false() {
            return false;
        }
        let is_open = is_open.select(simd.number(1.0), simd.number(0.0));
        let mut folded = block
            .constraints::<L>()
            .filter(|(lane, ..)| is_open[*lane] == 0.0);
        folded.any(|(.., corners)| (self.counts)(corners.map(Corner::particle)))
    }
}

/// Hinges with the data for their projection.
///
/// Lengths of normals and edges in denominators have a lower bound of a hundredth of their rest
/// values, so that the force of a collapsed triangle stays bounded; healthy hinges are bitwise
/// unaffected.
#[derive(Debug, Clone, Copy)]
pub struct Kernel<'a> {
    hinges: &'a Hinges,
    coefficients: Coefficients,
}

impl Blocks<4, 1> for Kernel<'_> {
    fn elements(&self) -> &Elements<4> {
        &self.hinges.elements
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
        let gamma = self.coefficients.gamma;
        let row = self.row(simd, block, x);
        let rates = rates(
            simd,
            x,
            moved,
            #[inline(always)]
            |x| [self.row(simd, block, x)],
        );
        solve_rows(simd, &[row], x, rates, lambda, gamma)
    }
}

impl Kernel<'_> {
    #[inline(always)]
    fn row<L: Lanes>(&self, simd: L, block: &Block<4>, x: &[Columns<L>; 4]) -> LaneRow<L, 4> {
        let alpha = self.coefficients.alpha;
        let zero = simd.number(0.0);
        let [min_normal, min_edge] =
            [0, 1].map(|kind: usize| block.column(simd, &self.hinges.floors[kind]));
        let edge = difference(&x[1], &x[0]);
        let (first, second) = (difference(&x[2], &x[0]), difference(&x[3], &x[0]));
        let (n1, n2) = (cross(&edge, &first), cross(&second, &edge));
        let length = dot(&edge, &edge).max(min_edge).sqrt();
        let sine = dot(&cross(&n1, &n2), &edge) / length;
        let angle = arc_tangent(simd, sine, dot(&n1, &n2));
        let mut error = angle - block.column(simd, &self.hinges.rest_angle);
        error = error.simd_gt(PI).select(error - TAU, error);
        error = error.simd_lt(-PI).select(error + TAU, error);

        // ∇θ is −e n/n² at the opposite corners, distributed to the ends of the edge by the
        // projections of the opposite corners onto it.
        let over_1 = dot(&first, &edge) / length;
        let over_2 = dot(&second, &edge) / length;
        let one = simd.number(1.0);
        let s1 = one / dot(&n1, &n1).max(min_normal);
        let s2 = one / dot(&n2, &n2).max(min_normal);
        let mut gradients = [[zero; 3]; 4];
        for axis in 0..3 {
            let (u1, u2) = (n1[axis] * s1, n2[axis] * s2);
            gradients[0][axis] = (length - over_1) * u1 + (length - over_2) * u2;
            gradients[1][axis] = over_1 * u1 + over_2 * u2;
            gradients[2][axis] = -(length * u1);
            gradients[3][axis] = -(length * u2);
        }
        LaneRow {
            error,
            gradients,
            alpha: block.column(simd, &self.hinges.flexibility) * alpha,
            least: zero,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Instructions, RestShape, Threads, kernel::random::Draws};
    use glam::{Vec3, vec3};
    use std::sync::Mutex;

    const SIDE: u32 = 12;

    fn sheet() -> RestShape {
        let at = |i: u32, j: u32| i * SIDE + j;
        let cells = (0..SIDE - 1).flat_map(|i| (0..SIDE - 1).map(move |j| (i, j)));
        let places = (0..SIDE).flat_map(|i| (0..SIDE).map(move |j| vec3(i as f32, 0.0, j as f32)));
        RestShape {
            vertices: places.collect(),
            triangles: cells
                .flat_map(|(i, j)| {
                    let [a, b] = [at(i, j), at(i + 1, j)];
                    [[a, a + 1, b], [a + 1, b + 1, b]]
                })
                .collect(),
            ..RestShape::default()
        }
    }

    /// Every hinge that is folded in double precision is among those found in single precision, with
    /// every instruction set. Of the others, those with a cosine more than 0.015 above the bound are
    /// not: the margin is 1e-5 and rounding 5e-6 of a product of lengths that is at most 1000 times
    /// that of the normals, for the hinges that are compared.
    #[test]
    fn folded_hinges_are_found() {
        const COSINE: f64 = -0.5;
        let topology = Topology::new(sheet()).expect("a sound sheet");
        let hinges = topology.hinges();
        let (mut folds, mut clear) = (0, 0);
        for trial in 0..20 {
            let mut draws = Draws::new([trial]);
            // From flat to crumpled, far from the origin in the last trials.
            let size = trial as f32 / 10.0;
            let away = if trial < 15 { 0.0 } else { 1000.0 };
            let places = topology.rest.iter().map(|&x| {
                let mut draw = || (draws.next() - 0.5) as f32 * size;
                x + vec3(draw(), draw(), draw()) + Vec3::splat(away)
            });
            let particles = Particles::at_rest(places);
            for instructions in Instructions::all() {
                let found = Mutex::new(Vec::new());
                let note = |corners| {
                    found.lock().expect("no panic").push(corners);
                    false
                };
                assert!(!any_folded(
                    COSINE as f32,
                    hinges,
                    &particles,
                    (instructions, &Threads::default()),
                    note
                ));
                let found = found.into_inner().expect("no panic");
                for corners in hinges.corners() {
                    let x = corners.map(|i| particles.position(i as usize));
                    let [n1, n2] = normals(x);
                    let (edge, [a, b]) = (x[1] - x[0], [x[2] - x[0], x[3] - x[0]]);
                    let is_found = found.contains(&corners);
                    let lengths = n1.length() * n2.length();
                    if n1.dot(n2) < COSINE * lengths {
                        assert!(is_found, "{corners:?} of trial {trial}");
                        folds += 1;
                    }
                    let is_thin = lengths < 1e-3 * edge.length_squared() * a.length() * b.length();
                    if !is_thin && n1.dot(n2) > (COSINE + 0.015) * lengths {
                        assert!(!is_found, "{corners:?} of trial {trial}");
                        clear += 1;
                    }
                }
            }
        }
        assert!(folds > 100 && clear > 100, "{folds} and {clear}");
    }
}
