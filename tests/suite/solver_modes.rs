//! Frequencies of a body's modes and their numerical damping, compared with closed forms.

use crate::support::{
    assert_relative, body, body_of_masses, chain, cube, pinned, settings, stretch, tetrahedron,
    volume, with, world,
};
use glam::Vec3;
use pliant::solver::{
    Body, Effects, RestShape, Substeps,
    modes::{Modes, RIGID, half_life},
    reference,
};
use std::f64::consts::PI;

const COMPLIANCE: f32 = 5e-4;
const MASS: f32 = 2.0;

fn modes(body: &Body) -> Modes {
    Modes::of(&body.topology, &body.particles, &body.effects).expect("it can strain")
}

fn softest(body: &Body) -> f64 {
    modes(body).softest.expect("found")
}

/// A chain of equal masses, in a direction that is not along an axis.
fn slanted(links: usize, compliance: f32) -> Body {
    let shape = chain(links, 0.5);
    let shape = RestShape {
        vertices: shape
            .vertices
            .iter()
            .map(|x| Vec3::new(0.36, 0.48, 0.8) * x.y)
            .collect(),
        ..shape
    };
    let effects = Effects {
        stretch: stretch(compliance),
        ..Effects::default()
    };
    with(body_of_masses(shape, &vec![MASS; links + 1]), effects)
}

/// √(k/m) of these [rad/s].
fn omega() -> f64 {
    1.0 / f64::from(COMPLIANCE * MASS).sqrt()
}

#[test]
fn a_mass_on_a_spring_has_one_frequency() {
    let modes = modes(&pinned(slanted(1, COMPLIANCE), &[0]));
    // Compliance and mass are rounded to f32, and so is the direction.
    assert_relative(modes.stiffest, omega(), 1e-6, "stiffest");
    assert_relative(modes.softest.expect("found"), omega(), 1e-6, "softest");
}

#[test]
fn a_chain_that_hangs_from_a_pin_has_the_modes_of_the_textbook() {
    for links in [2, 5, 32, 300, 1000] {
        let modes = modes(&pinned(slanted(links, COMPLIANCE), &[0]));
        let n = links as f64;
        let textbook = |k: f64| 2.0 * omega() * ((2.0 * k - 1.0) * PI / (4.0 * n + 2.0)).sin();
        // Iterates until ω² changes by less than 3e-3 while an eighth more steps are done.
        let what = format!("of {links} links");
        assert_relative(modes.stiffest, textbook(n), 1e-3, &what);
        assert_relative(modes.softest.expect("found"), textbook(1.0), 1e-3, &what);
    }
}

#[test]
fn a_free_chain_has_those_of_free_ends_and_none_for_its_flight() {
    for links in [1, 4, 40] {
        let modes = modes(&slanted(links, COMPLIANCE));
        let masses = links as f64 + 1.0;
        let textbook = |k: f64| 2.0 * omega() * (k * PI / (2.0 * masses)).sin();
        let what = format!("of {links} links");
        assert_relative(modes.stiffest, textbook(masses - 1.0), 1e-3, &what);
        assert_relative(modes.softest.expect("found"), textbook(1.0), 1e-3, &what);
    }
}

#[test]
fn a_lone_tetrahedron_breathes_with_the_frequency_of_its_volume() {
    let effects = Effects {
        volume: volume(1e-6),
        ..Effects::default()
    };
    let body = with(body_of_masses(tetrahedron(), &[MASS; 4]), effects);
    // ω² = Σ w‖∇V‖²/α; ∇V of three corners is 1/6 m², of the fourth √3/6 m².
    let expected = ((3.0 + 3.0) / 36.0 / f64::from(MASS) / f64::from(1e-6_f32)).sqrt();
    assert_relative(modes(&body).stiffest, expected, 1e-6, "stiffest");
    assert_relative(softest(&body), expected, 1e-6, "softest");
}

#[test]
fn what_is_rigid_has_no_frequency_and_no_energy_after_a_substep() {
    let modes = modes(&pinned(slanted(3, 0.0), &[0]));
    assert_eq!(modes.stiffest, f64::INFINITY);
    assert_eq!(modes.softest, None);
    assert_eq!(half_life(modes.stiffest, 1e-3), 0.0);
    let free = body("cube", cube(0.5, 1), 1000.0);
    assert_eq!(
        Modes::of(&free.topology, &free.particles, &Effects::default()),
        None
    );
}

