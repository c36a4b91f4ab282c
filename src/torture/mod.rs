//! The stress tests: hard cases that test the stability of the solver.
//!
//! A [`Case`] is a piece of data: a family of [members](Member), the setup of a member's world, the
//! actions during the run, and a judge that reports the outcome as [figures](Figure). Each case is
//! run over its whole family, small bodies and large, from 10 µm to 1 km, rigid and
//! soft, with one substep and with many, and the worst member is reported. In every case, [`Watch`]
//! checks the universal requirements: all numbers are finite, no energy is created, pins do not
//! move, the momentum of free bodies is constant, and repeated runs with any number of threads give
//! the same bits.
//!
//! A case can be run in two ways: by [`run`](fn@run) for the program and the tests, and by
//! [`run_given`] for a user's body. [`scene::run`] makes a case of a user's scene.
//!
//! A member that is known to fail stays in the table and is listed in [`EXPECTED_FAILURES`].
//!
//! To add a case, add a `Case` in a file of `cases` and a line in [`CASES`].

mod advice;
mod cases;
mod energy;
mod error;
mod expected;
mod family;
mod figure;
pub mod filmstrip;
mod html;
mod in_app;
mod map;
mod member;
pub mod report;
mod run;
pub mod scene;
mod shape;
mod suite;
pub mod table;
mod tally;
mod watch;

pub use advice::{Advice, advise, advise_given};
pub use cases::CASES;
pub use energy::Energy;
pub use error::TortureError;
pub use expected::{EXPECTED_FAILURES, ExpectedFailure};
pub use figure::Figure;
pub use member::Member;
pub use run::{Crews, Outcome, Run, prepared, run_given, run_member};
pub use shape::{Kind, Shape};
pub use suite::{Job, Options, SuiteRow, jobs, run};
pub use watch::{Moment, Watch};

use crate::solver::{World, deform::Deformation};

/// A hard case.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    /// Its name in commands.
    pub name: &'static str,
    /// Its name in tables.
    pub title: &'static str,
    /// Setup and requirements, in a sentence or two.
    pub about: &'static str,
    /// Simulated time [s].
    pub seconds: fn(&Member) -> f64,
    /// The members, with this multiple of the usual number of random mixtures.
    pub family: fn(u32) -> Vec<Member>,
    /// Setup before the first tick, of a world that contains only the member's body, without
    /// gravity.
    pub start: Start,
    /// Action before each tick.
    pub during: fn(&Member, &mut World) -> Result<(), TortureError>,
    /// Evaluates the requirements.
    pub judge: fn(&Run) -> Result<Vec<Figure>, TortureError>,
    /// External actions on the bodies during the run.
    pub outside: Outside,
    /// Whether the case applies to any user body.
    pub any_body: bool,
}

/// Setup of a world before its first tick.
#[derive(Debug, Clone, Copy)]
pub enum Start {
    /// Deforms its bodies.
    Deform(fn(&Member) -> Deformation),
    /// Any other setup.
    Make(fn(&Member, &mut World) -> Result<(), TortureError>),
}

/// External actions on the bodies during the run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outside {
    /// None: bodies must not gain energy, and free ones keep their momentum.
    Nothing,
    /// A grab or a collider acts on them, or bodies are added or removed.
    Work,
    /// One body is made non-finite.
    Poison,
}

impl Case {
    /// The case with this name.
    ///
    /// # Errors
    /// [`TortureError::NoCase`] with the valid names.
    pub fn named(name: &str) -> Result<&'static Self, TortureError> {
        let found = CASES.iter().find(|case| case.name == name);
        found.ok_or_else(|| TortureError::NoCase {
            name: name.to_owned(),
            valid: CASES
                .iter()
                .map(|case| case.name)
                .collect::<Vec<_>>()
                .join(", "),
        })
    }

    /// Puts a world into the initial state of a member.
    ///
    /// # Errors
    /// [`TortureError`] if it cannot be built.
    pub fn begin(&self, member: &Member, world: &mut World) -> Result<(), TortureError> {
        match self.start {
            Start::Deform(how) => {
                cases::deformed(member, world, how(member));
                Ok(())
            }
            Start::Make(make) => make(member, world),
        }
    }

    /// The deformation that puts a user's body into the initial state of the case, if it has one.
    #[must_use]
    pub fn deformation(&self, body: &Member) -> Option<Deformation> {
        match self.start {
            Start::Deform(how) if self.any_body => Some(how(body)),
            _ => None,
        }
    }

    /// The expected failure of a member, if it is known to fail.
    #[must_use]
    pub fn expected_failure(&self, member: &Member) -> Option<&'static ExpectedFailure> {
        let name = member.to_string();
        let mut all = EXPECTED_FAILURES.iter();
        all.find(|it| it.case == self.name && it.members.contains(&&*name))
    }
}

/// No action before a tick.
fn nothing(_: &Member, _: &mut World) -> Result<(), TortureError> {
    Ok(())
}
