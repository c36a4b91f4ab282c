//! Direct solves of four chains at once, one per lane. Shorter chains are padded with equations that
//! move nothing.
//!
//! The same equations as those of [`System`](super::system::System), of which use is made that
//! - U = a + (b − a)d₃d₃ᵀ, for the inverse inertia a across a segment and b along it, and Ld₃ = 0,
//!   so that LU = aL and LULᵀ = al²(1 − d₃d₃ᵀ);
//! - the compliance of C_s is s + (e − s)d₃d₃ᵀ;
//! - C_s of a segment does not depend on the joint before: a quarter of each coupling block is 0.
//!
//! Four numbers of 64 bits fill a register; single precision would need the system to be scaled, as
//! its entries span many orders of magnitude. The order of operations in a lane does not depend on
//! the instruction set, nor on the chains in the other lanes.

#![allow(
    clippy::needless_range_loop,
    clippy::manual_memcpy,
    reason = "iterators and copies of arrays of lanes go through memory: twice the time"
)]

use super::{
    clamp::carried,
    elimination::SINGULAR,
    shape::Rest as RestChains,
    system::{Errors, Pass},
};
use crate::{
    SegmentState,
    kernel::lanes::{Lanes, SimdWork},
    particles::Part,
};
use fearless_simd::{f64x4, prelude::*};
use glam::{DQuat, DVec3};
use std::ops::Range;

/// Number of chains that are solved together.
const WIDTH: usize = 4;
/// Mark of a place that belongs to no chain.
const NONE: u32 = u32::MAX;

/// A number in each lane, in memory.
type Four = [f64; WIDTH];
/// A number in each lane.
type Number<L> = f64x4<L>;
type Vector<L> = [Number<L>; 3];
type Quaternion<L> = [Number<L>; 4];
type Six<L> = [Number<L>; 6];

/// A segment of each chain at rest, and the joint behind it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rest {
    /// Numbers of the segments in the body, or `NONE`.
    numbers: [u32; WIDTH],
    /// Length [m]; 0 where there is none.
    length: Four,
    /// 1 where there is none.
    absent: Four,
    /// 1 where there is a joint.
    joint: Four,
    /// Mean length of the segments of the joint [m].
    mean: Four,
    /// Rest rotation of the joint, in x, y, z and w.
    turn: [Four; 4],
}

const ZERO: Four = [0.0; WIDTH];
const ONE: Four = [1.0; WIDTH];
const UNTURNED: [Four; 4] = [ZERO, ZERO, ZERO, ONE];

/// A node of each chain in a substep.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Node {
    /// Position [m].
    x: [Four; 3],
    /// Inverse mass [1/kg]; 0 where there is none.
    w: Four,
    /// Displacement by the iteration [m].
    by: [Four; 3],
}

const NO_NODE: Node = Node {
    x: [ZERO; 3],
    w: ZERO,
    by: [ZERO; 3],
};

/// A segment of each chain in a substep.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Segment {
    orientation: [Four; 4],
    angular_velocity: [Four; 3],
    /// Orientation by inertia alone.
    predicted: [Four; 4],
    /// Inverse inertia across and along [1/(kg·m²)].
    inertia: [Four; 2],
    /// Errors at the start of the substep.
    before: [Four; 6],
    lambda: [Four; 6],
}

const NO_SEGMENT: Segment = Segment {
    orientation: UNTURNED,
    angular_velocity: [ZERO; 3],
    predicted: UNTURNED,
    inertia: [ZERO; 2],
    before: [ZERO; 6],
    lambda: [ZERO; 6],
};

/// What four chains need from iteration to iteration of a substep. With one iteration per substep
/// all bundles share one, which stays in the cache: memory would be the limit otherwise.
#[derive(Debug, Clone, Default, PartialEq)]
struct Moving {
    nodes: Vec<Node>,
    segments: Vec<Segment>,
}

impl Moving {
    fn make_room(&mut self, segments: usize) {
        self.nodes.resize(segments + 1, NO_NODE);
        self.segments.resize(segments, NO_SEGMENT);
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.segments[..])
    }
}

/// A block while the system is solved: S = LDLᵀ, and what couples it with the next one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Factor {
    /// The axis of the segment, and the rows of G, before the iteration.
    axis: [Four; 3],
    turns: [[Four; 3]; 3],
    /// L below its diagonal of ones.
    lower: [[Four; 6]; 6],
    /// D⁻¹; 0 for singular pivots.
    inverse: [Four; 6],
    /// L⁻¹Bᵀ: the columns of C_s of the next segment, and those of its joint, whose first half is
    /// 0.
    stretch: [[Four; 6]; 3],
    bend: [[Four; 3]; 3],
    /// L⁻¹ times the right-hand side.
    y: [Four; 6],
}

/// Memory for the solution of four chains.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scratch {
    factors: Vec<Factor>,
    moving: Moving,
}

impl Scratch {
    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.factors[..]) + self.moving.bytes()
    }
}

/// Four chains.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Bundle {
    /// The particles of each node, or `NONE`.
    particles: Vec<[u32; WIDTH]>,
    rest: Vec<Rest>,
    /// Empty with one iteration per substep.
    kept: Moving,
}

/// Some chains of a body in bundles of four: those of equal length together, in their order.
pub fn bundles(chains: &RestChains, some: Range<usize>) -> Vec<Bundle> {
    let mut order: Vec<usize> = some.collect();
    order.sort_by_key(|&chain| std::cmp::Reverse(chains.ranges[chain].len()));
    order
        .chunks(WIDTH)
        .map(|chosen| Bundle::of(chains, chosen))
        .collect()
}

