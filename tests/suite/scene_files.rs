//! Contracts of the scene file: the registry matches the folder, a scene survives writing and
//! reading, and an error in a file is reported with its position and the expected input.

use pliant::scene::{Scene, registry, run::run};
use std::{collections::BTreeSet, fs, path::Path};

/// A scene with a line for every kind of error.
const SOUND: &str = r##"Scene(
    title: "t",
    look_at: "l",
    world: (substeps: 10),
    bodies: [(
        name: "b",
        primitive: Box(size: (0.4, 0.4, 0.4), cells: (2, 2, 2)),
        density: 1000,
        effects: (stretch: (compliance: 1e-4), volume: (), ground: ()),
        color: "#e07040",
    )],
    colliders: [(shape: Sphere(radius: 0.2))],
    acceptance: (seconds: 1.0, checks: [NoInverted]),
)"##;

/// The error message after `from` in the valid scene is replaced by `to`, when reading or building.
fn complaint(from: &str, to: &str) -> String {
    assert!(SOUND.contains(from), "{from} is not in the scene");
    let text = SOUND.replace(from, to);
    match Scene::parse("my.ron", &text).and_then(|scene| scene.build().map(|_| ())) {
        Ok(()) => panic!("{to} was accepted"),
        Err(error) => error.to_string(),
    }
}

/// Fails unless the message contains each of the parts.
#[track_caller]
fn says(complaint: &str, parts: &[&str]) {
    for part in parts {
        assert!(complaint.contains(part), "“{part}” is not in “{complaint}”");
    }
}

#[test]
fn the_sound_scene_of_these_tests_is_sound() {
    let scene: Scene = SOUND.parse().expect("it is sound");
    scene.build().expect("it can be built");
}

#[test]
fn names_of_earlier_versions_are_read() {
    let pinned = SOUND.replace("density: 1000,", "density: 1000, pins: [Vertex(0)],");
    let old = pinned
        .replace("Vertex(", "Particle(")
        .replace("color:", "colour:");
    let [now, old] = [&pinned, &old].map(|text| text.parse::<Scene>().expect("it is sound"));
    assert_eq!(now, old);
}

#[test]
fn the_registry_is_the_folder_of_scenes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes");
    let files: BTreeSet<String> = fs::read_dir(folder)
        .expect("the folder is there")
        .map(|entry| entry.expect("it can be listed").file_name())
        .map(|name| name.into_string().expect("names are ASCII"))
        .collect();
    let registered: Vec<String> = registry::SCENES
        .iter()
        .map(|scene| format!("{}.ron", scene.name))
        .collect();
    let unique: BTreeSet<String> = registered.iter().cloned().collect();
    assert_eq!(unique.len(), registered.len(), "a name is registered twice");
    assert_eq!(unique, files);
}

#[test]
fn every_scene_has_a_title_of_its_own_a_line_to_look_at_and_checks() {
    let mut titles = BTreeSet::new();
    for builtin in registry::SCENES {
        let scene = Scene::load(builtin.name).expect("a sound scene").scene;
        assert!(
            titles.insert(scene.title.clone()),
            "two scenes are called {}",
            scene.title
        );
        assert!(
            scene.look_at.ends_with('.'),
            "{}: look_at is a sentence",
            builtin.name
        );
        assert!(
            !scene.acceptance.checks.is_empty(),
            "{}: it has no checks",
            builtin.name
        );
    }
}

#[test]
fn every_scene_written_and_read_again_is_the_same_scene() {
    for builtin in registry::SCENES {
        let scene = Scene::load(builtin.name).expect("a sound scene").scene;
        let text = scene.to_text().expect("a sound scene can be written");
        let again =
            Scene::parse(builtin.name, &text).unwrap_or_else(|error| panic!("{error}, in\n{text}"));
        assert_eq!(scene, again, "{}", builtin.name);
    }
}

