//! What was found, in words. Every figure in a sentence is from the data.

use super::{
    Study,
    closed_form::Reference,
    coincidence,
    converge::{FIRST_ORDER, FoundBy},
    floor, growth, losses, overview,
    report::TARGETS,
    results::{CaseResult, Point, ProblemResult},
    rivalry,
};
use crate::output::document::Block;

/// A share as per cent, with two digits that say something.
pub(super) fn percent(share: f64) -> String {
    format!("{} %", number(share * 100.0))
}

/// A number with three digits.
pub(super) fn number(number: f64) -> String {
    let size = number.abs();
    if number == 0.0 || !number.is_finite() {
        format!("{number}")
    } else if !(1e-3..1e5).contains(&size) {
        format!("{number:.1e}")
    } else {
        let digits = (2 - size.log10().floor() as i32).clamp(0, 6);
        format!("{number:.*}", digits as usize)
    }
}

/// The title, the bad news, and what there is to know before the rest.
pub(super) fn beginning(study: &Study) -> Vec<Block> {
    let mut blocks = vec![
        Block::Heading(1, "Accuracy vs. cost".to_owned()),
        Block::Text("Weaknesses found:".to_owned()),
        Block::List(losses::sentences(study)),
        Block::Heading(2, "What 1 % costs".to_owned()),
        overview::table(study),
        Block::Text(
            "Costs are median milliseconds of one thread per simulated second; a setting is \
             *substeps × iterations* per tick. **Solver error** is the distance to the converged \
             solution on the same mesh: its static equilibrium, or the f64 reference with small \
             steps. **Mesh error** is the distance of that solution to the continuum. The two are \
             not added."
                .to_owned(),
        ),
    ];
    if study.machines.len() > 1 {
        blocks.push(Block::Text(format!(
            "**Times are from {} machines** and cannot be compared across problems: {}. Meshes with \
             points from several machines are marked.",
            study.machines.len(),
            study.machines.join("; ")
        )));
    }
    blocks.push(Block::Heading(2, "Substeps or iterations".to_owned()));
    blocks.push(Block::List(rivalry::sentences(study)));
    blocks
}

/// All sentences about a problem.
pub(super) fn problem(study: &Study, result: &ProblemResult) -> Vec<Block> {
    let problem = &result.problem;
    let mut sentences = vec![reference(result)];
    if let Some(case) = result.finest_with_errors() {
        sentences.extend(cheapest(case));
        sentences.extend(coincidence::sentence(case));
        sentences.extend(floor::sentence(case));
        sentences.extend(predictions(case));
    }
    sentences.extend(growth::sentence(study, result));
    sentences.extend(gaps(result));
    vec![
        Block::Heading(2, problem.title.clone()),
        Block::Text(problem.about.clone()),
        Block::List(sentences),
    ]
}

fn reference(result: &ProblemResult) -> String {
    let unit = result.problem.observe.unit();
    let unit = if unit == "1" { "" } else { unit };
    let against = result.problem.reference;
    let mut words = match (against, result.reference) {
        (Reference::Converged, _) => {
            "No closed form: errors are relative to the f64 reference, and the mesh error is unknown."
                .to_owned()
        }
        (Reference::FinestMesh, Some(value)) => match result.mesh_order {
            Some(order) => format!(
                "No closed form. The meshes converge to {} {unit} with order {order:.1}.",
                number(value)
            ),
            None => format!(
                "No closed form, and the meshes do not show a convergence order yet. Mesh errors are \
                 relative to the finest mesh, {} {unit}.",
                number(value)
            ),
        },
        (Reference::FinestMesh, None) => {
            "No closed form, and a single mesh gives no mesh error.".to_owned()
        }
        (_, Some(value)) => format!("Reference: {} = {} {unit}.", against.words(), number(value)),
        (_, None) => String::new(),
    };
    for case in &result.cases {
        let Some(converged) = &case.converged else {
            continue;
        };
        let asked = f64::from(case.case.world.settings.order.get());
        if let Some(order) = converged.order
            && !FIRST_ORDER.contains(&(order - asked + 1.0))
        {
            words += &format!(
                " On {} the reference converges with order {order:.2} instead of {asked}, up to {} substeps.",
                case.case.level_name, converged.substeps
            );
        }
        if let FoundBy::Equilibrium { residual } = converged.found_by {
            words += &format!(
                " On {} the converged solution is the static equilibrium by Newton's method, with a \
                 residual of {} of the load.",
                case.case.level_name,
                number(residual)
            );
        }
        if !converged.settled {
            words += &format!(" On {} the reference did not settle.", case.case.level_name);
        }
    }
    words
}

