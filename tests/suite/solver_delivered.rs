//! The effective stiffness of the solver, for bodies whose stretch under their weight is known.

use crate::support::{
    G, assert_relative, body, body_of_masses, chain, cube, damping, pinned, settings, stretch,
    volume, with, world,
};
use pliant::solver::{
    Delivered, EffectStates, Effects, ElasticKind, Stretch, World,
    delivered::{CLOSE, Work},
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

fn stretch_work(world: &World) -> Work {
    let body = &world.bodies[0];
    Work::of(
        &body.effects.stretch.expect("given"),
        &body.topology,
        &body.particles,
        body.states.multipliers(ElasticKind::Stretch),
        world.settings.substep_seconds(),
    )
}

fn volume_work(world: &World) -> Work {
    let body = &world.bodies[0];
    Work::of(
        &body.effects.volume.expect("given"),
        &body.topology,
        &body.particles,
        body.states.multipliers(ElasticKind::Volume),
        world.settings.substep_seconds(),
    )
}

fn delivered(world: &World) -> Delivered {
    stretch_work(world).delivered().expect("it is loaded")
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
fn may_rest(world: &World) -> f64 {
    let lowest = world.bodies[0].particles.positions[LINKS].y.abs();
    let h = world.settings.substep_seconds();
    0.5 * f64::from(lowest * f32::EPSILON) / (G * h * h)
}

/// Closed form of the result of one iteration per substep. A projected link matches its own
/// tension; neighbors that are projected later extend it by h²(1 + τ/h) w times their tensions.
fn expected(world: &World, compliance: f64, tau: f64) -> Delivered {
    let h = world.settings.substep_seconds();
    let edges = &world.bodies[0].topology.edges;
    let turns: Vec<u32> = edges.ends().map(|[upper, _]| upper).collect();
    let turn = |k: u32| turns.iter().position(|&link| link == k);
    let (mut all, mut longer) = (0.0, 0.0);
    for k in 0..LINKS as u32 {
        let own = tension(k as usize);
        all += own * own;
        for neighbour in [k.wrapping_sub(1), k + 1] {
            if turn(neighbour) > turn(k) {
                longer += own * tension(neighbour as usize);
            }
        }
    }
    Delivered {
        asked: compliance,
        got: compliance + (h * h + tau * h) * longer / all,
    }
}

#[test]
fn a_chain_is_found_as_much_too_soft_as_it_hangs_too_low() {
    let asked: f64 = (0..LINKS).map(|k| tension(k) * tension(k)).sum::<f64>() * 2e-6;
    for substeps in [1, 2, 5, 10, 20, 40] {
        let world = hanging(COMPLIANCE, 0.0, substeps, 1);
        let delivered = delivered(&world);
        let factor = delivered.factor().expect("elastic");
        // In addition, it has settled to 1e-4.
        let tolerance = 1e-4 + may_rest(&world);
        let what = format!("factor at {substeps} substeps");
        assert_relative(factor, lowered(&world) / asked, tolerance, &what);
        let expected = expected(&world, 2e-6, 0.0);
        assert_relative(delivered.asked, expected.asked, 1e-6, "asked");
        assert_relative(delivered.got, expected.got, tolerance, &what);
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
            let tolerance = 1e-4 + 10.0 * may_rest(&world);
            assert_relative(force, tension(upper as usize), tolerance, "tension");
        }
    }
}

#[test]
fn damping_makes_one_iteration_softer_by_its_share_of_the_substep() {
    for substeps in [5, 20] {
        let world = hanging(COMPLIANCE, 0.02, substeps, 1);
        let expected = expected(&world, 2e-6, f64::from(0.02_f32));
        let tolerance = 1e-4 + may_rest(&world);
        assert_relative(delivered(&world).got, expected.got, tolerance, "got");
        let advised = delivered(&world).substeps(&world.settings, damping(0.02));
        assert_eq!(advised, None, "more than a thousand substeps");
    }
}

#[test]
fn as_many_substeps_as_are_said_to_do_are_the_fewest_that_do() {
    let factor = |substeps| {
        let world = hanging(COMPLIANCE, 0.0, substeps, 1);
        delivered(&world).factor().expect("elastic")
    };
    for substeps in [2, 10, 20] {
        let world = hanging(COMPLIANCE, 0.0, substeps, 1);
        let delivered = delivered(&world);
        assert!(delivered.is_limited());
        let advised = delivered.substeps(&world.settings, damping(0.0));
        let advised = advised.expect("below a thousand");
        assert!(factor(advised) <= CLOSE, "{advised} are too few");
        assert!(factor(advised - 1) > CLOSE, "{advised} are too many");
    }
}

#[test]
fn with_several_iterations_a_substep_they_do_as_well() {
    for iterations in [2, 4, 10] {
        let world = hanging(COMPLIANCE, 0.0, 5, iterations);
        let advised = delivered(&world).substeps(&world.settings, damping(0.0));
        let world = hanging(COMPLIANCE, 0.0, advised.expect("few"), iterations);
        let delivered = delivered(&world);
        assert!(delivered.factor().expect("elastic") <= CLOSE);
        assert!(!delivered.is_limited());
    }
}

#[test]
fn a_rigid_chain_has_the_compliance_of_the_solver_alone() {
    let world = hanging(0.0, 0.0, 10, 1);
    let delivered = delivered(&world);
    let expected = expected(&world, 0.0, 0.0);
    assert_eq!(delivered.asked, 0.0);
    assert_relative(delivered.got, expected.got, 1e-3, "got");
    assert_eq!(delivered.factor(), None);
    assert_eq!(delivered.substeps(&world.settings, damping(0.0)), None);
    assert!(delivered.is_limited());
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
fn a_block_hangs_too_low_by_a_factor_between_the_two_that_are_found() {
    let exact = block(10, 100);
    let converged = delivered(&exact).factor().expect("elastic");
    assert_relative(converged, 1.0, 1e-4, "converged");
    let mut gap = f64::INFINITY;
    for substeps in [2, 5, 10, 20, 40] {
        let world = block(substeps, 1);
        let mut work = stretch_work(&world);
        work.add(volume_work(&world));
        // Forces times strains are the load times its displacement, up to the square of the
        // strains.
        let tolerance = lowered(&world) / (0.2 * 0.2 * 0.2 * 1000.0 * G * 0.2);
        assert_relative(work.got, lowered(&world), 4.0 * tolerance, "work");
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
        delivered(&world).factor().expect("elastic"),
        1.0,
        1e-4,
        "factor",
    );
    assert_eq!(
        delivered(&world).substeps(&world.settings, damping(0.0)),
        Some(1)
    );
}

#[test]
fn without_load_or_without_multipliers_nothing_is_said() {
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
            stretch_work(&world).delivered(),
            None,
            "in free fall at {gravity}"
        );
        assert_eq!(
            volume_work(&world).delivered(),
            None,
            "in free fall at {gravity}"
        );
    }
    let mut world = hanging(COMPLIANCE, 0.0, 10, 1);
    world.bodies[0].states = EffectStates::default();
    assert_eq!(stretch_work(&world), Work::default());
    assert_eq!(Work::default().delivered(), None);
}

#[test]
fn sums_of_ticks_are_means_weighted_by_load() {
    let mut world = hanging(COMPLIANCE, 0.0, 10, 1);
    let still = delivered(&world).got;
    // A displacement that makes it vibrate: each tick gives a different value, their sum the same.
    world.bodies[0].particles.positions[LINKS].y -= 1e-3;
    let mut sum = Work::default();
    for _ in 0..600 {
        world.tick();
        sum.add(stretch_work(&world));
    }
    assert_relative(sum.delivered().expect("loaded").got, still, 0.05, "mean");
}
