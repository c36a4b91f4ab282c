//! Conversion between the ECS and the solver's plain world, without Bevy.
//!
//! The plain world is the bit-exact reference for the ECS, and a copy for continuing a state
//! elsewhere.

pub use super::carried::{CARRIED, controls, effects};

use super::{
    AddedMass, Asleep, BodyDensity, BodySleep, JustRestored, Pins, Quarantined, RestTimer,
    SimulationClock, SimulationSettings, SoftBody, SolverThreads, SpawnOrder, SpawnOrders,
    TickStart,
    body::NextPlace,
    carried::{insert_effects, set_controls},
    step::Sleep,
};
use crate::solver::{self, Body, Collider, EffectStates, Particles, Stitches};
use bevy::prelude::*;
use std::sync::Arc;

/// A copy of a body; `None` if the entity is not one.
#[must_use]
pub fn body(entity: EntityRef) -> Option<Body> {
    let topology = &entity.get::<SoftBody>()?.0;
    let name = entity.get::<Name>().map_or("", Name::as_str);
    let density = entity.get::<BodyDensity>()?.0;
    Some(Body {
        particles: entity.get::<Particles>()?.clone(),
        added_mass: entity.get::<AddedMass>()?.0.clone(),
        pins: entity.get::<Pins>()?.0.clone(),
        effects: effects(entity),
        controls: Some(controls(entity))
            .filter(|it| !it.is_empty())
            .map(Box::new),
        stitches: entity.get::<Stitches>().cloned().unwrap_or_default(),
        rest: entity.get::<RestTimer>()?.0,
        sleep: entity.get::<BodySleep>().map(|it| it.0),
        asleep: entity.contains::<Asleep>(),
        quarantine: entity.get::<Quarantined>().map(|q| q.0.clone()),
        tick_start: entity.get::<TickStart>()?.0.clone(),
        ..Body::new(name, Arc::clone(topology), density)
    })
}

/// Copies of all colliders, in order.
#[must_use]
pub fn colliders(world: &mut World) -> Vec<Collider> {
    let entities = colliders_in_order(world).into_iter();
    entities
        .filter_map(|entity| world.get::<Collider>(entity).cloned())
        .collect()
}

/// Entities of all bodies, in order.
#[must_use]
pub fn bodies_in_order(world: &mut World) -> Vec<Entity> {
    let mut bodies: Vec<_> = world
        .query_filtered::<(&SpawnOrder, Entity), With<SoftBody>>()
        .iter(world)
        .collect();
    bodies.sort_unstable();
    bodies.into_iter().map(|(_, entity)| entity).collect()
}

/// Entities of all bodies but those that an emitter made, in order: these come and go by themselves.
#[must_use]
pub fn lasting_bodies(world: &mut World) -> Vec<Entity> {
    let mut bodies = bodies_in_order(world);
    bodies.retain(|body| {
        let particles = world.get::<Particles>(*body);
        particles.is_none_or(|it| it.emission.source().is_none())
    });
    bodies
}

/// Entities of all colliders, in order.
#[must_use]
pub fn colliders_in_order(world: &mut World) -> Vec<Entity> {
    let mut colliders: Vec<_> = world
        .query_filtered::<(&SpawnOrder, Entity), With<Collider>>()
        .iter(world)
        .collect();
    colliders.sort_unstable();
    colliders.into_iter().map(|(_, entity)| entity).collect()
}

/// A copy of the whole state, to be stepped without Bevy.
#[must_use]
pub fn capture(world: &mut World) -> solver::World {
    let colliders = colliders(world);
    let bodies = bodies_in_order(world)
        .into_iter()
        .filter_map(|entity| body(world.entity(entity)))
        .collect();
    let clock = world.resource::<SimulationClock>();
    solver::World {
        settings: **world.resource::<SimulationSettings>(),
        sleep: world.resource::<Sleep>().0,
        bodies,
        colliders,
        time: clock.time,
        tick: clock.tick,
        threads: world.resource::<SolverThreads>().0.clone(),
        ..solver::World::default()
    }
}

