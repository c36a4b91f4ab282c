//! The cost of 1 % error: one row per problem.

use super::{
    Study,
    numbers::{TARGETS, number, percent},
    results::{CaseResult, Point},
};
use crate::output::document::Block;

/// A table of the cost of 1 % error, one row per problem.
pub(super) fn table(study: &Study) -> Block {
    let head = ["problem", "mesh", "10 %", "1 %", "0.1 %", "mesh error"];
    let mut rows = Vec::new();
    for problem in &study.problems {
        if let Some(case) = problem.finest_with_errors() {
            let mut row = vec![problem.problem.title.clone(), case.case.level_name.clone()];
            row.extend(TARGETS.map(|target| cheapest(case, target)));
            row.push(mesh_error_words(case));
            rows.push(row);
        }
    }
    Block::table("", &head, rows)
}

/// A setting with its cost.
pub(super) fn cost_words(point: &Point) -> String {
    let ms = point.ms.map_or(f64::NAN, |ms| ms.median);
    format!("{}, {} ms", point.setting, number(ms))
}

/// The table with a column for each figure, for a page: numbers without words between them. What
/// is to be said about a setting follows on a second line.
pub(super) fn wide_table(study: &Study) -> Block {
    let head = [
        "problem",
        "mesh",
        "for 10 %",
        "cost",
        "for 1 %",
        "cost",
        "for 0.1 %",
        "cost",
        "mesh error",
    ];
    let mut rows = Vec::new();
    for problem in &study.problems {
        let Some(case) = problem.finest_with_errors() else {
            continue;
        };
        let mut row = vec![problem.problem.title.clone(), case.case.level_name.clone()];
        for target in TARGETS {
            row.extend(setting_and_cost(case, target));
        }
        row.push(match (case.mesh_error, case.doubt()) {
            (Some(error), Some(doubt)) if error < doubt => format!("< {}", percent(doubt)),
            _ => mesh_error_words(case),
        });
        rows.push(row);
    }
    Block::table("", &head, rows)
}

/// The cheapest setting for an error whose agreement is not coincidental, with remarks, and its cost.
fn setting_and_cost(case: &CaseResult, error: f64) -> [String; 2] {
    let mut remarks = Vec::new();
    if let Some((point, rivals)) = case.cheapest(error) {
        if case.coincidence(point).is_some() {
            remarks.push(format!("coincidental: {}", cost_words(point)));
        } else if !rivals.is_empty() {
            remarks.push("within noise".to_owned());
        }
    }
    let sound = case.cheapest_sound(error);
    if let (None, Some(best)) = (sound, case.best_sound().and_then(|best| best.error)) {
        remarks.insert(0, format!("best {}", percent(best)));
    }
    let mut setting = sound.map_or("not reached".to_owned(), |point| point.setting.to_string());
    if !remarks.is_empty() {
        setting += &format!("\n{}", remarks.join(", "));
    }
    let ms = sound.and_then(|point| point.ms);
    let cost = ms.map_or("—".to_owned(), |ms| format!("{} ms/s", number(ms.median)));
    [setting, cost]
}

/// The cheapest setting for an error, with its cost; if its agreement is coincidental, also the
/// cheapest setting whose agreement is not.
pub(super) fn cheapest(case: &CaseResult, error: f64) -> String {
    let cost = cost_words;
    match (case.cheapest(error), case.cheapest_sound(error)) {
        (Some((point, _)), sound) if case.coincidence(point).is_some() => {
            let sound = sound.map_or_else(|| not_reached(case), cost);
            format!("{sound} (coincidental: {})", cost(point))
        }
        (Some((point, rivals)), _) if rivals.is_empty() => cost(point),
        (Some((point, _)), _) => format!("{} *within noise*", cost(point)),
        (None, _) => not_reached(case),
    }
}

fn not_reached(case: &CaseResult) -> String {
    let best = case.best_sound().and_then(|best| best.error);
    best.map_or("not reached".to_owned(), |best| {
        format!("not reached (best {})", percent(best))
    })
}

fn mesh_error_words(case: &CaseResult) -> String {
    match (case.mesh_error, case.doubt()) {
        (Some(error), Some(doubt)) if error < doubt => format!("below {}", percent(doubt)),
        (Some(error), _) => percent(error),
        (None, _) => "—".to_owned(),
    }
}
