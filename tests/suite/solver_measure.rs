//! Measurements of a body: each compared with a case whose value is known.

use crate::support::{
    self, assert_relative, body, body_of_masses, chain, cube, settings, stretch, tetrahedron, with,
    world,
};
use glam::{DVec3, Vec3};
use pliant::solver::{
    Body, Effects, ElasticKind,
    contact::rotation,
    deform::{Deformation, deform},
    measure::{self, SquareSum},
};

fn shape_error(body: &Body) -> f64 {
    measure::shape_error(&body.topology, &body.particles.positions)
}

#[test]
fn a_body_that_was_only_moved_and_turned_has_its_own_shape() {
    for angle in [0.3, 2.0, std::f64::consts::PI] {
        let mut body = body("cube", cube(0.5, 2), 1000.0);
        let turn = rotation(DVec3::new(1.0, -2.0, 0.5), angle).as_mat3();
        for x in &mut body.particles.positions {
            *x = (turn * x.truncate() + Vec3::new(1.0, 2.0, 3.0)).extend(x.w);
        }
        // Positions near 3 m are rounded by 2⁻²³ m, for a size of 0.5 m.
        assert!(shape_error(&body) < 1e-6, "{}", shape_error(&body));
    }
}

#[test]
fn a_mirrored_body_is_not_a_turned_one_and_all_of_it_is_inside_out() {
    let mut body = body("cube", cube(0.5, 1), 1000.0);
    let tetrahedra = body.topology.tetrahedra.corners().len();
    assert_eq!(
        measure::inverted(&body.topology, &body.particles.positions),
        0
    );
    deform(&mut body.particles, Deformation::Mirror);
    let positions = &body.particles.positions;
    assert_eq!(measure::inverted(&body.topology, positions), tetrahedra);
    assert_relative(
        measure::volume_error(&body.topology, positions),
        -2.0,
        1e-6,
        "ΔV/V",
    );
    assert!(shape_error(&body) > 0.1, "no rotation undoes a mirror");
}

#[test]
fn a_squashed_body_has_lost_that_fraction_of_its_volume() {
    let mut body = body("cube", cube(0.5, 2), 1000.0);
    deform(&mut body.particles, Deformation::Squash(0.25));
    let error = measure::volume_error(&body.topology, &body.particles.positions);
    assert_relative(error, -0.75, 1e-6, "ΔV/V");
    assert!(shape_error(&body) > 0.1);
}

#[test]
fn energies_and_momenta_of_two_masses_are_those_of_the_textbook() {
    let mut body = body_of_masses(chain(1, 2.0), &[1.0, 3.0]);
    body.particles.set_velocity(0, Vec3::new(4.0, 0.0, 0.0));
    body.particles.set_velocity(1, Vec3::new(0.0, 0.0, 2.0));
    let state = &body.particles;
    let gravity = Vec3::new(0.0, -10.0, 0.0);
    assert_relative(
        measure::kinetic_energy(state),
        0.5 * 16.0 + 1.5 * 4.0,
        1e-6,
        "kinetic",
    );
    assert_relative(
        measure::gravitational_energy(state, gravity),
        -60.0,
        1e-6,
        "potential",
    );
    assert!(measure::momentum(state).distance(DVec3::new(4.0, 0.0, 6.0)) < 1e-5);
    // The second is at (0, −2, 0) and carries 6 kg·m/s along z.
    assert!(measure::angular_momentum(state).distance(DVec3::new(-12.0, 0.0, 0.0)) < 1e-5);
    assert!(measure::center_of_mass(state).distance(DVec3::new(0.0, -1.5, 0.0)) < 1e-6);
    assert_relative(
        measure::rms_speed(state),
        10.0_f64.sqrt(),
        1e-6,
        "rms speed",
    );
}

#[test]
fn a_stretched_edge_stores_half_its_square_over_its_compliance_and_a_rigid_one_nothing() {
    let mut body = body_of_masses(chain(1, 1.0), &[1.0, 1.0]);
    body.particles.positions[1].y = -1.5;
    let energy = |compliance: f32| {
        let effect = stretch(compliance).expect("given");
        measure::elastic_energy(&effect, &body.topology, &body.particles)
    };
    assert_relative(energy(0.25), 0.5 * 0.25 / 0.25, 1e-6, "energy");
    assert_eq!(energy(0.0), 0.0);
}

#[test]
fn residuals_fall_with_iterations() {
    let residual = |iterations: u32| {
        let effects = Effects {
            stretch: stretch(1e-6),
            ..Effects::default()
        };
        let rope = with(body("rope", chain(10, 0.1), 1.0), effects);
        let rope = support::pinned(rope, &[0]);
        let mut world = world(settings(9.81, 60.0, 2, iterations), rope);
        support::run(&mut world, 1.0);
        let body = &world.bodies[0];
        let sum = measure::residual(
            &body.effects.stretch.expect("given"),
            &body.topology,
            &body.particles,
            body.states.multipliers(ElasticKind::Stretch),
            world.settings.substep_seconds() as f32,
        );
        sum.rms()
    };
    let few = residual(1);
    let many = residual(30);
    assert!(few > 1e-4, "one iteration leaves {few}");
    assert!(many < few / 30.0, "thirty iterations leave {many} of {few}");
}

#[test]
fn the_mean_square_of_no_values_is_zero() {
    assert_eq!(SquareSum::default().rms(), 0.0);
    let body = body("tetrahedron", tetrahedron(), 1000.0);
    assert!(
        measure::edge_errors(&body.topology, &body.particles.positions).all(|c| c.abs() < 1e-7)
    );
}
