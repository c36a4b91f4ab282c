//! Contacts of bodies in a tick, for apps: forces, pairs, and what touched colliders and the ground.

use super::{BodyPair, SpawnOrder, SurfaceContact};
use crate::solver::{ContactCounts, tick::Tick};
use bevy::{ecs::entity::EntityHashSet, prelude::*};
use std::collections::BTreeMap;

/// Contacts between bodies, and forces of colliders and the ground.
#[derive(Resource, Debug, Default)]
pub struct BodyContacts {
    pub(super) tick: Tick,
    /// All bodies by their numbers in the tick.
    pub(super) bodies: Vec<(SpawnOrder, Entity)>,
    touching: Vec<[Entity; 2]>,
    /// Pairs that touched in the tick so far, with sums of their forces over these substeps.
    pairs: BTreeMap<[SpawnOrder; 2], BodyPair>,
    substeps: u32,
    /// The colliders of the tick, by their numbers, and what bodies touched that are no bodies; empty
    /// unless contacts are recorded.
    pub(super) colliders: Vec<Entity>,
    pub(super) surfaces: Vec<SurfaceContact>,
    /// The bodies that slept throughout the last tick: they were not stepped, and touch what they touched.
    pub(super) slept: EntityHashSet,
}

/// A contact that pushes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct BodyContact {
    /// The bodies, equal for a contact of a body with itself; `None` for a collider.
    pub bodies: [Option<Entity>; 2],
    /// The middle of the gap [m].
    pub point: Vec3,
    /// Direction of the force on the first one, a unit vector.
    pub normal: Vec3,
    /// Normal force, not negative [N].
    pub normal_force: f32,
    /// Friction force on the first one, perpendicular to the normal [N].
    pub friction: Vec3,
}

impl BodyContacts {
    /// Bodies were added or removed.
    pub(super) fn invalidate(&mut self) {
        self.tick.invalidate();
    }

    /// Begins a tick.
    pub(super) fn begin_tick(&mut self) {
        self.pairs.clear();
        self.surfaces.clear();
        self.substeps = 0;
    }

    /// Adds what touched since the last call.
    pub(super) fn collect(&mut self) {
        let Self {
            tick,
            bodies,
            touching,
            pairs,
            substeps,
            ..
        } = self;
        let body = |place: u32| bodies[place_of(tick, place)];
        touching.clear();
        let now = tick.contacts.touching().iter();
        touching.extend(now.map(|pair| pair.map(|place| body(place).1)));
        let mut new = Vec::new();
        *substeps += tick.contacts.take_pairs(|pair| new.push(pair));
        for pair in new {
            let both = pair.bodies.map(|place| bodies[place_of(tick, place)]);
            let sum = pairs.entry(both.map(|it| it.0)).or_insert(BodyPair {
                bodies: both.map(|it| it.1),
                force: Vec3::ZERO,
                normal_force: 0.0,
            });
            sum.force += pair.force.as_vec3();
            sum.normal_force += pair.normal_force as f32;
        }
    }

    fn entity(&self, place: u32) -> Entity {
        self.bodies[place_of(&self.tick, place)].1
    }

    /// Contact counts of the last substep.
    #[must_use]
    pub fn counts(&self) -> ContactCounts {
        self.tick.contacts.counts()
    }

    /// Smallest distance of two surfaces in contact at the start of the last substep [m]; `None`
    /// without a pair near enough for a constraint.
    #[must_use]
    pub fn smallest_gap(&self) -> Option<f64> {
        self.tick.contacts.smallest_gap()
    }

    /// The contacts that pushed in the last substep, with their forces.
    pub fn forces(&self) -> impl Iterator<Item = BodyContact> {
        self.tick.contacts.forces().map(|it| BodyContact {
            bodies: it.bodies.map(|place| Some(self.entity(place?))),
            point: it.point.as_vec3(),
            normal: it.normal.as_vec3(),
            normal_force: it.normal_force as f32,
            friction: it.friction.as_vec3(),
        })
    }

    /// Forces of the contacts that pushed in the last substep on particles: body, particle, and
    /// magnitude [N]. A contact acts on up to four particles, by the weights of its points.
    pub fn particle_forces(&self) -> impl Iterator<Item = (Entity, usize, f64)> {
        let forces = self.tick.contacts.particle_forces();
        forces.map(|(place, particle, force)| (self.entity(place), particle as usize, force))
    }

    /// Pairs of bodies that touched at the start of the last substep, without duplicates.
    #[must_use]
    pub fn touching(&self) -> &[[Entity; 2]] {
        &self.touching
    }

    /// The pairs of bodies that touched in the last tick, with the force between them. There are none
    /// in a tick in which all bodies sleep. Contacts of a body with itself are not among them; those
    /// with colliders and the ground are in [`surfaces`](Self::surfaces).
    pub fn pairs(&self) -> impl Iterator<Item = BodyPair> {
        let part = 1.0 / self.substeps.max(1) as f32;
        self.pairs.values().map(move |pair| BodyPair {
            force: pair.force * part,
            normal_force: pair.normal_force * part,
            ..*pair
        })
    }

    /// The colliders and grounds that bodies touched in the last tick, with their forces, while
    /// [`RecordContacts`](super::RecordContacts) is on: sorted by body in spawn order, then the ground
    /// before colliders in spawn order. There are none of bodies that sleep, and none between the
    /// substeps of a tick.
    pub fn surfaces(&self) -> impl Iterator<Item = SurfaceContact> {
        self.surfaces.iter().copied()
    }
}

/// Number of the body at a place in the contacts.
fn place_of(tick: &Tick, place: u32) -> usize {
    tick.number(place) as usize
}
