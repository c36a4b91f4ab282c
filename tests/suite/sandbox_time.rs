//! Undo, redo and the timeline, without a window: states come back to the bit and go on to the same
//! bits, within a memory budget, and recordings of all this replay.

use crate::support_app::{push, set, ticks};
use bevy::prelude::*;
use bevy_egui::egui;
use pliant::{
    effect::ForceMask,
    recording::{About, Recorder, Snapshot, replay},
    sandbox::{
        app::time::{
            self, History, OpenScene, SceneContext, TimePlugin,
            change::{Undoing, undoing},
            history::BUDGET,
            state::State,
            timeline::SPAN,
        },
        panel::time_strip,
        state::{
            display::Theme,
            event::SceneLoaded,
            selection::Selection,
            time::{Gesture, TimeStrip},
        },
        ui::{message::Notices, theme},
    },
    scene::{self, BuiltScene, CurrentScene, Scene, registry::SCENES, run::headless},
    simulation::{
        Action, Actions, BodyDensity, NewBody, Pins, Quarantined, SimulationClock,
        SimulationSettings, SoftBody,
        plain::{self, bodies_in_order, colliders_in_order},
        state_hash,
    },
    solver::{
        ColliderShape, Controls, Cut, Density, ExternalForce, GroupName, ParticleIndex, Pose,
        Quarantine, SurfacePoint, Threads, Topology, VertexIndex, deform::Deformation,
    },
};
use std::{collections::BTreeSet, fs, path::Path, sync::Arc, time::Instant};

fn loaded(name: &str) -> (CurrentScene, BuiltScene) {
    let current = Scene::load(name).expect("a built-in scene");
    let built = current.scene.build().expect("it builds");
    (current, built)
}

/// An app with a scene, its history and its timeline.
fn app_of(name: &str) -> App {
    let (current, built) = loaded(name);
    let mut app = headless(&built);
    // The app is finished, as a headless run leaves it.
    TimePlugin.build(&mut app);
    app.init_resource::<Notices>()
        .init_resource::<Selection>()
        .add_message::<SceneLoaded>();
    opened(app.world_mut(), current, built);
    app
}

/// What opening a scene does after its bodies were spawned.
fn opened(world: &mut World, current: CurrentScene, built: BuiltScene) {
    let context = SceneContext {
        current,
        orders: plain::places(world),
        floor: None,
        settings: built.world.settings,
        beginning: built,
    };
    world.insert_resource(OpenScene(Arc::new(context)));
    time::begin(world);
}

fn bytes(app: &mut App) -> Vec<u8> {
    let snapshot = Snapshot::take(app.world_mut(), About::default());
    snapshot.expect("between ticks").to_bytes()
}

fn hash(app: &mut App) -> u64 {
    state_hash(app.world_mut())
}

fn tick_of(app: &App) -> u64 {
    app.world().resource::<SimulationClock>().tick()
}

fn history(app: &App) -> &History {
    app.world().resource::<History>()
}

/// A new press of a button or key.
fn press(app: &mut App) {
    app.world_mut().resource_mut::<Gesture>().0 += 1;
}

/// A press that leads to an action, carried out at once.
fn act(app: &mut App, action: Action) {
    press(app);
    push(app, action);
    Actions::apply(app.world_mut());
    let errors = app.world_mut().resource_mut::<Actions>().take_errors();
    assert!(errors.is_empty(), "{errors:?}");
}

fn squash(app: &mut App) -> Action {
    let body = bodies_in_order(app.world_mut())[0];
    let deformation = Deformation::Squash(0.5);
    Action::Deform { body, deformation }
}

