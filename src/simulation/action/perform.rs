//! Carries out actions.

use super::{Action, ActionError, SETTINGS, collider, grab};
use crate::{
    effect::{Effect, EffectRegistry, ForceMask},
    simulation::{
        Asleep, BodyDensity, BodySkin, Pins, Quarantined, RestTimer, SceneEntity,
        SimulationSettings, SoftBody, TickStart, carried::set_controls, plain, tear,
    },
    solver::{
        CollisionIterations, Grab, GroupName, InvalidValue, Iterations, KeepSpin, Order, Particles,
        Rate, Settings, SmoothingIterations, Substeps, Topology, VertexIndex,
        deform::{self, reset_shape},
    },
};
use bevy::prelude::*;
use std::sync::Arc;

impl Action {
    /// Carries out the action at once, and not as one of [`Actions`](super::Actions).
    ///
    /// # Errors
    /// [`ActionError`] if the body, effect, parameter, setting or particle does not exist, or the value
    /// is out of range; nothing has changed in this case.
    pub fn perform(&self, world: &mut World) -> Result<(), ActionError> {
        match self {
            Action::SetSetting { name, value } => set_setting(world, name, *value),
            Action::SetParameter {
                body,
                effect,
                parameter,
                value,
            } => set_parameter(world, *body, effect, parameter, *value),
            Action::SetForceGroup { body, group } => set_force_group(world, *body, *group),
            Action::AddEffect { body, effect } => {
                let info = find_effect(world, effect)?;
                let (present, unfit) = (info.present, info.unfit);
                let (add, remove) = (info.insert_default, info.remove);
                let fitness = Fitness::of(world);
                let mut entity = body_mut(world, *body)?;
                if present(&EntityRef::from(&entity)) {
                    return Ok(());
                }
                if let Some(reason) = unfit(&EntityRef::from(&entity), &fitness.settings) {
                    let effect = effect.clone();
                    return Err(ActionError::Unfit { effect, reason });
                }
                let add = add.ok_or_else(|| ActionError::Absent(effect.clone()))?;
                let rest = entity.get::<RestTimer>().copied();
                let is_asleep = entity.contains::<Asleep>();
                add(&mut entity);
                let unfit = fitness.unfit(&entity);
                if !unfit.is_empty() {
                    remove(&mut entity);
                    let reason = fitness.reason_of_change(&entity, effect, unfit);
                    if let Some(reason) = reason {
                        // Removal of an effect wakes a body.
                        if is_asleep {
                            entity.insert(Asleep);
                        }
                        if let Some(rest) = rest {
                            entity.insert(rest);
                        }
                        let effect = effect.clone();
                        return Err(ActionError::Unfit { effect, reason });
                    }
                    add(&mut entity);
                }
                wake(&mut entity);
                Ok(())
            }
            Action::RemoveEffect { body, effect } => {
                let remove = find_effect(world, effect)?.remove;
                let mut entity = body_mut(world, *body)?;
                remove(&mut entity);
                wake(&mut entity);
                Ok(())
            }
            Action::SetDensity { body, density } => {
                body_mut(world, *body)?.insert(BodyDensity(*density));
                Ok(())
            }
            Action::Grab {
                body,
                point,
                target,
            } => grab::point(world, *body, *point, *target),
            Action::Brush {
                body,
                point,
                target,
                radius,
                stiffness,
            } => grab::patch(world, *body, (*point, *target), *radius, *stiffness),
            Action::GrabPins { body, vertex } => grab::pins(world, *body, *vertex),
            Action::MovePins {
                body,
                target,
                seconds,
            } => grab::move_pins(world, *body, *target, *seconds),
            Action::AddCollider { shape, pose } => collider::add(world, shape, *pose),
            Action::SetCollider {
                collider,
                shape,
                pose,
                seconds,
            } => collider::set(world, *collider, shape.as_ref(), *pose, *seconds),
            Action::RemoveCollider { collider } => collider::remove(world, *collider),
            Action::MoveGrab { body, target } => {
                let mut entity = body_mut(world, *body)?;
                if let Some(mut grab) = entity.get_mut::<Grab>()
                    && target.is_finite()
                {
                    grab.target = *target;
                }
                Ok(())
            }
            Action::Control { body, controls } => {
                let mut entity = body_mut(world, *body)?;
                let fit = |body: &SoftBody| controls.fit(body);
                if !entity.get().is_some_and(fit) {
                    return Err(ActionError::Controls);
                }
                set_controls(&mut entity, controls);
                Ok(())
            }
            Action::Release { body } => {
                body_mut(world, *body)?.remove::<Grab>();
                Ok(())
            }
            Action::Pin { body, vertex } => change_pins(world, *body, *vertex, true),
            Action::Unpin { body, vertex } => change_pins(world, *body, *vertex, false),
            Action::Cut { body, cut } => tear::cut(world, *body, cut),
            Action::Deform { body, deformation } => reshape(world, *body, |particles, _| {
                deform::deform(particles, *deformation);
            }),
            Action::ResetShape { body } => reshape(world, *body, reset_shape),
            Action::Restore { body } => {
                let mut entity = body_mut(world, *body)?;
                entity
                    .take::<Quarantined>()
                    .ok_or(ActionError::NotInQuarantine)?;
                wake(&mut entity);
                Ok(())
            }
            Action::Spawn(new) => {
                let entity = plain::spawn_body(world, &new.body);
                let mut entity = world.entity_mut(entity);
                entity.insert(SceneEntity);
                if let Some(skin) = &new.skin {
                    entity.insert(BodySkin(Arc::clone(skin)));
                }
                new.own.iter().for_each(|effect| effect.insert(&mut entity));
                Ok(())
            }
            Action::Despawn { body } => {
                body_mut(world, *body)?.despawn();
                Ok(())
            }
        }
    }
}

