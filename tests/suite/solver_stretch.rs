//! Edges: A5, A6, A13, A14 and A16 of the methods, and the closed forms of hanging masses.

use crate::support::{
    self, G, assert_relative, bits, body_of_masses, chain, damping, iterate, pinned, position,
    settings, state_bits, stretch, with, world,
};
use glam::{Vec3, Vec4};
use pliant::solver::{
    Body, Effects, ElasticKind, RestShape, Stiffness, Stretch, World, effects::Multipliers,
};

fn at(body: &Body, i: usize) -> Vec3 {
    body.particles.predicted(i).as_vec3()
}

#[test]
fn one_projection_closes_a_lone_rigid_edge_and_splits_the_correction_by_inverse_masses() {
    let mut body = body_of_masses(chain(1, 0.5), &[1.0, 3.0]);
    body.particles.positions[1] = Vec3::new(0.3, -0.4, 0.6).extend(1.0 / 3.0);
    let before = [at(&body, 0), at(&body, 1)];
    iterate(&mut body, &Stretch::default(), 0.01, Multipliers::Unused);
    let moved = [at(&body, 0) - before[0], at(&body, 1) - before[1]];
    let length = at(&body, 0).distance(at(&body, 1));
    assert!((length - 0.5).abs() <= 1e-6 * 0.5, "length {length}");
    // Positions below 1 m are rounded by at most 2⁻²⁵ m, for displacements of at least 0.07 m.
    assert_relative(
        f64::from(moved[0].length() / moved[1].length()),
        3.0,
        1e-6,
        "ratio",
    );
    let momentum = moved[0] + 3.0 * moved[1];
    assert!(
        momentum.length() < 4.0 * 2.0_f32.powi(-25),
        "momentum {momentum}"
    );
}

/// A mass that hangs from a pin on an edge, lowered gently.
fn hanging(rest_length: f32, mass: f32, effect: Stretch, rate: f64, substeps: u32) -> World {
    let effects = Effects {
        stretch: Some(effect),
        ..Effects::default()
    };
    let body = body_of_masses(chain(1, rest_length), &[1.0, mass]);
    world(
        settings(G, rate, substeps, 1),
        pinned(with(body, effects), &[0]),
    )
}

#[test]
fn a_hanging_kilogram_reads_nine_point_eight_one_newtons() {
    for compliance in [0.0, 1e-5, 1e-3] {
        let effect = Stretch {
            damping: damping(0.05),
            ..stretch(compliance).expect("given")
        };
        let mut world = hanging(0.1, 1.0, effect, 60.0, 10);
        support::run(&mut world, 5.0);
        let h = world.settings.substep_seconds();
        let force =
            f64::from(world.bodies[0].states.multipliers(ElasticKind::Stretch)[0]) / (h * h);
        assert_relative(-force, G, 1e-3, &format!("force at {compliance} m/N"));
    }
}

#[test]
fn an_edge_settles_at_compliance_times_force_whatever_the_substep() {
    // A particle does not move by less than half an ulp, so it may rest wherever gravity's
    // displacement in a substep, gh², is rounded off: within ½ ulp(x)/(gh²) of its stretch. With
    // x = 2 mm and h = 1/3840 s that is 2e-4; at 1 m it would be 5 %. The edge is therefore short.
    let extension = 1e-3;
    for rate in [30.0, 60.0] {
        for substeps in [1, 4, 16, 64] {
            for compliance in [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6_f32] {
                let force = extension / f64::from(compliance);
                let effect = Stretch {
                    damping: damping(0.02),
                    ..stretch(compliance).expect("given")
                };
                let mut world = hanging(1e-3, (force / G) as f32, effect, rate, substeps);
                support::run(&mut world, 2.0);
                let stretched = -f64::from(position(&world, 1).y) - 1e-3;
                let what = format!("stretch at {compliance} m/N, {substeps} substeps at {rate} Hz");
                assert_relative(stretched, extension, 1e-3, &what);
            }
        }
    }
}