#[test]
fn every_scene_returns_to_an_earlier_state_and_goes_on_to_the_same_bits() {
    const TICKS: usize = 9;
    const BACK: usize = 4;
    for scene in SCENES {
        let mut app = app_of(scene.name);
        let rate = app.world().resource::<SimulationSettings>().rate.get();
        let mut states = vec![bytes(&mut app)];
        for _ in 0..TICKS {
            ticks(&mut app, 1);
            states.push(bytes(&mut app));
        }
        time::scrub(app.world_mut(), BACK as f64 / rate);
        assert!(bytes(&mut app) == states[BACK], "{}: scrubbed", scene.name);
        assert!(app.world().resource::<SimulationClock>().paused);
        for (tick, state) in states.iter().enumerate().skip(BACK + 1) {
            ticks(&mut app, 1);
            assert!(bytes(&mut app) == *state, "{}, tick {tick}", scene.name);
        }
    }
}

#[test]
fn a_long_run_with_sleep_and_contacts_is_repeated_from_any_state() {
    for name in ["shapes", "colliders"] {
        let mut app = app_of(name);
        let mut hashes = vec![hash(&mut app)];
        for _ in 0..240 {
            ticks(&mut app, 1);
            hashes.push(hash(&mut app));
        }
        for back in [200, 77, 1, 0] {
            time::scrub(app.world_mut(), back as f64 / 60.0);
            assert_eq!(tick_of(&app), back);
            assert_eq!(hash(&mut app), hashes[back as usize], "{name}, tick {back}");
        }
        for (tick, earlier) in hashes.iter().enumerate().skip(1) {
            ticks(&mut app, 1);
            assert_eq!(hash(&mut app), *earlier, "{name}, tick {tick}");
        }
    }
}

#[test]
fn steps_lead_back_and_forth_and_going_on_drops_what_came_after_until_undo() {
    let mut app = app_of("shapes");
    ticks(&mut app, 50);
    let present = bytes(&mut app);
    press(&mut app);
    (0..20).for_each(|_| time::step_back(app.world_mut()));
    assert_eq!(tick_of(&app), 30);
    time::step(app.world_mut());
    assert_eq!(tick_of(&app), 31, "the next state is still kept");
    assert_eq!(history(&app).timeline().len(), 51);
    assert_eq!(history(&app).len(), 1, "one entry for all steps");
    ticks(&mut app, 3);
    assert_eq!(tick_of(&app), 34);
    assert_eq!(
        history(&app).timeline().len(),
        35,
        "what came after is gone"
    );
    let later = bytes(&mut app);
    assert!(time::undo(app.world_mut()).is_some());
    assert!(bytes(&mut app) == present);
    assert_eq!(history(&app).timeline().len(), 51, "and came back");
    assert!(time::redo(app.world_mut()).is_some());
    assert!(bytes(&mut app) == later);
    assert_eq!(history(&app).timeline().len(), 35);
    assert!(time::redo(app.world_mut()).is_none());
}

#[test]
fn no_earlier_state_and_nothing_to_undo_are_said() {
    let mut app = app_of("jelly_cube");
    let start = bytes(&mut app);
    time::step_back(app.world_mut());
    time::undo(app.world_mut());
    time::redo(app.world_mut());
    assert!(bytes(&mut app) == start);
    let notices = app.world().resource::<Notices>();
    let texts: Vec<_> = notices.iter().map(|notice| notice.text.clone()).collect();
    assert_eq!(
        texts,
        [
            "No earlier state is kept",
            "Nothing to undo",
            "Nothing to redo"
        ]
    );
}

#[test]
fn the_timeline_covers_ten_seconds() {
    let mut app = app_of("jelly_cube");
    ticks(&mut app, 900);
    let (start, end) = history(&app).timeline().span().expect("states");
    assert!((end - 15.0).abs() < 1e-6, "{end}");
    // One tick more or less.
    assert!((end - start - SPAN).abs() < 0.02, "{start} to {end}");
    let sleeping = history(&app).bytes().1;
    let awake = app_of("jelly_cube");
    let first = history(&awake).bytes().1;
    assert!(
        sleeping < 400 * first,
        "states of a body that sleeps are shared: {sleeping} of {first}"
    );
}