impl Bundle {
    fn of(chains: &RestChains, chosen: &[usize]) -> Self {
        let longest = chosen.iter().map(|&chain| chains.ranges[chain].len());
        let count = longest.max().unwrap_or(0);
        let none = Rest {
            numbers: [NONE; WIDTH],
            length: ZERO,
            absent: ONE,
            joint: ZERO,
            mean: ZERO,
            turn: UNTURNED,
        };
        let mut bundle = Self {
            particles: vec![[NONE; WIDTH]; count + 1],
            rest: vec![none; count],
            kept: Moving::default(),
        };
        for (lane, &chain) in chosen.iter().enumerate() {
            let range = chains.ranges[chain].clone();
            for (k, number) in range.clone().enumerate() {
                let one = &chains.segments[number];
                bundle.particles[k][lane] = one.nodes[0];
                bundle.particles[k + 1][lane] = one.nodes[1];
                let rest = &mut bundle.rest[k];
                rest.numbers[lane] = number as u32;
                rest.length[lane] = one.length;
                rest.absent[lane] = 0.0;
                let next = range.clone().nth(k + 1);
                if let Some(joint) = next.and_then(|next| chains.segments[next].joint) {
                    rest.joint[lane] = 1.0;
                    rest.mean[lane] = joint.length;
                    for (all, one) in rest.turn.iter_mut().zip(joint.turn.to_array()) {
                        all[lane] = one;
                    }
                }
            }
        }
        bundle
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.particles[..]) + size_of_val(&self.rest[..]) + self.kept.bytes()
    }

    /// Reads positions [m] of the particles of a piece, in the first iteration also the segments
    /// with which a substep begins. Clamped ones have the angular velocity of their pins.
    fn load(&self, moving: &mut Moving, piece: &Piece, pass: &Pass) {
        let part = &piece.part;
        for (node, particles) in moving.nodes.iter_mut().zip(&self.particles) {
            for lane in 0..WIDTH {
                let (x, w) = if particles[lane] == NONE {
                    (DVec3::ZERO, 0.0)
                } else {
                    let particle = particles[lane] as usize - piece.first_particle;
                    (part.predicted(particle), part.positions[particle].w.into())
                };
                (node.x[0][lane], node.x[1][lane], node.x[2][lane]) = (x.x, x.y, x.z);
                node.w[lane] = w;
            }
        }
        if !pass.first {
            return;
        }
        let Moving { nodes, segments } = moving;
        for (k, (segment, rest)) in segments.iter_mut().zip(&self.rest).enumerate() {
            for lane in 0..WIDTH {
                let (q, v) = if rest.numbers[lane] == NONE {
                    (DQuat::IDENTITY, DVec3::ZERO)
                } else {
                    let number = rest.numbers[lane] as usize - piece.first_segment;
                    let SegmentState {
                        orientation,
                        angular_velocity,
                    } = part.segments[number];
                    let [from, to] = [&nodes[k], &nodes[k + 1]];
                    let velocity = if from.w[lane] == 0.0 && to.w[lane] == 0.0 {
                        let [from, to] = [from, to].map(|node| node.x.map(|it| it[lane]));
                        let along = DVec3::from_array(to) - DVec3::from_array(from);
                        let turn = pass.turn(k == 0, rest.joint[lane] == 0.0);
                        carried(orientation, along, turn) / pass.h
                    } else {
                        angular_velocity
                    };
                    (orientation, velocity)
                };
                let [x, y, z, w] = &mut segment.orientation;
                (x[lane], y[lane], z[lane], w[lane]) = (q.x, q.y, q.z, q.w);
                let [x, y, z] = &mut segment.angular_velocity;
                (x[lane], y[lane], z[lane]) = (v.x, v.y, v.z);
            }
        }
    }

    /// Moves the particles.
    fn store(&self, moving: &Moving, piece: &mut Piece) {
        for (node, particles) in moving.nodes.iter().zip(&self.particles) {
            for lane in 0..WIDTH {
                let by = DVec3::from_array(node.by.map(|it| it[lane]));
                if particles[lane] != NONE && by != DVec3::ZERO {
                    let particle = particles[lane] as usize - piece.first_particle;
                    piece.part.shift(particle, by);
                }
            }
        }
    }

    /// Writes the segments and their multipliers after the last iteration.
    fn finish(&self, moving: &Moving, piece: &mut Piece) {
        for (segment, rest) in moving.segments.iter().zip(&self.rest) {
            for lane in 0..WIDTH {
                if rest.numbers[lane] == NONE {
                    continue;
                }
                let number = rest.numbers[lane] as usize - piece.first_segment;
                piece.part.segments[number] = SegmentState {
                    orientation: DQuat::from_array(segment.orientation.map(|it| it[lane])),
                    angular_velocity: DVec3::from_array(
                        segment.angular_velocity.map(|it| it[lane]),
                    ),
                };
                let [a, b, c, d, e, f] = segment.lambda.map(|it| it[lane]);
                piece.lambdas[number][0] = DVec3::new(a, b, c);
                if rest.joint[lane] > 0.0 {
                    piece.lambdas[number + 1][1] = DVec3::new(d, e, f);
                }
            }
        }
    }
}

