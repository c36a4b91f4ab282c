//! Where the method falls short: the tables with which a report begins.

use super::{
    Setting, Study, floor,
    numbers::{TARGETS, number, percent},
    results::CaseResult,
};
use crate::output::document::Block;

/// The setting closest to the default of a world (10 substeps) that every budget includes.
const DEFAULT: Setting = Setting::xpbd(16, 1);
/// Maximum number of rows in the table of costs, the most expensive first.
const MAX_SLOW: usize = 6;

/// A kind of weakness: a caption, the names of the columns, a row for each problem.
struct Weakness {
    caption: String,
    head: &'static [&'static str],
    rows: Vec<Vec<String>>,
}

/// All kinds, those without a row left out.
fn found(study: &Study) -> Vec<Weakness> {
    let all = [
        unreached(study),
        slow(study),
        rounding(study),
        motionless(study),
        coincidental(study),
        coarse(study),
        uncertain(study),
        unknown(study),
    ];
    all.into_iter()
        .filter(|weakness| !weakness.rows.is_empty())
        .collect()
}

/// A row for each problem that has one on its finest mesh with errors, after its title.
fn by_problem(study: &Study, row: impl Fn(&CaseResult) -> Option<Vec<String>>) -> Vec<Vec<String>> {
    let rows = study.problems.iter().filter_map(|problem| {
        let mut cells = vec![problem.problem.title.clone()];
        cells.extend(row(problem.finest_with_errors()?)?);
        Some(cells)
    });
    rows.collect()
}

fn unreached(study: &Study) -> Weakness {
    Weakness {
        caption: "Error of 1 % not reached".to_owned(),
        head: &["problem", "least error", "setting"],
        rows: by_problem(study, |case| {
            let best = case.best_sound()?;
            let error = best.error.filter(|&error| error > TARGETS[1])?;
            Some(vec![percent(error), best.setting.to_string()])
        }),
    }
}

fn slow(study: &Study) -> Weakness {
    let mut rows: Vec<(f64, Vec<String>)> = Vec::new();
    for problem in &study.problems {
        let row = || {
            let case = problem.finest_with_errors()?;
            let best = case.cheapest_sound(TARGETS[1])?;
            let default = case.point(DEFAULT)?;
            let error = default.error.filter(|&error| error > TARGETS[1])?;
            let times = best.ms?.median / default.ms?.median;
            let cells = vec![
                problem.problem.title.clone(),
                percent(error),
                best.setting.to_string(),
                format!("{}×", number(times)),
            ];
            (times > 1.0).then_some((times, cells))
        };
        rows.extend(row());
    }
    rows.sort_by(|a, b| b.0.total_cmp(&a.0));
    Weakness {
        caption: format!(
            "Cost of an error of 1 % relative to {DEFAULT} (the default of a world is 10×1)"
        ),
        head: &["problem", "error at 16×1", "setting for 1 %", "cost"],
        rows: rows
            .into_iter()
            .take(MAX_SLOW)
            .map(|(_, cells)| cells)
            .collect(),
    }
}

fn rounding(study: &Study) -> Weakness {
    Weakness {
        caption: "Precision floor: more substeps increase the error".to_owned(),
        head: &["problem", "least error", "substeps", "error", "substeps"],
        rows: by_problem(study, |case| {
            let (best, worst) = floor::turn(case)?;
            Some(vec![
                percent(best.error?),
                best.setting.substeps.to_string(),
                percent(worst.error?),
                worst.setting.substeps.to_string(),
            ])
        }),
    }
}

fn motionless(study: &Study) -> Weakness {
    Weakness {
        caption: "No motion, as the displacement per substep is rounded to zero".to_owned(),
        head: &["problem", "from substeps"],
        rows: by_problem(study, |case| {
            let first = *floor::motionless(case).first()?;
            Some(vec![first.setting.substeps.to_string()])
        }),
    }
}

fn coincidental(study: &Study) -> Weakness {
    Weakness {
        caption: "Coincidental agreement of classic PBD: too few iterations happen to give the \
                  requested compliance, and more of them increase the error"
            .to_owned(),
        head: &["problem", "settings on the Pareto front"],
        rows: by_problem(study, |case| {
            let front = case.front().into_iter();
            let lucky = front.filter(|point| case.coincidence(point).is_some());
            let names: Vec<String> = lucky.map(|point| point.setting.to_string()).collect();
            (!names.is_empty()).then(|| vec![names.join(", ")])
        }),
    }
}

fn coarse(study: &Study) -> Weakness {
    let mut rows = Vec::new();
    for problem in &study.problems {
        let mut cases = problem.cases.iter();
        let coarsest = cases.find_map(|case| Some((case, case.mesh_error?)));
        if let Some((case, error)) = coarsest.filter(|(_, error)| *error > TARGETS[0]) {
            let title = problem.problem.title.clone();
            rows.push(vec![title, case.case.level_name.clone(), percent(error)]);
        }
    }
    Weakness {
        caption: "Error of the coarsest mesh above 10 %, whatever the solver".to_owned(),
        head: &["problem", "mesh", "mesh error"],
        rows,
    }
}

fn uncertain(study: &Study) -> Weakness {
    let cases = study.problems.iter().flat_map(|problem| &problem.cases);
    let rows = cases.filter_map(|case| {
        let doubt = case.doubt().filter(|&doubt| doubt > TARGETS[1])?;
        Some(vec![case.case.id(), percent(doubt)])
    });
    Weakness {
        caption: "Converged solution uncertain: ignore smaller differences".to_owned(),
        head: &["mesh", "uncertainty"],
        rows: rows.collect(),
    }
}

fn unknown(study: &Study) -> Weakness {
    let cases = study.problems.iter().flat_map(|problem| &problem.cases);
    let rows = cases.filter(|case| case.converged.is_none());
    Weakness {
        caption: "No converged solution, and so no error: the reference was too costly or diverged"
            .to_owned(),
        head: &["mesh"],
        rows: rows.map(|case| vec![case.case.id()]).collect(),
    }
}

/// The text for a study without weaknesses.
fn nothing(study: &Study) -> String {
    let cases = study.problems.iter().flat_map(|problem| &problem.cases);
    let points = cases.flat_map(|case| &case.points);
    match points.filter(|point| point.run.is_none()).count() {
        0 => "None in the settings tried.".to_owned(),
        skipped => {
            format!("None in the settings tried. Settings skipped as too costly: {skipped}.")
        }
    }
}

/// A table for each kind.
pub(super) fn tables(study: &Study) -> Vec<Block> {
    let found = found(study);
    if found.is_empty() {
        return vec![Block::Text(nothing(study))];
    }
    let tables = found
        .into_iter()
        .map(|weakness| Block::table(weakness.caption, weakness.head, weakness.rows));
    tables.collect()
}

/// The same as lines for a terminal.
pub(super) fn lines(study: &Study) -> Vec<String> {
    let mut lines = vec!["Weaknesses found:".to_owned()];
    let found = found(study);
    if found.is_empty() {
        lines.push(format!("  {}", nothing(study)));
    }
    for weakness in found {
        lines.push(format!("  {}", weakness.caption));
        lines.push(format!("    [{}]", weakness.head.join(" | ")));
        let rows = weakness.rows.iter();
        lines.extend(rows.map(|cells| format!("    {}", cells.join(" | "))));
    }
    lines
}
