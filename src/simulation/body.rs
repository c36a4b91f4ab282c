//! The components that every soft body has.

use crate::solver::{self, Density, Mass, Particles, Topology, body::set_inverse_masses};
use bevy::{
    ecs::component::{Mutable, StorageType},
    prelude::*,
};
use std::sync::Arc;

/// A soft body: the immutable part, shared with its copies.
#[derive(Component, Debug, Clone, Deref)]
#[require(
    Particles,
    BodyDensity,
    Pins,
    AddedMass,
    TickStart,
    RestTimer,
    SpawnOrder
)]
pub struct SoftBody(pub Arc<Topology>);

impl Component for Particles {
    const STORAGE_TYPE: StorageType = StorageType::Table;
    type Mutability = Mutable;
}

/// Mass per measure: kg/m³ of a solid, kg/m² of a cloth, kg/m of a rope; default 1000.
#[derive(Component, Debug, Clone, Copy, PartialEq, Default, Deref, DerefMut)]
pub struct BodyDensity(pub Density);

/// Particles that do not move.
#[derive(Component, Debug, Clone, PartialEq, Eq, Default, Deref, DerefMut)]
pub struct Pins(pub Vec<u32>);

/// Masses on top of the density's, by particle.
#[derive(Component, Debug, Clone, PartialEq, Default, Deref, DerefMut)]
pub struct AddedMass(pub Vec<(u32, Mass)>);

/// Positions at the start of the last tick, or of the one under way [m]; w is the inverse mass.
#[derive(Component, Debug, Clone, PartialEq, Default, Deref)]
pub struct TickStart(pub(crate) Vec<Vec4>);

/// How long the body has been still.
#[derive(Component, Debug, Clone, Copy, Default)]
pub struct RestTimer(pub(super) solver::rest::RestTimer);

/// The place of a body among bodies, of a collider among colliders: the order in which they came.
/// Contacts, figures and hashes go by it, so that nothing depends on how the ECS stores entities
/// or uses their numbers again.
#[derive(Component, Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct SpawnOrder(u64);

/// The body has come to rest, and is not stepped until something disturbs it.
#[derive(Component, Debug, Clone, Copy, Default)]
pub struct Asleep;

/// The body turned non-finite, and is frozen at its last finite state.
#[derive(Component, Debug, Clone, PartialEq, Eq, Deref)]
pub struct Quarantined(pub solver::Quarantine);

/// A body was put in quarantine.
#[derive(Message, Debug, Clone, PartialEq, Eq)]
pub struct BodyQuarantined {
    /// The body.
    pub body: Entity,
    /// Which body, which particle, which stage, in a sentence.
    pub text: String,
}

/// Bodies that are stepped.
pub type Active = (With<SoftBody>, Without<Asleep>, Without<Quarantined>);

/// A rigid shape that bodies with [`Collide`](crate::effect::Collide) cannot enter.
impl Component for solver::Collider {
    const STORAGE_TYPE: StorageType = StorageType::Table;
    type Mutability = Mutable;
}

/// The place that the next body or collider gets.
#[derive(Resource, Debug, Default)]
pub(super) struct NextPlace(u64);

impl NextPlace {
    fn take(&mut self) -> SpawnOrder {
        self.0 += 1;
        SpawnOrder(self.0)
    }
}

/// Gives a new collider its place.
pub(super) fn complete_collider(
    added: On<Add, solver::Collider>,
    mut next: ResMut<NextPlace>,
    mut commands: Commands,
) {
    commands.entity(added.entity).insert(next.take());
}

/// Gives a new body its number, and particles in its rest shape unless it came with some.
pub(super) fn complete_body(
    added: On<Add, SoftBody>,
    mut next: ResMut<NextPlace>,
    mut bodies: Query<(
        &SoftBody,
        &mut Particles,
        &mut TickStart,
        &mut SpawnOrder,
        &BodyDensity,
        &AddedMass,
        &Pins,
    )>,
) {
    let Ok((body, mut particles, mut start, mut order, density, added_mass, pins)) =
        bodies.get_mut(added.entity)
    else {
        return;
    };
    *order = next.take();
    if particles.len() != body.particles() {
        *particles = Particles::at_rest(body.rest.iter().copied());
    }
    set_inverse_masses(&mut particles.positions, body, density.0, added_mass, pins);
    start.0.clone_from(&particles.positions);
}