/// Particles, segments and multipliers of some chains.
pub struct Piece<'a> {
    pub part: Part<'a>,
    /// Number of the first particle and of the first segment.
    pub first_particle: usize,
    pub first_segment: usize,
    /// Written after the last iteration.
    pub lambdas: &'a mut [Errors],
}

/// An iteration over some chains of a body.
pub struct Iteration<'a, 'b> {
    pub bundles: &'a mut [Bundle],
    pub pass: &'a Pass,
    pub piece: Piece<'b>,
    pub scratch: &'a mut Scratch,
}

impl SimdWork for Iteration<'_, '_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self {
            bundles,
            pass,
            mut piece,
            scratch: Scratch { factors, moving },
        } = self;
        let is_only = pass.first && pass.last;
        for bundle in bundles {
            let count = bundle.rest.len();
            let mut kept = std::mem::take(&mut bundle.kept);
            let moving = if is_only { &mut *moving } else { &mut kept };
            moving.make_room(count);
            factors.resize(factors.len().max(count), Factor::default());
            bundle.load(moving, &piece, pass);
            if pass.first {
                begin(simd, bundle, moving, &piece, pass);
            }
            eliminate(simd, &bundle.rest, moving, factors, pass);
            substitute(simd, &bundle.rest, moving, factors, pass);
            if pass.last {
                end(simd, moving, pass);
            }
            bundle.store(moving, &mut piece);
            if pass.last {
                bundle.finish(moving, &mut piece);
            }
            bundle.kept = if is_only { Moving::default() } else { kept };
        }
    }
}

#[inline(always)]
fn read<L: Lanes, const N: usize>(simd: L, from: &[Four; N]) -> [Number<L>; N] {
    let mut all = [f64x4::splat(simd, 0.0); N];
    for k in 0..N {
        all[k] = f64x4::simd_from(simd, from[k]);
    }
    all
}

#[inline(always)]
fn write<L: Lanes, const N: usize>(to: &mut [Four; N], from: &[Number<L>; N]) {
    for k in 0..N {
        from[k].store_slice(&mut to[k]);
    }
}

#[inline(always)]
fn dot<L: Lanes>(a: &Vector<L>, b: &Vector<L>) -> Number<L> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross<L: Lanes>(a: &Vector<L>, b: &Vector<L>) -> Vector<L> {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline(always)]
fn scaled<L: Lanes, const N: usize>(a: &[Number<L>; N], by: Number<L>) -> [Number<L>; N] {
    let mut all = *a;
    for k in 0..N {
        all[k] = a[k] * by;
    }
    all
}

#[inline(always)]
fn sum<L: Lanes, const N: usize>(a: &[Number<L>; N], b: &[Number<L>; N]) -> [Number<L>; N] {
    let mut all = *a;
    for k in 0..N {
        all[k] = a[k] + b[k];
    }
    all
}

#[inline(always)]
fn difference<L: Lanes, const N: usize>(a: &[Number<L>; N], b: &[Number<L>; N]) -> [Number<L>; N] {
    let mut all = *a;
    for k in 0..N {
        all[k] = a[k] - b[k];
    }
    all
}

/// The product of two quaternions.
#[inline(always)]
fn product<L: Lanes>(a: &Quaternion<L>, b: &Quaternion<L>) -> Quaternion<L> {
    let ([ax, ay, az, aw], [bx, by, bz, bw]) = (*a, *b);
    [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ]
}

#[inline(always)]
fn conjugate<L: Lanes>(q: &Quaternion<L>) -> Quaternion<L> {
    let [x, y, z, w] = *q;
    [-x, -y, -z, w]
}

/// Turns an orientation by a small rotation vector [rad].
#[inline(always)]
fn turned<L: Lanes>(simd: L, q: &Quaternion<L>, by: &Vector<L>) -> Quaternion<L> {
    let zero = f64x4::splat(simd, 0.0);
    let change = product(&[by[0], by[1], by[2], zero], q);
    let [x, y, z, w] = sum(q, &scaled(&change, f64x4::splat(simd, 0.5)));
    let shorter = f64x4::splat(simd, 1.0) / (x * x + y * y + z * z + w * w).sqrt();
    scaled(&[x, y, z, w], shorter)
}

/// The columns of the rotation matrix of a unit quaternion.
#[inline(always)]
fn columns<L: Lanes>(simd: L, q: &Quaternion<L>) -> [Vector<L>; 3] {
    let one = f64x4::splat(simd, 1.0);
    let [x, y, z, w] = *q;
    let (x2, y2, z2) = (x + x, y + y, z + z);
    let (xx, xy, xz) = (x * x2, x * y2, x * z2);
    let (yy, yz, zz) = (y * y2, y * z2, z * z2);
    let (wx, wy, wz) = (w * x2, w * y2, w * z2);
    [
        [one - (yy + zz), xy + wz, xz - wy],
        [xy - wz, one - (xx + zz), yz + wx],
        [xz + wy, yz - wx, one - (xx + yy)],
    ]
}

/// 1/x where x is above `limit`, otherwise 0.
#[inline(always)]
fn inverse<L: Lanes>(simd: L, x: Number<L>, limit: Number<L>) -> Number<L> {
    let one = f64x4::splat(simd, 1.0);
    let is_above = x.simd_gt(limit);
    is_above.select(one / is_above.select(x, one), f64x4::splat(simd, 0.0))
}