pub(super) fn body_mut(world: &mut World, body: Entity) -> Result<EntityWorldMut<'_>, ActionError> {
    world
        .get_entity_mut(body)
        .ok()
        .filter(|entity| entity.contains::<SoftBody>())
        .ok_or(ActionError::NoBody(body))
}

pub(super) fn wake(entity: &mut EntityWorldMut) {
    entity.remove::<Asleep>().insert(RestTimer::default());
}

/// Wakes a body at once. The next tick would do so too, but until then, reports about the state
/// would depend on more than the state.
fn rouse(entity: &mut EntityWorldMut) {
    if entity.contains::<Asleep>() {
        wake(entity);
    }
}

/// Changes the particles of a body between ticks, and ends its quarantine.
fn reshape(
    world: &mut World,
    body: Entity,
    change: impl FnOnce(&mut Particles, &Topology),
) -> Result<(), ActionError> {
    let mut entity = body_mut(world, body)?;
    let topology = entity.get::<SoftBody>().map(|body| Arc::clone(&body.0));
    if let (Some(topology), Some(mut particles)) = (topology, entity.get_mut::<Particles>()) {
        change(&mut particles, &topology);
        let start = particles.clone();
        entity.insert(TickStart(start));
    }
    entity.remove::<Quarantined>();
    wake(&mut entity);
    Ok(())
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

/// Which effects cannot act on a body that carries them. A scene with such a body may not load again.
struct Fitness {
    /// Name of each effect, whether a body carries it, and the reason why it cannot act on it.
    effects: Vec<EffectFitness>,
    settings: Settings,
}

type EffectFitness = (
    &'static str,
    fn(&EntityRef) -> bool,
    fn(&EntityRef, &Settings) -> Option<String>,
);

impl Fitness {
    fn of(world: &World) -> Self {
        let effects = world.resource::<EffectRegistry>().iter();
        Self {
            effects: effects
                .map(|info| (info.name, info.present, info.unfit))
                .collect(),
            settings: **world.resource::<SimulationSettings>(),
        }
    }

    /// Effects that the body carries and that cannot act on it, with the reason.
    fn unfit(&self, body: &EntityWorldMut) -> Vec<(&'static str, String)> {
        let body = EntityRef::from(body);
        let carried = self.effects.iter().filter(|(_, present, _)| present(&body));
        carried
            .filter_map(|(name, _, unfit)| Some((*name, unfit(&body, &self.settings)?)))
            .collect()
    }

    /// Reason against a change of an effect, given what is unfit after it: an effect that is not
    /// unfit on the body as it was before.
    fn reason_of_change(
        &self,
        before: &EntityWorldMut,
        changed: &str,
        after: Vec<(&'static str, String)>,
    ) -> Option<String> {
        let before = self.unfit(before);
        let is_new = |name: &str| before.iter().all(|(other, _)| *other != name);
        let (name, reason) = after.into_iter().find(|(name, _)| is_new(name))?;
        Some(if name == changed {
            reason
        } else {
            format!("the effect {name} of the body could no longer act: {reason}")
        })
    }
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
            valid: match info.parameters.is_empty() {
                true => "none".to_owned(),
                false => info.full_names().collect::<Vec<_>>().join(", "),
            },
        })?;
    let (get, set, try_out) = (info.get, info.set, info.try_out);
    let fitness = Fitness::of(world);
    let mut entity = body_mut(world, body)?;
    let before = get(&EntityRef::from(&entity), index);
    match try_out(&mut entity, index, value) {
        Some(Ok(())) => {
            let unfit = fitness.unfit(&entity);
            if let Some(before) = before
                && !unfit.is_empty()
            {
                try_out(&mut entity, index, before);
                if let Some(reason) = fitness.reason_of_change(&entity, effect, unfit) {
                    let parameter = format!("{effect}.{parameter}");
                    return Err(ActionError::UnfitParameter { parameter, reason });
                }
            }
            set(&mut entity, index, value);
            rouse(&mut entity);
            Ok(())
        }
        Some(Err(error)) => Err(ActionError::Parameter {
            parameter: format!("{effect}.{parameter}"),
            error,
        }),
        None => Err(ActionError::Absent(effect.to_owned())),
    }
}

