//! Effects of an app in scene files, snapshots, recordings and undo.

use crate::support_app::{app_with, push, ticks};
use bevy::{math::DVec3, prelude::*};
use pliant::{
    SoftBodyPlugins,
    effect::{
        Effect, EffectPlugin, EffectRegistry, OwnEffect, OwnEffects, Parameter, Scale, Stretch,
    },
    recording::{
        About, Recorder, RecordingError, Snapshot, SnapshotError, open_with, record, replay,
        replay_with,
    },
    scene::{
        BodyParameters, BuiltScene, Scene, SceneError, run::headless, save::Definition, spawn,
    },
    simulation::{
        Action, Active, Asleep, CurrentSubstep, EffectSystems, Moment, NewBody, SolverSystems,
        SubstepSchedule,
        plain::{self, bodies_in_order},
        state_hash,
    },
    solver::{Particles, Threads},
};
use serde::{Deserialize, Serialize};
use std::{fs, path::PathBuf, sync::Arc};

/// A breeze that tires: more than its parameters is saved.
#[derive(Component, Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Breeze {
    pub acceleration: f32,
    pub spent: f64,
    pub tag: Option<String>,
}

impl Default for Breeze {
    fn default() -> Self {
        Self {
            acceleration: 0.1,
            spent: 0.0,
            tag: None,
        }
    }
}

impl Effect for Breeze {
    const NAME: &'static str = "breeze";
    const TITLE: &'static str = "Breeze";
    const SUMMARY: &'static str = "Pushes a body along x, ever less.";
    const PARAMETERS: &'static [Parameter<Self>] = &[Parameter {
        name: "acceleration",
        title: "Acceleration",
        unit: "m/s²",
        help: "Acceleration along x at the start.",
        range: (0.1, 100.0),
        scale: Scale::Linear,
        get: |breeze| breeze.acceleration.into(),
        set: |breeze, value| {
            breeze.acceleration =
                pliant::solver::InvalidValue::unless_finite("acceleration", value as f32)?;
            Ok(())
        },
    }];
    type State = ();
    fn add_systems(schedules: &mut Schedules) {
        schedules.add_systems(
            SubstepSchedule,
            blow.in_set(EffectSystems(Self::NAME))
                .in_set(SolverSystems::Forces),
        );
    }
    fn when_added() -> Option<Self> {
        Some(Self::default())
    }
}

fn blow(step: Res<CurrentSubstep>, mut bodies: Query<(&mut Particles, &mut Breeze), Active>) {
    for (mut particles, mut breeze) in &mut bodies {
        let h = f64::from(step.seconds(&particles));
        let strength = f64::from(breeze.acceleration) / (1.0 + breeze.spent);
        breeze.bypass_change_detection().spent += h / 3.0;
        for i in 0..particles.len() {
            if particles.positions[i].w > 0.0 {
                particles.accelerate(i, DVec3::X * (strength * h));
            }
        }
    }
}

/// Substeps since the effect began.
#[derive(Component, Debug, Default, PartialEq)]
struct Age(u32);

/// An effect that acts after the breeze, and does not commute with it.
#[derive(Component, Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
struct Calm {
    factor: f64,
}

impl Effect for Calm {
    const NAME: &'static str = "calm";
    const TITLE: &'static str = "Calm";
    const SUMMARY: &'static str = "Slows a body.";
    type State = Age;
    fn add_systems(schedules: &mut Schedules) {
        schedules.add_systems(
            SubstepSchedule,
            slow.in_set(EffectSystems(Self::NAME))
                .in_set(SolverSystems::Forces),
        );
    }
}

fn slow(mut bodies: Query<(&mut Particles, &Calm, &mut Age), Active>) {
    for (mut particles, calm, mut age) in &mut bodies {
        age.0 += 1;
        for i in 0..particles.len() {
            let v = particles.velocity_f64(i);
            particles.accelerate(i, v * -calm.factor);
        }
    }
}

/// The effects of the app of these tests.
pub fn own() -> OwnEffects {
    OwnEffects::default().with::<Breeze>().with::<Calm>()
}

