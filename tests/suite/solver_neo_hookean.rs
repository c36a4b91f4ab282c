//! Neo-Hookean tetrahedra: their equations, the resulting material, and their recovery.

use crate::support::{
    self, assert_relative, body, body_of_masses, cube, damping, iterate, pinned, random_vector,
    settings, tetrahedron, world,
};
use glam::{DMat3, DVec3, UVec3, Vec3};
use pliant::{
    mesh::Primitive,
    solver::{
        Body, Effects, NeoHookean, PoissonRatio, Topology, World, YoungsModulus,
        deform::{Deformation, Random, deform},
        effects::{Multipliers, elastic::Elastic, strains},
        measure, reference,
    },
};

fn rubber(e: f32, nu: f32) -> NeoHookean {
    NeoHookean {
        youngs_modulus: YoungsModulus::new(e).expect("sound"),
        poisson_ratio: PoissonRatio::new(nu).expect("sound"),
        ..NeoHookean::default()
    }
}

fn of(material: NeoHookean) -> Effects {
    material.into()
}

fn random_matrix(random: &mut Random, half: f32) -> DMat3 {
    DMat3::from_cols_array_2d(&[0; 3].map(|_| random_vector(random, half).as_dvec3().to_array()))
}

#[test]
fn strains_are_those_of_the_paper_less_what_they_are_at_rest() {
    let mut random = Random::new(3);
    let [mu, lambda] = [2.0, 7.0];
    for _ in 0..1000 {
        let h = random_matrix(&mut random, 2.0);
        let f = DMat3::IDENTITY + h;
        let squares: f64 = f.to_cols_array().iter().map(|x| x * x).sum();
        if squares < 1.0 {
            continue;
        }
        let ([shear, volume], _) = strains(h);
        let prime = lambda + mu;
        let paper = |squares: f64, volume: f64| {
            let stretched = volume - 1.0 - mu / prime;
            0.5 * mu * (squares - 3.0) + 0.5 * prime * stretched * stretched
        };
        let ours = 0.5 * mu * shear * shear + 0.5 * lambda * volume * volume;
        let theirs = paper(squares, f.determinant()) - paper(3.0, 1.0);
        // Products of six numbers below 3, a few dozen of them, in f64.
        assert!((ours - theirs).abs() < 1e-10 * (1.0 + theirs.abs()));
    }
}

#[test]
fn strains_have_the_gradients_of_central_differences() {
    const STEP: f64 = 1e-5;
    let mut random = Random::new(4);
    for half in [0.1, 1.0, 2.0] {
        for _ in 0..1000 {
            let h = random_matrix(&mut random, half);
            let (_, slopes) = strains(h);
            // Also collapsed states, where the equation differs.
            for h in [h, h * 0.1 - DMat3::IDENTITY] {
                let ([shear, _], slopes_here) = strains(h);
                for index in 0..9 {
                    let moved = |side: f64| {
                        let mut columns = h.to_cols_array();
                        columns[index] += side * STEP;
                        strains(DMat3::from_cols_array(&columns)).0
                    };
                    let (more, less) = (moved(1.0), moved(-1.0));
                    for row in 0..2 {
                        let expected = (more[row] - less[row]) / (2.0 * STEP);
                        let slope = slopes_here[row].to_cols_array()[index];
                        // The square of the step times a third derivative: for D, about 1/D².
                        let allowed = 1e-8 * (1.0 + 1.0 / (shear * shear)) + 1e-7;
                        assert!(
                            (slope - expected).abs() < allowed,
                            "{row}: {slope}, not {expected}, at a strain of {shear}"
                        );
                    }
                }
            }
            assert!(slopes[0].is_finite());
        }
    }
}

