//! Ablation: distances that are known, and advice that follows from them.

use pliant::{
    ablation::{Ablation, Advice, Cost, Distance, Options, Variant, report, run},
    scene::Scene,
};
use std::ops::ControlFlow;

/// A cube that floats: nothing deforms it, so that its springs change nothing; a constant
/// acceleration of 1 m/s² moves it.
const FLOATING: &str = r#"Scene(
    title: "A cube is accelerated",
    look_at: "It moves to the right.",
    world: (gravity: (0.0, 0.0, 0.0)),
    bodies: [(
        name: "cube",
        primitive: Box(size: (0.4, 0.4, 0.4), cells: (2, 2, 2)),
        position: (0.0, 1.0, 0.0),
        effects: (stretch: (compliance: 1e-3), uniform: (x: 1.0)),
    )],
    acceptance: (seconds: 1.0, checks: []),
)"#;

fn ablation(seconds: f64) -> Ablation {
    let scene: Scene = FLOATING.parse().expect("a sound scene");
    let options = Options {
        seconds,
        ..Options::default()
    };
    let built = scene.build().expect("a sound scene");
    run(&built, &options, |_| ControlFlow::Continue(()))
        .expect("nothing is overridden")
        .expect("it is not ended")
}

#[test]
fn without_a_constant_acceleration_a_body_ends_where_the_closed_form_says() {
    let ablation = ablation(1.0);
    let names: Vec<_> = ablation.without.iter().map(|it| it.name).collect();
    assert_eq!(
        names,
        ["uniform", "stretch"],
        "in the order in which they act"
    );
    let [uniform, stretch] = [0, 1].map(|it| ablation.without[it].distance.expect("finite"));
    // Implicit Euler from rest: ½at²(1 + 1/n) after n substeps; here n = 600.
    let known = 0.5 * (1.0 + 1.0 / 600.0);
    // f32: a rounding of 6e-8 of about 1 m in each of 600 substeps.
    for distance in [uniform.rms, uniform.max] {
        assert!((distance - known).abs() < 4e-5, "{distance} m");
    }
    // Nothing is stretched but by rounding.
    assert!(stretch.max < 4e-5, "{} m", stretch.max);
    // The diagonal of the cube, to the rounding of a sum.
    assert!((ablation.size - 0.4 * 3.0_f64.sqrt()).abs() < 1e-6);
    assert_eq!(ablation.ticks, 60);
}

#[test]
fn twice_the_substeps_are_the_yardstick() {
    let ablation = ablation(1.0);
    // ½at²(1/n − 1/2n), as above.
    let known = 0.25 / 600.0;
    let yardstick = ablation.yardstick();
    assert!((yardstick - known).abs() < 8e-5, "{yardstick} m");
    let advice: Vec<_> = ablation
        .without
        .iter()
        .map(|it| ablation.advice(it))
        .collect();
    assert_eq!(advice[0], Advice::Keep);
    assert_ne!(advice[1], Advice::Keep, "no spring acts");
}

fn made(saved_ms: f64, noise: f64, distance: Option<f64>) -> Ablation {
    let variant = |name, ms, rms: Option<f64>| Variant {
        name,
        title: name,
        carriers: 1,
        cost: Cost { ms, noise },
        distance: rms.map(|rms| Distance {
            rms,
            max: rms,
            unmatched: 0,
        }),
    };
    Ablation {
        seconds: 1.0,
        ticks: 60,
        substeps: 10,
        threads: 1,
        size: 1.0,
        cost: Cost { ms: 1.0, noise },
        without: vec![variant("bend", 1.0 - saved_ms, distance)],
        finer: Some(variant("substeps", 2.0, Some(1e-3))),
    }
}

#[test]
fn an_effect_is_advised_against_if_it_costs_time_and_is_not_seen() {
    let advice = |ablation: Ablation| ablation.advice(&ablation.without[0]);
    assert_eq!(advice(made(0.31, 0.02, Some(5e-4))), Advice::Remove);
    assert_eq!(advice(made(0.01, 0.02, Some(5e-4))), Advice::Negligible);
    assert_eq!(advice(made(0.31, 0.02, Some(2e-3))), Advice::Keep);
    assert_eq!(
        advice(made(0.31, 0.02, None)),
        Advice::Keep,
        "it diverges without it"
    );
    let unknown = Ablation {
        finer: None,
        ..made(0.31, 0.02, Some(5e-4))
    };
    assert_eq!(advice(unknown), Advice::Keep, "without a yardstick");
    let chaotic = Ablation {
        size: 0.01,
        ..made(0.31, 0.02, Some(5e-4))
    };
    assert_eq!(
        advice(chaotic),
        Advice::Keep,
        "twice the substeps move 10 %"
    );
    let mut others = made(0.31, 0.02, Some(5e-4));
    if let Some(distance) = &mut others.without[0].distance {
        distance.unmatched = 1;
    }
    assert_eq!(
        advice(others),
        Advice::Keep,
        "a grain is missing without it"
    );
}

/// Grains that are missing are seen, and the scene has the size of what came.
#[test]
fn an_emitter_is_no_effect_that_changes_nothing() {
    let scene = Scene::load("fountain").expect("built in").scene;
    let options = Options {
        seconds: 0.25,
        ..Options::default()
    };
    let built = scene.build().expect("a sound scene");
    let ablation = run(&built, &options, |_| ControlFlow::Continue(()))
        .expect("nothing is overridden")
        .expect("it is not ended");
    let emitter = ablation.without.iter().find(|it| it.name == "emitter");
    let distance = emitter.and_then(|it| it.distance).expect("finite");
    // 250 per second.
    assert_eq!(distance.unmatched, 62);
    assert!(ablation.size > 0.5, "{} m", ablation.size);
    let text = report::text("Fountain", &ablation);
    assert!(text.contains("62 more or fewer"), "{text}");
    assert!(!text.contains("NaN") && !text.contains("inf %"), "{text}");
}

#[test]
fn the_report_says_what_a_removal_saves_and_changes() {
    let text = report::text("Sheet", &made(0.31, 0.02, Some(5e-4)));
    assert!(
        text.contains("bend: 31 % of the tick, 0.05 % of what is seen"),
        "{text}"
    );
    assert!(
        text.contains("Twice the substeps move the bodies by 1.00 mm (0.10 %)"),
        "{text}"
    );
    let chaotic = Ablation {
        size: 0.01,
        ..made(0.31, 0.02, Some(5e-4))
    };
    let text = report::text("Sheet", &chaotic);
    assert!(
        text.contains("by 1.00 mm (10 %): the scene is chaotic or not converged"),
        "{text}"
    );
    let json = report::json("sheet", &made(0.01, 0.02, None));
    assert_eq!(json["without"][0]["diverged"], true);
    assert_eq!(json["without"][0]["advice"], "keep");
}