#[test]
fn axial_stiffness_does_not_depend_on_how_finely_a_rope_is_divided() {
    // Every link adds its own FL/(EA) under the kilogram at the end and the 0.1 kg at each joint
    // between.
    for links in [1, 2, 4_u8] {
        let effects = Effects {
            stretch: Some(Stretch {
                axial_stiffness: Stiffness::new(100.0).expect("sound"),
                damping: damping(0.02),
                ..Stretch::default()
            }),
            ..Effects::default()
        };
        let mut masses = vec![0.1; usize::from(links)];
        masses.push(1.0);
        let link = 0.01 / f64::from(links);
        let shape = chain(usize::from(links), link as f32);
        let body = pinned(with(body_of_masses(shape, &masses), effects), &[0]);
        let mut world = world(settings(G, 60.0, 10, 200), body);
        support::run(&mut world, 3.0);
        let stretched = -f64::from(position(&world, usize::from(links)).y) - 0.01;
        let expected: f64 = (0..links)
            .map(|joints_below| G * (1.0 + 0.1 * f64::from(joints_below)) * link / 100.0)
            .sum();
        assert_relative(
            stretched,
            expected,
            1e-3,
            &format!("stretch of {links} links"),
        );
    }
}

/// Ends 0 and 1 at the same position, with a rest length along z.
fn collapsed(masses: [f32; 2], rest: [Vec3; 2]) -> Body {
    let shape = RestShape {
        vertices: rest.to_vec(),
        edges: vec![[0, 1]],
        ..RestShape::default()
    };
    let mut body = body_of_masses(shape, &masses);
    for x in &mut body.particles.positions {
        *x = Vec3::splat(0.5).extend(x.w);
    }
    body
}

#[test]
fn an_edge_without_length_opens_along_its_rest_direction() {
    let mut body = collapsed([1.0, 1.0], [Vec3::ZERO, Vec3::new(0.0, 0.0, 0.25)]);
    iterate(&mut body, &Stretch::default(), 0.01, Multipliers::Unused);
    assert_eq!(at(&body, 0), Vec3::new(0.5, 0.5, 0.375));
    assert_eq!(at(&body, 1), Vec3::new(0.5, 0.5, 0.625));
}

#[test]
fn an_edge_without_length_even_at_rest_is_left_alone() {
    let mut body = collapsed([1.0, 1.0], [Vec3::ONE, Vec3::ONE]);
    let before = state_bits(&body.particles);
    iterate(&mut body, &Stretch::default(), 0.01, Multipliers::Unused);
    assert_eq!(state_bits(&body.particles), before);
}

#[test]
fn an_edge_between_two_pins_does_nothing_and_makes_no_nan() {
    let mut body = pinned(body_of_masses(chain(1, 0.5), &[1.0, 1.0]), &[0, 1]);
    body.particles.positions[0].y = 1.0;
    body.particles.positions[1].y = -2.0;
    let before = state_bits(&body.particles);
    let mut lambda = [7.0];
    iterate(
        &mut body,
        &Stretch::default(),
        0.01,
        Multipliers::First(&mut lambda),
    );
    assert_eq!(state_bits(&body.particles), before);
    assert!(lambda[0].is_finite());
}

#[test]
fn without_compliance_the_bits_are_those_of_classic_position_based_dynamics() {
    let start = body_of_masses(chain(4, 0.3), &[1.0, 2.0, 0.5, 1.5, 3.0]);
    let mut body = pinned(start, &[0]);
    let w: Vec<f32> = body.particles.positions.iter().map(|x| x.w).collect();
    let mut random = pliant::solver::deform::Random::new(16);
    for x in &mut body.particles.positions {
        *x += support::random_vector(&mut random, 0.2).extend(0.0);
    }
    let p: Vec<Vec3> = (0..5).map(|i| at(&body, i)).collect();
    let mut u = [Vec3::ZERO; 5];
    for _ in 0..20 {
        // Müller and others 2007: no multiplier, no compliance; displacements from the initial
        // positions.
        for ([a, b], &rest) in body
            .topology
            .edges
            .ends()
            .zip(&body.topology.edges.rest_length)
        {
            let (a, b) = (a as usize, b as usize);
            let d = (p[b] - p[a]) + (u[b] - u[a]);
            let length = d.length();
            let s = (rest - length) / ((w[a] + w[b]) * length);
            u[a] -= d * (w[a] * s);
            u[b] += d * (w[b] * s);
        }
    }
    let mut lambda = vec![0.0; 4];
    for iteration in 0..20 {
        let multipliers = Multipliers::of_iteration(&mut lambda, (iteration, 20, false));
        iterate(&mut body, &Stretch::default(), 0.01, multipliers);
    }
    let of = |x: &[Vec3], w: &[f32]| -> Vec<Vec4> {
        x.iter().zip(w).map(|(x, w)| x.extend(*w)).collect()
    };
    assert_eq!(
        bits(&body.particles.displacements),
        bits(&of(&u, &[0.0; 5]))
    );
    assert_eq!(bits(&body.particles.positions), bits(&of(&p, &w)));
}
