//! Stretch.

#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Compliance, Damping, ElasticKind, Particles, RepairTime, Stiffness, Topology,
    elastic::{Elastic, Point, Row},
    kernel::{
        arithmetic::{difference, dot, scaled},
        block::{Ask, Block, Blocks, Projected, Resources, any},
    },
    lanes::{Columns, Floats, Lanes, Vectors},
    order::Elements,
    topology::{Edges, partitions::MAX_BATCHES},
};
use fearless_simd::prelude::*;
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicU64, Ordering};

/// Edges resist changes of length.
///
/// Stretch: C = ‖x₁ − x₀‖ − L₀ [m] on every edge.
///
/// λ/h² is the force along the edge in N (negative under tension). Compliance is in m/N: an edge
/// under a force F settles at C = αF.
///
/// ```
/// use pliant_solver::{Compliance, Damping, Stiffness, Stretch};
///
/// // A rope of 10 kN, however many segments it has.
/// let rope = Stretch {
///     axial_stiffness: Stiffness::of(1e4), // N
///     ..Stretch::default()
/// };
/// // Edges of a jelly, which stop vibrating within tenths of a second.
/// let jelly = Stretch {
///     compliance: Compliance::of(1e-4), // m/N
///     damping: Damping::of(0.05),       // s
///     ..Stretch::default()
/// };
/// # assert_ne!(rope, jelly);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Stretch {
    /// Compliance of each edge [m/N]; default 0, rigid.
    pub compliance: Compliance,
    /// Axial stiffness EA [N], independent of the resolution of a rope: an edge of rest length L₀
    /// adds L₀/EA to its compliance. Default ∞, which adds nothing.
    pub axial_stiffness: Stiffness,
    /// Damping τ [s], see [`Multipliers`](crate::effects::Multipliers); default 0.
    pub damping: Damping,
    /// Time constant [s] for recovering crushed and tangled edges of a sheet without adding
    /// velocity, see [`repair`](crate::repair); default 0.05, ∞ disables recovery. Ropes and solids
    /// ignore it.
    pub repair: RepairTime,
}

/// Coefficients for a substep of given length.
#[derive(Debug, Clone, Copy)]
pub struct Coefficients {
    /// α/h² [1/kg].
    alpha: f32,
    /// 1/(EA h²) [1/(kg·m)], multiplied by L₀.
    alpha_per_length: f32,
    /// γ = τ/h.
    gamma: f32,
}

impl Coefficients {
    /// Of springs of one compliance for a substep of `h` seconds.
    pub(super) fn of(compliance: Compliance, damping: Damping, h: f32) -> Self {
        Self {
            alpha: compliance.get() * (1.0 / (h * h)),
            alpha_per_length: 0.0,
            gamma: damping.get() / h,
        }
    }
}

impl Stretch {
    /// For a substep of `h` seconds.
    #[must_use]
    pub fn coefficients(&self, h: f32) -> Coefficients {
        Coefficients {
            alpha_per_length: 1.0 / (h * h) / self.axial_stiffness.get(),
            ..Coefficients::of(self.compliance, self.damping, h)
        }
    }

    /// Compliance [m/N] of an edge of the given rest length [m].
    #[must_use]
    pub fn compliance_of(&self, rest_length: f32) -> f64 {
        f64::from(self.compliance.get())
            + f64::from(rest_length) / f64::from(self.axial_stiffness.get())
    }
}

impl Elastic<2, 1> for Stretch {
    const KIND: ElasticKind = ElasticKind::Stretch;
    const UNIT: &'static str = "m/N";
    type Kernel<'a> = Kernel<'a>;

    fn elements(topology: &Topology) -> &Elements<2> {
        &topology.edges.elements
    }

    fn kernel<'a>(&self, topology: &'a Topology, h: f32) -> Kernel<'a> {
        Kernel::new(&topology.edges, &topology.rest, self.coefficients(h))
    }

    #[inline(always)]
    fn rows(&self, topology: &Topology, index: usize, ends: [Point; 2]) -> [Row<2>; 1] {
        let rest_length = topology.edges.rest_length[index];
        [edge_row(ends, rest_length, self.compliance_of(rest_length))]
    }

    fn damping(&self) -> Damping {
        self.damping
    }

    fn is_rigid(&self) -> bool {
        self.compliance_of(1.0) == 0.0
    }
}

/// The equation of a spring of a rest length [m] and a compliance [m/N].
#[inline(always)]
pub(super) fn edge_row([a, b]: [Point; 2], rest_length: f32, compliance: f64) -> Row<2> {
    let d = b.x - a.x;
    let length = d.length();
    let direction = if length > 0.0 {
        d / length
    } else {
        (b.rest - a.rest).normalize_or_zero()
    };
    Row {
        error: length - f64::from(rest_length),
        gradients: [-direction, direction],
        compliance,
        scale: f64::from(rest_length),
        least: 0.0,
    }
}

