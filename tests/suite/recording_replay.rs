//! A recording replays to the same hashes on any number of threads, or reports where it differs.

use crate::support_app::{push, set, ticks};
use bevy::{prelude::*, time::TimeUpdateStrategy};
use pliant::{
    SoftBodyPlugins,
    effect::{ExternalForce, ExternalImpulse, Grabs},
    recording::{About, HASH_EVERY, Recorder, RecordingError, Replay, replay},
    scene::{self, BuiltScene, Scene, run::headless},
    simulation::{
        Action, Asleep, NewBody, SimulationClock, SolvePhase, SolveSchedule,
        plain::{self, bodies_in_order},
        state_hash, tick,
    },
    solver::{
        Cut, Grab, ParticleIndex, Particles, SurfacePoint, Threads, VertexIndex,
        deform::Deformation,
    },
};
use proptest::prelude::*;
use std::{
    fs,
    path::{Path, PathBuf},
    sync::{Arc, OnceLock},
    thread::sleep,
    time::Duration,
};

/// A temporary file for a test, removed when dropped.
struct Temporary(PathBuf);

impl Temporary {
    fn new(name: &str) -> Self {
        let name = format!("pliant-recording-{}-{name}", std::process::id());
        Self(std::env::temp_dir().join(name))
    }

    fn with(name: &str, content: impl AsRef<[u8]>) -> Self {
        let file = Self::new(name);
        fs::write(&file.0, content).expect("written");
        file
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        // It may never have been written.
        let _ = fs::remove_file(&self.0);
    }
}

fn built(name: &str) -> BuiltScene {
    let scene = Scene::load(name).expect("a built-in scene").scene;
    scene.build().expect("it builds")
}

fn about(name: &str) -> About {
    About {
        name: name.to_owned(),
        ..About::default()
    }
}

/// What an app does by components is recorded, as long as it does it.
#[test]
fn what_an_app_does_replays() {
    let file = Temporary::new("controls");
    let mut app = recording(&built("shapes"), &file.0);
    let body = bodies(&mut app)[0];
    let point = SurfacePoint::new(&[(ParticleIndex(2), 1.0)]).expect("a point");
    for number in 0..40 {
        let mut body = app.world_mut().entity_mut(body);
        match number {
            3 => drop(body.insert(ExternalForce::on_whole(Vec3::X * 20.0))),
            8 => drop(body.insert(ExternalForce::at(point, Vec3::Y * 30.0))),
            12 | 20 => drop(body.insert(ExternalImpulse::on_whole(Vec3::Y * 5.0))),
            15 => drop(body.remove::<ExternalForce>()),
            25 => drop(body.insert(Grabs::new([Grab::on(point, Vec3::Y * 2.0, 1.0, 1.0, 9.81)]))),
            26.. => {
                let mut grabs = body.get_mut::<Grabs>().expect("grabbed");
                grabs
                    .iter_mut()
                    .for_each(|grab| grab.target += Vec3::X * 0.01);
            }
            _ => {}
        }
        ticks(&mut app, 1);
    }
    Recorder::end(app.world_mut());
    let found = played(&file.0, 1).expect("it replays");
    assert!(found.complete && found.difference.is_none(), "{found:?}");
    // Two impulses, two forces and their end, and each motion of the grab.
    assert_eq!(found.actions, 5 + 15);
}

/// An app that records, with a scene.
fn recording(built: &BuiltScene, path: &Path) -> App {
    let mut app = headless(built);
    Recorder::create(path).expect("a file").install(&mut app);
    Recorder::scene_opened(app.world_mut(), about("first"));
    app
}

fn played(path: &Path, threads: usize) -> Result<Replay, RecordingError> {
    let threads = Threads::new(threads).expect("threads");
    replay(path, &threads, |_| ())
}

fn bodies(app: &mut App) -> Vec<Entity> {
    bodies_in_order(app.world_mut())
}

