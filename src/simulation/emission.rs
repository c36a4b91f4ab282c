//! Bodies that appear and disappear between ticks: copies from emitters of bodies, and bodies in a sink.

use super::{
    AddedMass, Asleep, BodyContacts, BodyDensity, BodySkin, BodySleep, EnergyLedger, RestTimer,
    SceneEntity, SoftBody, SpawnOrder,
    carried::{Carried, CarriedItem},
    plain,
    step::UnderWay,
};
use crate::effect::EffectRegistry;
use crate::solver::{
    BodyEmitter, Contact, Effects, Emission, Particles, Sink, Stitches, Topology,
    emission::{self, Placed, Present, Template, around, meet},
    topology::Birth,
};
use bevy::{ecs::entity_disabling::Disabled, prelude::*};
use glam::DVec3;
use std::sync::Arc;

/// A copy of a body has left its [`BodyEmitter`]. Both a message and an event for observers, at the end
/// of the tick, after all copies of a source were spawned.
///
/// The copy has the name of the body with a number, its skin, its built-in effects, and those of an app
/// that are [saved](crate::effect::EffectPlugin::saved); an app adds other components.
#[derive(Message, Event, Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct BodyEmitted {
    /// The body with the emitter.
    pub source: Entity,
    /// The copy.
    pub body: Entity,
}

/// Run condition: an effect of a body adds or removes bodies.
pub(super) fn changes_bodies(changing: Query<(), Or<(With<BodyEmitter>, With<Sink>)>>) -> bool {
    !changing.is_empty()
}

/// What is read of all bodies.
type Read = (
    Entity,
    &'static SpawnOrder,
    &'static SoftBody,
    &'static mut Particles,
    Carried,
);

/// A body of the ECS.
struct Emitting<'w, 's> {
    entity: Entity,
    body: &'w SoftBody,
    particles: Mut<'w, Particles>,
    carried: CarriedItem<'w, 's>,
}

impl Placed for Emitting<'_, '_> {
    fn effects(&self) -> Effects {
        self.carried.effects()
    }

    fn topology(&self) -> &Topology {
        self.body
    }

    fn at(&self, particle: usize) -> DVec3 {
        self.particles.position(particle)
    }
}

impl Present for Emitting<'_, '_> {
    fn emission(&self) -> &Emission {
        &self.particles.emission
    }

    fn emission_mut(&mut self) -> &mut Emission {
        &mut self.particles.bypass_change_detection().emission
    }
}

/// Calls a function with all bodies in order.
fn with_bodies<T>(
    world: &mut World,
    query: &mut QueryState<Read>,
    call: impl FnOnce(&mut [Emitting]) -> T,
) -> T {
    let mut bodies: Vec<_> = query.iter_mut(world).collect();
    bodies.sort_unstable_by_key(|(_, order, ..)| **order);
    let bodies = bodies.into_iter();
    let bodies = bodies.map(|(entity, _, body, particles, carried)| Emitting {
        entity,
        body,
        particles,
        carried,
    });
    call(&mut bodies.collect::<Vec<_>>())
}

/// Adds and removes bodies at the end of a tick.
pub(super) fn emit(world: &mut World, query: &mut QueryState<Read>) {
    let settings = *world.resource::<UnderWay>().settings();
    let gone: Vec<Entity> = with_bodies(world, query, |bodies| {
        let gone = emission::gone(bodies, &settings).into_iter();
        gone.map(|number| bodies[number as usize].entity).collect()
    });
    let mut changes = !gone.is_empty();
    for body in gone.into_iter().rev() {
        world.despawn(body);
    }
    let mut emitted = Vec::new();
    let mut next = 0;
    // Copies of one source are in the way of those of the next.
    while let Some((number, source, births)) = with_bodies(world, query, |bodies| {
        (next..bodies.len()).find_map(|number| {
            let births = emission::births(bodies, number, &settings);
            (!births.is_empty()).then(|| (number, bodies[number].entity, births))
        })
    }) {
        next = number + 1;
        changes = true;
        let copies = spawn(world, (number as u32, source), &births);
        emitted.extend(copies.into_iter().map(|body| BodyEmitted { source, body }));
    }
    if changes {
        world.resource_mut::<BodyContacts>().invalidate();
        world.resource_mut::<EnergyLedger>().changes_bodies();
    }
    for message in emitted {
        world.trigger(message);
        world.flush();
        world.write_message(message);
    }
}

