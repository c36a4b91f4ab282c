//! What is stepped, and with what.

use super::{stage::Stage, substep::Settings};
use crate::{
    EffectStates, Effects, Factors, Particles, Stitches, Threads, Topology,
    contact::collider::Swept, lanes::Instructions,
};
use std::{fmt, sync::Arc};

/// A body turned non-finite.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotFinite {
    /// The first particle found.
    pub particle: usize,
    /// The substep after which it was found.
    pub substep: u32,
}

/// What is stepped, wherever its parts are kept.
#[derive(Debug)]
pub struct Stepper<'a> {
    /// The immutable part, unless the body flows.
    pub topology: &'a mut Arc<Topology>,
    /// The state.
    pub particles: &'a mut Particles,
    /// The effects that it carries.
    pub effects: &'a Effects,
    /// What they keep.
    pub states: &'a mut EffectStates,
    /// Its stitches; which are broken changes.
    pub stitches: &'a mut Stitches,
    /// What it is solved with directly, if it is.
    pub factors: &'a mut Factors,
}

/// What all bodies are stepped with.
#[derive(Debug, Clone, Copy)]
pub struct StepContext<'a> {
    /// Gravity, rate, substeps, iterations.
    pub settings: &'a Settings,
    /// Start of the tick [s].
    pub time: f64,
    /// What the colliders do in the tick.
    pub swept: &'a Swept,
    /// Threads to work on pieces with.
    pub threads: &'a Threads,
    /// Instructions to use.
    pub instructions: Instructions,
    /// Times the stages; none by default, as it is not free.
    pub watch: Option<&'a dyn Watch>,
}

/// Sees each piece of work on its way, to time it: the solver has no clock.
pub trait Watch: fmt::Debug + Sync {
    /// Does `work`, which is a part of `stage`, on the thread that it is called on.
    fn see(&self, stage: Stage, work: &mut dyn FnMut());
}
