//! The components that every soft body has.

use crate::{
    mesh::Skin,
    solver::{
        self, Density, EffectStates, Factors, Mass, Particles, Topology, TopologyId, VertexIndex,
        body::set_inverse_masses,
    },
};
use bevy::prelude::*;
use serde::{Deserialize, Serialize};
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
    EffectStates,
    SpawnOrder,
    KnownMesh
)]
pub struct SoftBody(pub Arc<Topology>);

/// Mass per measure: kg/m³ of a solid, kg/m² of a cloth, kg/m of a rope; default 1000.
#[derive(Component, Debug, Clone, Copy, PartialEq, Default, Deref, DerefMut)]
pub struct BodyDensity(pub Density);

/// Vertices that do not move.
#[derive(Component, Debug, Clone, PartialEq, Eq, Default, Deref, DerefMut)]
pub struct Pins(pub Vec<VertexIndex>);

/// Masses on top of the density's, by vertex.
#[derive(Component, Debug, Clone, PartialEq, Default, Deref, DerefMut)]
pub struct AddedMass(pub Vec<(VertexIndex, Mass)>);

/// The state at the start of the last tick, or of the one under way.
#[derive(Component, Debug, Clone, PartialEq, Default, Deref)]
pub struct TickStart(pub(crate) Particles);

/// How long the body has been still.
#[derive(Component, Debug, Clone, Copy, Default)]
pub struct RestTimer(pub(super) solver::rest::RestTimer);

/// The mesh that the body's state is of.
#[derive(Component, Debug, Clone, Copy, Default)]
pub(super) struct KnownMesh(Option<TopologyId>);

/// What a body that carries [`Direct`](crate::effect::Direct) is solved with: it follows from its mesh
/// and its effects.
#[derive(Component, Debug, Clone, Default)]
pub struct DirectFactors(pub(crate) Factors);

/// The place of a body among bodies, of a collider among colliders: the order in which they came.
/// Contacts, figures and hashes go by it, so that nothing depends on how the ECS stores entities
/// or uses their numbers again.
#[derive(
    Component, Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct SpawnOrder(pub(super) u64);

impl SpawnOrder {
    /// The place, from 1.
    #[must_use]
    pub const fn get(self) -> u64 {
        self.0
    }
}

/// The places of all bodies and colliders, so that in a restored state they are called what they
/// were, and those that come later are called what they would have been.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Places {
    /// Of the bodies, in their order.
    pub bodies: Vec<SpawnOrder>,
    /// Of the colliders, in their order.
    pub colliders: Vec<SpawnOrder>,
    /// The last place that was given away.
    pub last: SpawnOrder,
}

/// Everything that a scene spawned; all of it goes with the scene.
#[derive(Component, Debug, Clone, Copy, Default)]
pub struct SceneEntity;

/// The fine surface that follows a body.
#[derive(Component, Debug, Clone, Deref)]
pub struct BodySkin(pub Arc<Skin>);

/// A body that has been put back with its whole state: that its components are new is no change
/// that wakes it. Until its first tick begins.
#[derive(Component, Debug, Clone, Copy)]
pub struct JustRestored;

/// The body has come to rest, and is not stepped until something disturbs it.
#[derive(Component, Debug, Clone, Copy, Default)]
pub struct Asleep;

/// The body turned non-finite, and is paused at its last finite state: where the tick began in which
/// it did, at rest.
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

/// The place that the next body or collider gets.
#[derive(Resource, Debug, Default)]
pub(super) struct NextPlace(pub(super) u64);

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

/// Breaks the stitches to a collider that goes, and gives those to later ones their new numbers.
pub(super) fn forget_collider(
    removed: On<Remove, solver::Collider>,
    colliders: Query<(Entity, &SpawnOrder), With<solver::Collider>>,
    mut stitched: Query<&mut solver::Stitches>,
) {
    let Ok((_, order)) = colliders.get(removed.entity) else {
        return;
    };
    let before = colliders.iter().filter(|(_, other)| *other < order);
    let number = before.count() as u32;
    for mut stitches in &mut stitched {
        stitches.forget_collider(number);
    }
}

/// Gives a new body its number.
pub(super) fn number_body(
    added: On<Add, SoftBody>,
    mut next: ResMut<NextPlace>,
    mut bodies: Query<&mut SpawnOrder>,
) {
    if let Ok(mut order) = bodies.get_mut(added.entity) {
        *order = next.take();
    }
}

/// Gives a body particles in the rest shape of its mesh, unless a new one came with some. One that is given another mesh
/// begins anew; its effects, masses and pins stay. It loses its grab and its stitches, which are to points of the mesh
/// that it had.
pub(super) fn follow_mesh(
    inserted: On<Insert, SoftBody>,
    mut commands: Commands,
    mut bodies: Query<(
        &SoftBody,
        &mut Particles,
        &mut TickStart,
        &mut EffectStates,
        &mut RestTimer,
        &BodyDensity,
        &AddedMass,
        &Pins,
        &mut KnownMesh,
    )>,
) {
    let Ok((body, mut particles, mut start, mut states, mut rest, density, added, pins, mut known)) =
        bodies.get_mut(inserted.entity)
    else {
        return;
    };
    let mesh = Some(body.id());
    if known.0 == mesh {
        return;
    }
    let is_new = known.0.is_none();
    known.0 = mesh;
    if !is_new || particles.len() != body.particles() {
        *particles = Particles::at_rest(body.rest.iter().copied());
    }
    set_inverse_masses(&mut particles.positions, body, density.0, added, pins);
    start.0.clone_from(&particles);
    if !is_new {
        *states = EffectStates::default();
        rest.0.reset();
        commands
            .entity(inserted.entity)
            .remove::<(Asleep, Quarantined, solver::Grab, solver::Stitches)>();
    }
}
