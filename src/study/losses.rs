//! Where the method loses, in words: what a reader must know first.

use super::{
    Setting, Study, floor,
    report::TARGETS,
    words::{number, percent},
};

/// What is worse than one would wish, the worst first.
pub(super) fn sentences(study: &Study) -> Vec<String> {
    let mut sentences = Vec::new();
    let unreached: Vec<String> = study
        .problems
        .iter()
        .filter_map(|problem| {
            let case = problem.finest_with_errors()?;
            let best = case.best_sound()?;
            let error = best.error?;
            (error > TARGETS[1]).then(|| {
                format!(
                    "{} (best {}, {})",
                    problem.problem.title,
                    percent(error),
                    best.setting
                )
            })
        })
        .collect();
    if !unreached.is_empty() {
        sentences.push(format!(
            "No setting reaches 1 % on: {}.",
            unreached.join("; ")
        ));
    }
    let mut slow: Vec<(f64, String)> = study
        .problems
        .iter()
        .filter_map(|problem| {
            let case = problem.finest_with_errors()?;
            let best = case.cheapest_sound(TARGETS[1])?;
            let default = case.point(DEFAULT)?;
            let error = default.error.filter(|&error| error > TARGETS[1])?;
            let ms = best.ms?.median / default.ms?.median;
            (ms > 1.0).then(|| {
                (
                    ms,
                    format!(
                        "{}: the default, {}, has an error of {}; 1 % takes {}, at {} times the cost",
                        problem.problem.title,
                        DEFAULT_WORDS,
                        percent(error),
                        best.setting,
                        number(ms)
                    ),
                )
            })
        })
        .collect();
    slow.sort_by(|a, b| b.0.total_cmp(&a.0));
    sentences.extend(slow.into_iter().take(6).map(|(_, words)| words + "."));
    let rounded: Vec<String> = study
        .problems
        .iter()
        .filter_map(|problem| {
            let (best, worst) = floor::turn(problem.finest_with_errors()?)?;
            Some(format!(
                "{} ({} at {} substeps, {} at {})",
                problem.problem.title,
                percent(best.error?),
                best.setting.substeps,
                percent(worst.error?),
                worst.setting.substeps
            ))
        })
        .collect();
    if !rounded.is_empty() {
        sentences.push(format!(
            "In f32 more substeps increase the error, as ε‖x‖/h grows: {}.",
            rounded.join("; ")
        ));
    }
    let frozen: Vec<String> = study
        .problems
        .iter()
        .filter_map(|problem| {
            let substeps = floor::frozen(problem.finest_with_errors()?)
                .first()?
                .setting
                .substeps;
            Some(format!("{} ({substeps})", problem.problem.title))
        })
        .collect();
    if !frozen.is_empty() {
        sentences.push(format!(
            "In f32 the body does not move at all with so many substeps: {}.",
            frozen.join("; ")
        ));
    }
    let lucky: Vec<&str> = study
        .problems
        .iter()
        .filter(|problem| {
            let case = problem.finest_with_errors();
            case.is_some_and(|case| {
                let front = case.front();
                front.iter().any(|point| case.coincidence(point).is_some())
            })
        })
        .map(|problem| &problem.problem.title[..])
        .collect();
    if !lucky.is_empty() {
        sentences.push(format!(
            "Classic PBD has no compliance and agrees coincidentally on: {}. There, too few iterations \
             happen to give the requested compliance, and more of them increase the error.",
            lucky.join("; ")
        ));
    }
    let locking: Vec<String> = study
        .problems
        .iter()
        .filter_map(|problem| {
            let case = problem
                .cases
                .iter()
                .find(|case| case.mesh_error.is_some())?;
            let error = case.mesh_error.filter(|&error| error > TARGETS[0])?;
            let name = &case.case.level_name;
            Some(format!(
                "{} ({name}: {})",
                problem.problem.title,
                percent(error)
            ))
        })
        .collect();
    if !locking.is_empty() {
        sentences.push(format!(
            "The error of the coarsest mesh is above 10 %, independent of the solver: {}.",
            locking.join("; ")
        ));
    }
    let doubtful: Vec<String> = study
        .problems
        .iter()
        .flat_map(|problem| &problem.cases)
        .filter(|case| case.doubt().is_some_and(|doubt| doubt > TARGETS[1]))
        .map(|case| case.case.id())
        .collect();
    if !doubtful.is_empty() {
        sentences.push(format!(
            "The converged solution is uncertain by more than 1 % for {}: ignore smaller differences \
             there.",
            doubtful.join(", ")
        ));
    }
    let unknown: Vec<String> = study
        .problems
        .iter()
        .flat_map(|problem| &problem.cases)
        .filter(|case| case.converged.is_none())
        .map(|case| case.case.id())
        .collect();
    if !unknown.is_empty() {
        sentences.push(format!(
            "No converged solution, and so no error, for: {}.",
            unknown.join(", ")
        ));
    }
    if sentences.is_empty() {
        let points = study.problems.iter().flat_map(|problem| &problem.cases);
        let points = points.flat_map(|case| &case.points);
        sentences.push(match points.filter(|point| point.run.is_none()).count() {
            0 => "None in the settings tried.".to_owned(),
            skipped => {
                format!("None in the settings tried. Settings skipped as too costly: {skipped}.")
            }
        });
    }
    sentences
}

/// The settings nearest to the default of a world among those that every budget tries.
const DEFAULT: Setting = Setting::xpbd(16, 1);
const DEFAULT_WORDS: &str = "16 substeps of one iteration (the default of a world is 10)";