fn grab(body: Entity, target: Vec3) -> Action {
    let point = SurfacePoint::new(&[
        (ParticleIndex(0), 0.3),
        (ParticleIndex(1), 0.5),
        (ParticleIndex(2), 0.4),
    ])
    .expect("sound");
    Action::Grab {
        body,
        point,
        target,
    }
}

/// A minute of varied user actions in two scenes; returns the hash at the end.
fn session(path: &Path) -> u64 {
    let shapes = built("shapes");
    let mut app = recording(&shapes, path);
    ticks(&mut app, 7);
    let all = bodies(&mut app);
    push(&mut app, grab(all[0], Vec3::new(0.1, 1.0, 0.3)));
    for step in 0..25 {
        let target = Vec3::new(0.1 + 0.03 * step as f32, 1.0, 0.3);
        let body = all[0];
        push(&mut app, Action::MoveGrab { body, target });
        ticks(&mut app, 1);
    }
    push(
        &mut app,
        set(all[0], "stretch", "compliance", 1.0 / 3.0 * 1e-3),
    );
    push(
        &mut app,
        set(all[0], "volume", "bulk_modulus", f64::INFINITY),
    );
    push(&mut app, set(all[1], "stretch", "compliance", -1.0));
    let (effect, body) = ("collide".to_owned(), all[1]);
    push(&mut app, Action::AddEffect { body, effect });
    ticks(&mut app, 5);
    let (effect, body) = ("volume".to_owned(), all[2]);
    push(&mut app, Action::RemoveEffect { body, effect });
    push(&mut app, Action::Release { body: all[0] });
    push(
        &mut app,
        Action::Pin {
            body,
            vertex: VertexIndex(3),
        },
    );
    let (name, value) = ("substeps".to_owned(), 7.0);
    push(&mut app, Action::SetSetting { name, value });
    ticks(&mut app, 11);
    push(
        &mut app,
        Action::Unpin {
            body,
            vertex: VertexIndex(3),
        },
    );
    let deformation = Deformation::Shuffle(7);
    push(&mut app, Action::Deform { body, deformation });
    ticks(&mut app, 2);
    push(&mut app, Action::ResetShape { body });
    let cut = Cut {
        eye: Vec3::new(0.0, 9.0, 0.0),
        rays: [Vec3::new(-1.0, -1.0, -0.01), Vec3::new(1.0, -1.0, 0.01)],
    };
    push(&mut app, Action::Cut { body, cut });
    let mut new = plain::body(app.world().entity(all[3])).expect("a body");
    new.translate(Vec3::new(0.0, 1.5, 0.2));
    let skin = None;
    push(
        &mut app,
        Action::Spawn(Arc::new(NewBody {
            body: new,
            skin,
            own: Vec::new(),
        })),
    );
    push(&mut app, Action::Despawn { body: all[1] });
    ticks(&mut app, 20);
    let newest = *bodies(&mut app).last().expect("bodies");
    push(&mut app, grab(newest, Vec3::new(0.2, 1.2, 0.0)));
    ticks(&mut app, 13);
    // A restart, as in the window.
    let world = app.world_mut();
    Recorder::scene_ends(world);
    scene::despawn(world);
    scene::spawn(&shapes, world);
    Recorder::scene_restarted(world);
    let first = bodies(&mut app)[0];
    push(&mut app, set(first, "stretch", "compliance", 1e-3));
    ticks(&mut app, 33);
    // And another scene.
    let world = app.world_mut();
    Recorder::scene_ends(world);
    scene::despawn(world);
    scene::spawn(&built("colliders"), world);
    Recorder::scene_opened(world, about("second"));
    let first = bodies(&mut app)[0];
    ticks(&mut app, 3);
    push(&mut app, grab(first, Vec3::new(0.0, 0.9, 0.0)));
    // A body that user actions make diverge, and that is then restored.
    let body = bodies(&mut app)[1];
    push(&mut app, set(body, "ground", "height", 3e38));
    ticks(&mut app, 5);
    push(&mut app, set(body, "ground", "height", 0.0));
    push(&mut app, Action::Restore { body });
    ticks(&mut app, 24);
    Recorder::end(app.world_mut());
    let recorder = app.world().resource::<Recorder>();
    assert_eq!(recorder.failure(), None);
    state_hash(app.world_mut())
}

