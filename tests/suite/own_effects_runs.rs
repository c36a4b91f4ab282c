//! Effects of an app in the stress tests, in ablations, and in refinements of the substeps.

use crate::own_effects::{Breeze, SCENE, built, own};
use pliant::{
    ablation,
    effect::OwnEffect,
    scene::{BuiltScene, Scene},
    solver::Substeps,
    study::{Problem, Refine, refine},
    torture,
};
use std::ops::ControlFlow;

/// The scene with a body in free fall, so that the order of the solver is seen.
fn falling() -> BuiltScene {
    let text = SCENE
        // Per substep and not per time: with it, nothing converges.
        .replace("calm: (factor: 1e-3),", "")
        .replace("ground: (),", "")
        .replace("stretch: (compliance: 1e-4),", "");
    let scene = Scene::parse_with("falling.ron", &text, &own()).expect("sound");
    scene.build().expect("sound")
}

#[test]
fn torture_runs_the_effects_of_the_app() {
    let built = built();
    let row = torture::scene::run_built("breeze", &built, 0.3, &|_| ()).expect("it runs");
    let steps = row
        .outcomes
        .iter()
        .map(|it| (it.member.substeps, it.member.iterations));
    assert_eq!(
        steps.collect::<Vec<_>>(),
        [(10, 1), (5, 1), (20, 1), (1, 1), (10, 4)]
    );
    assert!(row.passed());
    let figures: Vec<_> = row.outcomes[0].figures.iter().map(|it| it.name).collect();
    assert_eq!(figures, ["bodies not finite", "runs with other bits"]);

    // The effect acts: one that is not a number makes the body diverge.
    let mut wild = built.clone();
    let given = Breeze {
        acceleration: f32::NAN,
        ..Breeze::default()
    };
    wild.own[0] = vec![OwnEffect::new(&given).expect("it can be written")];
    let row = torture::scene::run_built("wild", &wild, 0.3, &|_| ()).expect("it runs");
    assert_eq!(row.failed(), row.outcomes.len());
    let worst = row.worst().and_then(|outcome| outcome.worst());
    assert_eq!(worst.map(|figure| figure.name), Some("bodies not finite"));
}

#[test]
fn ablation_and_overrides_reach_the_effects_of_the_app() {
    let options = ablation::Options {
        seconds: 0.5,
        set: vec!["breeze.acceleration=5".parse().expect("sound")],
        rounds: 2,
        ..Default::default()
    };
    let found = ablation::run(&built(), &options, |_| ControlFlow::Continue(()));
    let found = found.expect("sound").expect("not stopped");
    let breeze = found
        .without
        .iter()
        .find(|it| it.name == "breeze")
        .expect("it is carried");
    assert_eq!(breeze.carriers, 1);
    // a t²/2 of one body of two, less what the ground and the breeze's tiring take.
    let distance = breeze.distance.expect("no body diverged").max;
    assert!((0.2..0.7).contains(&distance), "{distance} m");
}

#[test]
fn a_refinement_finds_the_order_and_what_is_left() {
    let options = Refine {
        seconds: 0.5,
        ..Refine::default()
    };
    let found = refine(&falling(), &options, |_| ControlFlow::Continue(()));
    let found = found.expect("it can be refined").expect("not stopped");
    let substeps: Vec<_> = found.runs.iter().map(|it| it.substeps).collect();
    assert_eq!(substeps, [10, 20, 40, 80, 160]);
    // Implicit Euler: the error of free fall is halved with the length of a substep.
    for run in &found.runs[..3] {
        let order = run.order.expect("both differ");
        assert!((order - 1.0).abs() < 0.1, "{run:?}");
    }
    let [coarse, .., finest] = &found.runs[..] else {
        panic!("{found:?}");
    };
    assert_eq!(finest.to_finest, Some(0.0));
    // That of the coarsest is known: g t h/2 for the body that nothing else accelerates.
    let left = found.left.expect("it converges");
    let error = coarse.to_finest.expect("both are finite") + left;
    let known = 9.81 * 0.5 / 600.0 / 2.0;
    assert!(
        (error / known - 1.0).abs() < 0.05,
        "{error} m, expected {known} m"
    );

    let mut fine = falling();
    fine.world.settings.substeps = Substeps::new(Substeps::MAX).expect("the maximum");
    let error = refine(&fine, &options, |_| ControlFlow::Continue(())).expect_err("no finer run");
    assert!(error.to_string().contains("at least two runs"), "{error}");
}

#[test]
fn a_study_refuses_an_effect_that_its_reference_does_not_know() {
    let mut problem = Problem::load("hanging_mass").expect("built in");
    assert!(problem.cases().is_ok());
    let given = OwnEffect::new(&Breeze::default()).expect("it can be written");
    problem.scene.bodies[0].effects.own = vec![given.clone()];
    problem
        .levels
        .iter_mut()
        .for_each(|level| level.bodies[0].effects.own = vec![given.clone()]);
    let said = problem
        .cases()
        .expect_err("unknown to the reference")
        .to_string();
    assert!(
        said.contains("breeze") && said.contains("study::refine"),
        "{said}"
    );
}
