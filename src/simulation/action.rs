//! Actions on the simulation, as data: carried out between ticks, in order.
//!
//! Pointer, panel and keys all act through this list, so that nothing changes in the middle of a
//! tick and all actions can be recorded.

mod collider;
mod grab;
mod perform;
mod setting;

pub use setting::{SETTINGS, setting};

use super::{SimulationClock, SpawnOrder};
use crate::{
    effect::OwnEffect,
    mesh::Skin,
    solver::{
        Body, ColliderShape, Controls, Cut, Density, GroupName, InvalidValue, ParticleIndex, Pose,
        SurfacePoint, VertexIndex, deform::Deformation,
    },
    suggestion::similar,
};
use bevy::prelude::*;
use serde::{Deserialize, Serialize};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

/// A body that is added to a running scene.
#[derive(Debug, Clone, PartialEq)]
pub struct NewBody {
    /// The body in its initial pose, with all its effects of the crate.
    pub body: Body,
    /// Its skin, if it has one.
    pub skin: Option<Arc<Skin>>,
    /// Its effects of an app; in most cases none.
    pub own: Vec<OwnEffect>,
}

/// An action of a user. `B` identifies the body: an entity, or a [`SpawnOrder`] in files.
///
/// ```
/// use bevy::prelude::*;
/// use pliant::prelude::*;
///
/// /// Lets go of the first vertex of each body.
/// fn let_go(bodies: Query<Entity, With<SoftBody>>, mut actions: ResMut<Actions>) {
///     for body in &bodies {
///         actions.push(Action::Unpin { body, vertex: VertexIndex(0) });
///     }
/// }
/// # bevy::ecs::system::assert_is_system(let_go);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Action<B = Entity> {
    /// Grabs a body at a point and pulls it to a target [m].
    Grab {
        /// The body.
        body: B,
        /// The point of its surface.
        point: SurfacePoint,
        /// Target [m].
        target: Vec3,
    },
    /// Grabs a patch of a body and pulls it to a target [m].
    Brush {
        /// The body.
        body: B,
        /// The point of its surface in the middle of the patch.
        point: SurfacePoint,
        /// Target of the weighted mean of the patch [m].
        target: Vec3,
        /// Radius of the patch at rest [m]; 0 grabs the point alone.
        radius: f32,
        /// Stiffness relative to that of [`Grab`](Self::Grab), 0.001 to 1000.
        stiffness: f32,
    },
    /// Grabs a pinned vertex, and the pins that are connected to it by edges between pins.
    GrabPins {
        /// The body.
        body: B,
        /// The vertex of its rest shape.
        vertex: VertexIndex,
    },
    /// Moves grabbed pins at constant velocity.
    MovePins {
        /// The body.
        body: B,
        /// Target of the vertex that was grabbed [m].
        target: Vec3,
        /// Simulated time of the motion [s]; at least one tick.
        seconds: f32,
    },
    /// Moves the target of the grab [m].
    MoveGrab {
        /// The grabbed body.
        body: B,
        /// Target [m].
        target: Vec3,
    },
    /// Releases the grab; the body keeps its velocity.
    Release {
        /// The grabbed body.
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
    /// Chooses the group of vertices on which the forces of a body with a force mask act.
    SetForceGroup {
        /// The body.
        body: B,
        /// Name of the group; empty for the whole body.
        group: GroupName,
    },
    /// Adds an effect with its default parameters, unless the body carries it already.
    AddEffect {
        /// The body.
        body: B,
        /// Name of the effect.
        effect: String,
    },
    /// Removes an effect.
    RemoveEffect {
        /// The body.
        body: B,
        /// Name of the effect.
        effect: String,
    },
    /// Sets the density of a body.
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
    /// Pins a vertex at its current position.
    Pin {
        /// The body.
        body: B,
        /// The vertex of its rest shape.
        vertex: VertexIndex,
    },
    /// Unpins a vertex.
    Unpin {
        /// The body.
        body: B,
        /// The vertex of its rest shape.
        vertex: VertexIndex,
    },
    /// Sets what an app does to a body, instead of what it did: its force, impulse, targets of pins and
    /// grabs. Recordings write it where the components have changed.
    Control {
        /// The body.
        body: B,
        /// All that the app does to it.
        controls: Box<Controls>,
    },
    /// Cuts a body where a wedge crosses it; one that misses it changes nothing.
    Cut {
        /// The body.
        body: B,
        /// The wedge.
        cut: Cut,
    },
    /// Deforms a body, to test its recovery.
    Deform {
        /// The body.
        body: B,
        /// The deformation.
        deformation: Deformation,
    },
    /// Returns a body to its rest shape at its present place and mean orientation, at rest. Pinned
    /// vertices stay.
    ResetShape {
        /// The body.
        body: B,
    },
    /// Restores a body in quarantine from its last finite state: that at the start of the tick in
    /// which it diverged, at rest.
    Restore {
        /// The body.
        body: B,
    },
    /// Adds a body to the scene. Not serialized as text, as it contains the mesh.
    #[serde(skip)]
    Spawn(Arc<NewBody>),
    /// Removes a body.
    Despawn {
        /// The body.
        body: B,
    },
    /// Adds a static collider to the scene.
    AddCollider {
        /// Its shape.
        shape: ColliderShape,
        /// Its pose.
        pose: Pose,
    },
    /// Moves a collider at constant velocity, which replaces its path.
    SetCollider {
        /// The collider.
        collider: B,
        /// Its new shape; `None` does not change it.
        shape: Option<ColliderShape>,
        /// Pose at the end of the motion.
        pose: Pose,
        /// Simulated time of the motion [s]; at least one tick.
        seconds: f32,
    },
    /// Removes a collider.
    RemoveCollider {
        /// The collider.
        collider: B,
    },
}

