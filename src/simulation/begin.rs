//! The start of a tick: update of masses, waking, and validation of input.

use super::{
    Active, AddedMass, Asleep, BodyDensity, BodyDirectWorkspace, JustRestored, Pins, Quarantined,
    RestTimer, SimulationClock, SimulationSettings, SoftBody, SpawnOrder, TickStart,
    body::{BodyQuarantined, shown_name},
    carried::Carried,
    quarantine,
    step::UnderWay,
};
use crate::solver::{
    Collider, Direct, Particles, Quarantine, Stitches,
    contact::SweptCollider,
    emission::{Slept, spread},
    masses::set_inverse_masses,
    rest::{disturbed, written},
};
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

/// Chooses the solver of bodies that carry [`Direct`] with a tolerance.
pub(super) fn choose_solvers(
    under_way: Res<UnderWay>,
    mut bodies: ParamSet<(
        Query<
            (
                Entity,
                &SoftBody,
                &Particles,
                Carried,
                &mut BodyDirectWorkspace,
            ),
            (Active, With<Direct>),
        >,
        Query<&mut Direct>,
    )>,
    mut chosen: Local<Vec<(Entity, Direct)>>,
) {
    chosen.clear();
    for (entity, body, particles, carried, mut workspace) in &mut bodies.p0() {
        let mut effects = carried.effects();
        workspace.bypass_change_detection().0.choose(
            &mut effects,
            body,
            particles,
            under_way.settings(),
        );
        chosen.extend(effects.direct.map(|direct| (entity, direct)));
    }
    let mut directs = bodies.p1();
    for &(entity, direct) in &*chosen {
        if let Ok(mut component) = directs.get_mut(entity) {
            // Derived: no change, which would wake the body.
            *component.bypass_change_detection() = direct;
        }
    }
}

/// Puts bodies into quarantine whose state was set from outside to values that are not finite, or
/// to columns that are too short or too long.
pub(super) fn check_input(
    mut commands: Commands,
    mut bodies: Query<
        (Entity, Option<&Name>, &SoftBody, &mut Particles, &TickStart),
        (With<SoftBody>, Without<Quarantined>),
    >,
    mut messages: MessageWriter<BodyQuarantined>,
) {
    for (entity, name, body, mut particles, start) in &mut bodies {
        if let Some(particle) = particles.first_unfit(body.particles()) {
            particles.restore_at_rest(&start.positions);
            let quarantine = Quarantine::new(body.vertex(particle), Quarantine::INPUT);
            messages.write(quarantine::message(entity, name, &quarantine));
            commands.entity(entity).insert(Quarantined(quarantine));
        }
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

/// Wakes bodies that are grabbed or moved, whose velocity was set, or that a collider moves past; and
/// those that rested on them, which do not see what these are about to do.
pub(super) fn wake_touched(
    mut commands: Commands,
    clock: Res<SimulationClock>,
    settings: Res<SimulationSettings>,
    colliders: Query<(&SpawnOrder, &Collider)>,
    mut sleepers: Query<
        (
            Entity,
            &SoftBody,
            &Particles,
            &TickStart,
            Carried,
            Option<&Stitches>,
            &mut RestTimer,
        ),
        With<Asleep>,
    >,
) {
    if sleepers.is_empty() {
        return;
    }
    let end = clock.time + settings.tick_seconds();
    let mut colliders: Vec<_> = colliders.iter().collect();
    colliders.sort_unstable_by_key(|(order, _)| **order);
    let swept: Vec<SweptCollider> = colliders
        .iter()
        .map(|(_, collider)| collider.sweep(clock.time, end))
        .collect();
    let moves = swept.iter().any(SweptCollider::moves);
    let all = sleepers.iter();
    let mut woken: Vec<bool> = all
        .map(|(_, body, particles, start, carried, stitches, _)| {
            carried.grab.is_some()
                || written(particles, &start.positions)
                || stitches.is_some_and(|stitches| stitches.are_pulled(&swept))
                || moves && disturbed(body, &carried.effects(), &particles.positions, &swept)
        })
        .collect();
    if !woken.contains(&true) {
        return;
    }
    let boxes = sleepers.iter().map(|(_, body, _, start, carried, ..)| {
        let slept = Slept {
            topology: body,
            effects: carried.effects(),
            start,
        };
        Some(slept.boxes())
    });
    spread(&boxes.collect::<Vec<_>>(), &mut woken);
    for ((entity, .., mut timer), woken) in sleepers.iter_mut().zip(woken) {
        if woken {
            timer.0.reset();
            commands.entity(entity).remove::<Asleep>();
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

/// Stores the state at the start of the tick.
pub(super) fn remember_start(mut bodies: Query<(&Particles, &mut TickStart)>) {
    for (particles, mut start) in &mut bodies {
        start.0.clone_from(particles);
    }
}