#[test]
fn a_word_that_is_not_known_is_named_with_its_place_and_the_valid_ones() {
    says(
        &complaint("name: \"b\"", "nmae: \"b\""),
        &[
            "my.ron:6:",
            "`nmae`",
            "`name`, `primitive`, `mesh`",
            "(did you mean “name”?)",
        ],
    );
    says(
        &complaint("compliance:", "complience:"),
        &["my.ron:9:", "(did you mean “compliance”?)"],
    );
    says(
        &complaint("stretch: (compliance:", "Stretch: (Compliance:"),
        &["my.ron:9:", "`Stretch`", "(did you mean “stretch”?)"],
    );
    says(
        &complaint("Sphere(", "Spere("),
        &["my.ron:12:", "(did you mean “Sphere”?)"],
    );
    says(
        &complaint("stretch:", "strech:"),
        &[
            "my.ron:9:",
            "`strech`",
            "`stretch`, `bend`, `isometric_bend`",
        ],
    );
    says(
        &complaint("NoInverted", "Upright"),
        &["my.ron:13:", "`Upright`", "`NoInverted`"],
    );
    says(
        &complaint("checks:", "cheks:"),
        &["my.ron:13:", "`cheks`", "`checks`"],
    );
}

#[test]
fn a_value_of_another_type_is_refused_with_its_place_and_the_type_that_was_expected() {
    says(
        &complaint("density: 1000", "density: \"heavy\""),
        &["my.ron:8:", "Expected float"],
    );
    says(
        &complaint("(2, 2, 2)", "(2, 2)"),
        &["my.ron:7:", "a sequence of 3"],
    );
    says(
        &complaint("bodies: [(", "bodies: ["),
        &["my.ron:6:", "Expected struct `BodySpec`"],
    );
    says(
        &complaint("title: \"t\",", ""),
        &["my.ron:14:", "missing field named `title`"],
    );
}

#[test]
fn a_value_out_of_range_is_refused_with_its_place_and_the_range() {
    let compliance = "compliance is {}, but must be between 0 and 1e12";
    for value in ["-1", "NaN", "inf"] {
        let expected = compliance.replace("{}", value);
        says(
            &complaint("compliance: 1e-4", &format!("compliance: {value}")),
            &["my.ron:9:", &expected],
        );
    }
    for value in ["0", "2.5", "-3"] {
        let expected = format!("substeps is {value}, but must be a whole number between 1 and");
        says(
            &complaint("substeps: 10", &format!("substeps: {value}")),
            &["my.ron:4:", &expected],
        );
    }
    for value in ["0", "-1000", "NaN", "inf"] {
        let expected = format!("density is {value}, but must be between 1e-9 and 1e9 (kg/m³");
        says(
            &complaint("density: 1000", &format!("density: {value}")),
            &["my.ron:8:", &expected],
        );
    }
    says(
        &complaint("substeps: 10", "gravity: (0.0, inf, 0.0)"),
        &["my.ron:4:", "gravity is inf, but must be a finite number"],
    );
}

#[test]
fn an_error_in_a_body_names_the_body_and_the_valid_input() {
    let primitive = "primitive: Box(size: (0.4, 0.4, 0.4), cells: (2, 2, 2)),";
    says(
        &complaint(primitive, ""),
        &[
            "“b”",
            "a primitive, a mesh or hair",
            "`mesh: (file: \"bunny\")`",
        ],
    );
    says(
        &complaint(primitive, "mesh: (file: \"cow\"),"),
        &["“b”", "'cow'", "expected one of", "bunny", "teapot"],
    );
    says(
        &complaint(primitive, "mesh: (file: \"no_such.obj\"),"),
        &["“b”", "no_such.obj"],
    );
    says(
        &complaint("cells: (2, 2, 2)", "cells: (0, 2, 2)"),
        &["“b”", "cells = 0", "a whole number from 1"],
    );
    says(
        &complaint("#e07040", "red"),
        &["“b”", "color is “red”", "#e07040"],
    );
    says(
        &complaint("density: 1000", "position: (0.0, NaN, 0.0)"),
        &["“b”", "position is [0, NaN, 0]", "three finite numbers"],
    );
    says(
        &complaint("density: 1000", "position: (0.0, -3.4e38, 0.0)"),
        &[
            "“b”",
            "within 100000 m of the origin",
            "move the whole scene",
        ],
    );
    says(
        &complaint(
            "density: 1000",
            "copies: (count: (1, 2, 1), spacing: (0.0, 2e9, 0.0))",
        ),
        &["“b”", "position is [0, 2000000000, 0]", "within 100000 m"],
    );
    says(
        &complaint("density: 1000", "added_mass: [(27, 1.0)]"),
        &["“b”", "vertex 27", "0 to 26"],
    );
}

