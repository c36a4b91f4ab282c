//! Random bodies, and a step of the fast solver compared with the reference.

use crate::support::random_vector;
use glam::{DVec3, Vec3};
use pliant::solver::{
    Body, Density, Mass, RestShape, Settings, Topology, VertexIndex, World, deform::Random,
    reference,
};
use std::sync::Arc;

/// Half a unit in the last place of 1: the relative error of an operation in f32.
pub const EPSILON: f64 = 1.0 / (1 << 24) as f64;

/// Random positions, elements and masses: `count` elements of `N` corners each, in a cube of 2 m.
pub fn random_body<const N: usize>(count: u32, seed: u32) -> Body {
    let mut random = Random::new(seed);
    let element = |i: u32| std::array::from_fn::<u32, N, _>(|k| i * N as u32 + k as u32);
    let vertices: Vec<Vec3> = (0..count * N as u32)
        .map(|_| random_vector(&mut random, 1.0))
        .collect();
    let mut shape = RestShape {
        vertices,
        ..RestShape::default()
    };
    for i in 0..count {
        let corners = element(i);
        match N {
            2 => shape.edges.push([corners[0], corners[1]]),
            4 => shape.tetrahedra.push(std::array::from_fn(|k| corners[k])),
            _ => {}
        }
    }
    let topology = Arc::new(Topology::new(shape).expect("sound"));
    let mut body = Body::new("random", topology, Density::new(1e-9).expect("sound"));
    for particle in 0..count * N as u32 {
        let mass = 0.1 + 10.0 * random.next() * random.next();
        body.added_mass
            .push((VertexIndex(particle), Mass::new(mass).expect("sound")));
        if random.next() < 0.1 {
            body.pins.push(VertexIndex(particle));
        }
    }
    body.update_masses();
    for i in 0..body.particles.len() {
        let v = random_vector(&mut random, 20.0);
        body.particles.set_velocity(i, v);
    }
    body
}

/// The state after a substep, of the fast solver and of the reference: (x, x̂), (v, v̂).
pub fn step(mut world: World) -> Vec<[(DVec3, DVec3); 2]> {
    let mut reference = reference::World::of(&world);
    world.tick();
    reference.tick();
    assert!(world.bodies[0].quarantine.is_none());
    let (fast, reference) = (&world.bodies[0].particles, &reference.bodies[0]);
    (0..fast.len())
        .map(|i| {
            [
                (fast.position(i), reference.x[i]),
                (fast.velocity_f64(i), reference.v[i]),
            ]
        })
        .collect()
}

/// One substep of one iteration per tick, under gravity.
pub fn settings(rate: f64) -> Settings {
    crate::support::settings(9.81, rate, 1, 1)
}

/// Fails if the position of particle `i` differs by more than `tolerance` [m], or its velocity by
/// twice that over a substep.
#[track_caller]
pub fn assert_near(state: &[[(DVec3, DVec3); 2]], i: usize, tolerance: f64, rate: f64) {
    let [(x, expected_x), (v, expected_v)] = state[i];
    let error = x.distance(expected_x);
    assert!(
        error <= tolerance,
        "particle {i} at {x} instead of {expected_x}: {error} > {tolerance}"
    );
    let error = v.distance(expected_v);
    let tolerance = 2.0 * tolerance * rate + 2.0 * EPSILON * expected_v.length();
    assert!(
        error <= tolerance,
        "particle {i} at {v} instead of {expected_v} m/s: {error} > {tolerance}"
    );
}
