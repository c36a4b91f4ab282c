//! What an app does to bodies, in a recording: the app changes components, and the recorder writes the
//! changes as actions before each tick.

use super::{Recorder, line::Line};
use crate::{
    simulation::{
        Action, SimulationClock, SpawnOrder,
        plain::{bodies_in_order, controls},
    },
    solver::Controls,
};
use bevy::prelude::*;
use std::collections::BTreeMap;

/// What an app does to bodies, as the last tick has left it; bodies to which it does nothing are left out.
#[derive(Debug, Default)]
pub(super) struct Known(BTreeMap<SpawnOrder, Controls>);

impl Known {
    /// For the present state.
    pub fn of(world: &mut World) -> Self {
        let all = bodies_in_order(world).into_iter().filter_map(|body| {
            let body = world.entity(body);
            let controls = controls(body);
            let place = body.get::<SpawnOrder>().copied()?;
            (!controls.is_empty()).then_some((place, controls))
        });
        Self(all.collect())
    }

    /// What has changed to another state.
    fn changes(&self, now: &Self) -> Vec<(SpawnOrder, Controls)> {
        let gone = self.0.keys().filter(|place| !now.0.contains_key(place));
        let gone = gone.map(|place| (*place, Controls::default()));
        let new = now.0.iter();
        let new = new.filter(|(place, controls)| self.0.get(place) != Some(*controls));
        let new = new.map(|(place, controls)| (*place, controls.clone()));
        gone.chain(new).collect()
    }
}

/// Writes what the app has changed, before a tick.
pub(super) fn note_controls(world: &mut World) {
    let now = Known::of(world);
    let tick = world.resource::<SimulationClock>().tick();
    let mut recorder = world.resource_mut::<Recorder>();
    if !recorder.begun {
        return;
    }
    for (body, controls) in recorder.controls.changes(&now) {
        let controls = Box::new(controls);
        let action = Action::Control { body, controls };
        recorder.write(&Line::Do { tick, action });
    }
}

/// Knows what is there after a tick: impulses are gone, and grabs have moved on.
pub(super) fn know_controls(world: &mut World) {
    let now = Known::of(world);
    world.resource_mut::<Recorder>().controls = now;
}
