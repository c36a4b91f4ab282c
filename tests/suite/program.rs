//! The command line program as a shell user sees it: output, files, exit codes.

use pliant::scene::registry::SCENES;
use serde_json::Value;
use std::{
    path::{Path, PathBuf},
    process::{Command, Output},
};

fn pliant(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_pliant"))
        .args(arguments)
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .output()
        .expect("the program starts")
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).expect("UTF-8")
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).expect("UTF-8")
}

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("pliant-program-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for temporary files");
    folder
}

#[test]
fn scenes_lists_every_scene_of_the_registry() {
    let output = pliant(&["scenes", "--json"]);
    assert!(output.status.success());
    let rows: Vec<Value> = serde_json::from_str(&stdout(&output)).expect("a JSON array");
    let names: Vec<&str> = rows.iter().filter_map(|row| row["name"].as_str()).collect();
    let registered: Vec<&str> = SCENES.iter().map(|scene| scene.name).collect();
    assert_eq!(names, registered);
    let text = stdout(&pliant(&["scenes"]));
    for name in registered {
        assert!(text.contains(name), "{name} is missing:\n{text}");
    }
}

#[test]
fn run_prints_one_object_with_all_figures() {
    let output = pliant(&["run", "jelly_cube", "--seconds", "0.5", "--json"]);
    let object: Value = serde_json::from_str(&stdout(&output)).expect("a JSON object");
    for key in [
        "scene",
        "seconds",
        "rate",
        "substeps",
        "iterations",
        "particles",
        "constraints",
        "systems",
        "ms_per_tick",
        "resolved_substeps",
        "measuring_ms_per_tick",
        "ecs_ms_per_tick",
        "finite",
        "energy_j",
        "momentum",
        "volume_error",
        "residual",
        "state_hash",
        "stopped",
        "accepted",
        "criteria",
        "reasons",
    ] {
        assert!(object.get(key).is_some(), "{key} is missing: {object:#}");
    }
    assert_eq!(object["scene"], "jelly_cube");
    assert_eq!(object["finite"], true);
    assert_eq!(object["ticks"], 30, "half a second at 60 ticks a second");
    assert!(
        object["constraints"]["stretch"]
            .as_u64()
            .is_some_and(|count| count > 0)
    );
    let systems: Vec<&str> = object["systems"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(Value::as_str)
        .collect();
    let place = |part: &str| systems.iter().position(|name| name.contains(part));
    assert!(place("presolve") < place("stretch"), "{systems:?}");
    assert!(place("stretch") < place("volume"), "{systems:?}");
    assert!(place("volume") < place("postsolve"), "{systems:?}");
    assert_eq!(
        place("collide"),
        None,
        "no body of the scene meets colliders: {systems:?}"
    );
}

#[test]
fn the_same_run_has_the_same_hash() {
    let hash = || {
        let output = pliant(&["run", "jelly_cube", "--seconds", "1", "--json"]);
        let object: Value = serde_json::from_str(&stdout(&output)).expect("a JSON object");
        object["state_hash"].as_str().expect("a hash").to_owned()
    };
    assert_eq!(hash(), hash());
}

#[test]
fn the_number_of_threads_changes_how_long_it_takes_and_nothing_else() {
    let folder = folder("threads");
    let file = folder.join("cloth.ron");
    // Large enough for several threads per body: that starts at 2048 particles.
    let text = "Scene(title: \"Cloth\", look_at: \"It falls.\", bodies: [(\
                name: \"cloth\", primitive: Cloth(size: (1, 1), cells: (63, 63)), density: 0.3, \
                pins: [Left(0.0)], effects: (stretch: (compliance: 1e-6)))], \
                acceptance: (seconds: 0.2, checks: []))";
    std::fs::write(&file, text).expect("written");
    let scene = file.to_str().expect("UTF-8");
    let run = |threads: &str| {
        let output = pliant(&[
            "run",
            scene,
            "--seconds",
            "0.2",
            "--json",
            "--threads",
            threads,
        ]);
        let object: Value = serde_json::from_str(&stdout(&output)).expect("a JSON object");
        let particles = object["particles"].as_u64().expect("a count");
        assert!(particles >= 2048, "{particles} particles");
        let hash = object["state_hash"].as_str().expect("a hash").to_owned();
        (hash, object["threads"].as_u64().expect("a count"))
    };
    let (one, two) = (run("1"), run("2"));
    assert_eq!(one.0, two.0);
    let several = if cfg!(feature = "parallel") { 2 } else { 1 };
    assert_eq!((one.1, two.1), (1, several));
    std::fs::remove_dir_all(folder).expect("it was made here");
}

#[test]
fn set_reaches_the_world_and_the_effects() {
    let output = pliant(&[
        "run",
        "jelly_cube",
        "--seconds",
        "0.1",
        "--json",
        "--set",
        "substeps=3",
        "--set",
        "stretch.compliance=1e-6",
        "--set",
        "gravity_y=-1.62",
        "--set",
        "rate=120",
    ]);
    let object: Value = serde_json::from_str(&stdout(&output)).expect("a JSON object");
    assert_eq!(object["substeps"], 3);
    assert_eq!(object["rate"], 120.0);
    let plain = stdout(&pliant(&[
        "run",
        "jelly_cube",
        "--seconds",
        "0.1",
        "--json",
    ]));
    let plain: Value = serde_json::from_str(&plain).expect("a JSON object");
    assert_ne!(object["state_hash"], plain["state_hash"]);
}

#[test]
fn csv_plot_and_json_agree() {
    let folder = folder("outputs");
    let (csv, svg) = (folder.join("run.csv"), folder.join("run.svg"));
    let output = pliant(&[
        "run",
        "jelly_cube",
        "--seconds",
        "0.5",
        "--json",
        "--csv",
        csv.to_str().expect("UTF-8"),
        "--plot",
        svg.to_str().expect("UTF-8"),
    ]);
    let object: Value = serde_json::from_str(&stdout(&output)).expect("a JSON object");
    let mut reader = csv::Reader::from_path(&csv).expect("the CSV is there");
    let column = reader
        .headers()
        .expect("a header")
        .iter()
        .position(|name| name == "energy_j")
        .expect("a column of energies");
    let rows: Vec<csv::StringRecord> = reader.records().map(|row| row.expect("a row")).collect();
    assert_eq!(rows.len(), 31, "the start and thirty ticks");
    let last: f64 = rows[30][column].parse().expect("a number");
    assert_eq!(Some(last), object["energy_j"].as_f64(), "to the last digit");
    let plot = std::fs::read_to_string(&svg).expect("the plot is there");
    assert!(plot.starts_with("<svg") && plot.contains("kinetic") && plot.contains("[J]"));
    std::fs::remove_dir_all(folder).expect("it was made here");
}

#[test]
fn a_failed_acceptance_is_exit_code_1_with_the_reason() {
    let folder = folder("acceptance");
    let file = folder.join("fails.ron");
    let text = r#"Scene(title: "t", look_at: "l", bodies: [(name: "rope",
        primitive: Rope(length: 1, segments: 2), effects: (stretch: ()))],
        acceptance: (seconds: 0.5, checks: [Above(0.0)]))"#;
    std::fs::write(&file, text).expect("written");
    let output = pliant(&["run", file.to_str().expect("UTF-8")]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stdout(&output).contains("rope: reaches down to -"),
        "{}",
        stdout(&output)
    );
    std::fs::remove_dir_all(folder).expect("it was made here");
}

