//! Criteria for sleeping and waking.
//!
//! Rest is determined from displacements over a whole tick: over one substep the rounding of
//! positions alone appears as a speed of about ε‖x‖/h.

use crate::{Particles, contact::collider::SweptCollider, topology::bounds};
use glam::{Vec3, Vec4};
use serde::{Deserialize, Serialize};

/// Sleep settings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SleepSettings {
    /// Whether bodies may sleep; default true.
    pub enabled: bool,
    /// A body is still while the root mean square speed of its particles is below this [m/s];
    /// default 1e-3.
    pub speed: f32,
    /// Time at rest before a body falls asleep [s]; default 0.5, longer than an oscillation stays
    /// at its turning point.
    pub after: f32,
}

impl Default for SleepSettings {
    fn default() -> Self {
        Self {
            enabled: true,
            speed: 1e-3,
            after: 0.5,
        }
    }
}

/// Duration of rest of a body.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct RestTimer {
    still_for: f32,
    /// Root mean square speed in the first tick at rest [m/s].
    speed: f32,
}

/// A body at rest must also be in balance: its acceleration is below this fraction of gravity.
/// Without this criterion a body that starts to fall in a gravity of 1e-3 m/s² would fall asleep.
const BALANCED: f32 = 0.1;

/// Number of particles between two comparisons of their sum with the limit.
const CHUNK: usize = 64;

impl RestTimer {
    /// Observes a tick of `seconds` under gravity of some strength [m/s²] that moved particles from
    /// `before` to `after`; returns whether the body may sleep.
    pub fn observe(
        &mut self,
        (before, after): (&[Vec4], &[Vec4]),
        seconds: f32,
        gravity: f32,
        settings: &SleepSettings,
    ) -> bool {
        let limit = settings.speed * seconds;
        let most = limit * limit * after.len() as f32;
        let mut moved = 0.0_f32;
        // The sum only grows, so that a body that moves is known by its first particles.
        for (before, after) in before.chunks(CHUNK).zip(after.chunks(CHUNK)) {
            for (a, b) in before.iter().zip(after) {
                moved += (b.truncate() - a.truncate()).length_squared();
            }
            if moved > most {
                self.still_for = 0.0;
                return false;
            }
        }
        let speed = (moved / after.len().max(1) as f32).sqrt() / seconds;
        if self.still_for == 0.0 {
            self.speed = speed;
        }
        let balanced = speed - self.speed <= BALANCED * gravity * self.still_for;
        self.still_for += seconds;
        settings.enabled && self.still_for >= settings.after && (balanced || gravity == 0.0)
    }

    /// Restarts the timer.
    pub fn reset(&mut self) {
        self.still_for = 0.0;
    }
}

/// Sleep state of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Wakefulness {
    /// Sleeping.
    Asleep,
    /// Awake, and moving or recently moved.
    Awake,
    /// Awake, and at rest for long enough to sleep.
    Still,
}

/// Lets bodies that touch each other sleep and wake together: a group with one that is awake is
/// awake, any other asleep. `touching` are pairs of indices.
pub fn settle(bodies: &mut [Wakefulness], touching: &[[u32; 2]]) {
    let mut changes = true;
    while changes {
        changes = false;
        for pair in touching {
            let [a, b] = pair.map(|place| bodies[place as usize] == Wakefulness::Awake);
            if a != b {
                let sleeper = pair[usize::from(a)];
                bodies[sleeper as usize] = Wakefulness::Awake;
                changes = true;
            }
        }
    }
    for body in bodies
        .iter_mut()
        .filter(|body| **body == Wakefulness::Still)
    {
        *body = Wakefulness::Asleep;
    }
}

/// Whether a sleeping body was moved or given a velocity since `start`; sleep itself does neither.
#[must_use]
pub fn written(particles: &Particles, start: &[Vec4]) -> bool {
    particles.positions != start || !particles.is_still()
}

/// Whether a collider that moves during a tick comes near a body with particles of at most this
/// radius [m] at these positions.
#[must_use]
pub fn disturbed(positions: &[Vec4], radius: f32, colliders: &[SweptCollider]) -> bool {
    if !colliders.iter().any(SweptCollider::moves) {
        return false;
    }
    let (low, high): (Vec3, Vec3) = bounds(positions.iter().map(|x| x.truncate()));
    let (low, high) = (low - radius, high + radius);
    colliders
        .iter()
        .any(|collider| collider.moves() && collider.near(low, high))
}
