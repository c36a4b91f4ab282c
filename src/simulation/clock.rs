//! The clock of the simulation: pause, single steps, speed, and a limit on catching up.

use bevy::prelude::*;
use std::time::Duration;

/// The clock of a tick: `Res<Time<Tick>>`, and `Res<Time>` inside
/// [`StepSchedule`](super::StepSchedule).
#[derive(Debug, Clone, Copy, Default)]
pub struct Tick;

/// The clock of a substep: `Res<Time<SubstepTime>>`, and `Res<Time>` inside
/// [`SubstepSchedule`](super::SubstepSchedule).
#[derive(Debug, Clone, Copy, Default)]
pub struct SubstepTime;

/// Controls when ticks happen. Changes take effect at the next tick.
#[derive(Resource, Debug, Clone)]
pub struct SimulationClock {
    /// Whether the simulation is paused; default false.
    pub paused: bool,
    /// Simulated seconds per real second, between 0 and 100; default 1. The length of a tick does
    /// not depend on it.
    pub speed: f64,
    /// Maximum real time to catch up in one run of the outer schedule; default 0.25 s. Ticks beyond
    /// it are dropped, so that a slow computer shows slow motion and never stalls.
    pub catch_up: Duration,
    /// Real time for ticks in one run of the outer schedule; default none. Longer ticks are spread
    /// over several runs, which keeps a window responsive at any cost of a tick.
    pub budget: Option<Duration>,
    /// Real time for which an action may wait for the end of a tick that is spread over several
    /// runs; default none. A tick that takes longer ends early, after a whole substep, and
    /// triggers [`EndedEarly`](super::EndedEarly): a program remains responsive at any cost of a
    /// tick, at the price of ticks of unequal length. A substep is never interrupted.
    pub patience: Option<Duration>,
    /// Whether no tick may begin until a follower of the simulation, such as the reference overlay,
    /// has caught up; default false. A tick under way is finished. Ticks that become due meanwhile
    /// are dropped.
    pub held: bool,
    /// Time since the start of the scene [s].
    pub(super) time: f64,
    /// Ticks since the start of the scene.
    pub(super) tick: u64,
    /// The next substep, while a tick is under way.
    pub(super) next_substep: Option<u32>,
    waiting: f64,
    tick_seconds: f64,
    steps_requested: u32,
    dropped: u64,
}

impl Default for SimulationClock {
    fn default() -> Self {
        Self {
            paused: false,
            speed: 1.0,
            catch_up: Duration::from_millis(250),
            budget: None,
            patience: None,
            held: false,
            time: 0.0,
            tick: 0,
            next_substep: None,
            waiting: 0.0,
            tick_seconds: 1.0 / 60.0,
            steps_requested: 0,
            dropped: 0,
        }
    }
}

impl SimulationClock {
    /// Simulated time since the start of the scene [s].
    #[must_use]
    pub const fn time(&self) -> f64 {
        self.time
    }

    /// Ticks since the start of the scene.
    #[must_use]
    pub const fn tick(&self) -> u64 {
        self.tick
    }

    /// Whether a tick is under way, interrupted because of the `budget`.
    #[must_use]
    pub const fn mid_tick(&self) -> bool {
        self.next_substep.is_some()
    }

    /// Number of dropped ticks since the start of the scene.
    #[must_use]
    pub const fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Requests one tick, even while paused.
    pub fn step_once(&mut self) {
        self.steps_requested += 1;
    }

    /// Fraction of the next tick that has passed in real time, from 0 to 1: draw bodies
    /// interpolated by it between [`TickStart`](super::TickStart) and their current state. 0 in
    /// mid-tick, 1 when paused.
    #[must_use]
    pub fn overstep(&self) -> f32 {
        if self.mid_tick() {
            0.0
        } else if self.paused {
            1.0
        } else {
            (self.waiting / self.tick_seconds).clamp(0.0, 1.0) as f32
        }
    }

    /// Resets the clock to the start of a scene; pause, speed and limits are kept.
    pub fn restart(&mut self) {
        *self = Self {
            paused: self.paused,
            speed: self.speed,
            catch_up: self.catch_up,
            budget: self.budget,
            patience: self.patience,
            ..Self::default()
        };
    }

    /// Advances by `real` time, with ticks of `tick_seconds`.
    pub(super) fn advance(&mut self, real: Duration, tick_seconds: f64) {
        self.tick_seconds = tick_seconds;
        if self.paused {
            return;
        }
        let speed = if self.speed.is_finite() {
            self.speed.clamp(0.0, 100.0)
        } else {
            1.0
        };
        self.waiting += real.as_secs_f64() * speed;
        // One more than the limit may be pending, so that a tick that is slightly late is not
        // dropped.
        let bound = match self.held {
            true => 1.0,
            false => (self.catch_up.as_secs_f64() * speed / tick_seconds).max(1.0),
        };
        let most = bound + 1.0;
        let due = self.waiting / tick_seconds;
        if due > most {
            let dropped = (due - most).ceil();
            self.dropped += dropped as u64;
            self.waiting -= dropped * tick_seconds;
        }
    }

    /// Whether a tick is due; removes it from the pending ones.
    pub(super) fn take_tick(&mut self) -> bool {
        // Durations are whole nanoseconds: a tick that is due within 1 ns counts as due.
        const NANOSECOND: f64 = 1e-9;
        if self.held {
            return false;
        }
        if self.steps_requested > 0 {
            self.steps_requested -= 1;
            return true;
        }
        if self.paused || self.waiting + NANOSECOND < self.tick_seconds {
            return false;
        }
        self.waiting = (self.waiting - self.tick_seconds).max(0.0);
        true
    }
}
