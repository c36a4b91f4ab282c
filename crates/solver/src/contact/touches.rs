//! Contacts of rigid surfaces with each other, and with colliders that are meshes.
//!
//! Two rigid surfaces touch where their distance has a minimum. The few places that carry the load (`manifold.rs`)
//! are found anew in each tick, and kept in it while the surfaces hardly move against each other; their closest
//! points are those of each substep.

use super::{
    closest::weighted,
    contacts::{Contacts, HORIZON, Member},
    detect::Batch,
    manifold::Touch,
    near::{Motion, Near},
    open::Open,
    rigid_pairs::{Place, RigidPairs},
    row::{ContactRow, NO_GAP, NO_INDEX},
    rows::sorted,
    tangible::Tangible,
};
use glam::DVec3;
use std::{mem::take, ops::Range, sync::Arc};

/// By how much the surface around a closest point may be below it, as a fraction of the distance from there: faces
/// that are this close to parallel touch with all of their corners.
const LEVEL: f64 = 1e-3;

/// Touches are kept until the surfaces have moved by this fraction of their distance against each other.
const KEPT: f64 = 0.05;

impl Contacts {
    /// Whether both surfaces of a batch are rigid.
    pub(super) fn is_hard(&self, batch: &Batch) -> bool {
        let is_hard = |member: u32| {
            let member = &self.members[member as usize];
            member.rigid != NO_INDEX || member.is_collider()
        };
        !self.rigids.is_empty() && self.members_of(batch).into_iter().all(is_hard)
    }

    /// Creates the rows of rigid surfaces with each other.
    pub(super) fn make_rows_of_pairs(&mut self, bodies: &[impl Tangible]) {
        if self.rigids.is_empty() {
            return;
        }
        let mut pairs = take(&mut self.rigid_pairs);
        self.open(&mut pairs);
        self.find_places(&mut pairs);
        let RigidPairs {
            all,
            touches,
            places,
            ..
        } = &mut pairs;
        let kept = self.manifolds.keep(touches).iter();
        for ((_, touch), place) in kept
            .zip(touches)
            .zip(places)
            .filter(|((kept, _), _)| **kept)
        {
            all[touch.of as usize].places.push(*place);
        }
        for pair in all {
            if pair.moves.is_some() {
                pair.is_known = true;
                for place in &pair.places {
                    self.make_row_of(bodies, place);
                }
            }
        }
        self.rigid_pairs = pairs;
    }

    /// Finds the pairs that may touch in the substep, and forgets the places of those that have moved.
    fn open(&self, pairs: &mut RigidPairs) {
        self.find_motions(pairs);
        for pair in &mut pairs.all {
            pair.moves = None;
        }
        for part in &self.near {
            for it in &part.opened {
                let batch = &self.batches[it.batch];
                if !self.is_hard(batch) {
                    continue;
                }
                let members = sorted(self.members_of(batch));
                let place = pairs.place(members);
                if pairs.all[place].moves.is_some() {
                    continue;
                }
                let moves = HORIZON * pairs.relative_motion(members);
                let pair = &mut pairs.all[place];
                pair.moves = Some(moves);
                if pair.moved + moves > KEPT * self.distance(members, batch) {
                    pair.forget();
                }
            }
        }
    }

    /// Finds the places of pairs where they are not known.
    fn find_places(&self, pairs: &mut RigidPairs) {
        pairs.touches.clear();
        pairs.places.clear();
        pairs.unknown.clear();
        for (part, near) in (0..).zip(&self.near) {
            for (number, it) in (0..).zip(&near.opened) {
                let members = sorted(self.members_of(&self.batches[it.batch]));
                if let Ok(place) = pairs.find(members)
                    && pairs.all[place].moves.is_some()
                    && !pairs.all[place].is_known
                {
                    pairs.unknown.push([place as u32, part, number]);
                }
            }
        }
        pairs.unknown.sort_unstable();
        for &[of, part, number] in &pairs.unknown {
            let part = &self.near[part as usize];
            let it = &part.opened[number as usize];
            let batch = &self.batches[it.batch];
            let motion = self.motion(batch, HORIZON);
            for open in &part.open[it.range()] {
                if let Some((touch, place)) = self.touch_of(of, (batch, &motion), open) {
                    pairs.touches.push(touch);
                    pairs.places.push(place);
                }
            }
        }
    }

    /// Where the primitives of an open candidate touch, if they are near and their distance is smallest there.
    fn touch_of(
        &self,
        of: u32,
        (batch, motion): (&Batch, &Motion),
        open: &Open,
    ) -> Option<(Touch, Place)> {
        let candidate = &self.candidates[open.candidate as usize];
        let near = motion.at_start(candidate)?;
        let members = self.members_of(batch);
        if near.gap <= NO_GAP
            || !motion.is_near(candidate, &near)
            || self.is_tangled(members, near.vertices)
            || !self.is_closest(members, batch.kind.split(), &near)
        {
            return None;
        }
        let normal = near.apart / near.gap;
        let motions = near
            .vertices
            .map(|v| self.ends[v as usize] - self.starts[v as usize]);
        let starts = near.vertices.map(|v| self.starts[v as usize]);
        let first = near.weights.map(|weight| weight.max(0.0));
        let distance = f64::from(near.distance);
        let touch = Touch {
            of,
            normal: match members[0] <= members[1] {
                true => normal,
                false => -normal,
            },
            point: weighted(first, starts),
            // They may come closer by as much until the places are found anew.
            error: near.gap + normal.dot(weighted(near.weights, motions)) - (1.0 + KEPT) * distance,
            distance,
        };
        let place = Place {
            kind: batch.kind,
            members,
            vertices: near.vertices,
            distance: near.distance,
        };
        Some((touch, place))
    }

