//! What a user does to the simulation, as data: carried out between ticks, in the order given.
//!
//! Hands, panel and keys all act through this list, so that nothing changes in the middle of a
//! tick and everything can be written down.

mod perform;
mod setting;

pub use perform::perform;
pub use setting::{SETTINGS, setting};

use super::{SimulationClock, SpawnOrder};
use crate::{
    mesh::Skin,
    solver::{Body, Deformation, Density, InvalidValue, ParticleIndex, SurfacePoint, VertexIndex},
};
use bevy::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A body that comes into a running scene.
#[derive(Debug, Clone, PartialEq)]
pub struct NewBody {
    /// The body where it is put, with all that it carries.
    pub body: Body,
    /// The fine surface that follows it, if it has one.
    pub skin: Option<Arc<Skin>>,
}

/// One thing that a user does. Bodies are named by their entities, or by whatever else `B` is: in
/// files by their [`SpawnOrder`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Action<B = Entity> {
    /// Takes hold of a body at a point and pulls it to a target [m].
    Grab {
        /// The body.
        body: B,
        /// The point of its surface.
        point: SurfacePoint,
        /// Where it is pulled to [m].
        target: Vec3,
    },
    /// Moves the hand [m].
    MoveGrab {
        /// The body that is held.
        body: B,
        /// Where it is pulled to [m].
        target: Vec3,
    },
    /// Lets go; the body keeps its speed.
    Release {
        /// The body that is held.
        body: B,
    },
    /// Sets a parameter of an effect that the body carries, in the parameter's unit.
    SetParameter {
        /// The body.
        body: B,
        /// Name of the effect.
        effect: String,
        /// Name of the parameter.
        parameter: String,
        /// The new value.
        value: f64,
    },
    /// Adds an effect with its default parameters, unless the body carries it already.
    AddEffect {
        /// The body.
        body: B,
        /// Name of the effect.
        effect: String,
    },
    /// Takes an effect away.
    RemoveEffect {
        /// The body.
        body: B,
        /// Name of the effect.
        effect: String,
    },
    /// Makes a body heavier or lighter.
    SetDensity {
        /// The body.
        body: B,
        /// Mass per measure [kg/m³ of a solid, kg/m² of a cloth, kg/m of a rope].
        density: Density,
    },
    /// Sets one of [`SETTINGS`].
    SetSetting {
        /// Its name.
        name: String,
        /// The new value.
        value: f64,
    },
    /// Holds a particle where it is.
    Pin {
        /// The body.
        body: B,
        /// The vertex of its rest shape.
        vertex: VertexIndex,
    },
    /// Lets a particle move again.
    Unpin {
        /// The body.
        body: B,
        /// The vertex of its rest shape.
        vertex: VertexIndex,
    },
    /// Puts a body into a hard case.
    Deform {
        /// The body.
        body: B,
        /// How.
        deformation: Deformation,
    },
    /// Lets a body that was put in quarantine go on from its last good state: where the tick began
    /// in which it turned non-finite, at rest.
    Restore {
        /// The body.
        body: B,
    },
    /// Puts a new body into the scene. Text has no form of it: it comes with its mesh.
    #[serde(skip)]
    Spawn(Arc<NewBody>),
    /// Takes a body away.
    Despawn {
        /// The body.
        body: B,
    },
}

impl<B> Action<B> {
    /// The body that it is done to, if it is done to one that is there.
    #[must_use]
    pub fn body(&self) -> Option<&B> {
        match self {
            Self::SetSetting { .. } | Self::Spawn(_) => None,
            Self::Grab { body, .. }
            | Self::MoveGrab { body, .. }
            | Self::Release { body }
            | Self::SetParameter { body, .. }
            | Self::AddEffect { body, .. }
            | Self::RemoveEffect { body, .. }
            | Self::SetDensity { body, .. }
            | Self::Pin { body, .. }
            | Self::Unpin { body, .. }
            | Self::Deform { body, .. }
            | Self::Restore { body }
            | Self::Despawn { body } => Some(body),
        }
    }

