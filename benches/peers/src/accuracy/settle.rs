//! Finding rest by kinetic damping, which does not change the state of rest.
//!
//! Whenever the kinetic energy of a body has passed a peak, the body is put back to its state at
//! the peak, without velocity (dynamic relaxation). The peak is that of a parabola through the
//! energies of three ticks. `pliant study` does the same for Pliant alone.
//!
//! A solver that only creeps moves little and may still be far from rest. Therefore, the remaining
//! way is extrapolated: mean positions over a window of half a second form a sequence whose steps shrink by a
//! factor q, and the sum of the steps to come is q/(1 − q) of the last one. In the end, the body must
//! stay where it is for one more window without kinetic damping.

use super::{error::Measure, solvers::Trial};
use crate::scenes::RATE;
use glam::DVec3;
use serde::Serialize;
use std::time::Duration;

/// Ticks of a window: half a second.
const WINDOW: u32 = RATE as u32 / 2;

/// A body is at rest if its remaining way is at most this fraction of its error, or of the largest target.
const FRACTION: f64 = 0.1;

/// The largest target for an error. A body that is far off and oscillates is not at rest.
const LARGEST_TARGET: f64 = 0.1;

/// Remaining ways below this are small enough for any error target, relative to the displacement.
const MIN_WAY: f64 = 1e-4;

/// Steps between windows below this are rounding errors, relative to the displacement.
const ROUNDING: f64 = 2e-6;

/// A body with this error has diverged: in all problems, it is more than twice its size away.
const DIVERGED: f64 = 1e3;

/// State at the end of a search for rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rest {
    /// Whether the body came to rest.
    pub settled: bool,
    /// Root mean square error over the last window, relative to the displacement.
    pub error: f64,
    /// Estimated remaining way, relative to the displacement; infinite if steps do not shrink.
    pub remaining: f64,
    /// Simulated time [s].
    pub seconds: f64,
    /// Processor time of ticks per simulated second [ms].
    pub ms_per_second: f64,
}

/// Limits of a search.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Patience {
    /// Simulated time [s].
    pub seconds: u32,
    /// Processor time.
    pub time: Duration,
}

/// Sum of the steps that follow the last of a sequence that shrinks by the same factor each time;
/// infinite if it does not shrink.
#[must_use]
pub fn remaining_way(steps: &[f64]) -> f64 {
    let &[.., first, _, last] = steps else {
        return f64::INFINITY;
    };
    if last <= ROUNDING {
        return last;
    }
    let factor = (last / first).sqrt();
    if factor < 1.0 {
        last * factor / (1.0 - factor)
    } else {
        f64::INFINITY
    }
}

/// Whether a body with this remaining way and error counts as being at rest.
#[must_use]
pub fn is_settled(remaining: f64, error: f64) -> bool {
    remaining <= (FRACTION * error.min(LARGEST_TARGET)).max(MIN_WAY)
}

/// Steps until the body is at rest.
///
/// # Errors
/// If the body diverges or a position is not finite, after how many seconds, or if the process of the trial failed.
pub fn settle(
    trial: &mut dyn Trial,
    measure: &Measure,
    masses: &[f64],
    patience: &Patience,
) -> Result<Rest, String> {
    let mut search = Search::new(trial, measure, masses);
    let mut steps = Vec::new();
    let mut last: Option<Vec<DVec3>> = None;
    let mut rest = Rest {
        settled: false,
        error: f64::INFINITY,
        remaining: f64::INFINITY,
        seconds: 0.0,
        ms_per_second: f64::INFINITY,
    };
    while rest.seconds < f64::from(patience.seconds) && search.spent < patience.time {
        let mut window = search.window(trial, true);
        if let Some(reason) = trial.failure() {
            return Err(reason.to_owned());
        }
        rest.remaining = f64::INFINITY;
        if let Some(last) = &last {
            steps.push(measure.between(last, &window.mean));
            rest.remaining = remaining_way(&steps);
        }
        if is_settled(rest.remaining, window.error) {
            // The same without kinetic damping: this is the error that counts.
            let free = search.window(trial, false);
            rest.remaining = rest
                .remaining
                .max(measure.between(&window.mean, &free.mean));
            rest.settled = is_settled(rest.remaining, free.error);
            window = free;
            search.energies = [0.0; 2];
        }
        rest.error = window.error;
        rest.seconds = f64::from(search.ticks) / f64::from(RATE);
        rest.ms_per_second = search.spent.as_secs_f64() * 1e3 / rest.seconds;
        if !rest.error.is_finite() {
            return Err(format!("not finite after {} s", rest.seconds));
        }
        if rest.error > DIVERGED {
            return Err(format!("diverged after {} s", rest.seconds));
        }
        if rest.settled {
            break;
        }
        last = Some(window.mean);
    }
    Ok(rest)
}

