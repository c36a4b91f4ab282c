//! Undo, redo, and the timeline of the last seconds.
//!
//! - [`state`]: the state of the window's simulation in memory, and how it is restored.
//! - [`timeline`]: the states of the last seconds.
//! - [`change`]: how each action is undone.
//! - [`history`]: the actions that can be undone and redone.
//! - [`travel`]: step back, and scrubbing.
//!
//! Undo of a parameter, a setting or an effect sets the previous value, and time goes on. Undo of
//! everything else restores the state from before, time included, to the bit.

pub mod change;
pub mod history;
pub mod state;
pub mod timeline;
pub mod travel;

pub use history::{History, before_scene, begin, quietly, redo, undo};
pub use state::{OpenScene, SceneContext};
pub use travel::{scrub, step, step_back};

use crate::{
    sandbox::state::{
        request::RequestSystems,
        time::{Gesture, TimeStrip, TimeView},
    },
    simulation::{Applied, Applying, SimulationClock, StepSchedule, StepSystems},
};
use bevy::prelude::*;

/// Keeps the history and the timeline.
pub struct TimePlugin;

impl Plugin for TimePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<History>()
            .init_resource::<TimeView>()
            .init_resource::<Gesture>()
            .add_observer(|applying: On<Applying>, mut commands: Commands| {
                let action = applying.0.clone();
                commands.queue(move |world: &mut World| history::before_action(world, &action));
            })
            .add_observer(|_: On<Applied>, mut history: ResMut<History>| history.applied())
            .add_systems(
                StepSchedule,
                history::keep
                    .after(StepSystems::End)
                    // It only reads, as everything else after the end of a tick does.
                    .ambiguous_with_all()
                    .run_if(|clock: Res<SimulationClock>| !clock.mid_tick()),
            )
            .add_systems(PreUpdate, count_gestures)
            .add_systems(Update, publish.after(RequestSystems));
    }
}

/// A press of a button or key begins a gesture; its repetitions do not.
fn count_gestures(
    mouse: Option<Res<ButtonInput<MouseButton>>>,
    keys: Option<Res<ButtonInput<KeyCode>>>,
    mut gesture: ResMut<Gesture>,
    mut history: ResMut<History>,
) {
    history.begin_frame();
    let clicked = mouse.is_some_and(|mouse| mouse.get_just_pressed().next().is_some());
    let typed = keys.is_some_and(|keys| keys.get_just_pressed().next().is_some());
    if clicked || typed {
        gesture.0 += 1;
    }
}

/// Publishes what the panel and the strip show.
fn publish(history: Res<History>, clock: Res<SimulationClock>, mut view: ResMut<TimeView>) {
    let now = clock.time();
    let timeline = history.timeline();
    let (start, end) = timeline.span().unwrap_or((now, now));
    let next = TimeView {
        undo: history.undo_title().map(str::to_owned),
        redo: history.redo_title().map(str::to_owned),
        strip: TimeStrip {
            states: timeline.len(),
            start: start.min(now),
            end: end.max(now),
            now,
            every: timeline.every(),
            marks: timeline.marks().to_vec(),
        },
    };
    if *view != next {
        *view = next;
    }
}
