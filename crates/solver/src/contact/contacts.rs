//! Contacts of all bodies of a world.

use super::{
    between::{Between, KINDS},
    bounds::Ball,
    closed_mesh::ClosedMesh,
    common::CommonMotion,
    crossing::Crossing,
    detect::{Batch, Candidate, PiecePair, Scratch},
    manifold::Manifolds,
    open::NearPart,
    rigid::Rigid,
    rigid_pairs::{RigidPair, RigidPairs},
    rigid_rows::{Kept, RigidRows},
    row::{Active, ContactForce, ContactPart, ContactRow, NO_INDEX},
    stitched::StitchedVertices,
    sums::{PairContact, Sums},
    tangible::Tangible,
    tangle::{CrossingSearch, Tangle},
    truncate::Truncation,
    unfolded::Bend,
};
use crate::{
    Effects, Pose, Stitches, Substep, Threads,
    colliders::collider::SweptCollider,
    effects::contact::{PairParams, Params},
    lanes::Instructions,
    topology::{features::Features, patches::Patch, surface::Surface},
};
use glam::{DAffine3, DVec3, Vec3A};
use std::{mem::take, ops::Range, sync::Arc};

/// Reach of a ball along the predicted motion, as a multiple of the motion.
pub(super) const HORIZON: f64 = 1.5;

/// Tolerated deviation of a particle from its expected path, as a fraction of the mean edge, and at
/// least a quarter of the thickness. Larger values mean fewer detections with more candidates: with
/// all of the thickness a dense pile had 2.5 times as many, and took 1.3 times as long.
const SKIN: f32 = 0.1;

/// Contact statistics of the last substep, and the number of detections.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct ContactCounts {
    /// Pairs of primitives that may come near each other.
    pub candidates: usize,
    /// Candidates that may come near enough for a constraint.
    pub near: usize,
    /// Constraints with a force.
    pub acting: usize,
    /// Particles with truncated motion.
    pub truncated: usize,
    /// Pairs that could not be separated, because none of their particles may be moved.
    pub failed: usize,
    /// Number of detections since contact was last inactive.
    pub detections: u64,
    /// Bodies with contact that no other came near in the last tick, so that they were stepped as without.
    pub apart: usize,
    /// Number of ticks that were stepped again, as bodies came near each other faster than was foreseen,
    /// since contact was last inactive.
    pub repeated: u64,
}

/// Contacts of all bodies of a world that carry [`Contact`](crate::Contact) or
/// [`SelfContact`](crate::SelfContact), and of those that carry [`Collide`](crate::Collide) with colliders that are meshes.
///
/// A cache, not part of the state: without it a world continues with the same bits.
#[derive(Debug, Default)]
pub struct Contacts {
    pub(super) members: Vec<Member>,
    pub(super) pieces: Vec<Piece>,
    /// How each piece lies over its chart, in contact with itself.
    pub(super) bends: Vec<Bend>,
    /// Per surface vertex: position at the start of the substep, and predicted position at its end
    /// [m].
    pub(super) starts: Vec<DVec3>,
    pub(super) ends: Vec<DVec3>,
    pub(super) inverse_masses: Vec<f64>,
    /// Per corner of a piece: its surface vertex, the center of the ball around its motion in the
    /// substep in the frame of the piece, and the center for which candidates were found.
    pub(super) vertices: Vec<u32>,
    pub(super) centers: Vec<Vec3A>,
    /// Half the length of the motion of each corner in the frame of its piece [m].
    pub(super) half_motions: Vec<f32>,
    pub(super) claimed: Vec<Vec3A>,
    /// Position of each corner at the start of the substep in the frame of its piece [m].
    pub(super) offsets: Vec<Vec3A>,
    /// How far each corner has moved in the substep, relative to the mean motion of its piece [m], where that
    /// was measured, by piece.
    pub(super) moved: Vec<f32>,
    pub(super) measured: Vec<bool>,
    pub(super) corners_of: VertexCorners,
    /// Pieces that may come near each other, and the bound on their relative motion.
    pub(super) pairs: Vec<PiecePair>,
    pub(super) batches: Vec<Batch>,
    pub(super) candidates: Vec<Candidate>,
    /// Lower bounds of the gaps of the candidates at the start of the substep [m].
    pub(super) gaps: Vec<f32>,
    /// The open candidates, in parts for the threads.
    pub(super) near: Vec<NearPart>,
    /// Rows of each kind of contact.
    pub(super) rows: [Vec<ContactRow>; KINDS],
    pub(super) active: Vec<Active>,
    pub(super) rigids: Vec<Rigid>,
    pub(super) manifolds: Manifolds,
    pub(super) rigid_pairs: RigidPairs,
    pub(super) rigid_rows: RigidRows,
    pub(super) tangles: Vec<Tangle>,
    pub(super) crossings: Vec<Crossing>,
    pub(super) search: CrossingSearch,
    /// Per member: whether it may have crossed another surface since the last check.
    pub(super) may_cross: Vec<bool>,
    /// Per member: whether it is a collider that was teleported since.
    pub(super) teleported: Vec<bool>,
    /// Per member: triangles of a closed collider, once they were needed.
    pub(super) closed: Vec<Option<ClosedMesh>>,
    /// Index of each vertex among the active ones.
    pub(super) places: Vec<u32>,
    /// Pairs of bodies in contact at the start of the last substep.
    pub(super) touching: Vec<[u32; 2]>,
    pub(super) sums: Sums,
    pub(super) truncation: Truncation,
    /// Bodies whose velocity changes after the substep, and by how much, per substep [m].
    pub(super) pushes: Vec<(usize, DVec3)>,
    pub(super) scratch: Scratch,
    pub(super) instructions: Instructions,
    pub(super) counts: ContactCounts,
    /// Length of the last substep [s].
    pub(super) h: f64,
    pub(super) is_valid: bool,
}

