//! One direct solve of all equations of chains or networks.
//!
//! A row of the system has the equations of a segment and those of its joint with the segment
//! before; a joint that closes a ring has a row of its own.

use super::{
    clamp::carried,
    elimination::Elimination,
    shape::{Rest, RestJoint},
};
use crate::SegmentState;
use glam::{DMat3, DQuat, DVec3};
use std::collections::BTreeSet;

/// A particle in a substep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Current position [m].
    pub x: DVec3,
    /// Inverse mass [1/kg].
    pub w: f64,
}

/// Parameters of an iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pass {
    /// Length of the substep [s] for implicit Euler.
    pub h: f64,
    /// Length of the substep [s] for compliance and damping.
    pub compliant: f64,
    /// Whether it is the first one of a substep.
    pub first: bool,
    /// Whether it is the last one.
    pub last: bool,
    /// Fraction of the correction that is applied, from 0 to 1.
    pub relaxation: f64,
    /// The section of the rod.
    pub section: Section,
    /// Damping τ [s].
    pub damping: f64,
    /// Rotation of the clamped first and last segment of each chain about their axes in a substep,
    /// as the tangent of half the angle.
    pub turns: [f64; 2],
}

impl Pass {
    /// That rotation of a segment which may be the first or the last one.
    pub fn turn(&self, is_first: bool, is_last: bool) -> f64 {
        match (is_first, is_last) {
            (true, _) => self.turns[0],
            (false, true) => self.turns[1],
            (false, false) => 0.0,
        }
    }

    /// Factor on the inverse inertia: constraints move a particle by w∇C λ with λ = h²f in their own
    /// time step; a segment, which is always stepped by implicit Euler, must move by U∇C h²f with h
    /// of that step.
    pub fn step(&self) -> f64 {
        let step = self.h / self.compliant;
        let step = step * step;
        if step.is_finite() && step > 0.0 {
            step
        } else {
            1.0
        }
    }
}

/// The errors of a row: C_s of a segment [m], and C_b of the joint before it, half an angle [rad].
pub type Errors = [DVec3; 2];

/// Section of a rod.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// 1/(κGA), 1/(κGA), 1/(EA) [1/N].
    pub stretch: DVec3,
    /// 1/(4EI), 1/(4EI), 1/(4GJ) [1/(N·m²)].
    pub bend: DVec3,
    /// Radius [m].
    pub radius: f64,
}

/// Shear correction of a circular section.
const SHEAR: f64 = 0.9;

impl Section {
    /// A circle with a radius [m] of a material with E [Pa] and ν.
    pub fn circle(radius: f64, modulus: f64, ratio: f64) -> Self {
        let shear = modulus / (2.0 * (1.0 + ratio));
        let area = std::f64::consts::PI * radius * radius;
        let (second, polar) = (area * radius * radius / 4.0, area * radius * radius / 2.0);
        let across = 1.0 / (SHEAR * shear * area);
        let bend = 1.0 / (4.0 * modulus * second);
        Self {
            stretch: DVec3::new(across, across, 1.0 / (modulus * area)),
            bend: DVec3::new(bend, bend, 1.0 / (4.0 * shear * polar)),
            radius,
        }
    }
}

/// What a substep begins with.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Prediction {
    /// Orientation of the segment by inertia alone.
    orientation: DQuat,
    /// Inverse inertia across and along the segment [1/(kg·m²)].
    inverse_inertia: [f64; 2],
}

/// State of a rod in a substep.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct System {
    pub(super) rest: Rest,
    /// The segments, as in [`Particles`](crate::Particles).
    pub segments: Vec<SegmentState>,
    predictions: Vec<Prediction>,
    /// Errors at the start of the substep.
    before: Vec<Errors>,
    /// λ of both equations; λ/h² is a force in N and twice a moment in N·m.
    pub(super) lambdas: Vec<Errors>,
    changes: Vec<Errors>,
    /// Made in the first iteration.
    plan: Option<Plan>,
    /// Displacements of the particles by the last iteration [m].
    pub(super) moves: Vec<DVec3>,
}

