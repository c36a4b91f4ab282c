//! Inflates a balloon to one and a half times its rest volume.
//! `cargo run --release --example balloon`

use pliant::{
    mesh::Primitive,
    solver::{Body, Compliance, Density, Effects, Filling, Pressure, Stretch, Topology, World},
};
use std::sync::Arc;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let balloon = Primitive::Balloon {
        radius: 0.3,
        cells: 6,
    }
    .build()?; // m
    let mut body = Body::new(
        "balloon",
        Arc::new(Topology::new(balloon.shape)?),
        Density::new(0.1)?,
    ); // kg/m²
    body.effects = Effects {
        stretch: Some(Stretch {
            compliance: Compliance::new(1e-2)?, // m/N
            ..Stretch::default()
        }),
        pressure: Some(Pressure::default()),
        ..Effects::default()
    };
    let mut world = World {
        bodies: vec![body],
        ..World::default()
    };
    world.settings.gravity = glam::Vec3::ZERO;
    for factor in [1.0, 1.25, 1.5] {
        let pressure = world.bodies[0]
            .effects
            .pressure
            .as_mut()
            .expect("it was given");
        pressure.factor = Filling::new(factor)?; // volume of air, over the volume at rest
        world.bodies[0].wake();
        (0..120).for_each(|_| world.tick());
        let particles = &world.bodies[0].particles;
        let radius = (0..particles.len())
            .map(|i| particles.position(i).length())
            .sum::<f64>();
        println!(
            "filled {factor} times: radius {:.4} m",
            radius / particles.len() as f64
        );
    }
    Ok(())
}
