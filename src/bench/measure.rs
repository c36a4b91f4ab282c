//! How things are timed: in turn, many times, with medians and what lies around them.

use super::Options;
use std::{
    panic,
    sync::Barrier,
    thread,
    time::{Duration, Instant},
};

/// Lowest, middle and highest of several measurements of one thing.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Spread {
    /// Lowest.
    pub low: f64,
    /// Middle; of two in the middle, the higher.
    pub median: f64,
    /// Highest.
    pub high: f64,
}

impl Spread {
    /// Of these measurements; zeros for none.
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

    /// `whole` over each of them, as a time becomes a rate.
    #[must_use]
    pub fn under(self, whole: f64) -> Self {
        Self {
            low: whole / self.high,
            median: whole / self.median,
            high: whole / self.low,
        }
    }
}

/// Something that is measured again and again.
pub trait Probe {
    /// Its figures, always as many; each takes `slot` or little more.
    fn sample(&mut self, slot: Duration) -> Vec<f64>;
}

/// All probes in turn, round by round, after one round to warm up. Returns the figures of each
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

/// Does `work` for `slot` or little more; it returns how many items it did. Items a second.
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

/// The same with a thread for each of the works, which begin together: the sum of their rates.
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
