//! The output folder of a study: `points.csv`, a diagram for each problem, `report.md`, a
//! self-contained `report.html`, and `study.json`.

pub use super::numbers::TARGETS;

use super::{
    Study, StudyError, html, page, picture,
    results::{CaseResult, Point, ProblemResult},
};
use crate::{
    bench::Spread,
    file,
    output::{
        self,
        document::{self, Block},
    },
};
use serde_json::{Value, json};
use std::path::Path;

/// Writes all files of a study into its folder.
///
/// # Errors
/// [`StudyError::Output`] with the file and the system's message.
pub fn write(folder: &Path, study: &Study) -> Result<(), StudyError> {
    let save = |name: &str, text: &str| {
        let path = folder.join(name);
        file::replace(&path, text.as_bytes()).map_err(|error| StudyError::unwritable(&path, error))
    };
    let mut blocks = page::beginning(study);
    let mut pictures = Vec::new();
    for problem in &study.problems {
        let picture = picture_of(folder, problem)?;
        if let Some(Block::Figure { file, svg, .. }) = &picture {
            save(file, svg)?;
        }
        blocks.extend(page::problem(problem));
        blocks.extend(picture.clone());
        blocks.extend(page::front(problem));
        pictures.push(picture);
    }
    blocks.push(Block::Heading(2, "Method".to_owned()));
    blocks.push(page::method(study));
    save("report.md", &document::markdown(&blocks))?;
    save(
        "report.html",
        &output::page::html(&html::page(study, &pictures)),
    )?;
    let object = serde_json::to_string_pretty(&json(study));
    let object =
        object.map_err(|error| StudyError::unwritable(&folder.join("study.json"), error))?;
    save("study.json", &object)?;
    write_csv(&folder.join("points.csv"), study)
}

/// The diagram of a problem; `None` if it has no point to draw.
fn picture_of(folder: &Path, problem: &ProblemResult) -> Result<Option<Block>, StudyError> {
    if !problem.drawable() {
        return Ok(None);
    }
    let file = format!("{}.svg", problem.problem.name);
    let svg = picture::draw(problem)
        .map_err(|error| StudyError::unwritable(&folder.join(&file), error))?;
    Ok(Some(Block::Figure {
        caption: page::caption(problem),
        file,
        svg,
    }))
}

/// The study as one JSON object.
#[must_use]
pub fn json(study: &Study) -> Value {
    json!({
        "version": study.header.version,
        "budget": study.header.budget,
        "hash": study.header.hash,
        "machines": study.machines,
        "problems": study.problems.iter().map(problem_json).collect::<Vec<_>>(),
    })
}

fn problem_json(result: &ProblemResult) -> Value {
    let problem = &result.problem;
    let cheapest = |error: f64| -> Vec<Value> {
        let cases = result.cases.iter();
        cases
            .filter_map(|case| {
                let (point, rivals) = case.cheapest(error)?;
                let mut value = point_json(case, point);
                let rivals = rivals.iter().map(|rival| rival.setting.to_string());
                value["within_noise_of"] = rivals.collect::<Vec<_>>().into();
                Some(value)
            })
            .collect()
    };
    json!({
        "name": problem.name,
        "title": problem.title,
        "unit": problem.observe.unit(),
        "reference": {
            "kind": problem.reference.words(),
            "value": result.reference,
            "mesh_order": result.mesh_order,
        },
        "mesh_error": result.cases.iter().rev().find_map(|case| case.mesh_error),
        "hash": problem.hash,
        "levels": result.cases.iter().map(case_json).collect::<Vec<_>>(),
        "points": result
            .cases
            .iter()
            .flat_map(|case| case.points.iter().map(|point| point_json(case, point)))
            .collect::<Vec<_>>(),
        "cheapest": {
            "10%": cheapest(TARGETS[0]),
            "1%": cheapest(TARGETS[1]),
            "0.1%": cheapest(TARGETS[2]),
        },
    })
}