#[test]
fn pins_that_pin_nothing_are_refused_with_where_the_body_is() {
    says(
        &complaint(
            "density: 1000",
            "pins: [Within(low: (5.0, 5.0, 5.0), high: (6.0, 6.0, 6.0))]",
        ),
        &[
            "“b”",
            "pins nothing",
            "[-0.2, -0.2, -0.2] to [0.2, 0.2, 0.2] m",
        ],
    );
    says(
        &complaint("density: 1000", "pins: [Vertex(27)]"),
        &["“b”", "Vertex(27) pins nothing", "vertices 0 to 26"],
    );
    // Syntax of older files.
    says(
        &complaint("density: 1000", "pins: [Particle(27)]"),
        &["“b”", "Vertex(27) pins nothing", "vertices 0 to 26"],
    );
}

#[test]
fn invalid_colliders_and_acceptances_are_refused() {
    says(
        &complaint("radius: 0.2", "radius: -1"),
        &["collider 1", "-1", "between 1e-9 and 1e9 m"],
    );
    says(
        &complaint("Sphere(radius: 0.2)", "Mesh(file: \"cup\")"),
        &["collider 1", "cup", "bowl", "stairs"],
    );
    says(
        &complaint("Sphere(radius: 0.2)", "Mesh(file: \"bowl\", size: -1)"),
        &["collider 1", "-1"],
    );
    says(
        &complaint("Sphere(radius: 0.2)", "Surface(Rope(length: 1))"),
        &["collider 1", "no triangles", "use a body of triangles"],
    );
    says(
        &complaint("radius: 0.2)", "radius: 0.2), opacity: 1.5"),
        &["collider 1", "opacity is 1.5", "between 0 and 1"],
    );
    says(
        &complaint("radius: 0.2)", "radius: 0.2), color: \"glass\""),
        &["collider 1", "glass", "#e07040"],
    );
    let view = |text: &str| complaint("acceptance: (", &format!("{text}, acceptance: ("));
    says(
        &view("frame: (low: (1, 0, 0), high: (0, 1, 1))"),
        &[
            "frame reaches from [1, 0, 0] to [0, 1, 1]",
            "low not above high",
        ],
    );
    says(
        &view("camera: (eye: (1, 0, 0), target: (1, 0, 0))"),
        &["camera looks from [1, 0, 0]", "two different points"],
    );
    says(
        &complaint("seconds: 1.0", "seconds: 0.0"),
        &["acceptance", "seconds is 0", "above 0"],
    );
    says(
        &complaint("NoInverted", "Of(\"x\", [NoInverted])"),
        &["acceptance", "“x”", "the bodies are: b"],
    );
}