/// A particle that deviates by more than this fraction of the thickness from its stepped position
/// was moved externally.
const MOVED: f32 = 0.01;

/// A collider that deviates by more than this fraction of its mean edge from the end of its last motion
/// was teleported.
const TELEPORTED: f32 = 1e-3;

/// Owner of a surface, by its index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Owner {
    Body(usize),
    Collider(usize),
}

/// A body with contact, or a collider that is a mesh.
#[derive(Debug)]
pub(super) struct Member {
    pub(super) owner: Owner,
    /// Index of its body among the rigid ones; [`NO_INDEX`] for others.
    pub(super) rigid: u32,
    pub(super) surface: Arc<Surface>,
    /// Index of its first surface vertex.
    pub(super) first: usize,
    /// Parameters by kind of contact.
    pub(super) params: [Option<Params>; KINDS],
    /// Number of its body; [`NO_INDEX`] for a collider.
    pub(super) number: u32,
    /// Its stitches.
    pub(super) stitched: StitchedVertices,
    pub(super) is_stepped: bool,
    /// Whether no other surface comes near it, and whether it is left out, as it has no contact with itself
    /// either.
    pub(super) is_apart: bool,
    pub(super) is_idle: bool,
    /// Motion of a collider in the substep.
    pub(super) motion: DAffine3,
    /// Pose of a collider when it was registered.
    pose: Option<Pose>,
}

/// A piece of the surface of a member, with its own moving frame.
#[derive(Debug)]
pub(super) struct Piece {
    pub(super) member: usize,
    /// Index of the patch of the surface.
    pub(super) patch: usize,
    /// Index of its first corner.
    pub(super) first: usize,
    /// Whether it moves by itself, and is not left out.
    pub(super) is_stepped: bool,
    pub(super) half_thickness: f32,
    /// Whether its motion has left its claims.
    pub(super) is_lost: bool,
    /// Whether it has other partners than when candidates were found.
    pub(super) is_new: bool,
    /// Whether its claims were renewed since its motion was bounded.
    pub(super) is_renewed: bool,
    /// Origin of its frame [m], and its displacement since detection [m].
    pub(super) origin: DVec3,
    pub(super) drift: DVec3,
    /// Mean motion in the substep [m].
    pub(super) motion: DVec3,
    /// The common motion of its group, where motion is cut.
    pub(super) common: Option<CommonMotion>,
    /// Displacements of its frame for which the pairs of pieces are valid.
    pub(super) claim: Ball,
    /// Margin of its balls against rounding [m].
    pub(super) slack: f32,
    /// Radius of the balls around the motion of its corners, with a margin [m], and of those for
    /// which candidates are valid.
    pub(super) radius: f32,
    pub(super) claimed_radius: f32,
    /// Maximum reach of a ball beyond the center of the claimed one [m].
    pub(super) travel: f32,
    /// How far a corner has moved at most relative to the mean motion, where that was measured [m].
    pub(super) farthest: f32,
}

