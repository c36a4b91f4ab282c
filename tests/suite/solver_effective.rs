//! The effective stiffness of the solver, for bodies whose stretch under their weight is known.

use crate::support::{
    G, assert_relative, body, body_of_masses, chain, cube, damping, pinned, settings, stretch,
    volume, with, world,
};
use pliant::solver::{
    EffectStates, Effects, ElasticKind, Stretch, World,
    effective::{CLOSE, ConstraintWork, EffectiveCompliance},
};

const LINKS: usize = 32;
const LINK: f32 = 1e-3;
const COMPLIANCE: f32 = 2e-6;
const RATE: f64 = 60.0;

/// Ticks until the body hangs still; between ticks, drag takes a fifth of all velocities.
fn settle(world: &mut World, seconds: f64) {
    for _ in 0..(seconds * RATE) as usize {
        world.tick();
        let particles = &mut world.bodies[0].particles;
        for i in 0..particles.len() {
            particles.set_velocity(i, particles.velocity(i) * 0.8);
        }
    }
    world.bodies[0].particles.stop();
}

/// Masses of 1 kg on links of a millimeter, hanging from a pin.
fn hanging(compliance: f32, tau: f32, substeps: u32, iterations: u32) -> World {
    let effects = Effects {
        stretch: Some(Stretch {
            damping: damping(tau),
            ..stretch(compliance).expect("given")
        }),
        ..Effects::default()
    };
    let body = body_of_masses(chain(LINKS, LINK), &[1.0; LINKS + 1]);
    let body = pinned(with(body, effects), &[0]);
    let mut world = world(settings(G, RATE, substeps, iterations), body);
    settle(&mut world, 40.0);
    world
}

fn stretch_work(world: &World) -> ConstraintWork {
    let body = &world.bodies[0];
    ConstraintWork::of(
        &body.effects.stretch.expect("given"),
        &body.topology,
        &body.particles,
        body.states.multipliers(ElasticKind::Stretch),
        world.settings.substep_seconds(),
    )
}

fn volume_work(world: &World) -> ConstraintWork {
    let body = &world.bodies[0];
    ConstraintWork::of(
        &body.effects.volume.expect("given"),
        &body.topology,
        &body.particles,
        body.states.multipliers(ElasticKind::Volume),
        world.settings.substep_seconds(),
    )
}

fn effective(world: &World) -> EffectiveCompliance {
    stretch_work(world).compliance().expect("it is loaded")
}

/// Sum of the weights times their descent from the rest shape, twice the work [J].
fn lowered(world: &World) -> f64 {
    let body = &world.bodies[0];
    let particles = (0..).zip(&body.particles.positions);
    particles
        .filter(|(_, x)| x.w > 0.0)
        .map(|(i, x)| {
            let down = f64::from(body.topology.rest[i].y) - body.particles.position(i).y;
            G / f64::from(x.w) * down
        })
        .sum()
}

/// Tension of link k, counted from 0 at the pin [N].
fn tension(k: usize) -> f64 {
    (LINKS - k) as f64 * G
}

/// Resolution of f32 at rest: ½ ulp(x)/(gh²) of its stretch, see the single edge.
fn rest_tolerance(world: &World) -> f64 {
    let lowest = world.bodies[0].particles.positions[LINKS].y.abs();
    let h = world.settings.substep_seconds();
    0.5 * f64::from(lowest * f32::EPSILON) / (G * h * h)
}

/// Closed form of the result of one iteration per substep. A projected link matches its own
/// tension; neighbors that are projected later extend it by h²(1 + τ/h) w times their tensions.
fn expected(world: &World, compliance: f64, tau: f64) -> EffectiveCompliance {
    let h = world.settings.substep_seconds();
    let edges = &world.bodies[0].topology.edges;
    let turns: Vec<u32> = edges.ends().map(|[upper, _]| upper).collect();
    let turn = |k: u32| turns.iter().position(|&link| link == k);
    let (mut all, mut longer) = (0.0, 0.0);
    for k in 0..LINKS as u32 {
        let own = tension(k as usize);
        all += own * own;
        for neighbor in [k.wrapping_sub(1), k + 1] {
            if turn(neighbor) > turn(k) {
                longer += own * tension(neighbor as usize);
            }
        }
    }
    EffectiveCompliance {
        requested: compliance,
        effective: compliance + (h * h + tau * h) * longer / all,
    }
}

