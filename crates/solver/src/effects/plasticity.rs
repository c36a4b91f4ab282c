//! Plasticity.

use super::{Multipliers, bend::wrapped};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Creep, Effects, Particles, PlasticLimit, Topology, Yield,
    kernel::{
        arithmetic::{cross, difference, dot},
        block::{Block, Blocks, Projected, solve_all},
    },
    lanes::{Columns, Floats, Lanes, Vectors, arc_tangent},
    order::Elements,
    particles::Part,
    topology::{
        self, Cotangents, Edges, Hinges, Tetrahedra,
        hinges::{FLOOR, angle},
    },
};
use fearless_simd::prelude::*;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::{f32::consts::PI, sync::Arc};

/// Strain beyond a yield strain becomes permanent: of edges, bends and tetrahedra, each where the
/// body resists the change.
///
/// Plasticity: strain beyond a yield strain becomes permanent.
///
/// The rest value R of an edge, hinge or tetrahedron follows its current value V where they differ
/// by more than the yield strain y times its size S,
///
/// dR/dt = c sign(V − R) (|V − R| − yS), c the creep rate in 1/s,
///
/// which is Bingham's law: elastic below y, bitwise; above it, the flow rate is proportional to the
/// excess strain. S is the rest length of an edge and the rest volume of a tetrahedron, before any
/// flow, so that strains are ratios. For a hinge it is (A₀ + A₁)/e, which converts an angle to a
/// curvature in 1/m: that of the sheet, independent of the mesh resolution.
///
/// After each substep the equation is solved exactly for a constant V, by the factor 1 − e^(−ch),
/// so that a constant strain relaxes by the same law for any substep. Where c is so small that a
/// substep would change less than a 256th of the pending flow, several substeps are combined: rest
/// values are `f32`, and many steps below their rounding would add up to nothing.
///
/// Compliances per rest length or rest volume use the flowed values. Energy only decreases: flow is
/// towards lower stored energy. Rigid constraints have no strain except the residual of the
/// iterations.
///
/// ```
/// use pliant_solver::{Creep, Plasticity, Yield};
///
/// // Clay: strain beyond 2 % remains, at once.
/// let clay = Plasticity {
///     stretch_yield: Yield::of(0.02),
///     creep: Creep::of(f32::INFINITY), // 1/s
///     ..Plasticity::default()
/// };
/// # assert_ne!(clay, Plasticity::default());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Plasticity {
    /// Yield strain of edges; default ∞, no flow.
    pub stretch_yield: Yield,
    /// Yield change of curvature of hinges [1/m]; default ∞.
    pub bend_yield: Yield,
    /// Yield change of volume of tetrahedra, as a fraction; default ∞.
    pub volume_yield: Yield,
    /// Creep rate: fraction of the excess strain that flows per second [1/s], ∞ is at once; default
    /// 10.
    pub creep: Creep,
    /// Maximum change of a rest length, as a fraction of the original; default ∞.
    pub stretch_limit: PlasticLimit,
    /// Maximum change of the rest curvature of a hinge [1/m]; default ∞.
    pub bend_limit: PlasticLimit,
    /// Maximum change of a rest volume, as a fraction of the original; default ∞.
    pub volume_limit: PlasticLimit,
}

impl Plasticity {
    /// Yield strain of 5 % for edges, yield change of curvature of 5 1/m for hinges.
    #[must_use]
    pub fn typical() -> Self {
        Self {
            stretch_yield: Yield::of(0.05),
            bend_yield: Yield::of(5.0),
            ..Self::default()
        }
    }
}

/// Minimum fraction of the pending flow that is applied at once; see the module.
const MIN_FRACTION: f64 = 1.0 / 256.0;

/// Maximum fraction by which rest lengths and rest volumes shrink, whatever the limit.
const MAX_SHRINKING: f32 = 0.9;

impl Plasticity {
    /// Duration of the flow that is due at the end of a substep of `h` seconds, `time` seconds
    /// after the start; `None` if it is deferred to a later substep.
    #[must_use]
    pub fn due(&self, time: f64, h: f64) -> Option<f64> {
        let creep = f64::from(self.creep.get());
        if creep == 0.0 {
            return None;
        }
        let together = ((MIN_FRACTION / (creep * h)) as u64).max(1);
        let number = (time / h).round() as u64;
        number
            .is_multiple_of(together)
            .then_some(together as f64 * h)
    }

