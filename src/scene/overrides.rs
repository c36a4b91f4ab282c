//! `--set name=value`: overrides world settings and effect parameters from the command line.

use crate::effect::{EffectInfo, EffectRegistry};
use crate::simulation::{Action, ActionError, SETTINGS, plain::bodies_in_order};
use crate::suggestion::similar_of;
use bevy::prelude::*;
use std::str::FromStr;

/// A name and a value, as in `substeps=20` or `stretch.compliance=1e-5`.
#[derive(Debug, Clone, PartialEq)]
pub struct Override {
    /// A setting, or an effect and its parameter separated by a dot.
    pub name: String,
    /// The value, in the unit of the parameter.
    pub value: f64,
}

/// Error of an override.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OverrideError {
    /// Not of the form name=value.
    #[error(
        "“{0}” is not of the form name=value; expected, for example, substeps=20 or stretch.compliance=1e-5"
    )]
    Form(String),
    /// The value is not a number.
    #[error("“{value}” in {name}={value} is not a number")]
    Number {
        /// Name of the override.
        name: String,
        /// The given text.
        value: String,
    },
    /// The name is neither a setting nor an effect.
    #[error(
        "unknown parameter “{name}”{}; expected one of the settings {settings}, or a parameter of one of the effects {effects}, as in stretch.compliance=1e-5",
        similar_of(.name, .names.iter().map(String::as_str))
    )]
    Unknown {
        /// Name of the override.
        name: String,
        /// Valid settings.
        settings: String,
        /// Valid effects.
        effects: String,
        /// Settings, and the parameters of all effects, as in `stretch.compliance`.
        names: Vec<String>,
    },
    /// No body carries the effect.
    #[error("cannot set {name}: no body of this scene carries {effect}; the scene has {present}")]
    Absent {
        /// The effect.
        effect: String,
        /// Name of the override.
        name: String,
        /// Effects that some body carries.
        present: String,
    },
    /// The value is out of range, or the parameter is unknown.
    #[error(transparent)]
    Action(#[from] ActionError),
}

impl FromStr for Override {
    type Err = OverrideError;

    fn from_str(text: &str) -> Result<Self, OverrideError> {
        let (name, value) = text
            .split_once('=')
            .ok_or_else(|| OverrideError::Form(text.to_owned()))?;
        let (name, value) = (name.trim().to_owned(), value.trim());
        match value.parse() {
            Ok(value) => Ok(Self { name, value }),
            Err(_) => Err(OverrideError::Number {
                name,
                value: value.to_owned(),
            }),
        }
    }
}

impl Override {
    /// Applies the override, to all bodies that carry the effect.
    ///
    /// # Errors
    /// [`OverrideError`] with the invalid word and the valid choices.
    pub fn apply(&self, world: &mut World) -> Result<(), OverrideError> {
        if let Some((effect, parameter)) = self.name.split_once('.') {
            return self.apply_to_bodies(world, effect, parameter);
        }
        if !SETTINGS.iter().any(|(name, ..)| *name == self.name) {
            return Err(self.unknown(world.resource::<EffectRegistry>()));
        }
        let action = Action::SetSetting {
            name: self.name.clone(),
            value: self.value,
        };
        Ok(action.perform(world)?)
    }

    fn unknown(&self, registry: &EffectRegistry) -> OverrideError {
        let settings = SETTINGS.map(|(name, ..)| name);
        let parameters = registry.iter().flat_map(EffectInfo::full_names);
        OverrideError::Unknown {
            name: self.name.clone(),
            settings: settings.join(", "),
            effects: registry.names(),
            names: settings
                .map(str::to_owned)
                .into_iter()
                .chain(parameters)
                .collect(),
        }
    }

    fn apply_to_bodies(
        &self,
        world: &mut World,
        effect: &str,
        parameter: &str,
    ) -> Result<(), OverrideError> {
        let registry = world.resource::<EffectRegistry>();
        let Some(info) = registry.get(effect) else {
            return Err(self.unknown(registry));
        };
        let present = info.present;
        let carriers: Vec<Entity> = bodies_in_order(world)
            .into_iter()
            .filter(|&body| present(&world.entity(body)))
            .collect();
        if carriers.is_empty() {
            return Err(OverrideError::Absent {
                effect: effect.to_owned(),
                name: self.name.clone(),
                present: present_effects(world),
            });
        }
        for body in carriers {
            let action = Action::SetParameter {
                body,
                effect: effect.to_owned(),
                parameter: parameter.to_owned(),
                value: self.value,
            };
            action.perform(world)?;
        }
        Ok(())
    }
}

fn present_effects(world: &mut World) -> String {
    let bodies = bodies_in_order(world);
    let registry = world.resource::<EffectRegistry>();
    let names: Vec<_> = registry
        .iter()
        .filter(|effect| {
            bodies
                .iter()
                .any(|&body| (effect.present)(&world.entity(body)))
        })
        .map(|effect| effect.name)
        .collect();
    if names.is_empty() {
        "no effects".to_owned()
    } else {
        names.join(", ")
    }
}