pub const SCENE: &str = r#"Scene(
    title: "Breeze",
    look_at: "It drifts.",
    bodies: [
        (
            name: "cube",
            primitive: Box(size: (0.4, 0.4, 0.4), cells: (2, 2, 2)),
            position: (0.0, 0.5, 0.0),
            effects: (
                calm: (factor: 1e-3),
                stretch: (compliance: 1e-4),
                ground: (),
                breeze: (
                    acceleration: 2.5, // m/s²
                    tag: "a \"b\"",
                ),
            ),
        ),
        (
            name: "still",
            primitive: Box(size: (0.4, 0.4, 0.4), cells: (2, 2, 2)),
            position: (0.0, 0.5, 1.0),
            effects: (stretch: (compliance: 1e-4), ground: (), breeze: None),
        ),
    ],
    acceptance: (seconds: 0.5, checks: []),
)"#;

fn scene() -> Scene {
    Scene::parse_with("breeze.ron", SCENE, &own()).expect("sound")
}

pub fn built() -> BuiltScene {
    scene().build().expect("it can be built")
}

fn snapshot(app: &mut App) -> Snapshot {
    Snapshot::take(app.world_mut(), About::default()).expect("all effects are saved")
}

fn breeze(app: &mut App, body: usize) -> Option<Breeze> {
    let body = bodies_in_order(app.world_mut())[body];
    app.world().get::<Breeze>(body).cloned()
}

/// A file of this test in the folder for temporary ones.
fn file(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("pliant own {} {name}", std::process::id()))
}

/// How far the body has drifted along x.
fn drift(app: &mut App, body: usize) -> f32 {
    let body = bodies_in_order(app.world_mut())[body];
    let particles = app.world().get::<Particles>(body).expect("a body");
    particles.positions.iter().map(|x| x.x).sum::<f32>() / particles.len() as f32
}

#[test]
fn a_scene_file_names_an_effect_of_the_app() {
    let effects = &scene().bodies[0].effects;
    // In the order in which they act, not in that of the file.
    assert_eq!(effects.names(), ["stretch", "ground", "breeze", "calm"]);
    let mut app = headless(&built());
    let expected = Breeze {
        acceleration: 2.5,
        tag: Some("a \"b\"".to_owned()),
        ..Breeze::default()
    };
    assert_eq!(breeze(&mut app, 0), Some(expected));
    assert_eq!(breeze(&mut app, 1), None);
    ticks(&mut app, 20);
    assert!(drift(&mut app, 0) > 0.05);
    assert!(drift(&mut app, 1).abs() < 1e-3);
}

#[test]
fn an_app_with_the_plugins_runs_the_scene_to_the_same_bits() {
    let mut app = app_with(|app| {
        app.add_plugins((
            EffectPlugin::<Breeze>::default().saved(),
            EffectPlugin::<Calm>::default().saved(),
        ));
    });
    let known = app.world().resource::<EffectRegistry>().own();
    assert_eq!(known, own());
    let scene = Scene::parse_with("breeze.ron", SCENE, &known).expect("sound");
    spawn(&scene.build().expect("sound"), app.world_mut());
    let mut other = headless(&built());
    for app in [&mut app, &mut other] {
        ticks(app, 30);
    }
    assert_eq!(state_hash(app.world_mut()), state_hash(other.world_mut()));
}

#[test]
fn a_snapshot_is_restored_in_a_fresh_app_and_goes_on_with_the_same_bits() {
    let mut app = headless(&built());
    ticks(&mut app, 10);
    let bytes = snapshot(&mut app).to_bytes();
    let read = Snapshot::from_bytes_with(&bytes, &own()).expect("the app has these effects");
    assert_eq!(read.to_bytes(), bytes);
    let mut again = headless(&read.built);
    assert_eq!(breeze(&mut again, 0), breeze(&mut app, 0));
    assert!(breeze(&mut app, 0).expect("carried").spent > 0.05);
    for _ in 0..20 {
        ticks(&mut app, 1);
        ticks(&mut again, 1);
        assert_eq!(state_hash(app.world_mut()), state_hash(again.world_mut()));
        assert_eq!(breeze(&mut again, 0), breeze(&mut app, 0));
    }
}