const GROUP: GroupName = GroupName::of("first");

/// One action of each kind, on the first or second body.
fn samples(app: &mut App) -> Vec<Action> {
    let bodies = bodies_in_order(app.world_mut());
    let (body, other) = (bodies[0], bodies[1]);
    let collider = colliders_in_order(app.world_mut())[0];
    let vertex = VertexIndex(3);
    let point = SurfacePoint::new(&[(ParticleIndex(0), 1.0)]).expect("sound");
    let target = Vec3::new(0.1, 1.0, 0.0);
    let new = plain::body(app.world().entity(other)).expect("a body");
    let (effect, absent) = ("stretch".to_owned(), "drag".to_owned());
    let density = Density::new(321.0).expect("in range");
    vec![
        set(body, "stretch", "compliance", 3e-4),
        Action::AddEffect {
            body,
            effect: absent,
        },
        Action::RemoveEffect { body, effect },
        Action::SetDensity { body, density },
        Action::SetSetting {
            name: "substeps".to_owned(),
            value: 13.0,
        },
        Action::Grab {
            body,
            point,
            target,
        },
        Action::MoveGrab { body, target },
        Action::Release { body },
        Action::Pin { body, vertex },
        Action::Unpin { body, vertex },
        Action::Deform {
            body,
            deformation: Deformation::Shuffle(5),
        },
        Action::Restore { body },
        Action::Spawn(Arc::new(NewBody {
            body: new,
            skin: None,
            own: Vec::new(),
        })),
        Action::Despawn { body },
        Action::ResetShape { body },
        Action::Brush {
            body,
            point,
            target,
            radius: 0.1,
            stiffness: 2.0,
        },
        Action::GrabPins { body, vertex },
        Action::MovePins {
            body,
            target,
            seconds: 0.1,
        },
        Action::AddCollider {
            shape: ColliderShape::Sphere { radius: 0.1 },
            pose: Pose::default(),
        },
        Action::SetCollider {
            collider,
            shape: None,
            pose: Pose::default(),
            seconds: 0.1,
        },
        Action::RemoveCollider { collider },
        Action::Cut {
            body,
            cut: Cut {
                eye: Vec3::new(0.001, 9.0, 0.0),
                rays: [Vec3::new(0.0, -1.0, -1.0), Vec3::new(0.0, -1.0, 1.0)],
            },
        },
        Action::SetForceGroup { body, group: GROUP },
        Action::Control {
            body,
            controls: Box::new(Controls {
                force: Some(ExternalForce::on_whole(Vec3::X * 10.0)),
                ..Controls::default()
            }),
        },
    ]
}

/// A new kind of action needs a number here, and a sample above.
fn kind(action: &Action) -> usize {
    match action {
        Action::SetParameter { .. } => 0,
        Action::AddEffect { .. } => 1,
        Action::RemoveEffect { .. } => 2,
        Action::SetDensity { .. } => 3,
        Action::SetSetting { .. } => 4,
        Action::Grab { .. } => 5,
        Action::MoveGrab { .. } => 6,
        Action::Release { .. } => 7,
        Action::Pin { .. } => 8,
        Action::Unpin { .. } => 9,
        Action::Deform { .. } => 10,
        Action::Restore { .. } => 11,
        Action::Spawn(_) => 12,
        Action::Despawn { .. } => 13,
        Action::ResetShape { .. } => 14,
        Action::Brush { .. } => 15,
        Action::GrabPins { .. } => 16,
        Action::MovePins { .. } => 17,
        Action::AddCollider { .. } => 18,
        Action::SetCollider { .. } => 19,
        Action::RemoveCollider { .. } => 20,
        Action::Cut { .. } => 21,
        Action::SetForceGroup { .. } => 22,
        Action::Control { .. } => 23,
    }
}

