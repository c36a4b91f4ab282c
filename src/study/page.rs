//! The pages of a report: tables with captions, every figure from the data.

use super::{
    Study,
    closed_form::Reference,
    converge::{Converged, FIRST_ORDER, FoundBy},
    floor, growth,
    numbers::{TARGETS, number, percent},
    overview,
    results::{CaseResult, Point, ProblemResult},
    rivalry, weaknesses,
};
use crate::output::document::Block;

/// Costs, settings and the two errors of a report.
pub(super) const TWO_ERRORS: &str = "Costs are median milliseconds of one thread per simulated second; a setting is \
     *substeps × iterations* per tick. **Solver error** is the distance to the converged \
     solution on the same mesh: its static equilibrium, or the f64 reference with small \
     steps. **Mesh error** is the distance of that solution to the continuum. The two are \
     not added.";

/// The machines of a study whose times cannot be compared.
pub(super) fn machines(study: &Study) -> Vec<Block> {
    if study.machines.len() < 2 {
        return Vec::new();
    }
    let machines = study.machines.iter().map(|machine| vec![machine.clone()]);
    vec![Block::table(
        "Times are from several machines and cannot be compared across problems",
        &["machine"],
        machines.collect(),
    )]
}

/// The title, the weaknesses, and the tables over all problems.
pub(super) fn beginning(study: &Study) -> Vec<Block> {
    let mut blocks = vec![
        Block::Heading(1, "Accuracy vs. cost".to_owned()),
        Block::Heading(2, "Weaknesses found".to_owned()),
    ];
    blocks.extend(weaknesses::tables(study));
    blocks.push(Block::Heading(2, "What 1 % costs".to_owned()));
    blocks.push(overview::table(study));
    blocks.push(Block::Text(TWO_ERRORS.to_owned()));
    blocks.extend(machines(study));
    blocks.push(Block::Heading(2, "Substeps or iterations".to_owned()));
    blocks.extend(rivalry::tables(study));
    blocks
}

/// The results of a problem.
pub(super) fn problem(result: &ProblemResult) -> Vec<Block> {
    let problem = &result.problem;
    let mut blocks = vec![
        Block::Heading(2, problem.title.clone()),
        Block::Text(problem.about.clone()),
    ];
    let mut facts = reference(result);
    let finest = result.finest_with_errors();
    if let Some(case) = finest {
        facts.extend(predictions(case));
        facts.extend(floor::facts(case));
    }
    facts.extend(growth::fact(result));
    facts.extend(gaps(result));
    let rows = facts.into_iter().map(Vec::from).collect();
    blocks.push(Block::table("", &["quantity", "value"], rows));
    let rows: Vec<_> = result.cases.iter().filter_map(converged).collect();
    if !rows.is_empty() {
        let head = [
            "mesh", "found by", "order", "expected", "settled", "residual",
        ];
        blocks.push(Block::table("Converged solutions", &head, rows));
    }
    if let Some(case) = finest {
        let head = [
            "error up to",
            "setting",
            "ms per simulated second",
            "projections per tick",
            "within timing noise of",
            "coincidental",
        ];
        let rows = TARGETS.map(|target| cheapest(case, target)).to_vec();
        let caption = format!("Cheapest settings: {}", case.case.level_name);
        blocks.push(Block::table(caption, &head, rows));
    }
    blocks
}

/// The references of the errors.
fn reference(result: &ProblemResult) -> Vec<[String; 2]> {
    let unit = match result.problem.observe.unit() {
        "1" => String::new(),
        unit => format!(" {unit}"),
    };
    let against = result.problem.reference;
    let value = result
        .reference
        .map(|value| format!("{}{unit}", number(value)));
    let mut facts = vec![["Reference".to_owned(), against.words().to_owned()]];
    match (against, value) {
        (Reference::Converged, _) => {}
        (_, Some(value)) => facts.push(["Value of the reference".to_owned(), value]),
        (_, None) => facts.push([
            "Value of the reference".to_owned(),
            "unknown: a single mesh has no limit".to_owned(),
        ]),
    }
    if matches!(against, Reference::FinestMesh) && result.cases.len() > 1 {
        facts.push([
            "Order of mesh convergence".to_owned(),
            result.mesh_order.map_or(
                "not shown; mesh errors are relative to the finest mesh".to_owned(),
                |order| format!("{order:.1}"),
            ),
        ]);
    }
    facts
}

/// The converged solution of a mesh as a row.
fn converged(case: &CaseResult) -> Option<Vec<String>> {
    let converged: &Converged = case.converged.as_ref()?;
    let expected = f64::from(case.case.world.settings.order.get());
    let (found_by, residual) = match converged.found_by {
        FoundBy::Equilibrium { residual } => (
            "static equilibrium by Newton's method".to_owned(),
            format!("{} of the load", number(residual)),
        ),
        _ => (
            format!("f64 reference, up to {} substeps", converged.substeps),
            "—".to_owned(),
        ),
    };
    let order = converged.order.map_or("—".to_owned(), |order| {
        let is_expected = FIRST_ORDER.contains(&(order - expected + 1.0));
        format!(
            "{order:.2}{}",
            if is_expected { "" } else { " (unexpected)" }
        )
    });
    Some(vec![
        case.case.level_name.clone(),
        found_by,
        order,
        converged
            .order
            .map_or("—".to_owned(), |_| expected.to_string()),
        if converged.settled { "yes" } else { "no" }.to_owned(),
        residual,
    ])
}

