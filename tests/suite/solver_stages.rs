//! The three stages: prediction, projection, update of positions; A1 to A4 and A11 of the methods.

use crate::support::{
    self, G, bits, body, body_of_masses, chain, cube, elastic_on_ground, pinned, point, position,
    settings, state_bits, stretch, tetrahedron, with, world,
};
use glam::{DVec3, Vec3, Vec4};
use pliant::solver::{Body, Effects, Height, RestShape, StickyGround, World, measure, reference};

fn particle() -> Body {
    body_of_masses(point(), &[1.0])
}

/// y₀ + v₀nh − gh²n(n+1)/2, the closed form of symplectic Euler.
fn fallen(v: f64, g: f64, h: f64, n: u32) -> f64 {
    let n = f64::from(n);
    v * n * h - g * h * h * n * (n + 1.0) / 2.0
}

#[test]
fn free_fall_follows_the_closed_form_to_the_bit_where_every_number_is_a_sum_of_few_powers_of_two() {
    // h = 2⁻⁸ s and g = 8 m/s²: positions are multiples of 2⁻¹³ m below 2¹⁰ m, so that 24 bits
    // hold each of them, and no operation rounds.
    let mut body = particle();
    body.set_velocity(Vec3::new(0.0, 2.0, 0.0));
    let mut world = world(settings(8.0, 64.0, 4, 1), body);
    for tick in 1..=512 {
        world.tick();
        let expected = fallen(2.0, 8.0, 1.0 / 256.0, 4 * tick);
        assert_eq!(
            f64::from(position(&world, 0).y),
            expected,
            "after {tick} ticks"
        );
    }
}

#[test]
fn free_fall_follows_the_closed_form_to_a_micrometer() {
    // Each of n = 10 substeps rounds a position below 0.25 m by at most 2⁻²⁷ m, and the velocity
    // derived from it carries the error on: at most n(n+1)/2 · 2⁻²⁷ m = 4e-7 m in total.
    let mut world = world(settings(G, 60.0, 10, 1), particle());
    world.bodies[0].set_velocity(Vec3::new(0.0, 1.0, 0.0));
    world.tick();
    let expected = fallen(1.0, G, 1.0 / 600.0, 10);
    assert!((f64::from(position(&world, 0).y) - expected).abs() < 1e-6);
}

#[test]
fn the_reference_falls_by_the_closed_form_for_ten_seconds() {
    let start = world(settings(G, 60.0, 10, 1), particle());
    let mut reference = reference::World::of(&start);
    for _ in 0..600 {
        reference.tick();
    }
    // At most 6000² / 2 roundings of 2⁻⁴⁴ m (half a unit of 490 m); gravity itself is an f32.
    let gravity = f64::from(start.settings.gravity.y.abs());
    let expected = fallen(0.0, gravity, 1.0 / 600.0, 6000);
    assert!((reference.bodies[0].x[0].y - expected).abs() < 1e-6);
}

#[test]
fn removing_the_triangles_of_a_solid_changes_no_bit_of_its_state() {
    let with_triangles = cube(0.5, 2);
    let without = RestShape {
        triangles: Vec::new(),
        ..with_triangles.clone()
    };
    assert!(!with_triangles.triangles.is_empty());
    let [a, b] = [with_triangles, without].map(|shape| {
        let mut body = with(body("cube", shape, 1000.0), elastic_on_ground());
        body.translate(Vec3::new(0.0, 0.5, 0.0));
        let mut world = world(settings(G, 60.0, 10, 1), body);
        support::run(&mut world, 1.0);
        world.state_hash()
    });
    assert_eq!(a, b);
}

#[test]
fn a_hanging_chain_equals_a_loop_of_ten_lines_to_the_bit() {
    let effects = Effects {
        stretch: stretch(1e-4),
        ..Effects::default()
    };
    let body = pinned(
        with(body_of_masses(chain(2, 0.3), &[1.0, 0.5, 2.0]), effects),
        &[0],
    );
    let mut world = world(settings(G, 60.0, 10, 3), body);
    world.bodies[0].set_velocity(Vec3::new(0.4, 0.0, 0.2));

    let state = &world.bodies[0].particles;
    // Position p, displacement u and carry c: a particle is at p + u, and was at p + c.
    let [mut p, mut u, mut c]: [Vec<Vec3>; 3] = state
        .columns()
        .map(|(_, column)| column.iter().map(|x| x.truncate()).collect());
    let w: Vec<f32> = state.positions.iter().map(|x| x.w).collect();
    let rest = world.bodies[0].topology.edges.rest_length.clone();
    let (h, gravity) = ((1.0_f64 / 600.0) as f32, Vec3::new(0.0, -9.81, 0.0));
    let alpha = 1e-4 * (1.0 / (h * h));
    assert_eq!(state.substep_seconds(), h, "as long as those to come");
    // A sum, and its rounding error.
    let sum = |a: Vec3, b: Vec3| (a + b, b - ((a + b) - a));
    for _ in 0..600 {
        for i in 1..3 {
            let (moved, lost) = sum(u[i], gravity * (h * h));
            (u[i], c[i]) = (moved, c[i] - lost);
        }
        let mut lambda = [0.0; 2];
        for edge in [0, 1].repeat(3) {
            let d = (p[edge + 1] - p[edge]) + (u[edge + 1] - u[edge]);
            let error = rest[edge] - d.length() - alpha * lambda[edge];
            let scale = error / ((w[edge] + w[edge + 1] + alpha) * d.length());
            lambda[edge] += scale * d.length();
            u[edge] += d * -(w[edge] * scale);
            u[edge + 1] += d * (w[edge + 1] * scale);
        }
        for i in 1..3 {
            let (place, error) = sum(p[i], u[i]);
            let (moved, lost) = sum(u[i], error - c[i]);
            (p[i], u[i], c[i]) = (place, moved, error - lost);
        }
    }

    support::run(&mut world, 1.0);
    let column = |x: &[Vec3], w: &[f32]| -> Vec<Vec4> {
        x.iter().zip(w).map(|(x, w)| x.extend(*w)).collect()
    };
    let expected = [column(&p, &w), column(&u, &[0.0; 3]), column(&c, &[0.0; 3])];
    let expected = expected.map(|column| bits(&column));
    assert_eq!(state_bits(&world.bodies[0].particles), expected);
}

