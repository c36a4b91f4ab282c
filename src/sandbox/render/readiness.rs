//! Whether the graphics pipelines are compiled, and the first picture of the window: the simulation
//! waits for it, so that the beginning of a scene is seen.

use crate::{render::Drawn, simulation::SimulationClock};
use bevy::{
    prelude::*,
    render::{Render, RenderApp, RenderSystems, render_resource::PipelineCache},
};
use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

/// Frames between the first body and the picture that shows it.
const FRAMES: u32 = 4;
/// Real time after which the simulation no longer waits [s].
const PATIENCE: f32 = 15.0;

/// Whether all pipelines that were asked for are compiled.
#[derive(Resource, Debug, Clone, Default)]
pub struct PipelinesReady(Arc<AtomicBool>);

impl PipelinesReady {
    /// Whether all pipelines that were asked for are compiled.
    #[must_use]
    pub fn get(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Whether a scene has been drawn.
#[derive(Resource, Debug, Default)]
pub struct FirstPicture {
    done: bool,
    frames: u32,
    seconds: f32,
}

impl FirstPicture {
    /// Whether a scene has been drawn.
    #[must_use]
    pub const fn is_done(&self) -> bool {
        self.done
    }

    /// Advances by a frame; `drawn` if there is a body and all pipelines are ready.
    fn pass(&mut self, seconds: f32, drawn: bool) {
        self.frames = if drawn { self.frames + 1 } else { 0 };
        self.seconds += seconds;
        self.done |= self.frames >= FRAMES || self.seconds > PATIENCE;
    }
}

/// Watches the pipelines, and holds the clock until the first picture.
pub struct ReadinessPlugin;

impl Plugin for ReadinessPlugin {
    fn build(&self, app: &mut App) {
        let ready = PipelinesReady::default();
        app.insert_resource(ready.clone())
            .init_resource::<FirstPicture>()
            .add_systems(PreUpdate, hold);
        if let Some(renderer) = app.get_sub_app_mut(RenderApp) {
            renderer
                .insert_resource(ready)
                .add_systems(Render, look.in_set(RenderSystems::Cleanup));
        }
    }
}

fn look(cache: Res<PipelineCache>, ready: Res<PipelinesReady>) {
    let waits = cache.waiting_pipelines().next().is_some();
    ready.0.store(!waits, Ordering::Relaxed);
}

fn hold(
    mut first: ResMut<FirstPicture>,
    ready: Res<PipelinesReady>,
    drawn: Query<(), With<Drawn>>,
    time: Res<Time<Real>>,
    mut clock: ResMut<SimulationClock>,
) {
    if !first.done {
        first.pass(time.delta_secs(), ready.get() && !drawn.is_empty());
        clock.held = !first.done;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_clock_is_held_until_bodies_are_drawn_for_some_frames_but_not_for_ever() {
        let mut first = FirstPicture::default();
        for drawn in [true, true, false, true, true, true] {
            first.pass(0.1, drawn);
            assert!(!first.is_done());
        }
        first.pass(0.1, true);
        assert!(first.is_done());
        let mut never = FirstPicture::default();
        never.pass(14.0, false);
        assert!(!never.is_done());
        never.pass(2.0, false);
        assert!(never.is_done());
    }
}
