//! Rods that are solved segment by segment and joint by joint.

use crate::{
    support::{assert_follows, body, damping, pinned, settings, world as world_of},
    support_app::deterministic,
};
use glam::{DVec3, Vec3};
use pliant::{
    mesh::Primitive,
    solver::{
        Body, RestShape, Rod, RodRadius, RodSolver, SectionStiffness, TurnRate, World,
        YoungsModulus, reference,
    },
};

/// EI [N·m²].
const BENDING: f64 = 0.5;

fn rod(solver: RodSolver) -> Rod {
    Rod {
        youngs_modulus: YoungsModulus::of(1e7),
        radius: RodRadius::of(0.01),
        bending_stiffness: SectionStiffness::of(BENDING as f32),
        twisting_stiffness: SectionStiffness::of(0.4),
        damping: damping(0.03),
        solver,
        ..Rod::default()
    }
}

/// Deflection of the tip of a cantilever of 1 m by its own weight q, over qL⁴/8EI, after 10 s.
fn deflection(solver: RodSolver, segments: u32, iterations: u32) -> f64 {
    let part = 1.0 / (f64::from(segments) - 0.5);
    let vertices = (0..=segments).map(|i| (DVec3::X * (f64::from(i) * part)).as_vec3());
    let shape = RestShape {
        vertices: vertices.collect(),
        edges: (0..segments).map(|i| [i, i + 1]).collect(),
        ..RestShape::default()
    };
    let weight = 0.08 * BENDING;
    let density = (weight / 9.81) as f32;
    let mut body = pinned(body("beam", shape, density), &[0, 1]);
    body.effects.rod = Some(rod(solver));
    let mut world = world_of(settings(9.81, 60.0, 16, iterations), body);
    for _ in 0..600 {
        world.tick();
        assert!(world.bodies[0].quarantine.is_none());
    }
    -world.bodies[0].particles.position(segments as usize).y / 0.01
}

/// Both solve the same equations: with enough iterations the iterated rod comes to rest where the direct
/// one does. With fewer, or more segments, it is softer, and the direct one is not.
#[test]
fn an_iterated_rod_needs_the_iterations_that_a_direct_one_does_not() {
    let direct = [4, 8].map(|segments| deflection(RodSolver::Direct, segments, 1));
    let iterated = |segments, iterations| deflection(RodSolver::Iterated, segments, iterations);
    // What is left falls by a factor from iteration to iteration: 2 % at 16, nothing at 256.
    let many = iterated(4, 256) / direct[0] - 1.0;
    assert!(many.abs() < 1e-3, "{many}");
    let [few, finer] = [iterated(4, 1) / direct[0], iterated(8, 16) / direct[1]];
    assert!(few > 2.0, "{few}");
    assert!(finer > 2.0, "{finer}");
    for found in direct {
        // The load is at the nodes: 1/(8n²) and more, 4 % at 4 segments.
        assert!((found - 1.0).abs() < 0.05, "{found}");
    }
}

/// A chain with a turned clamp, a ring and a tree.
fn bodies() -> Vec<Body> {
    let of = |primitive: Primitive, pins: &[u32]| {
        let shape = primitive.build().expect("sound").shape;
        let mut body = pinned(body("rod", shape, 0.3), pins);
        body.effects.rod = Some(Rod {
            turn_start: TurnRate::of(2.0),
            ..rod(RodSolver::Iterated)
        });
        body
    };
    vec![
        of(
            Primitive::Rope {
                length: 0.5,
                segments: 8,
            },
            &[0, 1],
        ),
        of(
            Primitive::Hoop {
                radius: 0.3,
                segments: 24,
            },
            &[0],
        ),
        of(
            Primitive::Tree {
                trunk: 0.4,
                forks: 3,
                levels: 2,
                spread: 40.0,
                shrink: 0.7,
                segments: 3,
            },
            &[0, 1],
        ),
    ]
}

fn world(iterations: u32) -> World {
    let mut bodies = bodies();
    for (i, body) in bodies.iter_mut().enumerate() {
        body.translate(Vec3::Z * (2.0 * i as f32));
    }
    let settings = settings(9.81, 60.0, 10, iterations);
    let mut world = world_of(settings, bodies.remove(0));
    world.bodies.extend(bodies);
    world
}

#[test]
fn the_reference_follows_iterated_rods() {
    let mut fast = world(2);
    let mut exact = reference::World::of(&fast);
    for _ in 0..60 {
        fast.tick();
        exact.tick();
        // Displacements of f32 over 600 substeps; a swinging rod is not chaotic.
        assert_follows(&exact, &fast, 1e-4);
    }
}

#[test]
fn iterated_rods_have_the_same_bits_in_every_way_to_run_them() {
    for iterations in [1, 3] {
        let start = world(iterations);
        let (end, _) = deterministic(start.clone(), 30);
        for (end, start) in end.bodies.iter().zip(&start.bodies) {
            let last = end.particles.len() - 1;
            assert!(end.particles.position(last) != start.particles.position(last));
        }
    }
}