#[test]
fn a_restored_body_with_an_effect_of_the_app_stays_asleep() {
    let mut app = headless(&built());
    let body = bodies_in_order(app.world_mut())[1];
    app.world_mut()
        .entity_mut(body)
        .insert(Calm { factor: 0.05 });
    ticks(&mut app, 400);
    assert!(app.world().get::<Asleep>(body).is_some(), "it rests");
    let bytes = snapshot(&mut app).to_bytes();
    let read = Snapshot::from_bytes_with(&bytes, &own()).expect("sound");
    let mut again = headless(&read.built);
    ticks(&mut again, 3);
    let body = bodies_in_order(again.world_mut())[1];
    assert!(
        again.world().get::<Asleep>(body).is_some(),
        "it still rests"
    );
}

#[test]
fn a_snapshot_without_effects_of_the_app_has_the_same_bytes_as_ever() {
    let scene = SCENE
        .replace("breeze: None", "")
        .replace("calm: (factor: 1e-3),", "");
    let cut = scene.find("breeze: (").expect("there");
    let end = cut + scene[cut..].find("),\n            ),").expect("there") + 2;
    let scene = format!("{}{}", &scene[..cut], &scene[end..]);
    let plain = Scene::parse("plain.ron", &scene)
        .expect("sound")
        .build()
        .expect("sound");
    let known = Scene::parse_with("plain.ron", &scene, &own())
        .expect("sound")
        .build();
    let [plain, known] = [plain, known.expect("sound")].map(|built| {
        let mut app = headless(&built);
        ticks(&mut app, 3);
        snapshot(&mut app).to_bytes()
    });
    assert_eq!(plain, known);
    assert!(Snapshot::from_bytes(&plain).is_ok());
}

#[test]
fn a_snapshot_with_an_effect_that_the_app_does_not_have_is_refused_by_name() {
    let mut app = headless(&built());
    let bytes = snapshot(&mut app).to_bytes();
    let error = Snapshot::from_bytes(&bytes).expect_err("unknown");
    assert!(matches!(error, SnapshotError::UnknownEffect { .. }));
    let said = error.to_string();
    for part in [
        "cube",
        "breeze",
        "it has none of its own",
        "EffectPlugin::saved",
    ] {
        assert!(said.contains(part), "“{part}” is not in “{said}”");
    }
    let other = OwnEffects::default().with::<Calm>();
    let said = Snapshot::from_bytes_with(&bytes, &other)
        .expect_err("unknown")
        .to_string();
    assert!(said.contains("it has calm"), "{said}");
}

#[test]
fn a_snapshot_with_invalid_parameters_is_refused_with_the_reason() {
    /// Another effect of the same name.
    #[derive(Component, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Other {
        acceleration: f32,
    }
    impl Effect for Other {
        const NAME: &'static str = "breeze";
        const TITLE: &'static str = "Breeze";
        const SUMMARY: &'static str = "Other.";
        type State = ();
    }
    let mut app = headless(&built());
    let bytes = snapshot(&mut app).to_bytes();
    let other = OwnEffects::default().with::<Other>().with::<Calm>();
    let error = Snapshot::from_bytes_with(&bytes, &other).expect_err("another component");
    let said = error.to_string();
    assert!(said.contains("breeze of body “cube”"), "{said}");
    assert!(said.contains("spent"), "{said}");
}

