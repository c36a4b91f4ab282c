//! Corrupted scene files and problem files of the study: a scene or an error with its position,
//! memory in proportion to the contents of the file; and every scene that can be built can be
//! stepped.

use crate::{
    allocation,
    fuzz_support::{broken, edits, fuzz, in_proportion},
    support_app::app,
};
use pliant::{
    mesh::{Primitive, Strands, Treatment},
    scene::{BodySpec, Scene, SceneError, overrides::Override, registry::SCENES},
    simulation::{SETTINGS, SimulationSettings, plain, tick},
    solver::{Body, Settings, Substeps, World},
    study::{Problem, StudyError, registry::PROBLEMS},
};
use proptest::prelude::*;
use std::{
    fs,
    path::PathBuf,
    time::{Duration, Instant},
};

/// Small instances of everything that a scene can contain.
const EVERYTHING: &str = r##"Scene(
    title: "everything",
    look_at: "l",
    world: (gravity: (0, -9.81, 0), rate: 60, substeps: 3, iterations: 2),
    bodies: [
        (name: "box", primitive: Box(size: (0.4, 0.4, 0.4), cells: (2, 2, 2)), density: 1000,
         position: (0, 0.5, 0), rotation: (10, 20, 30), velocity: (1, 0, 0), spin: (0, 1, 0),
         effects: (stretch: (compliance: 1e-4, damping: 0.01), volume: (compliance: 0),
                   ground: (height: 0, friction: 0.5, restitution: 0.3), collide: (friction: 0.5),
                   uniform: (x: 1), force_mask: (group: "all", high_x: 0.5)),
         groups: {"top": [Top(0.3), Vertex(1)], "all": [Group("top"), Left(1)]},
         pins: [Top(0.1), Left(0), Within(low: (-9, -9, -9), high: (9, 9, 9)), Particle(3), Group("top")],
         added_mass: [(0, 0.5), (7, 1e-3)], color: "#e07040"),
        (name: "ball", primitive: Sphere(radius: 0.2, cells: 4), start: [Squash(0), Mirror],
         effects: (stretch: (), volume: (bulk_modulus: 1e5), sticky_ground: (height: 0.05))),
        (name: "ring", primitive: Torus(major: 0.3, minor: 0.1, cells: 2), start: [Shuffle(7)],
         effects: (volume: (), shape_matching: (frequency: 20, region: 0.4, damping: 0.01)),
         copies: (count: (2, 1, 2), spacing: (1, 1, 1))),
        (name: "drum", primitive: Cylinder(radius: 0.2, height: 0.3, cells: 2), start: [Scale(1.5)],
         effects: (stretch: (compliance: 1e-3))),
        (name: "cloth", primitive: Cloth(size: (1, 1), cells: (3, 4), diagonals: OneWay, shear: true),
         density: 0.3, effects: (stretch: (), collide: ())),
        (name: "rope", primitive: Rope(length: 1, segments: 5), density: 0.1,
         effects: (stretch: (axial_stiffness: 1000)), pins: [Particle(0)]),
        (name: "hoop", primitive: Hoop(radius: 0.3, segments: 9), effects: (rod: (radius: 0.01))),
        (name: "tree", primitive: Tree(trunk: 0.3, forks: 2, levels: 2, spread: 30, shrink: 0.7, segments: 2),
         effects: (rod: (radius: 0.01)), pins: [Vertex(0)]),
        (name: "balloon", primitive: Balloon(radius: 0.2, cells: 2), density: 0.3,
         effects: (stretch: (), struts: (compliance: 1e-3), pressure: (factor: 1.2, bulk_modulus: 1e5))),
        (name: "mesh", mesh: (file: "tetrahedron.obj", size: 0.5, cells: 3, treatment: Fill),
         effects: (stretch: (), volume: (), ground: ())),
        (name: "shell", mesh: (file: "tetrahedron.obj", treatment: Shell), effects: (stretch: ())),
        (name: "fur", hair: (scalp: Mesh(file: "tetrahedron.obj", size: 0.5),
         strands: (count: 5, length: 0.1, segments: 2, curl: 0.01, turns: 2, coverage: 120, offset: -0.01)),
         effects: (rod: (radius: 0.01)), pins: [Roots(2)]),
        (name: "hair", hair: (scalp: Surface(Box(size: (0.4, 0.4, 0.4), cells: (1, 1, 1))), strands: (count: 3, segments: 2)),
         effects: (rod: ())),
    ],
    colliders: [
        (shape: Sphere(radius: 0.2), position: (0, 0.1, 0), path: Oscillate(travel: (1, 0, 0), period: 4)),
        (shape: Box(size: (0.5, 0.1, 0.5)), rotation: (0, 45, 0), path: Line(velocity: (0, 1, 0))),
        (shape: Capsule(radius: 0.1, length: 0.5), path: Spin(axis: (0, 1, 0), rate: 0.25)),
        (shape: Sphere(radius: 0.1), path: Stops(stops: [(0, (0, 0, 0)), (1, (0, 1, 0))], repeat: true)),
    ],
    camera: (eye: (2, 2, 3), target: (0, 0, 0)),
    acceptance: (seconds: 3, checks: [NoInverted, Volume(0.05), SpeedBelow(1), Above(-1), Asleep,
        Middle(place: (0, 0, 0), within: 9), Height(0, 1), EdgeStrain(0.1), Splits(0, 9), Particles(1, 9999), Bodies(1, 99), AwayFrom((0, 0, 0), 0.1),
        EnergyBounded(0.01), ShapeLost(0.1), Of("box", [Shape(0.05), ReachesBelow(1)])]),
)"##;