/// A run without criteria, of a mesh, a snapshot or a scene, does not pass for one that met some.
#[test]
fn a_run_without_criteria_says_so() {
    let folder = folder("without");
    let [scene, mesh, snapshot] = files(&folder);
    let run = |arguments: &[&str]| {
        let output = pliant(&[&["run"], arguments, &["--seconds", "0.1"]].concat());
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        stdout(&output)
    };
    for file in [&scene, &mesh, &snapshot] {
        let said = run(&[file]);
        assert!(said.contains("by no criteria: there are none"), "{said}");
        let object: Value = serde_json::from_str(&run(&[file, "--json"])).expect("JSON");
        assert_eq!(object["accepted"], true);
        assert_eq!(object["criteria"], 0);
    }
    let with = std::fs::read_to_string(&scene).expect("it is there");
    let with = with.replace("(seconds: 0.1)", "(seconds: 0.1, checks: [NoInverted])");
    std::fs::write(&scene, with).expect("written");
    let said = run(&[&scene]);
    assert!(said.trim_end().ends_with(", accepted"), "{said}");
    let object: Value = serde_json::from_str(&run(&[&scene, "--json"])).expect("JSON");
    assert_eq!(object["criteria"], 1);
    std::fs::remove_dir_all(folder).expect("it was made here");
}

