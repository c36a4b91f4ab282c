//! Rows of contacts, created when they are needed: a row that never acts changes nothing.
//!
//! A pass goes over the open candidates in their order. The primitives of one approach each other by at most
//! what their corners have moved relative to the mean motions of their pieces, and these relative to each other.
//! Where that is less than the room that they had at the start, there is nothing to do; all others
//! get a row, if they are near. Rigid bodies have their rows from the start, few with each other
//! (`touches.rs`), and are not part of the pass (`rigid_rows.rs`).

use super::{
    between::Between,
    closest::weighted,
    contacts::{Contacts, HORIZON, Member, Owner, Piece},
    detect::Batch,
    open::{NearPart, Open, OpenRow},
    row::{ContactRow, NO_GAP, NO_INDEX, TOUCHING},
    tangible::Tangible,
};
use glam::DVec3;
use std::mem::take;

/// Margin of the bound on the approach of two primitives against rounding, as a fraction.
const MARGIN: f32 = 1e-5;

impl Contacts {
    /// Removes the rows of the substep before.
    pub(super) fn clear_rows(&mut self) {
        for it in self.active.drain(..) {
            self.places[it.vertex as usize] = NO_INDEX;
        }
        for rows in &mut self.rows {
            rows.clear();
        }
    }

    /// Indices of the members of a batch.
    pub(super) fn members_of(&self, batch: &Batch) -> [u32; 2] {
        batch
            .pieces
            .map(|piece| self.pieces[piece as usize].member as u32)
    }

    /// Whether one of the surfaces of a batch is rigid.
    fn is_rigid(&self, batch: &Batch) -> bool {
        let is_rigid = |member: u32| self.members[member as usize].rigid != NO_INDEX;
        !self.rigids.is_empty() && self.members_of(batch).into_iter().any(is_rigid)
    }

    /// Creates all rows of rigid surfaces with soft ones.
    pub(super) fn make_rigid_rows(&mut self, bodies: &[impl Tangible]) {
        if self.rigids.is_empty() {
            return;
        }
        let mut parts = take(&mut self.near);
        for part in &mut parts {
            for it in &mut part.opened {
                let batch = &self.batches[it.batch];
                if self.is_rigid(batch) && !self.is_hard(batch) {
                    for open in &mut part.open[it.range()] {
                        open.row = self.make_row(bodies, (it.batch, false), open);
                        it.has_rows |= matches!(open.row, OpenRow::Some(_));
                    }
                }
            }
        }
        self.near = parts;
    }

    /// Finds the bodies that touch, also without a force.
    pub(super) fn find_touching(&mut self) {
        let mut touching = take(&mut self.touching);
        touching.clear();
        let of_rigid = self.rows[Between::Bodies as usize].iter();
        let of_rigid = of_rigid.filter(|row| row.touches());
        touching.extend(of_rigid.map(|row| sorted(row.bodies(&self.active))));
        touching.sort_unstable();
        touching.dedup();
        for part in &self.near {
            for it in &part.opened {
                let batch = &self.batches[it.batch];
                if batch.between != Between::Bodies || self.is_rigid(batch) {
                    continue;
                }
                let owners = self
                    .members_of(batch)
                    .map(|it| self.members[it as usize].owner);
                let pair = sorted(owners.map(|it| match it {
                    Owner::Body(body) => body as u32,
                    Owner::Collider(_) => NO_INDEX,
                }));
                let Err(place) = touching.binary_search(&pair) else {
                    continue;
                };
                let open = &part.open[it.range()];
                if open.iter().any(|open| self.touch(it.batch, open)) {
                    touching.insert(place, pair);
                }
            }
        }
        self.touching = touching;
    }

    /// Whether the primitives of an open candidate touch, and one of their bodies can be moved.
    fn touch(&self, batch: usize, open: &Open) -> bool {
        let candidate = &self.candidates[open.candidate as usize];
        let batch = &self.batches[batch];
        let members = self.members_of(batch);
        if f64::from(open.room) > (TOUCHING - 1.0) * f64::from(candidate.distance) * 1.00001 {
            return false;
        }
        let motion = self.motion(batch, HORIZON);
        motion.at_start(candidate).is_some_and(|near| {
            let corners = near.vertices.into_iter().zip(near.weights);
            let mut weights = corners.map(|(v, weight)| weight * self.inverse_masses[v as usize]);
            near.gap > NO_GAP
                && near.gap <= TOUCHING * f64::from(near.distance)
                && weights.any(|weight| weight != 0.0)
                && motion.is_near(candidate, &near)
                && !self.is_tangled(members, near.vertices)
        })
    }

