//! The values that a scene began with, which the panel's resets go back to.

use std::collections::BTreeMap;

use bevy::prelude::*;

use crate::{effect::EffectRegistry, simulation::SoftBody, solver::Settings};

/// The world's settings as the scene's file has them.
#[derive(Resource, Debug, Clone, Copy, Default, PartialEq, Deref)]
pub struct SceneSettings(pub Settings);

/// The parameters that a body came with, by effect and parameter.
#[derive(Component, Debug, Clone, Default, PartialEq)]
pub struct SceneDefaults(BTreeMap<(&'static str, &'static str), f64>);

impl SceneDefaults {
    /// The value that the body came with; `None` if it came without the effect.
    pub fn get(&self, effect: &'static str, parameter: &'static str) -> Option<f64> {
        self.0.get(&(effect, parameter)).copied()
    }

    /// The values that an entity has now.
    fn of(body: &EntityRef, registry: &EffectRegistry) -> Self {
        let mut values = BTreeMap::new();
        for effect in registry.iter() {
            for (index, parameter) in effect.parameters.iter().enumerate() {
                if let Some(value) = (effect.get)(body, index) {
                    values.insert((effect.name, parameter.name), value);
                }
            }
        }
        Self(values)
    }
}

/// Remembers the parameters of bodies that are new.
pub(super) fn remember(
    mut commands: Commands,
    registry: Res<EffectRegistry>,
    new: Query<EntityRef, (With<SoftBody>, Without<SceneDefaults>)>,
) {
    for body in &new {
        let scene_defaults = SceneDefaults::of(&body, &registry);
        commands.entity(body.id()).insert(scene_defaults);
    }
}