/// C_b of a joint: the rotation from one segment to the next less that at rest, with the sign that
/// makes it smaller.
#[inline(always)]
fn bending<L: Lanes>(simd: L, turn: &Quaternion<L>, at_rest: &Rest) -> Vector<L> {
    let zero = f64x4::splat(simd, 0.0);
    let rest = read(simd, &at_rest.turn);
    let [joint] = read(simd, &[at_rest.joint]);
    let same = turn[0] * rest[0] + turn[1] * rest[1] + turn[2] * rest[2] + turn[3] * rest[3];
    let is_other = same.simd_lt(zero);
    let mut bend = [zero; 3];
    for k in 0..3 {
        bend[k] = (turn[k] - is_other.select(-rest[k], rest[k])) * joint;
    }
    bend
}

/// Positions of a node at the start of the substep [m].
#[inline(always)]
fn start<L: Lanes>(simd: L, particles: &[u32; WIDTH], piece: &Piece) -> Vector<L> {
    let mut x = [ZERO; 3];
    for lane in 0..WIDTH {
        if particles[lane] != NONE {
            let at = (piece.part).start(particles[lane] as usize - piece.first_particle);
            (x[0][lane], x[1][lane], x[2][lane]) = (at.x, at.y, at.z);
        }
    }
    read(simd, &x)
}

/// Errors at the start of a substep.
#[inline(always)]
fn remember<L: Lanes>(simd: L, bundle: &Bundle, moving: &mut Moving, piece: &Piece) {
    let zero = f64x4::splat(simd, 0.0);
    let Bundle {
        particles, rest, ..
    } = bundle;
    let segments = &mut moving.segments;
    let mut here = start(simd, &particles[0], piece);
    for i in 0..rest.len() {
        let next = start(simd, &particles[i + 1], piece);
        let q = read(simd, &segments[i].orientation);
        let [_, _, axis] = columns(simd, &q);
        let [length] = read(simd, &[rest[i].length]);
        let [a, b, c] = difference(&difference(&next, &here), &scaled(&axis, length));
        let [d, e, f] = match segments.get(i + 1) {
            Some(behind) => {
                let turn = product(&conjugate(&q), &read(simd, &behind.orientation));
                bending(simd, &turn, &rest[i])
            }
            None => [zero; 3],
        };
        write(&mut segments[i].before, &[a, b, c, d, e, f]);
        here = next;
    }
}

/// Mass per length at a node [kg/m] by the lengths of the segments beside it; ∞ where it is pinned.
#[inline(always)]
fn per_length<L: Lanes>(simd: L, node: &Node, before: Number<L>, behind: Number<L>) -> Number<L> {
    let one = f64x4::splat(simd, 1.0);
    let [w] = read(simd, &[node.w]);
    let is_free = w.simd_gt(f64x4::splat(simd, 0.0));
    let product = is_free.select(w * (before + behind), one);
    is_free.select(
        f64x4::splat(simd, 2.0) / product,
        f64x4::splat(simd, f64::INFINITY),
    )
}

/// Begins a substep: errors at its start, and rotation by inertia; the gyroscopic moment is left
/// out.
#[inline(always)]
fn begin<L: Lanes>(simd: L, bundle: &Bundle, moving: &mut Moving, piece: &Piece, pass: &Pass) {
    if pass.damping > 0.0 {
        remember(simd, bundle, moving, piece);
    }
    let zero = f64x4::splat(simd, 0.0);
    let infinity = f64x4::splat(simd, f64::INFINITY);
    let radius = pass.section.radius;
    let step = f64x4::splat(simd, pass.step());
    let rest = &bundle.rest;
    let Moving { nodes, segments } = moving;
    let mut before = zero;
    let [mut length] = read(simd, &[rest[0].length]);
    for i in 0..rest.len() {
        let behind = match rest.get(i + 1) {
            Some(rest) => f64x4::simd_from(simd, rest.length),
            None => zero,
        };
        let ends = [
            per_length(simd, &nodes[i], before, length),
            per_length(simd, &nodes[i + 1], length, behind),
        ];
        let lighter = ends[0].simd_lt(ends[1]).select(ends[0], ends[1]);
        let is_free = lighter.simd_lt(infinity);
        let mass = is_free.select(lighter, zero) * length;
        let across = mass * (length * length / 12.0 + radius * radius / 4.0);
        let along = mass * (radius * radius / 2.0);
        let inertia = [
            inverse(simd, across, zero) * step,
            inverse(simd, along, zero) * step,
        ];
        let segment = &mut segments[i];
        let turns = inertia[0].simd_gt(zero);
        let [x, y, z] = read(simd, &segment.angular_velocity);
        let velocity = [
            turns.select(x, is_free.select(zero, x)),
            turns.select(y, is_free.select(zero, y)),
            turns.select(z, is_free.select(zero, z)),
        ];
        let q = read(simd, &segment.orientation);
        let q = turned(simd, &q, &scaled(&velocity, f64x4::splat(simd, pass.h)));
        write(&mut segment.angular_velocity, &velocity);
        write(&mut segment.orientation, &q);
        write(&mut segment.predicted, &q);
        write(&mut segment.inertia, &inertia);
        segment.lambda = [ZERO; 6];
        (before, length) = (length, behind);
    }
}

/// What the equations of a segment depend on.
#[derive(Clone, Copy)]
struct Frame<L: Lanes> {
    columns: [Vector<L>; 3],
    orientation: Quaternion<L>,
    /// a and b.
    inertia: [Number<L>; 2],
}

