//! Bounds the motion of surfaces, piece by piece.

use super::{between::Between, bounds::Ball, contacts::Contacts};
use crate::Threads;
use std::mem::take;

impl Contacts {
    /// Bounds motion times `horizon` by balls, in a tick of this number of substeps; finds
    /// candidates anew where one of them is outside of the ball for which they were found.
    pub(super) fn enclose_or_detect(&mut self, horizon: f64, substeps: u32, threads: &Threads) {
        if !(self.is_valid && self.enclose_motion(horizon)) {
            self.detect(substeps, horizon, threads);
            for number in 0..self.pieces.len() {
                if take(&mut self.pieces[number].is_renewed) {
                    self.enclose(number, horizon);
                }
            }
        }
    }

    /// Bounds motion times `horizon` by balls; false if one of them is outside of the ball for
    /// which candidates were found.
    fn enclose_motion(&mut self, horizon: f64) -> bool {
        let mut holds = true;
        for number in 0..self.pieces.len() {
            let is_inside = self.enclose(number, horizon);
            let piece = &mut self.pieces[number];
            piece.is_lost = piece.is_new || !is_inside;
            holds &= !piece.is_lost;
            let reach = piece.radius;
            self.bend(number, reach);
        }
        let mut pairs = take(&mut self.pairs);
        for pair in &mut pairs {
            if pair.is_unfolded {
                pair.is_lost = !self.are_unfolded(pair, horizon);
                holds &= !pair.is_lost;
                continue;
            }
            let [a, b] = pair.pieces.map(|piece| &self.pieces[piece as usize]);
            let moved = b.frame() - a.frame() - pair.offset;
            let motion = Ball::around(moved, (b.motion - a.motion) * horizon, a.slack + b.slack);
            pair.is_lost = a.first != b.first && !pair.claim.contains(motion);
            holds &= !pair.is_lost;
        }
        self.pairs = pairs;
        holds
    }

    /// Bounds the motion of a piece times `horizon`; false if it is outside of the ball for which candidates were
    /// found.
    fn enclose(&mut self, number: usize, horizon: f64) -> bool {
        let Self {
            members,
            pieces,
            starts,
            ends,
            vertices,
            centers,
            half_motions,
            offsets,
            claimed,
            ..
        } = self;
        let piece = &mut pieces[number];
        if !piece.is_stepped {
            return true;
        }
        let frame = piece.frame();
        let path = piece.motion * horizon;
        let motion = Ball::around(piece.drift, path, piece.slack);
        let (mut longest, mut farthest) = (0.0_f64, 0.0_f32);
        for corner in piece.corners(members) {
            let v = vertices[corner] as usize;
            let (start, end) = (starts[v], ends[v]);
            let relative = (end - start) * horizon - path;
            let offset = start - frame;
            let center = (offset + relative * 0.5).as_vec3a();
            offsets[corner] = offset.as_vec3a();
            let mut square = 0.25 * relative.length_squared();
            if let Some(common) = &piece.common {
                let apart = common.displacement(start) - path - relative * 0.5;
                square = square.max(apart.length_squared());
            }
            longest = longest.max(square);
            // A bound, also after rounding.
            half_motions[corner] = (square as f32).sqrt() * (1.0 + 1e-6);
            farthest = farthest.max((center - claimed[corner]).length_squared());
            centers[corner] = center;
        }
        piece.radius = longest.sqrt() as f32 + 0.5 * piece.half_thickness;
        piece.travel = farthest.sqrt() + piece.radius + piece.slack;
        piece.claim.contains(motion) && piece.travel <= piece.claimed_radius
    }

    /// Finds how a piece of a surface with contact with itself lies over its chart, with a reach of its corners [m].
    pub(super) fn bend(&mut self, number: usize, reach: f32) {
        let piece = &self.pieces[number];
        let member = &self.members[piece.member];
        if !piece.is_stepped || member.params[Between::Itself as usize].is_none() {
            return;
        }
        if let Some(patch) = member.surface.chart().patches.get(piece.patch)
            && !patch.eights.is_empty()
        {
            let at = &self.centers[piece.corners(&self.members)];
            self.bends[number].update(patch, at, reach, self.instructions);
        }
    }
}