const TETRAHEDRON: &str =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

/// A folder with the mesh file that [`EVERYTHING`] names.
fn folder() -> PathBuf {
    let folder = std::env::temp_dir().join(format!("pliant-fuzz-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder for temporary files");
    fs::write(folder.join("tetrahedron.obj"), TETRAHEDRON).expect("written");
    folder
}

/// Limit on the memory for reading a scene: a constant, and bytes per byte of the file. An item of
/// two bytes, `0,`, is a check, a pin or a stop of up to 64 bytes in memory, and growing a list
/// doubles it while the old one still exists.
const READING: (u64, u64) = (64 << 10, 128);

/// Time after which a world that can be stepped is not stepped again.
const SLOW: Duration = Duration::from_secs(1);

/// Number of elements of a body that is built here. Larger bodies, up to the limit, are covered by
/// other tests; beyond the limit they must be rejected immediately.
const SMALL: f64 = 6000.0;

/// Memory for building per element [byte]: shapes, tables, orders and state, some of them twice.
const ELEMENT: u64 = 2000;

/// Approximate number of elements that a file requests, including all copies: cells by the sizes of
/// primitives.
fn requested_elements(spec: &BodySpec) -> f64 {
    let number = f64::from;
    let one = match (&spec.primitive, &spec.mesh) {
        (Some(Primitive::Box { cells, .. }), _) => {
            5.0 * cells.to_array().map(number).iter().product::<f64>()
        }
        (Some(Primitive::Sphere { cells, .. }), _) => 6.0 * number(*cells).powi(3),
        (
            &Some(Primitive::Torus {
                major,
                minor,
                cells,
            }),
            _,
        ) => 20.0 * f64::from(major / minor) * number(cells).powi(3),
        (
            &Some(Primitive::Cylinder {
                radius,
                height,
                cells,
            }),
            _,
        ) => 12.0 * (1.0 + f64::from(height / radius)) * number(cells).powi(3),
        (Some(Primitive::Cloth { cells, .. }), _) => 5.0 * number(cells.x) * number(cells.y),
        (Some(Primitive::Balloon { cells, .. }), _) => 50.0 * number(*cells).powi(2),
        (Some(Primitive::Tube { cells, .. }), _) => 5.0 * number(cells.x) * number(cells.y),
        (
            Some(Primitive::Hair {
                strands, segments, ..
            }),
            _,
        ) => number(*strands) * (number(*segments) + 1.0),
        (
            Some(
                Primitive::Rope { segments, .. }
                | Primitive::Coil { segments, .. }
                | Primitive::Hoop { segments, .. },
            ),
            _,
        ) => number(*segments),
        (
            &Some(Primitive::Tree {
                forks,
                levels,
                segments,
                ..
            }),
            _,
        ) => {
            (0..=levels.min(99))
                .map(|level| number(forks).powi(level as i32))
                .sum::<f64>()
                * number(segments)
        }
        (&Some(Primitive::Grains { size, radius, .. }), _) => {
            f64::from(size.x) * f64::from(size.y) * f64::from(size.z)
                / (2.0 * f64::from(radius)).powi(3)
        }
        (Some(other), _) => panic!("no estimate for {other:?}: add one"),
        (None, Some(mesh)) if mesh.treatment == Treatment::Shell => 10.0,
        // A lattice of cubes, with one more on each side; 40 by default.
        (None, Some(mesh)) => 12.0 * (number(mesh.cells.unwrap_or(40)) + 2.0).powi(3),
        (None, None) => spec.hair.as_ref().map_or(0.0, |hair| {
            let Strands {
                count, segments, ..
            } = hair.strands;
            // With the candidates for roots.
            number(count) * (number(segments) + 6.0)
        }),
    };
    let copies = spec.copies.map_or(1.0, |copies| {
        copies.count.to_array().map(number).iter().product()
    });
    one.abs() * copies
}

/// Number of elements of a scene, if it can be built or rejected quickly.
fn moment(scene: &Scene) -> Option<u64> {
    let built_in = |spec: &BodySpec| {
        let mesh = spec.mesh.as_ref();
        mesh.is_some_and(|mesh| !mesh.file.contains('.'))
    };
    let requested: Vec<f64> = scene.bodies.iter().map(requested_elements).collect();
    let sum: f64 = requested.iter().sum();
    let moment = sum <= SMALL || requested.first().is_some_and(|first| *first > 1e8);
    (moment && !scene.bodies.iter().any(built_in)).then_some(sum.min(SMALL) as u64)
}

/// Reads a scene and fails unless an error has a position.
fn read(text: &str) -> Option<Scene> {
    match in_proportion(text.len(), READING, || Scene::parse("a.ron", text)) {
        Ok(scene) => Some(scene),
        Err(error) => {
            says_where(&error, text);
            None
        }
    }
}

fn says_where(error: &SceneError, text: &str) {
    let message = error.to_string();
    assert!(message.len() < 2000 + 4 * text.len(), "{message}");
    let named = match error {
        SceneError::Syntax { line, column, .. } => {
            let lines: Vec<&str> = text.split('\n').collect();
            let columns = lines
                .get(line - 1)
                .map_or(0, |line| line.chars().count() + 2);
            message.starts_with("a.ron:") && *line >= 1 && (1..=columns).contains(column)
        }
        SceneError::Mesh { body, .. }
        | SceneError::Topology { body, .. }
        | SceneError::Body { body, .. } => text.contains("name") && message.contains(body.as_str()),
        SceneError::Collider { index, .. } => message.contains(&format!("collider {index}")),
        SceneError::Acceptance(_) | SceneError::View(_) => true,
        SceneError::Answer { body, .. } => message.contains(body.as_str()),
        _ => false,
    };
    assert!(named, "{error:?} does not say where");
}

/// Steps a world a few times, if that is fast, and fails unless every body is finite, or in
/// quarantine and reported.
fn steps(world: &mut World) {
    let constraints: usize = world
        .bodies
        .iter()
        .map(|body| body.particles.len() + body.effects.constraints(&body.topology))
        .sum();
    let Settings {
        substeps,
        iterations,
        ..
    } = world.settings;
    let passes = f64::from(substeps.get()) * f64::from(iterations.get());
    if passes * constraints as f64 > 1e6 {
        return;
    }
    let touch = |body: &Body| body.effects.contact.is_some() || body.effects.self_contact.is_some();
    if world.bodies.iter().any(touch) {
        // What is flung at kilometers a second meets itself everywhere, which takes seconds per substep, but is no
        // fault.
        world.settings.substeps = Substeps::new(1).expect("a substep");
    }
    let begun = Instant::now();
    for _ in 0..3 {
        world.tick();
        if begun.elapsed() > SLOW {
            break;
        }
    }
    for body in &world.bodies {
        let columns = body.particles.columns().into_iter();
        let mut state = columns.flat_map(|(_, column)| column);
        let finite = state.all(|v| v.is_finite());
        assert!(finite, "{} is not finite: {:?}", body.name, body.quarantine);
        if let Some(quarantine) = &body.quarantine {
            assert!(quarantine.vertex.index() < body.particles.len());
            assert!(!quarantine.stage.is_empty());
        }
    }
}

/// Builds a scene and steps it.
fn survives(scene: &Scene, text: &str) {
    let Some(elements) = moment(scene) else {
        return;
    };
    let (built, most) = allocation::peak(|| scene.build());
    let allowed = (1 << 20) + ELEMENT * elements + READING.1 * text.len() as u64;
    assert!(most <= allowed, "{most} bytes held, {allowed} allowed");
    match built {
        Err(error) => says_where(&error, text),
        Ok(built) => {
            let mut world = built.world;
            let start = world.clone();
            steps(&mut world);
            // Whether it is accepted is irrelevant here.
            let _ = scene.acceptance.judge(&start, &world, &[]);
        }
    }
}

fn texts() -> Vec<&'static str> {
    let built_in = SCENES.iter().map(|scene| scene.text);
    built_in.chain([EVERYTHING; 20]).collect()
}

