//! Criteria for sleeping and waking.
//!
//! Rest is determined from displacements over a whole tick: over one substep the rounding of
//! positions alone appears as a speed of about ε‖x‖/h.
//!
//! How slow is still depends on the body. What still comes is at most its speed times the longest time
//! T over which its effects act, so that this product must be below 0.25 % of its size: a weight that
//! sinks by a meter in a damper of τ = 100 s is awake at 0.03 mm/s. A body that nothing
//! holds and that touches nothing keeps its speed for good, and is awake at any that is not rounding. One
//! that touches only without friction keeps that of its center, and is awake while that drifts.

use crate::{
    Effects, ElasticKind, ForceKind, InvalidValue, Particles, Topology,
    colliders::collider::SweptCollider, topology::bounds,
};
use glam::{Vec3, Vec4};
use serde::{Deserialize, Deserializer, Serialize, de::Error as _};

/// Sleep settings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SleepSettings {
    /// Whether bodies may sleep; default true.
    pub enabled: bool,
    /// A body is still while the root mean square speed of its particles is below this [m/s], and below
    /// what its [size and effects](self) allow; at least 0, at which no body sleeps; default 1e-3.
    #[serde(deserialize_with = "not_negative")]
    pub speed: f32,
    /// Time at rest before a body falls asleep [s]; default 0.5, longer than an oscillation stays
    /// at its turning point; at least 0.
    #[serde(deserialize_with = "not_negative")]
    pub after: f32,
}

/// A finite number, at least 0.
fn not_negative<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f32, D::Error> {
    let value = f32::deserialize(deserializer)?;
    if value.is_finite() && value >= 0.0 {
        return Ok(value);
    }
    Err(D::Error::custom(InvalidValue {
        quantity: "speed or time of sleep",
        value: value.into(),
        valid: "a finite number, at least 0",
    }))
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

/// A body at rest still moves by less than this fraction of its size.
const REMAINDER: f32 = 2.5e-3;

/// The shortest time over which a body is assumed to move on at its speed [s]: half of a slow oscillation.
const SHORTEST: f32 = 0.5;

/// The speed of rounding, in sizes per second. A body in free motion is awake above it.
const ROUNDING: f32 = 1e-6;

/// The speed of the center of a body at rest that no friction holds, in sizes per second: its size in a
/// day.
const DRIFT: f32 = 1e-5;

/// What decides how slow a body is at rest.
#[derive(Debug, Clone, Copy)]
pub struct Calm<'a> {
    /// Its topology.
    pub topology: &'a Topology,
    /// Its effects.
    pub effects: &'a Effects,
    /// Whether it touched something in the tick, or is stitched to something.
    pub is_touched: bool,
    /// Strength of gravity [m/s²].
    pub gravity: f32,
}

impl Calm<'_> {
    /// Whether a body is at rest whose particles have moved from `before` to `after` in a tick of
    /// `seconds`, at a root mean square `speed` [m/s].
    #[must_use]
    pub fn holds(&self, (before, after): (&[Vec4], &[Vec4]), seconds: f32, speed: f32) -> bool {
        let (low, high) = bounds(after.iter().map(|x| x.truncate()));
        let size = (high - low).max_element() + 2.0 * self.topology.largest_radius();
        let mut forces = ForceKind::ALL.into_iter();
        let is_fixed = forces.any(|kind| self.effects.has_force(kind)) || self.has_pin(after);
        if !is_fixed && !self.is_touched {
            return speed <= ROUNDING * size;
        }
        let slowest = self.effects.slowest(size, self.gravity).max(SHORTEST);
        if speed > REMAINDER * size / slowest {
            return false;
        }
        let ways = before.iter().zip(after).map(|(a, b)| (*b - *a).truncate());
        let drift = || ways.sum::<Vec3>().length() / (after.len() as f32 * seconds);
        is_fixed || self.effects.has_friction() || drift() <= DRIFT * size
    }

    /// Whether a particle is fixed that others are connected to: a vertex without elements never moves.
    fn has_pin(&self, positions: &[Vec4]) -> bool {
        let is_fixed = |i: &u32| positions[*i as usize].w == 0.0;
        match self.topology.radii.is_empty() {
            true => self.topology.components().members().iter().any(is_fixed),
            false => positions.iter().any(|x| x.w == 0.0),
        }
    }
}

impl Effects {
    /// Whether anything that the body may touch holds it by friction.
    fn has_friction(&self) -> bool {
        let of = [
            self.ground.map(|it| it.friction),
            self.collide.map(|it| it.friction),
            self.contact.map(|it| it.friction),
        ];
        let mut of = of.into_iter().flatten();
        self.sticky_ground.is_some() || of.any(|friction| friction.get() > 0.0)
    }

    /// The longest time over which an effect acts on a body of some size [m] under gravity [m/s²]: that
    /// of damping, creep, and of sinking by its size in a medium with drag [s].
    fn slowest(&self, size: f32, gravity: f32) -> f32 {
        let elastic = ElasticKind::ALL
            .into_iter()
            .filter_map(|kind| self.damping(kind));
        let others = [
            self.shape_matching.map(|it| it.damping),
            self.rod.map(|it| it.damping),
        ];
        let damping = elastic
            .chain(others.into_iter().flatten())
            .map(|it| it.get());
        let creep = self.plasticity.map(|it| 1.0 / it.creep.get());
        let creep = creep.filter(|seconds| seconds.is_finite());
        let drag = [
            self.drag.map(|it| it.linear),
            self.vortex.map(|it| it.coupling),
            self.axis.map(|it| it.coupling),
            self.stream.map(|it| it.coupling),
            self.turbulence.map(|it| it.coupling),
        ];
        let sinking = drag
            .into_iter()
            .flatten()
            .map(|it| it.get() * size / gravity);
        let sinking = sinking.filter(|seconds| seconds.is_finite());
        damping.chain(creep).chain(sinking).fold(0.0, f32::max)
    }
}

/// Number of particles between two comparisons of their sum with the limit.
const CHUNK: usize = 64;

impl RestTimer {
    /// Observes a tick of `seconds` under gravity of some strength [m/s²] that moved the particles of a body
    /// from `before` to `after`; returns whether the body may sleep. `calm` tells whether it is at rest at
    /// a speed [m/s], and is asked only of slow bodies.
    pub fn observe(
        &mut self,
        (before, after): (&[Vec4], &[Vec4]),
        (seconds, gravity): (f32, f32),
        calm: impl FnOnce(f32) -> bool,
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
        if !calm(speed) {
            self.still_for = 0.0;
            return false;
        }
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

/// Whether a collider that moves during a tick comes near a body with particles at these positions.
#[must_use]
pub fn disturbed(
    topology: &Topology,
    effects: &Effects,
    positions: &[Vec4],
    colliders: &[SweptCollider],
) -> bool {
    if effects.collide.is_none() || !colliders.iter().any(SweptCollider::moves) {
        return false;
    }
    let (low, high): (Vec3, Vec3) = bounds(positions.iter().map(|x| x.truncate()));
    let reach = topology.largest_radius() + effects.collider_distance(topology.surface().mean_edge);
    let (low, high) = (low - reach, high + reach);
    colliders
        .iter()
        .any(|collider| collider.moves() && collider.near(low, high))
}
