//! States in memory, for undo and for going back in time: cheaper than a plain world, as they hold
//! nothing that is derived, and share meshes and sleeping bodies with each other.
//!
//! Of the effects of an app, a moment holds those that are
//! [saved](crate::effect::EffectPlugin::saved); restoring it leaves others as they are.

use super::{
    AddedMass, Asleep, BodyContacts, BodyDensity, BodyDirectWorkspace, BodySkin, JustRestored,
    Pins, Quarantined, RestTimer, SceneEntity, SimulationClock, SimulationSettings, SoftBody,
    SpawnOrder, TickStart,
    body::NextPlace,
    carried::{self, set},
    plain::{bodies_in_order, colliders_in_order},
    step::{BodySleep, Sleep},
};
use crate::{
    effect::{EffectRegistry, OwnEffect, OwnEffects},
    mesh::Skin,
    solver::{
        self, Collider, Controls, Density, EffectStates, Effects, Mass, Particles, Quarantine,
        Settings, Stitches, Topology, VertexIndex, memory, rest::SleepSettings,
        topology::RestValues,
    },
};
use bevy::prelude::*;
use glam::Vec4;
use std::{collections::HashSet, sync::Arc};

/// The state of a simulation between two ticks.
#[derive(Debug, Clone)]
pub struct Moment {
    bodies: Vec<Arc<BodyMoment>>,
    colliders: Vec<(SpawnOrder, Collider)>,
    settings: Settings,
    sleep: SleepSettings,
    time: f64,
    tick: u64,
    last_order: u64,
}

/// The state of a body.
#[derive(Debug, PartialEq)]
struct BodyMoment {
    order: SpawnOrder,
    name: Option<Name>,
    /// The topology before plastic flow.
    topology: Arc<Topology>,
    /// Rest values after plastic flow, if there was any.
    rest_values: Option<RestValues>,
    skin: Option<Arc<Skin>>,
    density: Density,
    added_mass: Vec<(VertexIndex, Mass)>,
    pins: Vec<VertexIndex>,
    effects: Effects,
    controls: Controls,
    /// Effects of an app.
    own: Vec<OwnEffect>,
    stitches: Stitches,
    particles: Particles,
    /// Positions at the start of the last tick.
    start: Vec<Vec4>,
    rest: solver::rest::RestTimer,
    sleep: Option<BodySleep>,
    asleep: bool,
    quarantine: Option<Quarantine>,
}

impl Moment {
    /// The current state; `None` in the middle of a tick. Bodies that have not changed since
    /// `previous` because they sleep are shared with it.
    #[must_use]
    pub fn take(world: &mut World, previous: Option<&Self>) -> Option<Self> {
        if world.resource::<SimulationClock>().mid_tick() {
            return None;
        }
        let before = previous.map_or(&[][..], |moment| &moment.bodies);
        let own = world.resource::<EffectRegistry>().own();
        let bodies = bodies_in_order(world)
            .into_iter()
            .filter_map(|entity| BodyMoment::take(world.entity(entity), &own, before))
            .collect();
        let colliders = colliders_in_order(world)
            .into_iter()
            .filter_map(|entity| {
                let entity = world.entity(entity);
                Some((*entity.get()?, entity.get::<Collider>()?.clone()))
            })
            .collect();
        let clock = world.resource::<SimulationClock>();
        Some(Self {
            bodies,
            colliders,
            settings: **world.resource::<SimulationSettings>(),
            sleep: world.resource::<Sleep>().0,
            time: clock.time,
            tick: clock.tick,
            last_order: world.resource::<NextPlace>().0,
        })
    }

    /// Simulated time since the start of the scene [s].
    #[must_use]
    pub const fn time(&self) -> f64 {
        self.time
    }

    /// Ticks since the start of the scene.
    #[must_use]
    pub const fn tick(&self) -> u64 {
        self.tick
    }

    /// Memory of bodies [bytes] that are not in `counted`, to which they are added.
    pub fn count_bytes(&self, counted: &mut HashSet<usize>) -> usize {
        let new = self.bodies.iter().filter(|body| {
            let address = Arc::as_ptr(body) as usize;
            counted.insert(address)
        });
        let bodies = new.map(|body| body.bytes()).sum::<usize>();
        // A body that tears or whose grains appear has a topology of its own after each tick.
        let own = self.bodies.iter().map(|body| &body.topology);
        let own = own.filter(|it| it.splits() > 0 || it.is_renewed());
        let new = own.filter(|it| counted.insert(Arc::as_ptr(it) as usize));
        bodies + new.map(|it| memory::topology(it)).sum::<usize>()
    }