impl<B> Action<B> {
    /// The existing body or collider that the action applies to, if there is one.
    #[must_use]
    pub fn subject(&self) -> Option<&B> {
        match self {
            Self::SetCollider { collider, .. } | Self::RemoveCollider { collider } => {
                Some(collider)
            }
            _ => self.body(),
        }
    }

    /// The existing body that the action applies to, if there is one.
    #[must_use]
    pub fn body(&self) -> Option<&B> {
        match self {
            Self::SetSetting { .. }
            | Self::Spawn(_)
            | Self::AddCollider { .. }
            | Self::SetCollider { .. }
            | Self::RemoveCollider { .. } => None,
            Self::Grab { body, .. }
            | Self::Brush { body, .. }
            | Self::GrabPins { body, .. }
            | Self::MovePins { body, .. }
            | Self::MoveGrab { body, .. }
            | Self::Release { body }
            | Self::SetParameter { body, .. }
            | Self::SetForceGroup { body, .. }
            | Self::AddEffect { body, .. }
            | Self::RemoveEffect { body, .. }
            | Self::SetDensity { body, .. }
            | Self::Pin { body, .. }
            | Self::Unpin { body, .. }
            | Self::Control { body, .. }
            | Self::Cut { body, .. }
            | Self::Deform { body, .. }
            | Self::ResetShape { body }
            | Self::Restore { body }
            | Self::Despawn { body } => Some(body),
        }
    }

    /// The same action with another identifier of the body or collider; `None` if it has none.
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
            Self::Brush {
                body,
                point,
                target,
                radius,
                stiffness,
            } => Action::Brush {
                body: name(body)?,
                point,
                target,
                radius,
                stiffness,
            },
            Self::GrabPins { body, vertex } => Action::GrabPins {
                body: name(body)?,
                vertex,
            },
            Self::MovePins {
                body,
                target,
                seconds,
            } => Action::MovePins {
                body: name(body)?,
                target,
                seconds,
            },
            Self::AddCollider { shape, pose } => Action::AddCollider { shape, pose },
            Self::SetCollider {
                collider,
                shape,
                pose,
                seconds,
            } => Action::SetCollider {
                collider: name(collider)?,
                shape,
                pose,
                seconds,
            },
            Self::RemoveCollider { collider } => Action::RemoveCollider {
                collider: name(collider)?,
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
            Self::SetForceGroup { body, group } => Action::SetForceGroup {
                body: name(body)?,
                group,
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
            Self::Control { body, controls } => Action::Control {
                body: name(body)?,
                controls,
            },
            Self::Cut { body, cut } => Action::Cut {
                body: name(body)?,
                cut,
            },
            Self::Deform { body, deformation } => Action::Deform {
                body: name(body)?,
                deformation,
            },
            Self::ResetShape { body } => Action::ResetShape { body: name(body)? },
            Self::Restore { body } => Action::Restore { body: name(body)? },
            Self::Spawn(new) => Action::Spawn(new),
            Self::Despawn { body } => Action::Despawn { body: name(body)? },
        })
    }
}

