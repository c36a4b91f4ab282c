//! The list of scenes in the picker. Titles and notes are read from the scene files once.

use bevy::prelude::*;

use super::model::SceneEntry;
use crate::scene::{Scene, registry::SCENES};

/// The built-in scenes, in the order of the registry.
#[derive(Resource, Debug, Clone, Deref)]
pub(super) struct Picker(Vec<SceneEntry>);

impl Default for Picker {
    fn default() -> Self {
        let entries = SCENES.iter().map(|builtin| {
            let name = builtin.name.to_owned();
            match builtin.text.parse::<Scene>() {
                Ok(scene) => SceneEntry {
                    name,
                    title: scene.title,
                    note: scene.look_at,
                },
                // A scene that cannot be read is still listed; opening it shows the error.
                Err(error) => SceneEntry {
                    title: name.clone(),
                    name,
                    note: error.to_string(),
                },
            }
        });
        Self(entries.collect())
    }
}