/// The text of a session, made once.
fn text() -> &'static str {
    static TEXT: OnceLock<String> = OnceLock::new();
    TEXT.get_or_init(|| {
        let file = Temporary::new("text");
        session(&file.0);
        fs::read_to_string(&file.0).expect("text")
    })
}

#[test]
fn a_session_of_everything_replays_to_the_same_hash_on_any_number_of_threads() {
    let file = Temporary::new("session");
    let hash = session(&file.0);
    for threads in [1, 2, 8] {
        let done = played(&file.0, threads).expect("it can be replayed");
        assert_eq!(done.difference, None, "{threads} threads");
        assert_eq!(done.state_hash, hash);
        assert!(done.complete);
        assert_eq!(done.scenes, ["first", "second"]);
        assert_eq!(done.restarts, 1);
        // 1 + 25 + 2 + 1 + 5 + 1 + 4 + 1, then 1, then 4: the rejected action is not recorded.
        assert_eq!(done.actions, 45);
        assert_eq!(done.ticks, 7 + 25 + 5 + 11 + 2 + 20 + 13 + 33 + 3 + 5 + 24);
        assert!(done.hashes as u64 > done.ticks / HASH_EVERY, "{done:?}");
    }
}

#[test]
fn ticks_that_end_early_are_replayed_as_such() {
    let file = Temporary::new("early");
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, SoftBodyPlugins::new(Update)));
    app.finish();
    app.cleanup();
    scene::spawn(&built("shapes"), app.world_mut());
    Recorder::create(&file.0).expect("a file").install(&mut app);
    Recorder::scene_opened(app.world_mut(), about("first"));
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(
        17,
    )));
    app.add_systems(
        SolveSchedule,
        (|| sleep(Duration::from_millis(1))).in_set(SolvePhase::User),
    );
    let mut clock = app.world_mut().resource_mut::<SimulationClock>();
    clock.budget = Some(Duration::from_micros(100));
    clock.patience = Some(Duration::ZERO);
    let body = bodies(&mut app)[0];
    push(&mut app, grab(body, Vec3::new(0.1, 1.0, 0.3)));
    // The first update has no elapsed time.
    app.update();
    // Each update moves the grab, and so ends the tick of the update before.
    for step in 0..40 {
        let target = Vec3::new(0.1 + 0.02 * step as f32, 1.0, 0.3);
        let action = Action::MoveGrab { body, target };
        push(&mut app, action);
        app.update();
    }
    Recorder::end(app.world_mut());
    let text = fs::read_to_string(&file.0).expect("a recording");
    assert!(text.matches("\nEarly(").count() > 10, "{text:.300}");
    for threads in [1, 2] {
        let replay = played(&file.0, threads).expect("a recording");
        assert_eq!(replay.difference, None);
        assert!(replay.complete && replay.hashes > 2);
        assert_eq!(replay.state_hash, state_hash(app.world_mut()));
    }
}

/// The session must include a body that went into quarantine and was restored.
#[test]
fn a_restored_body_is_replayed_as_such() {
    assert!(text().contains("Restore(body:"), "it was in quarantine");
}

/// A rejected value is not recorded, so it must not have any effect.
#[test]
fn a_refused_value_does_not_wake_a_sleeping_body() {
    let mut app = headless(&built("jelly_cube"));
    let body = bodies(&mut app)[0];
    for _ in 0..3000 {
        tick(app.world_mut());
        if app.world().get::<Asleep>(body).is_some() {
            break;
        }
    }
    assert!(
        app.world().get::<Asleep>(body).is_some(),
        "it comes to rest"
    );
    push(&mut app, set(body, "stretch", "compliance", -1.0));
    ticks(&mut app, 2);
    assert!(app.world().get::<Asleep>(body).is_some(), "it sleeps on");
}

