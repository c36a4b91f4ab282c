//! Input of a step: a body and its context.

use super::stage::Stage;
use crate::{
    Controls, EffectStates, Effects, Outside, Particles, Settings, Stitches, Threads, Topology,
    colliders::collider::Swept, direct::DirectWorkspace, lanes::Instructions,
};
use std::{fmt, sync::Arc};

/// Error: a body diverged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct NotFinite {
    /// The first particle found.
    pub particle: usize,
    /// The substep after which it was found.
    pub substep: u32,
}

/// A body to step, independent of the storage of its parts.
#[derive(Debug)]
pub struct Stepper<'a> {
    /// The immutable part, except for plastic flow.
    pub topology: &'a mut Arc<Topology>,
    /// The state.
    pub particles: &'a mut Particles,
    /// Effects of the body.
    pub effects: &'a Effects,
    /// States of the effects.
    pub states: &'a mut EffectStates,
    /// Its stitches; their broken flags change.
    pub stitches: &'a mut Stitches,
    /// Data of the direct solver, if it is used.
    pub direct: &'a mut DirectWorkspace,
    /// What an app does to it.
    pub controls: &'a mut Option<Box<Controls>>,
}

impl Stepper<'_> {
    /// Reborrows for a shorter lifetime.
    pub(super) fn reborrow(&mut self) -> Stepper<'_> {
        Stepper {
            topology: self.topology,
            particles: self.particles,
            effects: self.effects,
            states: self.states,
            stitches: self.stitches,
            direct: self.direct,
            controls: self.controls,
        }
    }

    /// What acts on the body from outside.
    #[must_use]
    pub fn outside(&self) -> Outside {
        let stitched = !self.stitches.is_empty();
        let none = Outside {
            stitched,
            ..Outside::default()
        };
        let controls = self.controls.as_ref();
        controls.map_or(none, |it| it.outside(stitched))
    }
}

/// Context that all bodies share.
#[derive(Debug, Clone, Copy)]
pub struct StepContext<'a> {
    /// Gravity, rate, substeps, iterations.
    pub settings: &'a Settings,
    /// Start of the tick [s].
    pub time: f64,
    /// Motion of the colliders in the tick.
    pub swept: &'a Swept,
    /// Threads for work on pieces.
    pub threads: &'a Threads,
    /// Instructions to use.
    pub instructions: Instructions,
    /// Timer of the stages; none by default, because of its cost.
    pub watch: Option<&'a dyn Watch>,
}

/// Observes each piece of work, for timing: the solver has no clock.
pub trait Watch: fmt::Debug + Sync {
    /// Performs `work`, a part of `stage`, on the calling thread.
    fn observe(&self, stage: Stage, work: &mut dyn FnMut());
}