/// Whether any edge is shorter than the first of these fractions of its rest length, or would be
/// lengthened by a projection by more than the second, now or at the position predicted by inertia
/// for the next substep.
pub(crate) fn any_short(
    bounds: [f32; 2],
    kernel: &Kernel,
    particles: &Particles,
    resources: Resources,
) -> bool {
    let predicted = (&particles.positions[..], &particles.displacements[..]);
    let short = Short { bounds, kernel };
    any(&kernel.edges.elements, predicted, resources, &short)
}

struct Short<'a> {
    bounds: [f32; 2],
    kernel: &'a Kernel<'a>,
}

impl Ask<2> for Short<'_> {
    type Notes = ();

    #[inline(always)]
    fn holds<L: Lanes>(
        &self,
        simd: L,
        block: &Block<2>,
        ends: &[Columns<L>; 2],
        (): &mut (),
    ) -> bool {
        let [crushed, tangled] = self.bounds;
        let Measured {
            rest_length,
            length,
            weight,
            alpha,
        } = self.kernel.measure(simd, block, ends);
        let crushed = length.simd_lt(rest_length * crushed);
        let change = (rest_length - length) * weight;
        let tangled = change.simd_gt(rest_length * tangled * (weight + alpha));
        (crushed | tangled).any_true()
    }
}

/// Whether any edge is shorter than this fraction of its rest length as it is now, with lengths in
/// single precision: edges within a thousandth of it count, too, as they do in [`sums`].
pub(crate) fn any_crushed(
    fraction: f32,
    kernel: &Kernel,
    particles: &Particles,
    resources: Resources,
) -> bool {
    let now = (&particles.positions[..], &particles.carry[..]);
    let crushed = Crushed {
        fraction: fraction * CLOSE,
        kernel,
    };
    any(&kernel.edges.elements, now, resources, &crushed)
}

/// A fraction times this is above it by more than the rounding of lengths.
const CLOSE: f32 = 1.001;

struct Crushed<'a> {
    fraction: f32,
    kernel: &'a Kernel<'a>,
}

impl Ask<2> for Crushed<'_> {
    type Notes = ();

    #[inline(always)]
    fn holds<L: Lanes>(
        &self,
        simd: L,
        block: &Block<2>,
        ends: &[Columns<L>; 2],
        (): &mut (),
    ) -> bool {
        let edges = self.kernel.measure(simd, block, ends);
        edges
            .length
            .simd_lt(edges.rest_length * self.fraction)
            .any_true()
    }
}

/// Sums over the edges of a body.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct EdgeSums {
    /// Change of length by which a projection would shorten them [m].
    pub change: f64,
    /// Rest length of those that are shorter than a fraction of it [m].
    pub crushed: f64,
    /// Rest length [m].
    pub rest_length: f64,
}

/// Sums over the edges as they are now, with lengths in single precision: edges within a thousandth
/// of the `fraction` of their rest length count as shorter, too.
pub(crate) fn sums(
    fraction: f32,
    kernel: &Kernel,
    particles: &Particles,
    resources: Resources,
) -> EdgeSums {
    let now = (&particles.positions[..], &particles.carry[..]);
    let ask = Summed {
        fraction: fraction * CLOSE,
        kernel,
        sums: [const { [const { AtomicU64::new(0) }; 3] }; MAX_BATCHES],
    };
    any(&kernel.edges.elements, now, resources, &ask);
    // Batch by batch, whatever the threads.
    ask.sums.iter().fold(EdgeSums::default(), |sums, batch| {
        let of = |it: &AtomicU64| f64::from_bits(it.load(Ordering::Relaxed));
        EdgeSums {
            change: sums.change + of(&batch[0]),
            crushed: sums.crushed + of(&batch[1]),
            rest_length: sums.rest_length + of(&batch[2]),
        }
    })
}

struct Summed<'a> {
    fraction: f32,
    kernel: &'a Kernel<'a>,
    /// Of each batch, by one thread.
    sums: [[AtomicU64; 3]; MAX_BATCHES],
}

impl Ask<2> for Summed<'_> {
    /// The change, the rest length of crushed edges, and that of all [m].
    type Notes = [f64; 3];

    #[inline(always)]
    fn holds<L: Lanes>(
        &self,
        simd: L,
        block: &Block<2>,
        ends: &[Columns<L>; 2],
        notes: &mut [f64; 3],
    ) -> bool {
        let Measured {
            rest_length,
            length,
            weight,
            alpha,
        } = self.kernel.measure(simd, block, ends);
        let least = simd.number(f32::MIN_POSITIVE);
        let change = (length - rest_length) * weight / (weight + alpha).max(least);
        let is_crushed = length.simd_lt(rest_length * self.fraction);
        let [of_change, of_crushed, of_length] = notes;
        for lane in 0..block.lanes {
            *of_change += f64::from(change[lane]);
            *of_length += f64::from(rest_length[lane]);
        }
        if is_crushed.any_true() {
            let crushed = is_crushed.select(rest_length, simd.number(0.0));
            for lane in 0..block.lanes {
                *of_crushed += f64::from(crushed[lane]);
            }
        }
        false
    }

    fn take(&self, batch: usize, notes: [f64; 3]) {
        for (sum, of_batch) in self.sums[batch].iter().zip(notes) {
            sum.store(of_batch.to_bits(), Ordering::Relaxed);
        }
    }
}