#[test]
fn the_first_tick_that_differs_is_reported() {
    let changed = text().replacen("value:7.0", "value:8.0", 1);
    assert_ne!(changed, text());
    let file = Temporary::with("changed", changed);
    let done = played(&file.0, 1).expect("it can be replayed");
    let difference = done.difference.expect("seven substeps are not eight");
    // Set after 37 ticks; the next hash is at 40.
    assert_eq!((difference.tick, difference.agreed), (40, Some(30)));
    assert_eq!(difference.scene, "first");
    let line = text().lines().nth(difference.line - 1).expect("a line");
    assert!(
        line.contains("tick:40") && line.contains(&difference.expected),
        "{line}"
    );
}

/// The file after a crash: every line is written at once, and the last may be incomplete.
#[test]
fn a_recording_that_was_cut_anywhere_replays_as_far_as_it_goes() {
    let whole = text();
    let ends: Vec<usize> = whole.match_indices('\n').map(|(at, _)| at).collect();
    let mut played_some = 0;
    // Truncated in the middle of a line, right before its end, and right after it.
    for (number, &end) in ends.iter().enumerate().step_by(7) {
        let start = if number == 0 { 0 } else { ends[number - 1] + 1 };
        for cut in [(start + end) / 2, end, end + 1] {
            let file = Temporary::with("cut", &whole[..cut]);
            match played(&file.0, 1) {
                Ok(done) => {
                    assert_eq!(done.difference, None);
                    assert!(!done.complete || cut > ends[ends.len() - 1]);
                    played_some += 1;
                }
                Err(error) => {
                    let early = matches!(
                        error,
                        RecordingError::Foreign { .. } | RecordingError::Empty { .. }
                    );
                    assert!(early && number < 2, "cut at {cut}: {error}");
                }
            }
        }
    }
    assert!(played_some > 10);
}

