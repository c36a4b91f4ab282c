//! What a user does to the simulation, as data: carried out between ticks, in the order given.
//!
//! Hands, panel and keys all act through this list, so that nothing changes in the middle of a
//! tick and everything can be written down.

use super::{
    Asleep, Pins, Quarantined, RestTimer, SimulationClock, SimulationSettings, SoftBody, TickStart,
};
use crate::{
    effect::EffectRegistry,
    solver::{
        Deformation, Grab, InvalidValue, Iterations, Particles, Rate, Substeps, SurfacePoint,
        deform,
    },
};
use bevy::prelude::*;

/// One thing that a user does.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Takes hold of a body at a point and pulls it to a target [m].
    Grab {
        /// The body.
        body: Entity,
        /// The point of its surface.
        point: SurfacePoint,
        /// Where it is pulled to [m].
        target: Vec3,
    },
    /// Moves the hand [m].
    MoveGrab {
        /// The body that is held.
        body: Entity,
        /// Where it is pulled to [m].
        target: Vec3,
    },
    /// Lets go; the body keeps its speed.
    Release {
        /// The body that is held.
        body: Entity,
    },
    /// Sets a parameter of an effect that the body carries, in the parameter's unit.
    SetParameter {
        /// The body.
        body: Entity,
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
        body: Entity,
        /// Name of the effect.
        effect: String,
    },
    /// Takes an effect away.
    RemoveEffect {
        /// The body.
        body: Entity,
        /// Name of the effect.
        effect: String,
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
        body: Entity,
        /// The vertex of its rest shape.
        vertex: u32,
    },
    /// Lets a particle move again.
    Unpin {
        /// The body.
        body: Entity,
        /// The vertex of its rest shape.
        vertex: u32,
    },
    /// Puts a body into a hard case.
    Deform {
        /// The body.
        body: Entity,
        /// How.
        deformation: Deformation,
    },
    /// Takes a body away.
    Despawn {
        /// The body.
        body: Entity,
    },
}

/// Why an action was not carried out.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ActionError {
    /// The entity is gone, or was never a body.
    #[error("there is no such body any more ({0})")]
    NoBody(Entity),
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
    #[error("there is no {kind} called “{name}”; there are: {valid}")]
    Unknown {
        /// Effect, parameter or setting.
        kind: &'static str,
        /// What was asked for.
        name: String,
        /// The valid choices.
        valid: String,
    },
    /// The body does not carry the effect.
    #[error("the body does not carry {0}")]
    Absent(String),
    /// The particle does not exist.
    #[error("there is no particle {particle}; the body has {particles}")]
    NoParticle {
        /// The particle that was named.
        particle: u32,
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

/// An action was carried out before this tick.
#[derive(Message, Debug, Clone, PartialEq)]
pub struct Applied {
    /// The tick that was about to begin.
    pub tick: u64,
    /// The action.
    pub action: Action,
}

/// Carries out what waits, unless a tick is under way.
pub(super) fn apply(world: &mut World) {
    let clock = world.resource::<SimulationClock>();
    if clock.mid_tick() || world.resource::<Actions>().waiting.is_empty() {
        return;
    }
    let tick = clock.tick();
    let waiting = std::mem::take(&mut world.resource_mut::<Actions>().waiting);
    for action in waiting {
        match perform(world, &action) {
            Ok(()) => {
                world.write_message(Applied { tick, action });
            }
            Err(error) => world.resource_mut::<Actions>().errors.push(error),
        }
    }
}

/// Carries out one action at once.
///
/// # Errors
/// [`ActionError`] if the body, effect, parameter, setting or particle does not exist, or the
/// value is out of its range; nothing has changed then.
pub fn perform(world: &mut World, action: &Action) -> Result<(), ActionError> {
    match action {
        Action::SetSetting { name, value } => set_setting(world, name, *value),
        Action::SetParameter {
            body,
            effect,
            parameter,
            value,
        } => set_parameter(world, *body, effect, parameter, *value),
        Action::AddEffect { body, effect } => {
            let info = find_effect(world, effect)?;
            let (present, add) = (info.present, info.insert_default);
            let mut entity = body_mut(world, *body)?;
            if present(&EntityRef::from(&entity)) {
                Ok(())
            } else if let Some(add) = add {
                add(&mut entity);
                wake(&mut entity);
                Ok(())
            } else {
                Err(ActionError::Absent(effect.clone()))
            }
        }
        Action::RemoveEffect { body, effect } => {
            let remove = find_effect(world, effect)?.remove;
            let mut entity = body_mut(world, *body)?;
            remove(&mut entity);
            wake(&mut entity);
            Ok(())
        }
        Action::Grab {
            body,
            point,
            target,
        } => grab(world, *body, *point, *target),
        Action::MoveGrab { body, target } => {
            let mut entity = body_mut(world, *body)?;
            if let Some(mut grab) = entity.get_mut::<Grab>()
                && target.is_finite()
            {
                grab.target = *target;
            }
            Ok(())
        }
        Action::Release { body } => {
            body_mut(world, *body)?.remove::<Grab>();
            Ok(())
        }
        Action::Pin { body, vertex } => change_pins(world, *body, *vertex, true),
        Action::Unpin { body, vertex } => change_pins(world, *body, *vertex, false),
        Action::Deform { body, deformation } => {
            let mut entity = body_mut(world, *body)?;
            if let Some(mut particles) = entity.get_mut::<Particles>() {
                deform(&mut particles, *deformation);
                let positions = particles.positions.clone();
                entity.insert(TickStart(positions));
            }
            entity.remove::<Quarantined>();
            wake(&mut entity);
            Ok(())
        }
        Action::Despawn { body } => {
            body_mut(world, *body)?.despawn();
            Ok(())
        }
    }
}

fn body_mut(world: &mut World, body: Entity) -> Result<EntityWorldMut<'_>, ActionError> {
    world
        .get_entity_mut(body)
        .ok()
        .filter(|entity| entity.contains::<SoftBody>())
        .ok_or(ActionError::NoBody(body))
}

