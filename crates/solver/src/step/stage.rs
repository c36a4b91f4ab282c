//! The stages of a substep, in their order.

use super::{method::Method, substep::Substep};
use crate::effects::{
    Effects, body_effect::BodyPhase, body_kinds::BodyEffectKind, elastic::ElasticKind,
    force::ForceKind,
};

/// A part of a substep that can be ordered against.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// A force from outside, before the first stage.
    Force(ForceKind),
    /// Positions are predicted.
    Presolve,
    /// The constraints of an elastic effect.
    Elastic(ElasticKind),
    /// An effect without elements.
    Body(BodyEffectKind),
    /// All elastic effects that are solved directly.
    Direct,
    /// Contact with other bodies.
    Contact,
    /// Contact of the body with itself.
    SelfContact,
    /// Velocities are taken from positions.
    Postsolve,
    /// What is strained too far flows.
    Flow,
}

/// How many effects without elements act in a phase.
const fn count(phase: BodyPhase) -> usize {
    let (mut count, mut index) = (0, 0);
    while index < BodyEffectKind::ALL.len() {
        count += (BodyEffectKind::ALL[index].phase() as usize == phase as usize) as usize;
        index += 1;
    }
    count
}

/// Puts the effects without elements that act in a phase into `all`, from `place` on; the place after them.
const fn put<const N: usize>(
    mut all: [Stage; N],
    mut place: usize,
    phase: BodyPhase,
) -> ([Stage; N], usize) {
    let mut index = 0;
    while index < BodyEffectKind::ALL.len() {
        let kind = BodyEffectKind::ALL[index];
        if kind.phase() as usize == phase as usize {
            all[place] = Stage::Body(kind);
            place += 1;
        }
        index += 1;
    }
    (all, place)
}

/// At the end of the first stage.
const PREDICTION: usize = count(BodyPhase::Prediction);

/// In an iteration: direct solution, elastic effects, and others.
const ITERATION: usize =
    1 + ElasticKind::COUNT + count(BodyPhase::Iteration) + count(BodyPhase::IterationEnd);

/// In a pass over contacts. Those of bodies are left to [`together`](super::together).
const CONTACT: usize = 2 + count(BodyPhase::Contact);

impl Stage {
    /// What is done in an iteration, in its order: what holds the body together, then grabs. Contacts come after it.
    const ITERATION: [Self; ITERATION] = {
        let mut all = [Self::Direct; ITERATION];
        let mut kind = 0;
        while kind < ElasticKind::COUNT {
            all[1 + kind] = Self::Elastic(ElasticKind::ALL[kind]);
            kind += 1;
        }
        let (all, place) = put(all, 1 + kind, BodyPhase::Iteration);
        put(all, place, BodyPhase::IterationEnd).0
    };

    /// What is done in a pass over contacts, in its order.
    const CONTACT: [Self; CONTACT] = {
        let mut all = [Self::Contact; CONTACT];
        all[1] = Self::SelfContact;
        put(all, 2, BodyPhase::Contact).0
    };

    /// All of them, in the order of a substep.
    pub const ALL: [Self; ForceKind::COUNT + PREDICTION + ITERATION + CONTACT + 3] = {
        let mut all = [Self::Presolve; ForceKind::COUNT + PREDICTION + ITERATION + CONTACT + 3];
        let mut place = 0;
        while place < ForceKind::COUNT {
            all[place] = Self::Force(ForceKind::ALL[place]);
            place += 1;
        }
        let (mut all, mut place) = put(all, place + 1, BodyPhase::Prediction);
        let mut index = 0;
        while index < ITERATION {
            all[place] = Self::ITERATION[index];
            place += 1;
            index += 1;
        }
        index = 0;
        while index < CONTACT {
            all[place] = Self::CONTACT[index];
            place += 1;
            index += 1;
        }
        all[place] = Self::Postsolve;
        all[place + 1] = Self::Flow;
        all
    };

    /// What is done at the end of the first stage, in its order.
    pub(crate) fn prediction() -> impl Iterator<Item = Self> + Clone {
        let kinds = BodyEffectKind::ALL.iter().copied();
        kinds
            .filter(|kind| kind.phase() == BodyPhase::Prediction)
            .map(Self::Body)
    }

    /// Its place in [`Stage::ALL`].
    #[must_use]
    pub fn place(self) -> usize {
        Self::ALL
            .iter()
            .position(|stage| *stage == self)
            .unwrap_or(0)
    }

    /// The name of the stage or effect.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Force(kind) => kind.name(),
            Self::Presolve => "presolve",
            Self::Elastic(kind) => kind.name(),
            Self::Body(kind) => kind.name(),
            Self::Direct => "direct",
            Self::Contact => "contact",
            Self::SelfContact => "self_contact",
            Self::Postsolve => "postsolve",
            Self::Flow => "plasticity",
        }
    }
}

/// The second stage of a body: what is absent is not asked for again in every iteration.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Solve {
    iteration: [Option<Stage>; ITERATION],
    contact: [Option<Stage>; CONTACT],
}

impl Solve {
    /// Of a body that carries these effects, with stitches or without, by a method.
    pub fn of(effects: &Effects, stitched: bool, method: Method) -> Self {
        let acts = |stage: &Stage| stage.acts(effects, stitched, method);
        let mut present = Stage::ITERATION.into_iter().filter(acts);
        Self {
            iteration: std::array::from_fn(|_| present.next()),
            contact: Stage::CONTACT.map(|stage| acts(&stage).then_some(stage)),
        }
    }

    /// What is done in an iteration before contacts, in its order.
    pub fn constraints(self) -> impl Iterator<Item = Stage> + Clone {
        self.iteration.into_iter().flatten()
    }

    /// What is done in a pass over contacts, in its order.
    pub fn contacts(self) -> impl Iterator<Item = Stage> + Clone {
        self.contact.into_iter().flatten()
    }

    /// What is done in a substep, in its order, with the number of the iteration.
    pub fn stages(self, step: Substep) -> impl Iterator<Item = (Stage, u32)> + Clone {
        let Self { iteration, contact } = self;
        (0..step.sweeps()).flat_map(move |number| {
            let passes = (0..step.contacts_after(number)).flat_map(move |_| contact);
            let stages = iteration.into_iter().chain(passes).flatten();
            stages.map(move |stage| (stage, number))
        })
    }
}

impl Stage {
    /// Whether it does anything to a body that carries these effects, with stitches or without, by a
    /// method.
    #[must_use]
    pub fn acts(self, effects: &Effects, stitched: bool, method: Method) -> bool {
        match self {
            Self::Presolve | Self::Postsolve => true,
            Self::Force(kind) => effects.has_force(kind),
            Self::Elastic(kind) => effects.sweeps(kind, method),
            Self::Direct => effects.is_direct(method),
            Self::Body(kind) => effects.carries(kind, stitched),
            Self::Contact => effects.contact.is_some(),
            Self::SelfContact => effects.self_contact.is_some(),
            Self::Flow => effects.plasticity.is_some(),
        }
    }
}
