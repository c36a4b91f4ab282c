//! Candidates that may act in a substep.
//!
//! A candidate is near if its primitives can come closer than a distance along their motion: if
//! their distance half way is above it by no more than the motion from there. Contacts use the
//! longest motion in a piece, with a margin, as constraints change it; truncation uses that of the
//! primitives. Bounds decide most candidates, without a change of the result:
//!
//! - the distance at detection, less what has been moved since, for all candidates of a batch or for one;
//! - a lower bound of the gap at the start of the substep, which is computed in lanes, less the motion to
//!   half way.
//!
//! What remains is *open*. A contact acts only if its primitives come closer than their distance in a
//! pass, and they have not where that bound exceeds what they have moved towards each other: the rest, some in
//! a hundred, is computed exactly when it comes to that.
//!
//! Gaps are kept for truncation at the end of the substep, where the gap of hardly any candidate can
//! shrink enough.

use super::{
    bounds::{Ball, boxes_meet},
    closest::weighted,
    contacts::{Contacts, HORIZON},
    detect::{Batch, Candidate, OF_REST, SLACK},
    open::{NearPart, Open, OpenBatch, OpenRow},
};
use crate::{Threads, WorkEstimate};
use glam::DVec3;

/// Closest points of a candidate at the start of a substep.
#[derive(Debug, Clone, Copy)]
pub(super) struct Near {
    /// Surface vertices of the corners.
    pub vertices: [u32; 4],
    /// Their weights.
    pub weights: [f64; 4],
    /// Distance to maintain [m].
    pub distance: f32,
    /// From that of the second primitive to that of the first, and their distance [m].
    pub apart: DVec3,
    pub gap: f64,
}

/// Motion of the primitives of a batch.
pub(super) struct Motion<'a> {
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
const PROJECTIONS: usize = 1;

impl Motion<'_> {
    fn corners(&self, candidate: &Candidate) -> [u32; 4] {
        candidate
            .corners
            .map(|corner| self.contacts.vertices[corner as usize])
    }

    /// False if the primitives of a candidate certainly do not come closer than a distance [m].
    fn may_reach(&self, candidate: &Candidate, distance: f32) -> bool {
        boxes_meet(
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

    /// Closest points of a candidate at the start of the substep; `None` if it keeps no distance.
    pub fn at_start(&self, candidate: &Candidate) -> Option<Near> {
        let vertices = self.corners(candidate);
        let x = vertices.map(|v| self.contacts.starts[v as usize]);
        let weights = self.batch.kind.weights(x);
        let apart = weighted(weights, x);
        let gap = apart.length();
        let distance = match candidate.touch_at_rest {
            true => candidate.distance.min(OF_REST as f32 * gap as f32),
            false => candidate.distance,
        };
        (distance > 0.0).then_some(Near {
            vertices,
            weights,
            distance,
            apart,
            gap,
        })
    }

    /// Whether a candidate with these closest points is near enough for a constraint.
    pub fn is_near(&self, candidate: &Candidate, near: &Near) -> bool {
        let gap = near.gap as f32;
        let limit = near.distance + self.reach;
        gap <= near.distance
            || gap <= limit + self.change(candidate) + self.slack
                && self.is_below(near.vertices, limit)
    }
}

impl Contacts {
    /// Motion of a batch over a horizon in substeps.
    pub(super) fn motion<'a>(&'a self, batch: &'a Batch, horizon: f64) -> Motion<'a> {
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

    /// Finds the candidates that may act, and the gaps of all.
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
        let all = match batch.closest - distance <= motion.travel {
            true => batch.range.clone(),
            false => 0..0,
        };
        let candidates = &self.candidates[all.clone()];
        let gaps = &self.gaps[all];
        candidates.iter().zip(gaps).filter_map(move |(it, &gap)| {
            if it.clearance + it.distance - distance > motion.travel {
                return None;
            }
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
            opened,
            open,
            gaps,
            pairs,
            picked,
            instructions,
            ..
        } = self;
        opened.clear();
        open.clear();
        gaps.clear();
        for number in self.batches.clone() {
            let batch = &contacts.batches[number];
            let motion = contacts.motion(batch, HORIZON);
            let candidates = &contacts.candidates[batch.range.clone()];
            let first = gaps.len();
            // What is not near half way has a larger gap than its distance at the start.
            gaps.extend(candidates.iter().map(|it| it.distance));
            if batch.least > motion.travel {
                continue;
            }
            let [a, b] = batch.pieces.map(|piece| &contacts.pieces[piece as usize]);
            let apart = b.frame() - a.frame();
            let rounding = motion.slack + apart.abs().max_element() as f32 * SLACK;
            picked.clear();
            pairs.clear();
            for (place, candidate) in (0..).zip(candidates) {
                if candidate.clearance <= motion.travel {
                    let corners = candidate.corners;
                    let x = corners.map(|corner| contacts.offsets[corner as usize]);
                    pairs.push(batch.kind, x, apart.as_vec3a());
                    picked.push(place);
                }
            }
            let before = open.len();
            let mut least = f32::INFINITY;
            let bounds = pairs.lower_bounds(batch.kind, *instructions);
            for (&place, &bound) in picked.iter().zip(bounds) {
                let candidate = &candidates[place as usize];
                let gap = bound - rounding;
                gaps[first + place as usize] = gap;
                let limit = candidate.distance + motion.reach;
                // The motion of the corners is at most the longest one.
                let is_away = gap > limit + motion.reach + motion.slack
                    || gap > limit + motion.change(candidate) + motion.slack;
                if !is_away {
                    let room = gap - candidate.distance;
                    least = least.min(room);
                    open.push(Open {
                        corners: candidate.corners,
                        candidate: batch.range.start as u32 + place,
                        gap,
                        room,
                        row: OpenRow::Unknown,
                    });
                }
            }
            if open.len() > before {
                opened.push(OpenBatch {
                    batch: number,
                    kind: batch.kind,
                    first: before as u32,
                    count: (open.len() - before) as u32,
                    least,
                    has_rows: false,
                });
            }
        }
    }
}
