//! Contracts of `--set`: it reaches the world and every body that carries an effect, it has an
//! effect on the simulation, and an invalid name gives an error with the valid ones.

use pliant::{
    scene::{
        Scene,
        overrides::Override,
        run::{Run, RunOptions, run},
    },
    solver::Effects,
};

fn set(words: &[&str]) -> Result<Run, String> {
    let set: Result<Vec<Override>, _> = words.iter().map(|word| word.parse()).collect();
    let options = RunOptions {
        seconds: Some(0.2),
        set: set.map_err(|error| error.to_string())?,
        ..RunOptions::default()
    };
    let scene = Scene::load("edges_and_volume")
        .expect("a sound scene")
        .scene;
    let built = scene.build().expect("a sound scene");
    run(&built, &options, |_| ()).map_err(|error| error.to_string())
}

/// Fails unless setting `word` is rejected with each of the parts in the message.
#[track_caller]
fn refused(word: &str, parts: &[&str]) {
    let Err(message) = set(&[word]) else {
        panic!("{word} was set");
    };
    for part in parts {
        assert!(message.contains(part), "“{part}” is not in “{message}”");
    }
}

#[test]
fn an_override_reaches_the_world() {
    let run =
        set(&["substeps=7", "iterations=3", "rate=30", "gravity_y=-1.5"]).expect("all can be set");
    assert_eq!(run.settings.substeps.get(), 7);
    assert_eq!(run.settings.iterations.get(), 3);
    assert_eq!(run.settings.rate.get(), 30.0);
    assert_eq!(run.settings.gravity.y, -1.5);
    assert_eq!(
        run.history.len(),
        7,
        "0.2 s at 30 ticks a second, and the start"
    );
}

#[test]
fn an_override_reaches_every_body_that_carries_the_effect_and_no_other() {
    let run = set(&["stretch.compliance=2e-3", "ground.friction=0.25"]).expect("both can be set");
    let compliance = |effects: &Effects| effects.stretch.map(|stretch| stretch.compliance.get());
    let all: Vec<_> = run
        .world
        .bodies
        .iter()
        .map(|body| compliance(&body.effects))
        .collect();
    assert_eq!(all, [Some(2e-3), None, Some(2e-3)]);
    for body in &run.world.bodies {
        let friction = body.effects.ground.map(|ground| ground.friction.get());
        assert_eq!(friction, Some(0.25), "{}", body.name);
    }
}

#[test]
fn an_override_changes_the_result_and_one_to_the_current_value_does_not() {
    let hash = |words: &[&str]| set(words).expect("it can be set").state_hash;
    let as_it_is = hash(&[]);
    assert_eq!(as_it_is, hash(&["substeps=20"]));
    assert_ne!(as_it_is, hash(&["substeps=21"]));
    assert_ne!(as_it_is, hash(&["stretch.compliance=1e-3"]));
}

#[test]
fn an_invalid_override_is_named_with_the_valid_words() {
    refused("substeps", &["substeps", "name=value"]);
    refused("substeps=many", &["many", "is not a number"]);
    refused(
        "substps=20",
        &[
            "substps",
            "substeps",
            "iterations",
            "rate",
            "stretch",
            "ground",
        ],
    );
    refused("strech.compliance=1", &["strech", "stretch", "volume"]);
    for word in [
        "stretch.complience",
        "Stretch.compliance",
        "Stretch.complience",
        "STRETCH.COMPLIANCE",
    ] {
        let suggestion = format!("“{word}” (did you mean “stretch.compliance”?)");
        refused(&format!("{word}=1"), &[&suggestion]);
    }
    refused("Substeps=20", &["(did you mean “substeps”?)"]);
    refused("stretch.complience=1", &["stretch.damping"]);
    refused(
        "sticky_ground.height=1",
        &["sticky_ground", "no body", "stretch, volume, ground"],
    );
}

#[test]
fn a_value_out_of_range_is_refused_with_the_range() {
    refused("substeps=0", &["substeps is 0", "between 1 and 10000"]);
    refused("substeps=2.5", &["substeps is 2.5", "a whole number"]);
    refused("rate=0", &["rate is 0", "between 0.1"]);
    refused("gravity_y=NaN", &["gravity is NaN", "finite"]);
    refused(
        "stretch.compliance=-1",
        &["compliance is -1", "between 0 and 1e12"],
    );
    refused(
        "ground.restitution=1.5",
        &["restitution is 1.5", "between 0 and 1"],
    );
}
