//! Fractions of the time of a tick by part, smoothed over about a second. They add up to 1.

use bevy::prelude::Resource;
use std::{collections::BTreeMap, time::Duration};

/// Weight of a new tick in the smoothed times.
const FRESH: f64 = 0.04;
/// Parts that are absent from ticks are forgotten below this fraction.
const FORGOTTEN: f64 = 1e-3;

/// Time of a tick outside the named parts: schedules, masses, sleep.
const REST: &str = "other";

/// Smoothed real time by part [s].
#[derive(Resource, Debug, Clone, Default)]
pub(super) struct Fractions(BTreeMap<&'static str, f64>);

impl Fractions {
    /// Adds a tick that took `all` real time, with its measured parts.
    pub fn push(&mut self, parts: &[(&'static str, Duration)], all: Duration) {
        let is_first = self.0.is_empty();
        let named: Duration = parts.iter().map(|(_, spent)| spent).sum();
        let rest = (REST, all.saturating_sub(named));
        let column = || parts.iter().copied().chain([rest]);
        // A part that appears begins at 0 like one that disappears ends there: all are smoothed
        // alike, or their sum would exceed that of the ticks.
        for (part, _) in column() {
            self.0.entry(part).or_default();
        }
        let weight = if is_first { 1.0 } else { FRESH };
        for (part, smoothed) in &mut self.0 {
            let of_part = column().filter(|(name, _)| name == part);
            let spent: Duration = of_part.map(|(_, spent)| spent).sum();
            *smoothed += (spent.as_secs_f64() - *smoothed) * weight;
        }
        let least = FORGOTTEN * self.sum();
        self.0
            .retain(|part, spent| *spent >= least || column().any(|(name, _)| name == *part));
    }

    /// Forgets all ticks.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    fn sum(&self) -> f64 {
        self.0.values().sum()
    }

    /// The fraction of a part, from 0 to 1; `None` if it was not measured.
    pub fn of(&self, part: &str) -> Option<f32> {
        let sum = self.sum();
        let spent = self.0.get(part).filter(|_| sum > 0.0)?;
        Some((spent / sum) as f32)
    }

    /// The parts, by name.
    pub fn parts(&self) -> impl Iterator<Item = &'static str> {
        self.0.keys().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    fn sum(fractions: &Fractions) -> f32 {
        fractions
            .parts()
            .filter_map(|part| fractions.of(part))
            .sum()
    }

    #[test]
    fn fractions_are_those_of_equal_ticks_from_the_first_on() {
        let mut fractions = Fractions::default();
        assert_eq!(fractions.of("stretch"), None);
        for _ in 0..3 {
            fractions.push(&[("stretch", 3 * MS), ("volume", 2 * MS)], 8 * MS);
            for (part, fraction) in [("stretch", 0.375), ("volume", 0.25), (REST, 0.375)] {
                let found = fractions.of(part).expect("it was measured");
                assert!((found - fraction).abs() < 1e-6, "{part}: {found}");
            }
        }
    }

    #[test]
    fn fractions_add_up_to_one_while_parts_come_and_go() {
        let mut fractions = Fractions::default();
        for tick in 0..500_u32 {
            let mut parts = vec![("stretch", MS * (1 + tick % 7))];
            if tick % 50 > 25 {
                parts.push(("contact", 20 * MS));
            }
            if tick < 100 {
                parts.push(("grab", 3 * MS));
            }
            fractions.push(&parts, 30 * MS);
            // Each of some hundred sums rounds by at most 6e-8.
            assert!((sum(&fractions) - 1.0).abs() < 1e-5, "{}", sum(&fractions));
        }
        assert_eq!(fractions.of("grab"), None, "it is forgotten");
        assert!(fractions.of("contact").is_some_and(|it| it > 0.2));
    }
}