/// Corners of pieces by their surface vertex.
#[derive(Debug, Default)]
pub(super) struct VertexCorners {
    /// Index of the first of each vertex, and the number of all.
    first: Vec<u32>,
    /// Corner and piece.
    all: Vec<[u32; 2]>,
}

impl VertexCorners {
    /// Of corners with these vertices and pieces, for a number of vertices.
    fn fill(&mut self, corners: impl Iterator<Item = (u32, u32)> + Clone, vertices: usize) {
        self.first.clear();
        self.first.resize(vertices + 1, 0);
        for (vertex, _) in corners.clone() {
            self.first[vertex as usize + 1] += 1;
        }
        for vertex in 0..vertices {
            self.first[vertex + 1] += self.first[vertex];
        }
        let mut next = self.first.clone();
        self.all.clear();
        self.all.resize(corners.clone().count(), [0; 2]);
        for (corner, (vertex, piece)) in (0..).zip(corners) {
            let place = &mut next[vertex as usize];
            self.all[*place as usize] = [corner, piece];
            *place += 1;
        }
    }

    /// Corners of a vertex, with their pieces.
    pub fn of(&self, vertex: u32) -> &[[u32; 2]] {
        let [first, end] = [0, 1].map(|next| self.first[vertex as usize + next] as usize);
        &self.all[first..end]
    }
}

impl Member {
    pub(super) fn vertices(&self) -> Range<usize> {
        self.first..self.first + self.surface.vertices.len()
    }

    /// Where it can touch others first, if it is rigid.
    pub(super) fn features(&self) -> Option<&Features> {
        (self.rigid != NO_INDEX).then(|| self.surface.features())
    }

    /// The particle of one of its surface vertices.
    pub(super) fn particle(&self, vertex: usize) -> usize {
        self.surface.vertices[vertex - self.first] as usize
    }

    /// The largest of its parts of the distance in the kinds of contact that it has [m].
    pub(super) fn half_thickness(&self) -> f32 {
        let kinds = [Between::Bodies, Between::Itself, Between::Colliders];
        let halves = kinds.map(|between| self.half_thickness_for(between));
        halves.into_iter().flatten().fold(0.0, f32::max)
    }

    pub(super) fn is_collider(&self) -> bool {
        matches!(self.owner, Owner::Collider(_))
    }

    /// By how much one of its surface vertices is smaller than the largest [m].
    pub(super) fn deficit(&self, vertex: u32) -> f32 {
        let radius = self.surface.radii.get(vertex as usize - self.first);
        radius.map_or(0.0, |radius| self.surface.largest_radius - radius)
    }

    /// Kind of contact with another member, or with itself, if any.
    pub(super) fn between(&self, other: &Self) -> Option<Between> {
        let between = if self.owner == other.owner {
            Between::Itself
        } else if self.is_collider() || other.is_collider() {
            Between::Colliders
        } else {
            Between::Bodies
        };
        let can = [self, other]
            .iter()
            .all(|member| member.params[between as usize].is_some());
        let are_both_colliders = self.is_collider() && other.is_collider();
        let is_away = between != Between::Itself && (self.is_apart || other.is_apart);
        let is_any_stepped = self.is_stepped || other.is_stepped;
        (can && !are_both_colliders && !is_away && is_any_stepped).then_some(between)
    }

    /// Parameters of contact with another member, or with itself, in a substep of `h` seconds.
    pub(super) fn pair_params(&self, other: &Self, between: Between, h: f64) -> Option<PairParams> {
        let [a, b] = [self, other].map(|member| member.params[between as usize]);
        let (a, b) = (a?, b?);
        Some(match between {
            Between::Bodies => PairParams::between(&a, &b, h),
            Between::Itself => PairParams::within(&a, h),
            Between::Colliders => PairParams::within(if self.is_collider() { &b } else { &a }, h),
        })
    }

    /// One of its surface vertices, with its positions at the start and at the predicted end of a
    /// substep [m] and its inverse mass [1/kg].
    pub(super) fn active(&self, vertex: u32, [start, end]: [DVec3; 2], weight: f64) -> Active {
        Active {
            vertex,
            body: match self.owner {
                Owner::Body(body) => body as u32,
                Owner::Collider(_) => NO_INDEX,
            },
            rigid: self.rigid,
            particle: self.surface.vertices[vertex as usize - self.first],
            inverse_mass: if self.rigid == NO_INDEX { weight } else { 0.0 },
            start,
            now: start,
            motion: end - start,
            parts: [DVec3::ZERO; ContactPart::COUNT],
        }
    }