#[test]
fn bad_usage_is_exit_code_2_and_names_the_word_and_the_choices() {
    for (arguments, words) in [
        (&["run", "nosuch"][..], &["nosuch", "jelly_cube"][..]),
        (&["run", "buny"], &["“buny” (did you mean “bunny”?)"]),
        (&["nosuch"], &["nosuch", "jelly_cube", "pliant --help"]),
        (
            &["runn"],
            &["no such command", "(did you mean “run”?)", "jelly_cube"],
        ),
        (
            &["run", "jelly_cube", "--set", "foo=1"],
            &["foo", "substeps", "stretch"],
        ),
        (
            &["run", "jelly_cube", "--set", "stretch.foo=1"],
            &["stretch.foo", "stretch.compliance"],
        ),
        (
            &["run", "jelly_cube", "--set", "Stretch.complience=1"],
            &["(did you mean “stretch.compliance”?)"],
        ),
        (
            &["run", "jelly_cube", "--set", "collide.friction=1"],
            &["collide", "volume"],
        ),
        (
            &["run", "jelly_cube", "--set", "stretch.compliance=-1"],
            &["-1", "between 0 and 1e12"],
        ),
        (
            &["run", "jelly_cube", "--set", "substeps=0"],
            &["0", "between 1 and 10000"],
        ),
        (
            &["run", "jelly_cube", "--set", "substeps=2.5"],
            &["2.5", "whole number"],
        ),
        (
            &["run", "jelly_cube", "--set", "rate=NaN"],
            &["NaN", "ticks per second"],
        ),
        (&["run", "jelly_cube", "--set", "substeps"], &["name=value"]),
        (
            &["run", "jelly_cube", "--set", "substeps=ten"],
            &["ten", "not a number"],
        ),
        (
            &["run", "jelly_cube", "--seconds", "-1"],
            &["-1", "above 0"],
        ),
        (&["run", "./missing.ron"], &["missing.ron", "no such file"]),
        (
            &["run", "assets/meshes/dragn.obj"],
            &["(did you mean “assets/meshes/dragon.obj”?)"],
        ),
        // A misspelled command, with what would follow it.
        (
            &["rnu", "star.obj"],
            &["“rnu” (did you mean “run”?)", "pliant --help"],
        ),
        (
            &["rnu", "bunny", "--seconds", "3"],
            &["“rnu” (did you mean “run”?)"],
        ),
        (&["Torture", "--quick"], &["(did you mean “torture”?)"]),
        (&["buny"], &["“buny” (did you mean “bunny”?)"]),
        (
            &["assets/meshes/dragn.obj"],
            &["(did you mean “assets/meshes/dragon.obj”?)"],
        ),
        // What is known is not suspected.
        (
            &["bunny", "star.obj"],
            &["'star.obj' cannot be used with '[SCENE]'"],
        ),
        (&["run", "bunny", "--foo"], &["unexpected argument '--foo'"]),
        (&["help", "rnu"], &["unrecognized subcommand 'rnu'"]),
        (
            &["run", "jelly_cube", "--csv", "no/such/folder/x.csv"],
            &["no/such/folder"],
        ),
        (
            &["run", "jelly_cube", "--plot", "x.png"],
            &["x.png", "ends in .svg"],
        ),
        (
            &["run", "jelly_cube", "--threads", "2000"],
            &["2000 threads", "at most 1024"],
        ),
        (&["--threads", "2000"], &["2000 threads", "at most 1024"]),
        (
            &["run", "jelly_cube", "--threads", "two"],
            &["two", "--threads"],
        ),
        (
            &["run", "jelly_cube", "--threads=-1"],
            &["-1", "--threads", "whole number from 0"],
        ),
        (
            &["run", "jelly_cube", "--threads", "-1"],
            &["-1", "--threads", "whole number from 0"],
        ),
        (&["--threads", "-1"], &["whole number from 0"]),
        (&["bench", "--threads", "-1"], &["whole number from 0"]),
        (&["torture", "--threads", "-1"], &["whole number from 0"]),
        (&["torture", "--mixtures", "-1"], &["-1", "--mixtures"]),
        (&["bench", "--svg", "x.png"], &["x.png", "ends in .svg"]),
        (
            &["run", "jelly_cube", "--csv", "a", "--snapshot", "./a"],
            &["--csv and --snapshot would both write", "a file of its own"],
        ),
        (
            &["run", "jelly_cube", "--csv", "-", "--json"],
            &["--csv -", "--json"],
        ),
        (
            &["run", "jelly_cube", "--snapshot", "-"],
            &["--snapshot", "./-"],
        ),
        (&["run", "jelly_cube", "--csv", "/"], &["it is a folder"]),
        (&["run"], &["SCENE"]),
    ] {
        let output = pliant(arguments);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        for word in words {
            assert!(
                said.contains(word),
                "{arguments:?} should say “{word}”: {said}"
            );
        }
        assert!(!said.contains("panicked"), "{said}");
    }
}

