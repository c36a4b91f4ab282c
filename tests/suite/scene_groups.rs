//! Groups of vertices in scene files, saved scenes, snapshots, actions and the panel's model.

use crate::support_app::{app, app_of, done, ticks};
use bevy::{ecs::message::Messages, prelude::*};
use pliant::{
    effect::{EffectUnfit, ForceMask},
    recording::{About, Snapshot},
    scene::{BuiltScene, Scene, SceneError, run::headless, save::Definition},
    simulation::{
        Action, SimulationSettings, SoftBody,
        plain::{self, bodies_in_order},
        state_hash,
    },
    solver::{Body, Cut, Finite, GroupName, Particles, Uniform, VertexIndex},
};
use std::{
    fs,
    path::{Path, PathBuf},
};

const TOP: GroupName = GroupName::of("top");

/// A cloth of 5 × 5 vertices that hangs: 1 m along x and y, with its center 2 m above the origin.
fn text(groups: &str, mask: &str, fields: &str) -> String {
    format!(
        "Scene(title: \"Groups\", look_at: \"Groups.\", bodies: [(\n\
         name: \"kite\", primitive: Cloth(size: (1, 1), cells: (4, 4)), density: 0.3,\n\
         position: (0, 2, 0), rotation: (90, 0, 0),\n\
         groups: {groups},\n\
         effects: (stretch: (), uniform: (z: 3), force_mask: ({mask})), {fields})],\n\
         colliders: [(shape: Sphere(radius: 0.1))],\n\
         acceptance: (seconds: 1, checks: []))"
    )
}

fn built(groups: &str, mask: &str, fields: &str) -> BuiltScene {
    let scene: Scene = text(groups, mask, fields).parse().expect("valid");
    scene.build().expect("it builds")
}

fn error(groups: &str, mask: &str, fields: &str) -> String {
    let scene = text(groups, mask, fields).parse::<Scene>();
    let error = scene.and_then(|scene| scene.build());
    error.expect_err("it is wrong").to_string()
}

#[track_caller]
fn says(message: &str, words: &[&str]) {
    for word in words {
        assert!(message.contains(word), "“{word}” is not in: {message}");
    }
}

/// The vertices of a group, ascending.
fn vertices(body: &Body, name: &str) -> Vec<u32> {
    let name = GroupName::new(name).expect("short");
    let particles = body.topology.groups.particles(name);
    let mut vertices: Vec<u32> = particles
        .map(|particle| body.topology.numbering.vertex(particle).0)
        .collect();
    vertices.sort_unstable();
    vertices
}

const THREE: &str = "{\"top\": [Top(0)], \"corner\": [Within(low: (0.4, 1.4, -9), high: (9, 1.6, 9)), Vertex(12)], \
                     \"both\": [Group(\"corner\"), Group(\"top\"), Vertex(0)]}";

#[test]
fn a_group_is_what_its_entries_select_at_the_place_of_the_body() {
    let built = built(THREE, "group: \"top\"", "pins: [Group(\"corner\")]");
    let body = &built.world.bodies[0];
    let names = body.topology.groups.names();
    assert_eq!(
        names.iter().map(GroupName::as_str).collect::<Vec<_>>(),
        ["top", "corner", "both"]
    );
    // The first row of a cloth has the smallest z, which the rotation turns to the top.
    assert_eq!(vertices(body, "top"), [0, 1, 2, 3, 4]);
    assert_eq!(vertices(body, "corner"), [12, 24]);
    assert_eq!(vertices(body, "both"), [0, 1, 2, 3, 4, 12, 24]);
    assert_eq!(body.pins, [12, 24].map(VertexIndex));
    assert_eq!(body.effects.force_mask.map(|mask| mask.group), Some(TOP));
}

#[test]
fn a_group_is_stitched_point_by_point() {
    let built = built(
        THREE,
        "",
        "stitches: [(point: Group(\"top\"), to: Collider(1))]",
    );
    let stitches = built.world.bodies[0].stitches.all();
    let mut points: Vec<_> = stitches.iter().map(|stitch| stitch.point).collect();
    points.dedup();
    assert_eq!(points.len(), 5);
    let inside = "stitches: [(point: Group(\"top\"), to: Point(Vertex(0)))]";
    says(
        &error(THREE, "", inside),
        &["stitch 1", "Group", "Collider"],
    );
}

