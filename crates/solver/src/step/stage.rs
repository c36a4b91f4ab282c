//! The stages of a substep, in order.

use crate::{
    Damping, Effects, ForceKind, Method, Outside, Settings, Substep,
    effects::{
        body_effect::BodyPhase, body_kinds::BodyEffectKind, elastic_kind::ElasticKind, free::Free,
    },
    layout::order::Direction,
};
use std::cmp::Reverse;

/// A part of a substep; stages can be ordered relative to each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// A force of an app, before all fields.
    External,
    /// An app moves pins, after the first stage.
    Pins,
    /// A force field, before the first stage.
    Force(ForceKind),
    /// Positions are predicted.
    Presolve,
    /// The constraints of an elastic effect.
    Elastic(ElasticKind),
    /// An effect without elements.
    Body(BodyEffectKind),
    /// Several grabs of an app.
    Grabs,
    /// All elastic effects that are solved directly.
    Direct,
    /// Contact with other bodies.
    Contact,
    /// Contact of the body with itself.
    SelfContact,
    /// Stitches to other bodies, after the constraints of all bodies and before grabs and rods. They
    /// are left to `together`.
    Joints,
    /// Velocities are derived from positions.
    Postsolve,
    /// Plastic flow.
    Flow,
    /// Tearing, between ticks.
    Tear,
    /// Appearance and disappearance of grains, between ticks.
    Renew,
}

/// Number of effects without elements in a phase.
const fn count(phase: BodyPhase) -> usize {
    let (mut count, mut index) = (0, 0);
    while index < BodyEffectKind::ALL.len() {
        count += (BodyEffectKind::ALL[index].phase() as usize == phase as usize) as usize;
        index += 1;
    }
    count
}

/// Writes the effects without elements of a phase into `all`, from `place` on; returns the index
/// after them.
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

/// In an iteration: direct solver, elastic effects, grabs of an app, and others.
const ITERATION: usize =
    2 + ElasticKind::COUNT + count(BodyPhase::Iteration) + count(BodyPhase::IterationEnd);

/// In a contact pass. Contacts between bodies are left to `together`.
const CONTACT: usize = 2 + count(BodyPhase::Contact);

impl Stage {
    /// Stages of an iteration of a body without damping, in order: internal constraints, then grabs.
    /// Contacts follow it.
    const ITERATION: [Self; ITERATION] = {
        let mut all = [Self::Direct; ITERATION];
        let mut kind = 0;
        while kind < ElasticKind::COUNT {
            all[1 + kind] = Self::Elastic(ElasticKind::ALL[kind]);
            kind += 1;
        }
        let (mut all, place) = put(all, 1 + kind, BodyPhase::Iteration);
        all[place] = Self::Grabs;
        put(all, place + 1, BodyPhase::IterationEnd).0
    };

    /// Stages of a pass of a body with these effects, in order. Of the internal constraints those act
    /// first whose damping [lasts](Self::lasting) longest: damping that acted later would undo what
    /// the others have corrected, and they would correct it again in the next substep, which gains
    /// energy.
    pub(crate) fn iteration(effects: &Effects, direction: Direction) -> [Self; ITERATION] {
        let mut all = Self::ITERATION;
        let last = all.iter().rposition(|stage| stage.is_internal());
        let internal = &mut all[..=last.unwrap_or(0)];
        internal[1..].sort_by_key(|stage| Reverse(stage.lasting(effects)));
        if direction == Direction::Backward {
            internal.reverse();
        }
        all
    }

    /// The stage of a body with these effects in the place of this one, in a pass. A body has the places
    /// of its own stages.
    #[must_use]
    pub fn in_its_place(self, effects: &Effects, step: &Substep, iteration: u32) -> Self {
        if !self.is_internal() {
            return self;
        }
        let all = Self::iteration(effects, step.direction(iteration));
        if all == Self::ITERATION {
            return self;
        }
        let is_own = |stage: &Self| {
            stage.is_internal() && stage.acts(effects, Outside::default(), step.method)
        };
        let mut places = Self::ITERATION.into_iter().filter(is_own);
        let place = places.position(|stage| stage == self);
        let own = place.and_then(|place| all.into_iter().filter(is_own).nth(place));
        own.unwrap_or(self)
    }

