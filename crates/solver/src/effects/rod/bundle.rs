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
    Rod,
    chains::Chains,
    elimination::SINGULAR,
    system::{Errors, Pass, Section, SegmentState},
};
use crate::{
    kernel::lanes::{Lanes, SimdWork},
    particles::Part,
};
use fearless_simd::{f64x4, prelude::*};
use glam::{DQuat, DVec3};

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

/// A node of each chain.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Node {
    /// Its particles, or `NONE`.
    particles: [u32; WIDTH],
    /// Position [m].
    x: [Four; 3],
    /// Inverse mass [1/kg]; 0 where there is none.
    w: Four,
    /// Displacement by the iteration [m].
    by: [Four; 3],
}

/// A segment of each chain, and the joint behind it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Segment {
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
    rest: [Four; 4],
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

/// A block while the system is solved: S = LDLᵀ, and what couples it with the next one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Factor {
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

/// Four chains.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Bundle {
    nodes: Vec<Node>,
    segments: Vec<Segment>,
}

/// The chains of a body in bundles of four: those of equal length together, in their order.
pub fn bundles(chains: &Chains) -> Vec<Bundle> {
    let mut order: Vec<usize> = (0..chains.ranges.len()).collect();
    order.sort_by_key(|&chain| std::cmp::Reverse(chains.ranges[chain].len()));
    order
        .chunks(WIDTH)
        .map(|chosen| Bundle::of(chains, chosen))
        .collect()
}

impl Bundle {
    fn of(chains: &Chains, chosen: &[usize]) -> Self {
        let longest = chosen.iter().map(|&chain| chains.ranges[chain].len());
        let count = longest.max().unwrap_or(0);
        let zero = [0.0; WIDTH];
        let mut bundle = Self {
            nodes: vec![
                Node {
                    particles: [NONE; WIDTH],
                    x: [zero; 3],
                    w: zero,
                    by: [zero; 3],
                };
                count + 1
            ],
            segments: vec![
                Segment {
                    numbers: [NONE; WIDTH],
                    length: zero,
                    absent: [1.0; WIDTH],
                    joint: zero,
                    mean: zero,
                    rest: [zero, zero, zero, [1.0; WIDTH]],
                    orientation: [zero, zero, zero, [1.0; WIDTH]],
                    angular_velocity: [zero; 3],
                    predicted: [zero, zero, zero, [1.0; WIDTH]],
                    inertia: [zero; 2],
                    before: [zero; 6],
                    lambda: [zero; 6],
                };
                count
            ],
        };
        for (lane, &chain) in chosen.iter().enumerate() {
            let range = chains.ranges[chain].clone();
            for (k, number) in range.enumerate() {
                let rest = &chains.segments[number];
                bundle.nodes[k].particles[lane] = rest.nodes[0];
                bundle.nodes[k + 1].particles[lane] = rest.nodes[1];
                let segment = &mut bundle.segments[k];
                segment.numbers[lane] = number as u32;
                segment.length[lane] = rest.length;
                segment.absent[lane] = 0.0;
                if let Some((turn, mean)) = rest.joint {
                    segment.joint[lane] = 1.0;
                    segment.mean[lane] = mean;
                    for (all, one) in segment.rest.iter_mut().zip(turn.to_array()) {
                        all[lane] = one;
                    }
                }
            }
        }
        bundle
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.segments[..])
    }

    /// Reads positions [m], in the first iteration also what a substep begins with.
    fn load(&mut self, part: &Part, first: bool) {
        for node in &mut self.nodes {
            for lane in 0..WIDTH {
                let particle = node.particles[lane];
                if particle == NONE {
                    continue;
                }
                let x = part.predicted(particle as usize);
                for (axis, x) in x.to_array().into_iter().enumerate() {
                    node.x[axis][lane] = x;
                }
                node.w[lane] = part.positions[particle as usize].w.into();
            }
        }
        if !first {
            return;
        }
        for segment in &mut self.segments {
            for lane in 0..WIDTH {
                let number = segment.numbers[lane];
                if number == NONE {
                    continue;
                }
                let state = &part.segments[number as usize];
                let orientation = state.orientation.to_array();
                for (all, one) in segment.orientation.iter_mut().zip(orientation) {
                    all[lane] = one;
                }
                let velocity = state.angular_velocity.to_array();
                for (all, one) in segment.angular_velocity.iter_mut().zip(velocity) {
                    all[lane] = one;
                }
            }
        }
    }

    /// Moves the particles.
    fn store(&self, part: &mut Part) {
        for node in &self.nodes {
            for lane in 0..WIDTH {
                let particle = node.particles[lane];
                let by = DVec3::from_array(node.by.map(|it| it[lane]));
                if particle != NONE && by != DVec3::ZERO {
                    part.shift(particle as usize, by);
                }
            }
        }
    }

    /// Writes the segments and their multipliers after the last iteration.
    fn finish(&self, segments: &mut [SegmentState], lambdas: &mut [Errors]) {
        for segment in &self.segments {
            for lane in 0..WIDTH {
                let number = segment.numbers[lane];
                if number == NONE {
                    continue;
                }
                segments[number as usize] = SegmentState {
                    orientation: DQuat::from_array(segment.orientation.map(|it| it[lane])),
                    angular_velocity: DVec3::from_array(
                        segment.angular_velocity.map(|it| it[lane]),
                    ),
                };
                let [a, b, c, d, e, f] = segment.lambda.map(|it| it[lane]);
                lambdas[number as usize] = [DVec3::new(a, b, c), DVec3::new(d, e, f)];
            }
        }
    }
}