#[inline(always)]
fn frame<L: Lanes>(simd: L, segment: &Segment) -> Frame<L> {
    let orientation = read(simd, &segment.orientation);
    Frame {
        columns: columns(simd, &orientation),
        orientation,
        inertia: read(simd, &segment.inertia),
    }
}

/// Eliminates the system from root to tip.
#[inline(always)]
fn eliminate<L: Lanes>(
    simd: L,
    rest: &[Rest],
    moving: &Moving,
    factors: &mut [Factor],
    pass: &Pass,
) {
    let section = &pass.section;
    let per_square = 1.0 / (pass.compliant * pass.compliant);
    let gamma = pass.damping / pass.compliant;
    let scale = 1.0 / (1.0 + gamma);
    let zero = f64x4::splat(simd, 0.0);
    let one = f64x4::splat(simd, 1.0);
    let half = f64x4::splat(simd, 0.5);
    let Moving { nodes, segments } = moving;
    for i in 0..rest.len() {
        // Each is made twice: to keep it would cost more.
        let now = frame(simd, &segments[i]);
        let next = frame(simd, segments.get(i + 1).unwrap_or(&segments[i]));
        let (segment, at_rest) = (&segments[i], &rest[i]);
        let (done, others) = factors.split_at_mut(i);
        let factor = &mut others[0];
        let axis = now.columns[2];
        let [a, b] = now.inertia;
        let [length, absent, joint, mean] = read(
            simd,
            &[at_rest.length, at_rest.absent, at_rest.joint, at_rest.mean],
        );
        let lambda = read(simd, &segment.lambda);
        let [w0, w1] = read(simd, &[nodes[i].w, nodes[i + 1].w]);
        // Behind the end of a chain is its last node, which must not be pulled.
        let present = one - absent;
        let w0 = w0 * present;
        let (from, to) = (read(simd, &nodes[i].x), read(simd, &nodes[i + 1].x));

        // Errors with damping, and the right-hand side.
        let turn = product(&conjugate(&now.orientation), &next.orientation);
        let mut stretch = difference(&difference(&to, &from), &scaled(&axis, length));
        let mut bend = bending(simd, &turn, at_rest);
        if gamma > 0.0 {
            let before = read(simd, &segment.before);
            for k in 0..3 {
                stretch[k] += (stretch[k] - before[k]) * gamma;
                bend[k] += (bend[k] - before[k + 3]) * gamma;
            }
        }
        stretch = scaled(&stretch, present);
        let across = length * (section.stretch.x * per_square);
        let along = length * (section.stretch.z * per_square);
        let pulled = [lambda[0], lambda[1], lambda[2]];
        let pull = dot(&axis, &pulled) * (along - across);
        let angular = [
            mean * (section.bend.x * per_square),
            mean * (section.bend.y * per_square),
            mean * (section.bend.z * per_square),
        ];
        let mut right: Six<L> = [zero; 6];
        for k in 0..3 {
            right[k] = -(stretch[k] + across * pulled[k] + pull * axis[k]) * scale;
            right[k + 3] = -(bend[k] + angular[k] * lambda[k + 3]) * scale;
        }

        // The block on the diagonal, below it.
        let mut block = [[zero; 6]; 6];
        let arm = a * length * length;
        let along_axis = (along - across) * scale - arm;
        let even = w0 + w1 + arm + across * scale + absent;
        for r in 0..3 {
            for c in 0..=r {
                block[r][c] = along_axis * axis[r] * axis[c];
            }
            block[r][r] += even;
        }
        let [px, py, pz, p0] = scaled(&turn, joint * half);
        let bends = [
            combination(&now.columns, [p0, pz, -py]),
            combination(&now.columns, [-pz, p0, px]),
            combination(&now.columns, [py, -px, p0]),
        ];
        let lever = a * length;
        for c in 0..3 {
            // The column of sb is −aL g.
            let column = scaled(&cross(&bends[c], &axis), lever);
            for r in 0..3 {
                block[c + 3][r] = column[r];
            }
        }
        let [next_a, next_b] = next.inertia;
        let mut here = [zero; 3];
        let mut there = [zero; 3];
        for r in 0..3 {
            here[r] = dot(&bends[r], &axis);
            there[r] = dot(&bends[r], &next.columns[2]);
        }
        for r in 0..3 {
            for c in 0..=r {
                block[r + 3][c + 3] = (a + next_a) * dot(&bends[r], &bends[c])
                    + (b - a) * here[r] * here[c]
                    + (next_b - next_a) * there[r] * there[c];
            }
            block[r + 3][r + 3] += angular[r] * scale + (one - joint);
        }
        let mut original = [zero; 6];
        for k in 0..6 {
            original[k] = block[k][k];
        }

        if let Some(before) = done.last_mut() {
            let last = [
                read(simd, &before.turns[0]),
                read(simd, &before.turns[1]),
                read(simd, &before.turns[2]),
            ];
            let mut coupling = Coupling {
                w: w0,
                stretch: [[zero; 3]; 3],
                bend: [[zero; 3]; 3],
            };
            for c in 0..3 {
                // The column of sb is aL g of the joint before.
                coupling.stretch[c] = scaled(&cross(&axis, &last[c]), lever);
                let along = (b - a) * dot(&last[c], &axis);
                for r in 0..3 {
                    coupling.bend[r][c] = -(a * dot(&bends[r], &last[c]) + along * here[r]);
                }
            }
            couple(simd, before, &coupling, &mut block, &mut right);
        }
        factorize(simd, factor, &mut block, &original, &mut right);
        write(&mut factor.axis, &axis);
        for r in 0..3 {
            write(&mut factor.turns[r], &bends[r]);
        }
    }
}

