//! Runs a scene in every peer, in turn, and times it.
//!
//! All runs of a scene are built first, warmed up by the same number of ticks, and examined. Then
//! they are timed in rounds, each for a slice of time in turn, so that other load on the machine
//! affects all of them. A figure is the median of the rounds.

use crate::{
    peer::{Counts, Peer, PeerError, Run},
    sanity::{Residual, examine},
    scenes::{SUBSTEPS, Scene},
};
use serde::Serialize;
use std::time::{Duration, Instant};

/// Duration of the measurement.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Effort {
    /// Ticks before the first round.
    pub warm_up: u32,
    /// Number of rounds.
    pub rounds: u32,
    /// Time of one run in a round.
    pub slice: Duration,
    /// Limit on the total time of one run; a slower one gets fewer ticks and rounds.
    pub budget: Duration,
}

/// Outcome of one scene in one peer, with a number of threads.
#[derive(Debug, Clone, Serialize)]
pub struct Outcome {
    /// Name of the scene.
    pub scene: &'static str,
    /// Name of the peer.
    pub peer: &'static str,
    /// Number of threads.
    pub threads: usize,
    /// The figures, or the reason why there are none.
    pub figures: Result<Figures, String>,
}

/// The figures of a run.
#[derive(Debug, Clone, Serialize)]
pub struct Figures {
    /// Number of constraints in the peer.
    pub counts: Counts,
    /// Time of a tick in each round [ms].
    pub rounds: Vec<f64>,
    /// Time of a tick [ms].
    pub tick: Spread,
    /// Million constraint projections per second.
    pub rate: Spread,
    /// Number of ticks before the residual was measured.
    pub residual_after: u32,
    /// Residual of the constraints after these ticks.
    pub residual: Residual,
}

/// A median with its range.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Spread {
    /// Minimum.
    pub least: f64,
    /// Median.
    pub median: f64,
    /// Maximum.
    pub most: f64,
}

impl Spread {
    /// The spread of some values; zeros for none.
    #[must_use]
    pub fn of(values: &[f64]) -> Self {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let at = |index: usize| sorted.get(index).copied().unwrap_or(0.0);
        let (low, high) = (sorted.len().saturating_sub(1) / 2, sorted.len() / 2);
        Self {
            least: at(0),
            median: (at(low) + at(high)) / 2.0,
            most: at(sorted.len().saturating_sub(1)),
        }
    }
}

struct Runner<'a> {
    peer: &'a dyn Peer,
    threads: usize,
    run: Box<dyn Run>,
    spent: Duration,
    warmed: u32,
    residual: Residual,
    counts: Counts,
    rounds: Vec<f64>,
}

/// Measures a scene in all peers.
pub fn measure(
    scene: &Scene,
    peers: &[Box<dyn Peer>],
    all_threads: usize,
    effort: &Effort,
) -> Vec<Outcome> {
    let mut runners = Vec::new();
    for peer in peers {
        let counts: &[usize] = if peer.is_parallel() && all_threads > 1 {
            &[1, all_threads]
        } else {
            &[1]
        };
        for &threads in counts {
            let runner = Runner::warm(peer.as_ref(), scene, threads, effort);
            runners.push((peer.name(), threads, runner));
        }
    }
    for _ in 0..effort.rounds {
        for (_, _, runner) in &mut runners {
            if let Ok(alive) = runner
                && let Err(error) = alive.round(effort)
            {
                *runner = Err(error.to_string());
            }
        }
    }
    runners
        .into_iter()
        .map(|(peer, threads, runner)| Outcome {
            scene: scene.name,
            peer,
            threads,
            figures: runner.and_then(|runner| runner.finish(scene)),
        })
        .collect()
}

impl<'a> Runner<'a> {
    fn warm(
        peer: &'a dyn Peer,
        scene: &Scene,
        threads: usize,
        effort: &Effort,
    ) -> Result<Self, String> {
        let failed = |error: PeerError| error.to_string();
        let mut run = peer.build(scene, threads).map_err(failed)?;
        let start = Instant::now();
        let mut warmed = 0;
        while warmed < effort.warm_up && (warmed == 0 || start.elapsed() < effort.budget / 2) {
            run.tick().map_err(failed)?;
            warmed += 1;
        }
        let spent = start.elapsed();
        let report = run.report().map_err(failed)?;
        let residual = examine(scene, peer.has_volume(), &report)?;
        Ok(Self {
            peer,
            threads,
            run,
            spent,
            warmed,
            residual,
            counts: report.counts,
            rounds: Vec::new(),
        })
    }

    fn round(&mut self, effort: &Effort) -> Result<(), PeerError> {
        if !self.rounds.is_empty() && self.spent >= effort.budget {
            return Ok(());
        }
        let start = Instant::now();
        let mut ticks = 0_u32;
        while ticks == 0 || start.elapsed() < effort.slice {
            self.run.tick()?;
            ticks += 1;
        }
        let elapsed = start.elapsed();
        self.spent += elapsed;
        self.rounds
            .push(elapsed.as_secs_f64() * 1e3 / f64::from(ticks));
        Ok(())
    }

    /// Examines the run again at the end, and returns its figures.
    fn finish(mut self, scene: &Scene) -> Result<Figures, String> {
        let report = self.run.report().map_err(|error| error.to_string())?;
        examine(scene, self.peer.has_volume(), &report)
            .map_err(|reason| format!("{reason} ({} threads, later on)", self.threads))?;
        let projections = self.counts.projections() as f64 * f64::from(SUBSTEPS);
        let rates: Vec<f64> = self
            .rounds
            .iter()
            .map(|milliseconds| projections / (milliseconds * 1e3))
            .collect();
        Ok(Figures {
            counts: self.counts,
            tick: Spread::of(&self.rounds),
            rate: Spread::of(&rates),
            rounds: self.rounds,
            residual_after: self.warmed,
            residual: self.residual,
        })
    }
}