#[test]
fn lanes_equal_the_reference() {
    let mut random = Random::new(6);
    for (e, nu) in [(1e3, 0.0), (1e5, 0.3), (1e7, 0.49), (1e11, 0.499)] {
        for tau in [0.0, 0.02] {
            let material = NeoHookean {
                damping: damping(tau),
                ..rubber(e, nu)
            };
            for half in [0.02, 0.2, 1.0] {
                for _ in 0..100 {
                    let mut body = body_of_masses(tetrahedron(), &[1.0, 2.0, 4.0, 8.0]);
                    // Strained by the displacement since the start of the substep, on which damping
                    // depends.
                    for u in &mut body.particles.displacements {
                        *u = random_vector(&mut random, half).extend(0.0);
                    }
                    let particles = &body.particles;
                    let mut reference = reference::Body::of(&body);
                    for i in 0..particles.len() {
                        (reference.p[i], reference.x[i]) =
                            (particles.position(i), particles.predicted(i));
                    }
                    let mut lambdas = [0.0; 2];
                    for first in [true, false] {
                        reference.solve(&material, 0.01, first);
                        let kept = if first {
                            Multipliers::First(&mut lambdas)
                        } else {
                            Multipliers::Next(&mut lambdas)
                        };
                        iterate(&mut body, &material, 0.01, kept);
                    }
                    for (i, reference) in reference.x.iter().enumerate() {
                        let fast = body.particles.predicted(i);
                        let deviation = fast.distance(*reference);
                        assert!(fast.is_finite());
                        assert!(
                            deviation < 1e-4,
                            "E {e}, ν {nu}, τ {tau}, {half}: off by {deviation}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn a_body_of_rubber_at_rest_does_not_move_by_a_bit() {
    let cube = body("cube", cube(0.5, 3), 1000.0);
    let mut world = world(
        settings(0.0, 60.0, 10, 2),
        support::with(cube, of(rubber(1e6, 0.45))),
    );
    let before = world.state_hash();
    support::run(&mut world, 5.0);
    assert_eq!(world.state_hash(), before);
}

/// A bar of 1000 kg/m³ that hangs by its top, after it has come to rest.
fn hung(material: NeoHookean) -> World {
    let shape = Primitive::Box {
        size: Vec3::new(0.1, 0.4, 0.1),
        cells: UVec3::new(3, 12, 3),
    }
    .build()
    .expect("sound")
    .shape;
    let places = (0..).zip(&shape.vertices);
    let top = places.filter(|(_, x)| x.y > 0.1999).map(|(i, _)| i);
    let top: Vec<u32> = top.collect();
    let bar = pinned(body("bar", shape, 1000.0), &top);
    let material = NeoHookean {
        damping: damping(0.02),
        ..material
    };
    let mut world = world(
        settings(support::G, 60.0, 40, 8),
        support::with(bar, of(material)),
    );
    support::run(&mut world, 4.0);
    world
}

/// Strain along and across the bar, over its middle half.
fn strain_of(world: &World) -> [f64; 2] {
    let body = &world.bodies[0];
    let rest = &body.topology.rest;
    let slope = |axis: usize| {
        let near = |x: &Vec3| x.y.abs() < 0.101;
        let (mut both, mut own) = (0.0, 0.0);
        let all: Vec<(f64, f64)> = rest
            .iter()
            .zip(&body.particles.positions)
            .filter(|(rest, _)| near(rest))
            .map(|(rest, x)| (f64::from(rest[axis]), f64::from(x[axis])))
            .collect();
        let mean = all.iter().map(|(_, x)| x).sum::<f64>() / all.len() as f64;
        for (rest, x) in all {
            both += rest * (x - mean);
            own += rest * rest;
        }
        both / own - 1.0
    };
    [slope(1), slope(0)]
}

#[test]
fn a_hanging_bar_gives_youngs_modulus_and_poisson_ratio_back() {
    for (e, nu) in [(2e5, 0.0), (2e5, 0.3), (2e5, 0.45), (2e5, 0.49)] {
        let world = hung(rubber(e, nu));
        let [along, across] = strain_of(&world);
        // Its middle carries the lower half.
        let tension = 1000.0 * support::G * 0.2;
        let (found_e, found_nu) = (tension / along, -across / along);
        println!("E {e}, ν {nu}: {found_e} and {found_nu} at a strain of {along}");
        assert!(measure::rms_speed(&world.bodies[0].particles) < 1e-3);
        // C19. The middle half of a bar four times as long as wide is almost unaffected by its ends
        // (Saint-Venant), and linear tetrahedra do not lock in uniform strain. A strain of 1 %
        // gives a next-order term of about 1 %.
        assert_relative(found_e, e.into(), 0.05, "E");
        assert!(
            (found_nu - f64::from(nu)).abs() < 0.05 * 0.5,
            "ν is {found_nu}"
        );
    }
}

#[test]
fn a_small_strain_stores_what_the_linear_rows_say() {
    let mut random = Random::new(9);
    let material = rubber(1e5, 0.4);
    let mut body = body("cube", cube(1.0, 2), 1000.0);
    let topology: &Topology = &body.topology.clone();
    let moves: Vec<DVec3> = (0..topology.particles())
        .map(|_| random_vector(&mut random, 1e-3).as_dvec3())
        .collect();
    let corners = NeoHookean::elements(topology).corners();
    let linear: f64 = corners
        .enumerate()
        .flat_map(|(index, corners)| {
            let moves = &moves;
            let rows = material.linear_rows(topology, index, Default::default());
            rows.into_iter().map(move |row| {
                let along = row.gradients.iter().zip(corners);
                let change: f64 = along.map(|(g, i)| g.dot(moves[i as usize])).sum();
                0.5 * change * change / row.compliance
            })
        })
        .sum();
    for (x, by) in body.particles.positions.iter_mut().zip(&moves) {
        *x += by.as_vec3().extend(0.0);
    }
    let stored = measure::elastic_energy(&material, topology, &body.particles);
    // Strains of 1e-3 over edges of 0.5 m, so that next-order terms are a few thousandths.
    assert_relative(stored, linear, 0.02, "energy");
}

#[test]
fn a_body_of_rubber_gets_out_of_the_hard_cases() {
    let mut left = Vec::new();
    for (e, nu) in [(1e5, 0.0), (1e5, 0.3), (1e5, 0.45), (1e6, 0.49)] {
        for (deformation, seconds, allowed) in [
            (Deformation::Squash(0.0), 2.0, 0.01),
            (Deformation::Scale(0.0), 2.0, 0.01),
            (Deformation::Line, 2.0, 0.01),
            (Deformation::Shuffle(1), 5.0, 0.02),
            (Deformation::Mirror, 5.0, 0.02),
            (Deformation::Squash(-1.5), 5.0, 0.02),
            (Deformation::Scale(10.0), 5.0, 0.01),
        ] {
            let material = NeoHookean {
                damping: damping(0.02),
                ..rubber(e, nu)
            };
            let mut body: Body = body("cube", cube(0.5, 3), 1000.0);
            body.effects = of(material);
            deform(&mut body.particles, deformation);
            let mut world = world(settings(0.0, 60.0, 20, 1), body);
            support::run(&mut world, seconds);
            let body = &world.bodies[0];
            let positions = &body.particles.positions;
            let inverted = measure::inverted(&body.topology, positions);
            let error = measure::shape_error(&body.topology, positions);
            if inverted > 0 || error >= allowed {
                left.push(format!(
                    "E {e}, ν {nu}, {deformation:?}: {inverted} inside out, off by {error}"
                ));
            }
        }
    }
    assert!(left.is_empty(), "{left:#?}");
}

#[test]
fn a_free_body_of_rubber_keeps_its_momenta() {
    let mut body = body("cube", cube(0.5, 3), 1000.0);
    body.effects = of(rubber(1e5, 0.45));
    let mut random = Random::new(2);
    for i in 0..body.particles.len() {
        let x = &mut body.particles.positions[i];
        *x += random_vector(&mut random, 0.02).extend(0.0);
        let turn = Vec3::new(1.0, 2.0, 0.5).cross(x.truncate());
        let velocity = turn + Vec3::X + random_vector(&mut random, 0.5);
        body.particles.set_velocity(i, velocity);
    }
    let mut world = world(settings(0.0, 60.0, 10, 1), body);
    let momenta = |world: &World| {
        let particles = &world.bodies[0].particles;
        (
            measure::momentum(particles),
            measure::angular_momentum(particles),
        )
    };
    let before = momenta(&world);
    support::run(&mut world, 1.0);
    let after = momenta(&world);
    // 600 substeps of 64 particles below 2 m, each rounded to 1.2e-7 m in 1/600 s: 7e-5 m/s each
    // time, at random, of masses of 2 kg: 125 kg × 7e-5 × √(600/64) = 0.03; of 125 kg m/s.
    assert!(
        before.0.distance(after.0) < 0.03,
        "{}",
        before.0.distance(after.0)
    );
    // Lever arms are below 2 m.
    assert!(
        before.1.distance(after.1) < 0.06,
        "{}",
        before.1.distance(after.1)
    );
}

#[test]
fn values_that_make_no_rubber_are_refused_with_a_reason() {
    let error = PoissonRatio::new(0.5).expect_err("incompressible");
    assert!(error.to_string().contains("between 0 and 0.499"), "{error}");
    assert!(PoissonRatio::new(-0.1).is_err());
    for e in [0.0, -1.0, f32::NAN] {
        assert!(YoungsModulus::new(e).is_err());
    }
}
