//! The first steps: three hints in the window at the first start.

use bevy::prelude::*;

/// One of the first steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FirstStep {
    /// Drag a body.
    Drag,
    /// Change a parameter in the panel.
    Turn,
    /// Switch the reference overlay on.
    Reference,
}

impl FirstStep {
    /// Number of the step, from 1 to 3.
    #[must_use]
    pub const fn number(self) -> u32 {
        match self {
            Self::Drag => 1,
            Self::Turn => 2,
            Self::Reference => 3,
        }
    }
}

/// The step that is shown, if any.
#[derive(Resource, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FirstSteps(Option<FirstStep>);

impl FirstSteps {
    /// The step that is shown.
    #[must_use]
    pub const fn now(&self) -> Option<FirstStep> {
        self.0
    }

    /// Shows the steps from the first one on.
    pub fn again(&mut self) {
        self.0 = Some(FirstStep::Drag);
    }

    /// Goes on to the next step, if `done` is the one that is shown.
    pub fn complete(&mut self, done: FirstStep) {
        if self.0 == Some(done) {
            self.0 = match done {
                FirstStep::Drag => Some(FirstStep::Turn),
                FirstStep::Turn => Some(FirstStep::Reference),
                FirstStep::Reference => None,
            };
        }
    }

    /// Ends the steps.
    pub fn skip(&mut self) {
        self.0 = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_follow_each_other_and_only_the_shown_one_can_be_completed() {
        let mut steps = FirstSteps::default();
        steps.complete(FirstStep::Drag);
        assert_eq!(steps.now(), None);
        steps.again();
        steps.complete(FirstStep::Reference);
        assert_eq!(steps.now(), Some(FirstStep::Drag));
        for done in [FirstStep::Drag, FirstStep::Turn, FirstStep::Reference] {
            assert_eq!(steps.now(), Some(done));
            steps.complete(done);
        }
        assert_eq!(steps.now(), None);
    }
}
