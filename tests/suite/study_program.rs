//! `pliant study` from the command line.

use serde_json::Value;
use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

fn study(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_pliant"))
        .arg("study")
        .args(arguments)
        .output()
        .expect("the program starts")
}

fn words(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

/// An empty folder for a test.
fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("pliant-study-{}-{name}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder for temporary files");
    folder
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

/// A mass on a spring, as a user might write it, on two meshes.
const OWN: &str = r#"Problem(
    title: "A mass of my own",
    about: "Two ropes of the same stiffness.",
    scene: (title: "Mass", look_at: "It hangs.", bodies: [], acceptance: (seconds: 1.0)),
    levels: [
        (name: "2 links", bodies: [(name: "rope", primitive: Rope(length: 1, segments: 2),
            density: 1, pins: [Particle(0)], rotation: (0, 0, -90), effects: (stretch: (axial_stiffness: 300)))]),
        (name: "4 links", bodies: [(name: "rope", primitive: Rope(length: 1, segments: 4),
            density: 1, pins: [Particle(0)], rotation: (0, 0, -90), effects: (stretch: (axial_stiffness: 300)))]),
    ],
    observe: Rest(quantity: Moved(body: 0, axis: (0, -1, 0),
        select: Within(low: (-1, -0.51, -1), high: (1, -0.49, 1))), seconds: 6.0),
    reference: HangingBar(density: 1, length: 1, stiffness: 300, gravity: 9.81),
    converged: (substeps: 16, iterations: 4),
)"#;

fn own(folder: &Path) -> PathBuf {
    let file = folder.join("own.ron");
    fs::write(&file, OWN).expect("written");
    file
}