/// Spawns the bodies and colliders of a plain world, and sets settings and time. Returns the
/// entities of the bodies and those of the colliders, in order.
pub fn spawn(world: &mut World, plain: &solver::World) -> (Vec<Entity>, Vec<Entity>) {
    world.insert_resource(SimulationSettings(plain.settings));
    world.insert_resource(Sleep(plain.sleep));
    let mut clock = world.resource_mut::<SimulationClock>();
    clock.restart();
    clock.time = plain.time;
    clock.tick = plain.tick;
    let bodies = plain
        .bodies
        .iter()
        .map(|body| spawn_body(world, body))
        .collect();
    let colliders = plain
        .colliders
        .iter()
        .map(|collider| world.spawn(collider.clone()).id())
        .collect();
    (bodies, colliders)
}

/// Spawn orders of all bodies and colliders.
#[must_use]
pub fn places(world: &mut World) -> SpawnOrders {
    let (bodies, colliders) = (bodies_in_order(world), colliders_in_order(world));
    let place = |entity: Entity| world.get::<SpawnOrder>(entity).copied();
    SpawnOrders {
        bodies: bodies.into_iter().filter_map(place).collect(),
        colliders: colliders.into_iter().filter_map(place).collect(),
        last: SpawnOrder(world.resource::<NextPlace>().0),
    }
}

/// Like [`spawn`], but bit-exact: a captured state continues as if it had not been interrupted.
/// Sleeping bodies stay asleep, bodies and colliders keep their spawn orders.
pub fn restore(
    world: &mut World,
    plain: &solver::World,
    places: &SpawnOrders,
) -> (Vec<Entity>, Vec<Entity>) {
    let (bodies, colliders) = spawn(world, plain);
    for ((&entity, body), &place) in bodies.iter().zip(&plain.bodies).zip(&places.bodies) {
        world.entity_mut(entity).insert((
            place,
            body.particles.clone(),
            EffectStates::resumed(&body.effects, &body.topology, &body.particles),
            TickStart(body.tick_start.clone()),
            JustRestored,
        ));
    }
    for (&entity, &place) in colliders.iter().zip(&places.colliders) {
        world.entity_mut(entity).insert(place);
    }
    world.resource_mut::<NextPlace>().0 = places.last.0;
    (bodies, colliders)
}

/// Restarts the spawn orders from 1 if neither a body nor a collider is left, so that a restarted
/// scene is identical to a new one.
pub fn begin_places_anew(world: &mut World) {
    let any = world.query::<&SpawnOrder>().iter(world).next().is_some();
    if !any {
        world.resource_mut::<NextPlace>().0 = 0;
    }
}

/// Spawns one body with all its effects.
pub fn spawn_body(world: &mut World, body: &Body) -> Entity {
    let mut entity = world.spawn((
        Name::new(body.name.clone()),
        body.particles.clone(),
        BodyDensity(body.density),
        AddedMass(body.added_mass.clone()),
        Pins(body.pins.clone()),
        RestTimer(body.rest),
        SoftBody(Arc::clone(&body.topology)),
    ));
    insert_effects(&mut entity, &body.effects);
    if let Some(controls) = &body.controls {
        set_controls(&mut entity, controls);
    }
    insert(
        &mut entity,
        (!body.stitches.is_empty()).then(|| body.stitches.clone()),
    );
    insert(&mut entity, body.sleep.map(BodySleep));
    insert(&mut entity, body.asleep.then_some(Asleep));
    insert(&mut entity, body.quarantine.clone().map(Quarantined));
    entity.id()
}

/// Inserts a component, if there is one.
pub(super) fn insert(entity: &mut EntityWorldMut, component: Option<impl Component>) {
    if let Some(component) = component {
        entity.insert(component);
    }
}
