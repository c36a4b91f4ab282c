//! An iteration that solves the equations of four chains one after another, from root to tip: those of a
//! segment together, and those of a joint. The same as that of a [`System`](super::super::system::System).

use super::{
    Bundle, Frame, Moving, Node, Pass, Rest, Segment, Vector, bending, combination, conjugate,
    cross, difference, dot, frame, inverse, product, read, scaled, sum, turned, write,
};
use crate::kernel::lanes::Lanes;
use fearless_simd::{f64x4, prelude::*};

/// Sweeps from root to tip.
#[inline(always)]
pub fn sweep<L: Lanes>(simd: L, bundle: &Bundle, moving: &mut Moving, pass: &Pass) {
    let Moving { nodes, segments } = moving;
    for node in nodes.iter_mut() {
        node.by = [super::ZERO; 3];
    }
    for (i, rest) in bundle.rest.iter().enumerate() {
        stretch(simd, (&mut segments[i], rest), &mut nodes[i..i + 2], pass);
        if i > 0 {
            bend(simd, &mut segments[i - 1..=i], &bundle.rest[i - 1], pass);
        }
    }
}

/// Solves C_s. Its matrix is that of the two directions along and across the segment.
#[inline(always)]
fn stretch<L: Lanes>(
    simd: L,
    (segment, rest): (&mut Segment, &Rest),
    nodes: &mut [Node],
    pass: &Pass,
) {
    let one = f64x4::splat(simd, 1.0);
    let per_square = 1.0 / (pass.compliant * pass.compliant);
    let gamma = pass.damping / pass.compliant;
    let scale = 1.0 / (1.0 + gamma);
    let now = frame(simd, segment);
    let axis = now.columns[2];
    let [across_inertia, _] = now.inertia;
    let [length, absent] = read(simd, &[rest.length, rest.absent]);
    let present = one - absent;
    let [w0, w1] = read(simd, &[nodes[0].w, nodes[1].w]);
    let (w0, w1) = (w0 * present, w1 * present);
    let (from, to) = (read(simd, &nodes[0].x), read(simd, &nodes[1].x));
    let mut error = difference(&difference(&to, &from), &scaled(&axis, length));
    if gamma > 0.0 {
        let before = read(simd, &segment.before);
        for k in 0..3 {
            error[k] += (error[k] - before[k]) * gamma;
        }
    }
    let error = scaled(&error, present);
    let across = length * (pass.section.stretch.x * per_square);
    let along = length * (pass.section.stretch.z * per_square);
    let lambda = read(simd, &segment.lambda);
    let pulled = [lambda[0], lambda[1], lambda[2]];
    let pull = dot(&axis, &pulled) * (along - across);
    let mut right = error;
    for k in 0..3 {
        right[k] = -(error[k] + across * pulled[k] + pull * axis[k]) * scale;
    }
    let zero = f64x4::splat(simd, 0.0);
    let both = w0 + w1;
    let arm = across_inertia * length * length;
    let of_across = inverse(simd, both + arm + across * scale, zero);
    let of_along = inverse(simd, both + along * scale, zero);
    let part = dot(&axis, &right);
    let other = difference(&right, &scaled(&axis, part));
    let change = sum(&scaled(&other, of_across), &scaled(&axis, part * of_along));
    let change = scaled(&change, f64x4::splat(simd, pass.relaxation));
    for k in 0..3 {
        (lambda[k] + change[k]).store_slice(&mut segment.lambda[k]);
    }
    let by = scaled(&cross(&axis, &change), -(across_inertia * length));
    let q = turned(simd, &now.orientation, &by);
    write(&mut segment.orientation, &q);
    for (node, by) in nodes.iter_mut().zip([-w0, w1]) {
        let way = scaled(&change, by);
        let (x, all) = (read(simd, &node.x), read(simd, &node.by));
        write(&mut node.x, &sum(&x, &way));
        write(&mut node.by, &sum(&all, &way));
    }
}