fn case_json(result: &CaseResult) -> Value {
    json!({
        "level": result.case.level + 1,
        "name": result.case.level_name,
        "particles": result.case.particles(),
        "constraints": result.case.constraints(),
        "answer": result.answer(),
        "order": result.converged.as_ref().and_then(|converged| converged.order),
        "settled": result.converged.as_ref().map(|converged| converged.settled),
        "found_by": result.converged.as_ref().map(|converged| converged.found_by),
        "uncertainty": result
            .converged
            .as_ref()
            .zip(result.scale)
            .map(|(converged, scale)| converged.uncertainty / scale),
        "mesh_error": result.mesh_error,
        "hash": result.hash(),
    })
}

fn spread_json(spread: Spread) -> Value {
    json!({ "low": spread.low, "median": spread.median, "high": spread.high })
}

fn point_json(case: &CaseResult, point: &Point) -> Value {
    let run = point.run.as_ref();
    let residuals = run.and_then(|run| run.residuals);
    json!({
        "method": point.setting.method.name(),
        "substeps": point.setting.substeps,
        "iterations": point.setting.iterations,
        "level": case.case.level + 1,
        "projections_per_tick": point.projections_per_tick,
        "ms_per_second": point.ms.map(|spread| spread.median),
        "ms_per_second_spread": point.ms.map(spread_json),
        "threads": point.ms_all.map(|(threads, _)| threads),
        "ms_per_second_all_threads": point.ms_all.map(|(_, spread)| spread_json(spread)),
        "error": point.error,
        "value": point.value(),
        "predicted": point.predicted,
        "below_reference": point.below_reference,
        "settled": point.settled(),
        "skipped": run.is_none(),
        "primal_residual": residuals.map(|residuals| residuals.primal),
        "dual_residual": residuals.and_then(|residuals| residuals.dual),
        "machine": point.machine,
        "hash": point.hash,
    })
}

/// Column names of `points.csv`, with units; errors and residuals are fractions: 0.01 is 1 %.
pub const COLUMNS: [&str; 22] = [
    "problem",
    "level",
    "method",
    "substeps",
    "iterations",
    "particles",
    "constraints",
    "projections_per_tick",
    "error",
    "mesh_error",
    "value",
    "unit",
    "predicted",
    "settled",
    "ms_per_second",
    "ms_per_second_low",
    "ms_per_second_high",
    "ms_per_second_all_threads",
    "primal_residual",
    "dual_residual",
    "machine",
    "hash",
];

fn write_csv(path: &Path, study: &Study) -> Result<(), StudyError> {
    let unwritable = |error: &dyn std::fmt::Display| StudyError::unwritable(path, error);
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer
        .write_record(COLUMNS)
        .map_err(|error| unwritable(&error))?;
    for problem in &study.problems {
        for case in &problem.cases {
            for point in &case.points {
                writer
                    .write_record(row(problem, case, point))
                    .map_err(|error| unwritable(&error))?;
            }
        }
    }
    let text = writer.into_inner().map_err(|error| unwritable(&error))?;
    file::replace(path, &text).map_err(|error| unwritable(&error))
}

fn row(problem: &ProblemResult, case: &CaseResult, point: &Point) -> [String; COLUMNS.len()] {
    let number = |number: Option<f64>| number.map_or(String::new(), |number| number.to_string());
    let residuals = point.run.as_ref().and_then(|run| run.residuals);
    [
        problem.problem.name.clone(),
        (case.case.level + 1).to_string(),
        point.setting.method.name().to_owned(),
        point.setting.substeps.to_string(),
        point.setting.iterations.to_string(),
        case.case.particles().to_string(),
        case.case.constraints().to_string(),
        point.projections_per_tick.to_string(),
        number(point.error),
        number(case.mesh_error),
        number(point.value()),
        problem.problem.observe.unit().to_owned(),
        number(point.predicted),
        point
            .run
            .as_ref()
            .map_or("", |_| if point.settled() { "true" } else { "false" })
            .to_owned(),
        number(point.ms.map(|spread| spread.median)),
        number(point.ms.map(|spread| spread.low)),
        number(point.ms.map(|spread| spread.high)),
        number(point.ms_all.map(|(_, spread)| spread.median)),
        number(residuals.map(|residuals| residuals.primal)),
        number(residuals.and_then(|residuals| residuals.dual)),
        point.machine.clone().unwrap_or_default(),
        point.hash.clone(),
    ]
}

/// The study in a few lines: its weaknesses, then a line for each problem.
#[must_use]
pub fn summary(study: &Study) -> Vec<String> {
    page::summary(study)
}
