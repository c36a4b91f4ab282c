//! Step back, and scrubbing: shows a kept state, to the bit, and pauses. The states after it stay
//! until the simulation goes on from there.

use super::history::{History, depart, settle};
use crate::{sandbox::ui::message::Notices, simulation::SimulationClock};
use bevy::prelude::*;
use std::sync::Arc;

/// Title of a travel in the history.
const TITLE: &str = "Going back in time";

/// Pauses, and goes back to the previous kept state.
pub fn step_back(world: &mut World) {
    settle(world);
    world.resource_mut::<SimulationClock>().paused = true;
    let tick = world.resource::<SimulationClock>().tick();
    let history = world.resource::<History>();
    let earlier = |index: &usize| {
        let state = history.timeline().get(*index);
        match history.cursor {
            Some(cursor) => *index < cursor,
            None => state.is_some_and(|state| state.tick() < tick),
        }
    };
    let Some(index) = (0..history.timeline().len()).rfind(earlier) else {
        let text = "No earlier state is kept";
        world.resource_mut::<Notices>().info(text);
        return;
    };
    go(world, index);
}

/// Pauses, and goes on by one tick: to the next kept state if an earlier one is shown, else by a
/// tick of the simulation.
pub fn step(world: &mut World) {
    world.resource_mut::<SimulationClock>().paused = true;
    let history = world.resource::<History>();
    let next = history.cursor.map(|index| index + 1);
    match next.filter(|next| *next < history.timeline().len()) {
        Some(next) => go(world, next),
        None => world.resource_mut::<SimulationClock>().step_once(),
    }
}

/// Pauses, and shows the kept state that is nearest to a time [s].
pub fn scrub(world: &mut World, time: f64) {
    settle(world);
    world.resource_mut::<SimulationClock>().paused = true;
    let history = world.resource::<History>();
    let Some(index) = history.timeline().nearest(time) else {
        return;
    };
    let clock = world.resource::<SimulationClock>();
    let is_shown = match history.cursor {
        Some(cursor) => cursor == index,
        // The current state is later than all kept ones, or one of them.
        None => (clock.time() - time).abs() <= distance(history, index, time),
    };
    if !is_shown {
        go(world, index);
    }
}

fn distance(history: &History, index: usize, time: f64) -> f64 {
    let state = history.timeline().get(index);
    state.map_or(f64::INFINITY, |state| (state.time() - time).abs())
}

/// Shows a kept state.
fn go(world: &mut World, index: usize) {
    // The state to be shown may be dropped when the current one is added.
    let Some(state) = world.resource::<History>().timeline().get(index).cloned() else {
        return;
    };
    depart(world, TITLE);
    state.restore(world);
    let mut history = world.resource_mut::<History>();
    let index = history
        .timeline()
        .states()
        .position(|other| Arc::ptr_eq(other, &state));
    history.set_cursor(index);
    history.changed = false;
}
