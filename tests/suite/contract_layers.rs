//! Contracts about the source: which operations the solver may use, and which module may depend on
//! which.

use crate::modules::{Name, Package};
use std::{
    cmp::Reverse,
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
    process::Command,
};

/// Modules from top to bottom: each may import those below it, and those of its own line. (The compiler
/// enforces that no package imports one above it.) Simulation and effects share a line: a schedule holds
/// systems of effects, and an effect's systems belong to sets of the schedule.
const LAYERS: [(&str, &str, &str); 4] = [
    (
        "src",
        "",
        "command > sandbox > ablation study torture > avian bench output render > recording > scene > \
         effect simulation > file suggestion",
    ),
    (
        "src",
        "sandbox",
        "app > panel > input lab > render > ui > state",
    ),
    (
        "crates/solver/src",
        "",
        "diagnostics > reference > equilibrium > step > direct > contact > measure > effects > colliders > \
         deform > reflection > topology > substep > kernel > parallel > particles > layout > analytic > quantity",
    ),
    (
        "crates/mesh/src",
        "",
        "build > primitive > strands > scatter > lattice > embed > orient > clean > enclosure > elements > \
         limits > read > source > skin > error",
    ),
];

/// The packages, fewer imports between their files than are found, and their circles: how many files
/// import each other where these are more than three. This may only become shorter.
const CIRCLES: [(&str, usize, &[usize]); 3] = [
    ("src", 1500, &[21]),
    ("crates/solver/src", 1000, &[]),
    ("crates/mesh/src", 80, &[]),
];

pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Every file of a folder, recursively, with its text.
pub fn files(folder: &Path) -> Vec<(PathBuf, String)> {
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

/// Code without comments: each line up to `//`.
fn code(text: &str) -> impl Iterator<Item = &str> {
    text.lines()
        .map(|line| line.split("//").next().unwrap_or(""))
}

/// A program that only steps bodies builds neither Bevy nor the code that reads and draws.
#[test]
fn the_solver_package_builds_without_bevy() {
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

/// A module can be understood without those above it, as it does not depend on them.
#[test]
fn modules_depend_only_on_lower_layers() {
    for (folder, parent, layers) in LAYERS {
        let layers: Vec<Vec<_>> = layers
            .split(" > ")
            .map(|it| it.split(' ').collect())
            .collect();
        let layer = |module: &Name| {
            let mut names = module.iter();
            let is_inside = parent.is_empty() || names.next().is_some_and(|it| it == parent);
            let own = names.next().filter(|_| is_inside)?;
            let layer = layers
                .iter()
                .position(|layer| layer.contains(&own.as_str()));
            // A prelude may name everything, as a front page may.
            let is_free = ["main", "prelude"].contains(&own.as_str());
            assert!(
                layer.is_some() || is_free,
                "{folder}: an unknown module: {own}"
            );
            layer
        };
        let imports = Package::read(&root().join(folder)).dependencies();
        let each = imports
            .iter()
            .flat_map(|(from, to)| to.iter().map(move |to| (from, to)));
        let is_upward = |&(from, to): &(_, _)| layer(to).is_some_and(|to| Some(to) < layer(from));
        let upward: Vec<_> = each.filter(is_upward).collect();
        assert!(upward.is_empty(), "{folder}: {upward:?}");
    }
}

/// Files can be read alone, or together with two others.
#[test]
fn circles_of_more_than_three_files_are_those_that_are_listed() {
    for (folder, fewer, allowed) in CIRCLES {
        let imports = Package::read(&root().join(folder)).dependencies();
        let count: usize = imports.values().map(BTreeSet::len).sum();
        assert!(
            count > fewer,
            "{folder}: only {count} imports: the scan is broken"
        );
        let mut circles = circles(&imports);
        circles.retain(|circle| circle.len() > 3);
        let sizes: Vec<_> = circles.iter().map(BTreeSet::len).collect();
        assert_eq!(sizes, allowed, "{folder}: {circles:?}");
    }
}

/// Sets of files of which each imports each other, through others or not; the largest first.
fn circles(imports: &BTreeMap<Name, BTreeSet<Name>>) -> Vec<BTreeSet<&Name>> {
    let reached = |from| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![from]);
        while let Some(at) = open.pop() {
            let others = imports.get(at).into_iter().flatten();
            open.extend(others.filter(|other| seen.insert(*other)));
        }
        seen
    };
    let reached: BTreeMap<&Name, _> = imports.keys().map(|from| (from, reached(from))).collect();
    let circles = reached.iter().map(|(from, seen)| {
        let is_back = |to: &&Name| reached.get(to).is_some_and(|seen| seen.contains(from));
        seen.iter().copied().filter(is_back).collect()
    });
    let circles: BTreeSet<BTreeSet<&Name>> = circles.collect();
    let mut circles: Vec<_> = circles.into_iter().collect();
    circles.sort_by_key(|circle| Reverse(circle.len()));
    circles
}

/// Floating-point operations whose result depends on the machine, and containers without a fixed
/// order: sin, powf, mul_add and similar, and hash maps.
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
        // Analytic solutions are only compared with and do not affect a step.
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