impl System {
    pub(super) fn new(rest: Rest, particles: usize) -> Self {
        let count = rest.rows();
        Self {
            rest,
            lambdas: vec![[DVec3::ZERO; 2]; count],
            changes: vec![[DVec3::ZERO; 2]; count],
            moves: vec![DVec3::ZERO; particles],
            ..Self::default()
        }
    }

    /// Whether there is a state of each segment.
    pub fn has_segments(&self) -> bool {
        self.segments.len() == self.rest.segments.len()
    }

    /// C_s and C_b of each row, with their compliances [m/N, 1/(N·m)] in the frames of its segment and of the
    /// one before.
    pub fn errors<'a>(
        &'a self,
        section: Section,
        at: impl Fn(u32) -> DVec3 + 'a,
    ) -> impl Iterator<Item = (Errors, Errors)> + 'a {
        (0..self.rest.rows()).map(move |row| {
            let [stretch, bend] = errors(&self.rest, &self.segments, row, &at);
            // C_s is in the world; its compliance is diagonal in the frame of the segment.
            let segment = self.rest.segments.get(row);
            let (local, along) = segment.map_or_else(Default::default, |segment| {
                let orientation = self.segments[row].orientation;
                let along = segment.length * section.stretch;
                (orientation.conjugate() * stretch, along)
            });
            let joint = self.rest.joint_of(row);
            let length = joint.map_or(0.0, |(_, joint)| joint.length);
            ([local, bend], [along, length * section.bend])
        })
    }

    /// One iteration; leaves the displacements of the particles in `moves`. `start` is the position
    /// of a particle at the start of the substep.
    pub fn iterate(&mut self, pass: &Pass, at: impl Fn(u32) -> Node, start: impl Fn(u32) -> DVec3) {
        if pass.first {
            self.predict(pass, &at, &start);
            self.lambdas.fill([DVec3::ZERO; 2]);
        }
        self.moves.fill(DVec3::ZERO);
        self.solve(pass, &at);
        if pass.last {
            for (segment, predicted) in self.segments.iter_mut().zip(&self.predictions) {
                let turn = segment.orientation * predicted.orientation.conjugate();
                let sign = if turn.w < 0.0 { -2.0 } else { 2.0 };
                segment.angular_velocity += sign / pass.h * turn.xyz();
            }
        }
    }

    /// Rotates the segments by inertia; the gyroscopic moment is left out.
    fn predict(&mut self, pass: &Pass, at: &impl Fn(u32) -> Node, start: &impl Fn(u32) -> DVec3) {
        let Self {
            rest,
            segments,
            predictions,
            before,
            ..
        } = self;
        before.clear();
        if pass.damping > 0.0 {
            before.extend((0..rest.rows()).map(|row| errors(rest, segments, row, start)));
        }
        predictions.clear();
        let radius = pass.section.radius;
        let step = pass.step();
        for (i, segment) in segments.iter_mut().enumerate() {
            let inverse = inverse_inertia(rest, i, radius, at).map(|it| it * step);
            let [from, to] = rest.segments[i].nodes.map(at);
            if from.w == 0.0 && to.w == 0.0 {
                let turn = pass.turn(rest.is_first(i), rest.is_last(i));
                let turn = carried(segment.orientation, to.x - from.x, turn);
                segment.angular_velocity = turn / pass.h;
            } else if inverse == [0.0; 2] {
                segment.angular_velocity = DVec3::ZERO;
            }
            segment.orientation = turned(segment.orientation, segment.angular_velocity * pass.h);
            predictions.push(Prediction {
                orientation: segment.orientation,
                inverse_inertia: inverse,
            });
        }
    }

    /// Solves the equations for the changes of the multipliers, moves the particles and turns the
    /// segments by them.
    fn solve(&mut self, pass: &Pass, at: &impl Fn(u32) -> Node) {
        let mut plan = self.plan.take().unwrap_or_else(|| Plan::of(&self.rest));
        let frames: Vec<Frame> = (0..self.segments.len()).map(|i| self.frame(i)).collect();
        let joints: Vec<DMat3> = (0..self.rest.rows()).map(|row| self.bending(row)).collect();
        let system = &mut plan.elimination;
        system.clear();
        for (node, ends) in &plan.nodes {
            let w = at(*node).w;
            for (place, &(one, sign)) in ends.iter().enumerate() {
                for &(other, other_sign) in &ends[..=place] {
                    let block = DMat3::from_diagonal(DVec3::splat(sign * other_sign * w));
                    add(system, (one, 0), (other, 0), block);
                }
            }
        }
        for (frame, turns) in frames.iter().zip(&plan.turns) {
            let jacobian = |&(row, by): &(usize, By)| match by {
                By::Stretch => ((row, 0), frame.arm),
                By::Before => ((row, 1), -joints[row]),
                By::Behind => ((row, 1), joints[row]),
            };
            for (place, one) in turns.iter().enumerate() {
                let (one, first) = jacobian(one);
                let first = first * frame.inertia;
                for other in &turns[..=place] {
                    let (other, second) = jacobian(other);
                    add(system, one, other, first * second.transpose());
                }
            }
        }
        for row in 0..self.rest.rows() {
            let (right, compliances) = self.right(row, frames.get(row), pass, at);
            for (half, compliance) in compliances.into_iter().enumerate() {
                add(system, (row, half), (row, half), compliance);
            }
            let [s, b] = right;
            *system.right(row) = [s.x, s.y, s.z, b.x, b.y, b.z];
        }
        let changes = &mut self.changes;
        system.solve(|row, [a, b, c, d, e, f]| {
            changes[row] = [DVec3::new(a, b, c), DVec3::new(d, e, f)];
        });
        self.apply(pass, &frames, &joints, at);
        self.plan = Some(plan);
    }

    /// Right-hand sides of a row, and what its compliances add to the matrix; the identity where there is
    /// no equation.
    pub(super) fn right(
        &self,
        row: usize,
        frame: Option<&Frame>,
        pass: &Pass,
        at: &impl Fn(u32) -> Node,
    ) -> (Errors, [DMat3; 2]) {
        let section = pass.section;
        let per_square = 1.0 / (pass.compliant * pass.compliant);
        let gamma = pass.damping / pass.compliant;
        let scale = 1.0 / (1.0 + gamma);
        let [mut c_s, mut c_b] = errors(&self.rest, &self.segments, row, &|node| at(node).x);
        if let Some([s, b]) = self.before.get(row).filter(|_| gamma > 0.0) {
            (c_s, c_b) = (c_s + gamma * (c_s - s), c_b + gamma * (c_b - b));
        }
        let [lambda_s, lambda_b] = self.lambdas[row];
        let (mut right_s, mut of_s) = (DVec3::ZERO, DMat3::IDENTITY);
        if let Some(Frame { axes, .. }) = frame {
            let alpha = self.rest.segments[row].length * section.stretch * per_square;
            let alpha = *axes * DMat3::from_diagonal(alpha) * axes.transpose();
            right_s = -(c_s + alpha * lambda_s) * scale;
            of_s = alpha * scale;
        }
        let (mut right_b, mut of_b) = (DVec3::ZERO, DMat3::IDENTITY);
        if let Some((_, joint)) = self.rest.joint_of(row) {
            let alpha = joint.length * section.bend * per_square;
            right_b = -(c_b + alpha * lambda_b) * scale;
            of_b = DMat3::from_diagonal(alpha * scale);
        }
        ([right_s, right_b], [of_s, of_b])
    }

    /// Moves the particles and turns the segments by the changes of the multipliers.
    fn apply(
        &mut self,
        pass: &Pass,
        frames: &[Frame],
        joints: &[DMat3],
        at: &impl Fn(u32) -> Node,
    ) {
        let mut moments = vec![DVec3::ZERO; self.segments.len()];
        for (row, changes) in self.changes.iter().enumerate() {
            let [s, b] = changes.map(|change| change * pass.relaxation);
            self.lambdas[row][0] += s;
            self.lambdas[row][1] += b;
            if let Some(segment) = self.rest.segments.get(row) {
                let [first, second] = segment.nodes;
                self.moves[first as usize] -= at(first).w * s;
                self.moves[second as usize] += at(second).w * s;
                // Lᵀ = −L.
                moments[row] -= frames[row].arm * s;
            }
            if let Some((behind, joint)) = self.rest.joint_of(row) {
                let moment = joints[row].transpose() * b;
                moments[joint.before] -= moment;
                moments[behind] += moment;
            }
        }
        for ((segment, frame), moment) in self.segments.iter_mut().zip(frames).zip(moments) {
            segment.orientation = turned(segment.orientation, frame.inertia * moment);
        }
    }

    pub(super) fn frame(&self, i: usize) -> Frame {
        let axes = DMat3::from_quat(self.segments[i].orientation);
        let [across, along] = self.predictions[i].inverse_inertia;
        let diagonal = DMat3::from_diagonal(DVec3::new(across, across, along));
        Frame {
            axes,
            inertia: axes * diagonal * axes.transpose(),
            arm: cross(axes.z_axis * self.rest.segments[i].length),
        }
    }

    /// G, the derivative of C_b of a row by the rotation of the segment behind the joint; its
    /// negative is that by the rotation of the one before. 0 without a joint.
    pub(super) fn bending(&self, row: usize) -> DMat3 {
        let joint = self.rest.joint_of(row);
        joint.map_or(DMat3::ZERO, |(behind, joint)| {
            let turn = rotation(joint, &self.segments, behind);
            let inner = DMat3::from_diagonal(DVec3::splat(turn.w)) - cross(turn.xyz());
            let axes = DMat3::from_quat(self.segments[joint.before].orientation);
            0.5 * inner * axes.transpose()
        })
    }

    /// Work in a substep of `h` seconds of clamped segments that turn, against the moments λ/h² of the
    /// joints beside them [J]. `w` is the inverse mass of a particle.
    pub fn work_of_clamps(&self, h: f64, w: impl Fn(u32) -> f64) -> f64 {
        let way = |i: usize| {
            let mut nodes = self.rest.segments[i].nodes.into_iter();
            let is_clamped = nodes.all(|node| w(node) == 0.0);
            match is_clamped {
                // The vector by which it was turned has the length 2 tan(θ/2).
                true => {
                    let by = self.segments[i].angular_velocity * h;
                    by.normalize_or_zero() * 2.0 * libm::atan(0.5 * by.length())
                }
                false => DVec3::ZERO,
            }
        };
        let works = (0..self.rest.rows()).filter_map(|row| {
            let (behind, joint) = self.rest.joint_of(row)?;
            let way = way(behind) - way(joint.before);
            (way != DVec3::ZERO).then(|| {
                let [_, lambda] = self.lambdas[row];
                -(self.bending(row).transpose() * lambda).dot(way)
            })
        });
        works.sum::<f64>() / (h * h)
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        self.rest.bytes()
            + size_of_val(&self.segments[..])
            + size_of_val(&self.predictions[..])
            + size_of_val(&self.before[..])
            + size_of_val(&self.lambdas[..])
            + size_of_val(&self.changes[..])
            + size_of_val(&self.moves[..])
            + self.plan.as_ref().map_or(0, Plan::bytes)
    }
}

