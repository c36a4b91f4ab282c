//! The precision floor of f32: where more substeps increase the error.

use super::{
    numbers::{number, percent},
    results::{CaseResult, Point},
    setting::Method,
};

/// Minimum ratio to the error with fewer substeps for an error to count as worse.
const WORSE: f64 = 1.5;

/// With one iteration: the point with the smallest error and the point with the most substeps, if
/// the latter is clearly worse.
#[must_use]
pub fn turn(case: &CaseResult) -> Option<(&Point, &Point)> {
    let error = |point: &Point| point.error.unwrap_or(f64::NAN);
    let line: Vec<&Point> = case
        .points
        .iter()
        .filter(|point| point.setting.method == Method::Xpbd && point.setting.iterations == 1)
        .filter(|point| point.cost_and_error().is_some())
        .collect();
    let best = line.iter().min_by(|a, b| error(a).total_cmp(&error(b)))?;
    let worst = line.iter().max_by_key(|point| point.setting.substeps)?;
    let worse = error(worst) > WORSE * error(best) && !worst.below_reference;
    // Below 0.001 %, an increase of the error is irrelevant.
    (worse && error(worst) > 1e-5).then_some((*best, *worst))
}

/// With one iteration: the points at which the body never moved although the problem observes
/// motion, in order of increasing substeps. A substep moves their particles by less than half the
/// distance of adjacent f32 values.
#[must_use]
pub fn motionless(case: &CaseResult) -> Vec<&Point> {
    let points = case.points.iter();
    points
        .filter(|_| case.case.problem.observe.wants_motion())
        .filter(|point| point.setting.method == Method::Xpbd && point.setting.iterations == 1)
        .filter(|point| point.error.is_some_and(f64::is_finite) && !point.settled())
        .collect()
}

/// The precision floor of a case, if its points show one with one iteration: where errors turn, the
/// velocity noise ε‖x‖/h there, and gravity's displacement per substep beside the distance of two
/// numbers of f32.
#[must_use]
pub fn facts(case: &CaseResult) -> Vec<[String; 2]> {
    let Some((best, worst)) = turn(case) else {
        return Vec::new();
    };
    let Some(run) = worst.run.as_ref() else {
        return Vec::new();
    };
    let reach = run.reach;
    // The spacing of f32 values near x is between ε x/2 and ε x.
    let ulp = f64::from(f32::EPSILON) * 2.0_f64.powf(reach.log2().floor());
    let noise = f64::from(f32::EPSILON) * reach / worst.h;
    let fall = f64::from(case.case.world.settings.gravity.length()) * worst.h * worst.h;
    let at = |point: &Point| {
        format!(
            "{} at {} substeps",
            percent(point.error.unwrap_or(f64::NAN)),
            point.setting.substeps
        )
    };
    let mut facts = vec![
        [
            "Precision floor (1 iteration): least error".to_owned(),
            at(best),
        ],
        ["Precision floor: error beyond it".to_owned(), at(worst)],
        [
            "Velocity noise ε‖x‖/h there".to_owned(),
            format!("{} m/s at ‖x‖ = {} m", number(noise), number(reach)),
        ],
    ];
    if fall > 0.0 {
        let lost = if fall < ulp / 2.0 {
            " (rounded to zero: a particle at rest does not begin to fall)"
        } else {
            ""
        };
        facts.push([
            "Displacement gh² of a particle that begins to fall, and spacing of f32".to_owned(),
            format!("{} m, {} m{lost}", number(fall), number(ulp)),
        ]);
    }
    facts
}
