//! The table of outcomes: one row per case, kind of body and reason for failure.

use super::{
    Figure, Outcome, SuiteRow,
    tally::{self, Finding},
};
use serde_json::{Value, json};

/// The column headings.
pub const HEAD: [&str; 8] = [
    "case",
    "body",
    "members",
    "worst member",
    "figure",
    "limit",
    "unit",
    "verdict",
];

/// The cells of a row as text.
#[must_use]
pub fn cells(row: &SuiteRow) -> [String; 8] {
    let worst = row.worst();
    let figure = worst.and_then(|outcome| outcome.worst());
    let name = worst.map_or(String::new(), |outcome| {
        format!("{} {}", outcome.number, outcome.member)
    });
    let cell = |of: &dyn Fn(&Figure) -> String| figure.map_or(String::new(), of);
    [
        row.case.name.to_owned(),
        row.kind.name().to_owned(),
        row.outcomes.len().to_string(),
        name,
        cell(&|figure| number(figure.value)),
        cell(&|figure| number(figure.limit)),
        cell(&|figure| format!("{}, {}", figure.unit, figure.name)),
        verdict(row),
    ]
}

/// `passes`, or the number of failures and whether they were expected.
#[must_use]
pub fn verdict(row: &SuiteRow) -> String {
    match (row.failed(), row.expected) {
        (0, None) => "passes".to_owned(),
        (0, Some(_)) => "unexpected pass".to_owned(),
        (failed, None) => format!("{failed} fail"),
        (failed, Some(_)) => format!("{failed} fail, as expected"),
    }
}

/// Three significant digits; exponential notation for very large and very small values.
#[must_use]
pub fn number(x: f64) -> String {
    let size = x.abs();
    if !x.is_finite() || x == 0.0 {
        format!("{x}")
    } else if (1e-3..1e5).contains(&size) {
        let digits = (2 - size.log10().floor() as i32).clamp(0, 5) as usize;
        let text = format!("{x:.digits$}");
        match text.contains('.') {
            true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
            false => text,
        }
    } else {
        format!("{x:.2e}")
    }
}

/// The rows aligned for a terminal.
#[must_use]
pub fn text(rows: &[SuiteRow]) -> String {
    let head = HEAD.map(str::to_owned);
    let all: Vec<[String; 8]> = std::iter::once(head)
        .chain(rows.iter().map(cells))
        .collect();
    let width = |column: usize| all.iter().map(|cells| cells[column].chars().count()).max();
    let widths: Vec<usize> = (0..HEAD.len())
        .map(|column| width(column).unwrap_or(0))
        .collect();
    let line = |cells: &[String; 8]| {
        let cells = cells.iter().zip(&widths);
        let cells: Vec<String> = cells
            .map(|(cell, &width)| format!("{cell:width$}"))
            .collect();
        format!("{}\n", cells.join("  ").trim_end())
    };
    all.iter().map(line).collect()
}

/// The rows as a JSON array of objects. An infinite limit is null.
#[must_use]
pub fn json(rows: &[SuiteRow]) -> Value {
    let object = |row: &SuiteRow| {
        let worst = row.worst();
        let figure = worst.and_then(|outcome| outcome.worst());
        json!({
            "case": row.case.name,
            "body": row.kind.name(),
            "members": row.outcomes.len(),
            "failed": row.failed(),
            "worst": worst.map(|outcome| outcome.member.to_string()),
            "number": worst.map(|outcome| outcome.number),
            "measure": figure.map(|figure| figure.name),
            "figure": figure.map(|figure| figure.value),
            "limit": figure.map(|figure| figure.limit),
            "unit": figure.map(|figure| figure.unit),
            "passed": row.passed(),
            "expected_failure": row.expected.map(|it| it.reason),
        })
    };
    rows.iter().map(object).collect()
}

/// Summary: number of members, cases and failures.
#[must_use]
pub fn summary(rows: &[SuiteRow]) -> String {
    let [_, known, failed, passes] = Finding::ALL.map(|finding| tally::count(rows, finding));
    let unexpected = match passes {
        0 => String::new(),
        passes => format!(", {passes} unexpected passes"),
    };
    format!(
        "{} members of {} cases: {failed} unexpected failures{unexpected}, {known} expected failures.",
        rows.iter().map(|row| row.outcomes.len()).sum::<usize>(),
        tally::by_case(rows).count(),
    )
}

/// The members that are expected to fail, one per line, with outcome and reason.
#[must_use]
pub fn expected_failures(rows: &[SuiteRow]) -> Vec<String> {
    let rows = rows.iter().filter_map(|row| Some((row, row.expected?)));
    let lines = rows.flat_map(|(row, expected)| {
        row.outcomes.iter().filter_map(move |outcome| {
            let pass = if outcome.passed() {
                " (unexpected pass)"
            } else {
                ""
            };
            Some(format!(
                "{} {} {}{pass}: {}",
                row.case.name,
                outcome.number,
                member_and_figure(outcome)?,
                expected.reason,
            ))
        })
    });
    lines.collect()
}

/// A member with its worst figure.
pub(super) fn member_and_figure(outcome: &Outcome) -> Option<String> {
    let figure = outcome.worst()?;
    Some(format!(
        "{}: {} {} {}, at most {}",
        outcome.member,
        figure.name,
        number(figure.value),
        figure.unit,
        number(figure.limit),
    ))
}

/// The command that runs a member again.
pub(super) fn command(row: &SuiteRow, outcome: &Outcome) -> String {
    format!(
        "pliant torture {} --member {}",
        row.case.name, outcome.number
    )
}

/// The kind of body of a row, the number of its members, and the verdict.
pub(super) fn heading(row: &SuiteRow) -> String {
    let count = row.outcomes.len();
    format!("{}: {count} members, {}", row.kind.name(), verdict(row))
}

/// The members of a row that fail, one per line, each with the command that runs it again.
#[must_use]
pub fn failures(row: &SuiteRow) -> Vec<String> {
    let failed = row.outcomes.iter().filter(|outcome| !outcome.passed());
    let lines = failed.filter_map(|outcome| {
        Some(format!(
            "{}   # {}",
            command(row, outcome),
            member_and_figure(outcome)?,
        ))
    });
    lines.collect()
}

/// The member with the slowest frames. It depends on the machine, so no limit applies.
#[must_use]
pub fn slowest(rows: &[SuiteRow]) -> Option<String> {
    let all = rows
        .iter()
        .flat_map(|row| row.outcomes.iter().map(move |outcome| (row, outcome)));
    let (row, slowest) = all.max_by(|a, b| a.1.slowest.total_cmp(&b.1.slowest))?;
    Some(format!(
        "Slowest frames: {}× the median of their run ({}, member {}), as the fastest of eight in a row.",
        number(slowest.slowest),
        row.case.name,
        slowest.number,
    ))
}