/// The cheapest setting for an error as a row.
fn cheapest(case: &CaseResult, target: f64) -> Vec<String> {
    let none = || "—".to_owned();
    let Some((point, rivals)) = case.cheapest(target) else {
        let best = case.best().map_or_else(none, |best| {
            let error = percent(best.error.unwrap_or(f64::NAN));
            format!("not reached (best {error}, {})", best.setting)
        });
        return vec![percent(target), best, none(), none(), none(), none()];
    };
    let names: Vec<String> = rivals
        .iter()
        .take(3)
        .map(|rival| rival.setting.to_string())
        .collect();
    vec![
        percent(target),
        point.setting.to_string(),
        number(point.ms.map_or(f64::NAN, |ms| ms.median)),
        point.projections_per_tick.to_string(),
        if names.is_empty() {
            none()
        } else {
            names.join(", ")
        },
        case.coincidence(point).map_or_else(none, |worse| {
            let error = percent(worse.error.unwrap_or(f64::NAN));
            format!("{} has {error}", worse.setting)
        }),
    ]
}

/// Distance of the solver from the discrete prediction.
fn predictions(case: &CaseResult) -> Option<[String; 2]> {
    let off = |point: &Point| Some((point.value()? - point.predicted?).abs());
    let all: Vec<(f64, &Point)> = case
        .points
        .iter()
        .filter(|point| point.setting.iterations == 1 && point.settled())
        .filter_map(|point| Some((off(point)?, point)))
        .collect();
    let worst = all.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some([
        format!(
            "Deviation from the prediction for the discrete method, {} to {} substeps",
            all.first()?.1.setting.substeps,
            all.last()?.1.setting.substeps,
        ),
        format!(
            "at most {}, at {} substeps",
            percent(worst.0 / case.scale?),
            worst.1.setting.substeps
        ),
    ])
}

/// Settings that were not run or do not count, and meshes without a converged solution.
fn gaps(result: &ProblemResult) -> Vec<[String; 2]> {
    let all = || result.cases.iter().flat_map(|case| &case.points);
    let mut facts = Vec::new();
    let skipped = all().filter(|point| point.run.is_none()).count();
    if skipped > 0 {
        facts.push([
            "Settings skipped as too costly".to_owned(),
            skipped.to_string(),
        ]);
    }
    let excluded = all().filter(|point| point.run.is_some() && !point.settled());
    let excluded = excluded.count();
    if excluded > 0 {
        let why = if result.problem.observe.wants_motion() {
            "Settings excluded because nothing moved (f32 rounds the displacement to zero)"
        } else {
            "Settings excluded because they did not settle in time"
        };
        facts.push([why.to_owned(), excluded.to_string()]);
    }
    let unknown = result.cases.iter().filter(|case| case.converged.is_none());
    let unknown: Vec<&str> = unknown.map(|case| &case.case.level_name[..]).collect();
    if !unknown.is_empty() {
        facts.push([
            "Meshes without a converged solution (reference too costly or diverged)".to_owned(),
            unknown.join(", "),
        ]);
    }
    let mixed = result.cases.iter().filter(|case| case.machines() > 1);
    let mixed: Vec<&str> = mixed.map(|case| &case.case.level_name[..]).collect();
    if !mixed.is_empty() {
        facts.push([
            "Meshes timed on several machines (unreliable Pareto front)".to_owned(),
            mixed.join(", "),
        ]);
    }
    facts
}

/// The caption of a diagram.
pub(super) fn caption(result: &ProblemResult) -> String {
    let hashes: Vec<String> = result.cases.iter().map(CaseResult::hash).collect();
    format!(
        "{}: solver error over cost. Filled points are settled; the line is the Pareto front, with \
         substeps × iterations; the dashed line is the mesh error. Hash of scene and settings: {}.",
        result.problem.title,
        hashes.join(", ")
    )
}

/// The Pareto front of each mesh as a table.
pub(super) fn front(result: &ProblemResult) -> Option<Block> {
    let head = [
        "mesh",
        "setting",
        "ms per second",
        "spread",
        "error",
        "primal",
        "dual",
    ];
    let none = || "—".to_owned();
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
                residuals.map_or_else(none, |residuals| number(residuals.primal)),
                dual.map_or_else(none, number),
            ]);
        }
    }
    let caption = "Pareto front: no other setting is better in both cost and error";
    (!rows.is_empty()).then(|| Block::table(caption, &head, rows))
}

/// How the figures were obtained.
pub(super) fn method(study: &Study) -> Block {
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
            "The converged solution of a motion is extrapolated from the f64 reference at h, h/2 and h/4. \
             A state of rest is the static equilibrium, the minimum of Σ ½C²/α minus the work of the \
             load, by Newton's method in f64. With contacts or other forces without a potential, it \
             comes from the f64 reference with multipliers kept from substep to substep, where \
             C + αλ/h² = 0 and forces balance."
                .to_owned(),
            "Primal residual: root mean square of C + αλ/h² over rest lengths and volumes. Dual \
             residual: difference of M(x − x̃) and Σ∇C λ, relative to the former."
                .to_owned(),
    ])
}

/// Weaknesses, and a line for each problem: the cheapest setting for 1 %.
pub(super) fn summary(study: &Study) -> Vec<String> {
    let mut lines = weaknesses::lines(study);
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
