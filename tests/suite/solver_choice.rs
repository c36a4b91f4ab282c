//! The choice between the direct solver and Gauss–Seidel.

use crate::{
    support::{pinned, state_bits, with},
    support_app::{app_of, push, set, ticks},
};
use pliant::{
    mesh::Primitive,
    solver::{
        Body, Compliance, Density, Direct, Effects, Settings, Stretch, Substeps, Threads,
        Tolerance, Topology, Volume, World,
        direct::{Choice, Status},
    },
    study::{Case, Problem, Setting, converge::converge, sweep::run_one},
};
use std::sync::Arc;

use bevy::math::{UVec3, Vec3};

fn auto(tolerance: f32) -> Option<Direct> {
    Some(Direct::with_tolerance(
        Tolerance::new(tolerance).expect("sound"),
    ))
}

/// A bar of 40 × 5 × 5 cm that is held by one end, in a world with these substeps.
fn bar(compliance: f32, substeps: u32, direct: Option<Direct>) -> World {
    let size = Vec3::new(0.4, 0.05, 0.05);
    let cells = UVec3::new(8, 1, 1);
    let mesh = Primitive::Box { size, cells }.build().expect("sound");
    let topology = Arc::new(Topology::new(mesh.shape).expect("sound"));
    let held = topology
        .rest
        .iter()
        .enumerate()
        .filter(|(_, x)| x.x < -0.19);
    let held: Vec<u32> = held
        .map(|(i, _)| topology.numbering.vertex((i as u32).into()).0)
        .collect();
    let body = Body::new("bar", topology, Density::of(1000.0));
    let effects = Effects {
        stretch: Some(Stretch {
            compliance: Compliance::of(compliance),
            ..Stretch::default()
        }),
        volume: Some(Volume::default()),
        direct,
        ..Effects::default()
    };
    World {
        settings: Settings {
            substeps: Substeps::new(substeps).expect("sound"),
            ..Settings::default()
        },
        bodies: vec![pinned(with(body, effects), &held)],
        ..World::default()
    }
}

fn after(mut world: World, ticks: u32) -> World {
    (0..ticks).for_each(|_| world.tick());
    world
}

fn choice(world: &World) -> Choice {
    world.bodies[0].direct.choice().expect("it has a tolerance")
}

fn hashes(worlds: [World; 2]) -> [[Vec<[u32; 4]>; 3]; 2] {
    worlds.map(|world| state_bits(&world.bodies[0].particles))
}

#[test]
fn a_soft_body_is_solved_by_gauss_seidel_and_a_stiff_one_directly_to_the_same_bits() {
    for (compliance, is_direct) in [(1e-1, false), (1e-6, true)] {
        let chosen = after(bar(compliance, 10, auto(0.01)), 30);
        assert_eq!(choice(&chosen).is_direct, is_direct, "{compliance} m/N");
        let status = chosen.bodies[0].direct.status();
        assert_eq!(status == Status::Solved, is_direct);
        let given = is_direct.then_some(Direct::ALWAYS);
        let given = after(bar(compliance, 10, given), 30);
        let [a, b] = hashes([chosen, given]);
        assert_eq!(a, b, "{compliance} m/N");
    }
}

/// In the app as in a plain world, on one thread and on two, also where the compliance changes while
/// it runs.
#[test]
fn the_app_chooses_as_a_plain_world_does_and_again_when_a_parameter_changes() {
    for threads in [1, 2] {
        let mut world = bar(1e-1, 10, auto(0.01));
        world.threads = Threads::new(threads).expect("sound");
        let (mut app, bodies, _) = app_of(&world);
        let mut seen = Vec::new();
        for compliance in [1e-1_f32, 1e-6, 1e-1] {
            push(
                &mut app,
                set(bodies[0], "stretch", "compliance", compliance.into()),
            );
            ticks(&mut app, 10);
            let stretch = world.bodies[0]
                .effects
                .stretch
                .as_mut()
                .expect("it has one");
            stretch.compliance = Compliance::of(compliance);
            world = after(world, 10);
            seen.push(choice(&world).is_direct);
            let particles = app.world().get(bodies[0]).expect("a body");
            assert_eq!(
                state_bits(particles),
                state_bits(&world.bodies[0].particles),
                "{compliance} m/N"
            );
        }
        assert_eq!(seen, [false, true, false]);
    }
}

