//! Counts of outcomes by what was expected of them.

use super::{Outcome, SuiteRow};

/// An outcome beside what was expected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Finding {
    /// It passes, as it should.
    Passed,
    /// It fails, as it is known to.
    ExpectedFailure,
    /// It fails and should pass.
    UnexpectedFailure,
    /// It passes and is known to fail.
    UnexpectedPass,
}

impl Finding {
    /// All of them.
    pub const ALL: [Self; 4] = [
        Self::Passed,
        Self::ExpectedFailure,
        Self::UnexpectedFailure,
        Self::UnexpectedPass,
    ];

    /// Of a member of a row.
    #[must_use]
    pub fn of(row: &SuiteRow, outcome: &Outcome) -> Self {
        match (outcome.passed(), row.expected) {
            (true, None) => Self::Passed,
            (false, Some(_)) => Self::ExpectedFailure,
            (false, None) => Self::UnexpectedFailure,
            (true, Some(_)) => Self::UnexpectedPass,
        }
    }

    /// Its name in a report.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::ExpectedFailure => "expected failure",
            Self::UnexpectedFailure => "unexpected failure",
            Self::UnexpectedPass => "unexpected pass",
        }
    }

    /// Its name after a count: `1 unexpected failure`.
    #[must_use]
    pub fn counted(self, count: usize) -> String {
        let ending = match (self, count) {
            (Self::Passed, _) | (_, 1) => "",
            (Self::UnexpectedPass, _) => "es",
            _ => "s",
        };
        format!("{count} {}{ending}", self.name())
    }
}

/// Number of members of these rows with a finding.
#[must_use]
pub fn count<'a>(rows: impl IntoIterator<Item = &'a SuiteRow>, finding: Finding) -> usize {
    let outcomes = rows
        .into_iter()
        .flat_map(|row| row.outcomes.iter().map(move |outcome| (row, outcome)));
    outcomes
        .filter(|(row, outcome)| Finding::of(row, outcome) == finding)
        .count()
}

/// The rows of each case.
pub fn by_case(rows: &[SuiteRow]) -> impl Iterator<Item = &[SuiteRow]> {
    rows.chunk_by(|a, b| a.case.name == b.case.name)
}