    /// Its part of the distance of two surfaces [m]: half its thickness, or all of it from a
    /// collider, which has none; the largest radius of grains.
    pub(super) fn half_thickness_for(&self, between: Between) -> Option<f32> {
        let params = self.params[between as usize]?;
        if !self.surface.radii.is_empty() {
            return Some(self.surface.largest_radius);
        }
        Some(match (between, self.owner) {
            (Between::Colliders, Owner::Collider(_)) => 0.0,
            (Between::Colliders, _) => params.thickness(self.surface.mean_edge),
            _ => 0.5 * params.thickness(self.surface.mean_edge),
        })
    }
}

impl Piece {
    pub(super) fn patch<'a>(&self, members: &'a [Member]) -> &'a Patch {
        &members[self.member].surface.patches[self.patch]
    }

    pub(super) fn corners(&self, members: &[Member]) -> Range<usize> {
        self.first..self.first + self.patch(members).vertices.len()
    }

    /// Tolerated deviation of a corner from its expected path [m].
    pub(super) fn skin(&self, members: &[Member]) -> f32 {
        let mean_edge = members[self.member].surface.mean_edge;
        (SKIN * mean_edge).max(0.5 * self.half_thickness)
    }

    /// Current origin of the frame [m].
    pub(super) fn frame(&self) -> DVec3 {
        self.origin + self.drift
    }
}

impl Clone for Contacts {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl PartialEq for Contacts {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Contacts {
    /// Statistics of the last substep.
    #[must_use]
    pub fn counts(&self) -> ContactCounts {
        self.counts
    }

    /// Pairs of bodies in contact at the start of the last substep, by index, without repetition.
    #[must_use]
    pub fn touching(&self) -> &[[u32; 2]] {
        &self.touching
    }

    /// Forces of the active contacts in the last substep.
    pub fn forces(&self) -> impl Iterator<Item = ContactForce> {
        let rows = self.rows.iter().flatten().filter(|row| row.acts());
        rows.map(|row| row.force(self.h, &self.active))
    }

    /// Forces of the active contacts in the last substep on particles: index of the body, particle,
    /// and magnitude [N]. A contact acts on up to four particles, by the weights of its points.
    pub fn particle_forces(&self) -> impl Iterator<Item = (u32, u32, f64)> {
        let rows = self.rows.iter().flatten().filter(|row| row.acts());
        rows.flat_map(|row| row.particle_forces(self.h, &self.active))
    }

    /// The pairs of bodies that touched in a substep of the tick, with the mean of their forces.
    /// Does not have pairs of a body and a collider, nor self-contact.
    pub fn pairs(&self) -> impl Iterator<Item = PairContact> {
        self.sums.means()
    }

    /// Removes the pairs of bodies that touched since the tick began, or since they were removed last:
    /// forces are sums over the substeps, whose number is returned.
    pub fn take_pairs(&mut self, each: impl FnMut(PairContact)) -> u32 {
        self.sums.take(each)
    }

    /// Begins a tick: nothing is kept of the one before, and forces of pairs are added up anew.
    pub fn begin_tick(&mut self) {
        self.sums.clear();
        self.rigid_pairs.begin_tick();
        self.rigid_rows.begin_tick();
    }

    /// What substeps of a tick leave to the next ones.
    pub(crate) fn memory(&mut self) -> TickMemory {
        TickMemory {
            sums: self.sums.clone(),
            rows: self.rigid_rows.kept().clone(),
            pairs: self.rigid_pairs.all.clone(),
        }
    }

    /// Returns to what substeps of a tick have left, as the next ones have to be performed again.
    pub(crate) fn return_to(&mut self, memory: TickMemory) {
        let TickMemory { sums, rows, pairs } = memory;
        self.sums = sums;
        *self.rigid_rows.kept() = rows;
        self.rigid_pairs.all = pairs;
    }