/// How the rotation of a segment changes an equation.
#[derive(Debug, Clone, Copy, PartialEq)]
enum By {
    /// C_s of the segment itself.
    Stretch,
    /// C_b of a joint that the segment is before.
    Before,
    /// C_b of a joint that it is behind.
    Behind,
}

/// What is coupled with what.
#[derive(Debug, Clone, PartialEq)]
struct Plan {
    /// For each node, the segments that end there, with the sign of the node in their C_s.
    nodes: Vec<(u32, Vec<(usize, f64)>)>,
    /// For each segment, the rows that its rotation changes.
    turns: Vec<Vec<(usize, By)>>,
    elimination: Elimination,
}

impl Plan {
    fn of(rest: &Rest) -> Self {
        let mut ends: Vec<(u32, usize, f64)> = Vec::new();
        for (i, segment) in rest.segments.iter().enumerate() {
            let [first, second] = segment.nodes;
            ends.extend([(first, i, -1.0), (second, i, 1.0)]);
        }
        ends.sort_by_key(|&(node, segment, _)| (node, segment));
        let nodes: Vec<(u32, Vec<(usize, f64)>)> = ends
            .chunk_by(|a, b| a.0 == b.0)
            .map(|at| (at[0].0, at.iter().map(|&(_, i, sign)| (i, sign)).collect()))
            .collect();
        let each = (0..rest.segments.len()).map(|i| vec![(i, By::Stretch)]);
        let mut turns: Vec<_> = each.collect();
        for row in 0..rest.rows() {
            if let Some((behind, joint)) = rest.joint_of(row) {
                turns[joint.before].push((row, By::Before));
                turns[behind].push((row, By::Behind));
            }
        }
        let mut coupled = vec![BTreeSet::new(); rest.rows()];
        let mut couple = |rows: Vec<usize>| {
            for &row in &rows {
                coupled[row].extend(&rows);
            }
        };
        for (_, ends) in &nodes {
            couple(ends.iter().map(|&(i, _)| i).collect());
        }
        for turns in &turns {
            couple(turns.iter().map(|&(row, _)| row).collect());
        }
        Self {
            nodes,
            turns,
            elimination: Elimination::new(coupled),
        }
    }

