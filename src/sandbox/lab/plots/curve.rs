//! Force over displacement of the grabbed point, tick by tick, with a fitted stiffness.

use bevy::prelude::Vec3;

/// Maximum number of points; then every second one is dropped.
const MAX_POINTS: usize = 2000;
/// Minimum number of points, and minimum range of displacements [m], for a fit.
const FIT: (usize, f64) = (8, 5e-4);

/// The curve of a drag.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ForceCurve {
    /// Displacement of the grabbed point from where it was grabbed [m], and force of the grab [N].
    points: Vec<[f64; 2]>,
    /// Where it was grabbed [m].
    start: Vec3,
    /// Number of ticks per point, and ticks since the last one.
    stride: (u32, u32),
    /// Whether the drag goes on.
    pub live: bool,
    /// Name of the body.
    pub body: String,
}

/// A straight line through the points: F = F₀ + k d.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// Stiffness k [N/m].
    pub stiffness: f64,
    /// Force at no displacement F₀ [N].
    pub force: f64,
    /// Coefficient of determination R², 0 to 1.
    pub quality: f64,
}

impl ForceCurve {
    /// The curve of a drag of a body that begins at a point [m].
    #[must_use]
    pub fn new(body: String, start: Vec3) -> Self {
        Self {
            start,
            stride: (1, 0),
            live: true,
            body,
            ..Self::default()
        }
    }

    /// Adds a tick: where the grabbed point is [m], and the force [N].
    pub fn push(&mut self, point: Vec3, force: f32) {
        let (stride, since) = &mut self.stride;
        *since += 1;
        if *since < *stride {
            return;
        }
        *since = 0;
        self.points
            .push([f64::from(point.distance(self.start)), f64::from(force)]);
        if self.points.len() >= MAX_POINTS {
            let mut keep = false;
            self.points.retain(|_| {
                keep = !keep;
                keep
            });
            self.stride.0 *= 2;
        }
    }

    /// The points: displacement [m] and force [N].
    #[must_use]
    pub fn points(&self) -> &[[f64; 2]] {
        &self.points
    }

    /// The least-squares line; `None` if the point has hardly moved.
    #[must_use]
    pub fn fit(&self) -> Option<Fit> {
        let count = self.points.len() as f64;
        let mean = |axis: usize| self.points.iter().map(|point| point[axis]).sum::<f64>() / count;
        let (x, y) = (mean(0), mean(1));
        let product = |a: usize, b: usize| {
            let means = [x, y];
            let terms = self.points.iter();
            terms
                .map(|point| (point[a] - means[a]) * (point[b] - means[b]))
                .sum::<f64>()
        };
        let farthest = self.points.iter().map(|point| point[0]).fold(0.0, f64::max);
        let (xx, xy, yy) = (product(0, 0), product(0, 1), product(1, 1));
        if self.points.len() < FIT.0 || farthest < FIT.1 || xx <= 0.0 {
            return None;
        }
        let stiffness = xy / xx;
        Some(Fit {
            stiffness,
            force: y - stiffness * x,
            quality: if yy > 0.0 { xy * xy / (xx * yy) } else { 1.0 },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pulled(ticks: u32, force: impl Fn(f64) -> f64) -> ForceCurve {
        let mut curve = ForceCurve::new("cube".to_owned(), Vec3::ONE);
        for tick in 0..ticks {
            let displacement = f64::from(tick) * 1e-4;
            let point = Vec3::ONE + Vec3::Y * displacement as f32;
            curve.push(point, force(displacement) as f32);
        }
        curve
    }

    #[test]
    fn the_stiffness_of_a_spring_is_fitted_with_its_preload() {
        let fit = pulled(100, |d| 3.0 + 250.0 * d).fit().expect("it moved");
        // Positions near 1 m are rounded by 6e-8 m, of a range of 1e-2 m.
        assert!((fit.stiffness / 250.0 - 1.0).abs() < 1e-4, "{fit:?}");
        assert!((fit.force - 3.0).abs() < 1e-3 && fit.quality > 0.9999);
    }

    #[test]
    fn a_point_that_has_not_moved_has_no_stiffness() {
        assert_eq!(pulled(4, |d| d).fit(), None);
        let mut still = ForceCurve::new(String::new(), Vec3::ZERO);
        (0..50).for_each(|_| still.push(Vec3::ZERO, 1.0));
        assert_eq!(still.fit(), None);
        assert_eq!(ForceCurve::default().fit(), None);
    }

    #[test]
    fn a_long_drag_is_thinned_out_evenly() {
        let curve = pulled(50_000, |d| d);
        let points = curve.points();
        assert!(points.len() < MAX_POINTS && points.len() > MAX_POINTS / 4);
        let steps = points.windows(2).map(|pair| pair[1][0] - pair[0][0]);
        let (low, high) = steps.fold((f64::MAX, 0.0_f64), |(low, high), step| {
            (low.min(step), high.max(step))
        });
        // Where points were dropped, a step can be half as long again.
        assert!(high < 1.6 * low, "{low} {high}");
    }
}