    /// Memory use in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&self.starts[..])
            + size_of_val(&self.ends[..])
            + size_of_val(&self.inverse_masses[..])
            + size_of_val(&self.vertices[..])
            + size_of_val(&self.centers[..])
            + size_of_val(&self.claimed[..])
            + size_of_val(&self.offsets[..])
            + size_of_val(&self.moved[..])
            + size_of_val(&self.corners_of.all[..])
            + size_of_val(&self.candidates[..])
            + self
                .rows
                .iter()
                .map(|rows| size_of_val(&rows[..]))
                .sum::<usize>()
            + size_of_val(&self.active[..])
            + size_of_val(&self.places[..])
    }

    /// Removes all bodies: no contact in this tick.
    pub fn clear(&mut self) {
        if !self.members.is_empty() {
            *self = Self::default();
        }
    }

    /// Bodies were added or removed: the same places may belong to others.
    pub fn invalidate(&mut self) {
        self.is_valid = false;
        self.members.clear();
        self.near.clear();
        self.touching.clear();
    }

    /// No body comes near another in some substeps, or itself: there is no contact.
    pub(crate) fn rest(&mut self) {
        self.clear_rows();
        self.near.clear();
        self.touching.clear();
        self.counts = ContactCounts {
            detections: self.counts.detections,
            repeated: self.counts.repeated,
            ..ContactCounts::default()
        };
    }

    /// Some substeps were performed, in which this many bodies were apart from all others; `None` if they have to
    /// be performed again, as these were not.
    pub(crate) fn count_apart(&mut self, apart: Option<usize>) {
        self.counts.apart = apart.unwrap_or(0);
        if apart.is_none() {
            self.counts.repeated += 1;
        }
    }

    /// Begins a substep: finds near candidates.
    pub(crate) fn begin(
        &mut self,
        bodies: &[impl Tangible],
        colliders: &[SweptCollider],
        step: &Substep,
        threads: &Threads,
    ) {
        self.h = step.h.into();
        self.register(bodies, colliders);
        self.leave_out(bodies);
        self.predict(bodies, colliders, step);
        self.enclose_or_detect(HORIZON, step.count, threads);
        self.find_tangles(bodies);
        self.begin_rigid(bodies);
        self.find_near(threads);
        self.clear_rows();
        self.make_rigid_rows(bodies);
        self.make_rows_of_pairs(bodies);
        self.make_fixed_rows(bodies, colliders, step);
        self.find_touching();
    }

    /// One pass over the contacts of one kind, after an iteration; those of rigid bodies are solved with
    /// contacts between bodies, whatever their kind.
    pub(crate) fn solve(&mut self, bodies: &mut [impl Tangible], between: Between) {
        // Without contacts, the shape of a rigid body is restored once.
        let restores = between == Between::Bodies && !self.rigids.is_empty();
        let opened = self.near.iter().flat_map(|part| &part.opened);
        let mut kinds = opened.map(|it| self.batches[it.batch].between);
        if self.rows[between as usize].is_empty() && !restores && !kinds.any(|it| it == between) {
            return;
        }
        self.begin_pass(bodies, restores);
        self.pass(bodies, between);
        if restores {
            let Self {
                rows,
                active,
                rigids,
                ..
            } = self;
            self.rigid_rows.solve(rows, active, rigids);
        }
        self.write_back(bodies);
        if restores {
            self.end_pass(bodies);
        }
    }

    /// Copies the positions of the active particles back to the bodies.
    pub(super) fn write_back(&self, bodies: &mut [impl Tangible]) {
        for it in &self.active {
            let Some(body) = bodies.get_mut(it.body as usize) else {
                continue;
            };
            let by = it.now - body.now(it.particle as usize);
            if by != DVec3::ZERO {
                body.shift(it.particle as usize, by);
                body.touch();
            }
        }
    }

    /// Truncates motion that would let surfaces cross, before the last stage of a substep.
    pub(crate) fn truncate(
        &mut self,
        bodies: &mut [impl Tangible],
        step: &Substep,
        threads: &Threads,
    ) {
        for member in &self.members {
            let Owner::Body(body) = member.owner else {
                continue;
            };
            let body = &bodies[body];
            for (&particle, v) in member.surface.vertices.iter().zip(member.vertices()) {
                if member.is_stepped && !member.is_idle {
                    self.ends[v] = body.now(particle as usize);
                }
            }
        }
        self.find_mean_motion();
        self.enclose_or_detect(1.0, step.count, threads);
        self.follow_pairs();
        self.cut(bodies, step.count, threads);
    }