fn set_force_group(world: &mut World, body: Entity, group: GroupName) -> Result<(), ActionError> {
    let mut entity = body_mut(world, body)?;
    let groups = entity.get::<SoftBody>().map(|body| body.groups.clone());
    let groups = groups.unwrap_or_default();
    let mut mask = entity
        .get_mut::<ForceMask>()
        .ok_or_else(|| ActionError::Absent(ForceMask::NAME.to_owned()))?;
    if !group.is_empty() && !groups.contains(group) {
        let names: Vec<_> = groups.names().iter().map(GroupName::as_str).collect();
        return Err(ActionError::Unknown {
            kind: "group",
            name: group.to_string(),
            valid: match names.is_empty() {
                true => "the empty name, as the body has no groups".to_owned(),
                false => names.join(", "),
            },
        });
    }
    mask.group = group;
    rouse(&mut entity);
    Ok(())
}

fn change_pins(
    world: &mut World,
    body: Entity,
    vertex: VertexIndex,
    pinned: bool,
) -> Result<(), ActionError> {
    let mut entity = body_mut(world, body)?;
    let vertices = entity.get::<Particles>().map_or(0, Particles::len);
    if vertex.index() >= vertices {
        return Err(ActionError::NoVertex { vertex, vertices });
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

fn set_setting(world: &mut World, name: &str, value: f64) -> Result<(), ActionError> {
    let mut settings = **world.resource::<SimulationSettings>();
    let mut axis = |axis: usize| {
        let mut gravity = settings.gravity;
        gravity[axis] = value as f32;
        // The error must contain the given value, not the nearest f32.
        let done = settings.set_gravity(gravity);
        done.map_err(|error| InvalidValue { value, ..error })
    };
    let done =
        match name {
            "gravity_x" => axis(0),
            "gravity_y" => axis(1),
            "gravity_z" => axis(2),
            "rate" => Rate::new(value).map(|rate| settings.rate = rate),
            "substeps" => Substeps::try_from(value).map(|count| settings.substeps = count),
            "iterations" => Iterations::try_from(value).map(|count| settings.iterations = count),
            "order" => Order::try_from(value).map(|order| settings.order = order),
            "keep_spin" => KeepSpin::try_from(value).map(|kept| settings.keep_spin = kept),
            "smoothing_iterations" => SmoothingIterations::try_from(value)
                .map(|count| settings.smoothing_iterations = count),
            "collision_iterations" => CollisionIterations::try_from(value)
                .map(|count| settings.collision_iterations = count),
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
    let mut sleepers = world.query_filtered::<Entity, With<Asleep>>();
    for sleeper in sleepers.iter(world).collect::<Vec<_>>() {
        rouse(&mut world.entity_mut(sleeper));
    }
    Ok(())
}
