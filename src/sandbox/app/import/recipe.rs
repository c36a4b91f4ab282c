//! Material of imported bodies.

use std::sync::Arc;

use bevy::prelude::*;

use crate::{
    scene::mesh_file::material,
    solver::{Body, Collide, Collider, Effects, Ground, StickyGround, Topology},
};

/// A body of the default soft material, for any mesh size.
pub(super) fn body(name: &str, topology: Arc<Topology>) -> Body {
    let (density, effects) = material(&topology);
    let mut body = Body::new(name, topology, density);
    body.effects = (&effects).into();
    body
}

/// The effects of a new body in the scene: its ground, and its colliders.
pub(super) fn surroundings(world: &mut World, own: Effects) -> Effects {
    let sticky = world.query::<&StickyGround>().iter(world).next().copied();
    let ground = world.query::<&Ground>().iter(world).next().copied();
    let colliders = world.query::<&Collider>().iter(world).next().is_some();
    Effects {
        ground: ground.or_else(|| sticky.is_none().then(Ground::default)),
        sticky_ground: sticky.filter(|_| ground.is_none()),
        collide: colliders.then(Collide::default),
        ..own
    }
}