/// A window of ticks.
struct Window {
    /// Mean position of each particle [m].
    mean: Vec<DVec3>,
    /// Root mean square error.
    error: f64,
}

/// Steps a trial, with kinetic damping.
struct Search<'a> {
    measure: &'a Measure,
    masses: &'a [f64],
    /// Number of ticks, and the time that they took.
    ticks: u32,
    spent: Duration,
    now: Vec<DVec3>,
    before: Vec<DVec3>,
    older: Vec<DVec3>,
    /// Kinetic energies of the last two ticks, up to a factor.
    energies: [f64; 2],
}

impl<'a> Search<'a> {
    fn new(trial: &mut dyn Trial, measure: &'a Measure, masses: &'a [f64]) -> Self {
        let mut now = Vec::new();
        trial.positions(&mut now);
        Self {
            measure,
            masses,
            ticks: 0,
            spent: Duration::ZERO,
            before: now.clone(),
            older: now.clone(),
            now,
            energies: [0.0; 2],
        }
    }

    /// Steps a window, with or without kinetic damping.
    fn window(&mut self, trial: &mut dyn Trial, damped: bool) -> Window {
        let mut mean = vec![DVec3::ZERO; self.masses.len()];
        let mut square = 0.0;
        for _ in 0..WINDOW {
            std::mem::swap(&mut self.older, &mut self.before);
            std::mem::swap(&mut self.before, &mut self.now);
            self.spent += trial.advance(1);
            self.ticks += 1;
            trial.positions(&mut self.now);
            if damped {
                self.damp(trial);
            }
            for (sum, x) in mean.iter_mut().zip(&self.now) {
                *sum += *x / f64::from(WINDOW);
            }
            square += self.measure.error(&self.now).powi(2) / f64::from(WINDOW);
        }
        Window {
            mean,
            error: square.sqrt(),
        }
    }

    /// Resets the body to the last peak of its energy if it has just passed one.
    fn damp(&mut self, trial: &mut dyn Trial) {
        let moved = self.now.iter().zip(&self.before).zip(self.masses);
        let energy: f64 = moved
            .map(|((x, from), m)| m * x.distance_squared(*from))
            .sum();
        if energy < self.energies[1] {
            let [rising, peak] = self.energies;
            let late = 0.5 * (rising - energy) / (rising - 2.0 * peak + energy);
            for (x, (before, older)) in self.now.iter_mut().zip(self.before.iter().zip(&self.older))
            {
                *x = *older + (*before - *older) * (0.5 + late);
            }
            trial.place(&self.now);
            trial.positions(&mut self.now);
            self.before.clone_from(&self.now);
            self.energies = [0.0; 2];
        } else {
            self.energies = [self.energies[1], energy];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_remaining_way_of_a_geometric_sequence_is_its_sum() {
        let steps = [0.4, 0.2, 0.1];
        assert!((remaining_way(&steps) - 0.1).abs() < 1e-12);
        let slow = [0.01, 0.0099, 0.009801];
        assert!((remaining_way(&slow) - 0.970_299).abs() < 1e-6);
    }

    #[test]
    fn a_sequence_that_does_not_shrink_has_no_end() {
        assert_eq!(remaining_way(&[0.1, 0.1, 0.1]), f64::INFINITY);
        assert_eq!(remaining_way(&[0.1, 0.05]), f64::INFINITY);
    }

    #[test]
    fn steps_of_the_size_of_rounding_count_as_they_are() {
        assert!(remaining_way(&[1e-7, 1e-7, 1e-6]) <= ROUNDING);
    }

    #[test]
    fn rest_requires_a_tenth_of_the_error_or_less() {
        assert!(is_settled(0.009, 0.1));
        assert!(!is_settled(0.011, 0.1));
        assert!(is_settled(0.9e-4, 1e-6));
        assert!(!is_settled(0.02, 1.0));
        assert!(!is_settled(f64::INFINITY, 1.0));
    }
}