    /// Applies flow over some seconds at the current positions. The body gets its own topology.
    pub fn flow(
        &self,
        effects: &Effects,
        topology: &mut Arc<Topology>,
        particles: &mut Particles,
        seconds: f64,
    ) {
        let (original, own) = Topology::own(topology);
        // Between substeps particles are at p + c.
        let Particles {
            positions,
            displacements,
            carry,
            ..
        } = particles;
        let mut part = Part {
            positions,
            displacements: carry,
            carry: displacements,
            segments: &mut [],
            spins: &mut [],
            pushes: &mut [],
        };
        let law = |yields, limit| Law::new(yields, limit, self.creep, seconds);
        if effects.stretch.is_some()
            && let Some(law) = law(self.stretch_yield, self.stretch_limit)
        {
            let edges = &original.edges;
            let rest = Multipliers::Next(&mut own.edges.rest_length);
            solve_all(&Lengths { edges, law }, part.reborrow(), rest);
        }
        if effects.volume.is_some()
            && let Some(law) = law(self.volume_yield, self.volume_limit)
        {
            let tetrahedra = &original.tetrahedra;
            let rest = Multipliers::Next(&mut own.tetrahedra.rest_volume);
            solve_all(&Volumes { tetrahedra, law }, part.reborrow(), rest);
        }
        let Some(law) = law(self.bend_yield, self.bend_limit) else {
            return;
        };
        let hinges = original.hinges();
        if effects.bend.is_some() {
            let rest = Multipliers::Next(own.rest_angles_mut());
            solve_all(&Angles { hinges, law }, part.reborrow(), rest);
        }
        if effects.isometric_bend.is_some() {
            let cotangents = original.cotangents();
            let folds = Folds {
                hinges,
                cotangents,
                law,
            };
            let rest = Multipliers::Next(own.rest_folds_mut());
            solve_all(&folds, part.reborrow(), rest);
        }
    }

    /// The same in plain `f64`, for the reference.
    pub fn flow_plainly(
        &self,
        effects: &Effects,
        topology: &mut Arc<Topology>,
        x: &[DVec3],
        seconds: f64,
    ) {
        let at = |i: u32| x[i as usize];
        let (original, own) = Topology::own(topology);
        let law = |yields, limit| Law::new(yields, limit, self.creep, seconds);
        if effects.stretch.is_some()
            && let Some(law) = law(self.stretch_yield, self.stretch_limit)
        {
            let lengths = original.edges.ends().zip(&original.edges.rest_length);
            for (rest, (ends, &size)) in own.edges.rest_length.iter_mut().zip(lengths) {
                let [a, b] = ends.map(at);
                *rest = law.plain(a.distance(b), *rest, size, law.of_size(size));
            }
        }
        if effects.volume.is_some()
            && let Some(law) = law(self.volume_yield, self.volume_limit)
        {
            let tetrahedra = &original.tetrahedra;
            let volumes = tetrahedra.corners().zip(&tetrahedra.rest_volume);
            for (rest, (corners, &size)) in own.tetrahedra.rest_volume.iter_mut().zip(volumes) {
                let now = topology::volume(corners.map(at));
                *rest = law.plain(now, *rest, size.abs(), law.of_size(size));
            }
        }
        let Some(law) = law(self.bend_yield, self.bend_limit) else {
            return;
        };
        let hinges = original.hinges();
        if effects.bend.is_some() {
            let angles = hinges.corners().zip(&hinges.rest_angle).enumerate();
            for (rest, (index, (corners, &start))) in own.rest_angles_mut().iter_mut().zip(angles) {
                let size = hinges.flexibility[index] * edge_from(hinges.floors[1][index]);
                let now = f64::from(*rest) + wrapped(angle(corners.map(at)) - f64::from(*rest));
                let reach = size * law.limit;
                let bounds = [(start - reach).max(-PI), (start + reach).min(PI)];
                *rest = law.plain(now, *rest, size, bounds);
            }
        }
        if effects.isometric_bend.is_some() {
            let cotangents = original.cotangents();
            let folds = hinges.corners().enumerate();
            for (rest, (index, corners)) in own.rest_folds_mut().iter_mut().zip(folds) {
                let [x0, x1, x2, x3] = corners.map(at);
                let [k1, k2, k3] =
                    [0, 1, 2].map(|k: usize| f64::from(cotangents.weights[k][index]));
                let now = ((x1 - x0) * k1 + (x2 - x0) * k2 + (x3 - x0) * k3).length();
                let (start, size) = (cotangents.rest[index], cotangents.area[index]);
                let reach = size * law.limit;
                let bounds = [(start - reach).max(0.0), start + reach];
                *rest = law.plain(now, *rest, size, bounds);
            }
        }
    }

