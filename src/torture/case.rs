//! What a case consists of.

use super::{
    EXPECTED_FAILURES, ExpectedFailure, Figure, Member, Run, TortureError, deformed::deformed,
};
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
    /// Puts a world into the initial state of a member.
    ///
    /// # Errors
    /// [`TortureError`] if it cannot be built.
    pub fn begin(&self, member: &Member, world: &mut World) -> Result<(), TortureError> {
        match self.start {
            Start::Deform(how) => {
                deformed(member, world, how(member));
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
pub(super) fn nothing(_: &Member, _: &mut World) -> Result<(), TortureError> {
    Ok(())
}