    /// Restores the state bit for bit; the `State` of an effect of an app begins anew. Bodies and colliders that still exist keep their entities,
    /// others are spawned or despawned. Returns the entities of the bodies and of the colliders, in
    /// order.
    pub fn restore(&self, world: &mut World) -> (Vec<Entity>, Vec<Entity>) {
        world.insert_resource(SimulationSettings(self.settings));
        world.insert_resource(Sleep(self.sleep));
        // A cache of the contacts of other positions.
        world.insert_resource(BodyContacts::default());
        let mut clock = world.resource_mut::<SimulationClock>();
        clock.restart();
        clock.time = self.time;
        clock.tick = self.tick;
        let colliders = self.restore_colliders(world);
        let here = bodies_in_order(world);
        let known: Vec<_> = self
            .bodies
            .iter()
            .map(|body| {
                here.iter()
                    .copied()
                    .find(|it| body.is_of(world.entity(*it)))
            })
            .collect();
        for entity in here {
            if !known.contains(&Some(entity)) {
                world.despawn(entity);
            }
        }
        let own = world.resource::<EffectRegistry>().own();
        let bodies = known
            .into_iter()
            .zip(&self.bodies)
            .map(|(entity, body)| body.restore(world, &own, entity))
            .collect();
        world.resource_mut::<NextPlace>().0 = self.last_order;
        (bodies, colliders)
    }

    fn restore_colliders(&self, world: &mut World) -> Vec<Entity> {
        let here = colliders_in_order(world);
        let order = |world: &World, entity| world.get::<SpawnOrder>(entity).copied();
        for &entity in &here {
            let place = order(world, entity);
            if !self.colliders.iter().any(|(own, _)| Some(*own) == place) {
                world.despawn(entity);
            }
        }
        let mut entities = Vec::new();
        for (place, collider) in &self.colliders {
            let known = here
                .iter()
                .find(|entity| order(world, **entity) == Some(*place));
            let entity = match known {
                Some(&entity) if world.get(entity) == Some(collider) => entity,
                Some(&entity) => world.entity_mut(entity).insert(collider.clone()).id(),
                None => {
                    let mut new = world.spawn((collider.clone(), SceneEntity));
                    new.insert(*place).id()
                }
            };
            entities.push(entity);
        }
        entities
    }
}

impl BodyMoment {
    fn take(entity: EntityRef, own: &OwnEffects, previous: &[Arc<Self>]) -> Option<Arc<Self>> {
        let own = own.of_entity(&entity);
        let topology = &entity.get::<SoftBody>()?.0;
        let order = *entity.get::<SpawnOrder>()?;
        let is_still = entity.contains::<Asleep>() || entity.contains::<Quarantined>();
        let before = previous.iter().find(|body| is_still && body.order == order);
        if let Some(before) = before
            && before.own == own
            && before.describes(entity)
        {
            return Some(Arc::clone(before));
        }
        Some(Arc::new(Self {
            order,
            name: entity.get::<Name>().cloned(),
            topology: Arc::clone(topology.original().unwrap_or(topology)),
            rest_values: topology.rest_values(),
            skin: entity.get::<BodySkin>().map(|skin| Arc::clone(&skin.0)),
            density: entity.get::<BodyDensity>()?.0,
            added_mass: entity.get::<AddedMass>()?.0.clone(),
            pins: entity.get::<Pins>()?.0.clone(),
            effects: carried::effects(entity),
            controls: carried::controls(entity),
            own,
            stitches: entity.get::<Stitches>().cloned().unwrap_or_default(),
            particles: entity.get::<Particles>()?.clone(),
            start: entity.get::<TickStart>()?.positions.clone(),
            rest: entity.get::<RestTimer>()?.0,
            sleep: entity.get().copied(),
            asleep: entity.contains::<Asleep>(),
            quarantine: entity.get::<Quarantined>().map(|it| it.0.clone()),
        }))
    }