fn object(output: &Output) -> Value {
    assert!(output.status.success(), "{}", words(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("a JSON object")
}

/// The machine-independent part of every point.
fn answers(study: &Value) -> Vec<Value> {
    let problems = study["problems"].as_array().expect("an array").iter();
    let points = problems.flat_map(|problem| problem["points"].as_array().expect("an array"));
    points
        .map(|point| {
            let keys = [
                "method",
                "substeps",
                "iterations",
                "level",
                "projections_per_tick",
                "settled",
                "hash",
            ];
            let mut answer: Vec<Value> = keys.map(|key| point[key].clone()).into();
            // A number may change in its last digit when written and read.
            let error = point["error"].as_f64().map(|error| format!("{error:.10e}"));
            answer.push(error.into());
            Value::Array(answer)
        })
        .collect()
}

#[test]
fn a_users_file_gives_all_figures_and_all_files() {
    let folder = folder("own");
    let (file, out) = (own(&folder), folder.join("out"));
    let study = object(&study(&[
        text(&file),
        "--quick",
        "--json",
        "--out",
        text(&out),
    ]));
    let problems = study["problems"].as_array().expect("an array");
    assert_eq!(problems.len(), 1);
    let problem = &problems[0];
    assert_eq!(problem["name"], "own");
    assert_eq!(problem["unit"], "m");
    // ρgL²/(2EA).
    let reference = problem["reference"]["value"]
        .as_f64()
        .expect("a closed form");
    assert!((reference - 9.81 / 600.0).abs() < 1e-12);
    // Springs that divide a bar's weight give its elongation on any mesh; masses and lengths are
    // f32.
    assert!(problem["mesh_error"].as_f64().expect("a number") < 1e-5);
    let points = problem["points"].as_array().expect("an array");
    assert!(points.len() > 15, "{} points", points.len());
    for point in points {
        for key in [
            "method",
            "substeps",
            "iterations",
            "level",
            "projections_per_tick",
            "settled",
        ] {
            assert!(!point[key].is_null(), "{key} is missing: {point:#}");
        }
        if point["skipped"] == false {
            assert!(
                point["error"].as_f64().is_some_and(|error| error >= 0.0),
                "{point:#}"
            );
            assert!(
                point["ms_per_second"].as_f64().is_some_and(|ms| ms > 0.0),
                "{point:#}"
            );
        }
    }
    let constraints = |level: u64| [0, 2, 4][level as usize];
    for point in points {
        let number = |key: &str| point[key].as_u64().expect("a count");
        let expected = number("substeps") * number("iterations") * constraints(number("level"));
        assert_eq!(number("projections_per_tick"), expected);
    }
    for percent in ["10%", "1%", "0.1%"] {
        let cheapest = problem["cheapest"][percent].as_array().expect("an array");
        assert!(!cheapest.is_empty(), "nothing comes within {percent}");
    }
    let left = |name: &str| fs::read_to_string(out.join(name)).expect("a file of the study");
    let rows = left("points.csv").lines().count();
    assert_eq!(rows, points.len() + 1);
    assert!(left("own.svg").contains("<svg"));
    assert!(left("report.md").starts_with("# Accuracy vs. cost"));
    let page = left("report.html");
    assert!(page.contains("<svg") && page.contains("A mass of my own"));
    for outside in ["<script", "<link", "src=", "@import"] {
        assert!(!page.contains(outside), "{outside} needs something else");
    }
    let written: Value = serde_json::from_str(&left("study.json")).expect("a JSON object");
    assert_eq!(written, study);
    fs::remove_dir_all(folder).expect("it was made here");
}

#[test]
fn parts_that_are_put_together_are_the_same_study() {
    let folder = folder("parts");
    let (file, out, whole) = (own(&folder), folder.join("parts"), folder.join("whole"));
    let problems = [text(&file), "hanging_mass", "--quick"];
    let listed = study(&[&problems[..], &["--list", "--out", text(&out)]].concat());
    let list = words(&listed.stdout);
    assert_eq!(list.lines().count(), 3, "two meshes and one: {list}");
    for line in list.lines() {
        let command: Vec<&str> = line.split(' ').collect();
        assert_eq!(&command[..2], ["pliant", "study"]);
        let part = study(&command[2..]);
        assert!(part.status.success(), "{line}: {}", words(&part.stderr));
    }
    let mut parts: Vec<PathBuf> = fs::read_dir(&out)
        .expect("a folder of parts")
        .map(|part| part.expect("a part").path())
        .collect();
    parts.sort();
    let mut merge = vec!["--json", "--out"];
    let merged = folder.join("merged");
    merge.extend([text(&merged), "--merge"]);
    merge.extend(parts.iter().map(|part| text(part)));
    let merged_study = object(&study(&merge));
    let one = object(&study(
        &[&problems[..], &["--json", "--out", text(&whole)]].concat(),
    ));
    assert_eq!(answers(&merged_study), answers(&one));
    assert_eq!(merged_study["hash"], one["hash"]);
    assert!(merged.join("report.html").is_file());
    let other = folder.join("other");
    object(&study(&[
        "spring_period",
        "--quick",
        "--json",
        "--out",
        text(&other),
    ]));
    let refused = study(&[
        "--merge",
        text(&whole),
        text(&other),
        "--out",
        text(&folder.join("both")),
    ]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(words(&refused.stderr).contains("another study"));
    fs::remove_dir_all(folder).expect("it was made here");
}

#[test]
fn a_study_that_was_stopped_goes_on_from_what_it_has() {
    let folder = folder("resume");
    let (file, out) = (own(&folder), folder.join("out"));
    let arguments = [text(&file), "--quick", "--json", "--out", text(&out)];
    let whole = object(&study(&arguments));
    let points = out.join("points.jsonl");
    let all = fs::read_to_string(&points).expect("the points");
    let lines: Vec<&str> = all.split_inclusive('\n').collect();
    // The file after a kill: a third of the lines, and a part of the next.
    let kept = lines[..lines.len() / 3].concat();
    let cut = format!("{kept}{}", &lines[lines.len() / 3][..20]);
    fs::write(&points, cut).expect("written");
    let resumed = object(&study(&[&arguments[..], &["--resume"]].concat()));
    assert_eq!(answers(&resumed), answers(&whole));
    let after = fs::read_to_string(&points).expect("the points");
    assert!(after.starts_with(&kept), "what was there is kept");
    assert_eq!(after.lines().count(), lines.len());

    let refused = study(&["hanging_mass", "--quick", "--resume", "--out", text(&out)]);
    assert_eq!(refused.status.code(), Some(2));
    let said = words(&refused.stderr);
    assert!(
        said.contains("another study") && said.contains("--out"),
        "{said}"
    );
    fs::remove_dir_all(folder).expect("it was made here");
}

#[test]
fn invalid_studies_are_refused_in_one_message() {
    let folder = folder("refused");
    let out = folder.join("out");
    let refuse = |arguments: &[&str], expected: &[&str]| {
        let output = study(&[arguments, &["--quick", "--out", text(&out)]].concat());
        let said = words(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        for word in expected {
            assert!(said.contains(word), "{arguments:?} says {said}");
        }
        assert!(output.stdout.is_empty());
    };
    refuse(&["nonsense"], &["nonsense", "hanging_mass"]);
    refuse(&["no/such.ron"], &["no/such.ron"]);
    let write = |name: &str, contents: &str| {
        let path = folder.join(name);
        fs::write(&path, contents).expect("written");
        path
    };
    let broken = write("broken.ron", &OWN.replace("observe:", "observes:"));
    refuse(&[text(&broken)], &["broken.ron:", "observes"]);
    let line = OWN
        .lines()
        .position(|line| line.contains("observe:"))
        .expect("it is there")
        + 1;
    refuse(&[text(&broken)], &[&format!(":{line}:")]);
    let empty = write(
        "empty.ron",
        &OWN.replace("low: (-1, -0.51, -1)", "low: (5, 5, 5)"),
    );
    refuse(&[text(&empty)], &["empty", "2 links", "no particle"]);
    let body = write("body.ron", &OWN.replace("Moved(body: 0", "Moved(body: 7"));
    refuse(&[text(&body)], &["body 7", "number of bodies is 1"]);
    let endless = write("endless.ron", &OWN.replace("seconds: 6.0", "seconds: 1e9"));
    refuse(&[text(&endless)], &["1000 s"]);
    let infinite = write(
        "infinite.ron",
        &OWN.replace("stiffness: 300, gravity", "stiffness: 0, gravity"),
    );
    refuse(&[text(&infinite)], &["closed form"]);
    refuse(
        &["hanging_mass", "--only", "hanging_mass@9"],
        &["hanging_mass@9", "hanging_mass@1"],
    );
    let merge = |arguments: &[&str]| {
        let output = study(arguments);
        assert_eq!(output.status.code(), Some(2));
        words(&output.stderr)
    };
    let said = merge(&["--out", text(&out), "--merge", text(&folder)]);
    assert!(said.contains("no points"), "{said}");
    let inside = broken.join("out");
    let said = merge(&["hanging_mass", "--quick", "--out", text(&inside)]);
    assert!(said.contains("cannot write"), "{said}");
    fs::remove_dir_all(folder).expect("it was made here");
}
