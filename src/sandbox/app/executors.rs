//! On one or two cores, the systems of a schedule run one after another.
//!
//! Bevy distributes them over threads, which takes more time there than it saves: most are short,
//! and the renderer, the solver and the main loop have threads of their own.

use bevy::{
    ecs::schedule::{Schedules, SingleThreadedExecutor},
    prelude::*,
    render::RenderApp,
};
use std::{num::NonZero, thread};

/// Number of cores up to which systems run one after another.
const FEW: usize = 2;

/// Chooses the executors of all schedules that an app has so far.
pub(in crate::sandbox) fn choose(app: &mut App) {
    let cores = thread::available_parallelism().map_or(1, NonZero::get);
    if cores > FEW {
        return;
    }
    one_after_another(app.world_mut());
    if let Some(renderer) = app.get_sub_app_mut(RenderApp) {
        one_after_another(renderer.world_mut());
    }
}

fn one_after_another(world: &mut World) {
    for (_, schedule) in world.resource_mut::<Schedules>().iter_mut() {
        schedule.set_executor(SingleThreadedExecutor::new());
    }
}
