//! The strain limit: one-sided, and without any effect where it is not active.

use crate::support::{
    G, bits, body, body_of_masses, chain, iterate, pinned, random_vector, run, settings, stretch,
    with, world,
};
use glam::{DVec3, Vec3};
use pliant::solver::{
    Body, Effects, RestShape, Strain, StrainLimit, deform::Random, effects::Multipliers,
    measure::edge_errors, reference,
};

fn limit(limit: f32) -> StrainLimit {
    StrainLimit {
        limit: Strain::new(limit).expect("sound"),
    }
}

/// Unconnected edges along x, 1 m long, the ends of each at 0 and `lengths` [m].
fn edges(lengths: &[f32]) -> Body {
    let count = lengths.len() as u32;
    let mut body = body(
        "edges",
        RestShape {
            vertices: (0..count)
                .flat_map(|i| [0.0, 1.0].map(|x| Vec3::new(x, i as f32, 0.0)))
                .collect(),
            edges: (0..count).map(|i| [2 * i, 2 * i + 1]).collect(),
            ..RestShape::default()
        },
        1.0,
    );
    for (i, &length) in lengths.iter().enumerate() {
        for end in 0..2 {
            let x = &mut body.particles.positions[2 * i + end];
            *x = Vec3::new(end as f32 * length, 0.0, 0.0).extend(x.w);
        }
    }
    body.particles.settle();
    // Displaced by −0: adding 0 to it changes its bits.
    let nothing = Vec3::splat(-0.0).extend(0.0);
    body.particles.displacements.fill(nothing);
    body
}

#[test]
fn an_edge_beyond_its_limit_is_put_back_to_it_and_the_reference_says_so_too() {
    let mut random = Random::new(3);
    for _ in 0..1000 {
        let mut body = body_of_masses(chain(1, 0.5), &[1.0, 3.0]);
        for x in &mut body.particles.positions {
            *x += random_vector(&mut random, 0.4).extend(0.0);
        }
        body.particles.settle();
        let place = |body: &Body, i: usize| body.particles.predicted(i);
        let start = [place(&body, 0), place(&body, 1)];
        let before = start[0].distance(start[1]);
        let mut reference = reference::Body::of(&body);
        reference.solve(&limit(0.2), 0.01, true);
        iterate(&mut body, &limit(0.2), 0.01, Multipliers::Unused);
        let expected = before.min(0.5 * 1.2);
        let [a, b] = [place(&body, 0), place(&body, 1)];
        // Positions below 1 m, accurate to 6e-8 m; the limit to the same relative accuracy.
        assert!((a.distance(b) - expected).abs() < 5e-7);
        for i in 0..2 {
            assert!(reference.x[i].distance(place(&body, i)) < 5e-7);
        }
        let middle = |[a, b]: [DVec3; 2]| a + b * 3.0;
        assert!(middle([a, b]).distance(middle(start)) < 1e-6, "momentum");
    }
}

/// In a block of eight edges, inactive ones go through the same lanes as active ones.
#[test]
fn edges_below_their_limit_keep_their_bits_beside_edges_above_it() {
    let lengths = [1.0, 1.05, 1.5, 0.5, 0.0, 1.1, 2.0, 1.0999, 1.2, 0.9, 1.0];
    let before = edges(&lengths);
    let mut after = before.clone();
    iterate(&mut after, &limit(0.1), 0.01, Multipliers::Unused);
    let [before, after] = [&before, &after].map(|body| bits(&body.particles.displacements));
    for (i, &length) in lengths.iter().enumerate() {
        let ends = 2 * i..2 * i + 2;
        let moved = before[ends.clone()] != after[ends];
        assert_eq!(moved, length > 1.1, "edge {i} of {length} m");
    }
}

#[test]
fn a_limit_that_nothing_reaches_changes_no_bit_of_a_run() {
    let swing = |strain_limit| {
        let effects = Effects {
            stretch: stretch(1e-4),
            strain_limit,
            ..Effects::default()
        };
        let chain = pinned(body("chain", chain(20, 0.05), 0.1), &[0]);
        let mut world = world(settings(G, 60.0, 10, 2), with(chain, effects));
        world.bodies[0].set_velocity(Vec3::X);
        run(&mut world, 2.0);
        bits(&world.bodies[0].particles.positions)
    };
    assert_eq!(swing(None), swing(Some(limit(1.0))));
    assert_ne!(swing(None), swing(Some(limit(0.0))));
}

#[test]
fn no_edge_passes_its_limit_however_heavy_the_load() {
    const LINKS: u32 = 10;
    const SUBSTEPS: u32 = 100;
    for mass in [1.0, 10.0, 100.0] {
        let hung = body_of_masses(chain(LINKS as usize, 0.1), &[mass; LINKS as usize + 1]);
        let effects = Effects {
            strain_limit: Some(limit(0.05)),
            stretch: stretch(0.01),
            ..Effects::default()
        };
        let mut world = world(
            settings(G, 60.0, SUBSTEPS, 1),
            with(pinned(hung, &[0]), effects),
        );
        run(&mut world, 5.0);
        let body = &world.bodies[0];
        let h = 1.0 / (60.0 * f64::from(SUBSTEPS));
        // After its projection, an edge is extended by those below that move its end: each by at
        // most the fall per substep of the mass that hangs on it.
        let left = f64::from(LINKS * LINKS) * G * h * h;
        for error in edge_errors(&body.topology, &body.particles.positions) {
            assert!(error < 0.1 * 0.05 + left, "{mass} kg: longer by {error} m");
        }
        // The yarn alone would stretch by 1 cm per newton.
        let top = edge_errors(&body.topology, &body.particles.positions).fold(0.0, f64::max);
        assert!(top > 0.1 * 0.049, "the load reaches the limit: {top}");
    }
}