fn cheapest(case: &CaseResult) -> Vec<String> {
    let mesh = &case.case.level_name;
    TARGETS
        .iter()
        .map(|&target| match case.cheapest(target) {
            Some((point, rivals)) => {
                let ms = point.ms.map_or(f64::NAN, |ms| ms.median);
                let mut words = format!(
                    "For {} solver error ({mesh}): {}, {} ms per simulated second, {} projections per \
                     tick.",
                    percent(target),
                    point.setting,
                    number(ms),
                    point.projections_per_tick
                );
                if !rivals.is_empty() {
                    let names: Vec<String> = rivals
                        .iter()
                        .take(3)
                        .map(|rival| rival.setting.to_string())
                        .collect();
                    words += &format!(
                        " Within timing noise, {} may be as cheap.",
                        names.join(", ")
                    );
                }
                words
            }
            None => format!(
                "{} solver error ({mesh}) is not reached; the best result is {}.",
                percent(target),
                case.best().map_or("none".to_owned(), |best| format!(
                    "{} with {}",
                    percent(best.error.unwrap_or(f64::NAN)),
                    best.setting
                ))
            ),
        })
        .collect()
}

/// How far the solver is from what the discrete method should give.
fn predictions(case: &CaseResult) -> Option<String> {
    let off = |point: &Point| Some((point.value()? - point.predicted?).abs());
    let all: Vec<(f64, &Point)> = case
        .points
        .iter()
        .filter(|point| point.setting.iterations == 1 && point.settled())
        .filter_map(|point| Some((off(point)?, point)))
        .collect();
    let scale = case.scale?;
    let worst = all.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(format!(
        "Deviation from the prediction for the discrete method: at most {} at {} to {} substeps, the \
         largest at {}.",
        percent(worst.0 / scale),
        all.first()?.1.setting.substeps,
        all.last()?.1.setting.substeps,
        worst.1.setting.substeps,
    ))
}

/// What was not run, and what did not come to rest.
fn gaps(result: &ProblemResult) -> Option<String> {
    let all = || result.cases.iter().flat_map(|case| &case.points);
    let skipped = all().filter(|point| point.run.is_none()).count();
    let restless = all()
        .filter(|point| point.run.is_some() && !point.settled())
        .count();
    let unknown = result.cases.iter().filter(|case| case.converged.is_none());
    let unknown: Vec<&str> = unknown.map(|case| &case.case.level_name[..]).collect();
    let mut words = Vec::new();
    if skipped > 0 {
        words.push(match skipped {
            1 => "1 setting was skipped as too costly".to_owned(),
            _ => format!("{skipped} settings were skipped as too costly"),
        });
    }
    if restless > 0 && result.problem.observe.wants_motion() {
        words.push(format!(
            "settings excluded because nothing moved, as f32 rounds the displacement per substep to zero: {restless}"
        ));
    } else if restless > 0 {
        words.push(format!(
            "settings excluded because they did not settle in time: {restless}"
        ));
    }
    if !unknown.is_empty() {
        words.push(format!(
            "there is no converged solution on {}, where the reference was too costly or diverged, so \
             there are only times",
            unknown.join(", ")
        ));
    }
    let mixed = result.cases.iter().any(|case| case.machines() > 1);
    if mixed {
        words.push(
            "times of one mesh are from several machines, so its Pareto front is unreliable"
                .to_owned(),
        );
    }
    (!words.is_empty()).then(|| capital(&words.join("; ")) + ".")
}

