//! The stages of a substep, in their order.

use super::{method::Method, substep::Substep};
use crate::effects::{Effects, elastic::ElasticKind, force::ForceKind};

/// A part of a substep that can be ordered against.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// A force from outside, before the first stage.
    Force(ForceKind),
    /// Positions are predicted.
    Presolve,
    /// Sticky ground, at the end of the first stage.
    StickyGround,
    /// The constraints of an elastic effect.
    Elastic(ElasticKind),
    /// Particles are drawn to where the rest shape would have them.
    ShapeMatching,
    /// The pressure of what fills the body.
    Pressure,
    /// Stitches between points of the body, and to colliders.
    Stitches,
    /// All elastic effects that are solved directly.
    Direct,
    /// Tethers to pins.
    Tethers,
    /// The hold of a hand.
    Grab,
    /// Contact with other bodies.
    Contact,
    /// Contact of the body with itself.
    SelfContact,
    /// The ground.
    Ground,
    /// Colliders.
    Collide,
    /// Velocities are taken from positions.
    Postsolve,
    /// What is strained too far flows.
    Flow,
}

/// What takes part in a sweep before the elastic effects.
const BEFORE: [Stage; 1] = [Stage::Direct];

/// What takes part in a sweep after the elastic effects.
const AFTER: [Stage; 5] = [
    Stage::ShapeMatching,
    Stage::Pressure,
    Stage::Stitches,
    Stage::Tethers,
    Stage::Grab,
];

/// A pass over all contacts. Those of bodies are left to [`together`](super::together).
const CONTACTS: [Stage; 4] = [
    Stage::Contact,
    Stage::SelfContact,
    Stage::Ground,
    Stage::Collide,
];

impl Stage {
    /// What takes part in a sweep, in its order: what holds the body together, then hands. Contacts
    /// come after it.
    const SWEEP: [Self; BEFORE.len() + ElasticKind::COUNT + AFTER.len()] = {
        let after = BEFORE.len() + ElasticKind::COUNT;
        let mut all = [Self::Presolve; BEFORE.len() + ElasticKind::COUNT + AFTER.len()];
        let mut place = 0;
        while place < all.len() {
            all[place] = if place < BEFORE.len() {
                BEFORE[place]
            } else if place < after {
                Self::Elastic(ElasticKind::ALL[place - BEFORE.len()])
            } else {
                AFTER[place - after]
            };
            place += 1;
        }
        all
    };

    /// All of them, in the order of a substep.
    pub const ALL: [Self; ForceKind::COUNT + Self::SWEEP.len() + 4 + CONTACTS.len()] = {
        let mut all = [Self::Presolve; ForceKind::COUNT + Self::SWEEP.len() + 4 + CONTACTS.len()];
        let mut place = 0;
        while place < ForceKind::COUNT {
            all[place] = Self::Force(ForceKind::ALL[place]);
            place += 1;
        }
        all[place + 1] = Self::StickyGround;
        while place < ForceKind::COUNT + Self::SWEEP.len() {
            all[place + 2] = Self::SWEEP[place - ForceKind::COUNT];
            place += 1;
        }
        place += 2;
        let mut pass = 0;
        while pass < CONTACTS.len() {
            all[place + pass] = CONTACTS[pass];
            pass += 1;
        }
        all[place + pass] = Self::Postsolve;
        all[place + pass + 1] = Self::Flow;
        all
    };

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
            Self::StickyGround => "sticky_ground",
            Self::Elastic(kind) => kind.name(),
            Self::ShapeMatching => "shape_matching",
            Self::Pressure => "pressure",
            Self::Stitches => "stitches",
            Self::Direct => "direct",
            Self::Tethers => "tethers",
            Self::Grab => "grab",
            Self::Contact => "contact",
            Self::SelfContact => "self_contact",
            Self::Ground => "ground",
            Self::Collide => "collide",
            Self::Postsolve => "postsolve",
            Self::Flow => "plasticity",
        }
    }
}

/// The second stage of a body: what is absent is not asked for again in every sweep.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Solve {
    sweep: [Option<Stage>; Stage::SWEEP.len()],
    contacts: [Option<Stage>; CONTACTS.len()],
}

impl Solve {
    /// Of a body that carries these effects, with stitches or without, by a method.
    pub fn of(effects: &Effects, stitched: bool, method: Method) -> Self {
        let acts = |stage: &Stage| stage.acts(effects, stitched, method);
        let mut present = Stage::SWEEP.into_iter().filter(acts);
        Self {
            sweep: std::array::from_fn(|_| present.next()),
            contacts: CONTACTS.map(|stage| acts(&stage).then_some(stage)),
        }
    }

    /// What is done in an iteration before contacts, in its order.
    pub fn constraints(self) -> impl Iterator<Item = Stage> + Clone {
        self.sweep.into_iter().flatten()
    }

    /// What is done in a pass over contacts, in its order.
    pub fn contacts(self) -> impl Iterator<Item = Stage> + Clone {
        self.contacts.into_iter().flatten()
    }

    /// What is done in a substep, in its order, with the number of the sweep.
    pub fn stages(self, step: Substep) -> impl Iterator<Item = (Stage, u32)> + Clone {
        let Self { sweep, contacts } = self;
        (0..step.sweeps()).flat_map(move |iteration| {
            let passes = (0..step.contacts_after(iteration)).flat_map(move |_| contacts);
            let stages = sweep.into_iter().chain(passes).flatten();
            stages.map(move |stage| (stage, iteration))
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
            Self::StickyGround => effects.sticky_ground.is_some(),
            Self::Elastic(kind) => effects.sweeps(kind, method),
            Self::Direct => effects.is_direct(method),
            Self::ShapeMatching => effects.shape_matching.is_some(),
            Self::Pressure => effects.pressure.is_some(),
            Self::Stitches => stitched,
            Self::Tethers => effects.tethers.is_some(),
            Self::Grab => effects.grab.is_some(),
            Self::Contact => effects.contact.is_some(),
            Self::SelfContact => effects.self_contact.is_some(),
            Self::Ground => effects.ground.is_some(),
            Self::Collide => effects.collide.is_some(),
            Self::Flow => effects.plasticity.is_some(),
        }
    }
}