#[test]
fn the_saved_scene_parses_to_the_same_and_contains_what_was_changed() {
    let (scene, built) = (scene(), built());
    let definition = Definition::new(&scene, &built);
    let mut app = headless(&built);
    let save = |app: &mut App| {
        let now = snapshot(app).built;
        definition
            .save(&now, &std::env::temp_dir())
            .expect("describable")
            .scene
    };
    let same = save(&mut app);
    assert_eq!(same.bodies, scene.bodies);
    let text = same.to_text().expect("it can be written");
    let read = Scene::parse_with("saved.ron", &text, &own()).expect(&text);
    assert_eq!(read.bodies, scene.bodies, "{text}");

    let all = bodies_in_order(app.world_mut());
    let (effect, parameter) = ("breeze".to_owned(), "acceleration".to_owned());
    let body = all[1];
    push(
        &mut app,
        Action::AddEffect {
            body,
            effect: effect.clone(),
        },
    );
    push(
        &mut app,
        Action::SetParameter {
            body,
            effect: effect.clone(),
            parameter,
            value: 7.0,
        },
    );
    push(
        &mut app,
        Action::RemoveEffect {
            body: all[0],
            effect,
        },
    );
    ticks(&mut app, 1);
    let saved = save(&mut app);
    let text = saved.to_text().expect("it can be written");
    let read = Scene::parse_with("saved.ron", &text, &own()).expect(&text);
    assert_eq!(read.bodies, saved.bodies, "{text}");
    let mut again = headless(&read.build().expect("sound"));
    assert_eq!(breeze(&mut again, 0), None);
    assert_eq!(breeze(&mut again, 1).map(|it| it.acceleration), Some(7.0));
}

#[test]
fn copies_that_differ_in_an_effect_of_the_app_are_saved_one_by_one() {
    let copies = SCENE.replacen(
        "position: (0.0, 0.5, 0.0),",
        "position: (0.0, 0.5, 0.0), copies: (count: (2, 1, 1), spacing: (1, 0, 0)),",
        1,
    );
    let scene = Scene::parse_with("copies.ron", &copies, &own()).expect("sound");
    let built = scene.build().expect("sound");
    let definition = Definition::new(&scene, &built);
    let mut app = headless(&built);
    let body = bodies_in_order(app.world_mut())[1];
    app.world_mut().entity_mut(body).remove::<Breeze>();
    let now = snapshot(&mut app).built;
    let saved = definition
        .save(&now, &std::env::temp_dir())
        .expect("describable")
        .scene;
    let counts: Vec<_> = saved.bodies.iter().map(|it| it.effects.own.len()).collect();
    assert_eq!(counts, [2, 1, 0]);
}

#[test]
fn a_recording_replays_to_the_same_bits() {
    let path = file("record.rec");
    let mut app = headless(&built());
    Recorder::create(&path).expect("writable").install(&mut app);
    Recorder::scene_opened(app.world_mut(), About::default());
    let all = bodies_in_order(app.world_mut());
    ticks(&mut app, 5);
    let effect = "breeze".to_owned();
    push(
        &mut app,
        Action::AddEffect {
            body: all[1],
            effect,
        },
    );
    let entity = app.world().entity(all[0]);
    let mut body = plain::body(entity).expect("a body");
    body.translate(Vec3::Y);
    let own_of_body = own().of_body(&entity).expect("they can be written");
    let new = NewBody {
        body,
        skin: None,
        own: own_of_body,
    };
    push(&mut app, Action::Spawn(Arc::new(new)));
    ticks(&mut app, 25);
    Recorder::end(app.world_mut());
    assert_eq!(breeze(&mut app, 2).map(|it| it.acceleration), Some(2.5));
    let hash = state_hash(app.world_mut());
    let replayed = replay_with(&path, &Threads::default(), &own(), |_| ());
    let foreign = replay(&path, &Threads::default(), |_| ());
    fs::remove_file(&path).expect("it was written");
    let replayed = replayed.expect("it is read");
    assert_eq!(replayed.difference, None);
    assert!(replayed.complete);
    assert_eq!(replayed.state_hash, hash);
    let error = foreign.expect_err("the effect is unknown");
    assert!(matches!(error, RecordingError::Line { .. }));
    let said = error.to_string();
    assert!(
        said.contains("breeze") && said.contains("EffectPlugin::saved"),
        "{said}"
    );
}

