//! Candidates that are near enough to act in a substep.
//!
//! A candidate is near if its primitives can come closer than a distance along their motion: if
//! their distance half way is above it by no more than the motion from there. Contacts use the
//! longest motion in a piece, with a margin, as constraints change it; truncation uses that of the
//! primitives. Bounds decide most candidates, without a change of the result:
//!
//! - the distance at detection, less what has been moved since;
//! - the boxes of the primitives half way;
//! - the gap at the start of the substep, which contacts need anyway, less the motion to half way.
//!
//! Gaps are kept for truncation at the end of the substep, where the gap of hardly any candidate can
//! shrink enough.

use super::{
    bounds::{Ball, boxes_meet},
    closest::weighted,
    contacts::{Contacts, HORIZON},
    detect::{Batch, Candidate, Near, NearPart, OF_REST},
};
use crate::{Threads, WorkEstimate};

/// Motion of the primitives of a batch.
struct Motion<'a> {
    contacts: &'a Contacts,
    batch: &'a Batch,
    /// Half of the horizon, in substeps.
    half: f64,
    offset: Ball,
    /// Bound on the distance moved since detection [m].
    travel: f32,
    /// Bound on the change of a gap from half way to either end of the motion, with a margin for
    /// motion that constraints add [m].
    reach: f32,
    slack: f32,
}

/// Constraint projections that take about as long as the check of a candidate.
const PROJECTIONS: usize = 4;

impl Motion<'_> {
    fn corners(&self, candidate: &Candidate) -> [u32; 4] {
        candidate
            .corners
            .map(|corner| self.contacts.vertices[corner as usize])
    }

    /// False if the primitives of a candidate certainly do not come closer than a distance [m].
    fn may_reach(&self, candidate: &Candidate, distance: f32) -> bool {
        // The distance moved rejects most candidates, and boxes reject more.
        candidate.clearance + candidate.distance - distance <= self.travel
            && boxes_meet(
                self.batch.kind,
                candidate
                    .corners
                    .map(|corner| self.contacts.centers[corner as usize]),
                self.offset.center,
                distance + self.reach + 2.0 * self.slack,
            )
    }

    /// Bound on the change of the gap of a candidate from the start or the end of its motion to half
    /// way, whatever fraction of its motion each corner performs [m].
    fn change(&self, candidate: &Candidate) -> f32 {
        let of = |corner: u32| self.contacts.half_motions[corner as usize];
        let (first, second) = candidate.corners.split_at(self.batch.kind.split());
        let longest = |corners: &[u32]| corners.iter().map(|&it| of(it)).fold(0.0, f32::max);
        longest(first) + longest(second) + self.offset.radius
    }

    /// Whether the distance of primitives half way is below a limit [m]. It does not depend on when
    /// candidates were found.
    fn is_below(&self, vertices: [u32; 4], limit: f32) -> bool {
        let half_way = vertices.map(|v| {
            let (start, end) = (
                self.contacts.starts[v as usize],
                self.contacts.ends[v as usize],
            );
            start + (end - start) * self.half
        });
        self.batch.kind.distance(half_way) <= limit.into()
    }
}

impl Contacts {
    /// Motion of a batch over a horizon in substeps.
    fn motion<'a>(&'a self, batch: &'a Batch, horizon: f64) -> Motion<'a> {
        let [a, b] = batch.pieces.map(|piece| &self.pieces[piece as usize]);
        let path = (b.motion - a.motion) * horizon;
        let offset = Ball::around(b.frame() - a.frame(), path, 0.0);
        let slack = a.slack + b.slack;
        Motion {
            contacts: self,
            batch,
            half: 0.5 * horizon,
            offset,
            // Slightly more than the rounding error.
            travel: 1.00001 * (a.travel + b.travel + batch.offset.farthest(offset) + slack),
            reach: a.radius + b.radius + offset.radius,
            slack,
        }
    }

    /// Finds the candidates that are near enough for a constraint, and the gaps of all.
    pub(super) fn find_near(&mut self, threads: &Threads) {
        let mut parts = std::mem::take(&mut self.near);
        // More parts than threads, as they take different times.
        let count = match threads.count() {
            1 => 1,
            count => 4 * count,
        };
        parts.resize_with(count, NearPart::default);
        let each = self.candidates.len().div_ceil(count).max(1);
        let mut next = 0;
        for (number, part) in (1..).zip(&mut parts) {
            let first = next;
            while let Some(batch) = self.batches.get(next)
                && (batch.range.start < number * each || number == count)
            {
                next += 1;
            }
            part.batches = first..next;
        }
        let estimate = |part: &NearPart| {
            let batches = &self.batches[part.batches.clone()];
            let candidates: usize = batches.iter().map(|batch| batch.range.len()).sum();
            WorkEstimate {
                projections: candidates * PROJECTIONS,
                pieces: 1,
            }
        };
        threads.for_each(&mut parts, estimate, &|part: &mut NearPart, _: &Threads| {
            part.find(self);
        });
        self.gaps.clear();
        for part in &parts {
            self.gaps.extend(&part.gaps);
        }
        self.near = parts;
    }

    /// The candidates of a batch that come closer than a distance in the substep [m], by their
    /// surface vertices.
    pub(super) fn reaching<'a>(
        &'a self,
        batch: &'a Batch,
        distance: f32,
    ) -> impl Iterator<Item = [u32; 4]> + 'a {
        let motion = self.motion(batch, 1.0);
        let candidates = &self.candidates[batch.range.clone()];
        let gaps = &self.gaps[batch.range.clone()];
        candidates.iter().zip(gaps).filter_map(move |(it, &gap)| {
            let change = motion.change(it);
            let limit = distance + change;
            if gap > limit + change + motion.slack || !motion.may_reach(it, distance) {
                return None;
            }
            let vertices = motion.corners(it);
            motion.is_below(vertices, limit).then_some(vertices)
        })
    }
}

impl NearPart {
    fn find(&mut self, contacts: &Contacts) {
        let Self {
            counts, near, gaps, ..
        } = self;
        counts.clear();
        near.clear();
        gaps.clear();
        for batch in &contacts.batches[self.batches.clone()] {
            let motion = contacts.motion(batch, HORIZON);
            let before = near.len();
            for candidate in &contacts.candidates[batch.range.clone()] {
                let distance = candidate.distance;
                // What is not near half way has a larger gap than this at the start.
                let mut gap = distance;
                if motion.may_reach(candidate, distance) {
                    let vertices = motion.corners(candidate);
                    let x = vertices.map(|v| contacts.starts[v as usize]);
                    let weights = batch.kind.weights(x);
                    gap = weighted(weights, x).length() as f32;
                    let distance = match candidate.touch_at_rest {
                        true => distance.min(OF_REST as f32 * gap),
                        false => distance,
                    };
                    let limit = distance + motion.reach;
                    let is_near = gap <= distance
                        || gap <= limit + motion.change(candidate) + motion.slack
                            && motion.is_below(vertices, limit);
                    if is_near && distance > 0.0 {
                        near.push(Near {
                            vertices,
                            weights,
                            distance,
                        });
                    }
                }
                gaps.push(gap);
            }
            counts.push(near.len() - before);
        }
    }
}
