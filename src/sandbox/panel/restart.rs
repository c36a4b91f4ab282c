//! Keeps the changes made in the panel over a restart, so that the same motion can be repeated with
//! other parameters. Opening a scene, including the same one, begins with the values of its file.

use bevy::prelude::*;

use super::scene_defaults::{SceneDefaults, SceneSettings};
use crate::{
    effect::{EffectRegistry, ForceMask},
    simulation::{Action, Actions, SETTINGS, SimulationSettings, plain::bodies_in_order, setting},
    solver::GroupName,
};

/// A changed parameter of a body, by the index of the body in the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ChangedParameter {
    place: usize,
    effect: &'static str,
    parameter: &'static str,
    value: f64,
}

/// Changes of the scene defaults.
#[derive(Debug, Default)]
pub(in crate::sandbox) struct Changes {
    settings: Vec<(&'static str, f64)>,
    parameters: Vec<ChangedParameter>,
    /// Groups of force masks, by the index of the body in the scene.
    groups: Vec<(usize, GroupName)>,
}

/// The differences from the scene defaults.
pub(in crate::sandbox) fn changes(world: &mut World) -> Changes {
    let bodies = bodies_in_order(world);
    let now = &world.resource::<SimulationSettings>().0;
    let scene = &world.resource::<SceneSettings>().0;
    let settings = SETTINGS
        .iter()
        .filter_map(|(name, ..)| {
            let value = setting(now, name)?;
            (value != setting(scene, name)?).then_some((*name, value))
        })
        .collect();
    let parameters = bodies
        .iter()
        .enumerate()
        .flat_map(|(place, body)| changed(world, place, *body))
        .collect();
    let group = |(place, body): (usize, &Entity)| {
        let entity = world.entity(*body);
        let original = entity.get::<SceneDefaults>()?.group?;
        let group = entity.get::<ForceMask>()?.group;
        (group != original).then_some((place, group))
    };
    let groups = bodies.iter().enumerate().filter_map(group).collect();
    Changes {
        settings,
        parameters,
        groups,
    }
}

fn changed(world: &World, place: usize, body: Entity) -> Vec<ChangedParameter> {
    let entity = world.entity(body);
    let Some(scene_defaults) = entity.get::<SceneDefaults>() else {
        return Vec::new();
    };
    let mut changes = Vec::new();
    for effect in world.resource::<EffectRegistry>().iter() {
        for (index, parameter) in effect.parameters.iter().enumerate() {
            let original = scene_defaults.get(effect.name, parameter.name);
            let value = (effect.get)(&entity, index);
            if let (Some(value), Some(original)) = (value, original)
                && value != original
            {
                changes.push(ChangedParameter {
                    place,
                    effect: effect.name,
                    parameter: parameter.name,
                    value,
                });
            }
        }
    }
    changes
}

/// Makes the changes again, by actions.
pub(in crate::sandbox) fn repeat(world: &mut World, changes: Changes) {
    let bodies = bodies_in_order(world);
    let mut actions = world.resource_mut::<Actions>();
    for (name, value) in changes.settings {
        let name = name.to_owned();
        actions.push(Action::SetSetting { name, value });
    }
    for change in changes.parameters {
        if let Some(&body) = bodies.get(change.place) {
            actions.push(Action::SetParameter {
                body,
                effect: change.effect.to_owned(),
                parameter: change.parameter.to_owned(),
                value: change.value,
            });
        }
    }
    for (place, group) in changes.groups {
        if let Some(&body) = bodies.get(place) {
            actions.push(Action::SetForceGroup { body, group });
        }
    }
}