    /// Number of constraints that may flow.
    #[must_use]
    pub fn elements(&self, effects: &Effects, topology: &Topology) -> usize {
        let flows = |carried: bool, yields: Yield| carried && yields.get().is_finite();
        let mut count = 0;
        if flows(effects.stretch.is_some(), self.stretch_yield) {
            count += topology.edges.ends().len();
        }
        if flows(effects.volume.is_some(), self.volume_yield) {
            count += topology.tetrahedra.corners().len();
        }
        for bends in [effects.bend.is_some(), effects.isometric_bend.is_some()] {
            if flows(bends, self.bend_yield) {
                count += topology.hinges().corners().len();
            }
        }
        count
    }
}

/// Flow law for one kind of element.
#[derive(Debug, Clone, Copy)]
struct Law {
    /// y.
    yields: f32,
    /// Maximum change of R, relative to S.
    limit: f32,
    /// 1 − e^(−ch).
    fraction: f32,
}

impl Law {
    /// For `seconds`; `None` if it never flows.
    fn new(yields: Yield, limit: PlasticLimit, creep: Creep, seconds: f64) -> Option<Self> {
        let fraction = -libm::expm1(-f64::from(creep.get()) * seconds);
        yields.get().is_finite().then_some(Self {
            yields: yields.get(),
            // ∞ times a length of 0 would not be a number.
            limit: limit.get().min(1e6),
            fraction: fraction as f32,
        })
    }

    /// Minimum and maximum of a rest length or volume with the initial value `start`.
    fn of_size(&self, start: f32) -> [f32; 2] {
        let less = start - start * self.limit.min(MAX_SHRINKING);
        let more = start + start * self.limit;
        [less.min(more), less.max(more)]
    }

    /// New value of R, in `f64`.
    fn plain(&self, now: f64, rest: f32, size: f32, [least, most]: [f32; 2]) -> f32 {
        let error = now - f64::from(rest);
        let over = error.abs() - f64::from(size * self.yields);
        if over > 0.0 {
            let next = f64::from(rest) + (over * f64::from(self.fraction)).copysign(error);
            next.clamp(least.into(), most.into()) as f32
        } else {
            rest
        }
    }

    /// Change of R, in lanes.
    #[inline(always)]
    fn change<L: Lanes>(
        &self,
        simd: L,
        [now, rest, size]: [Floats<L>; 3],
        [least, most]: [Floats<L>; 2],
    ) -> Floats<L> {
        let error = now - rest;
        let over = error.abs() - size * self.yields;
        let step = over * self.fraction;
        let step = error.simd_lt(0.0).select(-step, step);
        let next = (rest + step).max(least).min(most);
        // Adding −0 leaves every number bitwise unchanged.
        over.simd_gt(0.0).select(next - rest, simd.number(-0.0))
    }

    /// [`of_size`](Self::of_size) in lanes.
    #[inline(always)]
    fn bounds<L: Lanes>(&self, start: Floats<L>) -> [Floats<L>; 2] {
        let less = start - start * self.limit.min(MAX_SHRINKING);
        let more = start + start * self.limit;
        [less.min(more), less.max(more)]
    }
}

/// e [m] from the lower bound of its square in kernels.
fn edge_from(floor: f32) -> f32 {
    (f64::from(floor) / FLOOR).sqrt() as f32
}

/// Rest lengths of edges, in the form of multipliers that move no particle.
struct Lengths<'a> {
    edges: &'a Edges,
    law: Law,
}

impl Blocks<2, 1> for Lengths<'_> {
    fn elements(&self) -> &Elements<2> {
        &self.edges.elements
    }

    fn damped(&self) -> bool {
        false
    }

    #[inline(always)]
    fn project<L: Lanes>(
        &self,
        simd: L,
        block: &Block<2>,
        [a, b]: &[Columns<L>; 2],
        _: Option<&[Vectors<L>; 2]>,
        rest: Option<[Floats<L>; 1]>,
    ) -> Projected<L, 2, 1> {
        let Some([rest]) = rest else {
            return Projected::still(simd, [simd.number(-0.0)]);
        };
        let d = difference(b, a);
        let size = block.column(simd, &self.edges.rest_length);
        let values = [dot(&d, &d).sqrt(), rest, size];
        let change = self.law.change(simd, values, self.law.bounds::<L>(size));
        Projected::still(simd, [change])
    }
}

/// Rest volumes of tetrahedra.
struct Volumes<'a> {
    tetrahedra: &'a Tetrahedra,
    law: Law,
}

