//! Adds and removes colliders.

use super::import::under_pointer;
use crate::{
    sandbox::state::{
        spawn::{ColliderKind, Spawn},
        view::{LastGrab, SelectedCollider},
    },
    simulation::{
        Action, Actions, end_tick,
        plain::{bodies_in_order, colliders_in_order},
    },
    solver::{Collide, ColliderShape, Pose},
};
use bevy::prelude::*;

/// Adds a collider of the size of new bodies on the point under the pointer, and selects it. Bodies
/// that did not touch colliders do so from then on.
pub fn add(world: &mut World, kind: ColliderKind) {
    let size = world.resource::<Spawn>().size;
    let shape = match kind {
        ColliderKind::Sphere => ColliderShape::Sphere { radius: size / 2.0 },
        ColliderKind::Box => ColliderShape::Box {
            size: Vec3::splat(size),
        },
        ColliderKind::Capsule => ColliderShape::Capsule {
            radius: size / 4.0,
            length: size / 2.0,
        },
    };
    let at = under_pointer(world).unwrap_or_default() + Vec3::Y * (size / 2.0);
    let pose = Pose::at(at.as_dvec3());
    let bodies = bodies_in_order(world);
    // Colliders are added between ticks: first ends a tick that is spread over frames.
    end_tick(world);
    let without = bodies
        .into_iter()
        .filter(|&body| world.get::<Collide>(body).is_none());
    let mut list: Vec<Action> = without
        .map(|body| Action::AddEffect {
            body,
            effect: "collide".to_owned(),
        })
        .collect();
    list.push(Action::AddCollider { shape, pose });
    let mut actions = world.resource_mut::<Actions>();
    list.into_iter().for_each(|action| actions.push(action));
    // Applied at once, so that it can be selected.
    Actions::apply(world);
    let added = colliders_in_order(world).last().copied();
    world.resource_mut::<SelectedCollider>().0 = added;
    world.resource_mut::<LastGrab>().0 = None;
}

/// Removes the selected collider; returns whether there was one.
pub fn remove_selected(world: &mut World) -> bool {
    let Some(collider) = world.resource_mut::<SelectedCollider>().0.take() else {
        return false;
    };
    let mut actions = world.resource_mut::<Actions>();
    actions.push(Action::RemoveCollider { collider });
    true
}