#[test]
fn the_scene_is_valid_before_it_is_corrupted() {
    let mut scene: Scene = EVERYTHING.parse().expect("whole");
    scene.folder = folder();
    let elements = moment(&scene).expect("small");
    assert!(elements > 1000, "{elements} elements");
    let mut world = scene.build().expect("whole").world;
    let before = world.state_hash();
    steps(&mut world);
    assert_ne!(world.state_hash(), before, "it has been stepped");
    assert!(world.bodies.iter().all(|body| body.quarantine.is_none()));
}

#[test]
fn every_scene_survives_being_cut_anywhere() {
    for end in 0..EVERYTHING.len() {
        if EVERYTHING.is_char_boundary(end) {
            assert!(read(&EVERYTHING[..end]).is_none(), "cut after {end} bytes");
        }
    }
}

#[test]
fn a_broken_scene_file_is_a_scene_or_an_error_that_says_where() {
    let (folder, texts) = (folder(), texts());
    let values = (0..texts.len(), edits());
    fuzz("scene files", 8000, &values, |(which, edits)| {
        let file = broken(texts[which].as_bytes(), &edits);
        // The system's own reading rejects invalid UTF-8.
        let text = String::from_utf8_lossy(&file);
        if let Some(mut scene) = read(&text) {
            scene.folder.clone_from(&folder);
            survives(&scene, &text);
        }
    });
}

