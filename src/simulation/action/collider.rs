//! Adds, moves and removes colliders.

use super::{ActionError, grab::check_seconds};
use crate::{
    simulation::{SceneEntity, SimulationClock, SimulationSettings},
    solver::{Collider, ColliderShape, InvalidValue, Path, Pose},
};
use bevy::{math::DMat3, prelude::*};

/// Largest deviation of RᵀR from the identity.
const TOLERANCE: f64 = 1e-6;

/// Adds a static collider.
pub fn add(world: &mut World, shape: &ColliderShape, pose: Pose) -> Result<(), ActionError> {
    check(&pose)?;
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
    check(&pose)?;
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

fn check(pose: &Pose) -> Result<(), ActionError> {
    let Pose {
        rotation,
        translation,
    } = *pose;
    if !translation.is_finite() {
        return Err(ActionError::Value(InvalidValue {
            quantity: "position of the collider",
            value: translation.x + translation.y + translation.z,
            valid: "finite",
        }));
    }
    let off = rotation.transpose() * rotation - DMat3::IDENTITY;
    let largest = off.to_cols_array().into_iter().map(f64::abs);
    let is_rotation = largest.fold(0.0, f64::max) < TOLERANCE && rotation.determinant() > 0.0;
    // A comparison with NaN is false; `max` ignores it.
    (rotation.is_finite() && is_rotation)
        .then_some(())
        .ok_or(ActionError::NoRotation)
}
