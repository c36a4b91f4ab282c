//! Fills a custom surface mesh with tetrahedra. `cargo run --release --example own_mesh`

use pliant::{
    mesh::{BuildOptions, FileMesh, build, read},
    solver::{Body, Density, Effects, Ground, Stretch, Topology, Volume, World, measure},
};
use std::sync::Arc;

/// A pyramid with a base of 1 m.
const PYRAMID: &str = "
v -0.5 0 -0.5\nv 0.5 0 -0.5\nv 0.5 0 0.5\nv -0.5 0 0.5\nv 0 0.8 0
f 1 2 3 4\nf 1 5 2\nf 2 5 3\nf 3 5 4\nf 4 5 1\n";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let surface: FileMesh = read::bytes("pyramid.obj", PYRAMID.as_bytes(), &|_| Ok(Vec::new()))?;
    let filled = build(surface, &BuildOptions::default())?;
    let topology = Arc::new(Topology::new(filled.shape)?);
    println!(
        "{} particles, {} tetrahedra",
        topology.particles(),
        topology.tetrahedra.corners().len()
    );
    let mut body = Body::new("pyramid", topology, Density::new(500.0)?); // kg/m³
    body.effects = Effects {
        stretch: Some(Stretch::default()),
        volume: Some(Volume::default()),
        ground: Some(Ground::default()),
        ..Effects::default()
    };
    body.translate(glam::Vec3::Y);
    let mut world = World {
        bodies: vec![body],
        ..World::default()
    };
    for _ in 0..120 {
        world.tick();
    }
    println!(
        "after 2 s its center of mass is at {:.3} m",
        measure::center_of_mass(&world.bodies[0].particles).y
    );
    Ok(())
}
