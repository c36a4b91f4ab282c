//! Hard cases: that the solver stays stable is shown, not said.
//!
//! A [`Case`] is a piece of data: a family of [members](Member), what is done to a member's world
//! before it is stepped and while it is, and a judge that says with [figures](Figure) what came of
//! it. Each case is run over its whole family, small bodies and large, a millimetre and a
//! kilometre, rigid and soft, with one substep and with many, and the worst member is what is
//! reported. Whatever a case is about, [`Watch`] holds it to what must always hold: every number
//! finite, no energy out of nothing, pins exactly still, the momentum of free bodies constant, the
//! same bits again and with other threads.
//!
//! One definition, three ways to run it: [`suite::run`] for the program and the tests;
//! [`run::run_given`] for a body that somebody has.
//!
//! A member that is known not to pass stays in the table and is listed in [`EXPECTED_FAILURES`].
//!
//! To add one: a `Case` in a file of `cases`, and a line in [`CASES`].

pub mod advice;
mod cases;
mod energy;
mod error;
mod expected;
mod family;
mod figure;
pub mod filmstrip;
mod member;
pub mod report;
pub mod run;
mod shape;
pub mod suite;
pub mod table;
pub mod watch;

pub use advice::Advice;
pub use cases::CASES;
pub use energy::Energy;
pub use error::TortureError;
pub use expected::{EXPECTED_FAILURES, ExpectedFailure};
pub use figure::Figure;
pub use member::Member;
pub use run::{Outcome, Run};
pub use shape::{Kind, Shape};
pub use suite::{Job, Options, Row, jobs};
pub use watch::{Moment, Watch};

use crate::solver::{Deformation, World};

/// A hard case.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    /// What commands call it.
    pub name: &'static str,
    /// What tables call it.
    pub title: &'static str,
    /// What is done, and what must come of it, in a sentence or two.
    pub about: &'static str,
    /// Simulated time [s].
    pub seconds: fn(&Member) -> f64,
    /// The bodies that it is tried on, with this multiple of the usual number of random mixtures.
    pub family: fn(u32) -> Vec<Member>,
    /// What is done before the first tick, to the member's body alone in a world without gravity.
    pub start: Start,
    /// What is done before each tick.
    pub during: fn(&Member, &mut World) -> Result<(), TortureError>,
    /// What must have come of it.
    pub judge: fn(&Run) -> Result<Vec<Figure>, TortureError>,
    /// What is done to the bodies from outside while they are stepped.
    pub outside: Outside,
    /// Whether it makes sense for any body that somebody has.
    pub any_body: bool,
}

/// What is done to a world before its first tick.
#[derive(Debug, Clone, Copy)]
pub enum Start {
    /// Its bodies are deformed.
    Deform(fn(&Member) -> Deformation),
    /// Anything else.
    Make(fn(&Member, &mut World) -> Result<(), TortureError>),
}

/// What is done to bodies from outside while they are stepped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outside {
    /// Nothing: they must not gain energy, and free ones keep their momentum.
    Nothing,
    /// A hand or a collider works on them, or bodies come and go.
    Work,
    /// One is made not finite.
    Poison,
}

impl Case {
    /// The case of a name.
    ///
    /// # Errors
    /// [`TortureError::NoCase`] with the names that there are.
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

    /// Puts a world into the state that a member begins from.
    ///
    /// # Errors
    /// [`TortureError`] for what cannot be built.
    pub fn begin(&self, member: &Member, world: &mut World) -> Result<(), TortureError> {
        match self.start {
            Start::Deform(how) => {
                cases::deformed(member, world, how(member));
                Ok(())
            }
            Start::Make(make) => make(member, world),
        }
    }

    /// How a body that somebody has is put into the state that the case begins from, if it is by a
    /// deformation.
    #[must_use]
    pub fn deformation(&self, body: &Member) -> Option<Deformation> {
        match self.start {
            Start::Deform(how) if self.any_body => Some(how(body)),
            _ => None,
        }
    }

    /// Why a member is known not to pass, if it is.
    #[must_use]
    pub fn expected_failure(&self, member: &Member) -> Option<&'static ExpectedFailure> {
        let name = member.to_string();
        let mut all = EXPECTED_FAILURES.iter();
        all.find(|it| it.case == self.name && it.members.contains(&&*name))
    }
}

/// Does nothing before a tick.
fn nothing(_: &Member, _: &mut World) -> Result<(), TortureError> {
    Ok(())
}