/// A combination of three vectors.
#[inline(always)]
fn combination<L: Lanes>(of: &[Vector<L>; 3], by: [Number<L>; 3]) -> Vector<L> {
    let mut all = of[0];
    for k in 0..3 {
        all[k] = of[0][k] * by[0] + of[1][k] * by[1] + of[2][k] * by[2];
    }
    all
}

/// The block B that couples a segment with the one before.
struct Coupling<L: Lanes> {
    /// −w on the diagonal of C_s and C_s.
    w: Number<L>,
    /// C_s and the equations of the joint before: by column.
    stretch: [Vector<L>; 3],
    /// C_b and the equations of the joint before: by row.
    bend: [Vector<L>; 3],
}

/// Takes Bᵀ S⁻¹ B of the block before from a block and its right-hand side.
#[inline(always)]
fn couple<L: Lanes>(
    simd: L,
    factor: &mut Factor,
    coupling: &Coupling<L>,
    block: &mut [[Number<L>; 6]; 6],
    right: &mut Six<L>,
) {
    let zero = f64x4::splat(simd, 0.0);
    let mut lower = [[zero; 6]; 6];
    for r in 1..6 {
        for c in 0..r {
            lower[r][c] = f64x4::simd_from(simd, factor.lower[r][c]);
        }
    }
    let inverse = read(simd, &factor.inverse);
    let y = read(simd, &factor.y);
    // L⁻¹Bᵀ, column by column.
    let mut stretch = [[zero; 6]; 3];
    forward::<L, 0>(&lower, coupling, &mut stretch[0]);
    forward::<L, 1>(&lower, coupling, &mut stretch[1]);
    forward::<L, 2>(&lower, coupling, &mut stretch[2]);
    let mut bend = coupling.bend;
    for column in &mut bend {
        column[1] -= lower[4][3] * column[0];
        column[2] -= lower[5][3] * column[0];
        column[2] -= lower[5][4] * column[1];
    }
    take::<L, 0>(&stretch, &bend, &inverse, &y, block, right);
    take::<L, 1>(&stretch, &bend, &inverse, &y, block, right);
    take::<L, 2>(&stretch, &bend, &inverse, &y, block, right);
    for r in 0..3 {
        write(&mut factor.stretch[r], &stretch[r]);
        write(&mut factor.bend[r], &bend[r]);
    }
}

/// Column `R` of L⁻¹Bᵀ. The row is a constant, so that all loops are unrolled.
#[inline(always)]
fn forward<L: Lanes, const R: usize>(
    lower: &[[Number<L>; 6]; 6],
    coupling: &Coupling<L>,
    column: &mut Six<L>,
) {
    column[R] = -coupling.w;
    for k in 0..3 {
        column[k + 3] = coupling.stretch[k][R];
    }
    for m in R..5 {
        for k in m + 1..6 {
            let by = lower[k][m] * column[m];
            column[k] -= by;
        }
    }
}

/// Takes the rows `R` and `R` + 3 of Bᵀ S⁻¹ B from a block and its right-hand side.
#[inline(always)]
fn take<L: Lanes, const R: usize>(
    stretch: &[[Number<L>; 6]; 3],
    bend: &[Vector<L>; 3],
    inverse: &Six<L>,
    y: &Six<L>,
    block: &mut [[Number<L>; 6]; 6],
    right: &mut Six<L>,
) {
    let mut scaled = stretch[R];
    for k in R..6 {
        scaled[k] *= inverse[k];
        right[R] -= scaled[k] * y[k];
    }
    let mut turned = bend[R];
    for k in 0..3 {
        turned[k] *= inverse[k + 3];
        right[R + 3] -= turned[k] * y[k + 3];
    }
    for c in 0..=R {
        for k in R..6 {
            block[R][c] -= scaled[k] * stretch[c][k];
        }
        for k in 0..3 {
            block[R + 3][c + 3] -= turned[k] * bend[c][k];
        }
    }
    for c in 0..3 {
        for k in 0..3 {
            block[R + 3][c] -= turned[k] * stretch[c][k + 3];
        }
    }
}

/// LDLᵀ of a block, and L⁻¹ times its right-hand side.
#[inline(always)]
fn factorize<L: Lanes>(
    simd: L,
    factor: &mut Factor,
    block: &mut [[Number<L>; 6]; 6],
    original: &Six<L>,
    right: &mut Six<L>,
) {
    pivot::<L, 0>(simd, factor, block, original, right);
    pivot::<L, 1>(simd, factor, block, original, right);
    pivot::<L, 2>(simd, factor, block, original, right);
    pivot::<L, 3>(simd, factor, block, original, right);
    pivot::<L, 4>(simd, factor, block, original, right);
    pivot::<L, 5>(simd, factor, block, original, right);
    write(&mut factor.y, right);
}

/// Eliminates column `J`.
#[inline(always)]
fn pivot<L: Lanes, const J: usize>(
    simd: L,
    factor: &mut Factor,
    block: &mut [[Number<L>; 6]; 6],
    original: &Six<L>,
    right: &mut Six<L>,
) {
    let pivot = inverse(simd, block[J][J], original[J] * SINGULAR);
    pivot.store_slice(&mut factor.inverse[J]);
    for r in J + 1..6 {
        let entry = block[r][J] * pivot;
        for c in J + 1..=r {
            let by = entry * block[c][J];
            block[r][c] -= by;
        }
        entry.store_slice(&mut factor.lower[r][J]);
        right[r] -= entry * right[J];
    }
}

