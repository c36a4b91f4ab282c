//! Timing: probes in turn, over many rounds, as medians with their spread.

use super::Options;
use std::{
    panic,
    sync::Barrier,
    thread,
    time::{Duration, Instant},
};

/// Lowest, median and highest of several measurements.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[non_exhaustive]
pub struct Spread {
    /// Lowest.
    pub low: f64,
    /// Median; for an even number, the higher of the two middle values.
    pub median: f64,
    /// Highest.
    pub high: f64,
}

impl Spread {
    /// The spread of these measurements; zeros if there are none.
    #[must_use]
    pub fn of(mut measured: Vec<f64>) -> Self {
        measured.sort_by(f64::total_cmp);
        let at = |place: usize| measured.get(place).copied().unwrap_or(0.0);
        Self {
            low: at(0),
            median: at(measured.len() / 2),
            high: at(measured.len().saturating_sub(1)),
        }
    }

    /// `whole` divided by each of them: converts a time to a rate.
    #[must_use]
    pub fn under(self, whole: f64) -> Self {
        Self {
            low: whole / self.high,
            median: whole / self.median,
            high: whole / self.low,
        }
    }
}

/// A repeatable measurement.
pub trait Probe {
    /// Its figures, always the same number of them; each takes `slot` or slightly more.
    fn sample(&mut self, slot: Duration) -> Vec<f64>;
}

/// Samples all probes in turn, round by round, after one warm-up round. Returns the figures of each
/// probe.
pub(super) fn in_turn(
    probes: &mut [&mut dyn Probe],
    options: &Options,
    progress: &mut dyn FnMut(f64),
) -> Vec<Vec<Spread>> {
    let mut measured: Vec<Vec<Vec<f64>>> = vec![Vec::new(); probes.len()];
    let count = probes.len();
    let all = ((options.rounds + 1) * count) as f64;
    for round in 0..=options.rounds {
        for (index, probe) in probes.iter_mut().enumerate() {
            let figures = probe.sample(options.slot);
            if round > 0 {
                let columns = &mut measured[index];
                columns.resize(figures.len(), Vec::new());
                for (column, figure) in columns.iter_mut().zip(figures) {
                    column.push(figure);
                }
            }
            progress((round * count + index + 1) as f64 / all);
        }
    }
    measured
        .into_iter()
        .map(|columns| columns.into_iter().map(Spread::of).collect())
        .collect()
}

/// Repeats `work`, which returns the number of items processed, for `slot` or slightly more.
/// Returns items per second.
pub fn rate(slot: Duration, mut work: impl FnMut() -> usize) -> f64 {
    let start = Instant::now();
    let mut items = 0;
    loop {
        items += work();
        let elapsed = start.elapsed();
        if elapsed >= slot {
            return items as f64 / elapsed.as_secs_f64();
        }
    }
}

/// Same with one thread per work item, started together; returns the sum of their rates.
pub fn rate_together<W: FnMut() -> usize + Send>(slot: Duration, works: Vec<W>) -> f64 {
    let start = &Barrier::new(works.len());
    thread::scope(|scope| {
        let threads: Vec<_> = works
            .into_iter()
            .map(|work| {
                scope.spawn(move || {
                    start.wait();
                    rate(slot, work)
                })
            })
            .collect();
        threads
            .into_iter()
            .map(|thread| match thread.join() {
                Ok(rate) => rate,
                Err(panicked) => panic::resume_unwind(panicked),
            })
            .sum()
    })
}