/// Settings, effects and densities: all that actions set while time goes on.
fn values(app: &mut App) -> String {
    let world = app.world_mut();
    let settings = **world.resource::<SimulationSettings>();
    let bodies = bodies_in_order(world).into_iter().map(|body| {
        let density = world.get::<BodyDensity>(body).expect("a body").0;
        (density, plain::effects(world.entity(body)))
    });
    format!("{settings:?} {:?}", bodies.collect::<Vec<_>>())
}

#[test]
fn every_kind_of_action_is_undone_and_redone() {
    let mut seen = BTreeSet::new();
    let count = samples(&mut app_of("colliders")).len();
    for index in 0..count {
        let mut app = app_of("colliders");
        ticks(&mut app, 20);
        let body = bodies_in_order(app.world_mut())[0];
        let sample = samples(&mut app).swap_remove(index);
        seen.insert(kind(&sample));
        if matches!(sample, Action::Restore { .. }) {
            let quarantine = Quarantine::new(VertexIndex(0), Quarantine::USER);
            app.world_mut()
                .entity_mut(body)
                .insert(Quarantined(quarantine));
            // The state of this tick has been kept without the quarantine.
            ticks(&mut app, 1);
        }
        if let Action::GrabPins { vertex, .. } = sample {
            app.world_mut().entity_mut(body).insert(Pins(vec![vertex]));
            ticks(&mut app, 1);
        }
        if matches!(sample, Action::SetForceGroup { .. }) {
            let mut entity = app.world_mut().entity_mut(body);
            let mut topology = Topology::clone(entity.get::<SoftBody>().expect("a body"));
            let added = topology.add_group(GROUP, [VertexIndex(0)]);
            added.expect("it has no groups");
            entity.insert((SoftBody(Arc::new(topology)), ForceMask::default()));
            ticks(&mut app, 1);
        }
        let (how, title) = undoing(app.world(), &sample);
        let (before, values_before) = (bytes(&mut app), values(&mut app));
        act(&mut app, sample.clone());
        let values_after = values(&mut app);
        ticks(&mut app, 5);
        let after = bytes(&mut app);
        let tick = tick_of(&app);
        match how {
            Undoing::State => {
                assert_eq!(time::undo(app.world_mut()).as_deref(), Some(title.as_str()));
                assert!(bytes(&mut app) == before, "undo: {sample:?}");
                assert_eq!(time::redo(app.world_mut()).as_deref(), Some(title.as_str()));
                // A drag that was undone is over, so that only its grab is missing.
                let is_drag = matches!(
                    sample,
                    Action::Grab { .. } | Action::Brush { .. } | Action::GrabPins { .. }
                );
                if !is_drag {
                    assert!(bytes(&mut app) == after, "redo: {sample:?}");
                }
                assert_eq!(tick_of(&app), tick);
            }
            Undoing::Values(_) => {
                assert_ne!(values_before, values_after, "{sample:?} does something");
                assert_eq!(time::undo(app.world_mut()).as_deref(), Some(title.as_str()));
                assert_eq!(values(&mut app), values_before, "undo: {sample:?}");
                assert_eq!(tick_of(&app), tick, "time goes on");
                ticks(&mut app, 2);
                time::redo(app.world_mut());
                assert_eq!(values(&mut app), values_after, "redo: {sample:?}");
                assert_eq!(tick_of(&app), tick + 2);
                time::undo(app.world_mut());
                assert_eq!(values(&mut app), values_before, "undo again: {sample:?}");
            }
            Undoing::Part => assert!(history(&app).is_empty(), "{sample:?}"),
        }
    }
    assert_eq!(seen.len(), count, "a sample of each kind");
}

#[test]
fn removing_any_effect_is_undone_with_all_its_parameters() {
    for scene in SCENES {
        let mut app = app_of(scene.name);
        let body = bodies_in_order(app.world_mut())[0];
        let all = values(&mut app);
        for effect in plain::CARRIED {
            act(
                &mut app,
                Action::RemoveEffect {
                    body,
                    effect: (*effect).to_owned(),
                },
            );
        }
        while time::undo(app.world_mut()).is_some() {}
        assert_eq!(values(&mut app), all, "{}", scene.name);
    }
}

