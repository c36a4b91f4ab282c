//! When a body has come to rest, and what disturbs its sleep.
//!
//! Rest is judged by how far particles went in a whole tick: over one substep the rounding of
//! positions alone, near ε‖x‖/h, looks like a speed.

use crate::{Particles, contact::collider::SweptCollider, topology::bounds};
use glam::{Vec3, Vec4};
use serde::{Deserialize, Serialize};

/// When bodies fall asleep.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SleepSettings {
    /// Whether bodies sleep at all; default true.
    pub enabled: bool,
    /// A body is still while the root mean square speed of its particles is below this [m/s];
    /// default 1e-3.
    pub speed: f32,
    /// It falls asleep after being still for this long [s]; default 0.5, longer than a swing
    /// stands still at its turning point.
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

/// How long a body has been still.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct RestTimer {
    still_for: f32,
    /// Root mean square speed in the first tick of that [m/s].
    speed: f32,
}

/// A body is at rest where forces balance: where what is left of them speeds it up by less than this
/// share of gravity. Without it what begins to fall in a gravity of 1e-3 m/s² would fall asleep.
const BALANCED: f32 = 0.1;

impl RestTimer {
    /// Looks at a tick of `seconds` under gravity of some strength [m/s²] that took particles from
    /// `before` to `after`; true when it is time to sleep.
    pub fn observe(
        &mut self,
        (before, after): (&[Vec4], &[Vec4]),
        seconds: f32,
        gravity: f32,
        settings: &SleepSettings,
    ) -> bool {
        let moved: f32 = before
            .iter()
            .zip(after)
            .map(|(a, b)| (b.truncate() - a.truncate()).length_squared())
            .sum();
        let limit = settings.speed * seconds;
        if moved > limit * limit * after.len() as f32 {
            self.still_for = 0.0;
            return false;
        }
        let speed = (moved / after.len().max(1) as f32).sqrt() / seconds;
        if self.still_for == 0.0 {
            self.speed = speed;
        }
        let balanced = speed - self.speed <= BALANCED * gravity * self.still_for;
        self.still_for += seconds;
        settings.enabled && self.still_for >= settings.after && (balanced || gravity == 0.0)
    }

    /// Starts to count anew.
    pub fn reset(&mut self) {
        self.still_for = 0.0;
    }
}

/// Whether a body sleeps, is awake, or has been still for long enough to sleep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wakefulness {
    /// It sleeps.
    Asleep,
    /// It is awake, and moves or has moved of late.
    Awake,
    /// It is awake, and has been still for long enough.
    Still,
}

/// Lets bodies that touch each other sleep and wake together: a group with one that is awake is awake, any other
/// asleep. `touching` are pairs of places.
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

/// Whether somebody moved or kicked a sleeper since `start`: it does neither by itself.
#[must_use]
pub fn written(particles: &Particles, start: &[Vec4]) -> bool {
    particles.positions != start || !particles.is_still()
}

/// Whether a collider that moves during a tick comes near a body at these positions.
#[must_use]
pub fn disturbed(positions: &[Vec4], colliders: &[SweptCollider]) -> bool {
    if !colliders.iter().any(SweptCollider::moves) {
        return false;
    }
    let (low, high): (Vec3, Vec3) = bounds(positions.iter().map(|x| x.truncate()));
    colliders
        .iter()
        .any(|collider| collider.moves() && collider.near(low, high))
}
