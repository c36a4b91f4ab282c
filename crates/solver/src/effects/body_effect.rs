//! What all effects have in common that have no elements: they act on particles one by one, or on the whole body.
//!
//! # Adding one
//! A file with its parameters and an implementation of [`BodyEffect`], once for lanes and threads and once in plain `f64`
//! for the reference, and a line in the table of [`effects!`](crate::effects). What it keeps, its place in a substep, the
//! energy ledger, residuals and memory follow from the implementation.

use crate::{
    ColliderShape, Pose, Topology,
    contact::collider::SweptCollider,
    kernel::sum::SquareSum,
    particles::{Part, Particles},
    step::{scope::Scope, substep::Substep},
};
use glam::{DVec3, Vec3, Vec4};
use std::fmt;

/// An effect without elements.
pub trait BodyEffect {
    /// What it keeps from pass to pass; it comes and goes with the effect.
    type State: fmt::Debug + Clone + Default + PartialEq;
    /// What it works on at a time.
    type Scope: Scope<Self::State>;
    /// What the reference keeps of it.
    type ReferenceState: fmt::Debug + Clone + Default;

    /// When it acts in a substep.
    const PHASE: BodyPhase = BodyPhase::Iteration;
    /// What the energy ledger puts its work down to.
    const WORK: WorkOf = WorkOf::Elasticity;

    /// Begins a tick of a body with these positions [m] and inverse masses [1/kg].
    fn begin_tick(&self, _state: &mut Self::State, _topology: &Topology, _positions: &[Vec4]) {}

    /// Brings its state in line with a body before it is stepped.
    fn prepare(&self, _state: &mut Self::State, _body: &Resting) {}

    /// A pass over a piece; says whether the body touched something.
    fn solve(
        &self,
        state: <Self::Scope as Scope<Self::State>>::Piece<'_>,
        part: Part,
        pass: &BodyPass,
    ) -> bool;

    /// Brings the state of the reference in line with a body at `x` [m] with inverse masses `w` [1/kg].
    fn prepare_reference(
        &self,
        _state: &mut Self::ReferenceState,
        _topology: &Topology,
        _x: &[DVec3],
        _w: &[f64],
    ) {
    }

    /// Begins a substep of the reference.
    fn begin_reference(&self, _state: &mut Self::ReferenceState, _particles: usize) {}

    /// A pass of the reference.
    fn solve_reference(
        &self,
        state: &mut Self::ReferenceState,
        body: ReferenceParticles,
        pass: &ReferencePass,
    );

    /// Moves the particles of the reference by what the multipliers that are there pull, w∇C λ.
    fn pull_reference(&self, _state: &mut Self::ReferenceState, _body: ReferenceParticles) {}

    /// How many constraints it has on a body.
    fn constraints(&self, _topology: &Topology) -> usize {
        0
    }

    /// How many elements it has on a body, as users count them.
    fn elements(&self, _state: &Self::State, topology: &Topology) -> usize {
        self.constraints(topology)
    }

    /// Estimated cost of a pass, in constraints of elastic effects.
    fn load(&self, topology: &Topology) -> usize {
        self.constraints(topology)
    }

    /// What it stores in a body whose particles are `at` places in m, with their inverse masses in 1/kg. `state` may be of
    /// another mesh, or new.
    fn stores(
        &self,
        _state: &Self::State,
        _topology: &Topology,
        _at: &dyn Fn(u32) -> (DVec3, f64),
        _store: &mut dyn FnMut(Store),
    ) {
    }

    /// What is left of its equations after a substep of `h` seconds, each over its own scale.
    fn residual(
        &self,
        _state: &Self::State,
        _topology: &Topology,
        _particles: &Particles,
        _h: f64,
    ) -> SquareSum {
        SquareSum::default()
    }

    /// Bytes of memory that the state has on the heap.
    fn bytes(state: &Self::State) -> usize;
}

