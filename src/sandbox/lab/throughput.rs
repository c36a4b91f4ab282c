//! How much the solver does: projections of constraints a second.
//!
//! A projection is one constraint solved once. Those of a tick are the constraints of all bodies
//! that are awake, times substeps, times iterations; the time is that of the solver, without the ECS
//! around it and without what it takes to measure.

use bevy::prelude::*;

use crate::{
    effect::{Stretch, Volume},
    simulation::{Active, Profile, SimulationClock, SimulationSettings, SoftBody, SoftBodySystems},
    solver::Effects,
};

/// Share of a new tick in the figure: with it, a tick of a second ago weighs a tenth.
const FRESH: f64 = 0.04;
/// How often the figure changes, so that it can be read [1/s].
const REFRESH: f32 = 5.0;

/// Projections a second, smoothed; nothing while no body is stepped.
#[derive(Resource, Debug, Clone, Default)]
pub struct Throughput {
    /// Projections of the last ticks, the older the less.
    projections: f64,
    /// Real time of the same ticks with the same weights [s].
    seconds: f64,
    shown: Option<f64>,
}

impl Throughput {
    /// Projections a second; `None` while time stands or all bodies sleep.
    #[must_use]
    pub const fn per_second(&self) -> Option<f64> {
        self.shown
    }

    /// Takes a tick in: how many constraints were projected in it, and how long it took [s].
    pub fn tick(&mut self, projections: f64, seconds: f64) {
        self.projections += (projections - self.projections) * FRESH;
        self.seconds += (seconds - self.seconds) * FRESH;
    }

    /// Shows what has been taken in until now.
    pub fn refresh(&mut self) {
        let counts = self.projections > 0.0 && self.seconds > 0.0;
        self.shown = counts.then(|| self.projections / self.seconds);
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        *self = Self::default();
    }
}

/// Follows the ticks.
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
    bodies: Query<(&SoftBody, Option<&Stretch>, Option<&Volume>), Active>,
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
            .map(|(body, stretch, volume)| {
                let effects = Effects {
                    stretch: stretch.copied(),
                    volume: volume.copied(),
                    ..default()
                };
                effects.constraints(body)
            })
            .sum();
        let sweeps = f64::from(settings.substeps.get()) * f64::from(settings.iterations.get());
        throughput.tick(constraints as f64 * sweeps, profile.solver().as_secs_f64());
    }
    *age += time.delta_secs();
    if *age >= 1.0 / REFRESH {
        *age = 0.0;
        throughput.refresh();
    }
}
