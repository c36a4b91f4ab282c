//! The benchmark: all figures are present and plausible, and invalid requests are rejected.

use pliant::bench::{Case, Options, Spread};
use serde_json::Value;
use std::{
    collections::BTreeSet,
    process::{Command, Output},
    time::Duration,
};

fn bench(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_pliant"))
        .arg("bench")
        .args(arguments)
        .output()
        .expect("the program starts")
}

fn words(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

/// Lowest, median and highest value: all positive and in this order.
fn check_spread(value: &Value, what: &str) {
    let figure = |key| {
        value[key]
            .as_f64()
            .unwrap_or_else(|| panic!("{what}.{key}"))
    };
    let (low, median, high) = (figure("low"), figure("median"), figure("high"));
    assert!(
        0.0 < low && low <= median && median <= high && high.is_finite(),
        "{what}: {low}, {median}, {high}"
    );
}

fn check_positive(object: &Value, keys: &[&str]) {
    for key in keys {
        let figure = object[key].as_f64().unwrap_or_else(|| panic!("{key}"));
        assert!(figure > 0.0 && figure.is_finite(), "{key}: {figure}");
    }
}

#[test]
fn bench_prints_one_object_with_all_figures_and_draws_them() {
    let file = std::env::temp_dir().join(format!("pliant-bench-{}.svg", std::process::id()));
    let svg = file.to_str().expect("UTF-8");
    let output = bench(&[
        "--quick",
        "--json",
        "--threads",
        "2",
        "--only",
        "cloth_21",
        "--svg",
        svg,
    ]);
    assert!(output.status.success(), "{}", words(&output.stderr));
    let object: Value = serde_json::from_slice(&output.stdout).expect("a JSON object");
    check_positive(&object, &["rounds", "slot_s", "substeps"]);
    for key in ["version", "os", "architecture", "instructions"] {
        assert!(
            object[key].as_str().is_some_and(|text| !text.is_empty()),
            "{key}"
        );
    }
    assert_eq!(object["sound"], true);

    let cases = object["cases"].as_array().expect("an array");
    assert_eq!(cases.len(), 1);
    let case = &cases[0];
    assert_eq!(case["name"], "stretch_cloth_21");
    // 2 × 21 × 20 edges along the sides of 20² cells, and both diagonals of each.
    assert_eq!(case["particles"], 441);
    assert_eq!(case["constraints"], 1640);
    assert_eq!(case["projections_per_tick"], 1640 * 16);
    assert_eq!(case["working_set_bytes"], 441 * 48 + 1640 * 12);
    check_positive(
        case,
        &[
            "bytes_per_projection",
            "operations_per_projection",
            "loads_in_turn_ns",
        ],
    );
    let threads = if cfg!(feature = "parallel") {
        vec![1, 2]
    } else {
        vec![1]
    };
    let counts = |list: &Value| -> Vec<u64> {
        let list = list.as_array().expect("an array");
        list.iter()
            .filter_map(|each| each["threads"].as_u64())
            .collect()
    };
    assert_eq!(counts(&case["stepped"]), threads);
    for stepped in case["stepped"].as_array().expect("an array") {
        check_spread(
            &stepped["million_projections_per_s"],
            "million_projections_per_s",
        );
        check_spread(&stepped["ns_per_projection"], "ns_per_projection");
        check_positive(
            stepped,
            &[
                "memory_bound_ns",
                "arithmetic_bound_ns",
                "fraction_of_bound",
            ],
        );
        let product = |a: &str, b: &str| {
            stepped["million_projections_per_s"][a]
                .as_f64()
                .unwrap_or(0.0)
                * stepped["ns_per_projection"][b].as_f64().unwrap_or(0.0)
        };
        for (a, b) in [("median", "median"), ("low", "high"), ("high", "low")] {
            // A quotient and a product in f64, rounded once each.
            assert!((product(a, b) - 1e3).abs() < 1e-9, "{a} × {b}");
        }
    }

    let roofline = &object["roofline"];
    assert_eq!(counts(&roofline["limits"]), threads);
    for limits in roofline["limits"].as_array().expect("an array") {
        let bandwidth = limits["bandwidth"].as_array().expect("an array");
        assert!(bandwidth.len() >= 6, "first-level cache to memory");
        for size in bandwidth {
            check_positive(size, &["bytes"]);
            check_spread(&size["gb_per_s"], "gb_per_s");
        }
        for key in ["operation_ns", "root_ns", "quotient_ns"] {
            check_spread(&limits[key], key);
        }
    }
    for size in roofline["latency"].as_array().expect("an array") {
        check_spread(&size["ns"], "latency");
    }

    let drawn = std::fs::read_to_string(&file).expect("a plot");
    assert!(drawn.contains("<svg") && drawn.contains("stretch, a cloth"));
    std::fs::remove_file(file).expect("it was made here");
}

#[test]
fn bench_refuses_what_it_cannot_measure() {
    for (arguments, expected) in [
        (&["--only", "cloht"][..], &["cloht", "stretch_cloth_21"][..]),
        (&["--threads", "100000"], &["100000", "1024"]),
        (&["--threads", "-1"], &["-1"]),
        (&["--svg", "no/such/folder/x.svg"], &["no/such/folder"]),
        (&["--json", "file"], &["file"]),
    ] {
        let output = bench(arguments);
        let said = words(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        for word in expected {
            assert!(
                said.contains(word),
                "{arguments:?} should say “{word}”: {said}"
            );
        }
        assert!(!said.contains("panicked"), "{said}");
    }
}

#[test]
fn every_case_has_a_name_of_its_own() {
    let names: BTreeSet<String> = Case::all().iter().map(Case::name).collect();
    assert_eq!(names.len(), Case::all().len());
    assert!(names.contains("both_box_5_x100"), "{names:?}");
}

#[test]
fn a_spread_has_the_middle_of_what_was_measured() {
    let spread = Spread::of(vec![4.0, 1.0, 8.0, 2.0, 5.0]);
    assert_eq!((spread.low, spread.median, spread.high), (1.0, 4.0, 8.0));
    let under = spread.under(8.0);
    assert_eq!((under.low, under.median, under.high), (1.0, 2.0, 8.0));
}

/// Blocks up to a million tetrahedra lie on their table: five tetrahedra in each of 6³ to 59³ cells.
#[test]
fn blocks_of_a_thousand_to_a_million_tetrahedra_lie_on_a_table() {
    let options = Options {
        rounds: 1,
        slot: Duration::from_millis(1),
        largest: 1 << 16,
        only: "cloth_21".to_owned(),
        loading: false,
        ..Options::default()
    };
    let report = pliant::bench::run(&options, |_| ()).expect("it runs");
    assert!(report.sound());
    let cells = [6_usize, 13, 27, 59];
    assert_eq!(report.growth.len(), cells.len());
    for (row, cells) in report.growth.iter().zip(cells) {
        assert_eq!(row.tetrahedra, 5 * cells.pow(3));
        assert_eq!(row.particles, (cells + 1).pow(3));
        // At most one contact of each vertex, edge and triangle of the lower face.
        assert!(
            (1..6 * (cells + 1).pow(2)).contains(&row.contacts),
            "{row:?}"
        );
        // Corners, rest volume and scale of a tetrahedron take 24 bytes; it has 1.2 to 1.5 edges of 12,
        // and 0.2 to 0.3 particles of 48 for the state alone.
        let bytes = row.bytes / row.tetrahedra;
        assert!((48..200).contains(&bytes), "{bytes} bytes per tetrahedron");
        for (place, (threads, milliseconds)) in row.stepped.iter().enumerate() {
            assert!(*threads > 0 && milliseconds.low > 0.0);
            assert!(row.nanoseconds(place).is_some_and(|it| it > 0.0));
        }
    }
    let text = report.to_string();
    assert!(text.contains("1026895"), "{text}");
    assert_eq!(report.json()["blocks"].as_array().map(Vec::len), Some(4));
}