    /// Whether it consists of internal constraints: those that have no torque.
    fn is_internal(self) -> bool {
        match self {
            Self::Direct | Self::Elastic(_) => true,
            Self::Body(kind) => kind.is_internal(),
            _ => false,
        }
    }

    /// How long the damping of internal constraints lasts, by the power of eight of τ: what is damped for
    /// about as long keeps its order. 0 without damping.
    fn lasting(self, effects: &Effects) -> u32 {
        let damping = match self {
            Self::Elastic(kind) => effects.damping(kind),
            Self::Body(BodyEffectKind::ShapeMatching) => {
                effects.shape_matching.map(|it| it.damping)
            }
            _ => None,
        };
        let exponent = damping.map_or(0.0, Damping::get).to_bits() >> (f32::MANTISSA_DIGITS - 1);
        exponent / 3
    }

    /// Stages of a contact pass in order.
    const CONTACT: [Self; CONTACT] = {
        let mut all = [Self::Contact; CONTACT];
        all[1] = Self::SelfContact;
        put(all, 2, BodyPhase::Contact).0
    };

    /// All stages, in the order of a substep.
    pub const ALL: [Self; ForceKind::COUNT + PREDICTION + ITERATION + CONTACT + 5] = {
        let mut all = [Self::Presolve; ForceKind::COUNT + PREDICTION + ITERATION + CONTACT + 5];
        all[0] = Self::External;
        let mut place = 1;
        while place <= ForceKind::COUNT {
            all[place] = Self::Force(ForceKind::ALL[place - 1]);
            place += 1;
        }
        all[place + 1] = Self::Pins;
        let (mut all, mut place) = put(all, place + 2, BodyPhase::Prediction);
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

    /// Stages at the end of the first stage, in order.
    pub(crate) fn prediction() -> impl Iterator<Item = Self> + Clone {
        let kinds = BodyEffectKind::ALL.iter().copied();
        let effects = kinds.filter(|kind| kind.phase() == BodyPhase::Prediction);
        std::iter::once(Self::Pins).chain(effects.map(Self::Body))
    }

    /// Index in [`Stage::ALL`].
    #[must_use]
    pub fn place(self) -> usize {
        Self::ALL
            .iter()
            .position(|stage| *stage == self)
            .unwrap_or(0)
    }

    /// Name of the stage or effect.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::External => "external_force",
            Self::Pins => "pin_targets",
            Self::Grabs => "grabs",
            Self::Force(kind) => kind.name(),
            Self::Presolve => "presolve",
            Self::Elastic(kind) => kind.name(),
            Self::Body(kind) => kind.name(),
            Self::Direct => "direct",
            Self::Contact => "contact",
            Self::SelfContact => "self_contact",
            Self::Joints => Self::Body(BodyEffectKind::Stitches).name(),
            Self::Postsolve => "postsolve",
            Self::Flow => "plasticity",
            Self::Tear => "tear",
            Self::Renew => "emitter",
        }
    }
}

/// What acts on a body in a substep.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Acting<'a> {
    pub effects: &'a Effects,
    /// What acts on it from outside.
    pub outside: Outside,
    /// The parts that keep their angular momentum.
    pub free: Free,
    /// The first and the last of the internal constraints in a pass, and in one without those that are
    /// solved directly.
    internal: [Option<[Stage; 2]>; 2],
}

impl<'a> Acting<'a> {
    /// For a body with these effects, on which this acts from outside, and of which these parts can rotate
    /// freely.
    pub fn of(effects: &'a Effects, outside: Outside, settings: &Settings, free: Free) -> Self {
        let free = if settings.keeps_spin() {
            free
        } else {
            Free::None
        };
        let ends = |iterates: bool| {
            let all = Stage::internal(effects, settings.method);
            let mut all =
                all.filter(|stage| free != Free::None && !(iterates && *stage == Stage::Direct));
            let first = all.next()?;
            Some([first, all.last().unwrap_or(first)])
        };
        Self {
            effects,
            outside,
            free,
            internal: [ends(false), ends(true)],
        }
    }