/// A scene with a mesh of its own, and a snapshot of it.
fn files(folder: &Path) -> [String; 3] {
    let [scene, mesh, snapshot] =
        ["my.ron", "my.obj", "my.snap"].map(|name| folder.join(name).display().to_string());
    let tetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    let body = "(name: \"t\", mesh: (file: \"my.obj\", cells: 3), position: (0, 1, 0), effects: (stretch: ()))";
    let text = format!(
        "Scene(title: \"t\", look_at: \"l\", bodies: [{body}], acceptance: (seconds: 0.1))"
    );
    std::fs::write(&mesh, tetrahedron).expect("written");
    std::fs::write(&scene, text).expect("written");
    let output = pliant(&["run", &scene, "--snapshot", &snapshot]);
    assert!(output.status.success(), "{}", stderr(&output));
    [scene, mesh, snapshot]
}

#[test]
fn an_output_replaces_no_file_that_the_run_reads_unless_that_is_meant() {
    let folder = folder("inputs");
    let [scene, mesh, snapshot] = files(&folder);
    let read = |path: &str| std::fs::read(path).expect("it is there");
    let before = [&scene, &mesh, &snapshot].map(|path| read(path));
    let twisted = folder.join("../").join(folder.file_name().expect("a name"));
    let twisted = twisted.join("my.ron").display().to_string();
    for (arguments, word) in [
        (&["run", &scene, "--csv", &scene][..], "the scene"),
        (&["run", &scene, "--csv", &twisted], "the scene"),
        (&["run", &scene, "--record", &scene], "the scene"),
        (&["run", &scene, "--snapshot", &mesh], "a mesh of the scene"),
        (&["run", &mesh, "--csv", &mesh], "the scene"),
        (
            &["run", "--from", &snapshot, "--snapshot", &snapshot],
            "the snapshot",
        ),
        (&["run", &scene, "--plot", &scene], "ends in .svg"),
    ] {
        let output = pliant(arguments);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains(word), "{arguments:?}: {said}");
        let now = [&scene, &mesh, &snapshot].map(|path| read(path));
        assert!(now == before, "{arguments:?} changed a file");
    }
    let meant = pliant(&[
        "run",
        "--from",
        &snapshot,
        "--seconds",
        "0.1",
        "--snapshot",
        &snapshot,
        "--overwrite",
    ]);
    assert!(meant.status.success(), "{}", stderr(&meant));
    assert!(read(&snapshot) != before[2]);
    std::fs::remove_dir_all(folder).expect("it was made here");
}

#[cfg(unix)]
#[test]
fn an_input_is_known_by_its_other_names() {
    let folder = folder("links");
    let [scene, ..] = files(&folder);
    let before = std::fs::read(&scene).expect("it is there");
    let [soft, hard] = ["soft.csv", "hard.csv"].map(|name| folder.join(name));
    std::os::unix::fs::symlink(&scene, &soft).expect("it can be linked");
    std::fs::hard_link(&scene, &hard).expect("it can be linked");
    for link in [&soft, &hard] {
        let output = pliant(&["run", &scene, "--csv", &link.display().to_string()]);
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert_eq!(std::fs::read(&scene).expect("it is there"), before);
    }
    std::fs::remove_dir_all(folder).expect("it was made here");
}

