//! Truncates motion that would let surfaces cross.
//!
//! Every particle moves from its start xⁿ to T(xⁿ + tΔ) with 0 ≤ t ≤ 1, with T the common motion of the
//! bodies involved, and Δ = T⁻¹(x) − xⁿ. Where all perform the common motion alone, nothing crosses.
//! Heights H along n, the direction of the shortest distance of two primitives at the start, are at
//! least that distance on the first, and at most 0 on the second. Two primitives that stay on their sides of a plane between them cannot cross.
//!
//! - A pair that keeps the minimum gap throughout is not changed; as motion is straight, its end
//!   points decide.
//! - In any other pair, each particle that comes too close to the plane is cut. The plane divides
//!   the gap in proportion to the approaches of the two sides.
//! - This is repeated with the t of the last pass until no other pair comes too close: cutting one
//!   particle can move it into the path of another. As t is a minimum over pairs, the result does
//!   not depend on their order.
//! - Pairs are first those that come near each other if all motion is performed in full. Where
//!   motion is cut, they are found again for all t from 0 to 1.
//!
//! Truncated motion loses momentum. A group without pins, colliders and repair gets it back after
//! the substep, as a change of velocity that is the same for all of its particles: with T the
//! motion of its center of mass, its energy does not grow. Angular momentum is lost.

use super::{
    closest::weighted,
    common::{CommonMotion, Group},
    contacts::{Contacts, Owner},
    detect::Batch,
    row::ContactPart,
    tangible::Tangible,
};
use crate::{Threads, topology::union::root};
use glam::DVec3;

/// Minimum distance of the plane from either side, as a fraction of the gap.
const MARGIN: f64 = 0.05;

/// A particle is cut to this fraction of its distance to the plane.
const CUT_FRACTION: f64 = 0.9;

/// A gap, above the minimum gap, may shrink to this fraction without further checks.
const SHRINK: f64 = 0.1;

/// Buffers for truncation, reused.
#[derive(Debug, Default)]
pub(super) struct Truncation {
    pairs: Vec<Pair>,
    /// Fraction of its motion that each particle performs, and that of the last pass.
    t: Vec<f64>,
    before: Vec<f64>,
    /// Roots of the groups of members that near pairs connect.
    roots: Vec<u32>,
    /// Whether the frames of each group, by its root, move along its common motion.
    follows: Vec<bool>,
    /// Each group of members, by its root.
    groups: Vec<Group>,
    /// Members of pairs that touch at distance 0, so that they have no sides.
    touching: Vec<[u32; 2]>,
}

/// Two primitives that come near each other in a substep.
#[derive(Debug)]
struct Pair {
    corners: [u32; 4],
    split: usize,
    members: [u32; 2],
    normal: DVec3,
    gap: f64,
    min_gap: f64,
    heights: [f64; 4],
    is_cut: bool,
}

impl Truncation {
    /// Joins the groups of members that pairs connect. Whether the pairs are not known to be all: a
    /// group has grown, or its frames do not follow its common motion.
    fn group(&mut self) -> bool {
        let Self {
            pairs,
            roots,
            follows,
            ..
        } = self;
        let mut is_new = false;
        for pair in pairs {
            let [a, b] = pair.members.map(|member| root(roots, member));
            roots[a.max(b) as usize] = a.min(b);
            is_new |= a != b || !follows[a as usize];
        }
        for member in 0..roots.len() {
            roots[member] = root(roots, member as u32);
        }
        is_new
    }
}

