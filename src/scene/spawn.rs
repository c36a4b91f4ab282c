//! Spawns a built scene.

use super::{BuiltScene, Scene};
use crate::simulation::{BodyEmitted, BodySkin, SceneEntity, plain};
use bevy::prelude::*;
use std::{path::PathBuf, sync::Arc};

/// Appearance of a body or a collider.
#[derive(Component, Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// Color as sRGB from 0 to 255; defaults to the next one of the palette for a body, and to
    /// pale gray for a collider.
    pub color: Option<[u8; 3]>,
    /// Opacity of a collider, from 0 (clear glass) to 1 (opaque, the default). Bodies are opaque.
    pub opacity: f32,
}

impl Default for Look {
    fn default() -> Self {
        Self {
            color: None,
            opacity: 1.0,
        }
    }
}

/// The scene that is open.
#[derive(Resource, Debug, Clone)]
#[non_exhaustive]
pub struct CurrentScene {
    /// Name in the registry, or path.
    pub name: String,
    /// Path of its file, unless it is built in.
    pub path: Option<PathBuf>,
    /// The scene.
    pub scene: Scene,
}

impl Look {
    /// Whether the opacity is between 0 and 1.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        (0.0..=1.0).contains(&self.opacity)
    }

    /// Parses a color as #rrggbb.
    ///
    /// # Errors
    /// What was expected, in a sentence.
    pub(super) fn new(color: Option<&str>) -> Result<Self, String> {
        let Some(text) = color else {
            return Ok(Self::default());
        };
        let number = text
            .strip_prefix('#')
            .filter(|digits| digits.len() == 6)
            .and_then(|digits| u32::from_str_radix(digits, 16).ok())
            .ok_or_else(|| format!("color is “{text}”, but must be like #e07040"))?;
        let [_, red, green, blue] = number.to_be_bytes();
        Ok(Self {
            color: Some([red, green, blue]),
            ..Self::default()
        })
    }
}

/// Spawns the bodies and colliders of a built scene, and sets settings and clock. Returns the
/// bodies in order. Effects of an app need their plugins
/// ([`OwnEffects::add_to`](crate::effect::OwnEffects::add_to)).
pub fn spawn(built: &BuiltScene, world: &mut World) -> Vec<Entity> {
    let (bodies, colliders) = match &built.places {
        Some(places) => plain::restore(world, &built.world, places),
        None => plain::spawn(world, &built.world),
    };
    for ((&body, skin), look) in bodies.iter().zip(&built.skins).zip(&built.looks) {
        let mut entity = world.entity_mut(body);
        entity.insert((SceneEntity, *look));
        if let Some(skin) = skin {
            entity.insert(BodySkin(Arc::clone(skin)));
        }
    }
    for (&body, own) in bodies.iter().zip(&built.own) {
        let mut entity = world.entity_mut(body);
        own.iter().for_each(|effect| effect.insert(&mut entity));
    }
    for (collider, look) in colliders.into_iter().zip(&built.collider_looks) {
        world.entity_mut(collider).insert((SceneEntity, *look));
    }
    bodies
}

/// Gives the copies that leave an emitter the look of their source: an observer.
pub fn copy_look(emitted: On<BodyEmitted>, looks: Query<&Look>, mut commands: Commands) {
    if let Ok(look) = looks.get(emitted.source) {
        commands.entity(emitted.body).insert(*look);
    }
}

/// Despawns all entities of the scene.
pub fn despawn(world: &mut World) {
    let all: Vec<Entity> = world
        .query_filtered::<Entity, With<SceneEntity>>()
        .iter(world)
        .collect();
    for entity in all {
        world.despawn(entity);
    }
    plain::begin_places_anew(world);
}