#[test]
fn the_softest_mode_of_an_incompressible_cube_is_that_of_one_almost_so() {
    let with_volume = |compliance: f32| {
        let effects = Effects {
            stretch: stretch(1e-5),
            volume: volume(compliance),
            ..Effects::default()
        };
        with(body("cube", cube(0.5, 3), 1000.0), effects)
    };
    let rigid = modes(&with_volume(0.0));
    assert_eq!(rigid.stiffest, f64::INFINITY);
    let almost = softest(&with_volume(1e-14));
    let rigid = rigid.softest.expect("found");
    // A stiffer volume strains in a slow mode by about the square of the ratio of the mode's
    // frequency to its own, which is well below a hundredth.
    assert_relative(rigid, almost, 0.01 / RIGID, "softest");
}

/// Energy of the edges and of the motion of a body in f64 [J].
fn energy(body: &reference::Body, compliance: f64) -> f64 {
    let topology = &body.topology;
    let stored: f64 = topology
        .edges
        .ends()
        .zip(&topology.edges.rest_length)
        .map(|([a, b], &rest)| {
            let error = body.x[a as usize].distance(body.x[b as usize]) - f64::from(rest);
            0.5 * error * error / compliance
        })
        .sum();
    let moving: f64 = body
        .v
        .iter()
        .zip(&body.w)
        .filter(|(_, w)| **w > 0.0)
        .map(|(v, w)| 0.5 * v.length_squared() / w)
        .sum();
    stored + moving
}

/// Half-life of the energy in a run of the body that is released after `shape` was added to the
/// positions of its masses along the chain [s].
fn measured(body: Body, h: f64, shape: impl Fn(f64) -> f64) -> f64 {
    let mut body = body;
    let links = body.particles.len() - 1;
    for i in 1..=links {
        let offset = shape(i as f64) * 1e-3;
        body.particles.positions[i] -= (Vec3::new(0.36, 0.48, 0.8) * offset as f32).extend(0.0);
    }
    let compliance = f64::from(COMPLIANCE);
    let mut world = world(settings(0.0, 1.0 / h, 1, 60), body);
    world.settings.substeps = Substeps::new(1).expect("sound");
    let mut reference = reference::World::of(&world);
    let start = energy(&reference.bodies[0], compliance);
    let ticks = 200;
    for _ in 0..ticks {
        reference.tick();
    }
    let left = energy(&reference.bodies[0], compliance) / start;
    h * f64::from(ticks) * 0.5_f64.ln() / left.ln()
}

#[test]
fn a_mass_that_swings_loses_half_its_energy_in_the_predicted_time() {
    for omega_h in [0.05, 0.2, 0.5] {
        let body = pinned(slanted(1, COMPLIANCE), &[0]);
        let h = omega_h / omega();
        let predicted = half_life(softest(&body), h);
        // The energy of the discrete mode is a constant times (1 + ω²h²)^(−n) except for the phase,
        // on which this quadratic form does not depend.
        assert_relative(measured(body, h, |_| 1.0), predicted, 1e-3, "half-life");
    }
}

#[test]
fn the_slowest_mode_of_a_chain_loses_half_its_energy_in_the_predicted_time() {
    let links = 5;
    let body = pinned(slanted(links, COMPLIANCE), &[0]);
    let h = 0.2 / softest(&body);
    let predicted = half_life(softest(&body), h);
    let n = links as f64;
    let mode = |i: f64| (i * PI / (2.0 * n + 1.0)).sin();
    assert_relative(measured(body, h, mode), predicted, 0.02, "half-life");
}

#[test]
fn small_steps_damp_in_proportion_to_their_length() {
    // ln(1 + ω²h²) = ω²h²: the half-life is ln 2/(ω²h).
    let expected = 2.0_f64.ln() / (50.0_f64.powi(2) * 1e-5);
    assert_relative(half_life(50.0, 1e-5), expected, 1e-6, "half-life");
}

#[test]
fn a_cube_of_five_thousand_particles_is_within_the_work_allowed() {
    let effects = Effects {
        stretch: stretch(1e-5),
        volume: volume(1e-7),
        ..Effects::default()
    };
    let coarse = softest(&with(body("cube", cube(0.8, 8), 1000.0), effects));
    let fine = with(body("cube", cube(0.8, 16), 1000.0), effects);
    assert!(fine.particles.len() > 4900);
    let fine = softest(&fine);
    // Twice as many edges of half the length: the stiffness of a cell, E ~ 1/(αL), doubles.
    assert_relative(fine / coarse, 2.0_f64.sqrt(), 0.1, "softest");
}