/// Edges with the data for their projection.
///
/// An edge of length zero has no direction; it is pushed apart along its direction in the rest
/// shape, so that a body squeezed to a point opens, always in the same way. If it has no length at
/// rest either, it is not changed.
#[derive(Debug, Clone, Copy)]
pub struct Kernel<'a> {
    edges: &'a Edges,
    rest: &'a [Vec3],
    coefficients: Coefficients,
}

/// Edges of a block as they are.
struct Measured<L: Lanes> {
    /// Rest length [m]; 0 in lanes without a constraint.
    rest_length: Floats<L>,
    /// Length [m].
    length: Floats<L>,
    /// Sum of the inverse masses [1/kg].
    weight: Floats<L>,
    /// α/h² [1/kg].
    alpha: Floats<L>,
}

impl Kernel<'_> {
    #[inline(always)]
    fn measure<L: Lanes>(
        &self,
        simd: L,
        block: &Block<2>,
        [a, b]: &[Columns<L>; 2],
    ) -> Measured<L> {
        let Coefficients {
            alpha,
            alpha_per_length,
            ..
        } = self.coefficients;
        let rest_length = block.column(simd, &self.edges.rest_length);
        let d = difference(b, a);
        Measured {
            rest_length,
            length: dot(&d, &d).sqrt(),
            weight: a[3] + b[3],
            alpha: rest_length * alpha_per_length + alpha,
        }
    }
}

impl Blocks<2, 1> for Kernel<'_> {
    const APART: bool = true;

    fn elements(&self) -> &Elements<2> {
        &self.edges.elements
    }

    fn damped(&self) -> bool {
        self.coefficients.gamma > 0.0
    }

    #[inline(always)]
    fn project<L: Lanes>(
        &self,
        simd: L,
        block: &Block<2>,
        [a, b]: &[Columns<L>; 2],
        moved: Option<&[Vectors<L>; 2]>,
        lambda: Option<[Floats<L>; 1]>,
    ) -> Projected<L, 2, 1> {
        let Coefficients {
            alpha,
            alpha_per_length,
            gamma,
        } = self.coefficients;
        let rest_length = block.column(simd, &self.edges.rest_length);
        let mut d = difference(b, a);
        let mut length = dot(&d, &d).sqrt();
        let weight = a[3] + b[3];
        let alpha = rest_length * alpha_per_length + alpha;
        let mut error = rest_length - length;
        let weighted = weight * (1.0 + gamma) + alpha;
        let mut denominator = weighted * length;
        if denominator.simd_gt(0.0).any_false() {
            // Edges without a direction get one of length 1; those that cannot move do not change.
            (d, length) = self.open::<L>(block, d, length);
            denominator = weighted * length;
            error = denominator.simd_gt(0.0).select(error, simd.number(0.0));
            denominator = denominator
                .simd_gt(0.0)
                .select(denominator, simd.number(1.0));
        }
        if let Some([lambda]) = lambda {
            error -= alpha * lambda;
        }
        if let Some([_, apart]) = moved {
            // By the direction in the middle of the way: a rotation does not shorten it.
            let mut middle = d;
            for axis in 0..3 {
                middle[axis] -= apart[axis] * 0.5;
            }
            let square = dot(&middle, &middle).max(f32::MIN_POSITIVE);
            error -= dot(&middle, apart) / square.sqrt() * gamma;
        }
        let scale = error / denominator;
        Projected {
            moves: [scaled(&d, -(a[3] * scale)), scaled(&d, b[3] * scale)],
            change: [scale * length],
        }
    }
}

impl<'a> Kernel<'a> {
    /// For edges of a body with this rest shape.
    pub(super) fn new(edges: &'a Edges, rest: &'a [Vec3], coefficients: Coefficients) -> Self {
        Self {
            edges,
            rest,
            coefficients,
        }
    }
}

impl Kernel<'_> {
    /// Directions of the rest shape, of length 1, for edges of a block without length.
    #[cold]
    fn open<L: Lanes>(
        &self,
        block: &Block<2>,
        d: [Floats<L>; 3],
        length: Floats<L>,
    ) -> ([Floats<L>; 3], Floats<L>) {
        let (mut d, mut length) = (d, length);
        for (lane, _, ends) in block.constraints::<L>() {
            if length[lane] == 0.0 {
                let [a, b] = ends.map(|end| self.rest[end.particle() as usize]);
                let apart = b - a;
                let direction = apart.normalize_or_zero();
                length[lane] = 1.0;
                for (axis, d) in d.iter_mut().enumerate() {
                    d[lane] = direction[axis];
                }
            }
        }
        (d, length)
    }
}
