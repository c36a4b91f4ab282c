//! What a study may spend, and on which settings.
//!
//! Limits are in work, not in time, so that the same points are skipped on every machine.

use super::{
    problem::Case,
    setting::{Method, Setting},
};
use std::time::Duration;

/// What a study may spend.
#[derive(Debug, Clone, PartialEq)]
pub struct Budget {
    /// `quick` or `full`.
    pub name: &'static str,
    /// Substeps that are tried on the coarsest mesh.
    pub substeps: Vec<u32>,
    /// Iterations that are tried on the coarsest mesh.
    pub iterations: Vec<u32>,
    /// Substeps and iterations on finer meshes.
    pub finer: (Vec<u32>, Vec<u32>),
    /// Work of a run at most, see [`work`].
    pub run: u64,
    /// Work of the three runs of the f64 reference at most.
    pub converged: u64,
    /// Projections of a tick at most, where a tick is timed.
    pub tick: u64,
    /// Rounds in which every setting of a case is timed once, after one to warm up.
    pub rounds: usize,
    /// How long a setting is timed in a round, or a tick if that is longer.
    pub slot: Duration,
}

impl Budget {
    /// Under a minute on two cores.
    #[must_use]
    pub fn quick() -> Self {
        Self {
            name: "quick",
            substeps: vec![1, 4, 16, 64, 256],
            iterations: vec![1, 4, 16],
            finer: (vec![4, 16, 64], vec![1]),
            run: 15_000_000,
            converged: 80_000_000,
            tick: 1_000_000,
            rounds: 5,
            slot: Duration::from_millis(2),
        }
    }

    /// Under half an hour on two cores.
    #[must_use]
    pub fn full() -> Self {
        let powers = |most: u32| (0..).map(|n| 1 << n).take_while(|&n| n <= most).collect();
        Self {
            name: "full",
            substeps: powers(1024),
            iterations: powers(64),
            finer: (vec![1, 4, 16, 64, 256], vec![1, 4, 16]),
            run: 80_000_000,
            converged: 1_500_000_000,
            tick: 10_000_000,
            rounds: 7,
            slot: Duration::from_millis(4),
        }
    }

    /// Every setting that is asked about a case, whether it can be afforded or not.
    #[must_use]
    pub fn settings(&self, case: &Case) -> Vec<Setting> {
        let (substeps, iterations) = if case.level == 0 {
            (&self.substeps, &self.iterations)
        } else {
            (&self.finer.0, &self.finer.1)
        };
        let mut all = Vec::new();
        for method in Method::ALL {
            if method != Method::Xpbd && !method.differs(&case.world) {
                continue;
            }
            for &substeps in substeps {
                // Newton has converged with its first step.
                let iterations = match method {
                    Method::Direct => &iterations[..1],
                    Method::Xpbd | Method::Pbd => &iterations[..],
                };
                all.extend(iterations.iter().map(|&iterations| Setting {
                    method,
                    substeps,
                    iterations,
                }));
            }
        }
        all
    }

    /// Simulated time that a run at this setting may take [s], if it can be afforded: all that is
    /// observed, or, to come to rest, at least two seconds.
    #[must_use]
    pub fn run_seconds(&self, case: &Case, setting: Setting) -> Option<f64> {
        let all = case.problem.observe.seconds();
        let affordable = all * self.run as f64 / work(case, setting) as f64;
        let enough =
            affordable >= all || (case.problem.observe.is_static() && affordable >= MIN_REST);
        enough.then_some(affordable.min(all))
    }

    /// Whether this setting can be timed.
    #[must_use]
    pub fn affords_time(&self, case: &Case, setting: Setting) -> bool {
        setting.projections(&case.world) <= self.tick
    }

    /// Whether the f64 reference's three runs can be afforded.
    #[must_use]
    pub fn affords_reference(&self, case: &Case) -> bool {
        reference_work(case) <= self.converged
    }

    /// The budget in words, for its hash.
    #[must_use]
    pub fn words(&self) -> String {
        format!("{self:?}")
    }
}

/// A body that has less time to come to rest would not [s].
const MIN_REST: f64 = 2.0;

/// Work of a run to its end: projections, with what a sweep and a substep take beside them, as
/// if they were projections too.
#[must_use]
pub fn work(case: &Case, setting: Setting) -> u64 {
    let ticks = case.problem.observe.seconds() * case.world.settings.rate.get();
    let sweep = case.constraints() as u64 + 16;
    // A factorization of a slender body takes about as long as so many sweeps.
    let sweeps = match setting.method {
        Method::Direct => 32,
        Method::Xpbd | Method::Pbd => 1,
    };
    let substep = sweeps * u64::from(setting.iterations) * sweep + 2 * case.particles() as u64 + 16;
    ticks.round().max(1.0) as u64 * u64::from(setting.substeps) * substep
}

/// The same for all runs of the f64 reference; bodies come to rest in a fraction of the time that they
/// have, as they begin near it.
#[must_use]
pub fn reference_work(case: &Case) -> u64 {
    let converged = case.problem.converged;
    let each = work(
        case,
        Setting::xpbd(converged.substeps, converged.iterations),
    );
    if case.problem.observe.is_static() && converged.keeps_multipliers {
        each * 3 / 4
    } else if case.problem.observe.is_static() {
        each * 7 / 4
    } else {
        each * 7
    }
}
