//! Components of every soft body.

use super::{PastStarts, SimulationClock};
use crate::{
    mesh::Skin,
    solver::{
        self, Density, EffectStates, Mass, Particles, Topology, TopologyId, VertexIndex,
        direct::DirectWorkspace, masses::set_inverse_masses,
    },
};
use bevy::{
    ecs::{lifecycle::HookContext, world::DeferredWorld},
    prelude::*,
};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A soft body: its immutable part, shared with its copies.
///
/// ```
/// use bevy::prelude::*;
/// use pliant::prelude::*;
///
/// /// Three cubes of 20 cm above each other.
/// fn spawn(mut commands: Commands) {
///     let cube = SoftBody::cuboid(Vec3::splat(0.2), UVec3::splat(4)); // m
///     for height in 1..4 {
///         let place = Vec3::Y * height as f32; // m
///         commands.spawn((cube.clone().at(place).build(), Stretch::default(), Volume::default()));
///     }
/// }
///
/// let mut app = App::new();
/// app.add_plugins((MinimalPlugins, SoftBodyPlugins::default())).add_systems(Startup, spawn);
/// app.update();
/// assert_eq!(app.world_mut().query::<&SoftBody>().iter(app.world()).count(), 3);
/// ```
#[derive(Component, Debug, Clone, Deref, Reflect)]
#[reflect(opaque)]
#[reflect(Component, Debug, Clone)]
#[component(on_add = needs_plugin)]
#[require(
    Particles,
    BodyDensity,
    Pins,
    AddedMass,
    TickStart,
    PastStarts,
    RestTimer,
    EffectStates,
    SpawnOrder,
    KnownMesh
)]
pub struct SoftBody(pub Arc<Topology>);

/// An entity as messages call it: by its name, or by its number.
pub(crate) fn shown_name(entity: Entity, name: Option<&Name>) -> String {
    name.map_or_else(|| entity.to_string(), |name| format!("“{name}”"))
}

/// Says that bodies are not stepped in an app without the simulation.
fn needs_plugin(world: DeferredWorld, body: HookContext) {
    if !world.contains_resource::<SimulationClock>() {
        log::warn!(
            "nothing steps the soft body {}: add `SoftBodyPlugins` to the app",
            body.entity
        );
    }
}

/// Mass per measure: kg/m³ of a solid, kg/m² of a cloth, kg/m of a rope; default 1000.
///
/// ```
/// use bevy::prelude::*;
/// use pliant::prelude::*;
///
/// let mut app = App::new();
/// app.add_plugins((MinimalPlugins, SoftBodyPlugins::default()));
/// let cloth = SoftBody::cloth(Vec2::ONE, UVec2::splat(10)).build();
/// let cloth = app.world_mut().spawn((cloth, Stretch::default())).id();
/// app.world_mut().entity_mut(cloth).insert(BodyDensity(Density::of(0.2))); // kg/m²
/// ```
#[derive(Component, Debug, Clone, Copy, PartialEq, Default, Deref, DerefMut, Reflect)]
#[reflect(Component, Debug, Default, PartialEq)]
pub struct BodyDensity(pub Density);

/// Pinned vertices.
///
/// ```
/// use bevy::prelude::*;
/// use pliant::prelude::*;
///
/// /// Holds every body at its first vertex, and nowhere else.
/// fn hang(mut bodies: Query<&mut Pins>) {
///     for mut pins in &mut bodies {
///         pins.0 = vec![VertexIndex(0)];
///     }
/// }
/// # bevy::ecs::system::assert_is_system(hang);
/// ```
#[derive(Component, Debug, Clone, PartialEq, Eq, Default, Deref, DerefMut, Reflect)]
#[reflect(Component, Debug, Default, PartialEq)]
pub struct Pins(pub Vec<VertexIndex>);

/// Masses in addition to the density's, by vertex.
#[derive(Component, Debug, Clone, PartialEq, Default, Deref, DerefMut, Reflect)]
#[reflect(Component, Debug, Default, PartialEq)]
pub struct AddedMass(pub Vec<(VertexIndex, Mass)>);

/// The state at the start of the tick under way, or of the last tick.
#[derive(Component, Debug, Clone, PartialEq, Default, Deref)]
pub struct TickStart(pub(crate) Particles);