    /// Whether the distance of two rigid surfaces is smallest at these points, at the start or at the end of the
    /// substep: others would push along a direction that is not a normal.
    fn is_closest(&self, members: [u32; 2], split: usize, near: &Near) -> bool {
        let [a, b] = members.map(|it| &self.members[it as usize]);
        let corners = || near.vertices.into_iter().zip(near.weights);
        let is_lowest = |member: &Member, range: Range<usize>, sign: f64| {
            let own = || corners().skip(range.start).take(range.len());
            let ends = |v: usize| [self.starts[v], self.ends[v]];
            let point = own().fold([DVec3::ZERO; 2], |[x, y], (v, weight)| {
                let [start, end] = ends(v as usize);
                [x + start * weight.abs(), y + end * weight.abs()]
            });
            let normal = near.apart * (sign / near.gap);
            let is_above = |vertex: u32| {
                let at = ends(member.first + vertex as usize);
                let above = [at[0] - point[0], at[1] - point[1]];
                above.into_iter().any(|it| {
                    let height = it.dot(normal);
                    height >= 0.0 || height * height <= LEVEL * LEVEL * it.length_squared()
                })
            };
            let of_member = own().map(|(v, weight)| (v - member.first as u32, weight));
            member.surface.features().is_lowest(of_member, is_above)
        };
        is_lowest(a, 0..split, 1.0) && is_lowest(b, split..4, -1.0)
    }

    fn make_row_of(&mut self, bodies: &[impl Tangible], place: &Place) {
        let Place {
            kind,
            members,
            vertices,
            distance,
        } = *place;
        let [a, b] = members.map(|it| &self.members[it as usize]);
        let params = a.between(b).and_then(|between| {
            let pair = a.pair_params(b, between, self.h)?;
            Some((between, pair))
        });
        let Some((between, pair)) = params else {
            return;
        };
        if self.is_tangled(members, vertices) {
            return;
        }
        let weights = kind.weights(vertices.map(|v| self.starts[v as usize]));
        let split = kind.split();
        let corners = self.activate(bodies, members, split, vertices);
        self.rows[between as usize].extend(ContactRow::new(
            u32::MAX,
            corners,
            (weights, distance.into()),
            &pair,
            (split, &self.rigids),
            &self.active,
        ));
    }

    /// The surfaces have moved in the substep.
    pub(super) fn follow_pairs(&mut self) {
        if self.rigid_pairs.all.is_empty() {
            return;
        }
        let mut pairs = take(&mut self.rigid_pairs);
        self.find_motions(&mut pairs);
        for number in 0..pairs.all.len() {
            let moved = pairs.relative_motion(pairs.all[number].members);
            pairs.all[number].moved += moved;
        }
        self.rigid_pairs = pairs;
    }

    /// Members were registered: those of known pairs have other indices, and their vertices too.
    pub(super) fn follow_members(&mut self, before: &[Member]) {
        let members = &self.members;
        let now = |member: u32| {
            let old = before.get(member as usize)?;
            let place = members.iter().position(|it| it.owner == old.owner)?;
            let new = &members[place];
            let first = new.first as u32;
            Arc::ptr_eq(&new.surface, &old.surface)
                .then_some((place as u32, first.wrapping_sub(old.first as u32)))
        };
        self.rigid_pairs.all.retain_mut(|pair| {
            let [Some((a, _)), Some((b, _))] = pair.members.map(now) else {
                return false;
            };
            for place in &mut pair.places {
                let split = place.kind.split();
                for (number, v) in place.vertices.iter_mut().enumerate() {
                    let member = place.members[usize::from(number >= split)];
                    let (_, moved) = now(member).unwrap_or_default();
                    *v = v.wrapping_add(moved);
                }
                place.members = place.members.map(|it| now(it).unwrap_or_default().0);
            }
            pair.members = [a, b];
            true
        });
        self.rigid_pairs.all.sort_unstable_by_key(|it| it.members);
    }

    /// Bounds the displacements of rigid surfaces in the substep.
    fn find_motions(&self, pairs: &mut RigidPairs) {
        pairs.motions.clear();
        pairs.motions.extend(self.members.iter().map(|member| {
            let is_hard = member.rigid != NO_INDEX || member.is_collider();
            if !is_hard || !member.is_stepped {
                return [DVec3::ZERO; 2];
            }
            let moves = member.vertices().map(|v| self.ends[v] - self.starts[v]);
            let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
            moves.fold(none, |[low, high], by| [low.min(by), high.max(by)])
        }));
    }

    /// The distance that two surfaces keep, without what grains lack [m].
    fn distance(&self, members: [u32; 2], batch: &Batch) -> f64 {
        let halves = members.map(|it| {
            let member = &self.members[it as usize];
            member.half_thickness_for(batch.between).unwrap_or(0.0)
        });
        (halves[0] + halves[1]).into()
    }
}
