//! How many substeps a reference overlay can have, and how many bodies a reference overlay, so that it keeps pace.

use crate::solver::{Settings, Substeps, World, reference};
use std::time::Instant;

/// Least of the factors by which a reference overlay's substeps outnumber its body's: with it, a method of
/// first order leaves a quarter of the body's error in the reference overlay. With less, the two would be alike
/// for being wrong alike.
pub const LEAST: u32 = 4;

/// The most of them.
pub const MOST: u32 = 64;

/// Share of the time of a tick that a reference overlay is planned to take. The rest is for what else the
/// machine does meanwhile.
const SHARE: f64 = 0.6;

/// Share of a new measurement in the smoothed one.
const FRESH: f64 = 0.1;

/// What a sweep of all reference overlays costs, and by how much their substeps outnumber the bodies'.
#[derive(Debug, Clone, Copy)]
pub struct Pace {
    /// Time of one substep of one iteration [s].
    sweep: f64,
    /// Substeps and iterations of the bodies, for which `times` was chosen.
    of: (u32, u32),
    times: u32,
}

impl Pace {
    /// For reference overlays that take `tick` seconds with the bodies' own settings, where `room` seconds are
    /// there for each tick.
    #[must_use]
    pub fn new(tick: f64, settings: &Settings, room: f64) -> Self {
        let mut pace = Self {
            sweep: tick / sweeps(settings),
            of: (0, 0),
            times: LEAST,
        };
        pace.follow(settings, room);
        pace
    }

    /// By how much the reference overlays' substeps outnumber the bodies'.
    #[must_use]
    pub const fn times(&self) -> u32 {
        self.times
    }

    /// Chooses anew if the bodies' substeps or iterations are others than before.
    pub fn follow(&mut self, settings: &Settings, room: f64) {
        let of = (settings.substeps.get(), settings.iterations.get());
        if of != self.of {
            self.of = of;
            self.times = times(self.sweep * sweeps(settings), room);
        }
    }

    /// Takes in a tick of all reference overlays that took `spent` seconds; with half the substeps from now on
    /// if that is more than there is room for.
    pub fn observe(&mut self, spent: f64, settings: &Settings, room: f64) {
        let now = spent / (sweeps(settings) * f64::from(self.times));
        self.sweep += (now - self.sweep) * FRESH;
        let expected = self.sweep * sweeps(settings) * f64::from(self.times);
        if expected > room && self.times > LEAST {
            self.times /= 2;
        }
    }

    /// The reference overlays' settings: as the bodies', but for the substeps.
    #[must_use]
    pub fn settings(&self, bodies: &Settings) -> Settings {
        let wanted = bodies.substeps.get().saturating_mul(self.times);
        Settings {
            // There is a most; it is more than any body is worth.
            substeps: Substeps::new(wanted.min(Substeps::MAX)).unwrap_or(bodies.substeps),
            ..*bodies
        }
    }
}

fn sweeps(settings: &Settings) -> f64 {
    f64::from(settings.substeps.get()) * f64::from(settings.iterations.get())
}

/// The greatest power of two by which substeps that take `tick` seconds can be multiplied.
fn times(tick: f64, room: f64) -> u32 {
    let mut times = MOST;
    while times > LEAST && tick * f64::from(times) > room * SHARE {
        times /= 2;
    }
    times
}

/// How many of the bodies, from the first on, can have a reference overlay where `room` seconds are there for
/// each tick, and what a tick of these takes with the bodies' own settings [s]. The first always
/// has one.
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
        // The second finds everything in the caches, as those that follow will.
        let tick = (0..2)
            .map(|_| {
                let started = Instant::now();
                reference.tick();
                started.elapsed().as_secs_f64()
            })
            .fold(f64::INFINITY, f64::min);
        if count > 0 && (sum + tick) * f64::from(LEAST) > room * SHARE {
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
        // 0.6 of 16 ms are room for 9.6 times 1 ms, so for 8 times the substeps.
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
