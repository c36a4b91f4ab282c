//! The state of the window's simulation in memory: a [`Moment`], the looks of its bodies, the
//! scene defaults of their parameters, and the scene that it belongs to.

use crate::{
    recording::{About, Recorder, Snapshot},
    sandbox::{
        app::aim,
        input::drag::Drag,
        lab::reference_overlay::{ReferenceCommand, ReferenceOverlay},
        panel::{SceneDefaults, SceneSettings, energy},
        render::{material::SkinMaterial, stage::FloorHeight},
        state::{
            event::SceneLoaded,
            selection::{Scope, Selection},
            view::LastGrab,
        },
    },
    scene::{self, BuiltScene, CurrentScene, Look},
    simulation::{
        EnergyLedger, Moment, SpawnOrder, SpawnOrders, Statistics,
        plain::{bodies_in_order, colliders_in_order},
    },
    solver::{Grab, Settings},
};
use bevy::prelude::*;
use std::{collections::HashSet, sync::Arc};

/// What belongs to an open scene.
#[derive(Debug)]
pub struct SceneContext {
    /// The scene.
    pub current: CurrentScene,
    /// Its initial state, to which a restart leads.
    pub beginning: BuiltScene,
    /// Spawn orders at its beginning.
    pub orders: SpawnOrders,
    /// Height of the floor [m].
    pub floor: Option<f32>,
    /// Its settings.
    pub settings: Settings,
}

/// The scene that is open, as a resource.
#[derive(Resource, Debug, Clone, Deref)]
pub struct OpenScene(pub Arc<SceneContext>);

/// A kept state.
#[derive(Debug)]
pub struct State {
    moment: Moment,
    bodies: Vec<BodyExtras>,
    colliders: Vec<Look>,
    scene: Option<Arc<SceneContext>>,
}

/// What a body has besides its state, for a body that is spawned again.
#[derive(Debug)]
struct BodyExtras {
    look: Option<Look>,
    scene_defaults: Option<SceneDefaults>,
    material: Option<MeshMaterial3d<SkinMaterial>>,
}

impl State {
    /// The current state; `None` in the middle of a tick. It shares sleeping bodies with
    /// `previous`.
    pub fn take(world: &mut World, previous: Option<&Self>) -> Option<Self> {
        let moment = Moment::take(world, previous.map(|state| &state.moment))?;
        let bodies = bodies_in_order(world)
            .into_iter()
            .map(|body| BodyExtras {
                look: world.get(body).copied(),
                scene_defaults: world.get(body).cloned(),
                material: world.get(body).cloned(),
            })
            .collect();
        let colliders = colliders_in_order(world)
            .into_iter()
            .map(|collider| world.get(collider).copied().unwrap_or_default())
            .collect();
        let scene = world.get_resource::<OpenScene>();
        Some(Self {
            moment,
            bodies,
            colliders,
            scene: scene.map(|scene| Arc::clone(&scene.0)),
        })
    }

    /// Simulated time since the start of the scene [s].
    pub const fn time(&self) -> f64 {
        self.moment.time()
    }

    /// Ticks since the start of the scene.
    pub const fn tick(&self) -> u64 {
        self.moment.tick()
    }

    /// Memory of what is not in `counted` [bytes].
    pub fn count_bytes(&self, counted: &mut HashSet<usize>) -> usize {
        let address = std::ptr::from_ref(self) as usize;
        if !counted.insert(address) {
            return 0;
        }
        let extras = self.bodies.len() * size_of::<BodyExtras>();
        size_of::<Self>() + extras + self.moment.count_bytes(counted)
    }

    /// Restores the state, without the grab of a drag that is over. What measures the simulation
    /// begins anew; the selection stays where its body exists.
    pub fn restore(&self, world: &mut World) {
        let open = world
            .get_resource::<OpenScene>()
            .map(|it| Arc::clone(&it.0));
        let other = match (&open, &self.scene) {
            (Some(open), Some(own)) => !Arc::ptr_eq(open, own),
            _ => false,
        };
        let chosen = if other { Vec::new() } else { chosen(world) };
        Recorder::scene_ends(world);
        if other {
            scene::despawn(world);
        }
        let (bodies, colliders) = self.moment.restore(world);
        self.restore_extras(world, &bodies, &colliders);
        release_all(world);
        match &self.scene {
            Some(scene) if other => reopen(world, scene),
            _ => Recorder::state_replaced(world),
        }
        let is_chosen = |body: &Entity| {
            let order = world.get::<SpawnOrder>(*body);
            order.is_some_and(|order| chosen.contains(order))
        };
        let kept = bodies.into_iter().filter(is_chosen);
        let scope = Scope::of(kept.map(Entity::to_bits));
        if let Some(mut selection) = world.get_resource_mut::<Selection>() {
            selection.set_if_neq(Selection(scope));
        }
        if world.resource::<EnergyLedger>().on {
            energy::keep(world, true);
        }
        if world.contains_resource::<ReferenceOverlay>() {
            world.write_message(ReferenceCommand::Again);
        }
        let figures = Statistics::measure(world);
        world.insert_resource(figures);
    }

    fn restore_extras(&self, world: &mut World, bodies: &[Entity], colliders: &[Entity]) {
        for (&entity, extras) in bodies.iter().zip(&self.bodies) {
            let mut entity = world.entity_mut(entity);
            if let Some(look) = extras.look
                && entity.get() != Some(&look)
            {
                entity.insert(look);
            }
            if let Some(scene_defaults) = &extras.scene_defaults {
                entity.insert(scene_defaults.clone());
            }
            if let Some(material) = &extras.material
                && !entity.contains::<MeshMaterial3d<SkinMaterial>>()
            {
                entity.insert(material.clone());
            }
        }
        for (&entity, look) in colliders.iter().zip(&self.colliders) {
            if world.get(entity) != Some(look) {
                world.entity_mut(entity).insert(*look);
            }
        }
    }
}

/// Spawn orders of the selected bodies.
fn chosen(world: &World) -> Vec<SpawnOrder> {
    let Some(selection) = world.get_resource::<Selection>() else {
        return Vec::new();
    };
    let bodies = selection.0.keys().filter_map(Entity::try_from_bits);
    bodies
        .filter_map(|body| world.get_entity(body).ok()?.get().copied())
        .collect()
}

/// Ends all drags: the restored state has a grab if it is from the middle of one.
fn release_all(world: &mut World) {
    let mut grabbed = world.query_filtered::<Entity, With<Grab>>();
    for entity in grabbed.iter(world).collect::<Vec<_>>() {
        world.entity_mut(entity).remove::<Grab>();
    }
    if let Some(mut drag) = world.get_resource_mut::<Drag>() {
        drag.held = None;
    }
    if let Some(mut last) = world.get_resource_mut::<LastGrab>()
        && let Some(grab) = &mut last.0
    {
        grab.held = false;
    }
}

/// Makes a scene the open one again, after its state was restored.
fn reopen(world: &mut World, scene: &Arc<SceneContext>) {
    world.insert_resource(OpenScene(Arc::clone(scene)));
    world.insert_resource(scene.current.clone());
    world.insert_resource(SceneSettings(scene.settings));
    world.insert_resource(FloorHeight(scene.floor));
    world.write_message(SceneLoaded {
        name: scene.current.name.clone(),
        error: None,
    });
    let mut built = scene.beginning.clone();
    built.places = Some(scene.orders.clone());
    let about = About::from(&scene.current);
    Recorder::scene_returned(world, Snapshot { about, built });
    aim::look_again(world, scene);
}
