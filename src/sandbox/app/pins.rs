//! Pins and unpins points and regions.

use crate::{
    sandbox::state::{hands::Hands, view::LastGrab},
    simulation::{Action, Actions, Pins, SoftBody},
    solver::VertexIndex,
};
use bevy::prelude::*;

/// Pins or unpins the point that is or was grabbed last.
pub fn pin_grabbed(world: &mut World, pinned: bool) {
    if let Some(grab) = world.resource::<LastGrab>().0 {
        pin(world, grab.body, grab.vertex, pinned);
    }
}

/// Pins a vertex, or unpins it, together with all vertices within the radius of the grab at rest.
pub fn pin(world: &mut World, body: Entity, vertex: VertexIndex, pinned: bool) {
    let radius = world.resource::<Hands>().radius;
    let Some((topology, pins)) = world.get::<SoftBody>(body).zip(world.get::<Pins>(body)) else {
        return;
    };
    let Some(&center) = topology.rest.get(topology.particle(vertex)) else {
        return;
    };
    let near = |at: Vec3| at.distance(center) < radius;
    let region = (0..topology.particles()).filter(|&i| near(topology.rest[i]));
    let region = region.map(|i| topology.vertex(i));
    let region = region.filter(|&other| other != vertex).chain([vertex]);
    let changed: Vec<_> = region
        .filter(|other| pins.contains(other) != pinned)
        .collect();
    let mut actions = world.resource_mut::<Actions>();
    for vertex in changed {
        actions.push(if pinned {
            Action::Pin { body, vertex }
        } else {
            Action::Unpin { body, vertex }
        });
    }
}

/// Unpins every vertex of some bodies.
pub fn unpin_all(world: &mut World, bodies: Vec<Entity>) {
    for body in bodies {
        let pins = world.get::<Pins>(body).map(|pins| pins.0.clone());
        let mut actions = world.resource_mut::<Actions>();
        for vertex in pins.unwrap_or_default() {
            actions.push(Action::Unpin { body, vertex });
        }
    }
}
