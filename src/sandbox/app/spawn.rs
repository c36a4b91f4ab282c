//! Requests bodies: rain, and drops at clicks.

use crate::{
    sandbox::{
        input::pointer::{Pointer, PointerOwner, PointerSystems},
        state::{
            event::SceneLoaded,
            request::{Request, RequestSystems, Requested},
            spawn::{MAX_BODIES, Spawn, SpawnPlace},
        },
        ui::message::Notices,
    },
    simulation::{SimulationClock, SoftBody},
};
use bevy::prelude::*;

/// Simulated time between two bodies of the rain [s].
const INTERVAL: f64 = 0.25;

/// Requests bodies.
pub struct SpawnPlugin;

impl Plugin for SpawnPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Spawn>().add_systems(
            Update,
            (stop, rain, click)
                .chain()
                .after(PointerSystems)
                .before(RequestSystems),
        );
    }
}

/// Stops the rain when a scene is opened or restarted.
fn stop(mut scenes: MessageReader<SceneLoaded>, mut spawn: ResMut<Spawn>) {
    if scenes.read().count() > 0 && spawn.rains {
        spawn.rains = false;
    }
}

fn rain(
    mut spawn: ResMut<Spawn>,
    clock: Res<SimulationClock>,
    bodies: Query<(), With<SoftBody>>,
    mut next: Local<f64>,
    mut number: Local<u32>,
    mut requests: MessageWriter<Requested>,
    mut notices: ResMut<Notices>,
) {
    if !spawn.rains {
        *next = 0.0;
        return;
    }
    if bodies.iter().count() >= MAX_BODIES {
        spawn.rains = false;
        notices.info(format!("The rain stops at {MAX_BODIES} bodies"));
        return;
    }
    // The clock starts again with the scene.
    *next = next.min(clock.time() + INTERVAL);
    if clock.time() >= *next {
        *next = clock.time() + INTERVAL;
        *number += 1;
        requests.write(Requested(Request::Spawn(SpawnPlace::Rain(*number))));
    }
}

fn click(
    spawn: Res<Spawn>,
    pointer: Res<Pointer>,
    mouse: Res<ButtonInput<MouseButton>>,
    mut requests: MessageWriter<Requested>,
) {
    let beside = pointer.owner == PointerOwner::Spent && mouse.just_pressed(MouseButton::Left);
    if spawn.on_click && beside && !mouse.pressed(MouseButton::Right) {
        requests.write(Requested(Request::Spawn(SpawnPlace::Pointer)));
    }
}