/// An iteration over the chains of a body.
pub struct Iteration<'a, 'b> {
    pub bundles: &'a mut [Bundle],
    pub rod: &'a Rod,
    pub pass: &'a Pass,
    pub part: &'a mut Part<'b>,
    /// Scratch memory for one bundle, which stays in the cache.
    pub factors: &'a mut Vec<Factor>,
    /// Written after the last iteration.
    pub lambdas: &'a mut [Errors],
}

impl SimdWork for Iteration<'_, '_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self {
            bundles,
            rod,
            pass,
            part,
            factors,
            lambdas,
        } = self;
        // The first bundles are the longest.
        let longest = bundles.first().map_or(0, |it| it.segments.len());
        factors.resize(longest, Factor::default());
        for bundle in bundles {
            bundle.load(part, pass.first);
            if pass.first {
                begin(simd, bundle, part, rod, pass);
            }
            eliminate(simd, bundle, factors, rod, pass);
            substitute(simd, bundle, factors, pass);
            if pass.last {
                end(simd, bundle, pass);
            }
            bundle.store(part);
            if pass.last {
                bundle.finish(part.segments, lambdas);
            }
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
fn bending<L: Lanes>(simd: L, turn: &Quaternion<L>, segment: &Segment) -> Vector<L> {
    let zero = f64x4::splat(simd, 0.0);
    let rest = read(simd, &segment.rest);
    let [joint] = read(simd, &[segment.joint]);
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
fn start<L: Lanes>(simd: L, node: &Node, part: &Part) -> Vector<L> {
    let mut x = [[0.0; WIDTH]; 3];
    for lane in 0..WIDTH {
        if node.particles[lane] != NONE {
            let at = part.start(node.particles[lane] as usize);
            (x[0][lane], x[1][lane], x[2][lane]) = (at.x, at.y, at.z);
        }
    }
    read(simd, &x)
}

/// Errors at the start of a substep.
#[inline(always)]
fn remember<L: Lanes>(simd: L, bundle: &mut Bundle, part: &Part) {
    let zero = f64x4::splat(simd, 0.0);
    let mut here = start(simd, &bundle.nodes[0], part);
    for i in 0..bundle.segments.len() {
        let next = start(simd, &bundle.nodes[i + 1], part);
        let q = read(simd, &bundle.segments[i].orientation);
        let [_, _, axis] = columns(simd, &q);
        let [length] = read(simd, &[bundle.segments[i].length]);
        let [a, b, c] = difference(&difference(&next, &here), &scaled(&axis, length));
        let [d, e, f] = match bundle.segments.get(i + 1) {
            Some(behind) => {
                let turn = product(&conjugate(&q), &read(simd, &behind.orientation));
                bending(simd, &turn, &bundle.segments[i])
            }
            None => [zero; 3],
        };
        write(&mut bundle.segments[i].before, &[a, b, c, d, e, f]);
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
fn begin<L: Lanes>(simd: L, bundle: &mut Bundle, part: &Part, rod: &Rod, pass: &Pass) {
    if rod.damping.get() > 0.0 {
        remember(simd, bundle, part);
    }
    let zero = f64x4::splat(simd, 0.0);
    let infinity = f64x4::splat(simd, f64::INFINITY);
    let radius = f64::from(rod.radius.get());
    let step = f64x4::splat(simd, pass.step());
    let Bundle { nodes, segments } = bundle;
    let mut before = zero;
    let [mut length] = read(simd, &[segments[0].length]);
    for i in 0..segments.len() {
        let behind = match segments.get(i + 1) {
            Some(segment) => f64x4::simd_from(simd, segment.length),
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
            turns.select(x, zero),
            turns.select(y, zero),
            turns.select(z, zero),
        ];
        let q = read(simd, &segment.orientation);
        let q = turned(simd, &q, &scaled(&velocity, f64x4::splat(simd, pass.h)));
        write(&mut segment.angular_velocity, &velocity);
        write(&mut segment.orientation, &q);
        write(&mut segment.predicted, &q);
        write(&mut segment.inertia, &inertia);
        segment.lambda = [[0.0; WIDTH]; 6];
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
fn eliminate<L: Lanes>(simd: L, bundle: &Bundle, factors: &mut [Factor], rod: &Rod, pass: &Pass) {
    let section = Section::of(rod);
    let per_square = 1.0 / (pass.compliant * pass.compliant);
    let gamma = f64::from(rod.damping.get()) / pass.compliant;
    let scale = 1.0 / (1.0 + gamma);
    let zero = f64x4::splat(simd, 0.0);
    let one = f64x4::splat(simd, 1.0);
    let half = f64x4::splat(simd, 0.5);
    let Bundle { nodes, segments } = bundle;
    let mut now = frame(simd, &segments[0]);
    // The rows of G of the joint before.
    let mut last = [[zero; 3]; 3];
    for i in 0..segments.len() {
        let next = match segments.get(i + 1) {
            Some(segment) => frame(simd, segment),
            None => now,
        };
        let segment = &segments[i];
        let (done, rest) = factors.split_at_mut(i);
        let factor = &mut rest[0];
        let axis = now.columns[2];
        let [a, b] = now.inertia;
        let [length, absent, joint, mean] = read(
            simd,
            &[segment.length, segment.absent, segment.joint, segment.mean],
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
        let mut bend = bending(simd, &turn, segment);
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
        last = bends;
        now = next;
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
fn substitute<L: Lanes>(simd: L, bundle: &mut Bundle, factors: &[Factor], pass: &Pass) {
    let zero = f64x4::splat(simd, 0.0);
    let Bundle { nodes, segments } = bundle;
    let mut next: Six<L> = [zero; 6];
    let count = segments.len();
    let mut changes = [zero; 6];
    for node in nodes.iter_mut() {
        node.by = [[0.0; WIDTH]; 3];
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
            turn(simd, &mut segments[i], &factors[i], &changes, &before);
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
    segment: &mut Segment,
    factor: &Factor,
    change: &Six<L>,
    before: &Vector<L>,
) {
    let lambda = read(simd, &segment.lambda);
    write(&mut segment.lambda, &sum(&lambda, change));
    let axis = read(simd, &factor.axis);
    let [a, b] = read(simd, &segment.inertia);
    let [length] = read(simd, &[segment.length]);
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
fn end<L: Lanes>(simd: L, bundle: &mut Bundle, pass: &Pass) {
    let zero = f64x4::splat(simd, 0.0);
    let two = f64x4::splat(simd, 2.0 / pass.h);
    for segment in &mut bundle.segments {
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
        effects::rod::system::{Node as PlainNode, System},
        lanes::Instructions,
    };
    use glam::Vec3;

    /// Chains of 1, 7, 3, 7, 12 and 2 segments, bent, with their first nodes pinned.
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
            // Light at places, and pinned at the roots.
            x.w = if x.x == 0.0 {
                0.0
            } else {
                10.0 + (i % 3) as f32
            };
        }
        (topology, particles)
    }

    fn rod() -> Rod {
        Rod {
            damping: crate::Damping::of(0.01),
            ..Rod::default()
        }
    }

    const PASS: Pass = Pass {
        h: 1e-3,
        compliant: 1e-3,
        first: true,
        last: true,
        relaxation: 1.0,
    };

    /// Ten substeps in which particles are pushed aside.
    fn run(mut step: impl FnMut(&mut Particles), particles: &mut Particles) {
        for substep in 0..10 {
            for (i, u) in particles.displacements.iter_mut().enumerate() {
                let push = ((i * 7 + substep * 3) % 11) as f32 - 5.0;
                *u += glam::Vec4::new(1e-5, -2e-5, 0.7e-5, 0.0) * push;
            }
            step(particles);
        }
    }

    fn in_lanes(instructions: Instructions, chosen: &dyn Fn(&Chains) -> Vec<Bundle>) -> Particles {
        let (topology, mut particles) = chains();
        let chains = Chains::of(&topology).expect("chains");
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
        let mut factors = Vec::new();
        run(
            |particles| {
                instructions.run(Iteration {
                    bundles: &mut bundles,
                    rod: &rod(),
                    pass: &PASS,
                    part: &mut particles.as_part(),
                    factors: &mut factors,
                    lambdas: &mut lambdas,
                });
            },
            &mut particles,
        );
        particles
    }

    #[test]
    fn neither_the_instruction_set_nor_the_other_lanes_change_a_bit() {
        let expected = in_lanes(Instructions::default(), &bundles);
        for instructions in Instructions::all() {
            assert_eq!(
                in_lanes(instructions, &bundles),
                expected,
                "{instructions:?}"
            );
        }
        let alone = |chains: &Chains| -> Vec<Bundle> {
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
        let found = in_lanes(Instructions::default(), &bundles);
        let (topology, mut particles) = chains();
        let chains = Chains::of(&topology).expect("chains");
        let mut system = System::new(chains, particles.len());
        let fitted = system.chains.fit(|i| particles.position(i as usize));
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
                system.iterate(&rod(), &PASS, at, |i| state.position(i as usize));
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
