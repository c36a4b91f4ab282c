//! The track of a slider: the mapping between positions and values.
//!
//! Pure math, no drawing. A logarithmic track may have a stop at its left end for 0 (rigid,
//! undamped) and at its right end for infinity. Positions run from 0 (left) to 1 (right);
//! `value(position(v)) = v` for values that the track can represent.

use std::ops::RangeInclusive;

/// Length of the stop for 0 or infinity, as a fraction of the track.
const STOP: f64 = 0.06;

/// Distribution of values over the track.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spread {
    /// Equal distances for equal differences.
    Linear,
    /// Equal distances for equal ratios.
    Logarithmic,
    /// Linear, whole numbers only.
    Integer,
}

/// Range of a slider and its distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Track {
    low: f64,
    high: f64,
    spread: Spread,
    zero: bool,
    infinity: bool,
}

impl Track {
    /// Minimum value.
    pub fn low(&self) -> f64 {
        self.low
    }

    /// A track from `low` to `high`. A logarithmic track needs both above 0; otherwise it becomes
    /// linear.
    pub fn new(range: RangeInclusive<f64>, spread: Spread) -> Self {
        let (low, high) = range.into_inner();
        let spread = match spread {
            Spread::Logarithmic if low <= 0.0 => Spread::Linear,
            other => other,
        };
        Self {
            low,
            high,
            spread,
            zero: false,
            infinity: false,
        }
    }

    /// Adds a stop for 0 at the left end of a logarithmic track.
    pub fn with_zero(mut self, zero: bool) -> Self {
        self.zero = zero && self.spread == Spread::Logarithmic;
        self
    }

    /// Adds a stop for infinity at the right end of a logarithmic track.
    pub fn with_infinity(mut self, infinity: bool) -> Self {
        self.infinity = infinity && self.spread == Spread::Logarithmic;
        self
    }

    /// Distribution of the values.
    pub fn spread(&self) -> Spread {
        self.spread
    }

    /// Position of a value; values outside the track are clamped to its ends.
    pub fn position(&self, value: f64) -> f64 {
        let (start, end) = self.body();
        match self.spread {
            Spread::Linear | Spread::Integer => {
                ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0)
            }
            Spread::Logarithmic if value <= 0.0 => 0.0,
            Spread::Logarithmic if value.is_infinite() => 1.0,
            Spread::Logarithmic => {
                let t = (value / self.low).log10() / self.decades();
                (start + t * (end - start)).clamp(start, end)
            }
        }
    }

    /// The value at a position, rounded to two or three digits.
    pub fn value(&self, position: f64) -> f64 {
        let (start, end) = self.body();
        match self.spread {
            Spread::Linear => {
                let span = self.high - self.low;
                let step = 10f64.powf((span / 100.0).log10().floor());
                let exact = self.low + position.clamp(0.0, 1.0) * span;
                rounded(exact, step).clamp(self.low, self.high)
            }
            Spread::Integer => {
                (self.low + position.clamp(0.0, 1.0) * (self.high - self.low)).round()
            }
            Spread::Logarithmic if self.zero && position < start / 2.0 => 0.0,
            Spread::Logarithmic if self.infinity && position > (1.0 + end) / 2.0 => f64::INFINITY,
            Spread::Logarithmic => {
                let t = ((position - start) / (end - start)).clamp(0.0, 1.0);
                let exact = self.low * 10f64.powf(t * self.decades());
                let step = 10f64.powf(exact.log10().floor() - 1.0);
                rounded(exact, step).clamp(self.low, self.high)
            }
        }
    }

    /// The value after one press of an arrow key: a step of 1 for whole numbers, a tenth of a
    /// decade on a logarithmic track, a hundredth of a linear one.
    pub fn step(&self, value: f64, forward: bool) -> f64 {
        let sign = if forward { 1.0 } else { -1.0 };
        let (start, end) = self.body();
        let step = match self.spread {
            Spread::Linear => 0.01,
            Spread::Integer => 1.0 / (self.high - self.low),
            Spread::Logarithmic => 0.1 / self.decades() * (end - start),
        };
        let position = self.position(value);
        let leaves_stop = (position < start && forward) || (position > end && !forward);
        if leaves_stop {
            return if forward { self.low } else { self.high };
        }
        self.value(position + sign * step)
    }

    /// Positions of the powers of ten on a logarithmic track, for its ticks; empty for other
    /// tracks.
    pub fn ticks(&self) -> impl Iterator<Item = f64> + '_ {
        let logarithmic = self.spread == Spread::Logarithmic;
        let powers = logarithmic.then(|| {
            // Includes a bound that is a power of ten, despite rounding of its logarithm.
            (self.low.log10() - 1e-6).ceil() as i32..=(self.high.log10() + 1e-6).floor() as i32
        });
        let powers = powers.into_iter().flatten();
        powers.map(|power| self.position(10f64.powi(power)))
    }

    /// Start of the filled part of the rail: at 0 if a linear track contains it, otherwise at the
    /// left end.
    pub fn origin(&self) -> f64 {
        match self.spread {
            Spread::Linear => self.position(0.0),
            Spread::Integer | Spread::Logarithmic => 0.0,
        }
    }

    /// The part of the track between its stops.
    fn body(&self) -> (f64, f64) {
        let start = if self.zero { STOP } else { 0.0 };
        let end = if self.infinity { 1.0 - STOP } else { 1.0 };
        (start, end)
    }

    fn decades(&self) -> f64 {
        (self.high / self.low).log10()
    }
}