    /// Ends a substep, after the last stage: records which bodies touch, applies restitution, and
    /// adds up forces.
    pub(crate) fn end(&mut self, bodies: &mut [impl Tangible], step: &Substep) {
        self.sort_rows();
        let rows = || self.rows.iter().flatten();
        self.counts.near = self.near.iter().map(|part| part.open.len()).sum();
        self.counts.acting = rows().filter(|row| row.acts()).count();
        if rows().any(ContactRow::may_bounce) {
            self.bounce(bodies, step);
        }
        self.rigid_rows.keep(&self.rows, &self.active);
        let between = &self.rows[Between::Bodies as usize];
        self.sums
            .add(between, self.h, (&self.active, &self.touching));
        self.record(bodies);
    }

    /// Applies restitution.
    fn bounce(&mut self, bodies: &mut [impl Tangible], step: &Substep) {
        for it in &mut self.active {
            if let Some(body) = bodies.get(it.body as usize) {
                it.motion = body.motion(it.particle as usize);
                it.now = body.start(it.particle as usize);
            }
        }
        let h = f64::from(step.h);
        self.begin_bounce(bodies);
        let slowest = 2.0 * step.gravity.as_dvec3().length() * h * h;
        for row in self.rows.iter_mut().flatten() {
            row.bounce(slowest, &mut self.active, &mut self.rigids);
        }
        if !self.rigids.is_empty() {
            let rigid = self.rows.iter_mut().flatten().rev();
            for row in rigid.filter(|row| row.is_rigid()) {
                row.bounce(slowest, &mut self.active, &mut self.rigids);
            }
        }
        let soft = self.active.iter().filter(|it| it.rigid == NO_INDEX);
        for it in soft {
            let Some(body) = bodies.get_mut(it.body as usize) else {
                continue;
            };
            let by = it.motion - body.motion(it.particle as usize);
            if by != DVec3::ZERO {
                body.accelerate(it.particle as usize, by);
            }
        }
        self.end_bounce(bodies);
    }