    fn bytes(&self) -> usize {
        let nodes = self.nodes.iter().map(|(_, ends)| size_of_val(&ends[..]));
        let turns = self.turns.iter().map(|rows| size_of_val(&rows[..]));
        size_of_val(&self.nodes[..])
            + size_of_val(&self.turns[..])
            + nodes.chain(turns).sum::<usize>()
            + self.elimination.bytes()
    }
}

/// What the equations of a segment depend on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    /// R.
    axes: DMat3,
    /// U, the inverse inertia in the world [1/(kg·m²)].
    pub inertia: DMat3,
    /// L = l [d₃]× [m], the derivative of C_s.
    pub arm: DMat3,
}

/// Rotation of a joint from the segment before to the frame of the one behind.
fn rotation(joint: &RestJoint, state: &[SegmentState], behind: usize) -> DQuat {
    state[joint.before].orientation.conjugate() * state[behind].orientation * joint.offset
}

/// C_s [m] in the world, and C_b in the frame of the segment before the joint.
fn errors(rest: &Rest, state: &[SegmentState], row: usize, at: &impl Fn(u32) -> DVec3) -> Errors {
    let stretch = rest.segments.get(row).map_or(DVec3::ZERO, |segment| {
        let [a, b] = segment.nodes;
        let axis = state[row].orientation * DVec3::Z;
        (at(b) - at(a)) - segment.length * axis
    });
    let bend = rest.joint_of(row).map_or(DVec3::ZERO, |(behind, joint)| {
        let turn = rotation(joint, state, behind);
        let sign = if turn.dot(joint.turn) >= 0.0 {
            1.0
        } else {
            -1.0
        };
        turn.xyz() - sign * joint.turn.xyz()
    });
    [stretch, bend]
}

