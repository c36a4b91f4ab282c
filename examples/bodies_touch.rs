//! A ball falls onto a cloth that is held by its corners. `cargo run --release --example bodies_touch`

use pliant::{
    mesh::Primitive,
    solver::{
        Body, Contact, Density, Effects, SelfContact, Stretch, Topology, VertexIndex, Volume,
        World, measure,
    },
};
use std::sync::Arc;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let side = 12;
    let cloth = Primitive::Cloth {
        size: glam::Vec2::splat(1.2), // m
        cells: glam::UVec2::splat(side),
        diagonals: Default::default(),
        shear: false,
    };
    let mut cloth = Body::new(
        "cloth",
        Arc::new(Topology::new(cloth.build()?.shape)?),
        Density::new(0.3)?,
    ); // kg/m²
    cloth.effects = Effects {
        stretch: Some(Stretch::default()),
        contact: Some(Contact::default()),
        self_contact: Some(SelfContact::default()),
        ..Effects::default()
    };
    let last = side * (side + 2);
    cloth.pins = [0, side, last - side, last].map(VertexIndex).to_vec();
    cloth.update_masses();

    let ball = Primitive::Sphere {
        radius: 0.15,
        cells: 6,
    }
    .build()?; // m
    let mut ball = Body::new(
        "ball",
        Arc::new(Topology::new(ball.shape)?),
        Density::new(100.0)?,
    ); // kg/m³
    ball.effects = Effects {
        stretch: Some(Stretch::default()),
        volume: Some(Volume::default()),
        contact: Some(Contact::default()),
        ..Effects::default()
    };
    ball.translate(glam::Vec3::Y * 0.5);

    let mut world = World {
        bodies: vec![cloth, ball],
        ..World::default()
    };
    for _ in 0..8 {
        (0..15).for_each(|_| world.tick());
        let height = measure::centre_of_mass(&world.bodies[1].particles).y;
        let contacts = world.contacts.counts().acting;
        println!(
            "{:.2} s: ball at {height:.3} m, {contacts} contacts",
            world.time
        );
    }
    Ok(())
}