#[test]
fn the_effective_compliance_of_a_chain_matches_its_excess_sag() {
    let requested: f64 = (0..LINKS).map(|k| tension(k) * tension(k)).sum::<f64>() * 2e-6;
    for substeps in [1, 2, 5, 10, 20, 40] {
        let world = hanging(COMPLIANCE, 0.0, substeps, 1);
        let effective = effective(&world);
        let factor = effective.factor().expect("elastic");
        // In addition, it has settled to 1e-4.
        let tolerance = 1e-4 + rest_tolerance(&world);
        let what = format!("factor at {substeps} substeps");
        assert_relative(factor, lowered(&world) / requested, tolerance, &what);
        let expected = expected(&world, 2e-6, 0.0);
        assert_relative(effective.requested, expected.requested, 1e-6, "requested");
        assert_relative(effective.effective, expected.effective, tolerance, &what);
    }
}

#[test]
fn with_one_iteration_forces_are_the_tensions_however_soft_the_chain_behaves() {
    for substeps in [1, 10] {
        let world = hanging(COMPLIANCE, 0.0, substeps, 1);
        let h = world.settings.substep_seconds();
        let body = &world.bodies[0];
        for ([upper, _], lambda) in body
            .topology
            .edges
            .ends()
            .zip(body.states.multipliers(ElasticKind::Stretch))
        {
            let force = -f64::from(*lambda) / (h * h);
            let tolerance = 1e-4 + 10.0 * rest_tolerance(&world);
            assert_relative(force, tension(upper as usize), tolerance, "tension");
        }
    }
}

#[test]
fn damping_softens_one_iteration_in_proportion_to_the_substep() {
    for substeps in [5, 20] {
        let world = hanging(COMPLIANCE, 0.02, substeps, 1);
        let expected = expected(&world, 2e-6, f64::from(0.02_f32));
        let tolerance = 1e-4 + rest_tolerance(&world);
        assert_relative(
            effective(&world).effective,
            expected.effective,
            tolerance,
            "effective",
        );
        let advised = effective(&world).substeps(&world.settings, damping(0.02));
        assert_eq!(advised, None, "more than a thousand substeps");
    }
}

#[test]
fn the_suggested_number_of_substeps_is_the_smallest_sufficient_one() {
    let factor = |substeps| {
        let world = hanging(COMPLIANCE, 0.0, substeps, 1);
        effective(&world).factor().expect("elastic")
    };
    for substeps in [2, 10, 20] {
        let world = hanging(COMPLIANCE, 0.0, substeps, 1);
        let effective = effective(&world);
        assert!(effective.is_limited());
        let advised = effective.substeps(&world.settings, damping(0.0));
        let advised = advised.expect("below a thousand");
        assert!(factor(advised) <= CLOSE, "{advised} are too few");
        assert!(factor(advised - 1) > CLOSE, "{advised} are too many");
    }
}

#[test]
fn the_suggested_number_of_substeps_suffices_with_several_iterations() {
    for iterations in [2, 4, 10] {
        let world = hanging(COMPLIANCE, 0.0, 5, iterations);
        let advised = effective(&world).substeps(&world.settings, damping(0.0));
        let world = hanging(COMPLIANCE, 0.0, advised.expect("few"), iterations);
        let effective = effective(&world);
        assert!(effective.factor().expect("elastic") <= CLOSE);
        assert!(!effective.is_limited());
    }
}

#[test]
fn a_rigid_chain_has_the_compliance_of_the_solver_alone() {
    let world = hanging(0.0, 0.0, 10, 1);
    let effective = effective(&world);
    let expected = expected(&world, 0.0, 0.0);
    assert_eq!(effective.requested, 0.0);
    assert_relative(effective.effective, expected.effective, 1e-3, "effective");
    assert_eq!(effective.factor(), None);
    assert_eq!(effective.substeps(&world.settings, damping(0.0)), None);
    assert!(effective.is_limited());
    assert_eq!(stretch_work(&world).factors(), None);
}