impl Contacts {
    /// Truncates motion where surfaces would cross, in a tick of this number of substeps.
    pub(super) fn cut(&mut self, bodies: &mut [impl Tangible], substeps: u32, threads: &Threads) {
        self.counts.truncated = 0;
        self.counts.failed = 0;
        let mut buffers = std::mem::take(&mut self.truncation);
        buffers.touching.clear();
        buffers.roots.clear();
        buffers.roots.extend(0..self.members.len() as u32);
        buffers.follows.clear();
        buffers.follows.resize(self.members.len(), false);
        self.find_closing(&mut buffers);
        let mut is_complete = false;
        while !buffers.pairs.is_empty() {
            self.counts.failed = 0;
            is_complete &= !buffers.group();
            self.find_common(&mut buffers, bodies);
            let is_any_cut = self.cut_pairs(&mut buffers);
            if !is_any_cut {
                break;
            }
            if is_complete {
                self.apply(&mut buffers, bodies);
                break;
            }
            // A cut particle can move into the path of others that were not near.
            self.follow(&mut buffers);
            self.enclose_or_detect(1.0, substeps, threads);
            self.find_closing(&mut buffers);
            is_complete = true;
        }
        for &member in buffers.touching.iter().flatten() {
            self.may_cross[member as usize] = true;
        }
        self.truncation = buffers;
    }

    /// Finds how much of its motion each particle performs; whether any does not perform all.
    fn cut_pairs(&mut self, buffers: &mut Truncation) -> bool {
        let mut is_any_cut = false;
        buffers.t.clear();
        buffers.t.resize(self.starts.len(), 1.0);
        loop {
            buffers.before.clone_from(&buffers.t);
            let mut found = false;
            for pair in &mut buffers.pairs {
                let group = buffers.roots[pair.members[0] as usize];
                let common = buffers.groups[group as usize].motion;
                let displacements = pair.corners.map(|v| {
                    let v = v as usize;
                    let relative = common.relative(self.starts[v], self.ends[v]);
                    pair.normal.dot(relative)
                });
                if pair.is_cut || pair.stays_apart(displacements, &buffers.before) {
                    continue;
                }
                pair.is_cut = true;
                found = true;
                let fixed = pair.corners.map(|v| self.inverse_masses[v as usize] == 0.0);
                let is_kept_apart = pair.cut(displacements, fixed, &mut buffers.t);
                if !is_kept_apart {
                    self.counts.failed += 1;
                    for member in pair.members {
                        self.may_cross[member as usize] = true;
                    }
                }
            }
            if !found {
                return is_any_cut;
            }
            is_any_cut = true;
            self.keep_rigid(&mut buffers.t);
        }
    }

    /// Moves the frames of the pieces along the common motion in groups that have pairs.
    fn follow(&mut self, buffers: &mut Truncation) {
        let Truncation {
            pairs,
            roots,
            groups,
            follows,
            ..
        } = buffers;
        for pair in pairs {
            follows[roots[pair.members[0] as usize] as usize] = true;
        }
        for number in 0..self.pieces.len() {
            let root = roots[self.pieces[number].member] as usize;
            if follows[root] && self.pieces[number].is_stepped {
                let common = groups[root].motion;
                let corners = &self.vertices[self.pieces[number].corners(&self.members)];
                let piece = &mut self.pieces[number];
                piece.common = Some(common);
                piece.motion = match common {
                    CommonMotion::Shift(by) => by,
                    CommonMotion::Turn { .. } => {
                        let each = corners.iter().map(|&v| self.starts[v as usize]);
                        let sum: DVec3 = each.map(|start| common.displacement(start)).sum();
                        sum / corners.len() as f64
                    }
                };
            }
        }
    }

    /// A rigid body performs its motion as a whole: as much of it as any of its particles may.
    fn keep_rigid(&self, t: &mut [f64]) {
        for rigid in &self.rigids {
            let all = &mut t[self.members[rigid.member].vertices()];
            let smallest = all.iter().copied().fold(1.0, f64::min);
            all.fill(smallest);
        }
    }

