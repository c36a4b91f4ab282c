//! Bodies that appear and disappear between ticks: copies from emitters of bodies, and bodies in a sink.

use super::{
    BodySkin, SceneEntity, SoftBody, SpawnOrder,
    carried::{Carried, CarriedItem},
    plain,
    step::UnderWay,
};
use crate::solver::{
    BodyEmitter, Effects, Emission, Particles, Sink, Topology,
    emission::{self, Present, Template},
};
use bevy::prelude::*;
use glam::DVec3;

/// A copy of a body has left its [`BodyEmitter`]. Both a message and an event for observers.
///
/// The copy has the name of the body with a number, its skin and its built-in effects; an app adds its
/// own components.
#[derive(Message, Event, Debug, Clone, Copy, PartialEq, Eq)]
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

/// A body of the ECS.
struct Emitting<'w, 's> {
    entity: Entity,
    body: &'w SoftBody,
    particles: Mut<'w, Particles>,
    carried: CarriedItem<'w, 's>,
}

impl Present for Emitting<'_, '_> {
    fn effects(&self) -> Effects {
        self.carried.effects()
    }

    fn topology(&self) -> &Topology {
        self.body
    }

    fn emission(&self) -> &Emission {
        &self.particles.emission
    }

    fn emission_mut(&mut self) -> &mut Emission {
        &mut self.particles.bypass_change_detection().emission
    }

    fn at(&self, particle: usize) -> DVec3 {
        self.particles.position(particle)
    }
}

/// Calls a function with all bodies in order.
fn with_bodies<T>(world: &mut World, call: impl FnOnce(&mut [Emitting]) -> T) -> T {
    let mut query = world.query::<(Entity, &SpawnOrder, &SoftBody, &mut Particles, Carried)>();
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
pub(super) fn emit(world: &mut World) {
    let settings = *world.resource::<UnderWay>().settings();
    let gone: Vec<Entity> = with_bodies(world, |bodies| {
        let gone = emission::gone(bodies, &settings).into_iter();
        gone.map(|number| bodies[number as usize].entity).collect()
    });
    for body in gone.into_iter().rev() {
        world.despawn(body);
    }
    for (number, source) in (0..).zip(plain::bodies_in_order(world)) {
        if world.get::<BodyEmitter>(source).is_none() {
            continue;
        }
        let births = with_bodies(world, |bodies| {
            emission::births(bodies, number as usize, &settings)
        });
        if births.is_empty() {
            continue;
        }
        let Some(template) = plain::body(world.entity(source)) else {
            continue;
        };
        let emitted = template.particles.emission.emitted();
        let template = Template {
            name: &template.name,
            topology: &template.topology,
            density: template.density,
            added_mass: &template.added_mass,
            stitches: &template.stitches,
            effects: template.effects,
        };
        for copy in template.copies((number, emitted), &births) {
            let body = plain::spawn_body(world, &copy);
            let given = world.entity(source);
            let skin = given.get::<BodySkin>().cloned();
            let is_of_scene = given.contains::<SceneEntity>();
            let mut entity = world.entity_mut(body);
            plain::insert(&mut entity, skin);
            plain::insert(&mut entity, is_of_scene.then_some(SceneEntity));
            let emitted = BodyEmitted { source, body };
            world.trigger(emitted);
            world.flush();
            world.write_message(emitted);
        }
    }
}
