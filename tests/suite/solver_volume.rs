//! Volumes: A7 and A14 of the methods; elements that are mirrored, flat, or reduced to a point.

use crate::support::{
    self, G, assert_relative, body, body_of_masses, damping, pinned, predicted, random_vector,
    settings, state_bits, tetrahedron, volume, world,
};
use glam::{DVec3, Vec3};
use pliant::solver::{
    Body, Stiffness, Volume,
    deform::Random,
    effects::{Multipliers, volume_and_gradients},
    measure, reference,
    topology::volume as exact_volume,
};

/// One iteration over the body's tetrahedra.
fn iterate(body: &mut Body, effect: &Volume, h: f32) {
    support::iterate(body, effect, h, Multipliers::Unused);
}

fn now(body: &Body) -> f64 {
    measure::tetrahedron_volumes(&body.topology, &predicted(&body.particles)).sum()
}

/// Central differences of V in f64: exact but for rounding, as V is linear in each coordinate.
fn differences(x: [DVec3; 4]) -> [DVec3; 4] {
    std::array::from_fn(|corner| {
        let along = |axis: DVec3| {
            let [mut more, mut less] = [x, x];
            more[corner] += axis * 0.25;
            less[corner] -= axis * 0.25;
            (exact_volume(more) - exact_volume(less)) / 0.5
        };
        DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z))
    })
}

fn random_corners(random: &mut Random) -> [Vec3; 4] {
    std::array::from_fn(|_| random_vector(random, 1.0))
}

#[test]
fn gradients_of_the_volume_are_its_central_differences() {
    let mut random = Random::new(7);
    for _ in 0..1000 {
        let x = random_corners(&mut random);
        let (volume, gradients) = volume_and_gradients(x);
        let wide = x.map(|x| x.as_dvec3());
        // Products of two lengths below 2√3 m, a dozen roundings of 2⁻²⁴ each.
        assert!((f64::from(volume) - exact_volume(wide)).abs() < 1e-5);
        for (gradient, expected) in gradients.iter().zip(differences(wide)) {
            assert!(
                gradient.as_dvec3().distance(expected) < 1e-5,
                "{gradient} is not {expected}"
            );
        }
    }
}

#[test]
fn gradients_of_the_volume_conserve_momenta() {
    let mut random = Random::new(8);
    for _ in 0..1000 {
        let x = random_corners(&mut random);
        let (_, gradients) = volume_and_gradients(x);
        let push: Vec3 = gradients.iter().sum();
        let turn: Vec3 = x.iter().zip(&gradients).map(|(x, g)| x.cross(*g)).sum();
        // As above, with an additional lever arm of √3 m.
        assert!(push.length() < 1e-6, "push {push}");
        assert!(turn.length() < 1e-5, "turn {turn}");
    }
}

#[test]
fn the_reference_moves_corners_along_the_central_differences() {
    let mut random = Random::new(9);
    for _ in 0..100 {
        let mut start = body("tetrahedron", tetrahedron(), 24.0);
        start.effects.volume = volume(0.0);
        for x in &mut start.particles.positions {
            *x += random_vector(&mut random, 0.2).extend(0.0);
        }
        let mut reference = reference::Body::of(&start);
        let before: [DVec3; 4] = std::array::from_fn(|i| reference.x[i]);
        let gradients = differences(before);
        let square: f64 = gradients.iter().map(|g| g.length_squared()).sum();
        let rest = f64::from(start.topology.tetrahedra.rest_volume[0]);
        let step = -(exact_volume(before) - rest) / square;
        reference.solve_elastic(0.01, true);
        for i in 0..4 {
            let expected = gradients[i] * step;
            // Masses are f32: those of 24 kg/m³ × 1/24 m³ are 1 kg except for one rounding.
            assert!((reference.x[i] - before[i]).distance(expected) < 1e-6 * step.abs());
        }
    }
}

#[test]
fn one_projection_restores_a_small_change_of_volume_but_for_its_square() {
    let mut body = body("tetrahedron", tetrahedron(), 1000.0);
    body.particles.positions[1].x = 1.01;
    let error = now(&body) * 6.0 - 1.0;
    assert_relative(error, 0.01, 1e-4, "change of volume");
    iterate(&mut body, &Volume::default(), 0.01);
    // V is cubic in the step: the remaining error is of the order of the square of the initial one.
    assert!((now(&body) * 6.0 - 1.0).abs() < 1e-4);
}

