//! Contracts about the source: what the solver may use, and which room may know which.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

/// From the top floor to the ground: a room knows those on lower floors, and its neighbours on its
/// own. (The packages below know nothing of it: the compiler sees to that.) Simulation and effects share a floor: a schedule holds systems of effects, and an effect's
/// systems stand in sets of the schedule.
const FLOORS: [&[&str]; 8] = [
    &["main"],
    &["command"],
    &["sandbox"],
    &["study", "torture"],
    &["bench", "output"],
    &["recording"],
    &["scene"],
    &["effect", "simulation"],
];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn source() -> PathBuf {
    root().join("src")
}

/// Every file of a folder and of those in it, with its text.
fn files(folder: &Path) -> Vec<(PathBuf, String)> {
    let mut all = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder of the project") {
        let path = entry.expect("a readable folder").path();
        if path.is_dir() {
            all.extend(files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = fs::read_to_string(&path).expect("a source file");
            all.push((path, text));
        }
    }
    all
}

fn floor(room: &str) -> Option<usize> {
    FLOORS.iter().position(|rooms| rooms.contains(&room))
}

/// Code without comments: what a line says before `//`.
fn code(text: &str) -> impl Iterator<Item = &str> {
    text.lines()
        .map(|line| line.split("//").next().unwrap_or(""))
}

/// The rooms that a file names: after `crate::` or `pliant::`, alone or in braces.
fn named_rooms(text: &str) -> Vec<String> {
    let all: String = code(text).collect::<Vec<_>>().join("\n");
    let mut rooms = Vec::new();
    for root in ["crate::", "pliant::"] {
        for (start, _) in all.match_indices(root) {
            let rest = &all[start + root.len()..];
            if let Some(braced) = rest.strip_prefix('{') {
                rooms.extend(heads(braced));
            } else {
                rooms.push(word(rest));
            }
        }
    }
    rooms
}

/// First words of the items of a `use` in braces, up to the brace that closes it.
fn heads(text: &str) -> Vec<String> {
    let (mut depth, mut item, mut heads) = (0, String::new(), Vec::new());
    for c in text.chars() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => heads.push(word(std::mem::take(&mut item).trim())),
            c if depth == 0 => item.push(c),
            _ => {}
        }
    }
    heads.push(word(item.trim()));
    heads
}

fn word(text: &str) -> String {
    text.chars()
        .take_while(|c| c.is_alphanumeric() || *c == '_')
        .collect()
}

/// A program that only steps bodies builds neither Bevy nor what reads and draws.
#[test]
fn the_solver_package_stands_alone() {
    let tree = Command::new(env!("CARGO"))
        .args(["tree", "--offline", "--edges", "normal", "--prefix", "none"])
        .args(["--package", "pliant_solver"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo runs");
    let error = String::from_utf8_lossy(&tree.stderr);
    assert!(tree.status.success(), "{error}");
    let tree = String::from_utf8_lossy(&tree.stdout).into_owned();
    assert!(tree.contains("glam"), "{tree}");
    for package in ["bevy", "clap", "plotters", "gltf"] {
        assert!(!tree.contains(package), "{package} is in\n{tree}");
    }
}

/// A room can be understood without those above it, as it does not know them.
#[test]
fn arrows_between_rooms_point_only_down() {
    let mut found = Vec::new();
    let mut seen = 0;
    for (path, text) in files(&source()) {
        let inside = path.strip_prefix(source()).expect("below src");
        let room = inside
            .components()
            .next()
            .map(|first| word(&first.as_os_str().to_string_lossy()))
            .unwrap_or_default();
        let Some(own) = floor(&room) else {
            // The crate's root and its prelude name everything.
            assert!(
                ["lib", "prelude"].contains(&room.as_str()),
                "an unknown room: {room}"
            );
            continue;
        };
        for known in named_rooms(&text) {
            if let Some(other) = floor(&known) {
                seen += 1;
                if other < own {
                    found.push(format!("{} knows {known}", inside.display()));
                }
            }
        }
    }
    assert!(
        seen > 50,
        "only {seen} arrows were found: the scan is blind"
    );
    assert!(found.is_empty(), "\n{}\n", found.join("\n"));
}

/// Floating point that differs by machine, or forgets the order of its sums: sin, powf, mul_add
/// and their like, and hash maps.
#[test]
fn the_solver_uses_nothing_that_differs_by_machine() {
    const FORBIDDEN: [&str; 18] = [
        "mul_add",
        ".sin()",
        ".cos()",
        ".tan()",
        ".sin_cos()",
        ".asin()",
        ".acos()",
        ".atan",
        ".exp()",
        ".ln()",
        ".powf(",
        ".powi(",
        ".cbrt()",
        ".hypot(",
        "HashMap",
        "HashSet",
        "Instant",
        "SystemTime",
    ];
    let solver = root().join("crates/solver/src");
    for (path, text) in files(&solver) {
        // What mathematics knows is compared with, and steps nothing.
        if path.starts_with(solver.join("analytic")) {
            continue;
        }
        for (line, code) in code(&text).enumerate() {
            for word in FORBIDDEN {
                assert!(
                    !code.contains(word),
                    "{} line {}: {code}",
                    path.display(),
                    line + 1
                );
            }
        }
    }
}
