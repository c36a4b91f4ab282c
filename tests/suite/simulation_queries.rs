//! Rays and closest points against bodies, without a window.

use crate::{
    support::{body, chain, cube, settings, world},
    support_app::app_of,
};
use bevy::{ecs::system::RunSystemOnce, prelude::*};
use pliant::{
    mesh::Primitive,
    simulation::{SoftBodyHit, SoftBodyQueries},
    solver::{Body, Particles, RestShape},
};

fn app_with(shapes: [(RestShape, Vec3); 3]) -> (App, Vec<Entity>) {
    let mut world = world(settings(0.0, 60.0, 1, 1), body("none", cube(1.0, 1), 1.0));
    world.bodies = shapes
        .into_iter()
        .map(|(shape, place)| {
            let mut body: Body = body("body", shape, 100.0);
            body.translate(place);
            body
        })
        .collect();
    let (app, bodies, _) = app_of(&world);
    (app, bodies)
}

/// A cube of 1 m around the origin, a rope of 2 m from (10, 0, 0) down, and a grain of 0.1 m at
/// (20, 0, 0).
fn three() -> (App, Vec<Entity>) {
    let grain = Primitive::Grains {
        size: Vec3::splat(0.2),
        region: Default::default(),
        radius: 0.1,
        variation: 0.0,
    };
    let mut grain = grain.build().expect("sound").shape;
    assert_eq!(grain.vertices.len(), 1);
    grain.vertices[0] = Vec3::ZERO;
    app_with([
        (cube(1.0, 2), Vec3::ZERO),
        (chain(4, 0.5), Vec3::X * 10.0),
        (grain, Vec3::X * 20.0),
    ])
}

fn closest(app: &mut App, place: Vec3, within: f32) -> Option<SoftBodyHit> {
    let find = move |bodies: SoftBodyQueries| bodies.closest(place, within);
    app.world_mut().run_system_once(find).expect("sound")
}

fn cast(app: &mut App, from: Vec3, along: Dir3, reach: f32) -> Option<SoftBodyHit> {
    let find = move |bodies: SoftBodyQueries| bodies.cast(Ray3d::new(from, along), reach);
    app.world_mut().run_system_once(find).expect("sound")
}

#[test]
fn the_nearest_point_is_found_on_every_kind_of_body() {
    let (mut app, bodies) = three();
    // Beside a face, beside an edge and in the cube; beside the rope and below it; beside the grain and
    // in it.
    let cases = [
        (Vec3::new(0.2, 2.5, 0.1), 0, 2.0, Vec3::new(0.2, 0.5, 0.1)),
        (Vec3::new(3.5, 4.5, 0.1), 0, 5.0, Vec3::new(0.5, 0.5, 0.1)),
        (Vec3::new(0.0, 0.4, 0.1), 0, 0.1, Vec3::new(0.0, 0.5, 0.1)),
        (
            Vec3::new(10.3, -0.7, 0.4),
            1,
            0.5,
            Vec3::new(10.0, -0.7, 0.0),
        ),
        (
            Vec3::new(10.0, -5.0, 0.0),
            1,
            3.0,
            Vec3::new(10.0, -2.0, 0.0),
        ),
        (Vec3::new(20.0, 0.0, 3.1), 2, 3.0, Vec3::new(20.0, 0.0, 0.1)),
        (
            Vec3::new(20.0, 0.04, 0.0),
            2,
            0.06,
            Vec3::new(20.0, 0.1, 0.0),
        ),
    ];
    for (place, number, distance, position) in cases {
        let hit = closest(&mut app, place, 10.0).expect("near");
        assert_eq!(hit.body, bodies[number], "{place}");
        // Rounding of coordinates up to 20 m.
        assert!(
            (hit.distance - distance).abs() < 4e-6,
            "{place}: {}",
            hit.distance
        );
        assert!(
            hit.position.distance(position) < 4e-6,
            "{place}: {}",
            hit.position
        );
        let particles = app.world().get::<Particles>(hit.body).expect("a body");
        let point = hit.point.position(&particles.positions);
        let radius = if number == 2 { 0.1 } else { 0.0 };
        assert!((point.distance(hit.position) - radius).abs() < 4e-6);
    }
    assert_eq!(closest(&mut app, Vec3::Y * 3.0, 2.4), None, "2.5 m away");
}

#[test]
fn a_ray_meets_the_first_body() {
    let (mut app, bodies) = three();
    let from = Vec3::new(30.0, 0.0, 0.02);
    let grain = cast(&mut app, from, Dir3::NEG_X, 0.01).expect("the grain is in front");
    assert_eq!(grain.body, bodies[2]);
    // The sphere is met beside its middle. Squares of 10 m are rounded to 6e-6 m², of which the root
    // of 0.0096 m² has an error of 3e-5 m.
    let expected = 10.0 - (0.01_f32 - 0.0004).sqrt();
    assert!(
        (grain.distance - expected).abs() < 1e-4,
        "{}",
        grain.distance
    );
    let from = Vec3::new(15.0, -0.2, 0.02);
    let rope = cast(&mut app, from, Dir3::NEG_X, 0.01).expect("within 0.01 · 5 m of the rope");
    assert_eq!(rope.body, bodies[1]);
    let cube = cast(&mut app, from, Dir3::NEG_X, 0.001).expect("behind the rope");
    assert_eq!((cube.body, cube.distance), (bodies[0], 14.5));
    assert_eq!(cast(&mut app, from, Dir3::X, 0.001), None);
    let other = move |all: SoftBodyQueries| {
        let ray = Ray3d::new(Vec3::X * 30.0, Dir3::NEG_X);
        all.cast_among(ray, 0.0, |body| body == bodies[0])
    };
    let hit = app.world_mut().run_system_once(other).expect("sound");
    assert_eq!(hit.map(|hit| hit.distance), Some(29.5));
}
