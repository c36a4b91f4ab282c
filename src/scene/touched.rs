//! What touched in a run, and with which forces.

use crate::simulation::{BodyContacts, ContactSurface, plain};
use bevy::prelude::*;
use std::collections::BTreeMap;

/// Two bodies that touched in a run.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PairOfRun {
    /// Names of the bodies, in the order of the scene.
    pub bodies: [String; 2],
    /// Time of the ticks in which they touched [s].
    pub seconds: f64,
    /// Mean magnitude of the force between them in these ticks, with the impulses of restitution [N].
    pub mean_force: f64,
    /// Largest magnitude of the force between them, as the mean over a tick [N].
    pub largest_force: f64,
}

/// A body that touched a collider or the ground in a run.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SurfaceOfRun {
    /// Name of the body.
    pub body: String,
    /// Number of the collider, from 1 as in scene files; `None` for the ground.
    pub collider: Option<usize>,
    /// Time of the ticks in which it touched [s].
    pub seconds: f64,
    /// Mean magnitude of the force on the body in these ticks, with the impulses of restitution [N].
    pub mean_force: f64,
    /// Largest magnitude of the force on the body, as the mean over a tick [N].
    pub largest_force: f64,
}

/// Forces of something that touched, over the ticks in which it did.
#[derive(Debug, Clone, Copy, Default)]
struct Forces {
    ticks: u32,
    sum: f64,
    largest: f64,
}

impl Forces {
    fn add(&mut self, force: Vec3) {
        let force = f64::from(force.length());
        self.ticks += 1;
        self.sum += force;
        self.largest = self.largest.max(force);
    }

    fn mean(&self) -> f64 {
        self.sum / f64::from(self.ticks)
    }

    fn seconds(&self, tick_seconds: f64) -> f64 {
        f64::from(self.ticks) * tick_seconds
    }
}

/// Contacts of one kind so far, in the order in which they first happened.
#[derive(Debug)]
struct Sums<K, N> {
    all: Vec<(N, Forces)>,
    places: BTreeMap<K, usize>,
}

impl<K, N> Default for Sums<K, N> {
    fn default() -> Self {
        Self {
            all: Vec::new(),
            places: BTreeMap::new(),
        }
    }
}

impl<K: Ord, N> Sums<K, N> {
    /// Adds the force of a tick; `name` names what touched, when it first does.
    fn add(&mut self, key: K, force: Vec3, name: impl FnOnce() -> N) {
        let all = &mut self.all;
        let place = *self.places.entry(key).or_insert_with(|| {
            all.push((name(), Forces::default()));
            all.len() - 1
        });
        self.all[place].1.add(force);
    }
}

/// What has touched in a run so far.
#[derive(Debug, Default)]
pub(super) struct Touched {
    pairs: Sums<[Entity; 2], [String; 2]>,
    surfaces: Sums<(Entity, ContactSurface), (String, Option<usize>)>,
}

impl Touched {
    /// Adds the contacts of a tick.
    pub fn add(&mut self, world: &mut World) {
        // Empty in most ticks of most scenes, and unless contacts are recorded.
        let mut colliders = Vec::new();
        if world.resource::<BodyContacts>().surfaces().next().is_some() {
            colliders = plain::colliders_in_order(world);
        }
        let name = |body| {
            let name = world.get::<Name>(body);
            name.map_or_else(String::new, ToString::to_string)
        };
        let contacts = world.resource::<BodyContacts>();
        for pair in contacts.pairs() {
            let names = || pair.bodies.map(name);
            self.pairs.add(pair.bodies, pair.force, names);
        }
        for it in contacts.surfaces() {
            let number = match it.surface {
                ContactSurface::Ground => None,
                ContactSurface::Collider(entity) => {
                    // One that is gone since the substeps has no number.
                    let Some(place) = colliders.iter().position(|it| *it == entity) else {
                        continue;
                    };
                    Some(place + 1)
                }
            };
            let names = || (name(it.body), number);
            self.surfaces.add((it.body, it.surface), it.force, names);
        }
    }

    /// The bodies that touched each other, and those that touched a collider or the ground.
    pub fn finish(self, tick_seconds: f64) -> (Vec<PairOfRun>, Vec<SurfaceOfRun>) {
        let pairs = self
            .pairs
            .all
            .into_iter()
            .map(|(bodies, forces)| PairOfRun {
                bodies,
                seconds: forces.seconds(tick_seconds),
                mean_force: forces.mean(),
                largest_force: forces.largest,
            });
        let surfaces = self.surfaces.all.into_iter();
        let surfaces = surfaces.map(|((body, collider), forces)| SurfaceOfRun {
            body,
            collider,
            seconds: forces.seconds(tick_seconds),
            mean_force: forces.mean(),
            largest_force: forces.largest,
        });
        (pairs.collect(), surfaces.collect())
    }
}
