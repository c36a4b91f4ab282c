//! Cost efficiency and scaling: Pareto front, cheapest setting, fitted exponent.

/// Indices of the points on the Pareto front: no other point is at most as costly and at most as
/// wrong, and better in one of the two. Ordered from the cheapest to the most accurate; of equal
/// points, the first. Points that are not finite are never included.
#[must_use]
pub fn front(points: &[(f64, f64)]) -> Vec<usize> {
    let mut places: Vec<usize> = (0..points.len())
        .filter(|&place| points[place].0.is_finite() && points[place].1.is_finite())
        .collect();
    places.sort_by(|&a, &b| {
        let (cost, error) = (points[a].0, points[a].1);
        cost.total_cmp(&points[b].0)
            .then(error.total_cmp(&points[b].1))
            .then(a.cmp(&b))
    });
    let mut best = f64::INFINITY;
    places.retain(|&place| {
        let better = points[place].1 < best;
        if better {
            best = points[place].1;
        }
        better
    });
    places
}

/// Index of the cheapest point whose error is at most `error`.
#[must_use]
pub fn cheapest(points: &[(f64, f64)], error: f64) -> Option<usize> {
    let front = front(points);
    front.into_iter().find(|&place| points[place].1 <= error)
}

/// Exponent p of y ~ xᵖ, from a least-squares fit of the logarithms; `None` unless there are two
/// different x. Points that are not positive are ignored.
#[must_use]
pub fn exponent(points: &[(f64, f64)]) -> Option<f64> {
    let logs: Vec<(f64, f64)> = points
        .iter()
        .filter(|(x, y)| *x > 0.0 && *y > 0.0 && x.is_finite() && y.is_finite())
        .map(|(x, y)| (x.ln(), y.ln()))
        .collect();
    let count = logs.len() as f64;
    let mean_x = logs.iter().map(|p| p.0).sum::<f64>() / count;
    let mean_y = logs.iter().map(|p| p.1).sum::<f64>() / count;
    let across: f64 = logs.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
    let along: f64 = logs.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum();
    (across > 1e-12).then(|| along / across)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn no_point_of_the_front_is_dominated_and_every_other_is(
            points in prop::collection::vec((0.0..8.0_f64, 0.0..8.0_f64), 0..40)
        ) {
            // Rounded, so that some are equal.
            let points: Vec<_> = points.iter().map(|p| (p.0.round(), p.1.round())).collect();
            let front = front(&points);
            let beats = |a: (f64, f64), b: (f64, f64)| a.0 <= b.0 && a.1 <= b.1 && a != b;
            for (place, &point) in points.iter().enumerate() {
                if front.contains(&place) {
                    prop_assert!(!points.iter().any(|&other| beats(other, point)));
                } else {
                    prop_assert!(front.iter().any(|&f| beats(points[f], point) || points[f] == point));
                }
            }
        }
    }

    #[test]
    fn what_is_not_finite_is_worth_nothing() {
        let points = [(1.0, f64::NAN), (f64::INFINITY, 0.0), (2.0, 0.5)];
        assert_eq!(front(&points), [2]);
    }

    #[test]
    fn the_cheapest_is_the_first_of_the_front_that_is_exact_enough() {
        let points = [
            (8.0, 0.001),
            (1.0, 0.2),
            (2.0, 0.05),
            (4.0, 0.01),
            (3.0, 0.06),
        ];
        assert_eq!(cheapest(&points, 0.1), Some(2));
        assert_eq!(cheapest(&points, 0.01), Some(3));
        assert_eq!(cheapest(&points, 1e-4), None);
    }

    #[test]
    fn a_power_law_gives_its_exponent_back() {
        let points: Vec<_> = (1..6)
            .map(|n| (f64::from(n), 3.0 * f64::from(n).powf(1.5)))
            .collect();
        let fitted = exponent(&points).expect("five different sizes");
        // Logarithms in f64, summed over five points.
        assert!((fitted - 1.5).abs() < 1e-12, "{fitted}");
        assert_eq!(exponent(&[(2.0, 1.0), (2.0, 3.0)]), None);
        assert_eq!(exponent(&[]), None);
    }
}