fn capital(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or(String::new(), |first| {
        first.to_uppercase().chain(letters).collect()
    })
}

/// What is under a diagram.
pub(super) fn caption(result: &ProblemResult) -> String {
    let hashes: Vec<String> = result.cases.iter().map(CaseResult::hash).collect();
    format!(
        "{}: solver error over cost. Filled points are settled; the line is the Pareto front, with \
         substeps × iterations; the dashed line is the mesh error. Hash of scene and settings: {}.",
        result.problem.title,
        hashes.join(", ")
    )
}

/// The front of each mesh as a table.
pub(super) fn tables(result: &ProblemResult) -> Vec<Block> {
    let head = [
        "mesh",
        "setting",
        "ms per second",
        "spread",
        "error",
        "primal",
        "dual",
    ];
    let mut rows = Vec::new();
    for case in &result.cases {
        for point in case.front() {
            let residuals = point.run.as_ref().and_then(|run| run.residuals);
            let ms = point.ms.unwrap_or_default();
            let dual = residuals.and_then(|residuals| residuals.dual);
            let error = percent(point.error.unwrap_or(f64::NAN));
            rows.push(vec![
                case.case.level_name.clone(),
                point.setting.to_string(),
                number(ms.median),
                format!("{}–{}", number(ms.low), number(ms.high)),
                if point.below_reference {
                    format!("{error}, below the uncertainty of the reference")
                } else {
                    error
                },
                residuals.map_or("—".to_owned(), |residuals| number(residuals.primal)),
                dual.map_or("—".to_owned(), number),
            ]);
        }
    }
    if rows.is_empty() {
        return Vec::new();
    }
    vec![
        Block::Text("Pareto front (no other setting is better in both cost and error):".to_owned()),
        Block::Table(head.map(str::to_owned).to_vec(), rows),
    ]
}

/// What the figures are from.
pub(super) fn end(study: &Study) -> Vec<Block> {
    vec![
        Block::Heading(2, "Method".to_owned()),
        Block::List(vec![
            format!(
                "Pliant {}, {} budget, study {}.",
                study.header.version, study.header.budget, study.header.hash
            ),
            format!("Machine: {}.", study.machines.join("; ")),
            "Settings of one mesh are timed in turn, round by round. “Within noise” means that \
             the times overlap."
                .to_owned(),
            "Rest is found by kinetic damping: velocities are set to zero whenever the kinetic energy \
             passes a peak. The result is a fixed point of the substep, including the excess \
             compliance of an unconverged solver."
                .to_owned(),
            "The converged solution of a motion is that of the f64 reference at h, h/2 and h/4, \
             extrapolated. That of a state of rest is the static equilibrium, the minimum of Σ ½C²/α \
             minus the work of the load, by Newton's method in f64. With contacts or other forces \
             without a potential, it is that of the f64 reference with multipliers kept from substep \
             to substep, where C + αλ/h² = 0 and forces balance."
                .to_owned(),
            "Primal residual: root mean square of C + αλ/h² over rest lengths and volumes. Dual \
             residual: difference of M(x − x̃) and Σ∇C λ, relative to the former."
                .to_owned(),
        ]),
    ]
}

/// Where it loses, and a line a problem: what 1 % costs.
pub(super) fn summary(study: &Study) -> Vec<String> {
    let mut lines = losses::sentences(study);
    lines.push(String::new());
    for problem in &study.problems {
        if let Some(case) = problem.finest_with_errors() {
            lines.push(format!(
                "{:<18} 1 %: {}",
                problem.problem.name,
                overview::cheapest(case, TARGETS[1])
            ));
        }
    }
    lines
}