/// Time for which the body has been at rest.
#[derive(Component, Debug, Clone, Copy, Default)]
pub struct RestTimer(pub(super) solver::rest::RestTimer);

/// The mesh to which the body's state belongs.
#[derive(Component, Debug, Clone, Copy, Default)]
pub(super) struct KnownMesh(Option<TopologyId>);

impl KnownMesh {
    /// The state now belongs to this mesh.
    pub(super) fn follow(&mut self, mesh: TopologyId) {
        self.0 = Some(mesh);
    }
}

/// Workspace of the direct solver, for a body that carries [`Direct`](crate::effect::Direct):
/// derived from its mesh and effects.
#[derive(Component, Debug, Clone, Default)]
pub struct BodyDirectWorkspace(pub(crate) DirectWorkspace);

/// Ordinal of a body or collider, in the order of spawning. Contacts, statistics and hashes use it,
/// so that nothing depends on storage order or reuse of entity indices in the ECS.
#[derive(
    Component, Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct SpawnOrder(pub(super) u64);

impl SpawnOrder {
    /// The ordinal, from 1.
    #[must_use]
    pub const fn get(self) -> u64 {
        self.0
    }
}

/// Spawn orders of all bodies and colliders, so that a restored state and everything spawned later
/// get the same ordinals as in the original run.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct SpawnOrders {
    /// Those of the bodies, in order.
    pub bodies: Vec<SpawnOrder>,
    /// Those of the colliders, in order.
    pub colliders: Vec<SpawnOrder>,
    /// The last ordinal that was assigned.
    pub last: SpawnOrder,
}

/// Marks all entities of a scene, which are despawned with it.
#[derive(Component, Debug, Clone, Copy, Default)]
pub struct SceneEntity;

/// The skin of a body.
#[derive(Component, Debug, Clone, Deref)]
pub struct BodySkin(pub Arc<Skin>);

/// A restored body whose newly added components must not wake it, until its first tick begins.
#[derive(Component, Debug, Clone, Copy)]
pub struct JustRestored;

/// The body is at rest, and is not stepped until something disturbs it.
#[derive(Component, Debug, Clone, Copy, Default)]
pub struct Asleep;

/// The body diverged and is paused at its last finite state: that at the start of the tick in which
/// it diverged, at rest.
#[derive(Component, Debug, Clone, PartialEq, Eq, Deref)]
pub struct Quarantined(pub solver::Quarantine);

/// A body was put in quarantine.
#[derive(Message, Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct BodyQuarantined {
    /// The body.
    pub body: Entity,
    /// Message with body, vertex and stage, in a sentence.
    pub text: String,
}

/// Filter for bodies that are stepped.
pub type Active = (With<SoftBody>, Without<Asleep>, Without<Quarantined>);

/// The ordinal of the next body or collider.
#[derive(Resource, Debug, Default)]
pub(super) struct NextPlace(pub(super) u64);

impl NextPlace {
    fn take(&mut self) -> SpawnOrder {
        self.0 += 1;
        SpawnOrder(self.0)
    }
}

/// Assigns an ordinal to a new collider.
pub(super) fn complete_collider(
    added: On<Add, solver::Collider>,
    mut next: ResMut<NextPlace>,
    mut commands: Commands,
) {
    commands.entity(added.entity).insert(next.take());
}

/// Breaks the stitches to a removed collider, and renumbers stitches to later ones.
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

/// Breaks the stitches of others to a removed body, wakes these, and renumbers stitches to later
/// bodies.
pub(super) fn forget_body(
    removed: On<Remove, SoftBody>,
    bodies: Query<(Entity, &SpawnOrder), With<SoftBody>>,
    mut stitched: Query<(Entity, &mut solver::Stitches)>,
) {
    let Ok((_, order)) = bodies.get(removed.entity) else {
        return;
    };
    // Its own are needed as they are to wake what they hold.
    let mut number = None;
    for (entity, mut stitches) in &mut stitched {
        if entity == removed.entity || !has_joints(&stitches) {
            continue;
        }
        let before = || bodies.iter().filter(|(_, other)| *other < order).count() as u32;
        let number = *number.get_or_insert_with(before);
        if stitches.bypass_change_detection().forget_body(number) {
            stitches.set_changed();
        }
    }
}

