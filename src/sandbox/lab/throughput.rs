//! Throughput of the solver: constraint projections per second.
//!
//! A projection solves one constraint once. Their number in a tick is the number of constraints of
//! all awake bodies, times substeps, times iterations. The time is that of the solver alone,
//! without the ECS and without taking statistics.

use bevy::prelude::*;

use crate::simulation::{
    Active, Profile, SimulationClock, SimulationSettings, SoftBody, SoftBodySystems,
    carried::Carried,
};

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

fn follow(
    mut throughput: ResMut<Throughput>,
    clock: Res<SimulationClock>,
    settings: Res<SimulationSettings>,
    profile: Res<Profile>,
    time: Res<Time<Real>>,
    bodies: Query<(&SoftBody, Carried), Active>,
    mut last: Local<u64>,
    mut age: Local<f32>,
) {
    let before = std::mem::replace(&mut *last, clock.tick());
    if clock.paused || bodies.is_empty() || clock.tick() < before {
        throughput.clear();
        return;
    }
    if clock.tick() > before {
        let constraints: usize = bodies
            .iter()
            .map(|(body, carried)| carried.effects().constraints(body))
            .sum();
        let iterations = f64::from(settings.substeps.get()) * f64::from(settings.iterations.get());
        throughput.tick(
            constraints as f64 * iterations,
            profile.solver().as_secs_f64(),
        );
    }
    *age += time.delta_secs();
    if *age >= 1.0 / REFRESH {
        *age = 0.0;
        throughput.refresh();
    }
}
