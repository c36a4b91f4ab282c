//! Chooses the substeps of the references, and the number of bodies with a reference, to keep up
//! with the simulation.

use crate::solver::{Settings, Substeps, World, reference};
use std::time::Instant;

/// Minimum ratio of the reference's substeps to the body's. At this ratio, a first-order method
/// leaves a quarter of the body's error in the reference. At smaller ratios, the two would agree
/// because they share their error.
pub const LEAST: u32 = 4;

/// Maximum ratio.
pub const MOST: u32 = 64;

/// Fraction of the time of a tick that references may take. The rest is left for other work.
const FRACTION: f64 = 0.6;

/// Weight of a new measurement in the smoothed one.
const FRESH: f64 = 0.1;

/// Cost of one iteration of all references, and the ratio of their substeps to the bodies'.
#[derive(Debug, Clone, Copy)]
pub struct Pace {
    /// Time of one iteration of one substep [s].
    seconds: f64,
    /// Substeps and iterations of the bodies for which `times` was chosen.
    of: (u32, u32),
    times: u32,
}

impl Pace {
    /// For references that take `tick` seconds per tick with the bodies' own settings, if `room`
    /// seconds are available per tick.
    #[must_use]
    pub fn new(tick: f64, settings: &Settings, room: f64) -> Self {
        let mut pace = Self {
            seconds: tick / iterations_per_tick(settings),
            of: (0, 0),
            times: LEAST,
        };
        pace.follow(settings, room);
        pace
    }

    /// Ratio of the references' substeps to the bodies'.
    #[must_use]
    pub const fn times(&self) -> u32 {
        self.times
    }

    /// Chooses a new ratio if the bodies' substeps or iterations have changed.
    pub fn follow(&mut self, settings: &Settings, room: f64) {
        let of = (settings.substeps.get(), settings.iterations.get());
        if of != self.of {
            self.of = of;
            self.times = times(self.seconds * iterations_per_tick(settings), room);
        }
    }

    /// Records a tick of all references that took `spent` seconds. Halves the ratio if the expected
    /// time exceeds what is available.
    pub fn observe(&mut self, spent: f64, settings: &Settings, room: f64) {
        let now = spent / (iterations_per_tick(settings) * f64::from(self.times));
        self.seconds += (now - self.seconds) * FRESH;
        let expected = self.seconds * iterations_per_tick(settings) * f64::from(self.times);
        if expected > room && self.times > LEAST {
            self.times /= 2;
        }
    }

    /// Settings of the references: those of the bodies, except for the substeps.
    #[must_use]
    pub fn settings(&self, bodies: &Settings) -> Settings {
        let wanted = bodies.substeps.get().saturating_mul(self.times);
        Settings {
            // Limited to the maximum number of substeps.
            substeps: Substeps::new(wanted.min(Substeps::MAX)).unwrap_or(bodies.substeps),
            ..*bodies
        }
    }
}

fn iterations_per_tick(settings: &Settings) -> f64 {
    f64::from(settings.substeps.get()) * f64::from(settings.iterations.get())
}

/// The largest power of two by which the substeps of a tick of `tick` seconds can be multiplied.
fn times(tick: f64, room: f64) -> u32 {
    let mut times = MOST;
    while times > LEAST && tick * f64::from(times) > room * FRACTION {
        times /= 2;
    }
    times
}

/// Number of bodies, from the first on, that can have a reference if `room` seconds are available
/// per tick, and the time that a tick of their references takes with the bodies' own settings [s].
/// The first body always has one.
#[must_use]
pub fn fitting(world: &World, room: f64) -> (usize, f64) {
    let (mut count, mut sum) = (0, 0.0);
    for body in &world.bodies {
        let alone = World {
            bodies: vec![body.clone()],
            settings: world.settings,
            colliders: world.colliders.clone(),
            time: world.time,
            ..World::default()
        };
        let mut reference = reference::World::of(&alone);
        // The second run measures with warm caches, like later ticks.
        let tick = (0..2)
            .map(|_| {
                let started = Instant::now();
                reference.tick();
                started.elapsed().as_secs_f64()
            })
            .fold(f64::INFINITY, f64::min);
        if count > 0 && (sum + tick) * f64::from(LEAST) > room * FRACTION {
            break;
        }
        count += 1;
        sum += tick;
    }
    (count, sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten substeps of one iteration.
    fn settings() -> Settings {
        Settings::default()
    }

    #[test]
    fn as_many_substeps_are_taken_as_there_is_room_for() {
        // 0.6 of 16 ms allows 9.6 times 1 ms, so 8 times the substeps.
        assert_eq!(Pace::new(1e-3, &settings(), 16e-3).times(), 8);
        assert_eq!(Pace::new(1e-6, &settings(), 16e-3).times(), MOST);
        assert_eq!(Pace::new(1.0, &settings(), 16e-3).times(), LEAST);
        let pace = Pace::new(1e-3, &settings(), 16e-3);
        assert_eq!(pace.settings(&settings()).substeps.get(), 80);
    }

    #[test]
    fn more_substeps_of_the_body_leave_room_for_fewer_of_the_reference_overlay() {
        let mut pace = Pace::new(1e-3, &settings(), 16e-3);
        let finer = Settings {
            substeps: Substeps::new(20).expect("sound"),
            ..settings()
        };
        pace.follow(&finer, 16e-3);
        assert_eq!(pace.settings(&finer).substeps.get(), 80);
        pace.follow(&settings(), 16e-3);
        assert_eq!(pace.times(), 8, "and back again");
    }

    #[test]
    fn a_reference_overlay_that_does_not_keep_pace_takes_fewer_substeps_but_never_too_few() {
        let mut pace = Pace::new(1e-3, &settings(), 16e-3);
        pace.observe(15e-3, &settings(), 16e-3);
        assert_eq!(pace.times(), 8, "it fits, if barely");
        for _ in 0..100 {
            pace.observe(100e-3, &settings(), 16e-3);
        }
        assert_eq!(pace.times(), LEAST);
    }
}