/// What was repaired or left out of a mesh is said as text, in JSON, and of an ablation.
#[test]
fn notes_about_a_mesh_are_said_wherever_it_runs() {
    let folder = folder("notes");
    let mesh = folder.join("open.obj").display().to_string();
    // A tetrahedron without one of its faces, and another one beside it.
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 3 0 0\nv 4 0 0\nv 3 1 0\nv 3 0 1\n";
    let faces = "f 1 2 4\nf 1 4 3\nf 2 3 4\nf 5 7 6\nf 5 6 8\nf 5 8 7\nf 6 7 8\n";
    std::fs::write(&mesh, format!("{corners}{faces}")).expect("written");
    let scene = folder.join("open.ron").display().to_string();
    let body = "(name: \"t\", mesh: (file: \"open.obj\", cells: 6), position: (0, 2, 0), effects: (stretch: (), volume: ()))";
    let text = format!(
        "Scene(title: \"t\", look_at: \"l\", bodies: [{body}], acceptance: (seconds: 0.1))"
    );
    std::fs::write(&scene, text).expect("written");
    let run = |arguments: &[&str]| stdout(&pliant(&[&["run", &scene], arguments].concat()));
    let said = run(&["--seconds", "0.1"]);
    assert!(said.starts_with("note: "), "{said}");
    assert!(said.contains("open") && said.contains("pieces"), "{said}");
    for arguments in [&["--json"][..], &["--json", "--ablate", "--seconds", "0.1"]] {
        let object: Value = serde_json::from_str(&run(arguments)).expect("a JSON object");
        let notes = object["notes"].as_array().expect("notes");
        assert!(notes.len() >= 2, "{object:#}");
    }
    std::fs::remove_dir_all(folder).expect("it was made here");
}

#[test]
fn the_figures_of_every_tick_can_be_piped() {
    let folder = folder("piped");
    let output = Command::new(env!("CARGO_BIN_EXE_pliant"))
        .current_dir(&folder)
        .args(["run", "jelly_cube", "--seconds", "0.1", "--csv", "-"])
        .output()
        .expect("the program starts");
    let text = stdout(&output);
    assert!(text.starts_with("tick,time_s,"), "{text}");
    assert_eq!(text.lines().count(), 1 + 7, "a header, and ticks 0 to 6");
    assert_eq!(std::fs::read_dir(&folder).expect("a folder").count(), 0);
    std::fs::remove_dir_all(folder).expect("it was made here");
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_a_run_with_the_figures_so_far() {
    let folder = folder("stopped");
    let [csv, snapshot] = ["a.csv", "a.snap"].map(|name| folder.join(name).display().to_string());
    let recording = folder.join("a.rec");
    let record = recording.display().to_string();
    let arguments = [
        "run",
        "jelly_cube",
        "--seconds",
        "100000",
        "--csv",
        &csv,
        "--snapshot",
        &snapshot,
        "--record",
        &record,
    ];
    let child = Command::new(env!("CARGO_BIN_EXE_pliant"))
        .args(arguments)
        .stdout(std::process::Stdio::piped())
        .spawn()
        .expect("the program starts");
    // It is watched for before the run begins, which writes a hash every ten ticks.
    let begun = || std::fs::metadata(&recording).is_ok_and(|file| file.len() > 100_000);
    for _ in 0..600 {
        if begun() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(100));
    }
    let id = child.id().to_string();
    let sent = Command::new("kill").args(["-INT", &id]).status();
    assert!(sent.expect("there is a kill").success());
    let output = child.wait_with_output().expect("it ends");
    let said = stdout(&output);
    assert_eq!(output.status.code(), Some(130), "{said}");
    assert!(
        said.contains("stopped before 100000 s: acceptance not checked"),
        "{said}"
    );
    let rows = std::fs::read_to_string(&csv).expect("it is written");
    assert!(rows.lines().count() > 2, "{rows}");
    let further = pliant(&["run", "--from", &snapshot, "--seconds", "0.1"]);
    assert!(further.status.success(), "{}", stderr(&further));
    std::fs::remove_dir_all(folder).expect("it was made here");
}

#[test]
fn a_study_replaces_no_other_study_unless_that_is_meant() {
    let folder = folder("studies");
    let out = folder.display().to_string();
    let study = |arguments: &[&str]| {
        let all = [&["study", "--quick", "--out", &out], arguments].concat();
        pliant(&all)
    };
    let first = study(&["hanging_mass"]);
    assert!(first.status.success(), "{}", stderr(&first));
    let points = folder.join(pliant::study::journal::FILE);
    let before = std::fs::read(&points).expect("points");
    let refused = study(&["spring_period"]);
    let said = stderr(&refused);
    assert_eq!(refused.status.code(), Some(2), "{said}");
    for word in ["earlier study", "--resume", "--overwrite", "--out"] {
        assert!(said.contains(word), "{said}");
    }
    assert_eq!(std::fs::read(&points).expect("points"), before);
    assert!(study(&["hanging_mass", "--resume"]).status.success());
    assert!(study(&["hanging_mass", "--overwrite"]).status.success());
    std::fs::remove_dir_all(folder).expect("it was made here");
}

