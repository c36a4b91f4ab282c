//! Contracts about the source: which operations the solver may use, and which module may depend on
//! which.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
    process::Command,
};

/// Layers from top to bottom: a module may depend on lower layers and on modules of its own layer.
/// (The compiler enforces that the packages below do not depend on it.) Simulation and effects
/// share a layer: a schedule holds systems of effects, and an effect's systems belong to sets of
/// the schedule.
const LAYERS: [&[&str]; 9] = [
    &["main"],
    &["command"],
    &["sandbox"],
    &["ablation", "study", "torture"],
    &["avian", "bench", "output", "render"],
    &["recording"],
    &["scene"],
    &["effect", "simulation"],
    &["file", "suggestion"],
];

/// Layers of the window's modules.
const WINDOW_LAYERS: [&[&str]; 6] = [
    &["app"],
    &["panel"],
    &["input", "lab"],
    &["render"],
    &["ui"],
    &["state"],
];

pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn source() -> PathBuf {
    root().join("src")
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

fn layer_of(layers: &[&[&str]], module_name: &str) -> Option<usize> {
    layers.iter().position(|names| names.contains(&module_name))
}

/// Code without comments: each line up to `//`.
pub fn code(text: &str) -> impl Iterator<Item = &str> {
    text.lines()
        .map(|line| line.split("//").next().unwrap_or(""))
}

/// The modules that a file names: after one of these roots, alone or in braces.
fn named_modules(text: &str, roots: &[&str]) -> Vec<String> {
    let all: String = code(text).collect::<Vec<_>>().join("\n");
    let mut names = Vec::new();
    for root in roots {
        for (start, _) in all.match_indices(root) {
            let rest = &all[start + root.len()..];
            if let Some(braced) = rest.strip_prefix('{') {
                names.extend(heads(braced));
            } else {
                names.push(word(rest));
            }
        }
    }
    names
}

/// First words of the items of a `use` in braces, up to the closing brace.
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
    assert_downward_dependencies(
        &source(),
        &LAYERS,
        &["crate::", "pliant::"],
        // The crate's root and its prelude may name everything.
        &["lib", "prelude"],
    );
}

/// The same for the modules of the window, except its root, which combines them.
#[test]
fn modules_of_the_window_depend_only_on_lower_layers() {
    let roots = ["sandbox::"];
    assert_downward_dependencies(&source().join("sandbox"), &WINDOW_LAYERS, &roots, &["mod"]);
}

#[track_caller]
fn assert_downward_dependencies(
    folder: &Path,
    layers: &[&[&str]],
    roots: &[&str],
    others: &[&str],
) {
    let mut found = Vec::new();
    let mut seen = 0;
    for (path, text) in files(folder) {
        let inside = path.strip_prefix(folder).expect("below it");
        let module_name = inside
            .components()
            .next()
            .map(|first| word(&first.as_os_str().to_string_lossy()))
            .unwrap_or_default();
        let Some(own) = layer_of(layers, &module_name) else {
            assert!(
                others.contains(&module_name.as_str()),
                "an unknown module: {module_name}"
            );
            continue;
        };
        for known in named_modules(&text, roots) {
            if let Some(other) = layer_of(layers, &known) {
                seen += 1;
                if other < own {
                    found.push(format!("{} knows {known}", inside.display()));
                }
            }
        }
    }
    assert!(
        seen > 50,
        "only {seen} dependencies were found: the scan is broken"
    );
    assert!(found.is_empty(), "\n{}\n", found.join("\n"));
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

/// The modules of the solver by path (`effects::stretch`), each with its code.
fn solver_modules() -> BTreeMap<String, String> {
    let root = root().join("crates/solver/src");
    let modules = files(&root).into_iter().map(|(path, text)| {
        let path = path
            .strip_prefix(&root)
            .expect("below src")
            .with_extension("");
        let parts = path.iter().map(|part| part.to_string_lossy().into_owned());
        let parts: Vec<_> = parts
            .filter(|part| part != "mod" && part != "lib")
            .collect();
        let text = text
            .split("#[cfg(test)]\nmod tests")
            .next()
            .unwrap_or_default();
        (parts.join("::"), code(text).collect::<Vec<_>>().join("\n"))
    });
    modules.collect()
}

/// All paths in a use tree, as in `a::{b, c::d}`.
pub fn paths(tree: &str) -> Vec<String> {
    let Some((head, rest)) = tree.split_once('{') else {
        let path: String = tree
            .split(" as ")
            .next()
            .unwrap_or("")
            .split_whitespace()
            .collect();
        return if path.is_empty() { vec![] } else { vec![path] };
    };
    let inside = rest.rsplit_once('}').map_or(rest, |(inside, _)| inside);
    let (mut depth, mut items) = (0, vec![String::new()]);
    for c in inside.chars() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        if c == ',' && depth == 0 {
            items.push(String::new());
        } else if let Some(item) = items.last_mut() {
            item.push(c);
        }
    }
    let head: String = head.split_whitespace().collect();
    let of_item = |item: &String| paths(item).into_iter();
    let all = items.iter().flat_map(of_item);
    all.map(|path| format!("{head}{path}")).collect()
}