impl Blocks<4, 1> for Volumes<'_> {
    fn elements(&self) -> &Elements<4> {
        &self.tetrahedra.elements
    }

    fn damped(&self) -> bool {
        false
    }

    #[inline(always)]
    fn project<L: Lanes>(
        &self,
        simd: L,
        block: &Block<4>,
        x: &[Columns<L>; 4],
        _: Option<&[Vectors<L>; 4]>,
        rest: Option<[Floats<L>; 1]>,
    ) -> Projected<L, 4, 1> {
        let Some([rest]) = rest else {
            return Projected::still(simd, [simd.number(-0.0)]);
        };
        let (a, b, c) = (
            difference(&x[1], &x[0]),
            difference(&x[2], &x[0]),
            difference(&x[3], &x[0]),
        );
        let now = dot(&a, &cross(&b, &c)) * (1.0 / 6.0);
        let start = block.column(simd, &self.tetrahedra.rest_volume);
        let values = [now, rest, start.abs()];
        let change = self.law.change(simd, values, self.law.bounds::<L>(start));
        Projected::still(simd, [change])
    }
}

/// Rest angles of hinges.
struct Angles<'a> {
    hinges: &'a Hinges,
    law: Law,
}

impl Blocks<4, 1> for Angles<'_> {
    fn elements(&self) -> &Elements<4> {
        &self.hinges.elements
    }

    fn damped(&self) -> bool {
        false
    }

    #[inline(always)]
    fn project<L: Lanes>(
        &self,
        simd: L,
        block: &Block<4>,
        x: &[Columns<L>; 4],
        _: Option<&[Vectors<L>; 4]>,
        rest: Option<[Floats<L>; 1]>,
    ) -> Projected<L, 4, 1> {
        let Some([rest]) = rest else {
            return Projected::still(simd, [simd.number(-0.0)]);
        };
        let floor = block.column(simd, &self.hinges.floors[1]);
        let edge = difference(&x[1], &x[0]);
        let (first, second) = (difference(&x[2], &x[0]), difference(&x[3], &x[0]));
        let (n1, n2) = (cross(&edge, &first), cross(&second, &edge));
        let length = dot(&edge, &edge).max(floor).sqrt();
        let sine = dot(&cross(&n1, &n2), &edge) / length;
        let angle = arc_tangent(simd, sine, dot(&n1, &n2));
        let mut error = angle - rest;
        error = error.simd_gt(PI).select(error - 2.0 * PI, error);
        error = error.simd_lt(-PI).select(error + 2.0 * PI, error);
        let start = block.column(simd, &self.hinges.rest_angle);
        let at_rest = (floor * (1.0 / FLOOR as f32)).sqrt();
        let size = block.column(simd, &self.hinges.flexibility) * at_rest;
        let reach = size * self.law.limit;
        let bounds = [(start - reach).max(-PI), (start + reach).min(PI)];
        let change = self.law.change(simd, [rest + error, rest, size], bounds);
        Projected::still(simd, [change])
    }
}

/// Rest folds of hinges with the quadratic bending energy.
struct Folds<'a> {
    hinges: &'a Hinges,
    cotangents: &'a Cotangents,
    law: Law,
}

impl Blocks<4, 1> for Folds<'_> {
    fn elements(&self) -> &Elements<4> {
        &self.hinges.elements
    }

    fn damped(&self) -> bool {
        false
    }

    #[inline(always)]
    fn project<L: Lanes>(
        &self,
        simd: L,
        block: &Block<4>,
        x: &[Columns<L>; 4],
        _: Option<&[Vectors<L>; 4]>,
        rest: Option<[Floats<L>; 1]>,
    ) -> Projected<L, 4, 1> {
        let Some([rest]) = rest else {
            return Projected::still(simd, [simd.number(-0.0)]);
        };
        let mut square = simd.number(0.0);
        let weights = &self.cotangents.weights;
        let (k1, k2, k3) = (
            block.column(simd, &weights[0]),
            block.column(simd, &weights[1]),
            block.column(simd, &weights[2]),
        );
        let (d1, d2, d3) = (
            difference(&x[1], &x[0]),
            difference(&x[2], &x[0]),
            difference(&x[3], &x[0]),
        );
        for ((d1, d2), d3) in d1.into_iter().zip(d2).zip(d3) {
            let d = d1 * k1 + d2 * k2 + d3 * k3;
            square += d * d;
        }
        let start = block.column(simd, &self.cotangents.rest);
        let size = block.column(simd, &self.cotangents.area);
        let reach = size * self.law.limit;
        let bounds = [(start - reach).max(0.0), start + reach];
        let change = self.law.change(simd, [square.sqrt(), rest, size], bounds);
        Projected::still(simd, [change])
    }
}