    /// The same with the body called by another name; `None` if it has no such name.
    pub fn renamed<C>(self, name: impl FnOnce(B) -> Option<C>) -> Option<Action<C>> {
        Some(match self {
            Self::Grab {
                body,
                point,
                target,
            } => Action::Grab {
                body: name(body)?,
                point,
                target,
            },
            Self::MoveGrab { body, target } => Action::MoveGrab {
                body: name(body)?,
                target,
            },
            Self::Release { body } => Action::Release { body: name(body)? },
            Self::SetParameter {
                body,
                effect,
                parameter,
                value,
            } => Action::SetParameter {
                body: name(body)?,
                effect,
                parameter,
                value,
            },
            Self::AddEffect { body, effect } => Action::AddEffect {
                body: name(body)?,
                effect,
            },
            Self::RemoveEffect { body, effect } => Action::RemoveEffect {
                body: name(body)?,
                effect,
            },
            Self::SetDensity { body, density } => Action::SetDensity {
                body: name(body)?,
                density,
            },
            Self::SetSetting { name, value } => Action::SetSetting { name, value },
            Self::Pin { body, vertex } => Action::Pin {
                body: name(body)?,
                vertex,
            },
            Self::Unpin { body, vertex } => Action::Unpin {
                body: name(body)?,
                vertex,
            },
            Self::Deform { body, deformation } => Action::Deform {
                body: name(body)?,
                deformation,
            },
            Self::Restore { body } => Action::Restore { body: name(body)? },
            Self::Spawn(new) => Action::Spawn(new),
            Self::Despawn { body } => Action::Despawn { body: name(body)? },
        })
    }
}

/// Why an action was not carried out.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ActionError {
    /// The entity is gone, or was never a body.
    #[error("no such body ({0}): it may have been removed")]
    NoBody(Entity),
    /// There is nothing to restore.
    #[error("the body is not in quarantine: there is nothing to restore")]
    NotInQuarantine,
    /// A value of a parameter out of range.
    #[error("{parameter}: {error}")]
    Parameter {
        /// Effect and parameter.
        parameter: String,
        /// What is wrong with the value.
        error: InvalidValue,
    },
    /// A value of a setting out of range.
    #[error(transparent)]
    Setting(InvalidValue),
    /// An unknown word.
    #[error("unknown {kind} “{name}”; expected one of: {valid}")]
    Unknown {
        /// Effect, parameter or setting.
        kind: &'static str,
        /// What was asked for.
        name: String,
        /// The valid choices.
        valid: String,
    },
    /// The body does not carry the effect.
    #[error("the body does not carry the effect {0}")]
    Absent(String),
    /// The effect cannot do anything to the body.
    #[error("cannot add {effect} to the body: {reason}")]
    Unfit {
        /// The effect.
        effect: String,
        /// Why not, and what to do.
        reason: String,
    },
    /// The vertex does not exist.
    #[error("no vertex {vertex}: the number of vertices of the body is {vertices}")]
    NoVertex {
        /// The vertex that was named.
        vertex: VertexIndex,
        /// How many there are.
        vertices: usize,
    },
    /// The particle does not exist.
    #[error("no particle {particle}: the number of particles of the body is {particles}")]
    NoParticle {
        /// The particle that was named.
        particle: ParticleIndex,
        /// How many there are.
        particles: usize,
    },
}

/// What users did since the last tick.
#[derive(Resource, Debug, Default)]
pub struct Actions {
    waiting: Vec<Action>,
    errors: Vec<ActionError>,
}

impl Actions {
    /// Adds an action; it is carried out before the next tick begins.
    pub fn push(&mut self, action: Action) {
        self.waiting.push(action);
    }

    /// Takes the errors of actions that could not be carried out.
    pub fn take_errors(&mut self) -> Vec<ActionError> {
        std::mem::take(&mut self.errors)
    }
}

/// An action was carried out before this tick. A message, and an event that observers hear at once.
#[derive(Message, Event, Debug, Clone, PartialEq)]
pub struct Applied {
    /// The tick that was about to begin.
    pub tick: u64,
    /// The action.
    pub action: Action,
    /// The place of the body that it was done to, which may be gone now.
    pub place: Option<SpawnOrder>,
}

/// Carries out what waits, unless a tick is under way.
pub fn apply(world: &mut World) {
    let clock = world.resource::<SimulationClock>();
    if clock.mid_tick() || world.resource::<Actions>().waiting.is_empty() {
        return;
    }
    let tick = clock.tick();
    let waiting = std::mem::take(&mut world.resource_mut::<Actions>().waiting);
    for action in waiting {
        let body = action.body().and_then(|&body| world.get_entity(body).ok());
        let place = body.and_then(|body| body.get::<SpawnOrder>().copied());
        match perform(world, &action) {
            Ok(()) => {
                let applied = Applied {
                    tick,
                    action,
                    place,
                };
                world.trigger(applied.clone());
                world.write_message(applied);
            }
            Err(error) => world.resource_mut::<Actions>().errors.push(error),
        }
    }
}