#[test]
fn a_gesture_is_one_entry() {
    let mut app = app_of("shapes");
    let body = bodies_in_order(app.world_mut())[0];
    let slider = |app: &mut App| {
        for value in [1e-4, 2e-4, 4e-4] {
            push(app, set(body, "stretch", "compliance", value));
            ticks(app, 1);
        }
    };
    let start = values(&mut app);
    press(&mut app);
    slider(&mut app);
    assert_eq!(history(&app).len(), 1);
    assert_eq!(history(&app).undo_title(), Some("Stretch compliance"));
    press(&mut app);
    slider(&mut app);
    assert_eq!(history(&app).len(), 2, "another drag of the slider");
    for _ in 0..2 {
        let deform = squash(&mut app);
        act(&mut app, deform);
        ticks(&mut app, 1);
    }
    assert_eq!(history(&app).len(), 4, "two clicks");
    (0..4).for_each(|_| drop(time::undo(app.world_mut())));
    assert_eq!(values(&mut app), start);
    assert_eq!(history(&app).len(), 0);
    let deform = squash(&mut app);
    act(&mut app, deform);
    assert_eq!(
        history(&app).redo_title(),
        None,
        "the rest cannot be redone"
    );
}

#[test]
fn a_rejected_action_is_no_entry() {
    let mut app = app_of("shapes");
    let body = bodies_in_order(app.world_mut())[0];
    push(&mut app, set(body, "stretch", "compliance", -1.0));
    push(&mut app, Action::Restore { body });
    ticks(&mut app, 1);
    assert!(history(&app).is_empty());
}

#[test]
fn memory_stays_within_the_budget() {
    let mut app = app_of("bunny");
    let state = history(&app).bytes().1;
    let budget = 25 * state;
    app.world_mut().resource_mut::<History>().set_budget(budget);
    for round in 0..40 {
        let deform = squash(&mut app);
        act(&mut app, deform);
        ticks(&mut app, 10);
        let (entries, timeline) = history(&app).bytes();
        assert!(entries <= budget, "{entries} of {budget}, round {round}");
        assert!(timeline <= budget, "{timeline} of {budget}, round {round}");
    }
    let timeline = history(&app).timeline();
    let (start, end) = timeline.span().expect("states");
    // The span stays, and the states are evenly spaced.
    assert!(end - start > 6.0, "{start} to {end}");
    let ticks: Vec<u64> = timeline.states().map(|state| state.tick()).collect();
    assert!(timeline.every() > 1);
    let mut gaps = ticks.windows(2).map(|pair| pair[1] - pair[0]);
    assert!(gaps.all(|gap| gap == timeline.every()), "{ticks:?}");
    assert!((15..40).contains(&history(&app).len()));
}

#[test]
fn fifty_actions_of_a_large_scene_can_be_undone() {
    let mut app = app_of("bunny");
    let start = bytes(&mut app);
    for _ in 0..60 {
        let deform = squash(&mut app);
        act(&mut app, deform);
        ticks(&mut app, 1);
    }
    assert!(history(&app).len() >= 50, "{}", history(&app).len());
    assert!(history(&app).bytes().0 <= BUDGET);
    while time::undo(app.world_mut()).is_some() {}
    assert!(bytes(&mut app) == start);
}

/// Opens another scene, as the window does.
fn open(app: &mut App, name: &str) {
    let (current, built) = loaded(name);
    press(app);
    let world = app.world_mut();
    time::before_scene(world, "Open");
    Recorder::scene_ends(world);
    scene::despawn(world);
    world.resource_mut::<SimulationClock>().restart();
    scene::spawn(&built, world);
    Recorder::scene_opened(world, About::from(&current));
    opened(world, current, built);
}

