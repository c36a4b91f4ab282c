//! A ball falls onto a cloth that is pinned at its corners.
//! `cargo run --release --example bodies_touch`

use bevy::prelude::*;
use pliant::{
    prelude::*,
    simulation::{BodyContacts, tick},
    solver::measure,
};

fn main() {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, SoftBodyPlugins::default()));
    let cloth = SoftBody::cloth(Vec2::splat(1.2), UVec2::splat(12)) // m
        .density(Density::of(0.3)) // kg/m²
        .pinned([0, 12, 156, 168]);
    app.world_mut().spawn((
        cloth.build(),
        Stretch::default(),
        Contact::default(),
        SelfContact::default(),
    ));
    let ball = SoftBody::sphere(0.15, 6) // m
        .at(Vec3::Y * 0.5)
        .density(Density::of(100.0)); // kg/m³
    let ball = app.world_mut().spawn((
        ball.build(),
        Stretch::default(),
        Volume::default(),
        Contact::default(),
    ));
    let ball = ball.id();
    for quarter in 1..=8 {
        (0..15).for_each(|_| tick(app.world_mut()));
        let particles = app.world().get::<Particles>(ball).expect("a body");
        let height = measure::center_of_mass(particles).y;
        let contacts = app.world().resource::<BodyContacts>();
        let force: f32 = contacts.forces().map(|contact| contact.normal_force).sum();
        let time = 0.25 * f64::from(quarter);
        println!("{time:.2} s: ball at {height:.3} m, contact forces {force:.2} N");
    }
}
