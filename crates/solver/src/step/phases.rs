//! The work of a tick as a sequence of phases.
//!
//! A task that handles each particle by itself (prediction, ground contact) can run on any pieces.
//! A task that projects constraints solves those of the even partitions on the even pieces, and
//! those of the odd partitions on the odd ones. Consecutive tasks on pieces of the same side form
//! one phase: they run together, piece by piece, while each piece is in the cache. Edges begin with
//! the even partitions, tetrahedra with the odd ones, so that a substep of both has two phases
//! instead of four.
//!
//! The tasks of a particle run in the same order as if each task were completed on the whole body
//! before the next begins.

use super::stage::Stage;
use crate::{
    BodyEffectKind, ElasticKind, ForceKind,
    parallel::scope::Side,
    partitions::{Partitions, Piece},
};
use std::iter::Peekable;

/// A task on a piece.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Task {
    /// The force of an app.
    Push,
    /// An app moves pins.
    MovePins { substep: u32 },
    /// Grabs of an app, in an iteration.
    Grabs { substep: u32, iteration: u32 },
    /// A force field.
    Force { kind: ForceKind, substep: u32 },
    /// Velocities are damped after gravity.
    DampVelocity,
    /// First stage.
    Begin,
    /// Third stage.
    End { substep: u32 },
    /// Third stage of a substep and first stage of the next.
    EndAndBegin { substep: u32 },
    /// Particles into lanes, with carries where they are needed.
    Load { carried: bool },
    /// Displacements back from lanes, and positions and carries if they have moved.
    Store { moved: bool },
    /// Constraints of an elastic effect: number of the iteration, their count, and whether λ is
    /// stored.
    Elastic {
        kind: ElasticKind,
        pass: (u32, u32, bool),
    },
    /// A pass of an effect without elements.
    Body {
        kind: BodyEffectKind,
        substep: u32,
        iteration: u32,
    },
    /// Keeps the displacements before the internal constraints of an iteration, the first of which is
    /// in the stage.
    Keep { stage: Stage },
    /// Sums up what these have done to the angular momentum of each even piece.
    Sum { stage: Stage },
    /// Finds the rotation that takes it back; where the body has several parts, turns them.
    FindTurn { stage: Stage },
    /// Turns the body back.
    TurnBack { stage: Stage },
    /// The elastic effects as one system, in an iteration.
    Direct { substep: u32, iteration: u32 },
    /// Moves every particle to the mean of the positions that the constraints of an effect require.
    Average { kind: ElasticKind, iteration: u32 },
}

impl Task {
    /// Stage of the task; [`EndAndBegin`](Self::EndAndBegin), [`Load`](Self::Load) and
    /// [`Store`](Self::Store) count as the last stage. A [`Watch`](super::stepper::Watch) sees no
    /// `Load` and no `Store`: a body that is observed is not stepped in strips.
    pub fn stage(self) -> Stage {
        match self {
            Self::Push => Stage::External,
            Self::MovePins { .. } => Stage::Pins,
            Self::Grabs { .. } => Stage::Grabs,
            Self::Force { kind, .. } => Stage::Force(kind),
            Self::DampVelocity | Self::Begin => Stage::Presolve,
            Self::Body { kind, .. } => Stage::Body(kind),
            Self::Keep { stage }
            | Self::Sum { stage }
            | Self::FindTurn { stage }
            | Self::TurnBack { stage } => stage,
            Self::Direct { .. } => Stage::Direct,
            Self::Elastic { kind, .. } | Self::Average { kind, .. } => Stage::Elastic(kind),
            Self::EndAndBegin { .. } | Self::End { .. } => Stage::Postsolve,
            Self::Load { .. } | Self::Store { .. } => Stage::Postsolve,
        }
    }
}

/// Maximum number of tasks in a phase.
const MAX_TASKS: usize = 16;

/// Tasks that run together, on pieces that share no particle.
#[derive(Debug, Clone)]
pub(crate) struct Phase<'a> {
    tasks: [Task; MAX_TASKS],
    count: usize,
    side: Side,
    /// All particles of the body.
    pub pieces: &'a [Piece],
}

impl Phase<'_> {
    /// The tasks in order.
    pub fn tasks(&self) -> &[Task] {
        &self.tasks[..self.count]
    }

    /// Whether it is a task that distributes its own work to threads.
    pub fn uses_threads(&self) -> bool {
        let grains = BodyEffectKind::Grains;
        matches!(self.tasks(), &[Task::Body { kind, .. }] if kind == grains)
    }

    /// Whether the body is in one piece, including overflow constraints.
    pub fn is_whole(&self) -> bool {
        self.side == Side::Whole
    }
}

/// Groups tasks into phases.
#[derive(Debug, Clone)]
pub(crate) struct Phases<'a, I: Iterator<Item = (Task, Side)>> {
    tasks: Peekable<I>,
    partitions: &'a Partitions,
}

impl<'a, I: Iterator<Item = (Task, Side)>> Phases<'a, I> {
    pub fn new(tasks: I, partitions: &'a Partitions) -> Self {
        Self {
            tasks: tasks.peekable(),
            partitions,
        }
    }
}

impl<'a, I: Iterator<Item = (Task, Side)>> Iterator for Phases<'a, I> {
    type Item = Phase<'a>;

    fn next(&mut self) -> Option<Phase<'a>> {
        let (task, mut side) = self.tasks.next()?;
        let mut tasks = [task; MAX_TASKS];
        let mut count = 1;
        while count < MAX_TASKS
            && let Some(&(task, next)) = self.tasks.peek()
            && let Some(both) = side.with(next)
        {
            tasks[count] = task;
            count += 1;
            side = both;
            self.tasks.next();
        }
        let pieces = match side {
            Side::Any | Side::Even => self.partitions.pieces(false),
            Side::Odd => self.partitions.pieces(true),
            Side::Whole => self.partitions.whole(),
        };
        Some(Phase {
            tasks,
            count,
            side,
            pieces,
        })
    }
}