/// Restarts the scene, as the window does.
fn restart(app: &mut App) {
    press(app);
    let world = app.world_mut();
    time::before_scene(world, "Restart");
    let scene = Arc::clone(&world.resource::<OpenScene>().0);
    Recorder::scene_ends(world);
    scene::despawn(world);
    world.resource_mut::<SimulationClock>().restart();
    scene::spawn(&scene.beginning, world);
    Recorder::scene_restarted(world);
    time::begin(world);
}

#[test]
fn the_scene_that_was_open_comes_back_as_it_was() {
    let mut app = app_of("shapes");
    let body = bodies_in_order(app.world_mut())[0];
    ticks(&mut app, 10);
    act(&mut app, set(body, "stretch", "compliance", 5e-4));
    let deform = squash(&mut app);
    act(&mut app, deform);
    ticks(&mut app, 10);
    let first = bytes(&mut app);
    open(&mut app, "colliders");
    ticks(&mut app, 15);
    let second = bytes(&mut app);
    time::undo(app.world_mut());
    assert!(bytes(&mut app) == first);
    assert_eq!(app.world().resource::<CurrentScene>().name, "shapes");
    assert_eq!(history(&app).timeline().len(), 21);
    time::redo(app.world_mut());
    assert!(bytes(&mut app) == second);
    assert_eq!(app.world().resource::<CurrentScene>().name, "colliders");
    restart(&mut app);
    assert_eq!(tick_of(&app), 0);
    (0..4).for_each(|_| drop(time::undo(app.world_mut())));
    assert_eq!(
        tick_of(&app),
        10,
        "before the squash; the parameter is undone"
    );
    assert!(history(&app).is_empty());
    // All of it forward again.
    (0..3).for_each(|_| drop(time::redo(app.world_mut())));
    assert!(bytes(&mut app) == second);
}

#[test]
fn a_recording_with_undo_redo_and_scrubbing_replays() {
    let name = format!("pliant-time-{}.rec", std::process::id());
    let path = std::env::temp_dir().join(name);
    let end = session(&path);
    for threads in [1, 2] {
        let threads = Threads::new(threads).expect("threads");
        let done = replay(&path, &threads, |_| ()).expect("it can be replayed");
        assert_eq!(done.difference, None);
        assert!(done.complete);
        assert_eq!(done.state_hash, end);
        assert_eq!(done.scenes, ["shapes", "colliders", "shapes"]);
        assert_eq!(done.restarts, 1);
        assert!(done.jumps >= 6, "{done:?}");
    }
    fs::remove_file(&path).expect("it was written");
}

/// A recorded session with undo of all kinds; returns the hash at the end.
fn session(path: &Path) -> u64 {
    let mut app = app_of("shapes");
    let about = About::from(&app.world().resource::<OpenScene>().current);
    Recorder::create(path).expect("a file").install(&mut app);
    Recorder::scene_opened(app.world_mut(), about);
    let body = bodies_in_order(app.world_mut())[0];
    ticks(&mut app, 33);
    let deform = squash(&mut app);
    act(&mut app, deform);
    ticks(&mut app, 14);
    time::undo(app.world_mut());
    ticks(&mut app, 7);
    act(&mut app, set(body, "stretch", "compliance", 1e-3));
    ticks(&mut app, 12);
    time::undo(app.world_mut());
    ticks(&mut app, 5);
    // Scrubbing writes only the state from which time goes on.
    press(&mut app);
    for tick in (3..40).rev() {
        time::scrub(app.world_mut(), f64::from(tick) / 60.0);
    }
    ticks(&mut app, 21);
    time::undo(app.world_mut());
    act(&mut app, Action::Despawn { body });
    ticks(&mut app, 3);
    time::undo(app.world_mut());
    ticks(&mut app, 3);
    open(&mut app, "colliders");
    ticks(&mut app, 11);
    time::undo(app.world_mut());
    ticks(&mut app, 13);
    restart(&mut app);
    ticks(&mut app, 12);
    time::undo(app.world_mut());
    ticks(&mut app, 4);
    time::step_back(app.world_mut());
    Recorder::end(app.world_mut());
    assert_eq!(app.world().resource::<Recorder>().failure(), None);
    hash(&mut app)
}

