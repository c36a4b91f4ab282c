//! Material of imported bodies.

use std::sync::Arc;

use bevy::prelude::*;

use crate::solver::{
    Body, Collide, Collider, Compliance, Contact, Density, Effects, Filling, Ground, Pressure,
    SelfContact, StickyGround, Stiffness, Stretch, Topology, Volume, topology::Dimension,
};

/// Young's modulus of the material of imported bodies [Pa]: a firm jelly. An edge of length L
/// carries about L² of it, so its compliance is 1/(E·L).
const YOUNG: f32 = 4e4;

/// Air in a closed surface, which keeps it round.
const AIR: Pressure = Pressure {
    factor: Filling::of(1.05),
    bulk_modulus: Stiffness::of(101_325.0),
};

/// A body of the default soft material, for any mesh size.
pub(super) fn body(name: &str, topology: Arc<Topology>) -> Body {
    let density = match topology.dimension {
        Dimension::Solid => 1000.0,
        Dimension::Sheet => 0.3,
        Dimension::Line => 0.1,
    };
    let edges = topology.edges.ends();
    let count = edges.len().max(1);
    let length = |ends: [u32; 2]| {
        let [a, b] = ends.map(|end| topology.rest[end as usize]);
        a.distance(b)
    };
    let mean = edges.map(length).sum::<f32>() / count as f32;
    let compliance = match topology.dimension {
        Dimension::Solid => 1.0 / (YOUNG * mean),
        Dimension::Sheet | Dimension::Line => 1e-5,
    };
    let stretch = Stretch {
        compliance: Compliance::new(compliance).unwrap_or_default(),
        ..default()
    };
    let solid = topology.dimension == Dimension::Solid;
    let is_hollow = topology.dimension == Dimension::Sheet && topology.enclosure().is_ok();
    let mut body = Body::new(name, topology, Density::new(density).unwrap_or_default());
    body.effects = Effects {
        stretch: Some(stretch),
        volume: solid.then(Volume::default),
        contact: Some(Contact::default()),
        self_contact: (!solid).then(SelfContact::default),
        pressure: is_hollow.then_some(AIR),
        ..default()
    };
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