#[test]
fn a_sticky_ground_puts_a_particle_back_to_where_it_was_at_ground_level() {
    let mut body = particle();
    body.effects.sticky_ground = Some(StickyGround {
        height: Height::of(0.25),
    });
    body.translate(Vec3::new(3.0, 0.26, -2.0));
    body.set_velocity(Vec3::new(5.0, -9.0, 4.0));
    let mut world = world(settings(G, 60.0, 1, 1), body);
    world.tick();
    // It would have moved to x = 3.083; sticking, it keeps x and z and loses all its velocity along
    // the ground.
    assert_eq!(position(&world, 0), Vec3::new(3.0, 0.25, -2.0));
    let velocity = world.bodies[0].particles.velocity(0);
    assert_eq!((velocity.x, velocity.z), (0.0, 0.0));
    support::run(&mut world, 1.0);
    assert_eq!(position(&world, 0), Vec3::new(3.0, 0.25, -2.0));
}

#[test]
fn pinned_particles_move_by_exactly_nothing_for_ten_thousand_frames() {
    let effects = Effects {
        stretch: stretch(0.0),
        ..Effects::default()
    };
    // Numbers without an exact binary representation, and an oscillation that never stops.
    let mut body = pinned(
        with(body_of_masses(chain(3, 0.37), &[1.0; 4]), effects),
        &[0, 2],
    );
    body.translate(Vec3::new(0.1, 0.7, -1.3));
    body.set_velocity(Vec3::new(3.0, 0.0, 1.0));
    let mut world = world(settings(G, 60.0, 10, 1), body);
    let before = state_bits(&world.bodies[0].particles);
    for _ in 0..10_000 {
        world.tick();
    }
    let after = state_bits(&world.bodies[0].particles);
    for (before, after) in before.iter().zip(&after) {
        assert_eq!((before[0], before[2]), (after[0], after[2]));
    }
    assert_ne!(before[0][1], after[0][1], "the others do move");
}

/// A tumbling tetrahedron, and the change of its momentum [kg·m/s] by the rounding of a substep to
/// f32, root mean square.
///
/// Each displacement of a particle rounds its position, below 4 m here, by ulp/√12, and postsolve
/// converts it to a velocity: m · 2⁻²² m / √12 / h = 1.7e-3 kg·m/s. With four iterations there are
/// 12 ends of edges and 4 corners four times over, and 4 predictions: 68 roundings along each of
/// three axes.
fn tumbling(gravity: f64) -> (World, f64) {
    let mut body = with(
        body("tetrahedron", tetrahedron(), 1000.0),
        support::elastic(),
    );
    body.set_velocity(Vec3::new(1.0, 2.0, -3.0));
    body.particles.set_velocity(0, Vec3::new(5.0, 2.0, 2.0));
    let mass = 1000.0 / 24.0;
    let rounding = mass * 2.0_f64.powi(-22) / 12.0_f64.sqrt() * 600.0 * (68.0 * 3.0_f64).sqrt();
    (world(settings(gravity, 60.0, 10, 4), body), rounding)
}

#[test]
fn the_momentum_of_a_free_body_is_constant_but_for_rounding() {
    let (mut world, rounding) = tumbling(0.0);
    let before = measure::momentum(&world.bodies[0].particles);
    support::run(&mut world, 1.0);
    let after = measure::momentum(&world.bodies[0].particles);
    // A random walk of 600 substeps, and three standard deviations of it.
    assert!(
        after.distance(before) < 3.0 * rounding * 600.0_f64.sqrt(),
        "{before}, {after}"
    );
}

#[test]
fn the_momentum_of_a_free_body_of_the_reference_is_constant_to_eleven_digits() {
    let (world, _) = tumbling(0.0);
    let mut reference = reference::World::of(&world);
    let momentum = |reference: &reference::World| {
        let body = &reference.bodies[0];
        (0..4).fold(DVec3::ZERO, |sum, i| sum + body.v[i] / body.w[i])
    };
    let before = momentum(&reference);
    (0..60).for_each(|_| reference.tick());
    // The random walk of the fast solver, shorter by 2²⁹.
    assert!(momentum(&reference).distance(before) < 1e-11 * before.length());
}

#[test]
fn the_center_of_mass_of_a_tumbling_body_follows_the_parabola() {
    let (mut world, rounding) = tumbling(G);
    let state = &world.bodies[0].particles;
    let start = measure::center_of_mass(state);
    let mass = 1000.0 / 6.0;
    let v = measure::momentum(state) / mass;
    support::run(&mut world, 0.5);
    let end = measure::center_of_mass(&world.bodies[0].particles);
    let expected = start + v * 0.5 + DVec3::Y * fallen(0.0, G, 1.0 / 600.0, 300);
    // The random walk of the momentum, summed again: h √(n³/3) times that of a substep.
    let tolerance = 3.0 * rounding / mass / 600.0 * (300.0_f64.powi(3) / 3.0).sqrt();
    assert!(
        end.distance(expected) < tolerance,
        "{end} instead of {expected}"
    );
}
