//! Scenes are saved with their changes and open again to the same; recordings begin at any time; the
//! cards ask what they say.

use crate::support_app::{push, set, ticks};
use bevy::prelude::*;
use bevy_egui::egui::{Context, Event, Key, Modifiers, PointerButton, RawInput, Rect, pos2, vec2};
use pliant::{
    mesh::Primitive,
    recording::{About, Recorder, Snapshot, replay},
    sandbox::{
        app::keep::{
            card::{Answer, Card, SaveCard, draw},
            save::{OpenDefinition, SaveError, save, scene_file, scene_text},
            unsaved::Baseline,
        },
        state::{
            display::Theme,
            keep::{FileKind, RecentFiles},
        },
        ui::{WidgetRects, theme},
    },
    scene::{
        self, BuiltScene, CurrentScene, Scene,
        registry::SCENES,
        run::headless,
        save::{Definition, MeshSource},
    },
    simulation::{Action, Applied, NewBody, SpawnOrder, plain, plain::bodies_in_order, state_hash},
    solver::{Body, Collider, ColliderShape, Density, Pose, Threads, Topology, VertexIndex},
};
use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

/// A folder for a test, removed when dropped.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str) -> Self {
        let folder =
            std::env::temp_dir().join(format!("pliant-keep-{test}-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder for temporary files");
        Self(folder)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// The bytes of a built scene, which contain all of it.
fn bytes(built: &BuiltScene) -> Vec<u8> {
    Snapshot::new(About::default(), built.clone()).to_bytes()
}

fn text(scene: &Scene) -> String {
    scene.to_text().expect("it can be written")
}

/// An app with a scene as the window opens it.
fn opened(name: &str) -> App {
    let current = Scene::load(name).expect("a built-in scene");
    let built = current.scene.build().expect("it builds");
    let mut app = headless(&built);
    let definition = Definition::new(&current.scene, &built);
    app.insert_resource(OpenDefinition(Some(definition)))
        .insert_resource(current)
        .init_resource::<RecentFiles>()
        .add_observer(
            |applied: On<Applied>,
             bodies: Query<&SpawnOrder>,
             mut definition: ResMut<OpenDefinition>| {
                if let (Action::Spawn(new), Some(definition)) = (&applied.action, &mut definition.0)
                {
                    let order = bodies.iter().max().expect("it was spawned");
                    definition.note_added(*order, Arc::clone(new));
                }
            },
        );
    Baseline::take(app.world_mut());
    app
}

fn body(app: &mut App, index: usize) -> Entity {
    bodies_in_order(app.world_mut())[index]
}

/// The scene that is saved now, read back and built.
fn again(app: &mut App) -> (Scene, BuiltScene, Vec<String>) {
    let folder = std::env::temp_dir();
    let (text, notes) = scene_text(app.world_mut(), &folder).expect("it can be described");
    let scene: Scene = text.parse().expect("it reads back");
    let built = scene.build().expect("it builds");
    (scene, built, notes)
}

fn pin(body: Entity, vertex: u32) -> Action {
    let vertex = VertexIndex(vertex);
    Action::Pin { body, vertex }
}

/// Adds a ball that comes from the panel's list.
fn add_ball(app: &mut App, place: Vec3) {
    let primitive = Primitive::Sphere {
        radius: 0.2,
        cells: 4,
    };
    let shape = primitive.build().expect("it can be made").shape;
    let topology = Arc::new(Topology::new(shape).expect("sound"));
    let definition = &mut app.world_mut().resource_mut::<OpenDefinition>().0;
    let definition = definition.as_mut().expect("a scene");
    definition.note_mesh(&topology, MeshSource::Primitive(primitive));
    let mut body = Body::new("ball", topology, Density::default());
    body.effects.stretch = Some(Default::default());
    body.translate(place);
    let skin = None;
    push(
        app,
        Action::Spawn(Arc::new(NewBody {
            body,
            skin,
            own: Vec::new(),
        })),
    );
    ticks(app, 1);
}

#[test]
fn every_built_in_scene_is_saved_and_opens_again_to_the_same_bits() {
    let folder = std::env::temp_dir();
    for builtin in SCENES {
        let name = builtin.name;
        let scene = Scene::load(name).expect("it loads").scene;
        let built = scene.build().expect("it builds");
        let saved = Definition::new(&scene, &built).save(&built, &folder);
        let saved = saved.unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(saved.notes, Vec::<String>::new(), "{name}");
        let text = text(&saved.scene);
        let read: Scene = text
            .parse()
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        let again = read
            .build()
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(bytes(&again) == bytes(&built), "{name} differs");
        assert_eq!(read.acceptance, scene.acceptance, "{name}");
        assert_eq!(read.answers, scene.answers, "{name}");
    }
}

#[test]
fn motion_is_no_change_and_a_scene_that_ran_is_saved_as_it_began() {
    let names = [
        "jelly_cube",
        "rope",
        "plasticity",
        "colliders",
        "materials",
        "dispenser",
    ];
    for name in names {
        let mut app = opened(name);
        // The emitters of the last scene have emitted two copies each.
        ticks(&mut app, 45);
        assert_eq!(Baseline::changes(app.world_mut()), Vec::<String>::new());
        let (_, built, notes) = again(&mut app);
        let first = Scene::load(name).expect("it loads").scene.build();
        assert!(bytes(&built) == bytes(&first.expect("it builds")), "{name}");
        assert!(notes.is_empty(), "{name}: {notes:?}");
    }
}

#[test]
fn changed_settings_parameters_and_pins_are_in_the_saved_scene() {
    let mut app = opened("jelly_cube");
    ticks(&mut app, 5);
    let cube = body(&mut app, 0);
    let (name, value) = ("substeps".to_owned(), 23.0);
    push(&mut app, Action::SetSetting { name, value });
    push(&mut app, set(cube, "stretch", "compliance", 3.25e-4));
    push(&mut app, pin(cube, 7));
    let effect = "volume".to_owned();
    push(&mut app, Action::RemoveEffect { body: cube, effect });
    ticks(&mut app, 3);
    let changes = Baseline::changes(app.world_mut()).join(", ");
    let expected = "1 setting changed, parameters of 1 body changed, pins of 1 body changed";
    assert_eq!(changes, expected);
    let (scene, built, _) = again(&mut app);
    assert_eq!(scene.world.substeps.get(), 23);
    let saved = &built.world.bodies[0];
    let now = plain::body(app.world().entity(cube)).expect("a body");
    assert_eq!(saved.effects, now.effects);
    assert!(saved.effects.volume.is_none());
    assert!(saved.pins.contains(&VertexIndex(7)));
    // The body begins where it began.
    let first = Scene::load("jelly_cube").expect("it loads").scene.build();
    let first = &first.expect("it builds").world.bodies[0];
    for (a, b) in saved
        .particles
        .positions
        .iter()
        .zip(&first.particles.positions)
    {
        assert_eq!(a.truncate(), b.truncate());
    }
}

#[test]
fn a_body_that_was_added_is_saved_where_it_was_added_and_a_removed_one_is_not() {
    let mut app = opened("shapes");
    let count = bodies_in_order(app.world_mut()).len();
    let place = Vec3::new(0.3, 2.0, -0.4);
    add_ball(&mut app, place);
    let removed = body(&mut app, 0);
    push(&mut app, Action::Despawn { body: removed });
    ticks(&mut app, 30);
    let changes = Baseline::changes(app.world_mut());
    assert_eq!(changes, ["1 body added", "1 body removed"]);
    let (scene, built, notes) = again(&mut app);
    // The scene has criteria on the removed body.
    assert_eq!(
        notes,
        ["Acceptance criteria of removed bodies were left out"]
    );
    assert_eq!(built.world.bodies.len(), count);
    let ball = scene.bodies.last().expect("a body");
    assert_eq!((ball.name.as_str(), ball.position), ("ball", place));
    let now = bodies_in_order(app.world_mut());
    let now = now
        .iter()
        .map(|body| plain::body(app.world().entity(*body)));
    for (now, saved) in now.zip(&built.world.bodies) {
        let now = now.expect("a body");
        assert_eq!((&now.name, &now.effects), (&saved.name, &saved.effects));
        assert_eq!(now.topology.rest, saved.topology.rest);
    }
}

#[test]
fn one_changed_copy_of_a_grid_is_written_by_itself_and_the_others_stay_where_they_are() {
    let mut app = opened("many_bodies");
    let all = bodies_in_order(app.world_mut());
    push(&mut app, set(all[1], "stretch", "compliance", 1.0 / 1024.0));
    push(&mut app, Action::Despawn { body: all[2] });
    ticks(&mut app, 1);
    let (_, built, _) = again(&mut app);
    let first = Scene::load("many_bodies").expect("it loads").scene.build();
    let mut expected = first.expect("it builds").world.bodies;
    expected.remove(2);
    assert_eq!(built.world.bodies.len(), expected.len());
    for (index, (saved, first)) in built.world.bodies.iter().zip(&expected).enumerate() {
        assert_eq!(saved.name, first.name);
        assert_eq!(saved.particles.positions, first.particles.positions);
        assert_eq!(saved.effects == first.effects, index != 1, "{}", saved.name);
    }
}

#[test]
fn moved_and_added_colliders_are_saved_and_a_mesh_of_unknown_source_is_a_reason() {
    let mut app = opened("colliders");
    let first = plain::colliders_in_order(app.world_mut())[0];
    let turn = pliant::solver::contact::rotation_degrees(Vec3::new(10.0, -25.0, 70.0));
    let start = Pose {
        rotation: turn,
        translation: bevy::math::DVec3::new(0.5, 1.25, -0.75),
    };
    let mut moved = app.world_mut().get_mut::<Collider>(first).expect("one");
    moved.start = start;
    let sphere = ColliderShape::Sphere { radius: 0.3 };
    let added = Collider::new(sphere, Pose::default()).expect("sound");
    app.world_mut().spawn(added.clone());
    assert_eq!(Baseline::changes(app.world_mut()), ["colliders changed"]);
    let (_, built, _) = again(&mut app);
    assert_eq!(built.world.colliders.last(), Some(&added));
    let saved = &built.world.colliders[0].start;
    assert_eq!(saved.translation, start.translation);
    // Angles are rounded to f32.
    assert!(saved.rotation.abs_diff_eq(start.rotation, 1e-6));

    let mesh = ColliderShape::Mesh(
        pliant::solver::ColliderMesh::new(&[Vec3::ZERO, Vec3::X, Vec3::Y], &[[0, 1, 2]])
            .expect("a triangle"),
    );
    let unknown = Collider::new(mesh, Pose::default()).expect("sound");
    app.world_mut().spawn(unknown);
    let error = scene_text(app.world_mut(), Path::new("")).expect_err("its mesh is unknown");
    let SaveError::NotDescribable(reasons) = error else {
        panic!("{error}");
    };
    assert!(
        reasons[0].contains("the source of its mesh is unknown"),
        "{reasons:?}"
    );
}

#[test]
fn analytic_solutions_and_criteria_of_removed_bodies_are_left_out() {
    let mut app = opened("rope");
    let scene = app.world().resource::<CurrentScene>().scene.clone();
    assert!(!scene.answers.is_empty());
    for body in bodies_in_order(app.world_mut()) {
        push(&mut app, Action::Despawn { body });
    }
    add_ball(&mut app, Vec3::Y);
    let (saved, ..) = again(&mut app);
    assert!(saved.answers.is_empty());
}

#[test]
fn a_saved_scene_is_open_under_its_name_and_nothing_is_unsaved() {
    let folder = Folder::new("open");
    let mut app = opened("jelly_cube");
    let cube = body(&mut app, 0);
    push(&mut app, pin(cube, 3));
    ticks(&mut app, 1);
    let world = app.world_mut();
    assert_eq!(scene_file(world), None);
    let path = folder.0.join("my cube.ron");
    save(world, FileKind::Scene, &path, false).expect("it is new");
    assert_eq!(scene_file(world), Some(path.clone()));
    assert_eq!(world.resource::<RecentFiles>().files()[0].path, path);
    assert!(Baseline::changes(world).is_empty());
    let error = save(world, FileKind::Scene, &path, false).expect_err("it exists");
    assert!(matches!(error, SaveError::Exists(_)), "{error}");
    save(world, FileKind::Scene, &path, true).expect("it may be replaced");
    let nowhere = path.join("below a file.ron");
    let error = save(world, FileKind::Scene, &nowhere, true).expect_err("no such place");
    assert!(matches!(error, SaveError::Failed(_)), "{error}");
    assert_eq!(scene_file(world), Some(path), "the scene keeps its file");
}

#[test]
fn a_snapshot_continues_with_the_same_bits_and_has_no_definition() {
    let folder = Folder::new("snapshot");
    let mut app = opened("jelly_cube");
    ticks(&mut app, 12);
    let path = folder.0.join("cube.snap");
    save(app.world_mut(), FileKind::Snapshot, &path, false).expect("it is new");
    let (current, built) = pliant::recording::open(path.to_str().expect("UTF-8")).expect("there");
    let mut other = headless(&built);
    other.insert_resource(current);
    other.insert_resource(OpenDefinition(None));
    ticks(&mut app, 20);
    ticks(&mut other, 20);
    assert_eq!(state_hash(app.world_mut()), state_hash(other.world_mut()));
    assert_eq!(scene_file(other.world()), None);
    let error = scene_text(other.world_mut(), &folder.0).expect_err("it is not defined");
    assert!(error.to_string().contains("snapshot"), "{error}");
}

/// A recording that begins in the middle contains the state of that moment, and the beginning of the
/// scene once it is restarted.
#[test]
fn a_recording_begun_in_the_middle_replays_to_the_same_bits_also_after_a_restart() {
    let folder = Folder::new("recording");
    let built = Scene::load("shapes").expect("it loads").scene.build();
    let built = built.expect("it builds");
    for restart in [false, true] {
        let mut app = headless(&built);
        Recorder::add_systems(&mut app);
        ticks(&mut app, 37);
        let path = folder.0.join(format!("{restart}.rec"));
        let about = About {
            name: "shapes".to_owned(),
            ..About::default()
        };
        Recorder::begin(app.world_mut(), about, &path).expect("a file");
        let cube = body(&mut app, 0);
        push(&mut app, set(cube, "stretch", "compliance", 2e-4));
        ticks(&mut app, 15);
        for _ in 0..if restart { 2 } else { 0 } {
            let world = app.world_mut();
            Recorder::scene_ends(world);
            scene::despawn(world);
            scene::spawn(&built, world);
            Recorder::scene_restarted(world);
            let cube = body(&mut app, 1);
            push(&mut app, pin(cube, 2));
            ticks(&mut app, 12);
        }
        Recorder::end(app.world_mut());
        app.world_mut().remove_resource::<Recorder>();
        let hash = state_hash(app.world_mut());
        // What happens later is not recorded.
        ticks(&mut app, 5);
        for threads in [1, 2] {
            let threads = Threads::new(threads).expect("threads");
            let played = replay(&path, &threads, |_| ()).expect("it is sound");
            assert!(played.complete && played.difference.is_none(), "{played:?}");
            assert_eq!(played.state_hash, hash);
            assert_eq!(played.restarts, if restart { 1 } else { 0 });
        }
    }
}

/// A card on a screen of 1280 × 800 px, with events.
struct Screen {
    context: Context,
    places: WidgetRects,
}

impl Screen {
    fn new() -> Self {
        let context = Context::default();
        theme::apply(&context, Theme::Light);
        Self {
            context,
            places: WidgetRects::default(),
        }
    }

    fn frame(&mut self, card: &mut Card, events: Vec<Event>) -> Option<Answer> {
        let screen = Rect::from_min_size(pos2(0.0, 0.0), vec2(1280.0, 800.0));
        let input = RawInput {
            screen_rect: Some(screen),
            events,
            ..RawInput::default()
        };
        let mut answer = None;
        self.places.clear();
        let places = &mut self.places;
        let output = self.context.run_ui(input, |ui| {
            let free = Rect::from_min_size(pos2(0.0, 0.0), vec2(936.0, 800.0));
            answer = answer.or(draw(&ui.ctx().clone(), card, free, places));
        });
        output.drop_without_applying_deltas();
        answer
    }

    /// Presses a widget.
    fn press(&mut self, card: &mut Card, name: &str) -> Option<Answer> {
        self.frame(card, Vec::new());
        self.frame(card, Vec::new());
        let pos = self.places.get(name).unwrap_or_else(|| panic!("no {name}"));
        let pos = pos.center();
        let button = |pressed| Event::PointerButton {
            pos,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        };
        self.frame(card, vec![Event::PointerMoved(pos)]);
        self.frame(card, vec![button(true)]);
        self.frame(card, vec![button(false)])
    }

    fn key(&mut self, card: &mut Card, key: Key) -> Option<Answer> {
        let event = Event::Key {
            key,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers: Modifiers::NONE,
        };
        self.frame(card, vec![event])
    }
}

fn save_card() -> SaveCard {
    SaveCard {
        kind: FileKind::Scene,
        name: "bunny".to_owned(),
        folder: PathBuf::from("/home/me/Documents/Pliant"),
        error: None,
        reasons: Vec::new(),
        exists: false,
        then_close: false,
    }
}

#[test]
fn the_save_card_saves_by_button_and_by_enter_and_takes_letters_from_the_start() {
    let mut screen = Screen::new();
    let mut card = Card::Save(save_card());
    let save = Some(Answer::Save { replace: false });
    assert_eq!(screen.press(&mut card, "keep.save"), save);
    assert_eq!(screen.press(&mut card, "keep.cancel"), Some(Answer::Cancel));
    let mut screen = Screen::new();
    screen.frame(&mut card, Vec::new());
    screen.frame(&mut card, Vec::new());
    screen.frame(&mut card, vec![Event::Text("x".to_owned())]);
    let Card::Save(typed) = &card else {
        panic!("{card:?}");
    };
    assert!(typed.name.contains('x'), "{}", typed.name);
    assert_eq!(screen.key(&mut card, Key::Enter), save);
    assert_eq!(screen.key(&mut card, Key::Escape), Some(Answer::Cancel));
}

#[test]
fn an_existing_file_is_replaced_by_a_button_of_its_own_and_a_new_name_takes_that_back() {
    let mut screen = Screen::new();
    let mut card = Card::Save(SaveCard {
        exists: true,
        ..save_card()
    });
    let replace = Some(Answer::Save { replace: true });
    assert_eq!(screen.press(&mut card, "keep.replace"), replace);
    let mut screen = Screen::new();
    screen.frame(&mut card, Vec::new());
    screen.frame(&mut card, Vec::new());
    assert_ne!(
        screen.key(&mut card, Key::Enter),
        replace,
        "Enter replaces nothing"
    );
    screen.frame(&mut card, Vec::new());
    screen.frame(&mut card, vec![Event::Text("2".to_owned())]);
    let Card::Save(typed) = &card else {
        panic!("{card:?}");
    };
    assert!(!typed.exists, "{typed:?}");
}

#[test]
fn a_state_that_no_scene_file_describes_is_offered_as_a_snapshot() {
    let mut screen = Screen::new();
    let mut card = Card::Save(SaveCard {
        reasons: vec!["collider 3: the source of its mesh is unknown".to_owned()],
        ..save_card()
    });
    let pressed = screen.press(&mut card, "keep.snapshot");
    assert_eq!(pressed, Some(Answer::Snapshot));
    assert!(screen.places.get("keep.save").is_none());
}

#[test]
fn the_closing_card_saves_discards_or_stays() {
    for (name, answer) in [
        ("keep.save", Answer::Save { replace: true }),
        ("keep.discard", Answer::Discard),
        ("keep.cancel", Answer::Cancel),
    ] {
        let mut card = Card::Closing {
            changes: vec!["1 body added".to_owned()],
            file: None,
        };
        assert_eq!(Screen::new().press(&mut card, name), Some(answer));
    }
}