/// Row `K` of L⁻ᵀ D⁻¹ x.
#[inline(always)]
fn backward<L: Lanes, const K: usize>(simd: L, factor: &Factor, x: &mut Six<L>) {
    let mut sum = x[K] * f64x4::simd_from(simd, factor.inverse[K]);
    for m in K + 1..6 {
        sum -= f64x4::simd_from(simd, factor.lower[m][K]) * x[m];
    }
    x[K] = sum;
}

/// Solves the system from tip to root, and moves the nodes and turns the segments by the change of
/// the multipliers.
#[inline(always)]
fn substitute<L: Lanes>(
    simd: L,
    rest: &[Rest],
    moving: &mut Moving,
    factors: &[Factor],
    pass: &Pass,
) {
    let zero = f64x4::splat(simd, 0.0);
    let Moving { nodes, segments } = moving;
    let mut next: Six<L> = [zero; 6];
    let count = rest.len();
    let mut changes = [zero; 6];
    for node in nodes.iter_mut() {
        node.by = [ZERO; 3];
    }
    // The change of a segment waits for the one before: both turn it.
    for i in (0..=count).rev() {
        let change = if i == 0 {
            [zero; 6]
        } else {
            let factor = &factors[i - 1];
            let mut x = read(simd, &factor.y);
            if i < count {
                for r in 0..3 {
                    let stretch = read(simd, &factor.stretch[r]);
                    for k in r..6 {
                        x[k] -= stretch[k] * next[r];
                    }
                    let bend = read(simd, &factor.bend[r]);
                    for k in 0..3 {
                        x[k + 3] -= bend[k] * next[r + 3];
                    }
                }
            }
            backward::<L, 5>(simd, factor, &mut x);
            backward::<L, 4>(simd, factor, &mut x);
            backward::<L, 3>(simd, factor, &mut x);
            backward::<L, 2>(simd, factor, &mut x);
            backward::<L, 1>(simd, factor, &mut x);
            backward::<L, 0>(simd, factor, &mut x);
            next = x;
            scaled(&x, f64x4::splat(simd, pass.relaxation))
        };
        if i < count {
            let before = if i == 0 {
                [zero; 3]
            } else {
                moment(simd, &factors[i - 1], &change)
            };
            let segment = (&mut segments[i], &rest[i]);
            turn(simd, segment, &factors[i], &changes, &before);
            let s = [changes[0], changes[1], changes[2]];
            let [w0, w1] = read(simd, &[nodes[i].w, nodes[i + 1].w]);
            let (first, second) = (read(simd, &nodes[i].by), read(simd, &nodes[i + 1].by));
            write(&mut nodes[i].by, &difference(&first, &scaled(&s, w0)));
            write(&mut nodes[i + 1].by, &sum(&second, &scaled(&s, w1)));
        }
        changes = change;
    }
}

/// Gᵀ times the change of a joint.
#[inline(always)]
fn moment<L: Lanes>(simd: L, factor: &Factor, change: &Six<L>) -> Vector<L> {
    let rows = [
        read(simd, &factor.turns[0]),
        read(simd, &factor.turns[1]),
        read(simd, &factor.turns[2]),
    ];
    combination(&rows, [change[3], change[4], change[5]])
}

/// Turns a segment by the changes of its equations and by the moment of the joint before.
#[inline(always)]
fn turn<L: Lanes>(
    simd: L,
    (segment, rest): (&mut Segment, &Rest),
    factor: &Factor,
    change: &Six<L>,
    before: &Vector<L>,
) {
    let lambda = read(simd, &segment.lambda);
    write(&mut segment.lambda, &sum(&lambda, change));
    let axis = read(simd, &factor.axis);
    let [a, b] = read(simd, &segment.inertia);
    let [length] = read(simd, &[rest.length]);
    let behind = moment(simd, factor, change);
    let pull = scaled(&cross(&axis, &[change[0], change[1], change[2]]), length);
    let all = difference(&difference(before, &behind), &pull);
    let along = (b - a) * dot(&axis, &all);
    let by = sum(&scaled(&all, a), &scaled(&axis, along));
    let q = read(simd, &segment.orientation);
    write(&mut segment.orientation, &turned(simd, &q, &by));
}

