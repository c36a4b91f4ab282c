//! Common interface of effects without elements: they act on individual particles or on the whole
//! body.
//!
//! # Adding one
//! A file with its parameters and an implementation of [`BodyEffect`], once for lanes and threads
//! and once in plain `f64` for the reference, and a line in the table of
//! [`effects!`](crate::effects). State, position in a substep, energy ledger, residuals and memory
//! follow from the implementation. An effect that acts on few particles can leave the others
//! [in lanes](BodyEffect::IN_LANES).

use crate::{
    Substep, Threads, Topology,
    colliders::{collider::SweptCollider, inside::WayOut},
    kernel::{each::InLanes, sum::SquareSum},
    lanes::Instructions,
    parallel::scope::Scope,
    particles::{Part, Particles},
};
use glam::{DVec3, Vec3, Vec4};
use std::fmt;

/// An effect without elements.
pub trait BodyEffect {
    /// State from pass to pass; it is created and dropped with the effect.
    type State: fmt::Debug + Clone + Default + PartialEq;
    /// Granularity of its work.
    type Scope: Scope<Self::State>;
    /// State of the reference.
    type ReferenceState: fmt::Debug + Clone + Default;

    /// Phase of a substep in which it acts.
    const PHASE: BodyPhase = BodyPhase::Iteration;
    /// Row of the energy ledger for its work.
    const WORK: WorkOf = WorkOf::Elasticity;
    /// Whether it acts in [`BodyPhase::Iteration`] and has no torque on a body without pins: what it
    /// changes of the [angular momentum](crate::spin) is taken back.
    const IS_INTERNAL: bool = false;
    /// Whether a body may stay in lanes for it: true if it implements
    /// [`solve_in_lanes`](Self::solve_in_lanes). It must not move positions.
    const IN_LANES: bool = false;

    /// Begins a tick of a body with these positions [m] and inverse masses [1/kg].
    fn begin_tick(&self, _state: &mut Self::State, _topology: &Topology, _positions: &[Vec4]) {}

    /// Updates its state for a body before it is stepped.
    fn prepare(&self, _state: &mut Self::State, _body: &Resting) {}

    /// Performs a pass over a piece whose particles are in lanes, with the bits of
    /// [`solve`](Self::solve). Returns the lanes in which a particle touched something, as bits, or
    /// `None`, with nothing changed, if the particles must leave the lanes for it.
    fn solve_in_lanes(
        &self,
        _state: <Self::Scope as Scope<Self::State>>::Piece<'_>,
        _particles: &mut impl InLanes,
        _pass: &BodyPass,
    ) -> Option<u64> {
        None
    }

    /// Performs a pass over a piece; returns whether the body touched something.
    fn solve(
        &self,
        state: <Self::Scope as Scope<Self::State>>::Piece<'_>,
        part: Part,
        pass: &BodyPass,
    ) -> bool;

    /// Updates the state of the reference for a body at `x` [m] with inverse masses `w` [1/kg].
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

    /// Performs a pass of the reference.
    fn solve_reference(
        &self,
        state: &mut Self::ReferenceState,
        body: ReferenceParticles,
        pass: &ReferencePass,
    );

    /// Moves the particles of the reference by the current multipliers, w∇C λ.
    fn pull_reference(&self, _state: &mut Self::ReferenceState, _body: ReferenceParticles) {}

    /// Number of constraints on a body.
    fn constraints(&self, _topology: &Topology) -> usize {
        0
    }

    /// Number of elements on a body, as shown to users.
    fn elements(&self, _state: &Self::State, topology: &Topology) -> usize {
        self.constraints(topology)
    }

    /// Estimated cost of a pass, in constraints of elastic effects.
    fn load(&self, topology: &Topology) -> usize {
        self.constraints(topology)
    }

    /// Energy stored in a body with particles `at` positions in m and inverse masses in 1/kg.
    /// `state` may belong to another mesh, or be new.
    fn stores(
        &self,
        _state: &Self::State,
        _topology: &Topology,
        _at: &dyn Fn(u32) -> (DVec3, f64),
        _store: &mut dyn FnMut(Store),
    ) {
    }

    /// Residual of its equations after a substep of `h` seconds, each relative to its scale.
    fn residual(
        &self,
        _state: &Self::State,
        _topology: &Topology,
        _particles: &Particles,
        _h: f64,
    ) -> SquareSum {
        SquareSum::default()
    }