#[test]
fn a_broken_problem_file_is_a_problem_or_an_error_that_says_where() {
    let values = (0..PROBLEMS.len(), edits());
    fuzz("problem files", 6000, &values, |(which, edits)| {
        let file = broken(PROBLEMS[which].text.as_bytes(), &edits);
        let text = String::from_utf8_lossy(&file);
        let base = (READING.0, 2 * READING.1);
        let says = |error: StudyError| match error {
            StudyError::Scene(error) => says_where(&error, &text),
            StudyError::Problem { problem, message } => {
                assert_eq!(problem, "a");
                assert!(!message.is_empty() && message.len() < 2000 + 4 * text.len());
            }
            other => panic!("{other:?} does not say where"),
        };
        let parse = || Problem::parse("a", "a.ron", &text);
        let problem = match in_proportion(text.len(), base, parse) {
            Ok(problem) => problem,
            Err(error) => return says(error),
        };
        let levels = problem.levels.iter().map(|level| Scene {
            bodies: level.bodies.clone(),
            ..problem.scene.clone()
        });
        if levels
            .chain([problem.scene.clone()])
            .all(|scene| moment(&scene).is_some())
            && let Err(error) = problem.cases()
        {
            says(error);
        }
    });
}

/// Any input of `--set`, on a scene with everything: it is set or rejected, and the result can be
/// stepped.
#[test]
fn any_override_is_set_or_refused_and_what_is_set_can_be_stepped() {
    let mut scene: Scene = EVERYTHING.parse().expect("whole");
    scene.folder = folder();
    let built = scene.build().expect("whole");
    let names = [
        "stretch.compliance",
        "stretch.axial_stiffness",
        "stretch.damping",
        "volume.compliance",
        "volume.bulk_modulus",
        "volume.damping",
        "struts.compliance",
        "struts.damping",
        "shape_matching.frequency",
        "shape_matching.region",
        "shape_matching.damping",
        "pressure.factor",
        "pressure.bulk_modulus",
        "ground.height",
        "ground.friction",
        "ground.restitution",
        "sticky_ground.height",
        "collide.friction",
        "collide.restitution",
        "grab.stiffness",
        "stretch",
        "stretch.",
        ".",
        "",
        "=",
        "x.y.z",
        "ünits",
    ];
    let names: Vec<&str> = SETTINGS
        .iter()
        .map(|(name, ..)| *name)
        .chain(names)
        .collect();
    let value = prop_oneof![
        any::<f64>().prop_map(|value| value.to_string()),
        (-45..39_i32, any::<bool>()).prop_map(|(power, negative)| {
            format!("{}1e{power}", if negative { "-" } else { "" })
        }),
        (0..40_u32).prop_map(|value| value.to_string()),
        prop::sample::select(vec![
            "", " ", "NaN", "-inf", "0x10", "1,5", "20 %", "1e", "=1", "٣"
        ])
        .prop_map(str::to_owned),
    ];
    let one = (
        prop::sample::select(names),
        value,
        prop::sample::select(vec!["=", "", " = ", "=="]),
    );
    let values = prop::collection::vec(one, 1..5);
    fuzz("overrides", 300, &values, |words| {
        let mut app = app();
        plain::spawn(app.world_mut(), &built.world);
        let world = app.world_mut();
        for (name, value, sign) in words {
            let word = format!("{name}{sign}{value}");
            let set = word.parse::<Override>().and_then(|set| set.apply(world));
            if let Err(error) = set {
                let message = error.to_string();
                assert!(message.len() < 1000, "{message}");
                // A parameter of a single axis is named after the whole vector.
                let (left, right) = word.split_once('=').unwrap_or((&word, ""));
                let mut parts = left.split(['.', '_']).chain([left, right]);
                let named = parts.any(|part| message.contains(part.trim()));
                assert!(named, "“{word}” is not named: {message}");
            }
        }
        let settings = **world.resource::<SimulationSettings>();
        if settings.substeps.get() * settings.iterations.get() <= 100 {
            (0..3).for_each(|_| tick(world));
        }
        let state = plain::capture(world);
        for body in &state.bodies {
            let finite = body.particles.positions.iter().all(|x| x.is_finite());
            assert!(finite, "{} is not finite: {:?}", body.name, body.quarantine);
        }
    });
}

