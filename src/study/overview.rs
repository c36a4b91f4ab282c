//! The cost of 1 % error: one row per problem.

use super::{
    Study,
    page::{number, percent},
    report::TARGETS,
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

/// The cheapest setting for an error, with its cost; if its agreement is coincidental, also the
/// cheapest setting whose agreement is not.
pub(super) fn cheapest(case: &CaseResult, error: f64) -> String {
    let cost = |point: &Point| {
        let ms = point.ms.map_or(f64::NAN, |ms| ms.median);
        format!("{}, {} ms", point.setting, number(ms))
    };
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