/// A block of 0.2 m that hangs from its upper face.
fn block(substeps: u32, iterations: u32) -> World {
    let effects = Effects {
        stretch: stretch(1e-5),
        volume: volume(1e-9),
        ..Effects::default()
    };
    let body = with(body("block", cube(0.2, 3), 1000.0), effects);
    let top: Vec<u32> = (0..)
        .zip(body.topology.rest.iter())
        .filter(|(_, x)| x.y > 0.0999)
        .map(|(i, _)| i)
        .collect();
    let mut world = world(settings(G, RATE, substeps, iterations), pinned(body, &top));
    settle(&mut world, 20.0);
    world
}

#[test]
fn the_excess_sag_of_a_block_lies_between_the_two_reported_factors() {
    let exact = block(10, 100);
    let converged = effective(&exact).factor().expect("elastic");
    assert_relative(converged, 1.0, 1e-4, "converged");
    let mut gap = f64::INFINITY;
    for substeps in [2, 5, 10, 20, 40] {
        let world = block(substeps, 1);
        let mut work = stretch_work(&world);
        work.add(volume_work(&world));
        // Forces times strains are the load times its displacement, up to the square of the
        // strains.
        let tolerance = lowered(&world) / (0.2 * 0.2 * 0.2 * 1000.0 * G * 0.2);
        assert_relative(work.effective, lowered(&world), 4.0 * tolerance, "work");
        let (least, most) = work.factors().expect("elastic");
        let truth = lowered(&world) / lowered(&exact);
        assert!(
            least < truth && truth < most,
            "{truth} is not between {least} and {most}"
        );
        assert!(most / least < gap, "the bounds close in");
        gap = most / least;
    }
    assert!(gap < 1.03, "at 40 substeps they are {gap} apart");
}

#[test]
fn a_lone_edge_is_never_limited() {
    let effects = Effects {
        stretch: stretch(1e-5),
        ..Effects::default()
    };
    let body = pinned(
        with(body_of_masses(chain(1, LINK), &[1.0, 1.0]), effects),
        &[0],
    );
    let mut world = world(settings(G, RATE, 1, 1), body);
    settle(&mut world, 5.0);
    assert_relative(
        effective(&world).factor().expect("elastic"),
        1.0,
        1e-4,
        "factor",
    );
    assert_eq!(
        effective(&world).substeps(&world.settings, damping(0.0)),
        Some(1)
    );
}

#[test]
fn without_load_or_without_multipliers_nothing_is_reported() {
    let effects = Effects {
        stretch: stretch(1e-5),
        volume: volume(1e-9),
        ..Effects::default()
    };
    for gravity in [0.0, G] {
        let body = with(body("cube", cube(0.2, 2), 1000.0), effects);
        let mut world = world(settings(gravity, RATE, 10, 1), body);
        for _ in 0..30 {
            world.tick();
        }
        assert_eq!(
            stretch_work(&world).compliance(),
            None,
            "in free fall at {gravity}"
        );
        assert_eq!(
            volume_work(&world).compliance(),
            None,
            "in free fall at {gravity}"
        );
    }
    let mut world = hanging(COMPLIANCE, 0.0, 10, 1);
    world.bodies[0].states = EffectStates::default();
    assert_eq!(stretch_work(&world), ConstraintWork::default());
    assert_eq!(ConstraintWork::default().compliance(), None);
}

#[test]
fn sums_of_ticks_are_means_weighted_by_load() {
    let mut world = hanging(COMPLIANCE, 0.0, 10, 1);
    let still = effective(&world).effective;
    // A displacement that makes it vibrate: each tick gives a different value, their sum the same.
    world.bodies[0].particles.positions[LINKS].y -= 1e-3;
    let mut sum = ConstraintWork::default();
    for _ in 0..600 {
        world.tick();
        sum.add(stretch_work(&world));
    }
    assert_relative(
        sum.compliance().expect("loaded").effective,
        still,
        0.05,
        "mean",
    );
}