    /// Heap memory of the state in bytes.
    fn bytes(state: &Self::State) -> usize;
}

/// Phase of a substep in which an effect acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BodyPhase {
    /// At the end of the first stage, after positions are predicted.
    Prediction,
    /// In each iteration, after elastic effects.
    Iteration,
    /// At the end of each iteration, after custom constraints.
    IterationEnd,
    /// In each pass over contacts.
    Contact,
}

/// Row of the energy ledger for work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WorkOf {
    /// Internal constraints of the body.
    Elasticity,
    /// A grab.
    Grab,
    /// A contact, with friction separated: the ledger performs each pass twice, first [without
    /// friction](BodyPass::is_frictionless) on a copy.
    Contact,
}

/// A body before it is stepped.
#[derive(Debug, Clone, Copy)]
pub struct Resting<'a> {
    /// Topology of the body.
    pub topology: &'a Topology,
    /// The first substep.
    pub step: &'a Substep,
    /// Whether forces of contacts are measured afterwards, see
    /// [`EffectStates::records_contacts`](crate::EffectStates::records_contacts).
    pub records_contacts: bool,
}

/// A pass over a piece of a body.
#[derive(Debug, Clone, Copy)]
pub struct BodyPass<'a> {
    /// Constraints, rest values and rest positions.
    pub topology: &'a Topology,
    /// Number of the first particle of the piece.
    pub first: usize,
    /// Motion of the colliders in the substep.
    pub colliders: &'a [SweptCollider],
    /// The sides to which the body leaves those that it began the tick in.
    pub sides: &'a [WayOut],
    /// Gravity [m/s²].
    pub gravity: Vec3,
    /// Length of the substep [s].
    pub seconds: f64,
    /// Length of the substep [s] for implicit Euler.
    pub h: f32,
    /// Length of the substep [s] for compliances, by the method.
    pub compliant: f32,
    /// Fraction of the correction that constraints apply, by the method, from 0 to 1.
    pub relaxation: f32,
    /// Number of the substep, and their count.
    pub substep: (u32, u32),
    /// Number of the iteration, and their count.
    pub iteration: (u32, u32),
    /// Whether friction is left out.
    pub is_frictionless: bool,
    /// Rolling resistance of grains that rotate.
    pub rolling_resistance: f32,
    /// The instruction set for lanes.
    pub instructions: Instructions,
    /// Threads for an effect on the whole body.
    pub threads: &'a Threads,
}

impl BodyPass<'_> {
    /// Whether its contacts count: the energy ledger repeats a pass without friction.
    pub(crate) fn records(&self) -> bool {
        !self.is_frictionless
    }
}

/// Particles of the reference.
#[derive(Debug)]
pub struct ReferenceParticles<'a> {
    /// Constraints, rest values and rest positions.
    pub topology: &'a Topology,
    /// Positions [m].
    pub x: &'a mut [DVec3],
    /// Positions at the start of the substep [m]; restitution lowers them.
    pub p: &'a mut [DVec3],
    /// Positions at the start of the substep without restitution [m].
    pub from: &'a [DVec3],
    /// Inverse masses [1/kg].
    pub w: &'a [f64],
    /// Radius times angular velocity of grains that rotate [m/s]; empty for others.
    pub spins: &'a mut [DVec3],
    /// Their coefficient of rolling resistance.
    pub rolling_resistance: f64,
    /// The sides to which the body leaves colliders that it began the tick in.
    pub sides: &'a [WayOut],
    /// Whether the body touched something.
    pub touched: &'a mut bool,
}

/// A pass of the reference.
#[derive(Debug, Clone, Copy)]
pub struct ReferencePass<'a> {
    /// Motion of the colliders in the substep.
    pub colliders: &'a [SweptCollider],
    /// Gravity [m/s²].
    pub gravity: DVec3,
    /// Length of the substep [s].
    pub seconds: f64,
    /// Length of the substep [s] for implicit Euler.
    pub h: f64,
    /// Length of the substep [s] for compliances, by the method.
    pub compliant: f64,
    /// Fraction of the correction that constraints apply, by the method, from 0 to 1.
    pub relaxation: f64,
    /// Number of the substep, and their count.
    pub substep: (u32, u32),
    /// Number of the iteration, and their count.
    pub iteration: (u32, u32),
    /// Whether elastic multipliers start at 0.
    pub is_anew: bool,
}

/// Stored energy along one coordinate.
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
    /// Any other energy.
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
    /// Stored energy [J].
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
