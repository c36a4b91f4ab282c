//! What f32 cannot reach: where more substeps make an answer worse.

use super::{
    results::{CaseResult, Point},
    setting::Method,
    words::{number, percent},
};

/// An error must be so many times that with fewer substeps to count as worse.
const WORSE: f64 = 1.5;

/// With one iteration: the point with the least error, and that with the most substeps, if it is
/// clearly worse.
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
    // What is off by less than a thousandth of a per cent is worse than nothing only on paper.
    (worse && error(worst) > 1e-5).then_some((*best, *worst))
}

/// With one iteration: the points that never moved, of a problem that is about motion, from the
/// fewest substeps on. A substep takes them less than half the distance of two numbers of f32.
#[must_use]
pub fn frozen(case: &CaseResult) -> Vec<&Point> {
    let points = case.points.iter();
    points
        .filter(|_| case.case.problem.observe.wants_motion())
        .filter(|point| point.setting.method == Method::Xpbd && point.setting.iterations == 1)
        .filter(|point| point.error.is_some_and(f64::is_finite) && !point.settled())
        .collect()
}

/// The floor of a case, if its points show one: with one iteration, the substeps beyond which
/// errors rise, what the noise ε‖x‖/h is there, and how far a particle falls in a substep beside the
/// distance of two numbers of f32.
#[must_use]
pub fn sentence(case: &CaseResult) -> Option<String> {
    let error = |point: &Point| point.error.unwrap_or(f64::NAN);
    let (best, worst) = turn(case)?;
    let reach = worst.run.as_ref()?.reach;
    // Numbers near x lie ε x/2 to ε x apart.
    let ulp = f64::from(f32::EPSILON) * 2.0_f64.powf(reach.log2().floor());
    let noise = f64::from(f32::EPSILON) * reach / worst.h;
    let gravity = case.case.world.settings.gravity.length();
    let fall = f64::from(gravity) * worst.h * worst.h;
    let mut words = format!(
        "Precision floor of f32: with one iteration, errors fall to {} at {} substeps and rise to {} \
         at {}. There the velocity noise ε‖x‖/h is {} m/s at ‖x‖ = {} m",
        percent(error(best)),
        best.setting.substeps,
        percent(error(worst)),
        worst.setting.substeps,
        number(noise),
        number(reach),
    );
    if fall > 0.0 {
        words += &format!(
            ", and a particle starting to fall moves by gh² = {} m per substep, where f32 values are \
             {} m apart",
            number(fall),
            number(ulp)
        );
        if fall < ulp / 2.0 {
            words += ": less than half of that, so a resting particle does not move, and gravity has no effect";
        }
    }
    Some(words + ".")
}