/// Of each kind of check, with a number that no run can meet, or that every run meets.
#[test]
fn a_check_with_an_impossible_number_is_refused_with_what_is_allowed() {
    let refused = |check: &str, expected: &str| {
        let [alone, within] = [check.to_owned(), format!("Of(\"b\", [{check}])")];
        for check in [alone, within] {
            let said = complaint("NoInverted", &check);
            says(&said, &["acceptance: ", "expected ", expected]);
        }
    };
    for value in ["-1", "-1e-9", "NaN", "inf", "-inf"] {
        for check in ["Volume", "VolumeLost", "Shape", "ShapeLost", "EdgeStrain"] {
            refused(&format!("{check}({value})"), "a finite number from 0");
        }
        for check in ["SpeedBelow", "Extent"] {
            refused(&format!("{check}({value})"), "a finite number above 0");
        }
        for check in [
            format!("Middle(place: (0, 0, 0), within: {value})"),
            format!("AwayFrom((0, 0, 0), {value})"),
        ] {
            refused(&check, "a finite distance from 0 [m]");
        }
        for check in [format!("Height({value}, 1)"), format!("Height(0, {value})")] {
            refused(&check, "two finite heights from 0 [m], the lower one first");
        }
        let energy = complaint("NoInverted", &format!("EnergyBounded({value})"));
        says(&energy, &["EnergyBounded(", "a finite number from 0"]);
    }
    for value in ["NaN", "inf"] {
        refused(&format!("Above({value})"), "a finite height [m]");
        refused(&format!("ReachesBelow({value})"), "a finite height [m]");
        refused(
            &format!("Middle(place: (0, {value}, 0), within: 1)"),
            "a finite place [m]",
        );
        refused(
            &format!("AwayFrom(({value}, 0, 0), 1)"),
            "a finite point [m]",
        );
    }
    for check in ["SpeedBelow(0)", "Extent(0)"] {
        refused(check, "a finite number above 0");
    }
    refused("Height(2, 1)", "the lower one first");
    for check in ["Splits", "Particles", "Bodies"] {
        refused(&format!("{check}(2, 1)"), "the smaller one first");
    }
    for check in ["EnergyBounded(0.1)", "Of(\"b\", [NoInverted])"] {
        let said = complaint("NoInverted", &format!("Of(\"b\", [{check}])"));
        says(&said, &["is within Of(\"b\", …)", "must stand beside it"]);
    }
    // The limits of what is possible.
    let limits = "Volume(0), VolumeLost(0), Shape(0), ShapeLost(0), SpeedBelow(1e-30), Above(-1e6), \
        ReachesBelow(1e6), Middle(place: (0, 0, 0), within: 0), Height(1, 1), Extent(1e-30), EdgeStrain(0), \
        Splits(0, 0), Particles(0, 0), Bodies(1, 1), AwayFrom((0, 0, 0), 0), EnergyBounded(0)";
    let scene: Scene = SOUND.replace("NoInverted", limits).parse().expect("sound");
    assert_eq!(scene.acceptance.count(), 16);
    scene.build().expect("sound");
}

#[test]
fn a_name_that_is_no_scene_is_answered_with_the_names_that_are() {
    let error = Scene::load("jely_cube").expect_err("there is no such scene");
    says(&error.to_string(), &["jely_cube", "jelly_cube", "bunny"]);
    let error = Scene::load("no/such/file.ron").expect_err("there is no such file");
    says(&error.to_string(), &["no/such/file.ron: no such file"]);
}

