//! Limits and settings of a study.
//!
//! Limits are in work, not in time, so that the same points are skipped on every machine.

use super::{
    problem::Case,
    setting::{Method, Setting},
};
use std::time::Duration;

/// Limits and settings of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Budget {
    /// `quick` or `full`.
    pub name: &'static str,
    /// Numbers of substeps on the coarsest mesh.
    pub substeps: Vec<u32>,
    /// Numbers of iterations on the coarsest mesh.
    pub iterations: Vec<u32>,
    /// Substeps and iterations on finer meshes.
    pub finer: (Vec<u32>, Vec<u32>),
    /// Limit on the work of a run, see [`Case::work`].
    pub run: u64,
    /// Limit on the work of the three runs of the f64 reference.
    pub converged: u64,
    /// Limit on the projections of a tick that is timed.
    pub tick: u64,
    /// Rounds in which every setting of a case is timed once, after one warm-up round.
    pub rounds: usize,
    /// Time for which a setting is measured in a round; at least one tick.
    pub slot: Duration,
}

impl Budget {
    /// Less than a minute on two cores.
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

    /// Less than half an hour on two cores.
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

    /// All settings of a case, whether they are within the limits or not.
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
                // Newton's method converges in its first step.
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

    /// Simulated time that a run at this setting may take [s], if it is within the limits: the
    /// whole observed time, or at least two seconds to come to rest.
    #[must_use]
    pub fn run_seconds(&self, case: &Case, setting: Setting) -> Option<f64> {
        let all = case.problem.observe.seconds();
        let affordable = all * self.run as f64 / case.work(setting) as f64;
        let enough =
            affordable >= all || (case.problem.observe.is_static() && affordable >= MIN_REST);
        enough.then_some(affordable.min(all))
    }

    /// Whether timing this setting is within the limits.
    #[must_use]
    pub fn affords_time(&self, case: &Case, setting: Setting) -> bool {
        setting.projections(&case.world) <= self.tick
    }

    /// Whether the three runs of the f64 reference are within the limits.
    #[must_use]
    pub fn affords_reference(&self, case: &Case) -> bool {
        case.reference_work() <= self.converged
    }

    /// The budget as text, for its hash.
    #[must_use]
    pub fn words(&self) -> String {
        format!("{self:?}")
    }
}

/// Minimum time to come to rest [s]; bodies do not settle in less.
const MIN_REST: f64 = 2.0;

impl Case {
    /// Work of a complete run: projections, plus the overhead per iteration and per substep in units of
    /// projections.
    #[must_use]
    pub fn work(&self, setting: Setting) -> u64 {
        let ticks = self.problem.observe.seconds() * self.world.settings.rate.get();
        let each = self.constraints() as u64 + 16;
        // The factorization of a slender body takes about as long as this many iterations.
        let iterations = match setting.method {
            Method::Direct => 32,
            Method::Xpbd | Method::Pbd => 1,
        };
        let substep =
            iterations * u64::from(setting.iterations) * each + 2 * self.particles() as u64 + 16;
        ticks.round().max(1.0) as u64 * u64::from(setting.substeps) * substep
    }

    /// Work of all runs of the f64 reference. Bodies start near rest there and settle in a fraction of
    /// their time.
    #[must_use]
    pub fn reference_work(&self) -> u64 {
        let converged = self.problem.converged;
        let each = self.work(Setting::xpbd(converged.substeps, converged.iterations));
        if self.problem.observe.is_static() && converged.keeps_multipliers {
            each * 3 / 4
        } else if self.problem.observe.is_static() {
            each * 7 / 4
        } else {
            each * 7
        }
    }
}
