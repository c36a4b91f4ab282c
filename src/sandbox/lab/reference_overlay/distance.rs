//! Distances between bodies and their references, over the last seconds.

use std::collections::VecDeque;

/// Number of ticks that are kept: five seconds at the default rate.
pub const TICKS: usize = 300;

/// Distance between the particles of bodies and of their f64 references, over all bodies that have
/// one, at one tick.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Distance {
    /// Root mean square over the particles [m].
    pub rms: f64,
    /// Maximum [m].
    pub largest: f64,
    /// Root mean square of the distance relative to the size of the body.
    pub rms_fraction: f64,
    /// Maximum of the distance relative to the size of the body.
    pub largest_fraction: f64,
}

/// Accumulates a [`Distance`] particle by particle.
#[derive(Debug, Default)]
pub struct Sum {
    all: Distance,
    count: usize,
}

impl Sum {
    /// Adds the distance of a particle [m] for a body of the given size [m].
    pub fn add(&mut self, distance: f64, size: f64) {
        let fraction = distance / size.max(f64::MIN_POSITIVE);
        self.all.rms += distance * distance;
        self.all.rms_fraction += fraction * fraction;
        self.all.largest = self.all.largest.max(distance);
        self.all.largest_fraction = self.all.largest_fraction.max(fraction);
        self.count += 1;
    }

    /// The accumulated distance.
    #[must_use]
    pub fn distance(&self) -> Distance {
        let mean = |sum: f64| (sum / self.count.max(1) as f64).sqrt();
        Distance {
            rms: mean(self.all.rms),
            rms_fraction: mean(self.all.rms_fraction),
            ..self.all
        }
    }
}

/// Distances of the last ticks, oldest first.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Trail(VecDeque<Distance>);

impl Trail {
    /// Appends a tick, and drops the oldest one.
    pub fn push(&mut self, distance: Distance) {
        if self.0.len() == TICKS {
            self.0.pop_front();
        }
        self.0.push_back(distance);
    }

    /// The ticks, oldest first.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &Distance> {
        self.0.iter()
    }

    /// The latest tick.
    #[must_use]
    pub fn now(&self) -> Option<&Distance> {
        self.0.back()
    }

    /// Maximum over all ticks [m]; 0 if there is none.
    #[must_use]
    pub fn most(&self) -> f64 {
        self.0.iter().map(|tick| tick.largest).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_summed_over_particles_and_over_sizes() {
        let mut sum = Sum::default();
        sum.add(3.0, 1.0);
        sum.add(4.0, 2.0);
        let distance = sum.distance();
        // √((9 + 16)/2) and √((9 + 4)/2).
        assert!((distance.rms - 12.5_f64.sqrt()).abs() < 1e-15);
        assert!((distance.rms_fraction - 6.5_f64.sqrt()).abs() < 1e-15);
        assert_eq!((distance.largest, distance.largest_fraction), (4.0, 3.0));
        assert_eq!(Sum::default().distance(), Distance::default());
    }

    #[test]
    fn the_last_ticks_are_kept() {
        let mut trail = Trail::default();
        for tick in 0..TICKS + 10 {
            trail.push(Distance {
                largest: if tick == 5 { 9.0 } else { 1.0 },
                ..Distance::default()
            });
        }
        assert_eq!((trail.iter().len(), trail.most()), (TICKS, 1.0));
    }
}