/// The imports of a module: absolute paths from the root of the solver, each with whether it is
/// re-exported.
fn imports(module: &str, code: &str) -> Vec<(Vec<String>, bool)> {
    let mut found = Vec::new();
    let mut others = String::new();
    for statement in code.split_inclusive(';') {
        let start = statement.rfind("use ").filter(|&start| {
            let before = &statement[..start];
            before.is_empty() || before.ends_with([' ', '\n'])
        });
        match start {
            Some(start) if statement.ends_with(';') && !statement[start..].contains('(') => {
                let line = statement[..start].lines().last().unwrap_or("");
                let exported = line.trim_start().starts_with("pub");
                let tree = statement[start + 4..].trim_end_matches(';');
                found.extend(paths(tree).into_iter().map(|path| (path, exported)));
                others.push_str(&statement[..start]);
            }
            _ => others.push_str(statement),
        }
    }
    // A re-export that the module does not use is not a dependency of it.
    let is_used = |path: &str| others.contains(path.rsplit("::").next().unwrap_or(path));
    let mut found: Vec<_> = found
        .into_iter()
        .map(|(path, exported)| (path.clone(), exported && !is_used(&path)))
        .collect();
    for root in ["crate::", "super::"] {
        for (start, _) in others.match_indices(root) {
            let path = others[start..].chars();
            let path: String = path
                .take_while(|c| c.is_alphanumeric() || "_:".contains(*c))
                .collect();
            found.push((path, false));
        }
    }
    let own: Vec<String> = module.split("::").map(str::to_owned).collect();
    let absolute = |path: &str| {
        let mut at = own.clone();
        let mut parts = path.split("::").filter(|part| !part.is_empty()).peekable();
        match parts.peek().copied() {
            Some("crate") => {
                parts.next();
                at.clear();
            }
            Some("self") => {
                parts.next();
            }
            _ => {}
        }
        while parts.next_if_eq(&"super").is_some() {
            at.pop();
        }
        at.extend(parts.map(str::to_owned));
        at.retain(|part| !part.is_empty());
        at
    };
    let all = found.iter();
    all.map(|(path, sign)| (absolute(path), *sign)).collect()
}

/// Dependencies between the modules of the solver.
fn dependencies(modules: &BTreeMap<String, String>) -> BTreeMap<String, BTreeSet<String>> {
    let imports: BTreeMap<&String, _> = modules
        .iter()
        .map(|(module, code)| (module, imports(module, code)))
        .collect();
    // The origin of each re-exported name.
    let mut signs = BTreeMap::new();
    for (module, all) in &imports {
        for (path, _) in all {
            let mut name: Vec<String> = module.split("::").map(str::to_owned).collect();
            name.retain(|part| !part.is_empty());
            name.extend(path.last().cloned());
            signs.insert(name, path.clone());
        }
    }
    let target = |path: &[String]| {
        let mut path = path.to_vec();
        for _ in 0..8 {
            let known = |end: &usize| modules.contains_key(&path[..*end].join("::"));
            let end = (0..=path.len()).rev().find(known).unwrap_or(0);
            let sign = signs.get(path.get(..=end).unwrap_or(&[]));
            match sign {
                Some(from) if path[..=end] != from[..] => {
                    path = [from, &path[end + 1..]].concat();
                }
                _ => return path[..end].join("::"),
            }
        }
        String::new()
    };
    let mut dependencies = BTreeMap::new();
    for (module, all) in imports.iter().filter(|(module, _)| !module.is_empty()) {
        let targets = all.iter().filter(|(_, sign)| !sign);
        let targets = targets.map(|(path, _)| target(path));
        let targets = targets.filter(|other| !other.is_empty() && other != *module);
        dependencies.insert((*module).clone(), targets.collect());
    }
    dependencies
}

fn reachable<'a>(
    from: &'a str,
    dependencies: &'a BTreeMap<String, BTreeSet<String>>,
) -> BTreeSet<&'a str> {
    let mut seen = BTreeSet::new();
    let mut open = vec![from];
    while let Some(module) = open.pop() {
        for other in dependencies.get(module).into_iter().flatten() {
            if seen.insert(&**other) {
                open.push(other);
            }
        }
    }
    seen
}

/// Modules of the solver can be read independently: an import cycle has at most three members.
#[test]
fn the_solver_has_no_import_cycle_of_more_than_three_modules() {
    let dependencies = dependencies(&solver_modules());
    let count: usize = dependencies.values().map(BTreeSet::len).sum();
    assert!(count > 200, "only {count} dependencies: the scan is broken");
    let reach: BTreeMap<&str, _> = dependencies
        .keys()
        .map(|module| (&**module, reachable(module, &dependencies)))
        .collect();
    for (module, known) in &reach {
        let cycle: Vec<_> = known
            .iter()
            .filter(|other| reach.get(**other).is_some_and(|back| back.contains(module)))
            .collect();
        assert!(cycle.len() <= 3, "{module}: {cycle:?}");
    }
}
