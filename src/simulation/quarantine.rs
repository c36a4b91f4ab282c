//! Quarantine of diverged bodies.

use super::{
    BodyContacts, BodyQuarantined, Quarantined, SolverThreads, SpawnOrder, body::shown_name, plain,
    step::CurrentSubstep,
};
use crate::solver::{Particles, Quarantine, advance::NotFinite};
use bevy::prelude::*;

/// Resets a diverged body to the start of the tick, determines the stage that failed, and sends a
/// message.
pub(super) fn quarantine(world: &mut World, entity: Entity, error: NotFinite) {
    let Some(body) = plain::body(world.entity(entity)) else {
        return;
    };
    let context = world
        .resource::<CurrentSubstep>()
        .context(world.resource::<SolverThreads>());
    let order = world.get::<SpawnOrder>(entity).copied();
    let is_joined = order.is_some_and(|order| world.resource::<BodyContacts>().joins(order));
    let other = if body.effects.touches_surfaces(context.swept.has_meshes()) {
        Quarantine::CONTACT
    } else if is_joined {
        Quarantine::JOINTS
    } else {
        Quarantine::USER
    };
    let quarantine = body.find_cause(error, other, &context);
    let mut entity_mut = world.entity_mut(entity);
    if let Some(mut particles) = entity_mut.get_mut::<Particles>() {
        particles.restore_at_rest(&body.tick_start.positions);
    }
    entity_mut.insert(Quarantined(quarantine.clone()));
    let text = message(entity, world.get::<Name>(entity), &quarantine);
    world.write_message(text);
}

/// The message for users.
pub(super) fn message(
    body: Entity,
    name: Option<&Name>,
    quarantine: &Quarantine,
) -> BodyQuarantined {
    let name = shown_name(body, name);
    let Quarantine { vertex, stage, .. } = quarantine;
    let (what, remedy) = match *stage {
        Quarantine::INPUT => (
            format!(
                "was given invalid input (vertex {vertex} is not finite, or columns of particles differ in length)"
            ),
            "Set finite values, one per particle in each column.",
        ),
        stage => (
            format!("diverged (non-finite state of vertex {vertex} after {stage})"),
            "Try more substeps, less damping or less stiffness.",
        ),
    };
    BodyQuarantined {
        body,
        text: format!(
            "body {name} {what}. It was restored to the start of the tick and paused. {remedy}"
        ),
    }
}
