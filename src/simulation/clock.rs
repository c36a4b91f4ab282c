//! The clock of the simulation: pause, single steps, speed, and a bound on catching up.

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

/// When ticks happen. Writing a field takes effect at the next tick.
#[derive(Resource, Debug, Clone)]
pub struct SimulationClock {
    /// Whether time stands still; default false.
    pub paused: bool,
    /// Simulated seconds a real second, between 0 and 100; default 1. The length of a tick does
    /// not depend on it.
    pub speed: f64,
    /// Real time at most that ticks catch up with in one run of the outer schedule; default 0.25 s. What is beyond is
    /// dropped, so that a slow computer shows slow motion and never stands still.
    pub catch_up: Duration,
    /// Real time for ticks in one run of the outer schedule; default none. Ticks that take
    /// longer are spread over several runs, which keeps a window alive whatever a tick costs.
    pub budget: Option<Duration>,
    /// Whether no tick begins because something that goes along with the simulation has not caught
    /// up; default false. A tick under way is finished. What would have been due is dropped.
    pub held: bool,
    /// Time since the scene began [s].
    pub(super) time: f64,
    /// Ticks since the scene began.
    pub(super) tick: u64,
    /// The next substep, while a tick is under way.
    pub(super) next_substep: Option<u32>,
    waiting: f64,
    tick_seconds: f64,
    steps_asked: u32,
    dropped: u64,
}

impl Default for SimulationClock {
    fn default() -> Self {
        Self {
            paused: false,
            speed: 1.0,
            catch_up: Duration::from_millis(250),
            budget: None,
            held: false,
            time: 0.0,
            tick: 0,
            next_substep: None,
            waiting: 0.0,
            tick_seconds: 1.0 / 60.0,
            steps_asked: 0,
            dropped: 0,
        }
    }
}

impl SimulationClock {
    /// Simulated time since the scene began [s].
    #[must_use]
    pub const fn time(&self) -> f64 {
        self.time
    }

    /// Ticks since the scene began.
    #[must_use]
    pub const fn tick(&self) -> u64 {
        self.tick
    }

    /// Whether a tick has begun and not yet ended, because of the `budget`.
    #[must_use]
    pub const fn mid_tick(&self) -> bool {
        self.next_substep.is_some()
    }

    /// Ticks that could not be caught up since the scene began.
    #[must_use]
    pub const fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Asks for one tick, paused or not.
    pub fn step_once(&mut self) {
        self.steps_asked += 1;
    }

    /// How far real time is into the next tick, from 0 to 1: draw bodies this far between
    /// [`TickStart`](super::TickStart) and where they are. 0 in mid-tick, 1 when paused.
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

    /// Back to the beginning of a scene; pause, speed and bounds stay.
    pub fn restart(&mut self) {
        *self = Self {
            paused: self.paused,
            speed: self.speed,
            catch_up: self.catch_up,
            budget: self.budget,
            ..Self::default()
        };
    }

    /// Lets `real` time pass, with ticks of `tick_seconds`.
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
        // One more than the bound may wait, so that a tick that is due a hair late is not lost.
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

    /// Whether a tick is due; takes it off what waits.
    pub(super) fn take_tick(&mut self) -> bool {
        // Durations are whole nanoseconds: a tick that is due within one of them is due.
        const NANOSECOND: f64 = 1e-9;
        if self.held {
            return false;
        }
        if self.steps_asked > 0 {
            self.steps_asked -= 1;
            return true;
        }
        if self.paused || self.waiting + NANOSECOND < self.tick_seconds {
            return false;
        }
        self.waiting = (self.waiting - self.tick_seconds).max(0.0);
        true
    }
}