/// `value` rounded to multiples of `step`. Divides by the inverse of steps below 1, which is a
/// whole number, so that 3 × 0.1 is written 0.3.
fn rounded(value: f64, step: f64) -> f64 {
    if step < 1.0 {
        let inverse = (1.0 / step).round();
        (value * inverse).round() / inverse
    } else {
        (value / step).round() * step
    }
}

#[cfg(test)]
mod tests {
    use crate::sandbox::ui::track::*;

    fn compliance() -> Track {
        Track::new(1e-9..=1e-1, Spread::Logarithmic).with_zero(true)
    }

    #[test]
    fn the_ends_of_a_track_are_the_ends_of_its_range() {
        let tracks = [
            (Track::new(-20.0..=20.0, Spread::Linear), -20.0, 20.0),
            (Track::new(1.0..=64.0, Spread::Integer), 1.0, 64.0),
            (Track::new(1e-3..=1e3, Spread::Logarithmic), 1e-3, 1e3),
            (compliance(), 0.0, 1e-1),
        ];
        for (track, low, high) in tracks {
            assert_eq!(track.value(0.0), low);
            assert_eq!(track.value(1.0), high);
            assert_eq!(track.value(-5.0), low);
            assert_eq!(track.value(5.0), high);
        }
    }

    #[test]
    fn a_value_keeps_its_place() {
        let track = compliance();
        for value in [0.0, 1e-9, 2.5e-8, 1e-5, 4.7e-3, 1e-1] {
            let back = track.value(track.position(value));
            assert!(
                (back - value).abs() <= 1e-9 * value,
                "{value} came back as {back}"
            );
        }
        let whole = Track::new(1.0..=64.0, Spread::Integer);
        for value in 1..=64 {
            assert_eq!(
                whole.value(whole.position(f64::from(value))),
                f64::from(value)
            );
        }
    }

    #[test]
    fn zero_and_infinity_have_a_stop_of_their_own() {
        let stiffness = Track::new(1e2..=1e8, Spread::Logarithmic).with_infinity(true);
        assert_eq!(stiffness.value(1.0), f64::INFINITY);
        assert_eq!(stiffness.position(f64::INFINITY), 1.0);
        assert!(stiffness.position(1e8) < 1.0);
        assert_eq!(compliance().position(0.0), 0.0);
        assert!(compliance().position(1e-9) > 0.0);
    }

    #[test]
    fn arrow_keys_move_on_in_both_directions_and_leave_the_stops() {
        let track = compliance();
        assert_eq!(track.step(0.0, true), 1e-9);
        assert!(track.step(1e-5, true) > 1e-5);
        assert!(track.step(1e-5, false) < 1e-5);
        assert_eq!(
            Track::new(1.0..=64.0, Spread::Integer).step(10.0, true),
            11.0
        );
    }

    #[test]
    fn a_logarithmic_track_has_a_tick_for_each_power_of_ten() {
        assert_eq!(compliance().ticks().count(), 9);
        assert_eq!(Track::new(0.0..=1.0, Spread::Linear).ticks().count(), 0);
    }

    #[test]
    fn values_outside_stand_at_the_end() {
        assert_eq!(compliance().position(10.0), 1.0);
        assert_eq!(Track::new(0.0..=1.0, Spread::Linear).position(-3.0), 0.0);
    }
}