/// Tells copies of a removed body that it is gone, and copies of later bodies their number.
pub(super) fn forget_source(
    removed: On<Remove, SoftBody>,
    bodies: Query<&SpawnOrder, With<SoftBody>>,
    mut copies: Query<&mut Particles, With<SoftBody>>,
) {
    let Ok(order) = bodies.get(removed.entity) else {
        return;
    };
    if copies.iter().all(|it| it.emission.source().is_none()) {
        return;
    }
    let number = bodies.iter().filter(|other| *other < order).count() as u32;
    for mut copy in &mut copies {
        copy.bypass_change_detection().emission.forget_body(number);
    }
}

/// Wakes the bodies to which removed stitches led.
pub(super) fn release_joined(
    removed: On<Remove, solver::Stitches>,
    stitched: Query<&solver::Stitches>,
    bodies: Query<(&SpawnOrder, Entity), With<SoftBody>>,
    mut commands: Commands,
) {
    let Ok(stitches) = stitched.get(removed.entity) else {
        return;
    };
    let numbers: Vec<_> = stitches
        .intact_joints()
        .map(|(_, number, _)| number)
        .collect();
    if numbers.is_empty() {
        return;
    }
    let mut bodies: Vec<_> = bodies.iter().collect();
    bodies.sort_unstable();
    for number in numbers {
        if let Some((_, other)) = bodies.get(number as usize)
            && let Ok(mut other) = commands.get_entity(*other)
        {
            other
                .try_remove::<Asleep>()
                .try_insert(RestTimer::default());
        }
    }
}

fn has_joints(stitches: &solver::Stitches) -> bool {
    let mut all = stitches.all().iter();
    all.any(|stitch| matches!(stitch.to, solver::StitchEnd::Body { .. }))
}

/// Changes the stitches of other bodies to `body`, given its number. Those for which `change` returns
/// true wake.
pub(super) fn follow_joints(
    world: &mut World,
    body: Entity,
    change: impl Fn(&mut solver::Stitches, u32) -> bool,
) {
    let mut stitched = world.query::<&mut solver::Stitches>();
    if !stitched.iter(world).any(has_joints) {
        return;
    }
    let mut bodies = super::plain::bodies_in_order(world).into_iter();
    let Some(number) = bodies.position(|it| it == body) else {
        return;
    };
    for mut stitches in stitched.iter_mut(world) {
        if change(stitches.bypass_change_detection(), number as u32) {
            stitches.set_changed();
        }
    }
}

/// Assigns an ordinal to a new body.
pub(super) fn number_body(
    added: On<Add, SoftBody>,
    mut next: ResMut<NextPlace>,
    mut bodies: Query<&mut SpawnOrder>,
) {
    if let Ok(mut order) = bodies.get_mut(added.entity) {
        *order = next.take();
    }
}

/// Initializes the particles of a body in the rest shape of its mesh, unless a new one came with
/// particles. Replacing the mesh resets the state; effects, masses and pins stay. Grab and stitches
/// are removed, and stitches of other bodies to it break, as they refer to points of the previous
/// mesh.
pub(super) fn follow_mesh(
    inserted: On<Insert, SoftBody>,
    mut commands: Commands,
    mut bodies: Query<(
        &SoftBody,
        &mut Particles,
        (&mut TickStart, &mut PastStarts),
        &mut EffectStates,
        &mut RestTimer,
        &BodyDensity,
        &AddedMass,
        &Pins,
        &mut KnownMesh,
    )>,
) {
    let Ok((body, mut particles, starts, mut states, mut rest, density, added, pins, mut known)) =
        bodies.get_mut(inserted.entity)
    else {
        return;
    };
    let (mut start, mut past) = starts;
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
        *past = PastStarts::default();
        *states = EffectStates::default();
        rest.0.reset();
        let entity = inserted.entity;
        commands
            .entity(entity)
            .remove::<(Asleep, Quarantined, solver::Grab, solver::Stitches)>();
        commands.queue(move |world: &mut World| {
            follow_joints(world, entity, solver::Stitches::break_joints);
        });
    }
}
