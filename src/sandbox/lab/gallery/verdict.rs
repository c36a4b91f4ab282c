//! The result of a case.

use crate::torture::{
    Figure, Outcome, SuiteRow,
    filmstrip::{Frame, frames},
};

/// The result of a case, on the body on screen or on the worst member of its family.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// The body whose figures these are.
    pub member: String,
    /// Number of members that were run.
    pub members: usize,
    /// Number of unexpected failures.
    pub failed: usize,
    /// Number of expected failures.
    pub expected_failed: usize,
    /// Reason why the member is expected to fail, if it is.
    pub expected: Option<&'static str>,
    /// Settings with which it passes, as text, once they have been searched for.
    pub advice: Option<String>,
    /// All figures, the worst first.
    pub figures: Vec<Figure>,
    /// Pictures of the start, the worst moment and the end.
    pub film: Vec<Frame>,
}

impl Verdict {
    /// The verdict for the body on screen.
    #[must_use]
    pub fn of_this(outcome: &Outcome) -> Self {
        Self {
            failed: usize::from(!outcome.passed()),
            ..Self::of(outcome, 1, None)
        }
    }

    /// The verdict for a family: of the worst member that is expected to pass, or else the worst of
    /// the others. `film` is the outcome of that member, run again with pictures.
    #[must_use]
    pub fn of_family(rows: &[SuiteRow], film: &Outcome, expected: Option<&'static str>) -> Self {
        let count = |of: &dyn Fn(&SuiteRow) -> usize| rows.iter().map(of).sum();
        let failed = |expected: bool| {
            count(&|row| match row.expected.is_some() == expected {
                true => row.failed(),
                false => 0,
            })
        };
        Self {
            failed: failed(false),
            expected_failed: failed(true),
            ..Self::of(film, count(&|row| row.outcomes.len()), expected)
        }
    }

    fn of(outcome: &Outcome, members: usize, expected: Option<&'static str>) -> Self {
        let mut figures = outcome.figures.clone();
        figures.sort_by(|a, b| b.load().total_cmp(&a.load()));
        Self {
            member: outcome.member.to_string(),
            members,
            failed: 0,
            expected_failed: 0,
            expected,
            advice: None,
            figures,
            film: frames(outcome).unwrap_or_default(),
        }
    }

    /// Whether all figures are within their limits.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.figures.iter().all(Figure::holds)
    }
}