/// Found by seed 7 of the scene files: numbers that are finite individually, but not combined.
#[test]
fn a_body_with_non_finite_initial_positions_is_refused() {
    let particle: &[&str] = &["particle ", "finite", "smaller"];
    for (with, parts) in [
        ("start: [Scale(3e38)]", particle),
        ("start: [Squash(3e38)]", particle),
        ("spin: (0, 0, 3e38)", particle),
        (
            "copies: (count: (9, 1, 1), spacing: (3e38, 0, 0))",
            &["position is [-inf, ", "within 100000 m"],
        ),
    ] {
        let text = format!(
            "Scene(title: \"t\", look_at: \"l\", bodies: [(name: \"b\", primitive: \
             Box(size: (100, 100, 100), cells: (1, 1, 1)), effects: (), {with})], \
             acceptance: (seconds: 1))"
        );
        let scene: Scene = text.parse().expect("it can be read");
        let message = match scene.build() {
            Ok(_) => panic!("{with} was built"),
            Err(error) => error.to_string(),
        };
        for part in parts.iter().chain(&["body “b”"]) {
            assert!(message.contains(part), "“{part}” is not in “{message}”");
        }
    }
}

/// A few words may request more than the available memory; they are rejected before it is
/// allocated.
#[test]
fn scenes_that_are_too_large_are_refused_before_memory_is_allocated() {
    let most = u32::MAX;
    for (bodies, says) in [
        (format!("(name: \"b\", primitive: Box(size: (1, 1, 1), cells: ({most}, {most}, {most})), effects: ())"), "tetrahedra"),
        (format!("(name: \"b\", primitive: Sphere(radius: 1, cells: {most}), effects: ())"), "tetrahedra"),
        (format!("(name: \"b\", primitive: Torus(major: 1e7, minor: 1e-7, cells: {most}), effects: ())"), "tetrahedra"),
        (format!("(name: \"b\", primitive: Cylinder(radius: 1e-7, height: 1e7, cells: {most}), effects: ())"), "tetrahedra"),
        (format!("(name: \"b\", primitive: Cloth(size: (1, 1), cells: ({most}, {most})), effects: ())"), "particles"),
        (format!("(name: \"b\", primitive: Rope(length: 1, segments: {most}), effects: ())"), "particles"),
        (format!("(name: \"b\", primitive: Rope(length: 1), copies: (count: ({most}, {most}, {most}), spacing: (0, 0, 0)), effects: ())"), "copies"),
        ("(name: \"b\", primitive: Rope(length: 1, segments: 2000), copies: (count: (100, 1, 100), spacing: (1, 1, 1)), effects: ())".into(), "particles"),
        (vec!["(name: \"b\", primitive: Rope(length: 1, segments: 2), copies: (count: (100, 1, 100), spacing: (1, 1, 1)), effects: ())"; 300].join(","), "bodies"),
    ] {
        let text = format!("Scene(title: \"t\", look_at: \"l\", bodies: [{bodies}], acceptance: (seconds: 1))");
        let scene: Scene = text.parse().expect("it can be read");
        let build = || match scene.build() {
            Ok(_) => panic!("{bodies} was built"),
            Err(error) => error.to_string(),
        };
        // The largest scene that is built before it is rejected has 100 000 ropes of two edges, of
        // less than 4.57 kB each, in a list that doubles while it grows.
        let message = in_proportion(text.len(), (457_000_000, READING.1), build);
        assert!(message.contains("body “b”") && message.contains(says), "{message}");
    }
}