#[test]
fn a_scene_is_recorded_and_a_snapshot_opened_without_an_app() {
    let (path, state) = (file("short.rec"), file("state.snapshot"));
    let hash = record(&built(), About::default(), 0.2, &path).expect("writable");
    let replayed = replay_with(&path, &Threads::default(), &own(), |_| ());
    fs::remove_file(&path).expect("it was written");
    assert_eq!(replayed.expect("sound").state_hash, hash);
    let mut app = headless(&built());
    ticks(&mut app, 12);
    snapshot(&mut app).write(&state).expect("writable");
    let opened = open_with(state.to_str().expect("UTF-8"), &own());
    fs::remove_file(&state).expect("it was written");
    let mut again = headless(&opened.expect("sound").1);
    assert_eq!(state_hash(again.world_mut()), hash);
}

#[test]
fn undo_brings_the_effects_back() {
    let mut app = headless(&built());
    ticks(&mut app, 5);
    let before = Moment::take(app.world_mut(), None).expect("between ticks");
    let (carried, hash) = (breeze(&mut app, 0), state_hash(app.world_mut()));
    let all = bodies_in_order(app.world_mut());
    push(&mut app, Action::Despawn { body: all[0] });
    let effect = "breeze".to_owned();
    push(
        &mut app,
        Action::AddEffect {
            body: all[1],
            effect,
        },
    );
    ticks(&mut app, 5);
    before.restore(app.world_mut());
    assert_eq!(breeze(&mut app, 0), carried);
    let body = bodies_in_order(app.world_mut())[0];
    assert_eq!(app.world().get::<Age>(body), Some(&Age(0)));
    // Also where the body was there all the time: a replay knows no other.
    ticks(&mut app, 3);
    assert_eq!(app.world().get::<Age>(body), Some(&Age(30)));
    before.restore(app.world_mut());
    assert_eq!(app.world().get::<Age>(body), Some(&Age(0)));
    assert_eq!(breeze(&mut app, 1), None);
    assert_eq!(state_hash(app.world_mut()), hash);
    let mut other = headless(&built());
    ticks(&mut other, 25);
    ticks(&mut app, 20);
    assert_eq!(state_hash(app.world_mut()), state_hash(other.world_mut()));
}

/// The error of the scene in which `from` is replaced by `to`.
fn complaint(from: &str, to: &str) -> (usize, usize, String) {
    assert!(SCENE.contains(from), "{from} is not in the scene");
    let text = SCENE.replace(from, to);
    match Scene::parse_with("breeze.ron", &text, &own()) {
        Err(SceneError::Syntax {
            line,
            column,
            message,
            ..
        }) => (line, column, message),
        other => panic!("{to}: {other:?}"),
    }
}

#[test]
fn errors_in_an_effect_of_the_app_have_line_and_column() {
    let (line, column, message) = complaint("acceleration: 2.5", "accelleration: 2.5");
    assert_eq!(
        SCENE
            .lines()
            .position(|it| it.contains("acceleration: 2.5")),
        Some(line - 1)
    );
    assert_eq!(column, 21, "{message}");
    for part in ["breeze", "accelleration", "acceleration", "spent"] {
        assert!(message.contains(part), "“{part}” is not in “{message}”");
    }
    // The same place as in an effect of the crate.
    let [own, of_crate] = ["acceleration: 2.5", "ground: ()"].map(|from| {
        let (name, _) = from.split_once(':').expect("a name");
        let to = match name {
            "ground" => "ground: (height: fast)".to_owned(),
            name => format!("{name}: fast"),
        };
        let (line, column, message) = complaint(from, &to);
        assert!(message.contains("Expected float"), "{message}");
        let text = SCENE.replacen(from, &to, 1);
        let text = text.lines().nth(line - 1).expect("there");
        text.find("fast").expect(text) - column
    });
    assert_eq!(own, of_crate);
    // On the line of its name.
    let (line, column, message) = complaint("breeze: None", "breeze: (mild: true)");
    let place = SCENE.lines().position(|it| it.contains("breeze: None"));
    assert_eq!(place, Some(line - 1), "{message}");
    let text = SCENE.lines().nth(line - 1).expect("there");
    assert_eq!(column, text.find("None").expect("there") + 2, "{message}");
    let (.., message) = complaint("breeze: None", "calm: (factor: 1), calm: (factor: 2)");
    assert!(message.contains("duplicate effect `calm`"), "{message}");
}

