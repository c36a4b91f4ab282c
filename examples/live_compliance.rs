//! Makes a hanging block ten times softer while it is simulated.
//! `cargo run --release --example live_compliance`

use bevy::prelude::*;
use pliant::{mesh::Primitive, prelude::*, simulation::tick, solver::Damping};

fn main() -> Result {
    let block = Primitive::Box {
        size: Vec3::new(0.2, 0.6, 0.2),
        cells: UVec3::new(2, 6, 2),
    }
    .build()?; // m
    let top: Vec<u32> = (0..)
        .zip(&block.shape.vertices)
        .filter(|(_, x)| x.y > 0.29)
        .map(|(i, _)| i)
        .collect();
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, SoftBodyPlugins::default()));
    let stretch = Stretch {
        compliance: Compliance::of(1e-4), // m/N
        damping: Damping::of(0.02),       // s
        ..default()
    };
    let block = SoftBody::shape(block.shape).pinned(top);
    let body = app
        .world_mut()
        .spawn((block.build(), stretch, Volume::default()));
    let body = body.id();
    for compliance in [1e-4, 1e-3] {
        let mut stretch = app
            .world_mut()
            .get_mut::<Stretch>(body)
            .expect("it was given");
        stretch.compliance = Compliance::new(compliance)?;
        for _ in 0..240 {
            tick(app.world_mut());
        }
        let particles = app
            .world()
            .get::<Particles>(body)
            .expect("a body has particles");
        let lowest = (0..particles.len())
            .map(|i| particles.position(i).y)
            .fold(0.0, f64::min);
        println!("{compliance:.0e} m/N: its lower end hangs at {lowest:.3} m");
    }
    Ok(())
}
