//! Scene defaults: the initial values of a scene, used by the panel's resets.

use std::{collections::BTreeMap, sync::Arc};

use bevy::prelude::*;

use crate::{
    effect::{EffectRegistry, ForceMask},
    simulation::SoftBody,
    solver::{GroupName, Settings},
};

/// World settings in the scene file.
#[derive(Resource, Debug, Clone, Copy, Default, PartialEq, Deref)]
pub struct SceneSettings(pub Settings);

/// Initial parameters of a body, by effect and parameter.
#[derive(Component, Debug, Clone, Default, PartialEq)]
pub struct SceneDefaults {
    values: Arc<BTreeMap<(&'static str, &'static str), f64>>,
    /// The group of the force mask, if the body had one.
    pub(in crate::sandbox) group: Option<GroupName>,
}

impl SceneDefaults {
    /// The initial value; `None` if the body did not carry the effect.
    pub fn get(&self, effect: &'static str, parameter: &'static str) -> Option<f64> {
        self.values.get(&(effect, parameter)).copied()
    }

    /// The current values of an entity.
    fn of(body: &EntityRef, registry: &EffectRegistry) -> Self {
        let mut values = BTreeMap::new();
        for effect in registry.iter() {
            for (index, parameter) in effect.parameters.iter().enumerate() {
                if let Some(value) = (effect.get)(body, index) {
                    values.insert((effect.name, parameter.name), value);
                }
            }
        }
        Self {
            values: Arc::new(values),
            group: body.get::<ForceMask>().map(|mask| mask.group),
        }
    }
}

/// Stores the parameters of new bodies.
pub(in crate::sandbox) fn remember(
    world: &mut World,
    new: &mut QueryState<Entity, (With<SoftBody>, Without<SceneDefaults>)>,
) {
    for body in new.iter(world).collect::<Vec<_>>() {
        let registry = world.resource::<EffectRegistry>();
        let scene_defaults = SceneDefaults::of(&world.entity(body), registry);
        world.entity_mut(body).insert(scene_defaults);
    }
}

/// Stores the settings and the parameters of a scene that was opened or restarted.
pub(in crate::sandbox) fn begin(world: &mut World, settings: Settings) {
    world.insert_resource(SceneSettings(settings));
    let mut new = world.query_filtered();
    remember(world, &mut new);
}