#[test]
fn an_unknown_effect_is_answered_with_those_that_are_known() {
    let (line, _, message) = complaint("breeze: None", "breze: ()");
    assert!(
        SCENE
            .lines()
            .nth(line - 1)
            .expect("there")
            .contains("breeze: None")
    );
    for part in [
        "breze",
        "(did you mean “breeze”?)",
        "stretch",
        "calm",
        "EffectPlugin::saved",
    ] {
        assert!(message.contains(part), "“{part}” is not in “{message}”");
    }
    let error = Scene::parse("breeze.ron", SCENE).expect_err("no effects of an app");
    let said = error.to_string();
    assert!(
        said.contains("unknown effect `calm`") && said.contains("stretch"),
        "{said}"
    );
    // What was known while another text was read is forgotten.
    let text = "effects: (breeze: (acceleration: 3))";
    let known = BodyParameters::parse_with("clipboard", text, &own()).expect("sound");
    assert_eq!(known.effects.names(), ["breeze"]);
    let written = known.to_text().expect("it can be written");
    let again = BodyParameters::parse_with("again", &written, &own());
    assert_eq!(again.expect("sound"), known);
    assert!(BodyParameters::parse("clipboard", text).is_err());
}

#[test]
fn an_effect_that_is_not_saved_is_refused_by_a_snapshot() {
    let mut app = app_with(|app| {
        app.add_plugins(EffectPlugin::<Breeze>::default());
    });
    assert!(app.world().resource::<EffectRegistry>().own().is_empty());
    spawn(&built(), app.world_mut());
    let error = Snapshot::take(app.world_mut(), About::default()).expect_err("not saved");
    let said = error.to_string();
    assert!(said.contains("cube") && said.contains("breeze"), "{said}");
    assert!(said.contains("EffectPlugin::saved"), "{said}");
}

#[test]
fn a_component_becomes_an_effect_of_a_scene() {
    let mut scene = scene();
    let given = Breeze {
        acceleration: 9.0,
        ..Breeze::default()
    };
    scene.bodies[1].effects.own = vec![OwnEffect::new(&given).expect("it can be written")];
    scene.bodies[0].effects.own.clear();
    let mut app = headless(&scene.build().expect("sound"));
    assert_eq!(breeze(&mut app, 0), None);
    assert_eq!(breeze(&mut app, 1), Some(given));
}

#[test]
#[should_panic(expected = "“stretch” is built in")]
fn an_effect_of_the_crate_is_not_one_of_the_app() {
    let _refused = EffectPlugin::<Stretch>::default().saved();
}

#[test]
#[should_panic(expected = "there is an effect called “breeze” already")]
fn two_effects_of_one_name_are_refused() {
    let _refused = own().with::<Breeze>();
}

#[test]
fn entities_and_other_components_stay_where_a_moment_is_restored() {
    #[derive(Component, Debug, PartialEq)]
    struct Score(u32);
    let mut app = App::new();
    app.add_plugins((
        SoftBodyPlugins::default(),
        EffectPlugin::<Breeze>::default().saved(),
    ));
    app.finish();
    app.cleanup();
    let only_breeze = SCENE.replace("calm: (factor: 1e-3),", "");
    let known = app.world().resource::<EffectRegistry>().own();
    let scene = Scene::parse_with("breeze.ron", &only_breeze, &known).expect("sound");
    let all = spawn(&scene.build().expect("sound"), app.world_mut());
    app.world_mut().entity_mut(all[0]).insert(Score(3));
    let moment = Moment::take(app.world_mut(), None).expect("between ticks");
    ticks(&mut app, 4);
    assert_eq!(moment.restore(app.world_mut()).0, all);
    assert_eq!(app.world().get::<Score>(all[0]), Some(&Score(3)));
}
