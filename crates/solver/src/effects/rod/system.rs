//! One direct solve of all equations of a chain.

use super::{
    chains::{Chains, RestSegment},
    elimination::{Block, Elimination, Six},
};
use glam::{DMat3, DQuat, DVec3};
use std::ops::Range;

/// Orientation and rotation of a segment of a [rod](crate::Rod).
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SegmentState {
    /// It turns the z axis to the direction of the segment.
    pub orientation: DQuat,
    /// Angular velocity [rad/s].
    pub angular_velocity: DVec3,
}

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
}

impl Pass {
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

/// The errors of a segment: C_s [m], and C_b of the joint behind it, half an angle [rad].
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
    pub(super) chains: Chains,
    /// The segments, as in [`Particles`](crate::Particles).
    pub segments: Vec<SegmentState>,
    predictions: Vec<Prediction>,
    /// Errors at the start of the substep.
    before: Vec<Errors>,
    /// λ of both equations; λ/h² is a force in N and twice a moment in N·m.
    pub(super) lambdas: Vec<Errors>,
    changes: Vec<Errors>,
    elimination: Elimination,
    /// Displacements of the particles by the last iteration [m].
    pub(super) moves: Vec<DVec3>,
}

impl System {
    pub fn new(chains: Chains, particles: usize) -> Self {
        let count = chains.segments.len();
        Self {
            chains,
            lambdas: vec![[DVec3::ZERO; 2]; count],
            changes: vec![[DVec3::ZERO; 2]; count],
            moves: vec![DVec3::ZERO; particles],
            ..Self::default()
        }
    }

