//! A map of all outcomes: one row per case and kind of body, one cell per member, ordered by the
//! parameter that is varied, as HTML for the beginning of a report.
//!
//! A cell tells its member and its worst figure under the pointer or when tapped, without a script.

use super::{
    Member, Outcome, SuiteRow,
    table::member_and_figure,
    tally::{Finding, count},
};
use crate::output::page::escaped;
use std::fmt::Write;

/// What distinguishes a member from the first of its kind in its case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Varied {
    Shape,
    Size,
    Compliance,
    Steps,
    Seed,
    Several,
}

impl Varied {
    const ALL: [Self; 6] = [
        Self::Shape,
        Self::Size,
        Self::Compliance,
        Self::Steps,
        Self::Seed,
        Self::Several,
    ];

    const fn name(self) -> &'static str {
        match self {
            Self::Shape => "shape",
            Self::Size => "size",
            Self::Compliance => "compliance",
            Self::Steps => "steps",
            Self::Seed => "seed",
            Self::Several => "several",
        }
    }

    fn of(member: &Member, first: &Member) -> Self {
        let differences = [
            (Self::Shape, member.shape != first.shape),
            (Self::Size, member.scale != first.scale),
            (
                Self::Compliance,
                (member.compliance, member.damping) != (first.compliance, first.damping),
            ),
            (
                Self::Steps,
                (member.substeps, member.iterations) != (first.substeps, first.iterations),
            ),
            (Self::Seed, member.seed != first.seed),
        ];
        let mut all = differences.iter().filter(|(_, differs)| *differs);
        match (all.next(), all.next()) {
            (None, _) => Self::Shape,
            (Some((what, _)), None) => *what,
            _ => Self::Several,
        }
    }
}

/// A cell of the map.
struct Cell<'a> {
    varied: Varied,
    row: &'a SuiteRow,
    outcome: &'a Outcome,
}

/// The members of one case and kind in the order of the map: by what is varied, and its value.
fn cells(rows: &[SuiteRow]) -> Vec<Cell<'_>> {
    let case = rows[0].case;
    let family = (case.family)(1);
    let first = |member: &Member| {
        let kind = member.shape.kind();
        let first = family.iter().find(|other| other.shape.kind() == kind);
        *first.unwrap_or(member)
    };
    let mut cells: Vec<Cell> = rows
        .iter()
        .flat_map(|row| {
            row.outcomes.iter().map(move |outcome| Cell {
                varied: Varied::of(&outcome.member, &first(&outcome.member)),
                row,
                outcome,
            })
        })
        .collect();
    cells.sort_by(|a, b| {
        let (x, y) = (&a.outcome.member, &b.outcome.member);
        let value = match a.varied {
            Varied::Size => x.scale.total_cmp(&y.scale),
            Varied::Compliance => x.compliance.total_cmp(&y.compliance),
            Varied::Steps => (x.substeps, x.iterations).cmp(&(y.substeps, y.iterations)),
            _ => std::cmp::Ordering::Equal,
        };
        a.varied
            .cmp(&b.varied)
            .then(value)
            .then(a.outcome.number.cmp(&b.outcome.number))
    });
    cells
}

/// Class of a cell, and the sign in it.
const fn look(finding: Finding) -> (&'static str, &'static str) {
    match finding {
        Finding::Passed => ("p", ""),
        Finding::ExpectedFailure => ("x", "–"),
        Finding::UnexpectedFailure => ("u", "✕"),
        Finding::UnexpectedPass => ("s", "!"),
    }
}

/// The target of links to a case.
pub(super) fn anchor(case: &str) -> String {
    format!("case-{case}")
}

/// The legend, with the number of members of each color.
pub(super) fn legend(rows: &[SuiteRow]) -> String {
    let entries = Finding::ALL.into_iter().filter_map(|finding| {
        let members = count(rows, finding);
        let always = finding != Finding::UnexpectedPass;
        let (class, sign) = look(finding);
        (always || members > 0).then(|| {
            format!(
                "<span><i class=\"{class}\" aria-hidden=\"true\">{sign}</i>{}</span>",
                finding.counted(members)
            )
        })
    });
    format!(
        "<div class=\"legend\">{}</div>",
        entries.collect::<String>()
    )
}