/// Spawns the copies of a body.
fn spawn(world: &mut World, (number, source): (u32, Entity), births: &[Birth]) -> Vec<Entity> {
    let given = world.entity(source);
    let (Some(body), Some(particles)) = (given.get::<SoftBody>(), given.get::<Particles>()) else {
        return Vec::new();
    };
    let none = Stitches::default();
    let template = Template {
        name: given.get::<Name>().map_or("", Name::as_str),
        topology: &body.0,
        density: given
            .get::<BodyDensity>()
            .map_or_else(Default::default, |it| it.0),
        added_mass: given.get::<AddedMass>().map_or(&[], |it| &it.0),
        stitches: given.get::<Stitches>().unwrap_or(&none),
        effects: plain::effects(given),
        sleep: given.get::<BodySleep>().map(|it| it.0),
    };
    let flow = particles.emission.copies;
    let copies: Vec<_> = template.copies(number, &flow, births).collect();
    let skin = given.get::<BodySkin>().map(|skin| Arc::clone(&skin.0));
    let is_of_scene = given.contains::<SceneEntity>();
    let own = world
        .get_resource::<EffectRegistry>()
        .map(EffectRegistry::own);
    let own = own.map_or_else(Vec::new, |own| own.of_entity(&given));
    let spawned = copies.iter().map(|copy| {
        let body = plain::spawn_body(world, copy);
        let mut entity = world.entity_mut(body);
        plain::insert(&mut entity, skin.clone().map(BodySkin));
        plain::insert(&mut entity, is_of_scene.then_some(SceneEntity));
        own.iter().for_each(|effect| effect.insert(&mut entity));
        body
    });
    spawned.collect()
}

/// A body of the ECS that nothing changes.
struct Resting<'w, 's>(&'w SoftBody, &'w Particles, CarriedItem<'w, 's>);

impl Placed for Resting<'_, '_> {
    fn effects(&self) -> Effects {
        self.2.effects()
    }

    fn topology(&self) -> &Topology {
        self.0
    }

    fn at(&self, particle: usize) -> DVec3 {
        self.1.position(particle)
    }
}

/// Wakes the bodies that rested on a removed one.
pub(super) fn wake_above(
    removed: On<Remove, SoftBody>,
    bodies: Query<(&SoftBody, &Particles, Carried)>,
    sleepers: Sleepers,
    commands: Commands,
) {
    let gone = removed.entity;
    wake_those_on(gone, bodies.get(gone).ok(), sleepers, commands);
}

/// Wakes the bodies that rested on one that is about to lose its contact.
pub(super) fn wake_above_untouchable(
    removed: On<Remove, Contact>,
    bodies: Query<(&SoftBody, &Particles, Carried)>,
    sleepers: Sleepers,
    commands: Commands,
) {
    let gone = removed.entity;
    wake_those_on(gone, bodies.get(gone).ok(), sleepers, commands);
}

/// Wakes the bodies that rested on one that is disabled.
pub(super) fn wake_above_disabled(
    added: On<Add, Disabled>,
    bodies: Query<(&SoftBody, &Particles, Carried), With<Disabled>>,
    sleepers: Sleepers,
    commands: Commands,
) {
    let gone = added.entity;
    wake_those_on(gone, bodies.get(gone).ok(), sleepers, commands);
}

type Sleepers<'w, 's> =
    Query<'w, 's, (Entity, &'static SoftBody, &'static Particles, Carried), With<Asleep>>;

/// Wakes the bodies whose boxes meet that of another.
fn wake_those_on<'w, 's>(
    gone: Entity,
    body: Option<(&'w SoftBody, &'w Particles, CarriedItem<'w, 's>)>,
    sleepers: Sleepers,
    mut commands: Commands,
) {
    if sleepers.is_empty() {
        return;
    }
    let left =
        body.and_then(|(body, particles, carried)| around(&Resting(body, particles, carried)));
    let Some(left) = left else {
        return;
    };
    for (entity, body, particles, carried) in &sleepers {
        let own = around(&Resting(body, particles, carried));
        if entity != gone
            && own.is_some_and(|own| meet(own, left))
            && let Ok(mut entity) = commands.get_entity(entity)
        {
            entity
                .try_remove::<Asleep>()
                .try_insert(RestTimer::default());
        }
    }
}