    /// C_s and C_b of each segment, with their compliances [m/N, 1/(N·m)] in its frame.
    pub fn errors<'a>(
        &'a self,
        section: Section,
        at: impl Fn(u32) -> DVec3 + 'a,
    ) -> impl Iterator<Item = (Errors, Errors)> + 'a {
        (0..self.chains.segments.len()).map(move |i| {
            let rest = &self.chains.segments[i];
            let errors = errors(&self.chains.segments, &self.segments, i, &at);
            // C_s is in the world; its compliance is diagonal in the frame of the segment.
            let local = self.segments[i].orientation.conjugate() * errors[0];
            let bend = rest.joint.map_or(0.0, |(_, length)| length) * section.bend;
            ([local, errors[1]], [rest.length * section.stretch, bend])
        })
    }

    /// One iteration; leaves the displacements of the particles in `moves`. `start` is the position
    /// of a particle at the start of the substep.
    pub fn iterate(&mut self, pass: &Pass, at: impl Fn(u32) -> Node, start: impl Fn(u32) -> DVec3) {
        if pass.first {
            self.predict(pass, &at, &start);
        }
        if pass.first {
            self.lambdas.fill([DVec3::ZERO; 2]);
        }
        self.moves.fill(DVec3::ZERO);
        for range in self.chains.ranges.clone() {
            self.solve(range.clone(), pass, &at);
            self.apply(range, pass, &at);
        }
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
            chains,
            segments,
            predictions,
            before,
            ..
        } = self;
        before.clear();
        if pass.damping > 0.0 {
            let all = 0..chains.segments.len();
            before.extend(all.map(|i| errors(&chains.segments, segments, i, start)));
        }
        predictions.clear();
        let radius = pass.section.radius;
        let step = pass.step();
        for (i, segment) in segments.iter_mut().enumerate() {
            let inverse = inverse_inertia(&chains.segments, i, radius, at).map(|it| it * step);
            if inverse == [0.0; 2] {
                segment.angular_velocity = DVec3::ZERO;
            }
            segment.orientation = turned(segment.orientation, segment.angular_velocity * pass.h);
            predictions.push(Prediction {
                orientation: segment.orientation,
                inverse_inertia: inverse,
            });
        }
    }

    /// Solves the equations of a chain for the change of its multipliers.
    fn solve(&mut self, range: Range<usize>, pass: &Pass, at: &impl Fn(u32) -> Node) {
        let section = pass.section;
        let per_square = 1.0 / (pass.compliant * pass.compliant);
        let gamma = pass.damping / pass.compliant;
        let (rest, state) = (&self.chains.segments, &self.segments);
        let first = range.start;
        self.elimination.clear();
        let mut before: Option<Frame> = None;
        let mut frame = Frame::of(rest, state, &self.predictions, first);
        for i in range.clone() {
            let next =
                (i + 1 < range.end).then(|| Frame::of(rest, state, &self.predictions, i + 1));
            let place = |node: u32| at(node).x;
            let [mut c_s, mut c_b] = errors(rest, state, i, &place);
            let [lambda_s, lambda_b] = self.lambdas[i];
            let [w0, w1] = rest[i].nodes.map(|node| at(node).w);
            let axes = frame.axes;
            let alpha_s = rest[i].length * section.stretch * per_square;
            let alpha_s = axes * DMat3::from_diagonal(alpha_s) * axes.transpose();
            let length = rest[i].joint.map_or(0.0, |(_, length)| length);
            let alpha_b = length * section.bend * per_square;
            let scale = 1.0 / (1.0 + gamma);
            if let Some([s, b]) = self.before.get(i).filter(|_| gamma > 0.0) {
                (c_s, c_b) = (c_s + gamma * (c_s - s), c_b + gamma * (c_b - b));
            }
            let right_s = -(c_s + alpha_s * lambda_s) * scale;
            let right_b = -(c_b + alpha_b * lambda_b) * scale;
            // L U and L U Lᵀ, with Lᵀ = −L.
            let arm_inertia = frame.arm * frame.inertia;
            let ss = DMat3::from_diagonal(DVec3::splat(w0 + w1)) - arm_inertia * frame.arm
                + alpha_s * scale;
            let (sb, bb) = next.as_ref().map_or_else(
                || (DMat3::ZERO, DMat3::IDENTITY),
                |next| {
                    let both = frame.inertia + next.inertia;
                    let compliance = DMat3::from_diagonal(alpha_b * scale);
                    (
                        -arm_inertia * frame.bend.transpose(),
                        frame.bend * both * frame.bend.transpose() + compliance,
                    )
                },
            );
            let coupling = before.as_ref().map(|last| {
                let ss = DMat3::from_diagonal(DVec3::splat(-w0));
                let sb = arm_inertia * last.bend.transpose();
                let bb = -(frame.bend * frame.inertia) * last.bend.transpose();
                block(ss, sb, DMat3::ZERO, bb)
            });
            let diagonal = block(ss, sb, sb.transpose(), bb);
            self.elimination
                .push(diagonal, coupling.as_ref(), six(right_s, right_b));
            if let Some(next) = next {
                before = Some(frame);
                frame = next;
            }
        }
        let changes = &mut self.changes;
        self.elimination.solve(|i, [a, b, c, d, e, f]| {
            changes[first + i] = [DVec3::new(a, b, c), DVec3::new(d, e, f)];
        });
    }

    /// Moves the particles and turns the segments of a chain by the change of its multipliers.
    fn apply(&mut self, range: Range<usize>, pass: &Pass, at: &impl Fn(u32) -> Node) {
        let mut moment_before = DVec3::ZERO;
        for i in range.clone() {
            let [s, b] = self.changes[i].map(|change| change * pass.relaxation);
            self.lambdas[i][0] += s;
            self.lambdas[i][1] += b;
            let [first, second] = self.chains.segments[i].nodes;
            self.moves[first as usize] -= at(first).w * s;
            self.moves[second as usize] += at(second).w * s;
            // With the orientations before this iteration: those behind i have not been turned yet.
            let frame = Frame::of(&self.chains.segments, &self.segments, &self.predictions, i);
            let moment = frame.bend.transpose() * b;
            let turn = frame.inertia * (-(frame.arm * s) - moment + moment_before);
            moment_before = moment;
            let segment = &mut self.segments[i];
            segment.orientation = turned(segment.orientation, turn);
        }
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        self.chains.bytes()
            + size_of_val(&self.segments[..])
            + size_of_val(&self.predictions[..])
            + size_of_val(&self.before[..])
            + size_of_val(&self.lambdas[..])
            + size_of_val(&self.changes[..])
            + size_of_val(&self.moves[..])
            + self.elimination.bytes()
    }
}