#[test]
fn an_invalid_line_is_reported() {
    let whole: Vec<&str> = text().lines().collect();
    let (head, first) = (whole[0], whole[1]);
    let with = |lines: &[&str]| format!("{head}\n{first}\n{}\n", lines.join("\n"));
    let cases: Vec<(String, &str)> = vec![
        (with(&["Do(tick:0,action:Jump)"]), ":3: column"),
        (
            with(&["Do(tick:0,action:Release(body:99))"]),
            ":3: no body has the number 99",
        ),
        (
            with(&["Do(tick:0,action:Restore(body:1))"]),
            ":3: the body is not in quarantine",
        ),
        (
            with(&[
                "Do(tick:0,action:SetParameter(body:1,effect:\"stretch\",parameter:\"compliance\",value:-1.0))",
            ]),
            "between 0 and 1e12",
        ),
        (
            with(&["Do(tick:0,action:Grab(body:1,point:[],target:(0,0,0)))"]),
            "1 to 12 different",
        ),
        (
            with(&["Do(tick:0,action:Grab(body:1,point:[(999999,1.0)],target:(0,0,0)))"]),
            "no particle 999999",
        ),
        (
            with(&["Hash(tick:1000000000000,hash:\"\")"]),
            "lines are missing",
        ),
        (with(&["Hash(tick:11,hash:\"\")"]), "lines are missing"),
        (
            with(&[
                "Do(tick:5,action:Release(body:1))",
                "Do(tick:4,action:Release(body:1))",
            ]),
            ":4: tick 4 is out of order after tick 5",
        ),
        (
            with(&["Scene(tick:0,name:\"x\",state:\"!\")"]),
            ":3: the state is not valid base64",
        ),
        (
            with(&["Scene(tick:0,name:\"x\",state:\"AAAA\")"]),
            ":3: not a Pliant snapshot",
        ),
        (
            with(&["Add(tick:0,body:\"AAAA\")"]),
            ":3: not a Pliant snapshot",
        ),
        (
            with(&[whole[1]
                .replacen("Scene", "Add", 1)
                .replacen("name:\"first\",state", "body", 1)
                .as_str()]),
            "expected one body in an Add line",
        ),
        (with(&["End(tick:0,hash:\"x\")"]), ""),
        (format!("{head}\nRestart(tick:0)\n"), ":2: no scene yet"),
        (format!("{head}\n"), "the recording is empty"),
        (String::new(), "not a Pliant recording"),
        ("Scene(title: \"t\")\n".to_owned(), "not a Pliant recording"),
        ("x".repeat(100_000), "not a Pliant recording"),
        (
            "Recording(version:7,program:\"9\")\n".to_owned(),
            "version 7",
        ),
    ];
    for (text, words) in cases {
        let file = Temporary::with("nonsense", &text);
        let tail: String = text
            .chars()
            .rev()
            .take(120)
            .collect::<Vec<_>>()
            .into_iter()
            .rev()
            .collect();
        match played(&file.0, 1) {
            Err(error) => assert!(error.to_string().contains(words), "{tail}: {error}"),
            Ok(done) => assert!(words.is_empty() && done.difference.is_some(), "{tail}"),
        }
    }
    let mut bytes = format!("{head}\n{first}\n").into_bytes();
    bytes.extend([0xff, 0xfe, b'\n']);
    let file = Temporary::with("bytes", bytes);
    let error = played(&file.0, 1).expect_err("no text").to_string();
    assert!(error.contains(":3: not valid UTF-8"), "{error}");
    let missing = played(Path::new("no/such/file.rec"), 1).expect_err("missing");
    assert!(missing.to_string().contains("no/such/file.rec"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// A replay, a difference, or an error: never a panic, for any change of the text.
    #[test]
    fn a_mutated_recording_never_panics(
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
        words in prop::collection::vec((any::<prop::sample::Index>(), prop::sample::select(
            vec!["-1", "1e400", "nan", "18446744073709551616", "body:2", "(", "\"", "tick:9", "inf"],
        )), 0..3),
    ) {
        let whole = text();
        // States are covered by the tests of snapshots: only the text after the first one is
        // changed.
        let behind = whole.match_indices('\n').nth(1).map_or(0, |(at, _)| at);
        let mut bytes = whole.as_bytes().to_vec();
        let rest = &whole[behind..whole.len().min(behind + 12_000)];
        bytes.truncate(behind + rest.len());
        for (place, byte) in edits {
            let place = behind + place.index(rest.len());
            bytes[place] = byte;
        }
        for (place, word) in words {
            let place = behind + place.index(rest.len());
            bytes.splice(place..place, word.bytes());
        }
        let file = Temporary::with("mutated", &bytes);
        if let Err(error) = played(&file.0, 1) {
            prop_assert!(!error.to_string().is_empty());
        }
    }
}

/// A body that a user action made diverge is in quarantine at the start of its tick.
#[test]
fn a_ground_raised_beyond_all_bounds_quarantines_the_body_at_a_finite_state() {
    let mut app = headless(&built("jelly_cube"));
    let body = bodies(&mut app)[0];
    ticks(&mut app, 10);
    let before = app.world().get::<Particles>(body).expect("a body").clone();
    // Raised by that much within a substep, its speed exceeds the range of f32.
    push(&mut app, set(body, "ground", "height", 3e38));
    ticks(&mut app, 2);
    assert!(
        app.world()
            .get::<pliant::simulation::Quarantined>(body)
            .is_some()
    );
    let frozen = app.world().get::<Particles>(body).expect("a body");
    assert_eq!(frozen.positions, before.positions, "where the tick began");
    assert!(frozen.is_still());
    // The cause remains: the body is quarantined again in the next tick.
    push(&mut app, Action::Restore { body });
    ticks(&mut app, 1);
    assert!(
        app.world()
            .get::<pliant::simulation::Quarantined>(body)
            .is_some()
    );
    // Without the cause, the body continues.
    push(&mut app, set(body, "ground", "height", 0.0));
    push(&mut app, Action::Restore { body });
    ticks(&mut app, 60);
    assert!(
        app.world()
            .get::<pliant::simulation::Quarantined>(body)
            .is_none()
    );
    let moved = app.world().get::<Particles>(body).expect("a body");
    assert_ne!(moved.positions, before.positions);
}