    /// A part of the displacements in the substep [m]: body, particle, displacement.
    pub(crate) fn part<'a, T: Tangible>(
        &'a self,
        part: ContactPart,
        bodies: &'a [T],
    ) -> impl Iterator<Item = (usize, usize, DVec3)> + use<'a, T> {
        let of_bodies = self.active.iter().filter(|it| it.body != NO_INDEX);
        let particles = of_bodies.map(move |it| {
            (
                it.body as usize,
                it.particle as usize,
                it.parts[part as usize],
            )
        });
        particles.chain(
            self.rigids
                .iter()
                .flat_map(move |it| it.part(part, &bodies[it.body])),
        )
    }

    /// Registers the surfaces with contact, if they have changed.
    fn register(&mut self, bodies: &[impl Tangible], colliders: &[SweptCollider]) {
        let meshes = || {
            let each = colliders.iter().enumerate();
            each.filter_map(|(place, it)| Some((place, it, it.shape.mesh()?)))
        };
        let has_meshes = meshes().next().is_some();
        let of_bodies = || {
            let each = bodies.iter().enumerate();
            let with_contact = each.filter(|(_, body)| {
                body.takes_part() && body.effects().touches_surfaces(has_meshes)
            });
            with_contact.map(|(place, body)| NewMember {
                owner: Owner::Body(place),
                surface: body.topology().surface(),
                params: params(body, has_meshes),
                number: body.number(),
                stitches: Some(body.stitches()),
                is_rigid: body.effects().is_rigid(),
                is_stepped: body.is_stepped(),
                pose: None,
            })
        };
        let of_colliders = || {
            meshes().map(|(place, swept, mesh)| NewMember {
                owner: Owner::Collider(place),
                surface: mesh.surface(),
                params: [None, None, Some(Params::of_collider())],
                number: NO_INDEX,
                stitches: None,
                is_rigid: false,
                is_stepped: swept.moves(),
                pose: Some(swept.from),
            })
        };
        let all = || of_bodies().chain(of_colliders());
        let known = self.members.len() == all().count()
            && self.members.iter().zip(all()).all(|(member, new)| {
                member.owner == new.owner
                    && member.number == new.number
                    && (member.rigid != NO_INDEX) == new.is_rigid
                    && member.is_stepped == new.is_stepped
                    // One that does not move by itself may have been teleported.
                    && (new.is_stepped || member.pose == new.pose)
                    && member.params == new.params
                    && new.stitches.is_none_or(|it| member.stitched.is_current(it))
                    && Arc::ptr_eq(&member.surface, new.surface)
            });
        if known {
            return;
        }
        self.is_valid = false;
        // Its places are those of the bodies before.
        self.touching.clear();
        let before = take(&mut self.members);
        self.rigids.clear();
        let mut first = 0;
        for new in all() {
            let mut rigid = NO_INDEX;
            if let (Owner::Body(body), true) = (new.owner, new.is_rigid) {
                rigid = self.rigids.len() as u32;
                self.rigids.push(Rigid::new(body, self.members.len()));
            }
            self.members.push(Member {
                owner: new.owner,
                number: new.number,
                rigid,
                surface: Arc::clone(new.surface),
                first,
                params: new.params,
                stitched: StitchedVertices::of(new.stitches, new.surface),
                is_stepped: new.is_stepped,
                is_apart: false,
                is_idle: false,
                motion: DAffine3::IDENTITY,
                pose: new.pose,
            });
            first += new.surface.vertices.len();
        }
        self.follow_members(&before);
        self.starts.clear();
        self.starts.resize(first, DVec3::ZERO);
        self.ends.clear();
        self.ends.resize(first, DVec3::ZERO);
        self.inverse_masses.clear();
        self.inverse_masses.resize(first, 0.0);
        self.active.clear();
        self.places.clear();
        self.places.resize(first, NO_INDEX);
        self.may_cross.clear();
        self.may_cross.resize(self.members.len(), true);
        self.teleported.clear();
        self.teleported.resize(self.members.len(), true);
        self.closed.clear();
        self.closed.resize_with(self.members.len(), || None);
        self.cut_into_pieces();
    }

    /// Leaves out the bodies that nothing comes near.
    fn leave_out(&mut self, bodies: &[impl Tangible]) {
        for (number, member) in self.members.iter_mut().enumerate() {
            let Owner::Body(body) = member.owner else {
                continue;
            };
            let is_apart = bodies[body].is_apart();
            if member.is_apart == is_apart {
                continue;
            }
            member.is_apart = is_apart;
            member.is_idle = is_apart && member.params[Between::Itself as usize].is_none();
            for piece in self
                .pieces
                .iter_mut()
                .filter(|piece| piece.member == number)
            {
                piece.is_new = true;
                piece.is_stepped = member.is_stepped && !member.is_idle;
            }
        }
    }

    fn cut_into_pieces(&mut self) {
        self.pieces.clear();
        self.vertices.clear();
        self.bends.clear();
        self.pairs.clear();
        self.batches.clear();
        self.candidates.clear();
        for (place, member) in self.members.iter().enumerate() {
            for (number, patch) in member.surface.patches.iter().enumerate() {
                self.pieces.push(Piece {
                    member: place,
                    patch: number,
                    first: self.vertices.len(),
                    is_stepped: member.is_stepped,
                    half_thickness: member.half_thickness(),
                    is_lost: true,
                    is_new: true,
                    is_renewed: false,
                    origin: DVec3::ZERO,
                    drift: DVec3::ZERO,
                    motion: DVec3::ZERO,
                    common: None,
                    claim: Ball::ORIGIN,
                    slack: 0.0,
                    radius: 0.0,
                    claimed_radius: 0.0,
                    travel: 0.0,
                    farthest: 0.0,
                });
                let vertices = patch.vertices.iter().map(|&v| v + member.first as u32);
                self.vertices.extend(vertices);
            }
        }
        self.bends.resize(self.pieces.len(), Bend::default());
        self.centers.clear();
        self.centers.resize(self.vertices.len(), Vec3A::ZERO);
        self.half_motions.clear();
        self.half_motions.resize(self.vertices.len(), 0.0);
        self.claimed.clear();
        self.claimed.resize(self.vertices.len(), Vec3A::ZERO);
        self.offsets.clear();
        self.offsets.resize(self.vertices.len(), Vec3A::ZERO);
        self.moved.clear();
        self.moved.resize(self.vertices.len(), 0.0);
        let pieces = (0..).zip(&self.pieces);
        let corners = pieces.flat_map(|(number, piece)| {
            let corners = &self.vertices[piece.corners(&self.members)];
            corners.iter().map(move |&vertex| (vertex, number))
        });
        self.corners_of.fill(corners, self.starts.len());
    }

    /// The mean motion of each piece.
    fn find_mean_motion(&mut self) {
        for piece in self.pieces.iter_mut().filter(|piece| piece.is_stepped) {
            let corners = &self.vertices[piece.corners(&self.members)];
            let displacement = |&v: &u32| self.ends[v as usize] - self.starts[v as usize];
            let sum = corners.iter().map(displacement).sum::<DVec3>();
            piece.motion = sum / corners.len() as f64;
        }
    }

    /// Records positions, and predicts motion from velocities and gravity.
    fn predict(&mut self, bodies: &[impl Tangible], colliders: &[SweptCollider], step: &Substep) {
        let h = f64::from(step.h);
        let fall = step.gravity.as_dvec3() * (h * h);
        let flags = self.may_cross.iter_mut().zip(&mut self.teleported);
        for (member, (may_cross, teleported)) in self.members.iter_mut().zip(flags) {
            if member.is_idle || !member.is_stepped && self.is_valid {
                continue;
            }
            let body = match member.owner {
                Owner::Body(body) => &bodies[body],
                Owner::Collider(collider) => {
                    let SweptCollider { from, to, .. } = &colliders[collider];
                    member.motion = to.affine() * from.affine().inverse();
                    let limit = f64::from(TELEPORTED * member.surface.mean_edge);
                    for (rest, v) in member.surface.rest.iter().zip(member.vertices()) {
                        let rest = rest.as_dvec3();
                        let start = from.apply(rest);
                        *teleported |= start.distance_squared(self.ends[v]) > limit * limit;
                        (self.starts[v], self.ends[v]) = (start, to.apply(rest));
                        self.inverse_masses[v] = 0.0;
                    }
                    *may_cross |= *teleported;
                    continue;
                }
            };
            for (&particle, v) in member.surface.vertices.iter().zip(member.vertices()) {
                let particle = particle as usize;
                let start = body.start(particle);
                let weight = body.inverse_mass(particle);
                // Where it was stepped to, up to rounding; anything else may have crossed a
                // surface.
                let stepped = self.starts[v] + body.motion(particle);
                let deviation = (start - stepped).length_squared();
                let limit = f64::from(MOVED * member.half_thickness());
                *may_cross |= deviation > limit * limit;
                self.starts[v] = start;
                (self.inverse_masses[v], self.ends[v]) = if !member.is_stepped || weight == 0.0 {
                    (0.0, start)
                } else {
                    (weight, start + body.motion(particle) + fall)
                };
            }
        }
        for piece in self.pieces.iter_mut().filter(|piece| piece.is_stepped) {
            // Its motion in the previous substep.
            piece.drift += piece.motion;
            piece.common = None;
        }
        self.find_mean_motion();
    }
}

