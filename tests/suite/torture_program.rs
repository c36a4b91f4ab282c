//! `pliant torture` from the command line.

use pliant::{scene::Scene, torture::scene};
use serde_json::Value;
use std::{
    fs,
    process::{Command, Output},
};

fn torture(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_pliant"))
        .arg("torture")
        .args(arguments)
        .output()
        .expect("the program starts")
}

fn words(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

#[test]
fn json_is_an_array_of_objects_with_all_that_the_table_has() {
    let output = torture(&["edge", "element", "--quick", "--json"]);
    assert!(output.status.success(), "{}", words(&output.stderr));
    let rows: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let rows = rows.as_array().expect("an array");
    assert_eq!(rows.len(), 2);
    for row in rows {
        for text in ["case", "body", "worst", "measure", "unit"] {
            assert!(row[text].is_string(), "{text}: {row}");
        }
        for number in ["members", "failed", "number", "figure", "limit"] {
            assert!(row[number].is_number(), "{number}: {row}");
        }
        assert_eq!(row["passed"], true);
        assert_eq!(row["expected_failure"], Value::Null);
    }
}

#[test]
fn a_member_is_run_again_by_its_number_or_its_name() {
    let list = words(&torture(&["edge", "--list"]).stdout);
    let line = list.lines().nth(3).expect("a third member");
    let (number, name) = line.trim().split_once(' ').expect("a number and a name");
    let by_number = torture(&["edge", "--member", number]);
    let by_name = torture(&["edge", "--member", name.trim()]);
    assert!(by_number.status.success());
    let of = |output: &Output| -> Vec<String> {
        let text = words(&output.stdout);
        text.lines()
            .filter(|line| !line.starts_with("Slowest"))
            .map(str::to_owned)
            .collect()
    };
    assert_eq!(of(&by_number), of(&by_name));
    assert!(words(&by_number.stdout).contains("strain of edges"));
}

#[test]
fn bad_usage_is_distinguished_from_a_failed_case() {
    for (arguments, said) in [
        (&["no_such_case"][..], "squashed"),
        (&["--member", "3"], "exactly one case"),
        (&["edge", "--member", "1000000"], "a number from 1 to"),
        (&["edge", "--threads", "99999"], "at most"),
        (&["--scene", "no_such_scene"], "no_such_scene"),
        (&["edge", "--scene", "jelly_cube"], "cannot be used with"),
    ] {
        let output = torture(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let error = words(&output.stderr);
        assert!(error.contains(said), "{arguments:?}: {error}");
    }
}

#[test]
fn a_report_stands_alone_and_has_pictures() {
    let folder = std::env::temp_dir().join(format!("pliant-torture-{}", std::process::id()));
    let path = folder.to_str().expect("UTF-8");
    assert!(
        torture(&["edge", "element", "--quick", "--report", path])
            .status
            .success()
    );
    let html = fs::read_to_string(folder.join("report.html")).expect("a page");
    assert_eq!(
        html.matches("<svg").count(),
        4,
        "a film and energies for each row"
    );
    assert!(!html.contains("src="), "nothing beside it is needed");
    let markdown = fs::read_to_string(folder.join("report.md")).expect("a page");
    for line in markdown.lines().filter(|line| line.starts_with("![")) {
        let file = line
            .rsplit_once('(')
            .expect("a link")
            .1
            .trim_end_matches(')');
        let svg = fs::read_to_string(folder.join(file)).expect("a picture");
        assert!(svg.contains("</svg>"));
    }
    fs::remove_dir_all(folder).expect("it was made here");
}

/// A body squeezed between plates keeps its volume with eight times the substeps.
#[test]
fn advice_names_the_cheapest_settings_that_pass() {
    let output = torture(&["plates", "--member", "13", "--advise", "--json"]);
    assert!(output.status.success(), "{}", words(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert!(json["cases"][0]["expected_failure"].is_string(), "{json}");
    let advice = &json["advice"][0];
    assert_eq!(advice["member"], "cube3,compliance=1e-4,damping=0.02");
    let found = &advice["passes_with"];
    assert_eq!(
        (found["substeps"].as_u64(), found["iterations"].as_u64()),
        (Some(80), Some(1))
    );
    assert_eq!(found["direct"], false);
    assert!(
        found["time_ratio"]
            .as_f64()
            .is_some_and(|ratio| ratio > 0.0)
    );
    let text = words(&torture(&["plates", "--member", "13", "--advise"]).stdout);
    assert!(text.contains("passes at 80×1"), "{text}");
}

/// Its own settings, half, twice, one substep, and four times the iterations.
#[test]
fn a_scene_is_a_case_with_coarser_and_finer_settings() {
    let output = torture(&["--scene", "hanging_chain", "--json"]);
    assert!(output.status.success(), "{}", words(&output.stdout));
    let scene: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(scene["scene"], "hanging_chain");
    assert_eq!(scene["passed"], true);
    let settings = scene["settings"].as_array().expect("an array");
    let steps = |it: &Value| (it["substeps"].as_u64(), it["iterations"].as_u64());
    let steps: Vec<_> = settings.iter().map(steps).collect();
    let expected = [(10, 20), (5, 20), (20, 20), (1, 20), (10, 80)];
    assert_eq!(steps, expected.map(|(n, k)| (Some(n), Some(k))));

    let text = words(&torture(&["--scene", "hanging_chain"]).stdout);
    assert!(text.contains("way of the pins"), "{text}");
    assert!(text.contains("1 substep, 20 iterations:"), "{text}");
    assert!(text.ends_with("Passes with all 5 settings.\n"), "{text}");
}

/// A split renumbers the particles behind it: pins are still found at their places.
#[test]
fn pins_of_a_body_that_tears_do_not_move() {
    let current = Scene::load("torn_banner").expect("built in");
    let mut world = current.scene.build().expect("sound").world;
    let particles = world.bodies[0].particles.len();
    let row = scene::run("torn_banner", &world, 0.25, &|_| ()).expect("it runs");
    (0..15).for_each(|_| world.tick());
    assert!(world.bodies[0].particles.len() > particles, "it tears");
    let figures = row.outcomes.iter().flat_map(|outcome| &outcome.figures);
    let mut ways = figures.filter(|figure| figure.name == "way of the pins");
    assert!(ways.all(|figure| figure.value == 0.0));
}

#[test]
fn a_scene_with_a_body_that_is_not_finite_fails_and_one_without_bodies_is_refused() {
    let current = Scene::load("jelly_cube").expect("built in");
    let mut world = current.scene.build().expect("sound").world;
    world.bodies[0].particles.displacements[0].x = f32::NAN;
    let row = scene::run("broken", &world, 0.1, &|_| ()).expect("it runs");
    assert_eq!(row.failed(), row.outcomes.len());
    let worst = row.worst().and_then(|outcome| outcome.worst());
    assert_eq!(worst.map(|figure| figure.name), Some("bodies not finite"));

    world.bodies.clear();
    let error = scene::run("empty", &world, 0.1, &|_| ()).expect_err("no bodies");
    assert!(error.to_string().contains("has no bodies"), "{error}");
}