#[test]
fn copies_and_cuts_share_the_groups_of_the_entry() {
    let copies = "copies: (count: (2, 1, 1), spacing: (3, 0, 0)), \
                  cuts: [(eye: (0.01, 2, 5), rays: ((0, -1, -1), (0, 1, -1)))]";
    let built = built(THREE, "group: \"top\"", copies);
    for body in &built.world.bodies {
        let splits = body.topology.splits();
        assert!(splits > 0, "it was cut");
        let corner = vertices(body, "corner");
        assert_eq!(corner[..2], [12, 24]);
        let top: Vec<u32> = vertices(body, "top");
        assert_eq!(top[..5], [0, 1, 2, 3, 4]);
        let rest = |vertex: u32| body.topology.rest[body.topology.particle(VertexIndex(vertex))];
        let copied = top[5..].iter().all(|copy| rest(*copy).z == rest(0).z);
        assert!(copied && top.len() > 5, "{top:?}");
    }
}

#[test]
fn wrong_groups_are_errors_with_the_body_and_what_is_there() {
    says(
        &error("{\"top\": [Top(0)]}", "group: \"tip\"", ""),
        &[
            "“kite”",
            "`force_mask`",
            "unknown group “tip”",
            "did you mean",
            "top",
        ],
    );
    says(
        &error("{}", "group: \"top\"", ""),
        &["“kite”", "`force_mask`", "the body has no `groups`"],
    );
    says(
        &error("{\"top\": [Vertex(25)]}", "", ""),
        &[
            "“kite”",
            "group “top”",
            "Vertex(25) selects nothing",
            "0 to 24",
        ],
    );
    says(
        &error("{\"top\": []}", "", ""),
        &["“kite”", "group “top”", "no entries"],
    );
    says(
        &error("{\"a\": [Group(\"b\")], \"b\": [Top(0)]}", "", ""),
        &["“kite”", "group “a”", "unknown group “b”"],
    );
    says(
        &error("{\"top\": [Roots(1)]}", "", ""),
        &["“kite”", "group “top”", "Roots"],
    );
    says(
        &error("{}", "", "pins: [Group(\"top\")]"),
        &["“kite”", "unknown group “top”"],
    );
    says(
        &error(
            "{}",
            "",
            "stitches: [(point: Group(\"top\"), to: Collider(1))]",
        ),
        &["“kite”", "stitch 1", "unknown group “top”"],
    );
    let many = |count: u32| -> String {
        let each = (0..count).map(|i| format!("\"g{i}\": [Vertex(0)]"));
        format!("{{{}}}", each.collect::<Vec<_>>().join(", "))
    };
    assert_eq!(
        built(&many(32), "", "").world.bodies[0]
            .topology
            .groups
            .names()
            .len(),
        32
    );
    says(
        &error(&many(33), "", ""),
        &["“kite”", "33 groups", "at most 32"],
    );
}

#[test]
fn wrong_names_are_errors_with_their_line() {
    let syntax = |groups: &str, mask: &str| {
        let scene = text(groups, mask, "").parse::<Scene>();
        match scene.expect_err("it is wrong") {
            SceneError::Syntax { line, message, .. } => (line, message),
            other => panic!("{other}"),
        }
    };
    let (line, message) = syntax("{\"top\": [Top(0)], \"top\": [Left(0)]}", "");
    assert_eq!(line, 4);
    says(&message, &["“top” is there twice"]);
    let (line, message) = syntax("{\"\": [Top(0)]}", "");
    assert_eq!(line, 4);
    says(&message, &["a name of 1 to 31 bytes"]);
    let long = "a".repeat(32);
    let (line, message) = syntax(&format!("{{\"{long}\": [Top(0)]}}"), "");
    assert_eq!(line, 4);
    says(&message, &[&long, "at most 31 bytes"]);
    let (line, message) = syntax("{}", &format!("group: \"{long}\""));
    assert_eq!(line, 5);
    says(&message, &["at most 31 bytes"]);
}

#[test]
fn a_scene_with_groups_is_written_and_read() {
    let scene: Scene = text(THREE, "group: \"top\"", "").parse().expect("valid");
    let written = scene.to_text().expect("it can be written");
    assert!(written.contains("\"corner\": ["), "{written}");
    let again: Scene = written.parse().expect(&written);
    assert_eq!(again, scene);
}