/// What the equations of a segment, and of the joint behind it, depend on.
#[derive(Debug, Clone, Copy)]
struct Frame {
    /// R.
    axes: DMat3,
    /// U, the inverse inertia in the world [1/(kg·m²)].
    inertia: DMat3,
    /// L = l [d₃]× [m], the derivative of C_s.
    arm: DMat3,
    /// G, the derivative of C_b by the rotation of the segment behind; its negative is that by the
    /// rotation of this one. 0 for the last segment.
    bend: DMat3,
}

impl Frame {
    fn of(
        rest: &[RestSegment],
        state: &[SegmentState],
        predictions: &[Prediction],
        i: usize,
    ) -> Self {
        let axes = DMat3::from_quat(state[i].orientation);
        let [across, along] = predictions[i].inverse_inertia;
        let diagonal = DMat3::from_diagonal(DVec3::new(across, across, along));
        let bend = rest[i].joint.map_or(DMat3::ZERO, |_| {
            let turn = state[i].orientation.conjugate() * state[i + 1].orientation;
            let inner = DMat3::from_diagonal(DVec3::splat(turn.w)) - cross(turn.xyz());
            0.5 * inner * axes.transpose()
        });
        Self {
            axes,
            inertia: axes * diagonal * axes.transpose(),
            arm: cross(axes.z_axis * rest[i].length),
            bend,
        }
    }
}

/// C_s [m] in the world, and C_b in the frame of the segment.
fn errors(
    rest: &[RestSegment],
    state: &[SegmentState],
    i: usize,
    at: &impl Fn(u32) -> DVec3,
) -> Errors {
    let RestSegment {
        nodes: [a, b],
        length,
        joint,
        ..
    } = rest[i];
    let axis = state[i].orientation * DVec3::Z;
    let stretch = (at(b) - at(a)) - length * axis;
    let bend = joint.map_or(DVec3::ZERO, |(wanted, _)| {
        let turn = state[i].orientation.conjugate() * state[i + 1].orientation;
        let sign = if turn.dot(wanted) >= 0.0 { 1.0 } else { -1.0 };
        turn.xyz() - sign * wanted.xyz()
    });
    [stretch, bend]
}

/// Inverse inertia of a segment [1/(kg·m²)], across and along it: that of a cylinder. Its mass is
/// its length times the mass per length at its lighter end. Between two pins it is clamped.
fn inverse_inertia(
    rest: &[RestSegment],
    i: usize,
    radius: f64,
    at: &impl Fn(u32) -> Node,
) -> [f64; 2] {
    let [a, b] = rest[i].nodes;
    let length = rest[i].length;
    let neighbor = |j: Option<usize>, node: u32| {
        j.and_then(|j| rest.get(j))
            .filter(|it| it.nodes.contains(&node))
            .map_or(0.0, |it| it.length)
    };
    let per_length = |node: u32, other: f64| {
        let w = at(node).w;
        (w > 0.0).then(|| 2.0 / (w * (length + other)))
    };
    let ends = [
        per_length(a, neighbor(i.checked_sub(1), a)),
        per_length(b, neighbor(Some(i + 1), b)),
    ];
    let Some(lighter) = ends.into_iter().flatten().reduce(f64::min) else {
        return [0.0; 2];
    };
    let mass = lighter * length;
    let across = mass * (length * length / 12.0 + radius * radius / 4.0);
    let along = mass * radius * radius / 2.0;
    [across, along].map(|inertia| if inertia > 0.0 { 1.0 / inertia } else { 0.0 })
}

/// Turns an orientation by a small rotation vector [rad].
fn turned(orientation: DQuat, by: DVec3) -> DQuat {
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

fn block(a: DMat3, b: DMat3, c: DMat3, d: DMat3) -> Block {
    std::array::from_fn(|row| {
        std::array::from_fn(|column| {
            let part = match (row < 3, column < 3) {
                (true, true) => &a,
                (true, false) => &b,
                (false, true) => &c,
                (false, false) => &d,
            };
            part.col(column % 3)[row % 3]
        })
    })
}

fn six(a: DVec3, b: DVec3) -> Six {
    [a.x, a.y, a.z, b.x, b.y, b.z]
}
