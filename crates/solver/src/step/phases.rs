//! What is to be done in a tick, as a row of phases.
//!
//! A task that touches each particle by itself (to predict, to keep it above ground) can be done
//! on any pieces; one that projects constraints does those of the even bands on the even pieces,
//! and those of the odd bands on the odd ones. Tasks that follow each other on pieces of the same
//! side are one phase: they are done together, piece by piece, each piece while it is in the
//! cache. Edges begin with the even bands, tetrahedra with the odd ones, so that a substep of
//! both has two phases, not four.
//!
//! A particle meets its tasks in the same order as if each task were done on all of the body
//! before the next one begins.

use super::{scope::Side, stage::Stage};
use crate::{
    BodyEffectKind, ElasticKind, ForceKind,
    partitions::{Partitions, Piece},
};
use std::iter::Peekable;

/// What is done with a piece.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Task {
    /// A force from outside.
    Force { kind: ForceKind, substep: u32 },
    /// Velocities lose a share of what they will be after gravity.
    Fade,
    /// First stage.
    Begin,
    /// Third stage.
    End { substep: u32 },
    /// Third stage of a substep and first stage of the next.
    Turn { substep: u32 },
    /// The constraints of an elastic effect: sweep number so-and-so of so many, and whether λ is to
    /// be kept.
    Elastic {
        kind: ElasticKind,
        sweep: (u32, u32, bool),
    },
    /// A pass of an effect without elements.
    Body {
        kind: BodyEffectKind,
        substep: u32,
        iteration: u32,
    },
    /// What elastic effects do as one system: iteration number so-and-so.
    Direct { iteration: u32 },
    /// Every particle goes to the mean of where the constraints of an effect would have it.
    Average { kind: ElasticKind, sweep: u32 },
}

impl Task {
    /// What it is a part of; a turn counts as the stage that it begins with.
    pub fn stage(self) -> Stage {
        match self {
            Self::Force { kind, .. } => Stage::Force(kind),
            Self::Fade | Self::Begin => Stage::Presolve,
            Self::Body { kind, .. } => Stage::Body(kind),
            Self::Direct { .. } => Stage::Direct,
            Self::Elastic { kind, .. } | Self::Average { kind, .. } => Stage::Elastic(kind),
            Self::Turn { .. } | Self::End { .. } => Stage::Postsolve,
        }
    }
}

/// Tasks of a phase at most.
const MAX_TASKS: usize = 16;

/// Tasks that are done together, on pieces that share no particle.
#[derive(Debug, Clone)]
pub(crate) struct Phase<'a> {
    tasks: [Task; MAX_TASKS],
    count: usize,
    side: Side,
    /// All particles of the body.
    pub pieces: &'a [Piece],
}

impl Phase<'_> {
    /// In their order.
    pub fn tasks(&self) -> &[Task] {
        &self.tasks[..self.count]
    }

    /// Whether the body is in one piece, and loose constraints are to be solved.
    pub fn is_whole(&self) -> bool {
        self.side == Side::Whole
    }
}

/// Puts tasks into phases.
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