/// Run it with `cargo test --release --test suite -- --ignored --nocapture cost_of_the_timeline`.
#[test]
#[ignore = "prints the table of docs/results/window.md"]
fn cost_of_the_timeline() {
    let median = |mut times: Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    };
    for name in ["jelly_cube", "bunny", "many_bodies", "dragon", "heap"] {
        let mut app = app_of(name);
        let bytes = history(&app).bytes().1;
        let (_, built) = loaded(name);
        let mut plain = headless(&built);
        let (mut alone, mut keeping) = (Vec::new(), Vec::new());
        for _ in 0..60 {
            let started = Instant::now();
            ticks(&mut plain, 1);
            alone.push(started.elapsed().as_secs_f64() * 1e3);
            ticks(&mut app, 1);
            let started = Instant::now();
            let state = State::take(app.world_mut(), None).expect("between ticks");
            keeping.push(started.elapsed().as_secs_f64() * 1e3);
            drop(state);
        }
        let particles: usize = built
            .world
            .bodies
            .iter()
            .map(|body| body.particles.len())
            .sum();
        let every = (600 * bytes).div_ceil(BUDGET).next_power_of_two();
        println!(
            "| {name} | {particles} | {:.2} | {:.3} | {:.2} | {:.0} | {every} |",
            median(alone),
            median(keeping),
            bytes as f64 / 1e6,
            (600 / every * bytes) as f64 / 1e6,
        );
    }
}

#[test]
fn dragging_on_the_strip_asks_for_the_time_under_the_pointer() {
    let strip = TimeStrip {
        states: 601,
        start: 5.0,
        end: 15.0,
        now: 15.0,
        every: 1,
        marks: vec![(7.5, "Pin".to_owned())],
    };
    for place in [0.0, 0.25, 1.0] {
        assert!((strip.place(strip.time(place)) - place).abs() < 1e-6);
    }
    let context = egui::Context::default();
    theme::apply(&context, Theme::Dark);
    let window = egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(900.0, 600.0));
    let rect = egui::Rect::from_min_max(
        egui::pos2(0.0, window.bottom() - time_strip::HEIGHT),
        window.max,
    );
    let draw = |events: Vec<egui::Event>| {
        let input = egui::RawInput {
            screen_rect: Some(window),
            events,
            ..egui::RawInput::default()
        };
        let mut scrubbed = None;
        let output = context.run_ui(input, |ui| {
            scrubbed = time_strip::show(ui.ctx(), rect, &strip).1;
        });
        output.drop_without_applying_deltas();
        scrubbed
    };
    for _ in 0..3 {
        draw(Vec::new());
    }
    let button = |x, pressed| egui::Event::PointerButton {
        pos: egui::pos2(x, rect.center().y),
        button: egui::PointerButton::Primary,
        pressed,
        modifiers: egui::Modifiers::NONE,
    };
    let moved = |x| egui::Event::PointerMoved(egui::pos2(x, rect.center().y));
    draw(vec![moved(450.0)]);
    draw(vec![button(450.0, true)]);
    // A press becomes a drag when the pointer has moved by a few pixels.
    draw(vec![moved(470.0)]);
    let middle = draw(vec![moved(450.0)]).expect("it is dragged");
    // A pixel is a hundredth of a second.
    assert!((middle - 10.0).abs() < 0.02, "{middle}");
    let start = draw(vec![moved(-50.0)]).expect("still dragged");
    assert_eq!(start, 5.0);
    draw(vec![button(-50.0, false)]);
    assert_eq!(draw(Vec::new()), None);
}
