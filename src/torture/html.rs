//! The report of a run as a page: the verdict, a map of all members, a table of the worst ones, and
//! a folded part for each case, which is open where a member fails unexpectedly.

use super::{
    Figure, SuiteRow, map, table,
    tally::{Finding, by_case, count},
};
use crate::output::{
    document::Block,
    page::{Page, Part, Status, Verdict},
};

/// Maximum number of failures that the verdict names.
const MAX_NAMED: usize = 3;

/// The page. `figures` has the pictures of each row's worst member.
pub(super) fn page(rows: &[SuiteRow], figures: &[Vec<Block>]) -> Page {
    let mut parts = vec![
        Part::Html(map::legend(rows)),
        Part::text(
            "A cell is a member of the case in its row. Columns say in which parameter it differs from \
             the first member of its row, in ascending order. Point at a cell or tap it for its name \
             and its worst figure.",
        ),
        Part::Html(map::html(rows)),
        Part::heading("Worst members"),
        worst_members(rows).into(),
        Part::text(table::slowest(rows).unwrap_or_default()),
        Part::heading("Cases"),
    ];
    let mut figures = figures.iter();
    for rows in by_case(rows) {
        let figures: Vec<&[Block]> = figures
            .by_ref()
            .take(rows.len())
            .map(|all| &all[..])
            .collect();
        parts.push(details(rows, &figures));
    }
    Page {
        title: "Robustness".to_owned(),
        verdict: verdict(rows),
        parts,
    }
}

/// What the exit code says, in words.
fn verdict(rows: &[SuiteRow]) -> Verdict {
    let [_, expected, unexpected, surprises] =
        Finding::ALL.map(|finding| (finding, count(rows, finding)));
    let members: usize = rows.iter().map(|row| row.outcomes.len()).sum();
    let cases = by_case(rows).count();
    let mut about = vec![format!(
        "{members} member{} of {cases} case{}, {}.",
        if members == 1 { "" } else { "s" },
        if cases == 1 { "" } else { "s" },
        expected.0.counted(expected.1)
    )];
    let (status, words) = match (unexpected.1, surprises.1) {
        (0, 0) => (Status::Passed, "Passed: no unexpected failures".to_owned()),
        (0, count) => (
            Status::Attention,
            format!("Passed, with {}", surprises.0.counted(count)),
        ),
        (count, _) => {
            about.extend(named(rows, count));
            (Status::Failed, unexpected.0.counted(count))
        }
    };
    Verdict {
        status,
        words,
        about,
    }
}

/// The first unexpected failures, one per line.
fn named(rows: &[SuiteRow], count: usize) -> Vec<String> {
    let unexpected = rows.iter().filter(|row| row.expected.is_none());
    let failures = unexpected.flat_map(|row| {
        let failed = row.outcomes.iter().filter(|outcome| !outcome.passed());
        failed.filter_map(|outcome| {
            let figure = table::member_and_figure(outcome)?;
            Some(format!("{} {} {figure}.", row.case.name, outcome.number))
        })
    });
    let mut lines: Vec<String> = failures.take(MAX_NAMED).collect();
    if count > lines.len() {
        lines.push(format!("And {} more.", count - lines.len()));
    }
    lines
}

/// The table of the rows' worst members.
fn worst_members(rows: &[SuiteRow]) -> Block {
    let head = [
        "case",
        "body",
        "members",
        "worst member",
        "measure",
        "value",
        "limit",
        "unit",
        "result",
    ];
    let cells = rows.iter().map(|row| {
        let [case, body, members, .., verdict] = table::cells(row);
        let worst = row.worst().map_or(String::new(), |outcome| {
            format!("{}\nmember {}", outcome.member, outcome.number)
        });
        let figure = row.worst().and_then(|outcome| outcome.worst());
        let cell = |of: &dyn Fn(&Figure) -> String| figure.map_or(String::new(), of);
        vec![
            case,
            body,
            members,
            worst,
            cell(&|figure| figure.name.to_owned()),
            cell(&|figure| table::number(figure.value)),
            cell(&|figure| table::number(figure.limit)),
            cell(&|figure| figure.unit.to_owned()),
            format!("{} {verdict}", sign(row)),
        ]
    });
    Block::table("", &head, cells.collect())
}

/// A sign for the result of a row.
fn sign(row: &SuiteRow) -> &'static str {
    match (row.failed(), row.expected) {
        (0, None) => "✓",
        (0, Some(_)) => "!",
        (_, None) => "✕",
        (_, Some(_)) => "–",
    }
}

/// The part of a case.
fn details(rows: &[SuiteRow], figures: &[&[Block]]) -> Part {
    let case = rows[0].case;
    let found = Finding::ALL
        .into_iter()
        .filter_map(|finding| match count(rows, finding) {
            0 => None,
            members => Some(finding.counted(members)),
        });
    let found: Vec<String> = found.collect();
    let mut parts = vec![Part::text(case.about)];
    for (row, figures) in rows.iter().zip(figures) {
        parts.push(Block::Heading(3, table::heading(row)).into());
        if let Some(expected) = row.expected {
            parts.push(Part::text(format!("Known: {}.", expected.reason)));
        }
        if row.failed() > 0 {
            parts.push(failures(row).into());
        }
        parts.extend(figures.iter().cloned().map(Part::from));
    }
    Part::Details {
        id: map::anchor(case.name),
        summary: format!("{} ({}): {}", case.name, case.title, found.join(", ")),
        open: count(rows, Finding::UnexpectedFailure) > 0,
        parts,
    }
}

/// The members of a row that fail, with their worst figure and the command that runs them again.
fn failures(row: &SuiteRow) -> Block {
    let failed = row.outcomes.iter().filter(|outcome| !outcome.passed());
    let rows = failed.filter_map(|outcome| {
        let figure = outcome.worst()?;
        Some(vec![
            outcome.member.to_string(),
            figure.name.to_owned(),
            table::number(figure.value),
            table::number(figure.limit),
            figure.unit.to_owned(),
            format!("`{}`", table::command(row, outcome)),
        ])
    });
    let head = [
        "failing member",
        "measure",
        "value",
        "limit",
        "unit",
        "run again",
    ];
    Block::table("", &head, rows.collect())
}
