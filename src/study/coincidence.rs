//! The agreement of classic PBD is sometimes coincidental: it has no compliance, and too few
//! iterations over rigid constraints can result in about the requested softness. More iterations
//! then increase the error, and another mesh or substep changes the softness.

use super::{
    results::{CaseResult, Point},
    setting::Method,
};

/// Factor by which an error with more iterations must be larger for the smaller one to be a
/// coincidence.
const WORSE: f64 = 1.5;

impl CaseResult {
    /// The point that shows that the agreement of this one is coincidental: the worst of those
    /// without compliance that have the same number of substeps, or of iterations, and take more
    /// work, if it is clearly worse.
    #[must_use]
    pub fn coincidence(&self, point: &Point) -> Option<&Point> {
        if point.setting.method != Method::Pbd {
            return None;
        }
        let (_, error) = point.cost_and_error()?;
        let more = self.points.iter().filter(|other| {
            other.setting.method == Method::Pbd
                && other.setting.substeps >= point.setting.substeps
                && other.setting.iterations >= point.setting.iterations
        });
        let error_of = |point: &Point| point.error.unwrap_or(f64::NAN);
        let worst = more
            .filter(|other| other.cost_and_error().is_some())
            .max_by(|a, b| error_of(a).total_cmp(&error_of(b)))?;
        (error_of(worst) > WORSE * error).then_some(worst)
    }

    /// The cheapest point whose error is at most `error` and whose agreement is not coincidental.
    #[must_use]
    pub fn cheapest_sound(&self, error: f64) -> Option<&Point> {
        let figures = self.sound().filter(|(_, figures)| figures.1 <= error);
        let cheapest = figures.min_by(|a, b| a.1.0.total_cmp(&b.1.0));
        cheapest.map(|(point, _)| point)
    }

    /// The smallest error of all points whose agreement is not coincidental.
    #[must_use]
    pub fn best_sound(&self) -> Option<&Point> {
        let best = self.sound().min_by(|a, b| a.1.1.total_cmp(&b.1.1));
        best.map(|(point, _)| point)
    }

    /// Valid points whose agreement is not coincidental, with cost and error.
    fn sound(&self) -> impl Iterator<Item = (&Point, (f64, f64))> {
        let points = self.points.iter();
        points
            .filter(|point| self.coincidence(point).is_none())
            .filter_map(|point| Some((point, point.cost_and_error()?)))
    }
}