    /// Whether the state of the body is this one. Compares all but the mesh, the effects of an app, and
    /// the rest timer without plastic flow.
    fn describes(&self, entity: EntityRef) -> bool {
        let Some(body) = entity.get::<SoftBody>() else {
            return false;
        };
        Arc::ptr_eq(&self.topology, &body.0)
            && entity.get() == self.name.as_ref()
            && entity
                .get()
                .is_some_and(|it: &Particles| *it == self.particles)
            && entity
                .get()
                .is_some_and(|it: &TickStart| it.positions == self.start)
            && entity.get().is_some_and(|it: &Pins| it.0 == self.pins)
            && entity
                .get()
                .is_some_and(|it: &BodyDensity| it.0 == self.density)
            && entity
                .get()
                .is_some_and(|it: &AddedMass| it.0 == self.added_mass)
            && entity.get().is_some_and(|it: &RestTimer| it.0 == self.rest)
            && entity.get() == self.sleep.as_ref()
            && entity.get::<Stitches>().cloned().unwrap_or_default() == self.stitches
            && carried::effects(entity) == self.effects
            && carried::controls(entity) == self.controls
            && entity.contains::<Asleep>() == self.asleep
            && entity.get().map(|it: &Quarantined| &it.0) == self.quarantine.as_ref()
    }

    /// Whether the entity is this body in another state.
    fn is_of(&self, entity: EntityRef) -> bool {
        let order = entity.get::<SpawnOrder>();
        let body = entity.get::<SoftBody>().map(|body| &body.0);
        let skin = entity.get::<BodySkin>().map(|skin| &skin.0);
        let same_skin = match (skin, &self.skin) {
            (Some(one), Some(other)) => Arc::ptr_eq(one, other),
            (one, other) => one.is_none() && other.is_none(),
        };
        same_skin
            && order == Some(&self.order)
            && body.is_some_and(|body| Arc::ptr_eq(body.original().unwrap_or(body), &self.topology))
    }

    fn restore(&self, world: &mut World, own: &OwnEffects, entity: Option<Entity>) -> Entity {
        let topology = match &self.rest_values {
            None => Arc::clone(&self.topology),
            Some(values) => self
                .topology
                .flowed(values)
                .unwrap_or_else(|| Arc::clone(&self.topology)),
        };
        let mut entity = match entity {
            Some(entity) => world.entity_mut(entity),
            None => world.spawn(SceneEntity),
        };
        let same = entity
            .get::<SoftBody>()
            .is_some_and(|body| Arc::ptr_eq(&body.0, &topology));
        if !same {
            // Resets the state of the body, so it comes first.
            entity.insert((self.particles.clone(), SoftBody(Arc::clone(&topology))));
        }
        carried::set_effects(&mut entity, &self.effects);
        carried::set_controls(&mut entity, &self.controls);
        own.set(&mut entity, &self.own);
        if entity.contains::<BodyDirectWorkspace>() {
            entity.insert(BodyDirectWorkspace::default());
        }
        let states = EffectStates::resumed(&self.effects, &topology, &self.particles);
        let mut start = self.particles.clone();
        start.positions.clone_from(&self.start);
        entity.insert((
            self.order,
            BodyDensity(self.density),
            AddedMass(self.added_mass.clone()),
            Pins(self.pins.clone()),
            RestTimer(self.rest),
            states,
            self.particles.clone(),
            TickStart(start),
            JustRestored,
        ));
        set(&mut entity, self.name.clone());
        let skin = self.skin.as_ref();
        set(&mut entity, skin.map(|skin| BodySkin(Arc::clone(skin))));
        let stitches = (!self.stitches.is_empty()).then(|| self.stitches.clone());
        set(&mut entity, stitches);
        set(&mut entity, self.sleep);
        set(&mut entity, self.asleep.then_some(Asleep));
        set(&mut entity, self.quarantine.clone().map(Quarantined));
        entity.id()
    }

    /// Memory without the mesh [bytes].
    fn bytes(&self) -> usize {
        /// Size of an element of the columns of particles, and the largest of their history.
        const ELEMENT: usize = size_of::<Vec4>();
        const PAST: usize = 24;
        let columns = self.particles.columns().into_iter();
        let now: usize = columns.map(|(_, column)| column.len() * ELEMENT).sum();
        let history = self.particles.history.columns().into_iter();
        let past: usize = history.map(|(_, count)| count * PAST).sum();
        let rest = self.rest_values.as_ref().map_or(0, |rest| {
            let columns = [&rest.lengths, &rest.volumes, &rest.angles, &rest.folds];
            columns.iter().map(|column| column.len() * 4).sum()
        });
        let turning =
            size_of_val(&self.particles.segments[..]) + size_of_val(&self.particles.spins[..]);
        let own: usize = self.own.iter().map(|effect| effect.text().len()).sum();
        size_of::<Self>() + own + now + past + turning + rest + self.start.len() * ELEMENT
    }
}