/// Inverse inertia of a segment [1/(kg·m²)], across and along it: that of a cylinder. Its mass is
/// its length times the mass per length at its lighter end. Between two pins it is clamped.
fn inverse_inertia(rest: &Rest, i: usize, radius: f64, at: &impl Fn(u32) -> Node) -> [f64; 2] {
    let segment = &rest.segments[i];
    let length = segment.length;
    let per_length = [0, 1].map(|end| {
        let w = at(segment.nodes[end]).w;
        (w > 0.0).then(|| 2.0 / (w * segment.around[end]))
    });
    let Some(lighter) = per_length.into_iter().flatten().reduce(f64::min) else {
        return [0.0; 2];
    };
    let mass = lighter * length;
    let across = mass * (length * length / 12.0 + radius * radius / 4.0);
    let along = mass * radius * radius / 2.0;
    [across, along].map(|inertia| if inertia > 0.0 { 1.0 / inertia } else { 0.0 })
}

/// Adds a block and its transpose to the system.
fn add(system: &mut Elimination, one: (usize, usize), other: (usize, usize), block: DMat3) {
    system.add(one, other, &block.transpose().to_cols_array_2d());
}

/// Turns an orientation by a small rotation vector [rad], exactly by twice the arctangent of half its
/// length.
pub fn turned(orientation: DQuat, by: DVec3) -> DQuat {
    let change = DQuat::from_xyzw(by.x, by.y, by.z, 0.0) * orientation;
    (orientation + change * 0.5).normalize()
}

/// The matrix of v×.
fn cross(v: DVec3) -> DMat3 {
    DMat3::from_cols(
        DVec3::new(0.0, v.z, -v.y),
        DVec3::new(-v.z, 0.0, v.x),
        DVec3::new(v.y, -v.x, 0.0),
    )
}
