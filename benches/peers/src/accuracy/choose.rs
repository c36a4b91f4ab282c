//! The cheapest setting of each solver for an error, and the solver that wins.

use super::sweep::{Entry, Outcome, Point};
use crate::measure::Spread;

/// The cheapest setting of a solver whose error is at most a target.
#[derive(Debug, Clone, Copy)]
pub struct Cheapest<'a> {
    /// Its time per simulated second [ms].
    pub ms: Spread,
    /// The point.
    pub point: &'a Point,
}

/// The cheapest setting of a solver for an error.
#[must_use]
pub fn cheapest(entry: &Entry, target: f64) -> Option<Cheapest<'_>> {
    let points = entry.points.iter();
    points
        .filter_map(|point| {
            let (ms, error) = point.result()?;
            (error <= target).then_some(Cheapest { ms, point })
        })
        .min_by(|a, b| a.ms.median.total_cmp(&b.ms.median))
}

/// Smallest error of a solver at rest, if it came to rest with any setting.
#[must_use]
pub fn best_error(entry: &Entry) -> Option<f64> {
    let errors = entry
        .points
        .iter()
        .filter_map(|point| Some(point.result()?.1));
    errors.min_by(f64::total_cmp)
}

/// The solver that reaches an error in the least time, and whether the times of another overlap.
#[must_use]
pub fn winner(outcome: &Outcome, target: f64) -> Option<(&'static str, bool)> {
    let entries = outcome.entries.iter();
    let mut all: Vec<(&'static str, Spread)> = entries
        .filter_map(|entry| Some((entry.solver, cheapest(entry, target)?.ms)))
        .collect();
    all.sort_by(|a, b| a.1.median.total_cmp(&b.1.median));
    let (name, best) = *all.first()?;
    let overlaps = all[1..].iter().any(|other| other.1.least <= best.most);
    Some((name, overlaps))
}

/// The points of a solver that no other of its points beats in both time [ms per simulated second]
/// and error, from the cheapest on.
#[must_use]
pub fn front(entry: &Entry) -> Vec<(f64, f64)> {
    let points: Vec<(f64, f64)> = entry
        .points
        .iter()
        .filter_map(|point| point.result().map(|(ms, error)| (ms.median, error)))
        .collect();
    let front = pliant::study::pareto::front(&points);
    front.into_iter().map(|place| points[place]).collect()
}

#[cfg(test)]
mod tests {
    use super::{
        super::{settle::Rest, solvers::Setting},
        *,
    };

    fn point(ms: f64, error: f64, settled: bool) -> Point {
        Point {
            setting: Setting::new(1, 1),
            label: String::new(),
            rest: Ok(Rest {
                settled,
                error,
                remaining: 0.0,
                seconds: 1.0,
                ms_per_second: ms,
            }),
            ms: Some(Spread {
                least: 0.9 * ms,
                median: ms,
                most: 1.1 * ms,
            }),
        }
    }

    fn entry(solver: &'static str, points: Vec<Point>) -> Entry {
        Entry {
            solver,
            refusal: None,
            failure: None,
            points,
        }
    }

    fn outcome(entries: Vec<Entry>) -> Outcome {
        Outcome {
            problem: "test",
            title: "test",
            particles: 1,
            edges: 0,
            tetrahedra: 0,
            displacement: 1.0,
            relative_displacement: 1.0,
            residual: 0.0,
            uncertainty: 0.0,
            entries,
        }
    }

    #[test]
    fn the_cheapest_setting_is_the_fastest_below_the_target() {
        let entry = entry(
            "one",
            vec![
                point(9.0, 1e-4, true),
                point(2.0, 0.05, true),
                point(4.0, 0.009, true),
            ],
        );
        let ms = |target| cheapest(&entry, target).map(|found| found.ms.median);
        assert_eq!(ms(0.1), Some(2.0));
        assert_eq!(ms(0.01), Some(4.0));
        assert_eq!(ms(0.001), Some(9.0));
        assert_eq!(ms(1e-5), None);
        assert_eq!(best_error(&entry), Some(1e-4));
    }

    #[test]
    fn a_setting_that_did_not_come_to_rest_does_not_count() {
        let entry = entry("one", vec![point(1.0, 1e-4, false), point(5.0, 0.02, true)]);
        assert_eq!(
            cheapest(&entry, 0.1).map(|found| found.ms.median),
            Some(5.0)
        );
        assert_eq!(best_error(&entry), Some(0.02));
    }

    #[test]
    fn the_winner_is_the_fastest_and_overlapping_times_are_within_noise() {
        let fast = || entry("fast", vec![point(1.0, 0.01, true)]);
        let near = entry("near", vec![point(1.1, 0.01, true)]);
        let far = entry("far", vec![point(3.0, 1e-4, true)]);
        let three = outcome(vec![far.clone(), near, fast()]);
        assert_eq!(winner(&three, 0.1), Some(("fast", true)));
        assert_eq!(winner(&three, 0.001), Some(("far", false)));
        assert_eq!(winner(&three, 1e-6), None);
        assert_eq!(
            winner(&outcome(vec![far, fast()]), 0.1),
            Some(("fast", false))
        );
    }

    #[test]
    fn the_front_has_no_point_that_another_beats() {
        let entry = entry(
            "one",
            vec![
                point(1.0, 0.5, true),
                point(2.0, 0.6, true),
                point(3.0, 0.1, true),
            ],
        );
        assert_eq!(front(&entry), [(1.0, 0.5), (3.0, 0.1)]);
    }
}
