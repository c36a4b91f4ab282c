//! The solver without Bevy: a rope that hangs from its first particle.
//! `cargo run --release --example without_bevy`

use pliant::{
    mesh::Primitive,
    solver::{Body, Damping, Density, Effects, Stiffness, Stretch, Topology, VertexIndex, World},
};
use std::sync::Arc;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let rope = Primitive::Rope {
        length: 1.0,
        segments: 16,
    }
    .build()?;
    let mut body = Body::new(
        "rope",
        Arc::new(Topology::new(rope.shape)?),
        Density::new(0.1)?,
    ); // kg/m
    body.effects = Effects {
        stretch: Some(Stretch {
            axial_stiffness: Stiffness::new(1e4)?, // N
            damping: Damping::new(0.01)?,          // s
            ..Stretch::default()
        }),
        ..Effects::default()
    };
    body.pins = vec![VertexIndex(0)];
    body.update_masses();
    let mut world = World {
        bodies: vec![body],
        ..World::default()
    };
    for second in 1..=3 {
        for _ in 0..60 {
            world.tick();
        }
        let end = world.bodies[0].particles.position(16);
        println!(
            "{second} s: its end is at ({:.3}, {:.3}, {:.3}) m",
            end.x, end.y, end.z
        );
    }
    Ok(())
}
