//! The effects of an app in a snapshot.

use crate::{
    effect::{
        Effect, EffectRegistry, ExternalForce, ExternalImpulse, Grabs, OwnEffect, OwnEffects,
        PinTargets, Stitches,
    },
    recording::error::{SnapshotError, nonsense},
    scene::BuiltScene,
    simulation::plain::{CARRIED, bodies_in_order},
    solver::Body,
};
use bevy::prelude::{Name, World};
use serde::{Deserialize, Serialize};

/// An effect of an app on a body.
#[derive(Serialize, Deserialize)]
pub struct StoredOwn {
    /// Index of the body.
    body: u32,
    name: String,
    /// The parameters in the syntax of scene files.
    text: String,
}

/// The effects of an app on each body, in order.
///
/// # Errors
/// If a body carries one that is not saved, or that cannot be written.
pub fn own_effects(world: &mut World) -> Result<Vec<Vec<OwnEffect>>, SnapshotError> {
    let bodies = bodies_in_order(world);
    let registry = world.resource::<EffectRegistry>();
    let own = registry.own();
    let is_saved = |name: &str| {
        let controls = [
            ExternalForce::NAME,
            ExternalImpulse::NAME,
            PinTargets::NAME,
            Grabs::NAME,
        ];
        CARRIED.contains(&name)
            || name == Stitches::NAME
            || controls.contains(&name)
            || own.names().any(|it| it == name)
    };
    let others: Vec<_> = registry.iter().filter(|it| !is_saved(it.name)).collect();
    let all = bodies.into_iter().map(|body| {
        let entity = world.entity(body);
        let name = || {
            entity
                .get::<Name>()
                .map_or_else(String::new, Name::to_string)
        };
        if let Some(effect) = others.iter().find(|it| (it.present)(&entity)) {
            return Err(SnapshotError::Effect {
                body: name(),
                effect: effect.name,
            });
        }
        own.of_body(&entity)
            .map_err(|(effect, error)| SnapshotError::EffectText {
                body: name(),
                effect: effect.to_owned(),
                error: error.to_string(),
            })
    });
    all.collect()
}

impl StoredOwn {
    /// Those of a scene.
    pub fn all(built: &BuiltScene) -> Vec<Self> {
        let of_bodies = (0..).zip(&built.own);
        let all = of_bodies.flat_map(|(body, own)| own.iter().map(move |effect| (body, effect)));
        all.map(|(body, effect)| Self {
            body,
            name: effect.name().to_owned(),
            text: effect.text().to_owned(),
        })
        .collect()
    }

    /// Decodes those of each body.
    pub fn read_all(
        all: Vec<Self>,
        bodies: &[Body],
        known: &OwnEffects,
    ) -> Result<Vec<Vec<OwnEffect>>, SnapshotError> {
        let mut own = vec![Vec::new(); bodies.len()];
        for Self { body, name, text } in all {
            let Some((effects, body)) = own.get_mut(body as usize).zip(bodies.get(body as usize))
            else {
                let count = bodies.len();
                return Err(nonsense(format!(
                    "the effect {name} of body {body}; expected less than {count}"
                )));
            };
            let body = body.name.clone();
            if effects.iter().any(|it: &OwnEffect| it.name() == name) {
                return Err(nonsense(format!("the effect {name} of “{body}” twice")));
            }
            let Some(effect) = known.read(&name, &text) else {
                let known: Vec<_> = known.names().collect();
                return Err(SnapshotError::UnknownEffect {
                    body,
                    effect: name,
                    known: known.join(", "),
                });
            };
            effects.push(effect.map_err(|error| SnapshotError::EffectText {
                body,
                effect: name,
                error: error.to_string(),
            })?);
        }
        own.iter_mut().for_each(|effects| known.sort(effects));
        Ok(own)
    }
}
