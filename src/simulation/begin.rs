//! The start of a tick: update of masses, and waking of bodies whose components have changed.

use super::{
    AddedMass, Asleep, BodyDensity, JustRestored, Pins, RestTimer, SimulationSettings, SoftBody,
    body::shown_name,
};
use crate::solver::{Collider, Particles, PinTargets, masses::set_inverse_masses};
use bevy::prelude::*;

/// Updates inverse masses after changes of density, added masses or pins.
pub(super) fn update_masses(
    mut bodies: Query<
        (&SoftBody, &mut Particles, &BodyDensity, &AddedMass, &Pins),
        Or<(Changed<BodyDensity>, Changed<AddedMass>, Changed<Pins>)>,
    >,
) {
    for (body, mut particles, density, added, pins) in &mut bodies {
        set_inverse_masses(&mut particles.positions, body, density.0, added, pins);
    }
}

/// Reports colliders that were set to something that is not sound.
pub(super) fn check_colliders(
    colliders: Query<(Entity, Option<&Name>, &Collider), Changed<Collider>>,
) {
    for (entity, name, collider) in &colliders {
        if let Err(error) = collider.check() {
            let name = shown_name(entity, name);
            log::error!("bodies may pass through collider {name}: its {error}");
        }
    }
}

/// Reports targets of pins that are not finite, once.
pub(super) fn check_targets(
    bodies: Query<(Entity, Option<&Name>, &PinTargets), Changed<PinTargets>>,
    mut has_said: Local<bool>,
) {
    for (entity, name, targets) in &bodies {
        if let Some((vertex, target)) = targets.first_not_finite().filter(|_| !*has_said) {
            let name = shown_name(entity, name);
            log::error!(
                "the target of vertex {vertex} of body {name} is {target} m, but must be finite"
            );
            *has_said = true;
        }
    }
}

/// Wakes bodies whose components have changed.
pub(crate) fn wake_changed<F: bevy::ecs::query::QueryFilter>(
    mut commands: Commands,
    mut sleepers: Query<(Entity, &mut RestTimer), (With<Asleep>, Without<JustRestored>, F)>,
) {
    for (entity, mut timer) in &mut sleepers {
        timer.0.reset();
        commands.entity(entity).remove::<Asleep>();
    }
}

/// Wakes all bodies if gravity, rate, substeps or iterations have changed, or a collider has.
pub(super) fn wake_all(
    mut commands: Commands,
    settings: Res<SimulationSettings>,
    changed: Query<(), Changed<Collider>>,
    mut removed: RemovedComponents<Collider>,
    mut sleepers: Query<(Entity, &mut RestTimer), (With<Asleep>, Without<JustRestored>)>,
) {
    let gone = removed.read().count() > 0;
    if settings.is_changed() || !changed.is_empty() || gone {
        for (entity, mut timer) in &mut sleepers {
            timer.0.reset();
            commands.entity(entity).remove::<Asleep>();
        }
    }
}

/// Ends the exemption of restored bodies from waking by changed components.
pub(super) fn forget_restored(mut commands: Commands, restored: Query<Entity, With<JustRestored>>) {
    for entity in &restored {
        commands.entity(entity).remove::<JustRestored>();
    }
}
