//! The report of a study as a page: how many problems reach 1 %, a diagram for each, a table of the
//! cheapest settings, and the rest folded.

use super::{
    Study, multiples, numbers::TARGETS, overview, page, results::ProblemResult, rivalry, weaknesses,
};
use crate::output::{
    document::Block,
    page::{Page, Part, Status, Verdict},
};

/// The page. `pictures` has the diagram of each problem, if it can be drawn, in order.
pub(super) fn page(study: &Study, pictures: &[Option<Block>]) -> Page {
    let mut parts = vec![
        Part::Html(multiples::legend(study)),
        Part::Html(multiples::html(study)),
        Part::text(
            "Error against the converged solution on the same mesh over the time of one thread per \
             simulated second; below 0.001 % and above 1000 % at the edge. Each diagram is of the \
             finest mesh with errors. Settings are *substeps × iterations* per tick.",
        ),
        Part::heading("Cheapest settings"),
        overview::wide_table(study).into(),
        Part::text(page::TWO_ERRORS),
    ];
    parts.push(Part::heading("Weaknesses found"));
    parts.extend(weaknesses(study));
    parts.push(Part::heading("Problems"));
    for (problem, picture) in study.problems.iter().zip(pictures) {
        parts.push(details(problem, picture.clone()));
    }
    parts.push(Part::heading("Comparison and method"));
    parts.push(folded(
        "rivalry",
        "Substeps or iterations",
        rivalry::tables(study),
    ));
    let mut method = page::machines(study);
    method.push(page::method(study));
    parts.push(folded("method", "Method and machine", method));
    Page {
        title: "Accuracy vs. cost".to_owned(),
        verdict: verdict(study),
        parts,
    }
}

/// How many problems reach an error of 1 %, which do not, and which have no errors.
fn verdict(study: &Study) -> Verdict {
    let titles = |which: &dyn Fn(&ProblemResult) -> bool| -> Vec<&str> {
        let problems = study.problems.iter().filter(|problem| which(problem));
        problems.map(|problem| &problem.problem.title[..]).collect()
    };
    let known = |problem: &ProblemResult| problem.finest_with_errors().is_some();
    let reaches = |problem: &ProblemResult| {
        let case = problem.finest_with_errors();
        case.is_some_and(|case| case.cheapest_sound(TARGETS[1]).is_some())
    };
    let missed = titles(&|problem| known(problem) && !reaches(problem));
    let unknown = titles(&|problem| !known(problem));
    let all = study.problems.len();
    let reached = all - missed.len() - unknown.len();
    let mut about = Vec::new();
    for (what, titles) in [
        ("Not reached", &missed),
        ("No errors, as there is no converged solution", &unknown),
    ] {
        if !titles.is_empty() {
            about.push(format!("{what}: {}.", titles.join("; ")));
        }
    }
    about.push(format!(
        "Cheapest settings of the {} budget, on one thread.",
        study.header.budget
    ));
    Verdict {
        status: if reached == all {
            Status::Passed
        } else {
            Status::Attention
        },
        words: format!(
            "{reached} of {all} problem{} solved to 1\u{a0}%",
            if all == 1 { "" } else { "s" }
        ),
        about,
    }
}

/// Each kind of weakness, folded, with the number of its rows.
fn weaknesses(study: &Study) -> Vec<Part> {
    let blocks = weaknesses::tables(study).into_iter().enumerate();
    blocks
        .map(|(place, block)| match block {
            Block::Table {
                caption,
                head,
                rows,
            } => Part::Details {
                id: format!("weakness-{}", place + 1),
                summary: format!("{caption} ({})", rows.len()),
                open: false,
                parts: vec![
                    Block::Table {
                        caption: String::new(),
                        head,
                        rows,
                    }
                    .into(),
                ],
            },
            other => other.into(),
        })
        .collect()
}

fn details(problem: &ProblemResult, picture: Option<Block>) -> Part {
    let summary = match problem.finest_with_errors() {
        Some(case) => format!(
            "{} · 1\u{a0}%: {}",
            problem.problem.title,
            overview::cheapest(case, TARGETS[1])
        ),
        None => format!(
            "{} · no errors: no converged solution",
            problem.problem.title
        ),
    };
    // The title is the summary.
    let mut blocks = page::problem(problem).split_off(1);
    blocks.extend(picture);
    blocks.extend(page::front(problem));
    folded(&multiples::anchor(problem), &summary, blocks)
}

fn folded(id: &str, summary: &str, blocks: Vec<Block>) -> Part {
    Part::Details {
        id: id.to_owned(),
        summary: summary.to_owned(),
        open: false,
        parts: blocks.into_iter().map(Part::from).collect(),
    }
}