#[test]
fn a_mirrored_element_comes_back_within_a_hundred_iterations() {
    // Inverted exactly, and beyond its own volume: V = −1.5 V₀.
    for stretched in [1.0, 1.5] {
        let mut body = body("tetrahedron", tetrahedron(), 1000.0);
        body.particles.positions[1].x = -stretched;
        assert_relative(now(&body) * 6.0, f64::from(-stretched), 1e-6, "V/V₀");
        let mut iterations = 0;
        while now(&body) <= 0.0 {
            iterate(&mut body, &Volume::default(), 0.01);
            iterations += 1;
            assert!(iterations <= 100, "still inside out: {}", now(&body));
        }
        for _ in 0..100 {
            iterate(&mut body, &Volume::default(), 0.01);
        }
        assert_relative(now(&body) * 6.0, 1.0, 1e-5, "V/V₀ in the end");
    }
}

#[test]
fn an_element_in_one_point_opens_the_same_way_every_time() {
    let opened = [0, 1].map(|_| {
        let mut body = body("tetrahedron", tetrahedron(), 1000.0);
        for x in &mut body.particles.positions {
            *x = Vec3::splat(2.0).extend(x.w);
        }
        for _ in 0..100 {
            iterate(&mut body, &Volume::default(), 0.01);
        }
        // Positions at 2 m are accurate to 2⁻²³ m, and V/V₀ to six times that.
        assert_relative(now(&body) * 6.0, 1.0, 1e-5, "V/V₀");
        state_bits(&body.particles)
    });
    assert_eq!(opened[0], opened[1]);
}

#[test]
fn an_element_flat_or_in_a_line_opens_and_throws_nothing_far_away() {
    let flat: fn(Vec3) -> Vec3 = |x| Vec3::new(x.x, x.y, 0.0);
    let line: fn(Vec3) -> Vec3 = |x| Vec3::new(x.x + 0.3 * x.y - 0.2 * x.z, 0.0, 0.0);
    for squeeze in [flat, line] {
        let mut body = body("tetrahedron", tetrahedron(), 1000.0);
        for x in &mut body.particles.positions {
            *x = squeeze(x.truncate()).extend(x.w);
        }
        for _ in 0..200 {
            iterate(&mut body, &Volume::default(), 0.01);
            for x in predicted(&body.particles) {
                assert!(x.truncate().length() < 5.0, "thrown to {x}");
            }
        }
        assert_relative(now(&body) * 6.0, 1.0, 1e-5, "V/V₀");
    }
}

#[test]
fn elements_of_ten_micrometers_and_of_ten_kilometers_behave_alike() {
    let ratios = [1e-5, 1.0, 1e4_f32].map(|scale| {
        let mut shape = tetrahedron();
        for vertex in &mut shape.vertices {
            *vertex *= scale;
        }
        let mut body = body("tetrahedron", shape, 1000.0);
        body.particles.positions[1].x *= 0.5;
        body.particles.positions[2].y *= -0.25;
        let before = now(&body);
        iterate(&mut body, &Volume::default(), 0.01);
        let rest = f64::from(body.topology.tetrahedra.rest_volume[0]);
        (before / rest, now(&body) / rest)
    });
    for ratio in ratios {
        // The scales are not powers of two, so that each product is rounded.
        assert_relative(ratio.0, ratios[1].0, 1e-6, "V/V₀ before");
        assert_relative(ratio.1, ratios[1].1, 1e-5, "V/V₀ after one projection");
    }
}

#[test]
fn an_element_of_pins_does_nothing_and_makes_no_nan() {
    let mut body = pinned(body("tetrahedron", tetrahedron(), 1000.0), &[0, 1, 2, 3]);
    body.particles.positions[1].x = -3.0;
    let before = state_bits(&body.particles);
    iterate(&mut body, &Volume::default(), 0.01);
    assert_eq!(state_bits(&body.particles), before);
}

#[test]
fn a_loaded_element_gives_way_by_pressure_over_modulus_whatever_its_size() {
    // A base of area A is pinned, and the apex carries m: the gradient of V there is A/3, so the
    // pressure is 3mg/A and ΔV/V = −p/K = −1 %.
    for side in [0.1, 0.3, 1.0_f32] {
        let mut shape = tetrahedron();
        for vertex in &mut shape.vertices {
            *vertex *= side;
        }
        let area = f64::from(side) * f64::from(side) / 2.0;
        let load = (2e3 * area / (3.0 * G)) as f32;
        let mut body = body_of_masses(shape, &[1.0, 1.0, load, 1.0]);
        body.effects.volume = Some(Volume {
            bulk_modulus: Stiffness::new(2e5).expect("sound"),
            damping: damping(0.05),
            ..Volume::default()
        });
        let mut world = world(settings(G, 60.0, 10, 1), pinned(body, &[0, 1, 3]));
        support::run(&mut world, 5.0);
        let body = &world.bodies[0];
        let change = measure::volume_error(&body.topology, &body.particles.positions);
        // Resolution of f32 for the apex: ½ ulp(1 m)/(gh²) = 2e-3. V is proportional to the height.
        assert_relative(change, -0.01, 3e-3, &format!("ΔV/V at {side} m"));
    }
}
