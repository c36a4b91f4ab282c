//! Where the time of a tick goes.

use bevy::prelude::*;
use std::time::{Duration, Instant};

/// Real time spent in ticks, and in each effect and stage if `by_part` is on.
#[derive(Resource, Debug, Clone, Default)]
pub struct Profile {
    /// Whether each effect and stage is timed; default false, as looking at a clock twice a
    /// system a substep is not free.
    pub by_part: bool,
    running: Duration,
    tick: Duration,
    /// Of the tick under way.
    running_parts: Vec<(&'static str, Duration)>,
    /// Of the last whole tick.
    parts: Vec<(&'static str, Duration)>,
}

impl Profile {
    /// Real time of the last whole tick.
    #[must_use]
    pub const fn tick(&self) -> Duration {
        self.tick
    }

    /// Real time of each effect and stage in the last whole tick, in the order in which they ran.
    #[must_use]
    pub fn parts(&self) -> &[(&'static str, Duration)] {
        &self.parts
    }

    /// Runs `work` as a part of the tick.
    pub fn time(&mut self, part: &'static str, work: impl FnOnce()) {
        if !self.by_part {
            return work();
        }
        let started = Instant::now();
        work();
        let spent = started.elapsed();
        match self
            .running_parts
            .iter_mut()
            .find(|(name, _)| *name == part)
        {
            Some((_, sum)) => *sum += spent,
            None => self.running_parts.push((part, spent)),
        }
    }

    pub(super) fn begin_tick(&mut self) {
        self.running = Duration::ZERO;
        self.running_parts.clear();
    }

    /// Adds real time that was spent in the tick, and closes it if it has `ended`.
    pub(super) fn spend(&mut self, spent: Duration, ended: bool) {
        self.running += spent;
        if ended {
            self.tick = self.running;
            self.parts.clone_from(&self.running_parts);
        }
    }
}