/// Copies that differ have entries of their own, whose groups are listed by vertex: a box in the scene
/// would contain other vertices at another place.
#[test]
fn a_saved_scene_has_the_groups_that_it_had() {
    let copies = "copies: (count: (2, 1, 1), spacing: (3, 0, 0))";
    let scene: Scene = text(THREE, "group: \"both\"", copies)
        .parse()
        .expect("valid");
    let built = scene.build().expect("it builds");
    let definition = Definition::new(&scene, &built);
    let mut now = built.clone();
    let mask = &mut now.world.bodies[1].effects.force_mask;
    mask.as_mut().expect("a mask").group = TOP;
    let saved = definition
        .save(&now, Path::new(""))
        .expect("describable")
        .scene;
    assert_eq!(saved.bodies.len(), 2);
    let written = saved.to_text().expect("it can be written");
    let again = written
        .parse::<Scene>()
        .expect(&written)
        .build()
        .expect("it builds");
    for (before, after) in built.world.bodies.iter().zip(&again.world.bodies) {
        assert_eq!(before.topology.groups, after.topology.groups);
    }
    let masks = again
        .world
        .bodies
        .iter()
        .map(|body| body.effects.force_mask);
    let chosen: Vec<_> = masks
        .map(|mask| mask.expect("a mask").group.to_string())
        .collect();
    assert_eq!(chosen, ["both", "top"]);
    // Unchanged, the entry remains as it was.
    let same = definition
        .save(&built, Path::new(""))
        .expect("describable")
        .scene;
    assert_eq!(same.bodies, scene.bodies);
}

#[test]
fn a_snapshot_has_the_groups_of_a_torn_body_and_goes_on_with_the_same_bits() {
    let mut app = headless(&built(THREE, "group: \"both\"", "pins: [Vertex(4)]"));
    let body = bodies_in_order(app.world_mut())[0];
    ticks(&mut app, 5);
    let cut = Cut {
        eye: Vec3::new(0.01, 2.0, 5.0),
        rays: [Vec3::new(0.0, -1.0, -1.0), Vec3::new(0.0, 1.0, -1.0)],
    };
    assert!(done(&mut app, Action::Cut { body, cut }).is_empty());
    ticks(&mut app, 5);
    let taken = Snapshot::take(app.world_mut(), About::default()).expect("between ticks");
    let bytes = taken.to_bytes();
    let read = Snapshot::from_bytes(&bytes).expect("it was just written");
    assert_eq!(read.to_bytes(), bytes);
    let now = &plain::capture(app.world_mut()).bodies[0];
    assert!(now.topology.splits() > 0 && !now.topology.groups.is_empty());
    assert_eq!(
        read.built.world.bodies[0].topology.groups,
        now.topology.groups
    );
    let mut other = headless(&read.built);
    for _ in 0..20 {
        ticks(&mut app, 1);
        ticks(&mut other, 1);
        assert_eq!(state_hash(app.world_mut()), state_hash(other.world_mut()));
    }
    // The group makes a difference there.
    let mut whole = read.built.clone();
    let mask = &mut whole.world.bodies[0].effects.force_mask;
    mask.as_mut().expect("a mask").group = GroupName::default();
    let mut whole = headless(&whole);
    ticks(&mut whole, 20);
    assert_ne!(state_hash(whole.world_mut()), state_hash(app.world_mut()));
}

#[test]
fn an_action_chooses_a_group_that_the_body_has() {
    let built = built(THREE, "", "");
    let (mut app, bodies, _) = app_of(&built.world);
    let body = bodies[0];
    let choose = |group: GroupName| Action::SetForceGroup { body, group };
    assert!(done(&mut app, choose(TOP)).is_empty());
    let group = |app: &App| app.world().get::<ForceMask>(body).map(|mask| mask.group);
    assert_eq!(group(&app), Some(TOP));
    let errors = done(&mut app, choose(GroupName::of("tip")));
    says(
        &errors[0].to_string(),
        &["unknown group “tip”", "top, corner, both"],
    );
    assert_eq!(group(&app), Some(TOP), "nothing has changed");
    assert!(done(&mut app, choose(GroupName::default())).is_empty());
    assert_eq!(group(&app), Some(GroupName::default()));
    app.world_mut().entity_mut(body).remove::<ForceMask>();
    let errors = done(&mut app, choose(TOP));
    says(&errors[0].to_string(), &["force_mask"]);
}

#[test]
fn a_mask_of_an_unknown_group_is_reported_and_no_force_acts() {
    let mut app = app();
    let cloth = || SoftBody::cloth(Vec2::ONE, UVec2::splat(4)).group(TOP, 0..5);
    let force = Uniform {
        x: Finite::of(3.0),
        ..default()
    };
    let mask = |name| ForceMask {
        group: GroupName::of(name),
        ..default()
    };
    let right = app
        .world_mut()
        .spawn((cloth().build(), force, mask("top")))
        .id();
    let wrong = app
        .world_mut()
        .spawn((cloth().build(), force, mask("tip")))
        .id();
    app.world_mut()
        .resource_mut::<SimulationSettings>()
        .0
        .gravity = Vec3::ZERO;
    ticks(&mut app, 1);
    let messages = app.world().resource::<Messages<EffectUnfit>>();
    let mut cursor = messages.get_cursor();
    let found: Vec<_> = cursor.read(messages).collect();
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].body, wrong);
    says(
        &found[0].text,
        &["force_mask", "no group “tip”", "expected one of: top"],
    );
    let moves = |body: Entity| -> Vec<bool> {
        let particles = app.world().get::<Particles>(body).expect("a body");
        (0..25)
            .map(|i| particles.velocity(i) != Vec3::ZERO)
            .collect()
    };
    assert_eq!(moves(right), (0..25).map(|i| i < 5).collect::<Vec<_>>());
    assert_eq!(moves(wrong), [false; 25]);
}