/// Solves C_b of the joint between two segments, which belongs to the first one.
#[inline(always)]
fn bend<L: Lanes>(simd: L, segments: &mut [Segment], rest: &Rest, pass: &Pass) {
    let one = f64x4::splat(simd, 1.0);
    let per_square = 1.0 / (pass.compliant * pass.compliant);
    let gamma = pass.damping / pass.compliant;
    let scale = 1.0 / (1.0 + gamma);
    let (now, next) = (frame(simd, &segments[0]), frame(simd, &segments[1]));
    let [joint, mean] = read(simd, &[rest.joint, rest.mean]);
    let turn = product(&conjugate(&now.orientation), &next.orientation);
    let mut error = bending(simd, &turn, rest);
    if gamma > 0.0 {
        let before = read(simd, &segments[0].before);
        for k in 0..3 {
            error[k] += (error[k] - before[k + 3]) * gamma;
        }
    }
    let lambda = read(simd, &segments[0].lambda);
    let soft = pass.section.bend.to_array();
    let angular = soft.map(|it| mean * (it * per_square));
    let mut right = error;
    for k in 0..3 {
        right[k] = -(error[k] + angular[k] * lambda[k + 3]) * scale;
    }
    let [px, py, pz, p0] = scaled(&turn, joint * 0.5);
    let turns = [
        combination(&now.columns, [p0, pz, -py]),
        combination(&now.columns, [-pz, p0, px]),
        combination(&now.columns, [py, -px, p0]),
    ];
    let turned_by = |frame: &Frame<L>, moment: &Vector<L>| -> Vector<L> {
        let [a, b] = frame.inertia;
        let along = (b - a) * dot(&frame.columns[2], moment);
        sum(&scaled(moment, a), &scaled(&frame.columns[2], along))
    };
    let mut block = [right; 3];
    for c in 0..3 {
        let by = sum(&turned_by(&now, &turns[c]), &turned_by(&next, &turns[c]));
        for r in c..3 {
            block[r][c] = dot(&turns[r], &by);
        }
        block[c][c] += angular[c] * scale + (one - joint);
    }
    let change = solve(simd, block, right);
    let change = scaled(&change, f64x4::splat(simd, pass.relaxation));
    for k in 0..3 {
        (lambda[k + 3] + change[k]).store_slice(&mut segments[0].lambda[k + 3]);
    }
    let moment = combination(&turns, change);
    let back = scaled(&turned_by(&now, &moment), f64x4::splat(simd, -1.0));
    let mut first = turned(simd, &now.orientation, &back);
    let mut second = turned(simd, &next.orientation, &turned_by(&next, &moment));
    // Behind the end of a chain, not even the rounding of its last segment may change.
    let is_joint = joint.simd_gt(f64x4::splat(simd, 0.0));
    for k in 0..4 {
        first[k] = is_joint.select(first[k], now.orientation[k]);
        second[k] = is_joint.select(second[k], next.orientation[k]);
    }
    write(&mut segments[0].orientation, &first);
    write(&mut segments[1].orientation, &second);
}

/// Solves three equations by LDLᵀ of the lower triangle of a matrix. Singular pivots are left out.
#[inline(always)]
fn solve<L: Lanes>(simd: L, mut block: [Vector<L>; 3], mut right: Vector<L>) -> Vector<L> {
    let original = [block[0][0], block[1][1], block[2][2]];
    let mut pivots = right;
    for j in 0..3 {
        pivots[j] = inverse(simd, block[j][j], original[j] * super::SINGULAR);
        for r in j + 1..3 {
            let entry = block[r][j] * pivots[j];
            for c in j + 1..=r {
                let by = entry * block[c][j];
                block[r][c] -= by;
            }
            let by = entry * right[j];
            right[r] -= by;
        }
        for r in j + 1..3 {
            block[r][j] *= pivots[j];
        }
    }
    for j in (0..3).rev() {
        let mut x = right[j] * pivots[j];
        for r in j + 1..3 {
            x -= block[r][j] * right[r];
        }
        right[j] = x;
    }
    right
}