#[test]
fn a_missing_file_is_answered_with_a_similar_one_beside_it() {
    let folder = std::env::temp_dir().join(format!("pliant-beside-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder for temporary files");
    for name in ["star.obj", "other.ron", "stir.txt"] {
        fs::write(folder.join(name), "").expect("it can be written");
    }
    let path = |name: &str| folder.join(name).display().to_string();
    for (wanted, similar) in [
        ("sta.obj", "star.obj"),
        ("Star.OBJ", "star.obj"),
        ("othr.ron", "other.ron"),
    ] {
        let error = Scene::load(&path(wanted)).expect_err("it does not exist");
        let suggestion = format!("(did you mean “{}”?)", path(similar));
        says(&error.to_string(), &["no such file", &suggestion]);
    }
    fs::remove_dir_all(&folder).expect("it was made here");
}

/// Notes name the body or collider, what is unusual, and what to do; a usual scene has none.
#[test]
fn a_thick_contact_and_a_collider_that_is_open_fast_or_small_are_noted() {
    let notes = |text: &str| {
        let scene = Scene::parse("my.ron", text).expect("sound");
        scene.build().expect("sound").notes
    };
    assert!(notes(SOUND).is_empty(), "{:?}", notes(SOUND));
    let thick = SOUND.replace("ground: ()", "ground: (), contact: (thickness: 0.5)");
    let thick = notes(&thick).join("\n");
    says(
        &thick,
        &[
            "b: contact.thickness is 0.5 m",
            "mean edge length",
            "lower the thickness",
        ],
    );
    let tube = SOUND.replace(
        "Sphere(radius: 0.2)",
        "Surface(Tube(radius: 0.2, height: 1.0, cells: (8, 2)))",
    );
    let open = notes(&tube).join("\n");
    // Both ends have eight edges.
    says(
        &open,
        &["collider 1", "16 edges of one triangle", "close it"],
    );
    let turning = |rate: &str| {
        let path = format!("Sphere(radius: 0.2), path: Spin(axis: (0, 1, 0), rate: {rate})");
        notes(&SOUND.replace("Sphere(radius: 0.2)", &path)).join("\n")
    };
    // 600 substeps per second.
    assert_eq!(turning("290"), "");
    let fast = turning("-360");
    says(
        &fast,
        &[
            "collider 1: turns 0.60 times in each substep of 1.67 ms",
            "above 12",
        ],
    );
    let small = SOUND
        .replace("Sphere(radius: 0.2)", "Sphere(radius: 0.05)")
        .replace("ground: ()", "ground: (), collide: ()");
    says(
        &notes(&small).join("\n"),
        &["collider 1: 0.1 m across", "of “b”", "use `Surface(…)`"],
    );
    let closed = SOUND.replace("Sphere(radius: 0.2)", "Mesh(file: \"bowl\")");
    assert!(notes(&closed).iter().all(|note| !note.contains("open")));
}

#[test]
fn a_scene_says_when_its_bodies_sleep() {
    let with = |sleep: &str| SOUND.replace("bodies:", &format!("sleep: {sleep}, bodies:"));
    for (sleep, sleepers) in [("()", 1), ("(enabled: false)", 0), ("(after: 60.0)", 0)] {
        let scene: Scene = with(sleep).parse().expect("sound");
        let again: Scene = scene.to_text().expect("written").parse().expect("sound");
        assert_eq!(again, scene);
        let mut world = scene.build().expect("sound").world;
        for _ in 0..600 {
            world.tick();
        }
        let asleep = world.bodies.iter().filter(|body| body.asleep).count();
        assert_eq!(asleep, sleepers, "{sleep}");
    }
    says(
        &complaint("bodies:", "sleep: (speed: -1.0), bodies:"),
        &["my.ron:5:", "speed or time of sleep", "at least 0"],
    );
}

/// Copies are numbered, lie on the grid around the given position, and share one topology.
#[test]
fn copies_share_their_mesh_and_stand_on_a_grid() {
    let text = SOUND.replace(
        "density: 1000",
        "copies: (count: (2, 1, 2), spacing: (1.0, 0.0, 3.0))",
    );
    let built = text
        .parse::<Scene>()
        .and_then(|scene| scene.build())
        .expect("it is sound");
    let bodies = &built.world.bodies;
    let names: Vec<_> = bodies.iter().map(|body| body.name.as_str()).collect();
    assert_eq!(names, ["b 1", "b 2", "b 3", "b 4"]);
    for body in bodies {
        assert!(std::sync::Arc::ptr_eq(&body.topology, &bodies[0].topology));
    }
    let corner = |i: usize| bodies[i].particles.positions[0].truncate();
    assert_eq!(corner(1) - corner(0), glam::Vec3::new(1.0, 0.0, 0.0));
    assert_eq!(corner(2) - corner(0), glam::Vec3::new(0.0, 0.0, 3.0));
}

/// A unit cube and a unit square, as OBJ files.
const CUBE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
    f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
const SQUARE: &str = "v 0 0 0\nv 100 0 0\nv 100 0 100\nv 0 0 100\nf 1 2 3 4\n";

#[test]
fn a_mesh_file_is_a_scene_with_one_soft_body_above_the_ground() {
    let folder = std::env::temp_dir().join(format!("pliant-mesh-scene-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder for temporary files");
    for (name, text, is_solid) in [("cube.obj", CUBE, true), ("square.OBJ", SQUARE, false)] {
        let path = folder.join(name);
        fs::write(&path, text).expect("it can be written");
        let current = Scene::load(path.to_str().expect("UTF-8")).expect("it is a mesh");
        assert!(
            current.scene.look_at.contains(name),
            "{}",
            current.scene.look_at
        );
        let built = current.scene.build().expect("it can be built");
        let notes = built.notes.join("\n");
        for said in [
            "square: scaled from 100 m to 0.6 m",
            "not from 0.05 to 5 m",
            "no `size` keeps it",
            "imported as cloth",
        ] {
            assert_eq!(
                notes.matches(said).count(),
                usize::from(!is_solid),
                "{notes}"
            );
        }
        let [body] = &built.world.bodies[..] else {
            panic!("one body");
        };
        assert_eq!(!body.topology.tetrahedra.rest_volume.is_empty(), is_solid);
        let lowest = body.particles.positions.iter().map(|x| x.y);
        assert!(
            lowest.fold(f32::INFINITY, f32::min) > 0.0,
            "above the ground"
        );
        let done = run(&built, &current.scene.run_options(), |_| ()).expect("it runs");
        assert!(done.accepted(), "{:?}", done.reasons);
        // The scene can be saved as a file of its own.
        let again: Scene = current
            .scene
            .to_text()
            .expect("RON")
            .parse()
            .expect("a scene");
        assert_eq!(again.bodies, current.scene.bodies);
    }
    let missing = folder.join("no.obj");
    let error = Scene::load(missing.to_str().expect("UTF-8")).expect_err("it does not exist");
    assert!(error.to_string().contains("no.obj"), "{error}");
    fs::remove_dir_all(&folder).expect("it was made here");
}

/// A strip of cloth whose left half is cut through, and one whose edge is stitched to a collider.
#[test]
fn a_body_begins_with_its_cuts_and_stitches_of_a_region() {
    let text = |body: &str| {
        format!(
            "Scene(title: \"\", look_at: \"\", bodies: [(name: \"sheet\", \
             primitive: Cloth(size: (0.4, 0.2), cells: (8, 4)), {body})], \
             colliders: [(shape: Sphere(radius: 0.01))], acceptance: (seconds: 1))"
        )
    };
    let built = |body: &str| -> Result<_, String> {
        let scene: Scene = text(body).parse().map_err(|error| format!("{error}"))?;
        scene.build().map_err(|error| error.to_string())
    };
    let whole = built("effects: ()").expect("sound").world;
    let cut = "effects: (), cuts: [(eye: (0, 1, 0.00001), rays: ((-0.5, -1, 0), (0.01, -1, 0)))]";
    let split = built(cut).expect("sound").world;
    let particles = |world: &pliant::solver::World| world.bodies[0].particles.len();
    // Five of the nine vertices of the middle row lie to the left of x = 0.01 m.
    assert_eq!(particles(&split), particles(&whole) + 5);
    let far = "effects: (), cuts: [(eye: (9, 1, 0), rays: ((0, -1, 0), (0.01, -1, 0)))]";
    let error = built(far).expect_err("it misses");
    assert!(
        error.contains("body “sheet”: cut 1: it does not divide the body"),
        "{error}"
    );
    let edge = "effects: (), stitches: [(point: Within(low: (-1, -1, 0.099), high: (1, 1, 1)), to: Collider(1))]";
    let stitched = built(edge).expect("sound").world;
    assert_eq!(stitched.bodies[0].stitches.all().len(), 9);
    // A stitch of 2 m/N that stores 1 J pulls with 1 N.
    let tough = edge.replace(
        "Collider(1))",
        "Collider(1), compliance: 2, strength: 5, toughness: 1)",
    );
    let tough = built(&tough).expect("sound").world;
    assert_eq!(tough.bodies[0].stitches.all()[0].strength.get(), 1.0);
    let rigid = edge.replace("Collider(1))", "Collider(1), toughness: 1)");
    let error = built(&rigid).expect_err("it stores no energy");
    assert!(
        error.contains("stitch 1: a rigid stitch stores no energy"),
        "{error}"
    );
    let nothing = "effects: (), stitches: [(point: Within(low: (5, 5, 5), high: (6, 6, 6)), to: Collider(1))]";
    let error = built(nothing).expect_err("nothing is there");
    assert!(error.contains("stitch 1: no vertex is within"), "{error}");
}

/// Text that is no scene, and bytes that are no text.
#[test]
fn a_file_of_another_kind_is_named_and_what_can_be_read_is_listed() {
    for content in [&b"solid star\nendsolid star\n"[..], &[0xff, 0xfe, 0, 1]] {
        let path = std::env::temp_dir().join(format!("pliant-kind-{}.stl", std::process::id()));
        fs::write(&path, content).expect("writable");
        let error = Scene::load(&path.to_string_lossy()).expect_err("an STL file");
        says(
            &error.to_string(),
            &[
                ".stl is no scene file (RON) and no mesh (obj, gltf",
                "convert",
            ],
        );
        fs::remove_file(&path).expect("it was made here");
    }
}