/// What substeps of a tick leave to the next ones.
#[derive(Debug)]
pub(crate) struct TickMemory {
    sums: Sums,
    rows: Vec<Kept>,
    pairs: Vec<RigidPair>,
}

/// A surface with contact in the current substep.
struct NewMember<'a> {
    owner: Owner,
    surface: &'a Arc<Surface>,
    params: [Option<Params>; KINDS],
    number: u32,
    stitches: Option<&'a Stitches>,
    is_rigid: bool,
    is_stepped: bool,
    pose: Option<Pose>,
}

/// The largest part of a body of the distances that it keeps [m], in a world with or without colliders that
/// are meshes.
pub(crate) fn half_thickness(body: &impl Tangible, has_meshes: bool) -> f32 {
    let surface = body.topology().surface();
    let [between, itself, colliders] = params(body, has_meshes);
    let halves = [(between, 0.5), (itself, 0.5), (colliders, 1.0)];
    let halves = halves.into_iter().filter_map(|(params, part)| {
        let thickness = params?.thickness(surface.mean_edge);
        Some(match surface.radii.is_empty() {
            true => part * thickness,
            false => surface.largest_radius,
        })
    });
    halves.fold(0.0, f32::max)
}

/// Parameters of a body by kind of contact, in a world with or without colliders that are meshes.
fn params(body: &impl Tangible, has_meshes: bool) -> [Option<Params>; KINDS] {
    let Effects {
        self_contact,
        collide,
        ..
    } = body.effects();
    let diameter = body.effects().rod_diameter();
    let contact = body.effects().contact_params();
    let collide = collide.filter(|_| has_meshes);
    [
        contact,
        self_contact.map(|it| it.params().or_thickness(diameter)),
        collide.map(|it| Params::with_colliders(&it, contact.as_ref())),
    ]
}
