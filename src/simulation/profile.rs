//! Where the time of a tick goes.

use crate::solver::advance::{Stage, Watch};
use bevy::prelude::*;
use std::{
    sync::atomic::{AtomicU64, Ordering},
    time::{Duration, Instant},
};

/// Nanoseconds that all threads together spent in each stage.
#[derive(Debug, Default)]
pub(super) struct StageWatch([AtomicU64; Stage::ALL.len()]);

impl Watch for StageWatch {
    fn see(&self, stage: Stage, work: &mut dyn FnMut()) {
        let started = Instant::now();
        work();
        let spent = started.elapsed().as_nanos() as u64;
        self.0[stage.place()].fetch_add(spent, Ordering::Relaxed);
    }
}

/// The part of a tick in which figures of the state are taken.
pub const MEASURING: &str = "measuring";

/// What a tick took.
#[derive(Debug, Clone, Copy, Default)]
struct Spent {
    all: Duration,
    solver: Duration,
    measuring: Duration,
}

/// Real time spent in ticks, and in each effect and stage if `by_part` is on.
#[derive(Resource, Debug, Clone, Default)]
pub struct Profile {
    /// Whether each effect and stage is timed; default false, as looking at a clock twice a
    /// system a substep is not free.
    pub by_part: bool,
    running: Spent,
    tick: Spent,
    /// Of the tick under way.
    running_parts: Vec<(&'static str, Duration)>,
    /// Of the last whole tick.
    parts: Vec<(&'static str, Duration)>,
}

impl Profile {
    /// Real time of the last whole tick: solver, measuring, and what the ECS takes around them.
    #[must_use]
    pub const fn tick(&self) -> Duration {
        self.tick.all
    }

    /// What the solver took of it: its substeps.
    #[must_use]
    pub const fn solver(&self) -> Duration {
        self.tick.solver
    }

    /// What it took to take figures of the state, for those who look at them.
    #[must_use]
    pub const fn measuring(&self) -> Duration {
        self.tick.measuring
    }

    /// What is left: schedules, masses, sleep, moving bodies into the solver and back.
    #[must_use]
    pub fn ecs(&self) -> Duration {
        let known = self.tick.solver + self.tick.measuring;
        self.tick.all.saturating_sub(known)
    }

    /// Real time of each effect and stage in the last whole tick, in the order in which they ran.
    /// Where threads worked on several at once, the time is shared out by how long each took them.
    #[must_use]
    pub fn parts(&self) -> &[(&'static str, Duration)] {
        &self.parts
    }

    fn add(&mut self, part: &'static str, spent: Duration) {
        match self
            .running_parts
            .iter_mut()
            .find(|(name, _)| *name == part)
        {
            Some((_, sum)) => *sum += spent,
            None => self.running_parts.push((part, spent)),
        }
    }

    /// Shares `spent` out among the stages, by the time that all threads took for each.
    pub(super) fn share_out(&mut self, spent: Duration, watch: &StageWatch) {
        let of_stage = |stage: Stage| watch.0[stage.place()].load(Ordering::Relaxed) as f64;
        let all: f64 = Stage::ALL.into_iter().map(of_stage).sum();
        for stage in Stage::ALL {
            let share = of_stage(stage) / all;
            if share > 0.0 {
                self.add(stage.name(), spent.mul_f64(share));
            }
        }
    }

    /// Adds real time of the solver in the tick under way.
    pub(super) fn solve(&mut self, spent: Duration) {
        self.running.solver += spent;
    }

    /// Adds real time that figures took in it.
    pub(super) fn measure(&mut self, spent: Duration) {
        self.running.measuring += spent;
        if self.by_part {
            self.add(MEASURING, spent);
        }
    }

    pub(super) fn begin_tick(&mut self) {
        self.running = Spent::default();
        self.running_parts.clear();
    }

    /// Adds real time that was spent in the tick, and closes it if it has `ended`.
    pub(super) fn spend(&mut self, spent: Duration, ended: bool) {
        self.running.all += spent;
        if ended {
            self.tick = self.running;
            self.parts.clone_from(&self.running_parts);
        }
    }
}
