//! What came of a case.

use crate::torture::{
    Figure, Outcome, Row,
    filmstrip::{Frame, frames},
};

/// What came of a case, on the body on screen or on the worst of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// The body whose figures these are.
    pub member: String,
    /// How many were run.
    pub members: usize,
    /// How many of them did not pass, though nothing is said of them.
    pub failed: usize,
    /// How many did not pass, as expected.
    pub expected_failed: usize,
    /// Why it is not expected to pass, if it is not.
    pub expected: Option<&'static str>,
    /// Settings with which it passes, in words, once they are looked for.
    pub advice: Option<String>,
    /// All figures, the worst first.
    pub figures: Vec<Figure>,
    /// The start, the worst moment and the end.
    pub film: Vec<Frame>,
}

impl Verdict {
    /// Of the body on screen.
    #[must_use]
    pub fn of_this(outcome: &Outcome) -> Self {
        Self {
            failed: usize::from(!outcome.passed()),
            ..Self::of(outcome, 1, None)
        }
    }

    /// Of a family: the worst member that is expected to pass, or else the worst of the others.
    /// `film` is that member, run again to be seen.
    #[must_use]
    pub fn of_family(rows: &[Row], film: &Outcome, expected: Option<&'static str>) -> Self {
        let count = |of: &dyn Fn(&Row) -> usize| rows.iter().map(of).sum();
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

    /// Whether every figure of it holds.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.figures.iter().all(Figure::holds)
    }
}