#[test]
fn a_builder_with_an_invalid_group_says_so() {
    let error = SoftBody::rope(1.0, 4).group(TOP, [5]).try_build();
    let error = error.expect_err("there is no vertex 5").to_string();
    says(&error, &["group “top”", "vertex 5", "0 to 4"]);
}

/// A strip of two squares, each with its own vertices, and a cube with a lid.
const STRIP: &str = "v 0 0 0\nv 0 0 1\nv 1 0 0\nv 1 0 1\nv 1 0 0\nv 1 0 1\nv 2 0 0\nv 2 0 1\n\
                     o left\nf 1 2 4 3\no right\nf 5 6 8 7\n";
const CUBE: &str = "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nv 0 1 0\nv 1 1 0\nv 1 1 1\nv 0 1 1\n\
                    o lid\nf 5 8 7 6\no rest\nf 1 2 3 4\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n";

/// The folder with both files.
fn files() -> PathBuf {
    let folder = std::env::temp_dir().join(format!("pliant-groups-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder for temporary files");
    fs::write(folder.join("strip.obj"), STRIP).expect("writable");
    fs::write(folder.join("cube.obj"), CUBE).expect("writable");
    folder
}

fn of_file(mesh: &str, groups: &str, fields: &str) -> Result<Body, String> {
    let text = format!(
        "Scene(title: \"Parts\", look_at: \"Parts.\", bodies: [(name: \"part\", mesh: ({mesh}), \
         groups: {groups}, {fields})], acceptance: (seconds: 1, checks: []))"
    );
    let mut scene: Scene = text.parse().expect("valid");
    scene.folder = files();
    let built = scene.build().map_err(|error| error.to_string())?;
    Ok(built.world.bodies[0].clone())
}

#[test]
fn the_vertices_of_a_part_of_the_file_are_a_group() {
    let groups = "{\"l\": [Part(\"left\")], \"r\": [Part(\"right\")]}";
    let strip = "file: \"strip.obj\", treatment: Shell";
    let body = of_file(strip, groups, "pins: [Group(\"l\")]").expect("it builds");
    // The copies of 2 and 3 are welded to them.
    assert_eq!(vertices(&body, "l"), [0, 1, 2, 3]);
    assert_eq!(vertices(&body, "r"), [2, 3, 4, 5]);
    assert_eq!(body.pins, [0, 1, 2, 3].map(VertexIndex));
    // Of a body that is a part itself, those are there that it has.
    let right = format!("{strip}, part: \"right\"");
    let body = of_file(&right, "{\"r\": [Part(\"right\")]}", "").expect("it builds");
    assert_eq!(vertices(&body, "r"), [0, 1, 2, 3]);
    let error = of_file(&right, groups, "").expect_err("it has no vertex of the other");
    says(&error, &["group “l”", "Part(\"left\") selects nothing"]);

    let error = of_file(strip, "{\"r\": [Part(\"rigth\")]}", "").expect_err("unknown");
    says(&error, &["“part”", "group “r”", "rigth", "left", "right"]);
    let error = of_file(strip, "{}", "pins: [Part(\"left\")]").expect_err("not a group");
    says(&error, &["“part”", "is an entry of `groups`"]);
    says(
        &error_of_primitive(),
        &["“kite”", "group “top”", "needs a body with `mesh`"],
    );
}

fn error_of_primitive() -> String {
    error("{\"top\": [Part(\"left\")]}", "", "")
}

/// In a filled surface, the group is what carries the part.
#[test]
fn a_part_of_a_filled_surface_is_what_carries_it() {
    let groups = "{\"lid\": [Part(\"lid\")]}";
    let body = of_file("file: \"cube.obj\", cells: 4", groups, "").expect("it builds");
    let lid = vertices(&body, "lid");
    let rest = |vertex: u32| body.topology.rest[body.topology.particle(VertexIndex(vertex))];
    // Four corners in a tetrahedron each, within a cell of a quarter below the lid at 0.5 m.
    assert!((4..=16).contains(&lid.len()), "{lid:?}");
    assert!(lid.iter().all(|vertex| rest(*vertex).y > 0.2), "{lid:?}");
}
