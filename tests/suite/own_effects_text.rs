//! The text of effects of an app: what is read, what is refused before it is lost, and what an app without
//! the plugin is told.

use crate::support_app::app_with;
use bevy::prelude::*;
use pliant::{
    effect::{
        Effect, EffectPlugin, EffectUnfit, OwnEffect, OwnEffectError, OwnEffects, needs_plugin,
    },
    recording::{About, Snapshot, SnapshotError},
    scene::{BodyParameters, Scene, SceneEffects, spawn},
    simulation::{Moment, plain::bodies_in_order},
};
use serde::{Deserialize, Serialize};

/// An effect one of whose values has the name by which files leave an effect out.
#[derive(Component, Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
enum Breeze {
    None,
    Blows(f32),
}

impl Effect for Breeze {
    const NAME: &'static str = "breeze";
    const TITLE: &'static str = "Breeze";
    const SUMMARY: &'static str = "Says how it blows.";
    type State = ();
}

/// A length in a type of its own.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Metres(f32);

/// An effect with a type of its own inside, and with the hook.
#[derive(Component, Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[component(on_add = needs_plugin::<Reach>)]
struct Reach {
    length: Metres,
}

impl Effect for Reach {
    const NAME: &'static str = "reach";
    const TITLE: &'static str = "Reach";
    const SUMMARY: &'static str = "Reaches so far.";
    type State = ();
}

/// An effect that writes less than it reads.
#[derive(Component, Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Forgetful {
    #[serde(skip_serializing)]
    kept: u32,
}

impl Effect for Forgetful {
    const NAME: &'static str = "forgetful";
    const TITLE: &'static str = "Forgetful";
    const SUMMARY: &'static str = "Does not write what it needs.";
    type State = ();
}

fn known() -> OwnEffects {
    OwnEffects::default().with::<Breeze>().with::<Reach>()
}

fn effects(text: &str) -> SceneEffects {
    let parameters = BodyParameters::parse_with("test", text, &known());
    parameters
        .unwrap_or_else(|error| panic!("{text}: {error}"))
        .effects
}

/// A scene with a body of these effects.
fn text(effects: &str) -> String {
    format!(
        "Scene(title: \"Test\", look_at: \"Nothing.\", bodies: [(name: \"cube\", primitive: Box(\
         size: (0.4, 0.4, 0.4), cells: (2, 2, 2)), effects: ({effects}))], acceptance: (seconds: 1, \
         checks: []))"
    )
}

fn scene(effects: &str) -> Scene {
    Scene::parse_with("test.ron", &text(effects), &known()).expect("sound")
}

#[test]
fn a_value_called_none_is_the_value_and_not_the_absence_of_the_effect() {
    let read = effects("effects: (breeze: None, reach: None)");
    assert_eq!(
        read.own,
        [OwnEffect::new(&Breeze::None).expect("it can be written")]
    );
    let read = effects("effects: (breeze: Blows(2))");
    assert_eq!(
        read.own,
        [OwnEffect::new(&Breeze::Blows(2.0)).expect("it can be written")]
    );
    // In a body as in the clipboard, and written again.
    let scene = scene("breeze: None");
    let parameters = BodyParameters {
        density: None,
        effects: scene.bodies[0].effects.clone(),
    };
    let written = parameters.to_text().expect("it can be written");
    assert_eq!(effects(&written), parameters.effects);
}

#[test]
fn extensions_that_a_file_enables_hold_in_the_effects_of_an_app() {
    let given = OwnEffect::new(&Reach {
        length: Metres(2.0),
    })
    .expect("it can be written");
    let plain = effects("effects: (reach: (length: (2)))");
    assert_eq!(plain.own, std::slice::from_ref(&given));
    let file = |header: &str, length: &str| {
        let text = format!("{header}{}", text(&format!("reach: (length: {length})")));
        Scene::parse_with("test.ron", &text, &known())
    };
    let header =
        "// One that has a header.\n#![enable(unwrap_newtypes)]\n#![enable(implicit_some)]\n";
    let scene = file(header, "2").expect("sound");
    assert_eq!(scene.bodies[0].effects.own, [given]);
    for (header, length) in [("", "2"), (header, "far")] {
        let error = file(header, length).expect_err("no length");
        assert!(error.to_string().contains("reach: "), "{error}");
    }
}

#[test]
fn an_effect_that_would_not_be_read_back_is_refused_when_it_is_written() {
    let given = Forgetful { kept: 3 };
    let error = OwnEffect::new(&given).expect_err("a field is missing");
    assert!(
        matches!(error, OwnEffectError::ReadBack { .. }),
        "{error:?}"
    );
    let said = error.to_string();
    assert!(
        said.contains("kept") && said.contains("Deserialize"),
        "{said}"
    );

    let mut app = app_with(|app| {
        app.add_plugins(EffectPlugin::<Forgetful>::default().saved());
    });
    spawn(
        &scene("stretch: ()").build().expect("sound"),
        app.world_mut(),
    );
    let body = bodies_in_order(app.world_mut())[0];
    app.world_mut().entity_mut(body).insert(given);
    let error = Snapshot::take(app.world_mut(), About::default()).expect_err("unreadable");
    assert!(
        matches!(error, SnapshotError::EffectText { .. }),
        "{error:?}"
    );
    let said = error.to_string();
    assert!(said.contains("forgetful of body “cube”"), "{said}");
    // A moment leaves it on the body.
    let moment = Moment::take(app.world_mut(), None).expect("between ticks");
    moment.restore(app.world_mut());
    assert_eq!(app.world().get::<Forgetful>(body), Some(&given));
}

#[test]
fn an_effect_of_a_scene_whose_plugin_is_missing_is_reported_once() {
    let mut app = app_with(|_| ());
    let scene = scene("breeze: Blows(1), reach: (length: (1))");
    let bodies = spawn(&scene.build().expect("sound"), app.world_mut());
    let messages = app.world().resource::<Messages<EffectUnfit>>();
    let said: Vec<_> = messages.iter_current_update_messages().collect();
    let told: Vec<_> = said.iter().map(|it| (it.body, it.effect)).collect();
    assert_eq!(told, [(bodies[0], "breeze"), (bodies[0], "reach")]);
    for message in said {
        assert!(
            message.text.contains("add `EffectPlugin::<"),
            "{}",
            message.text
        );
    }
}