    /// Finds pairs that can come closer than their minimum gap.
    fn find_closing(&self, buffers: &mut Truncation) {
        let Truncation {
            pairs, touching, ..
        } = buffers;
        pairs.clear();
        for batch in &self.batches {
            let closing = self.reaching(batch, batch.min_gap as f32);
            let members = batch
                .pieces
                .map(|piece| self.pieces[piece as usize].member as u32);
            pairs.extend(closing.filter_map(|vertices| {
                if self.is_tangled(members, vertices) {
                    return None;
                }
                let pair = Pair::new(batch, members, vertices, &self.starts);
                if pair.is_none() {
                    touching.push(members);
                }
                pair
            }));
        }
    }

    /// Computes the common motion of each group.
    fn find_common(&self, buffers: &mut Truncation, bodies: &[impl Tangible]) {
        let Truncation { roots, groups, .. } = buffers;
        groups.clear();
        groups.resize(self.members.len(), Group::default());
        for (member, &root) in self.members.iter().zip(&*roots) {
            let group = &mut groups[root as usize];
            match member.owner {
                Owner::Body(body) if member.is_stepped => {
                    let body = &bodies[body];
                    group.is_repaired |= body.is_repaired();
                    for i in 0..body.topology().particles() {
                        group.add(body.now(i) - body.start(i), body.inverse_mass(i));
                    }
                }
                Owner::Body(_) => group.add(DVec3::ZERO, 0.0),
                Owner::Collider(_) => {
                    let moved = |v: usize| (self.ends[v] - self.starts[v]).length();
                    let farthest = member.vertices().map(moved).fold(0.0, f64::max);
                    group.add_collider(member.motion, farthest);
                }
            }
        }
        for group in groups {
            group.find_motion();
        }
    }

    /// Moves particles to their truncated positions.
    fn apply(&mut self, buffers: &mut Truncation, bodies: &mut [impl Tangible]) {
        for (member, &root) in self.members.iter().zip(&buffers.roots) {
            let Owner::Body(body) = member.owner else {
                continue;
            };
            let Group { motion, lost, .. } = &mut buffers.groups[root as usize];
            let common = *motion;
            if bodies[body].effects().is_rigid() {
                let t = buffers.t[member.first];
                if t < 1.0 {
                    self.counts.truncated += member.surface.vertices.len();
                    *lost += cut_rigid(&mut bodies[body], common, t);
                    *lost += self.rigids[member.rigid as usize].cut_lift(t);
                }
                continue;
            }
            let mut touches = false;
            for (&particle, v) in member.surface.vertices.iter().zip(member.vertices()) {
                let t = buffers.t[v];
                if t < 1.0 && self.inverse_masses[v] > 0.0 {
                    let relative = common.relative(self.starts[v], self.ends[v]);
                    let by = common.seen(relative * (t - 1.0));
                    if let Some(it) = self.active.get_mut(self.places[v] as usize) {
                        let lift = &mut it.parts[ContactPart::Lift as usize];
                        *lost += *lift * (t - 1.0) / self.inverse_masses[v];
                        *lift *= t;
                    }
                    let (body, particle) = (&mut bodies[body], particle as usize);
                    if body.is_repaired() {
                        // Displacement by repair is not velocity, and neither is the truncated part
                        // of it.
                        let drawn = body.began(particle) - self.starts[v];
                        body.shift_start(particle, drawn * (t - 1.0));
                    }
                    body.shift(particle, by);
                    *lost -= by / self.inverse_masses[v];
                    self.counts.truncated += 1;
                    touches = true;
                }
            }
            if touches {
                bodies[body].touch();
            }
        }
        for (member, &root) in self.members.iter().zip(&buffers.roots) {
            if let (Owner::Body(body), Some(by)) =
                (member.owner, buffers.groups[root as usize].push())
            {
                self.pushes.push((body, by));
            }
        }
    }

    /// Returns the momentum that truncation has taken, as a change of velocity after the substep.
    pub(crate) fn return_momentum(&mut self, bodies: &mut [impl Tangible]) {
        for (body, by) in self.pushes.drain(..) {
            let body = &mut bodies[body];
            for i in 0..body.topology().particles() {
                body.accelerate(i, by);
            }
        }
    }
}