/// The map.
pub(super) fn html(rows: &[SuiteRow]) -> String {
    let kinds = rows.chunk_by(|a, b| a.case.name == b.case.name && a.kind == b.kind);
    let lines: Vec<(&SuiteRow, Vec<Cell>)> = kinds.map(|rows| (&rows[0], cells(rows))).collect();
    let columns: Vec<(Varied, usize)> = Varied::ALL
        .into_iter()
        .filter_map(|varied| Some((varied, usual_count(&lines, varied)?)))
        .collect();
    let widths = columns
        .iter()
        .map(|(_, cells)| format!(" minmax(5.4rem,{cells}fr)"));
    let mut html = format!(
        "<style>.map .row{{grid-template-columns:7.5rem 5.5rem 2rem{}}}</style>\n<div class=\"map\">\n\
         <div class=\"row heads\"><span>case</span><span>body</span><span></span>{}</div>\n",
        widths.collect::<String>(),
        columns
            .iter()
            .map(|(varied, _)| format!("<span>{}</span>", varied.name()))
            .collect::<String>()
    );
    let mut last = "";
    for (row, cells) in &lines {
        let is_first = row.case.name != last;
        last = row.case.name;
        html += &line(row, is_first, cells, &columns);
    }
    html + "</div>"
}

/// Upper quartile of the number of cells in a column, of the lines that have any; `None` if there
/// is none.
fn usual_count(lines: &[(&SuiteRow, Vec<Cell>)], varied: Varied) -> Option<usize> {
    let mut counts: Vec<usize> = lines
        .iter()
        .map(|(_, cells)| cells.iter().filter(|cell| cell.varied == varied).count())
        .filter(|&count| count > 0)
        .collect();
    counts.sort_unstable();
    counts.get(counts.len() * 3 / 4).copied()
}

/// The line of a case and a kind of body.
fn line(row: &SuiteRow, is_first: bool, cells: &[Cell], columns: &[(Varied, usize)]) -> String {
    let case = row.case;
    let name = if is_first {
        format!(
            "<a href=\"#{}\" title=\"{}\">{}</a>",
            anchor(case.name),
            escaped(case.title),
            case.name
        )
    } else {
        String::new()
    };
    let mut html = format!(
        "<div class=\"row{}\"><b>{name}</b><span>{}</span><span class=\"count\">{}</span>",
        if is_first { " first" } else { "" },
        row.kind.name(),
        cells.len()
    );
    for (varied, _) in columns {
        let group = cells.iter().filter(|cell| cell.varied == *varied);
        html += "<span class=\"cells\">";
        for cell in group {
            let finding = Finding::of(cell.row, cell.outcome);
            let (class, sign) = look(finding);
            // Writing to a string cannot fail.
            let _ = write!(
                html,
                "<i class=\"{class}\" tabindex=\"-1\" data-about=\"{}\">{sign}</i>",
                escaped(&about(cell, finding))
            );
        }
        html += "</span>";
    }
    html + "</div>\n"
}

/// Which member it is, how it ended, and why.
fn about(cell: &Cell, finding: Finding) -> String {
    let figure = member_and_figure(cell.outcome).unwrap_or_else(|| cell.outcome.member.to_string());
    let mut text = format!(
        "{} {}: {}\n{figure}",
        cell.row.case.name,
        cell.outcome.number,
        finding.name()
    );
    if let Some(expected) = cell.row.expected {
        let _ = write!(text, "\nKnown: {}.", expected.reason);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::torture::Shape;

    #[test]
    fn a_member_stands_under_the_one_parameter_that_it_varies() {
        let first = Member {
            compliance: 1e-5,
            ..Member::of(Shape::Cube(3))
        };
        let scale = 10.0;
        assert_eq!(Varied::of(&first, &first), Varied::Shape);
        assert_eq!(Varied::of(&Member { scale, ..first }, &first), Varied::Size);
        let softer = Member {
            compliance: 1e-3,
            damping: 0.1,
            ..first
        };
        assert_eq!(Varied::of(&softer, &first), Varied::Compliance);
        let both = Member { scale, ..softer };
        assert_eq!(Varied::of(&both, &first), Varied::Several);
    }
}
