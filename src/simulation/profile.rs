//! Real time of the parts of a tick.

use crate::solver::advance::{Stage, Watch};
use bevy::prelude::*;
use std::{
    sync::atomic::{AtomicU64, Ordering},
    time::{Duration, Instant},
};

/// Time of each stage, summed over all threads [ns].
#[derive(Debug)]
pub(super) struct StageWatch([AtomicU64; Stage::ALL.len()]);

impl Default for StageWatch {
    fn default() -> Self {
        Self([const { AtomicU64::new(0) }; Stage::ALL.len()])
    }
}

impl Watch for StageWatch {
    fn observe(&self, stage: Stage, work: &mut dyn FnMut()) {
        let started = Instant::now();
        work();
        let spent = started.elapsed().as_nanos() as u64;
        self.0[stage.place()].fetch_add(spent, Ordering::Relaxed);
    }
}

/// Name of the part of a tick in which statistics are taken.
pub const MEASURING: &str = "measuring";

/// Real time of a tick.
#[derive(Debug, Clone, Copy, Default)]
struct Spent {
    all: Duration,
    solver: Duration,
    measuring: Duration,
}

impl Spent {
    /// Extrapolates from a `fraction` of the substeps, above 0, to all of them.
    fn extrapolate(&mut self, fraction: f64) {
        self.all = self.all.div_f64(fraction);
        self.solver = self.solver.div_f64(fraction);
    }
}

/// Real time of ticks, and of each effect and stage if `by_part` is on.
#[derive(Resource, Debug, Clone, Default)]
pub struct Profile {
    /// Whether each effect and stage is timed; default false, as reading a clock twice per system
    /// and substep is not free.
    pub by_part: bool,
    running: Spent,
    tick: Spent,
    /// Real time of a substep in the last tick, with all that surrounds it.
    substep: Duration,
    /// Parts of the tick under way.
    running_parts: Vec<(&'static str, Duration)>,
    /// Parts of the last complete tick.
    parts: Vec<(&'static str, Duration)>,
}

impl Profile {
    /// Real time of the last complete tick: solver, statistics, and the ECS around them.
    #[must_use]
    pub const fn tick(&self) -> Duration {
        self.tick.all
    }

    /// Time of the solver: its substeps.
    #[must_use]
    pub const fn solver(&self) -> Duration {
        self.tick.solver
    }

    /// Time of taking statistics.
    #[must_use]
    pub const fn measuring(&self) -> Duration {
        self.tick.measuring
    }

    /// Remaining time: schedules, masses, sleep, transfer of bodies to the solver and back.
    #[must_use]
    pub fn ecs(&self) -> Duration {
        let known = self.tick.solver + self.tick.measuring;
        self.tick.all.saturating_sub(known)
    }

    /// Real time of each effect and stage in the last complete tick, in execution order. Where
    /// several ran concurrently, the time is distributed in proportion to their thread time.
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

    /// Distributes `spent` over the stages in proportion to their time summed over all threads.
    pub(super) fn distribute(&mut self, spent: Duration, watch: &StageWatch) {
        let of_stage = |stage: Stage| watch.0[stage.place()].load(Ordering::Relaxed) as f64;
        let all: f64 = Stage::ALL.into_iter().map(of_stage).sum();
        for stage in Stage::ALL {
            let fraction = of_stage(stage) / all;
            if fraction > 0.0 {
                self.add(stage.name(), spent.mul_f64(fraction));
            }
        }
    }

    /// Adds real time of the solver to the tick under way.
    pub(super) fn solve(&mut self, spent: Duration) {
        self.running.solver += spent;
    }

    /// Adds real time of taking statistics to the tick under way.
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

    /// Number of substeps that fit into some real time by the last tick; at least 1.
    pub(super) fn substeps_in(&self, time: Duration) -> u32 {
        let fitting = time.as_nanos() / self.substep.as_nanos().max(1);
        match self.substep {
            Duration::ZERO => 1,
            _ => u32::try_from(fitting).unwrap_or(u32::MAX).max(1),
        }
    }

    /// Adds real time to the tick under way, and closes the tick if it has `ended`: after a number
    /// of substeps out of the number in a whole one. The times of a tick that ended early are
    /// extrapolated to a whole one.
    pub(super) fn spend(&mut self, spent: Duration, ended: Option<[u32; 2]>) {
        self.running.all += spent;
        let Some([substeps, all]) = ended else {
            return;
        };
        self.tick = self.running;
        self.parts.clone_from(&self.running_parts);
        self.substep = self.tick.all / substeps.max(1);
        if substeps < all {
            let fraction = f64::from(substeps.max(1)) / f64::from(all);
            self.tick.extrapolate(fraction);
            for (_, spent) in &mut self.parts {
                *spent = spent.div_f64(fraction);
            }
        }
    }
}