/// Reason why an action was not carried out.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ActionError {
    /// The entity does not exist or is not a body.
    #[error("no such body ({0}): it may have been removed")]
    NoBody(Entity),
    /// The entity does not exist or is not a collider.
    #[error("no such collider ({0}): it may have been removed")]
    NoCollider(Entity),
    /// A number is out of range.
    #[error(transparent)]
    Value(InvalidValue),
    /// The vertex is not pinned.
    #[error("vertex {0} is not pinned: pin it before it is dragged as a pin")]
    NotPinned(VertexIndex),
    /// A point or a vertex is not one of the body, or a force is not finite.
    #[error(
        "the controls are not those of the body: expected its points and vertices, and finite forces"
    )]
    Controls,
    /// A cut is not finite, or its rays are parallel.
    #[error("the cut has no area: expected two finite rays that are not parallel")]
    Cut,
    /// The body is not in quarantine.
    #[error("the body is not in quarantine: there is nothing to restore")]
    NotInQuarantine,
    /// The value of a parameter is out of range.
    #[error("{parameter}: {error}")]
    Parameter {
        /// Effect and parameter.
        parameter: String,
        /// The error of the value.
        error: InvalidValue,
    },
    /// The value of a setting is out of range.
    #[error(transparent)]
    Setting(InvalidValue),
    /// A name is unknown.
    #[error("unknown {kind} “{name}”{}; expected one of: {valid}", similar(.name, .valid))]
    Unknown {
        /// Kind of name: effect, parameter, setting or group.
        kind: &'static str,
        /// The given name.
        name: String,
        /// The valid choices.
        valid: String,
    },
    /// The body does not carry the effect.
    #[error("the body does not carry the effect {0}")]
    Absent(String),
    /// The effect cannot act on the body.
    #[error("cannot add {effect} to the body: {reason}")]
    Unfit {
        /// The effect.
        effect: String,
        /// The reason, and what to do.
        reason: String,
    },
    /// With this value of a parameter the effect cannot act on the body.
    #[error("cannot change {parameter}: {reason}")]
    UnfitParameter {
        /// Effect and parameter.
        parameter: String,
        /// The reason, and what to do.
        reason: String,
    },
    /// The vertex does not exist.
    #[error("no vertex {vertex}: the number of vertices of the body is {vertices}")]
    NoVertex {
        /// The given vertex.
        vertex: VertexIndex,
        /// Number of vertices.
        vertices: usize,
    },
    /// The particle does not exist.
    #[error("no particle {particle}: the number of particles of the body is {particles}")]
    NoParticle {
        /// The given particle.
        particle: ParticleIndex,
        /// Number of particles.
        particles: usize,
    },
}

/// Actions of users since the last tick.
///
/// ```
/// use bevy::prelude::*;
/// use pliant::prelude::*;
///
/// /// Makes all bodies softer: 1e-3 m/N.
/// fn soften(bodies: Query<Entity, With<SoftBody>>, mut actions: ResMut<Actions>) {
///     for body in &bodies {
///         actions.push(Action::SetParameter {
///             body,
///             effect: "stretch".into(),
///             parameter: "compliance".into(),
///             value: 1e-3,
///         });
///     }
/// }
/// # bevy::ecs::system::assert_is_system(soften);
/// ```
#[derive(Resource, Debug, Default)]
pub struct Actions {
    waiting: Vec<Action>,
    /// When the first of them was added.
    since: Option<Instant>,
    errors: Vec<ActionError>,
}

impl Actions {
    /// Adds an action, to be carried out before the next tick begins.
    pub fn push(&mut self, action: Action) {
        self.since.get_or_insert_with(Instant::now);
        self.waiting.push(action);
    }

    /// Real time for which the first pending action has waited; `None` without one.
    #[must_use]
    pub fn waited(&self) -> Option<Duration> {
        self.since.map(|since| since.elapsed())
    }

    /// Carries out pending actions, unless a tick is under way. Returns whether there were any.
    pub fn apply(world: &mut World) -> bool {
        let clock = world.resource::<SimulationClock>();
        if clock.mid_tick() || world.resource::<Actions>().waiting.is_empty() {
            return false;
        }
        let tick = clock.tick();
        let mut actions = world.resource_mut::<Actions>();
        actions.since = None;
        let waiting = std::mem::take(&mut actions.waiting);
        for action in waiting {
            let body = action
                .subject()
                .and_then(|&body| world.get_entity(body).ok());
            let place = body.and_then(|body| body.get::<SpawnOrder>().copied());
            world.trigger(Applying(action.clone()));
            world.flush();
            match action.perform(world) {
                Ok(()) => {
                    let applied = Applied {
                        tick,
                        action,
                        place,
                    };
                    world.trigger(applied.clone());
                    world.flush();
                    world.write_message(applied);
                }
                Err(error) => {
                    log::warn!("an action was not carried out: {error}");
                    let errors = &mut world.resource_mut::<Actions>().errors;
                    // An app may never take them.
                    if errors.len() >= MAX_ERRORS {
                        errors.remove(0);
                    }
                    errors.push(error);
                }
            }
        }
        true
    }

    /// Takes the errors of rejected actions.
    pub fn take_errors(&mut self) -> Vec<ActionError> {
        std::mem::take(&mut self.errors)
    }
}

/// An action is about to be carried out, unless it is rejected. Observers, and the commands that
/// they queue, see the state before it.
#[derive(Event, Debug, Clone, PartialEq)]
pub struct Applying(pub Action);

/// An action was carried out before this tick. Both a message and an event for observers.
#[derive(Message, Event, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Applied {
    /// The tick that follows.
    pub tick: u64,
    /// The action.
    pub action: Action,
    /// Spawn order of the body that it applies to, which may no longer exist.
    pub place: Option<SpawnOrder>,
}

/// Number of errors of actions that are kept until they are read.
const MAX_ERRORS: usize = 100;

/// Carries out pending actions, unless a tick is under way.
pub(super) fn apply_pending(world: &mut World) {
    Actions::apply(world);
}