    /// Whether a stage begins and whether it ends the internal constraints of a pass.
    pub fn bounds(&self, stage: Stage, step: &Substep, iteration: u32) -> [bool; 2] {
        let iterates = step.ends_iteration(iteration).is_none();
        let Some([first, last]) = self.internal[usize::from(iterates)] else {
            return [false; 2];
        };
        match step.direction(iteration) {
            Direction::Forward => [first, last],
            Direction::Backward => [last, first],
        }
        .map(|end| end == stage)
    }
}

/// The second stage of a body; absent effects are not checked again in every iteration.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Solve {
    iteration: [Option<Stage>; ITERATION],
    /// Number of internal constraints among them, which come first.
    internal: usize,
    contact: [Option<Stage>; CONTACT],
}

impl Solve {
    /// For a body with these effects, on which this acts from outside, and a method.
    pub fn of(effects: &Effects, outside: Outside, method: Method) -> Self {
        let acts = |stage: &Stage| stage.acts(effects, outside, method);
        let all = Stage::iteration(effects, Direction::Forward);
        let mut present = all.into_iter().filter(acts);
        let iteration = std::array::from_fn(|_| present.next());
        let is_internal = |stage: &&Stage| stage.is_internal();
        Self {
            iteration,
            internal: iteration.iter().flatten().filter(is_internal).count(),
            contact: Stage::CONTACT.map(|stage| acts(&stage).then_some(stage)),
        }
    }

    /// Stages of a pass before contacts, in order.
    pub fn constraints(self, direction: Direction) -> impl Iterator<Item = Stage> + Clone {
        let Self {
            iteration,
            internal,
            ..
        } = self;
        let places = direction.of(0..internal).chain(internal..ITERATION);
        places.filter_map(move |place| iteration[place])
    }

    /// Stages of a contact pass, in order.
    pub fn contacts(self) -> impl Iterator<Item = Stage> + Clone {
        self.contact.into_iter().flatten()
    }

    /// Stages of a substep, in order, with the number of the iteration.
    pub fn stages(self, step: Substep) -> impl Iterator<Item = (Stage, u32)> + Clone {
        (0..step.total_iterations()).flat_map(move |number| {
            let passes = (0..step.contacts_after(number)).flat_map(move |_| self.contacts());
            let stages = self.constraints(step.direction(number)).chain(passes);
            stages.map(move |stage| (stage, number))
        })
    }
}

impl Stage {
    /// The internal constraints of an iteration, in order.
    pub(crate) fn internal(effects: &Effects, method: Method) -> impl Iterator<Item = Self> {
        let all = Self::iteration(effects, Direction::Forward).into_iter();
        let outside = Outside::default();
        all.filter(move |stage| stage.is_internal() && stage.acts(effects, outside, method))
    }

    /// Whether it follows [`Joints`](Self::Joints) in an iteration.
    pub(crate) fn is_after_joints(self) -> bool {
        match self {
            Self::Grabs => true,
            Self::Body(kind) => kind.phase() == BodyPhase::IterationEnd,
            _ => false,
        }
    }

    /// Whether it affects a body with these effects, on which this acts from outside, under a method.
    #[must_use]
    pub fn acts(self, effects: &Effects, outside: Outside, method: Method) -> bool {
        match self {
            Self::Presolve | Self::Postsolve => true,
            Self::External => outside.pushed,
            Self::Pins => outside.steered,
            Self::Grabs => outside.grabbed,
            Self::Force(kind) => effects.has_force(kind),
            Self::Elastic(kind) => effects.iterates(kind, method),
            Self::Direct => effects.is_direct(method),
            // Contacts of rigid bodies act on the whole body, in `contact`.
            Self::Body(BodyEffectKind::Ground | BodyEffectKind::Collide) if effects.is_rigid() => {
                false
            }
            Self::Body(kind) => effects.carries(kind, outside.stitched),
            Self::Contact => effects.contact.is_some(),
            Self::SelfContact => effects.self_contact.is_some(),
            Self::Flow => effects.plasticity.is_some(),
            // They act between bodies, or between ticks.
            Self::Joints | Self::Tear | Self::Renew => false,
        }
    }
}