/// Truncates the motion of all particles of a body; returns the lost momentum [kg·m].
fn cut_rigid(body: &mut impl Tangible, common: CommonMotion, t: f64) -> DVec3 {
    let mut lost = DVec3::ZERO;
    for i in 0..body.topology().particles() {
        let relative = common.relative(body.start(i), body.now(i));
        let by = common.seen(relative * (t - 1.0));
        body.shift(i, by);
        if body.inverse_mass(i) > 0.0 {
            lost -= by / body.inverse_mass(i);
        }
    }
    body.touch();
    lost
}

impl Pair {
    /// `None` for primitives that cross: they have no sides.
    fn new(batch: &Batch, members: [u32; 2], corners: [u32; 4], starts: &[DVec3]) -> Option<Self> {
        let x = corners.map(|v| starts[v as usize]);
        let weights = batch.kind.weights(x);
        let apart = weighted(weights, x);
        let gap = apart.length();
        if gap == 0.0 {
            return None;
        }
        let normal = apart / gap;
        let split = batch.kind.split();
        // Closest point of the second primitive, relative to one of its corners.
        let point = (split..4).fold(DVec3::ZERO, |sum, i| sum - (x[i] - x[3]) * weights[i]);
        Some(Self {
            corners,
            split,
            members,
            normal,
            gap,
            min_gap: batch.min_gap,
            heights: x.map(|at| normal.dot((at - x[3]) - point)),
            is_cut: false,
        })
    }

    /// Whether its sides stay apart at the end of these displacements along the normal [m], scaled
    /// by t.
    fn stays_apart(&self, displacements: [f64; 4], t: &[f64]) -> bool {
        let mut ends = [0.0; 4];
        for (i, end) in ends.iter_mut().enumerate() {
            *end = self.heights[i] + t[self.corners[i] as usize] * displacements[i];
        }
        let (first, second) = ends.split_at(self.split);
        let low = first.iter().copied().fold(f64::INFINITY, f64::min);
        let high = second.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        low - high >= self.gap.min(SHRINK * self.gap + self.min_gap)
    }

    /// Cuts the displacements of its corners at a plane; those that are `fixed` are performed in
    /// full. False if there is no such plane.
    fn cut(&self, displacements: [f64; 4], fixed: [bool; 4], t: &mut [f64]) -> bool {
        let Self {
            gap,
            min_gap,
            heights,
            split,
            ..
        } = *self;
        let half = 0.5 * min_gap;
        // Approach of each corner towards the other side.
        let mut approach = displacements;
        approach[..split].iter_mut().for_each(|it| *it = -*it);
        let largest = |of: &[f64]| of.iter().copied().fold(0.0, f64::max);
        let [first, second] = [largest(&approach[..split]), largest(&approach[split..])];
        if first + second == 0.0 {
            return true;
        }
        let (mut low, mut high) = (MARGIN, 1.0 - MARGIN);
        // What is nearer than the minimum gap must not come nearer to the plane.
        let room = half.min((0.5 - MARGIN) * gap);
        for i in (0..4).filter(|&i| fixed[i] && approach[i] > 0.0) {
            if i < split {
                high = high.min((heights[i] - room - approach[i]) / gap);
            } else {
                low = low.max((heights[i] + room + approach[i]) / gap);
            }
        }
        if low > high {
            return false;
        }
        let plane = (second / (first + second)).clamp(low, high) * gap;
        for i in (0..4).filter(|&i| !fixed[i] && approach[i] > 0.0) {
            let clearance = if i < split {
                heights[i] - plane - half
            } else {
                plane - heights[i] - half
            };
            if approach[i] >= clearance {
                let t = &mut t[self.corners[i] as usize];
                *t = t.min((CUT_FRACTION * clearance / approach[i]).max(0.0));
            }
        }
        true
    }
}