#[test]
fn an_error_in_a_scene_file_is_reported_with_file_line_and_column() {
    let folder = folder("mistake");
    let file = folder.join("mistake.ron");
    let text = "Scene(\n    title: \"t\",\n    look_at: \"l\",\n    bodees: [],\n)";
    std::fs::write(&file, text).expect("written");
    let output = pliant(&["run", file.to_str().expect("UTF-8")]);
    assert_eq!(output.status.code(), Some(2));
    let said = stderr(&output);
    assert!(said.contains("mistake.ron:4:"), "file and line: {said}");
    assert!(
        said.contains("bodees") && said.contains("bodies"),
        "found and expected: {said}"
    );
    std::fs::remove_dir_all(folder).expect("it was made here");
}

#[test]
fn without_a_display_the_default_scene_runs_and_leaves_figures_and_a_plot() {
    let folder = folder("display");
    let output = Command::new(env!("CARGO_BIN_EXE_pliant"))
        .current_dir(&folder)
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .output()
        .expect("the program starts");
    let said = stdout(&output);
    assert!(output.status.success(), "{said}{}", stderr(&output));
    assert!(said.starts_with("No window: "), "{said}");
    let left = folder.join("pliant-run");
    assert!(
        said.contains(left.to_str().expect("UTF-8")),
        "it names the folder: {said}"
    );
    for file in ["run.csv", "run.svg"] {
        let size = std::fs::metadata(left.join(file))
            .expect("it is there")
            .len();
        assert!(size > 1000, "{file} has {size} bytes");
    }
    std::fs::remove_dir_all(folder).expect("it was made here");
}

#[test]
fn a_run_with_its_ledger_says_where_the_energy_went() {
    let output = pliant(&[
        "run",
        "jelly_cube",
        "--seconds",
        "0.5",
        "--ledger",
        "--json",
    ]);
    let object: Value = serde_json::from_str(&stdout(&output)).expect("a JSON object");
    let ledger = object["ledger_j"].as_object().expect("a ledger");
    let energy = |name: &str| ledger[name].as_f64().expect("joules");
    let rows = ledger
        .keys()
        .filter(|name| !["change", "unaccounted"].contains(&name.as_str()));
    let sum: f64 = rows.map(|name| energy(name)).sum();
    let gap = energy("change") - sum - energy("unaccounted");
    // Sums of eight terms of up to 1e3 J in f64.
    assert!(gap.abs() < 1e-10, "{gap:e}: {ledger:?}");
    assert!(energy("integrator") < 0.0, "{ledger:?}");
    let words = stdout(&pliant(&["run", "bounce", "--seconds", "0.5", "--ledger"]));
    assert!(words.contains("contact -2.1"), "{words}");
    let without = pliant(&["run", "jelly_cube", "--seconds", "0.5", "--json"]);
    assert!(!stdout(&without).contains("ledger_j"));
}

/// A mesh file that disappears while it is read is either read or reported as missing by name.
#[test]
fn a_mesh_file_that_is_deleted_while_it_loads_is_named_or_read() {
    let folder = folder("vanishing");
    let scene = folder.join("scene.ron");
    let text = r#"(title: "t", look_at: "l", world: (), bodies: [(
        name: "dragon", mesh: (file: "mesh.obj", size: 0.9, cells: 6), effects: (stretch: ()),
    )], acceptance: (seconds: 0.05, checks: []))"#;
    std::fs::write(&scene, text).expect("written");
    let scene = scene.to_str().expect("UTF-8");
    let (mut read, mut missed) = (0, 0);
    for milliseconds in [0, 1, 2, 5, 10, 20, 50, 100] {
        std::fs::copy("assets/meshes/dragon.obj", folder.join("mesh.obj")).expect("copied");
        let program = Command::new(env!("CARGO_BIN_EXE_pliant"))
            .args(["run", scene, "--seconds", "0.05"])
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .expect("the program starts");
        std::thread::sleep(std::time::Duration::from_millis(milliseconds));
        std::fs::remove_file(folder.join("mesh.obj")).expect("removed");
        let output = program.wait_with_output().expect("it ends");
        let words = stderr(&output);
        assert!(!words.contains("panicked"), "{words}");
        match output.status.code() {
            Some(0) => read += 1,
            Some(2) => {
                assert!(words.contains("mesh.obj"), "{words}");
                missed += 1;
            }
            code => panic!("{code:?}: {words}"),
        }
    }
    assert_eq!(read + missed, 8);
    std::fs::remove_dir_all(&folder).expect("it was made here");
}