/// When an effect acts in a substep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BodyPhase {
    /// At the end of the first stage, once positions are predicted.
    Prediction,
    /// In each iteration, after elastic effects.
    Iteration,
    /// At the end of each iteration, after what an app adds to it.
    IterationEnd,
    /// In each pass over contacts.
    Contact,
}

/// What the energy ledger puts work down to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WorkOf {
    /// What holds the body together.
    Elasticity,
    /// A grab.
    Grab,
    /// A contact, with friction told apart: the ledger does each pass twice, first
    /// [without friction](BodyPass::is_frictionless) on a copy.
    Contact,
}

/// A body that is about to be stepped.
#[derive(Debug, Clone, Copy)]
pub struct Resting<'a> {
    /// Its mesh.
    pub topology: &'a Topology,
    /// The first substep.
    pub step: &'a Substep,
}

/// A pass over a piece of a body.
#[derive(Debug, Clone, Copy)]
pub struct BodyPass<'a> {
    /// Constraints, rest values and rest positions.
    pub topology: &'a Topology,
    /// Number of the first particle of the piece.
    pub first: usize,
    /// What colliders do in the substep.
    pub colliders: &'a [SweptCollider],
    /// Gravity [m/s²].
    pub gravity: Vec3,
    /// Length of the substep [s], as implicit Euler has it.
    pub h: f32,
    /// The same as compliances have it by the method.
    pub compliant: f32,
    /// How much of their way constraints go by the method, from 0 to 1.
    pub share: f32,
    /// Number of the substep, of how many.
    pub substep: (u32, u32),
    /// Number of the iteration, of how many.
    pub iteration: (u32, u32),
    /// Whether friction is left out.
    pub is_frictionless: bool,
}

/// Particles of the reference, as an effect has them.
#[derive(Debug)]
pub struct ReferenceParticles<'a> {
    /// Constraints, rest values and rest positions.
    pub topology: &'a Topology,
    /// Positions [m].
    pub x: &'a mut [DVec3],
    /// Positions at the start of the substep [m]; a bounce lowers them.
    pub p: &'a mut [DVec3],
    /// The same as they were before any bounce [m].
    pub from: &'a [DVec3],
    /// Inverse masses [1/kg].
    pub w: &'a [f64],
    /// Whether the body touched something.
    pub touched: &'a mut bool,
}

/// A pass of the reference.
#[derive(Debug, Clone, Copy)]
pub struct ReferencePass<'a> {
    /// What colliders do in the substep.
    pub colliders: &'a [(ColliderShape, Pose, Pose)],
    /// Gravity [m/s²].
    pub gravity: DVec3,
    /// Length of the substep [s], as implicit Euler has it.
    pub h: f64,
    /// The same as compliances have it by the method.
    pub compliant: f64,
    /// How much of their way constraints go by the method, from 0 to 1.
    pub share: f64,
    /// Number of the substep, of how many.
    pub substep: (u32, u32),
    /// Number of the iteration, of how many.
    pub iteration: (u32, u32),
    /// Whether elastic multipliers start at 0.
    pub is_anew: bool,
}

/// Energy that is stored along one coordinate.
#[derive(Debug, Clone, Copy)]
pub enum Store {
    /// ½C²/α; rigid constraints store none.
    Spring {
        /// C.
        error: f64,
        /// α.
        compliance: f64,
        /// τ [s].
        damping: f64,
    },
    /// Any other.
    Potential {
        /// The coordinate q.
        coordinate: f64,
        /// E(q) [J].
        energy: f64,
        /// −dE/dq.
        force: f64,
    },
}

impl Store {
    /// What is stored [J].
    pub fn energy(self) -> f64 {
        match self {
            Self::Spring {
                error, compliance, ..
            } => spring_energy(error, compliance),
            Self::Potential { energy, .. } => energy,
        }
    }
}

/// ½C²/α [J]; 0 where α is.
pub fn spring_energy(error: f64, compliance: f64) -> f64 {
    if compliance > 0.0 {
        0.5 * error * error / compliance
    } else {
        0.0
    }
}
