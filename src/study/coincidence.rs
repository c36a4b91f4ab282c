//! The agreement of classic PBD is sometimes coincidental: it knows no compliance, and too few sweeps over
//! rigid constraints can happen to be as soft as was asked. More sweeps then make it worse, and
//! another mesh or substep makes it something else.

use super::{
    results::{CaseResult, Point},
    setting::Method,
    words::percent,
};

/// Factor by which an error with more iterations must be larger for the smaller one to be a coincidence.
const WORSE: f64 = 1.5;

impl CaseResult {
    /// The point that shows that the agreement of this one is coincidental: of those without compliance and with
    /// as many substeps, or iterations, that take more work, the worst, if it is clearly worse.
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

    /// The cheapest point that is at most so wrong, and not by coincidence.
    #[must_use]
    pub fn cheapest_sound(&self, error: f64) -> Option<&Point> {
        let figures = self.sound().filter(|(_, figures)| figures.1 <= error);
        let cheapest = figures.min_by(|a, b| a.1.0.total_cmp(&b.1.0));
        cheapest.map(|(point, _)| point)
    }

    /// The least error of all points whose agreement is not coincidental.
    #[must_use]
    pub fn best_sound(&self) -> Option<&Point> {
        let best = self.sound().min_by(|a, b| a.1.1.total_cmp(&b.1.1));
        best.map(|(point, _)| point)
    }

    /// Points that count and whose agreement is not coincidental, with cost and error.
    fn sound(&self) -> impl Iterator<Item = (&Point, (f64, f64))> {
        let points = self.points.iter();
        points
            .filter(|point| self.coincidence(point).is_none())
            .filter_map(|point| Some((point, point.cost_and_error()?)))
    }
}

/// Which points of a front agree by coincidence, if any.
pub(super) fn sentence(case: &CaseResult) -> Option<String> {
    let all: Vec<(&Point, &Point)> = case
        .front()
        .into_iter()
        .filter_map(|point| Some((point, case.coincidence(point)?)))
        .collect();
    let (_, worst) = all.iter().max_by(|a, b| {
        a.1.error
            .unwrap_or(0.0)
            .total_cmp(&b.1.error.unwrap_or(0.0))
    })?;
    let names: Vec<String> = all
        .iter()
        .map(|(point, _)| {
            let error = percent(point.error.unwrap_or(f64::NAN));
            format!("{} ({error})", point.setting)
        })
        .collect();
    Some(format!(
        "Coincidental agreement on the Pareto front: {} ({}). Without compliance, too few iterations \
         happen to give the requested compliance; the error of {} is {}.",
        names.join(", "),
        case.case.level_name,
        worst.setting,
        percent(worst.error.unwrap_or(f64::NAN)),
    ))
}
