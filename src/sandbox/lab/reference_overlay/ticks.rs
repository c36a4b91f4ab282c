//! Starting the references, and sending each tick to their thread.

use super::{
    Follower, ReferenceOverlay,
    bodies::{Moment, Seen},
};
use crate::{
    sandbox::state::selection::Selection,
    simulation::{
        Action, Applied, Asleep, CurrentSubstep, Quarantined, SimulationClock, SimulationSettings,
        SolverThreads, TickStart,
        plain::{self, bodies_in_order, lasting_bodies},
    },
    solver::{self, Particles, Threads, joints::Joined},
};
use bevy::{ecs::message::MessageCursor, prelude::*};
use std::sync::Arc;

/// Real time available per tick [s].
fn room(world: &World) -> f64 {
    let speed = world.resource::<SimulationClock>().speed;
    world.resource::<SimulationSettings>().tick_seconds() / speed.max(1.0)
}

/// Sends copies of the bodies to a new thread: of the selected body, or of all bodies sorted by
/// distance from the camera.
pub(super) fn begin(world: &mut World, reference_overlay: &mut ReferenceOverlay) {
    reference_overlay.bodies = lasting_bodies(world);
    let entities = bodies_in_order(world);
    reference_overlay.chosen = world.resource::<Selection>().0.clone();
    let room = room(world);
    let eye = world
        .query_filtered::<&GlobalTransform, With<Camera3d>>()
        .iter(world)
        .next()
        .map_or(Vec3::ZERO, GlobalTransform::translation);
    let mut copy = plain::capture(world);
    let stitches = (0..).zip(copy.bodies.iter().map(|body| &body.stitches));
    let joined = Joined::of(stitches, copy.bodies.len());
    let mut all: Vec<_> = std::mem::take(&mut copy.bodies)
        .into_iter()
        .zip(entities)
        .zip(0..)
        .filter(|((body, entity), number)| {
            reference_overlay.chosen.contains(*entity)
                && body.quarantine.is_none()
                && !is_renewed(body)
                && body.particles.emission.source().is_none()
                // Each reference is alone: it would come off what it is stitched to.
                && !joined.contains(*number)
        })
        .map(|(one, _)| one)
        .collect();
    all.sort_by(|(a, _), (b, _)| distance(a, eye).total_cmp(&distance(b, eye)));
    let (bodies, entities): (_, Vec<_>) = all.into_iter().unzip();
    copy.bodies = bodies;
    copy.threads = Threads::default();
    reference_overlay.candidates = entities.len();
    reference_overlay.began = copy.tick;
    if entities.is_empty() {
        reference_overlay.trouble =
            Some("No body to compare: add a body, or restore one that diverged. Bodies of grains with an emitter, bodies with a sink, copies that were emitted, and bodies that are stitched to others have no reference.".to_owned());
        return;
    }
    match Follower::start(copy, entities, room) {
        Ok(follower) => reference_overlay.follower = Some(follower),
        Err(error) => {
            reference_overlay.trouble =
                Some(format!("Cannot start the thread of the reference: {error}"))
        }
    }
}

/// Whether grains appear and disappear: those of a reference, which are elsewhere, would appear and
/// disappear at other times.
fn is_renewed(body: &solver::Body) -> bool {
    body.effects.emitter.is_some() || body.effects.sink.is_some()
}

/// Distance of a body's mean position from a point [m].
fn distance(body: &solver::Body, from: Vec3) -> f32 {
    let places = &body.particles.positions;
    let sum: Vec3 = places.iter().map(|x| x.truncate()).sum();
    (sum / places.len().max(1) as f32).distance(from)
}

/// At the end of a tick: sends its inputs and the resulting state of the bodies.
///
/// If a body was moved between two ticks, for example deformed, references cannot follow and all
/// are restarted.
pub(super) fn observe(world: &mut World, mut read: Local<MessageCursor<Applied>>) {
    if world.resource::<SimulationClock>().mid_tick() {
        return;
    }
    let mut applied = read.read(world.resource::<Messages<Applied>>());
    let deformed = applied.any(|applied| {
        matches!(
            applied.action,
            Action::Deform { .. } | Action::ResetShape { .. }
        )
    });
    world.resource_scope(|world, mut reference_overlay: Mut<ReferenceOverlay>| {
        if reference_overlay.follower.is_none() && reference_overlay.trouble.is_none() {
            begin(world, &mut reference_overlay);
            return;
        }
        if deformed || moved(world, &reference_overlay) {
            reference_overlay.again();
            begin(world, &mut reference_overlay);
            return;
        }
        let moment = Arc::new(moment(world, &reference_overlay));
        let heard = reference_overlay
            .follower
            .as_ref()
            .is_some_and(|worker| worker.send(Arc::clone(&moment)));
        if heard {
            reference_overlay.sent = Some(moment);
        } else if reference_overlay.follower.take().is_some() {
            reference_overlay.trouble =
                Some("The thread of the reference has ended. Restart it.".to_owned());
        }
    });
}

/// Whether a body started this tick at a position other than the end of the last tick.
fn moved(world: &World, reference_overlay: &ReferenceOverlay) -> bool {
    let Some(last) = &reference_overlay.sent else {
        return false;
    };
    last.bodies.iter().any(|seen| {
        // Bodies in quarantine are not stepped.
        let body = world.get_entity(seen.body).ok();
        let body = body.filter(|body| !body.contains::<Quarantined>());
        let start = body.and_then(|body| body.get::<TickStart>());
        start.is_some_and(|start| {
            let mut pairs = start.positions.iter().zip(&seen.positions);
            // A torn body has other particles; its reference ends.
            start.positions.len() == seen.positions.len()
                && pairs.any(|(a, b)| a.truncate() != b.truncate())
        })
    })
}

fn moment(world: &mut World, reference_overlay: &ReferenceOverlay) -> Moment {
    let colliders = plain::colliders(world);
    let world = &*world;
    let gaps = reference_overlay
        .compared()
        .map(|comparison| &comparison.gaps);
    let followed: Vec<Entity> = match gaps {
        Some(gaps) => gaps.iter().map(|(body, _)| *body).collect(),
        // It is not yet known which of them have a reference.
        None => reference_overlay.bodies.clone(),
    };
    let seen = |body: Entity| {
        let entity = world.get_entity(body).ok()?;
        let sound = !entity.contains::<Quarantined>();
        sound.then_some(())?;
        Some(Seen {
            body,
            effects: plain::effects(entity),
            positions: entity.get::<Particles>()?.positions.clone(),
            asleep: entity.contains::<Asleep>(),
        })
    };
    let threads = world.resource::<SolverThreads>();
    Moment {
        tick: world.resource::<SimulationClock>().tick(),
        settings: *world.resource::<CurrentSubstep>().context(threads).settings,
        colliders,
        room: room(world),
        bodies: followed.into_iter().filter_map(seen).collect(),
    }
}