fn wake(entity: &mut EntityWorldMut) {
    entity.remove::<Asleep>().insert(RestTimer::default());
}

fn find_effect<'w>(
    world: &'w World,
    name: &str,
) -> Result<&'w crate::effect::EffectInfo, ActionError> {
    let registry = world.resource::<EffectRegistry>();
    registry.get(name).ok_or_else(|| ActionError::Unknown {
        kind: "effect",
        name: name.to_owned(),
        valid: registry.names(),
    })
}

fn set_parameter(
    world: &mut World,
    body: Entity,
    effect: &str,
    parameter: &str,
    value: f64,
) -> Result<(), ActionError> {
    let info = find_effect(world, effect)?;
    let index = info
        .parameter(parameter)
        .ok_or_else(|| ActionError::Unknown {
            kind: "parameter",
            name: format!("{effect}.{parameter}"),
            valid: info.parameter_names(),
        })?;
    let set = info.set;
    let mut entity = body_mut(world, body)?;
    match set(&mut entity, index, value) {
        Some(Ok(())) => Ok(()),
        Some(Err(error)) => Err(ActionError::Parameter {
            parameter: format!("{effect}.{parameter}"),
            error,
        }),
        None => Err(ActionError::Absent(effect.to_owned())),
    }
}

fn grab(
    world: &mut World,
    body: Entity,
    point: SurfacePoint,
    target: Vec3,
) -> Result<(), ActionError> {
    let gravity = world.resource::<SimulationSettings>().gravity.length();
    let mut entity = body_mut(world, body)?;
    let (Some(particles), Some(topology)) = (entity.get::<Particles>(), entity.get::<SoftBody>())
    else {
        return Err(ActionError::NoBody(body));
    };
    if !target.is_finite() || !point.fits(particles.len()) {
        return Err(ActionError::NoParticle {
            particle: point.nearest(),
            particles: particles.len(),
        });
    }
    let mass: f32 = particles
        .positions
        .iter()
        .filter(|x| x.w > 0.0)
        .map(|x| 1.0 / x.w)
        .sum();
    let grab = Grab::on(point, target, mass, topology.size, gravity);
    entity.insert(grab);
    wake(&mut entity);
    Ok(())
}

fn change_pins(
    world: &mut World,
    body: Entity,
    vertex: u32,
    pinned: bool,
) -> Result<(), ActionError> {
    let mut entity = body_mut(world, body)?;
    let particles = entity.get::<Particles>().map_or(0, Particles::len);
    if vertex as usize >= particles {
        return Err(ActionError::NoParticle {
            particle: vertex,
            particles,
        });
    }
    if let Some(mut pins) = entity.get_mut::<Pins>() {
        pins.0.retain(|&pin| pin != vertex);
        if pinned {
            pins.0.push(vertex);
        }
    }
    wake(&mut entity);
    Ok(())
}

/// Names, units and meanings of the settings that [`Action::SetSetting`] reaches.
pub const SETTINGS: [(&str, &str, &str); 6] = [
    ("gravity_x", "m/s²", "gravity to the right"),
    ("gravity_y", "m/s²", "gravity upwards"),
    ("gravity_z", "m/s²", "gravity towards the viewer"),
    ("rate", "1/s", "ticks a second"),
    ("substeps", "", "substeps a tick"),
    ("iterations", "", "sweeps over all constraints a substep"),
];

/// The value of a setting by its name.
#[must_use]
pub fn setting(settings: &crate::solver::Settings, name: &str) -> Option<f64> {
    Some(match name {
        "gravity_x" => settings.gravity.x.into(),
        "gravity_y" => settings.gravity.y.into(),
        "gravity_z" => settings.gravity.z.into(),
        "rate" => settings.rate.get(),
        "substeps" => settings.substeps.get().into(),
        "iterations" => settings.iterations.get().into(),
        _ => return None,
    })
}

fn set_setting(world: &mut World, name: &str, value: f64) -> Result<(), ActionError> {
    let mut settings = **world.resource::<SimulationSettings>();
    let mut axis = |axis: usize| {
        let mut gravity = settings.gravity;
        gravity[axis] = value as f32;
        // The message is to name the value that was given, not the f32 nearest to it.
        let done = settings.set_gravity(gravity);
        done.map_err(|error| InvalidValue { value, ..error })
    };
    let done = match name {
        "gravity_x" => axis(0),
        "gravity_y" => axis(1),
        "gravity_z" => axis(2),
        "rate" => Rate::new(value).map(|rate| settings.rate = rate),
        "substeps" => Substeps::try_from(value).map(|count| settings.substeps = count),
        "iterations" => Iterations::try_from(value).map(|count| settings.iterations = count),
        _ => {
            return Err(ActionError::Unknown {
                kind: "setting",
                name: name.to_owned(),
                valid: SETTINGS.map(|(name, ..)| name).join(", "),
            });
        }
    };
    done.map_err(ActionError::Setting)?;
    world.insert_resource(SimulationSettings(settings));
    Ok(())
}
