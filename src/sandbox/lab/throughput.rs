//! Throughput of the solver: constraint projections per second.
//!
//! Their number in a tick is that of [`projections`], with all effects and contacts. The time is that
//! of the solver alone, without the ECS and without taking statistics.

use bevy::prelude::*;

use crate::simulation::{Active, Profile, SimulationClock, SoftBody, SoftBodySystems, projections};

/// Weight of a new tick in the smoothed figure: a tick from one second ago has a tenth of the
/// weight.
const FRESH: f64 = 0.04;
/// Update rate of the figure, slow enough to be read [1/s].
const REFRESH: f32 = 5.0;

/// Projections per second, smoothed; `None` while no body is stepped.
#[derive(Resource, Debug, Clone, Default)]
pub struct Throughput {
    /// Projections of the last ticks, exponentially weighted.
    projections: f64,
    /// Real time of the same ticks with the same weights [s].
    seconds: f64,
    shown: Option<f64>,
}

impl Throughput {
    /// Projections per second; `None` while the simulation is paused or all bodies sleep.
    #[must_use]
    pub const fn per_second(&self) -> Option<f64> {
        self.shown
    }

    /// Adds a tick: its number of projections, and its duration [s].
    pub fn tick(&mut self, projections: f64, seconds: f64) {
        self.projections += (projections - self.projections) * FRESH;
        self.seconds += (seconds - self.seconds) * FRESH;
    }

    /// Updates the figure from the ticks so far.
    pub fn refresh(&mut self) {
        let counts = self.projections > 0.0 && self.seconds > 0.0;
        self.shown = counts.then(|| self.projections / self.seconds);
    }

    /// Resets everything.
    pub fn clear(&mut self) {
        *self = Self::default();
    }
}

/// Measures the throughput after each tick.
pub struct ThroughputPlugin;

impl Plugin for ThroughputPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Throughput>()
            .add_systems(PostUpdate, follow.after(SoftBodySystems::Last));
    }
}

/// State of [`follow`].
#[derive(Debug, Default)]
struct Followed {
    /// The last tick that was seen.
    tick: u64,
    /// Time since the figure was updated [s].
    age: f32,
}

fn follow(
    world: &mut World,
    awake: &mut QueryState<(), (With<SoftBody>, Active)>,
    mut followed: Local<Followed>,
) {
    let clock = world.resource::<SimulationClock>();
    let (tick, paused) = (clock.tick(), clock.paused);
    let before = std::mem::replace(&mut followed.tick, tick);
    if paused || awake.iter(world).next().is_none() || tick < before {
        world.resource_mut::<Throughput>().clear();
        return;
    }
    if tick > before {
        let projections = projections::per_tick(world);
        let seconds = world.resource::<Profile>().solver().as_secs_f64();
        world
            .resource_mut::<Throughput>()
            .tick(projections, seconds);
    }
    followed.age += world.resource::<Time<Real>>().delta_secs();
    if followed.age >= 1.0 / REFRESH {
        followed.age = 0.0;
        world.resource_mut::<Throughput>().refresh();
    }
}