/// Ends a substep: angular velocities.
#[inline(always)]
fn end<L: Lanes>(simd: L, moving: &mut Moving, pass: &Pass) {
    let zero = f64x4::splat(simd, 0.0);
    let two = f64x4::splat(simd, 2.0 / pass.h);
    for segment in &mut moving.segments {
        let predicted = read(simd, &segment.predicted);
        let turn = product(&read(simd, &segment.orientation), &conjugate(&predicted));
        let sign = turn[3].simd_lt(zero).select(-two, two);
        let velocity = read(simd, &segment.angular_velocity);
        let change = scaled(&[turn[0], turn[1], turn[2]], sign);
        write(&mut segment.angular_velocity, &sum(&velocity, &change));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Particles, RestShape, Topology,
        effects::rod::{
            shape::RodShape,
            system::{Node as PlainNode, Section, System},
        },
        lanes::Instructions,
    };
    use glam::Vec3;

    /// Chains of 1, 7, 3, 7, 12 and 2 segments, bent and clamped.
    fn chains() -> (Topology, Particles) {
        let mut shape = RestShape::default();
        for (chain, count) in [1_u32, 7, 3, 7, 12, 2].into_iter().enumerate() {
            let first = shape.vertices.len() as u32;
            for k in 0..=count {
                let t = k as f32;
                let place = Vec3::new(0.1 * t, 0.02 * t * t, 0.3 * chain as f32 + 0.01 * t);
                shape.vertices.push(place);
            }
            shape
                .edges
                .extend((first..first + count).map(|i| [i, i + 1]));
        }
        let topology = Topology::new(shape).expect("sound");
        let mut particles = Particles::at_rest(topology.rest.iter().copied());
        for (i, x) in particles.positions.iter_mut().enumerate() {
            // Light at places, and the first segments between pins.
            x.w = if x.x < 0.15 {
                0.0
            } else {
                10.0 + (i % 3) as f32
            };
        }
        (topology, particles)
    }

    fn pass() -> Pass {
        Pass {
            h: 1e-3,
            compliant: 1e-3,
            first: true,
            last: true,
            relaxation: 1.0,
            section: Section::circle(5e-3, 1e6, 0.3),
            damping: 0.01,
            turns: [0.01, -0.02],
        }
    }

    /// Ten substeps in which particles are pushed aside, also the pins.
    fn run(mut step: impl FnMut(&mut Particles), particles: &mut Particles) {
        for substep in 0..10 {
            for (i, u) in particles.displacements.iter_mut().enumerate() {
                let push = ((i * 7 + substep * 3) % 11) as f32 - 5.0;
                *u += glam::Vec4::new(1e-5, -2e-5, 0.7e-5, 0.0) * push;
            }
            step(particles);
        }
    }

    fn shape(topology: &Topology) -> RestChains {
        RodShape::of(topology).expect("edges alone").chains
    }

    fn all(chains: &RestChains) -> Vec<Bundle> {
        bundles(chains, 0..chains.ranges.len())
    }

    fn in_lanes(
        instructions: Instructions,
        chosen: &dyn Fn(&RestChains) -> Vec<Bundle>,
    ) -> Particles {
        let (topology, mut particles) = chains();
        let chains = shape(&topology);
        let fitted = chains.fit(|i| particles.position(i as usize));
        particles.segments = fitted
            .into_iter()
            .map(|orientation| SegmentState {
                orientation,
                angular_velocity: DVec3::new(0.3, 0.1, -0.2),
            })
            .collect();
        let mut bundles = chosen(&chains);
        let mut lambdas = vec![Errors::default(); particles.segments.len()];
        let mut scratch = Scratch::default();
        run(
            |particles| {
                instructions.run(Iteration {
                    bundles: &mut bundles,
                    pass: &pass(),
                    piece: Piece {
                        part: particles.as_part(),
                        first_particle: 0,
                        first_segment: 0,
                        lambdas: &mut lambdas,
                    },
                    scratch: &mut scratch,
                });
            },
            &mut particles,
        );
        particles
    }

    #[test]
    fn neither_the_instruction_set_nor_the_other_lanes_change_a_bit() {
        let expected = in_lanes(Instructions::default(), &all);
        for instructions in Instructions::all() {
            let found = in_lanes(instructions, &all);
            assert_eq!(found, expected, "{instructions:?}");
        }
        let alone = |chains: &RestChains| -> Vec<Bundle> {
            let mut order: Vec<usize> = (0..chains.ranges.len()).collect();
            order.sort_by_key(|&chain| std::cmp::Reverse(chains.ranges[chain].len()));
            order
                .into_iter()
                .map(|chain| Bundle::of(chains, &[chain]))
                .collect()
        };
        assert_eq!(in_lanes(Instructions::default(), &alone), expected);
    }

    #[test]
    fn the_lanes_solve_the_equations_of_the_reference() {
        let found = in_lanes(Instructions::default(), &all);
        let (topology, mut particles) = chains();
        let chains = shape(&topology);
        let mut system = System::new(chains, particles.len());
        let fitted = system.rest.fit(|i| particles.position(i as usize));
        system.segments = fitted
            .into_iter()
            .map(|orientation| SegmentState {
                orientation,
                angular_velocity: DVec3::new(0.3, 0.1, -0.2),
            })
            .collect();
        run(
            |particles| {
                let state = &*particles;
                let at = |i: u32| PlainNode {
                    x: state.predicted(i as usize),
                    w: state.positions[i as usize].w.into(),
                };
                system.iterate(&pass(), at, |i| state.position(i as usize));
                let mut part = particles.as_part();
                for (i, &by) in system.moves.iter().enumerate() {
                    if by != DVec3::ZERO {
                        part.shift(i, by);
                    }
                }
            },
            &mut particles,
        );
        for (segment, found) in system.segments.iter().zip(&found.segments) {
            // Displacements of up to 1e-3 m are rounded to 24 bits, on segments of 0.1 m, in ten
            // substeps.
            let turn = segment.orientation.dot(found.orientation).abs();
            assert!((turn - 1.0).abs() < 1e-12, "{turn}");
            let off = segment.angular_velocity.distance(found.angular_velocity);
            assert!(off < 1e-4 * segment.angular_velocity.length(), "{off}");
        }
        for (expected, found) in particles.displacements.iter().zip(&found.displacements) {
            assert!(expected.distance(*found) < 1e-9, "{expected} {found}");
        }
    }
}
