//! Adds, moves and removes colliders.

use super::{ActionError, grab::check_seconds};
use crate::{
    simulation::{SceneEntity, SimulationClock, SimulationSettings},
    solver::{Collider, ColliderShape, Path, Pose},
};
use bevy::prelude::*;

/// Adds a static collider.
pub fn add(world: &mut World, shape: &ColliderShape, pose: Pose) -> Result<(), ActionError> {
    let collider = Collider::new(shape.clone(), pose).map_err(ActionError::Value)?;
    world.spawn((collider, SceneEntity));
    Ok(())
}

/// Moves a collider to a pose at constant velocity within a time [s], at least one tick.
pub fn set(
    world: &mut World,
    entity: Entity,
    shape: Option<&ColliderShape>,
    pose: Pose,
    seconds: f32,
) -> Result<(), ActionError> {
    check_seconds(seconds)?;
    let begin = world.resource::<SimulationClock>().time();
    let tick = world.resource::<SimulationSettings>().tick_seconds();
    let old = world
        .get::<Collider>(entity)
        .ok_or(ActionError::NoCollider(entity))?;
    let from = old.pose_at(begin);
    let path = if from == pose {
        Path::Still
    } else {
        let end = begin + f64::from(seconds).max(tick);
        Path::Glide { from, begin, end }
    };
    let shape = shape.unwrap_or(&old.shape).clone();
    let moved = Collider::moving(shape, pose, path).map_err(ActionError::Value)?;
    if let Some(mut collider) = world.get_mut::<Collider>(entity) {
        *collider = moved;
    }
    Ok(())
}

/// Removes a collider.
pub fn remove(world: &mut World, entity: Entity) -> Result<(), ActionError> {
    if !world
        .get_entity(entity)
        .is_ok_and(|it| it.contains::<Collider>())
    {
        return Err(ActionError::NoCollider(entity));
    }
    world.despawn(entity);
    Ok(())
}