    /// Creates the row of an open candidate, if it is near enough for one; before that, if it `may_wait`, only
    /// where its surfaces are closer than their distance now.
    fn make_row(
        &mut self,
        bodies: &[impl Tangible],
        (number, may_wait): (usize, bool),
        open: &Open,
    ) -> OpenRow {
        let batch = &self.batches[number];
        let candidate = &self.candidates[open.candidate as usize];
        let motion = self.motion(batch, HORIZON);
        let Some(near) = motion.at_start(candidate) else {
            return OpenRow::None;
        };
        let members = self.members_of(batch);
        let [a, b] = members.map(|member| &self.members[member as usize]);
        let Some(pair) = a.pair_params(b, batch.between, self.h) else {
            return OpenRow::None;
        };
        let split = batch.kind.split();
        if may_wait && near.gap > NO_GAP {
            let x = std::array::from_fn(|corner| {
                let v = near.vertices[corner] as usize;
                match self.active.get(self.places[v] as usize) {
                    Some(it) => it.now,
                    None => position(bodies, [a, b][usize::from(corner >= split)], v, &self.ends),
                }
            });
            let distance = f64::from(near.distance).min(near.gap + pair.recovery);
            let error = (near.apart / near.gap).dot(weighted(near.weights, x)) - distance;
            if error >= 0.0 || !error.is_finite() {
                return OpenRow::Unknown;
            }
        }
        if !motion.is_near(candidate, &near) || self.is_tangled(members, near.vertices) {
            return OpenRow::None;
        }
        let between = batch.between;
        let corners = self.activate(bodies, members, split, near.vertices);
        let rows = &mut self.rows[between as usize];
        let index = rows.len() as u32;
        rows.extend(ContactRow::new(
            open.candidate,
            corners,
            (near.weights, near.distance.into()),
            &pair,
            (split, &self.rigids),
            &self.active,
        ));
        match rows.len() as u32 > index {
            true => OpenRow::Some(index),
            false => OpenRow::None,
        }
    }

    /// Indices of surface vertices among the active ones; the first ones, up to `split`, belong to the first member.
    pub(super) fn activate(
        &mut self,
        bodies: &[impl Tangible],
        members: [u32; 2],
        split: usize,
        vertices: [u32; 4],
    ) -> [u32; 4] {
        let mut corners = [0; 4];
        for (corner, (number, v)) in corners.iter_mut().zip(vertices.into_iter().enumerate()) {
            let v = v as usize;
            if self.places[v] == NO_INDEX {
                let member = &self.members[members[usize::from(number >= split)] as usize];
                let ends = [self.starts[v], self.ends[v]];
                let mut it = member.active(v as u32, ends, self.inverse_masses[v]);
                it.now = position(bodies, member, v, &self.ends);
                self.places[v] = self.active.len() as u32;
                self.active.push(it);
            }
            *corner = self.places[v];
        }
        corners
    }

    /// Projects the contacts of one kind, but those of rigid bodies, in the order of their candidates.
    pub(super) fn pass(&mut self, bodies: &[impl Tangible], between: Between) {
        let mut parts = take(&mut self.near);
        self.measure(bodies, &parts, between);
        for NearPart { opened, open, .. } in &mut parts {
            for it in opened {
                let batch = &self.batches[it.batch];
                if batch.between != between || self.is_hard(batch) {
                    continue;
                }
                let [a, b] = self.batches[it.batch].pieces.map(|it| it as usize);
                let apart = (self.pieces[b].motion - self.pieces[a].motion).length() as f32;
                let most = self.pieces[a].farthest + self.pieces[b].farthest + apart;
                if !it.has_rows && it.least > most * (1.0 + MARGIN) {
                    continue;
                }
                let split = self.batches[it.batch].kind.split();
                for open in &mut open[it.range()] {
                    if open.row == OpenRow::Unknown {
                        let moved = open.corners.map(|corner| self.moved[corner as usize]);
                        let (first, second) = moved.split_at(split);
                        let largest = |of: &[f32]| of.iter().copied().fold(0.0, f32::max);
                        let towards = largest(first) + largest(second) + apart;
                        if open.room > towards * (1.0 + MARGIN) {
                            continue;
                        }
                        open.row = self.make_row(bodies, (it.batch, true), open);
                        it.has_rows |= matches!(open.row, OpenRow::Some(_));
                    }
                    if let OpenRow::Some(row) = open.row {
                        let row = &mut self.rows[between as usize][row as usize];
                        if !row.is_rigid() && row.solve(&mut self.active) {
                            let corners = row.corners;
                            self.follow_moved(corners);
                        }
                    }
                }
            }
        }
        self.near = parts;
    }

