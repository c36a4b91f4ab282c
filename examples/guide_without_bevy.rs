//! A jelly ball falls onto the ground, without Bevy:
//! `cargo run --release --example guide_without_bevy`

use pliant_mesh::Primitive;
use pliant_solver::{
    Body, Compliance, Damping, Density, Ground, Height, Stretch, Topology, Volume, World, measure,
};
use std::{error::Error, sync::Arc};

fn main() -> Result<(), Box<dyn Error>> {
    let (radius, cells) = (0.2, 6); // m, across the diameter
    let ball = Primitive::Sphere { radius, cells }.build()?;
    let topology = Arc::new(Topology::new(ball.shape)?);
    let mut body = Body::new("ball", topology, Density::of(1000.0)); // kg/m³
    body.effects.stretch = Some(Stretch {
        compliance: Compliance::of(1e-3), // m/N
        damping: Damping::of(0.02),       // s
        ..Stretch::default()
    });
    body.effects.volume = Some(Volume::default());
    body.effects.ground = Some(Ground {
        height: Height::of(-1.0), // m
        ..Ground::default()
    });
    let mut world = World::default();
    world.bodies.push(body);
    for second in 1..=3 {
        (0..60).for_each(|_| world.tick()); // of 1/60 s
        let center = measure::center_of_mass(&world.bodies[0].particles);
        println!("{second} s: center of mass at {:.3} m", center.y);
    }
    Ok(())
}