#[test]
fn a_body_that_is_too_large_is_solved_by_gauss_seidel_and_says_so() {
    let size = Vec3::ONE;
    let cells = UVec3::splat(12);
    let mesh = Primitive::Box { size, cells }.build().expect("sound");
    let mut world = bar(1e-9, 1, auto(0.01));
    let effects = world.bodies[0].effects;
    let topology = Arc::new(Topology::new(mesh.shape).expect("sound"));
    world.bodies = vec![with(
        Body::new("cube", topology, Density::of(1000.0)),
        effects,
    )];
    let world = after(world, 1);
    let Choice {
        is_direct,
        error,
        substeps,
        ratio,
        ..
    } = choice(&world);
    assert!(!is_direct && error > 1.0);
    assert_eq!((substeps, ratio), (None, 0.0));
}

/// Twice the substeps quarter the expected error, and a tolerance of zero always solves directly.
#[test]
fn the_expected_error_falls_with_the_square_of_the_substeps() {
    let errors = [10, 20].map(|substeps| choice(&after(bar(1e-4, substeps, auto(0.5)), 1)).error);
    assert!((errors[0] / errors[1] - 4.0).abs() < 1e-9, "{errors:?}");
    let always = after(bar(1e-1, 10, auto(0.0)), 1);
    assert_eq!(always.bodies[0].direct.status(), Status::Solved);
    assert_eq!(always.bodies[0].direct.choice(), None);
}

/// The error that the choice expects, against the solver error of the study's problems: relative to the
/// converged answer, at substeps at which it is between 0.5 and 60 %. The ratio is 0.8 to 1.6 in all of
/// them; the estimate assumes the same energy in each equation, where the load distributes it otherwise.
#[test]
fn the_expected_error_is_that_of_the_study_within_a_factor_of_two() {
    let mut compared = 0;
    for name in [
        "cantilever_4",
        "cantilever_8",
        "cantilever_16",
        "twisted_bar",
        "hanging_bar",
        "rubber_hanging",
        "fem_beam",
        "hanging_strip",
        "hanging_weave",
    ] {
        let problem = Problem::load(name).expect("built in");
        let case = problem.cases().expect("sound").swap_remove(0);
        let converged = converge(&case).expect("it converges").values[0];
        let all = [1, 2, 4, 8, 16, 32, 64, 128, 256];
        let errors = all.map(|substeps| measured(&case, substeps, converged));
        for (pair, substeps) in errors.windows(2).zip(all) {
            let &[Some(measured), Some(next)] = pair else {
                continue;
            };
            // Not where errors of opposite signs cancel.
            let converges = (2.0..8.0).contains(&(measured / next));
            if !converges || !(0.005..0.6).contains(&measured) {
                continue;
            }
            let expected = expected(&case, substeps);
            println!("{name} at {substeps}: expected {expected:.4}, measured {measured:.4}");
            assert!(
                (0.5..2.0).contains(&(expected / measured)),
                "{name} at {substeps}: expected {expected}, measured {measured}"
            );
            compared += 1;
        }
    }
    assert!(compared >= 20, "{compared}");
}

fn measured(case: &Case, substeps: u32, converged: f64) -> Option<f64> {
    let seconds = case.problem.observe.seconds();
    let run = run_one(case, Setting::xpbd(substeps, 1), seconds).ok()?;
    let value = run.observed.values[0];
    run.observed
        .settled
        .then(|| (value / converged - 1.0).abs())
}

fn expected(case: &Case, substeps: u32) -> f64 {
    let mut world = Setting::xpbd(substeps, 1)
        .applied(&case.world)
        .expect("sound");
    world.bodies[0].effects.direct = auto(1e-3);
    choice(&after(world, 1)).error
}