    /// Measures how far the corners of pieces with open candidates have moved.
    fn measure(&mut self, bodies: &[impl Tangible], parts: &[NearPart], between: Between) {
        self.measured.clear();
        self.measured.resize(self.pieces.len(), false);
        for it in parts.iter().flat_map(|part| &part.opened) {
            let batch = &self.batches[it.batch];
            if batch.between == between && !self.is_rigid(batch) {
                for piece in batch.pieces {
                    self.measured[piece as usize] = true;
                }
            }
        }
        let Self {
            members,
            pieces,
            vertices,
            starts,
            ends,
            moved,
            measured,
            ..
        } = self;
        for (piece, _) in pieces.iter_mut().zip(measured).filter(|(_, it)| **it) {
            piece.farthest = 0.0;
            let member = &members[piece.member];
            for corner in piece.corners(members) {
                let v = vertices[corner] as usize;
                let displacement = position(bodies, member, v, ends) - starts[v];
                moved[corner] = piece.moved(displacement);
                piece.farthest = piece.farthest.max(moved[corner]);
            }
        }
    }

    /// The corners of a row have moved.
    fn follow_moved(&mut self, corners: [u32; 4]) {
        for corner in corners {
            let it = &self.active[corner as usize];
            if it.inverse_mass > 0.0 {
                let displacement = it.now - it.start;
                for &[corner, piece] in self.corners_of.of(it.vertex) {
                    let piece = &mut self.pieces[piece as usize];
                    let moved = piece.moved(displacement);
                    self.moved[corner as usize] = moved;
                    piece.farthest = piece.farthest.max(moved);
                }
            }
        }
    }

    /// Brings the rows into the order of their candidates, as they may have been created in several passes.
    pub(super) fn sort_rows(&mut self) {
        for rows in &mut self.rows {
            if !rows.is_sorted_by_key(|row| row.order) {
                rows.sort_by_key(|row| row.order);
            }
        }
    }

    /// Whether a constraint with another surface, or itself, is possible in the substep, for a body given by
    /// its index. To be asked before anything moves.
    pub(crate) fn is_near(&self, body: usize) -> bool {
        let mut opened = self
            .near
            .iter()
            .flat_map(|part| part.opened.iter().map(move |it| (part, it)));
        self.active.iter().any(|it| it.body as usize == body)
            || opened.any(|(part, it)| {
                let batch = &self.batches[it.batch];
                let members = self.members_of(batch);
                let is_own = |member: u32| self.members[member as usize].owner == Owner::Body(body);
                members.into_iter().any(is_own)
                    && part.open[it.range()].iter().any(|open| {
                        let candidate = &self.candidates[open.candidate as usize];
                        let motion = self.motion(batch, HORIZON);
                        motion.at_start(candidate).is_some_and(|near| {
                            motion.is_near(candidate, &near)
                                && !self.is_tangled(members, near.vertices)
                        })
                    })
            })
    }

    /// Smallest distance of two surfaces at the start of the last substep [m]; `None` without a pair
    /// near enough for a constraint.
    #[must_use]
    pub fn smallest_gap(&self) -> Option<f64> {
        let mut smallest: Option<f64> = None;
        for part in &self.near {
            for it in &part.opened {
                for open in &part.open[it.range()] {
                    if open.row != OpenRow::None
                        && smallest.is_none_or(|gap| f64::from(open.gap) < gap)
                    {
                        let vertices = open.corners.map(|it| self.vertices[it as usize] as usize);
                        let gap = it.kind.distance(vertices.map(|v| self.starts[v]));
                        smallest = Some(smallest.map_or(gap, |it| it.min(gap)));
                    }
                }
            }
        }
        smallest
    }
}

impl Piece {
    /// How far a corner that was displaced has moved relative to the mean motion [m].
    fn moved(&self, displacement: DVec3) -> f32 {
        (displacement - self.motion).length() as f32
    }
}

/// In ascending order.
pub(super) fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Where a surface vertex of a member is now [m]: of a collider, at the end of the substep.
fn position(bodies: &[impl Tangible], member: &Member, v: usize, ends: &[DVec3]) -> DVec3 {
    match member.owner {
        Owner::Body(body) => bodies[body].now(member.particle(v)),
        Owner::Collider(_) => ends[v],
    }
}
