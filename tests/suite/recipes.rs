//! The recipes of `docs/choosing-parameters.md`: each scene in `assets/recipes` runs, is accepted, and
//! is converged, and the page quotes these scenes and `examples/recipes.rs` to the letter.

use pliant::{
    output::warnings::warnings,
    scene::{Scene, run::run},
};
use rayon::prelude::*;
use std::{
    fs,
    path::{Path, PathBuf},
};

/// The page.
const PAGE: &str = "docs/choosing-parameters.md";

/// Its examples in Rust.
const EXAMPLE: &str = "examples/recipes.rs";

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The scene files, in the order of their names.
fn recipes() -> Vec<PathBuf> {
    let entries = fs::read_dir(path("assets/recipes")).expect("a folder of the project");
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| entry.expect("a readable folder").path())
        .collect();
    paths.sort();
    paths
}

/// File name of a recipe.
fn name(path: &Path) -> &str {
    let name = path.file_name().and_then(|name| name.to_str());
    name.expect("names of recipes are in ASCII")
}

/// Lines without their indentation, each with a line break.
fn trimmed(text: &str) -> String {
    text.lines()
        .map(|line| format!("{}\n", line.trim()))
        .collect()
}

/// The blocks of a page in a language, without indentation.
fn blocks(page: &str, language: &str) -> Vec<String> {
    let begin = format!("\n```{language}\n");
    page.split(&begin)
        .skip(1)
        .map(|rest| {
            let (block, _) = rest.split_once("\n```").expect("the block ends");
            trimmed(block)
        })
        .collect()
}

#[test]
fn every_recipe_is_accepted_and_converged() {
    let paths = recipes();
    assert!(paths.len() >= 12, "{paths:?}");
    let found: Vec<String> = paths.par_iter().flat_map_iter(|it| problems(it)).collect();
    assert!(found.is_empty(), "\n{}\n", found.join("\n"));
}

/// What is wrong with a recipe, one sentence each.
fn problems(path: &Path) -> Vec<String> {
    let name = name(path);
    let scene = Scene::parse(name, &read(path)).expect("a sound scene");
    let checks = &scene.acceptance.checks;
    let built = scene.build().expect("a sound scene");
    let done = run(&built, &scene.run_options(), |_| ()).expect("nothing is overridden");
    let mut problems = done.reasons.clone();
    if checks.is_empty() {
        problems.push("states no figures".to_owned());
    }
    problems.extend(warnings(&done));
    problems.extend(done.notes.iter().cloned());
    let last = done.history.last().expect("it has a first row");
    if !last.energy().is_finite() {
        problems.push(format!("its energy is {} J", last.energy()));
    }
    let bodies = done.world.bodies.iter();
    let paused = bodies.filter(|body| body.quarantine.is_some());
    problems.extend(paused.map(|body| format!("{} is in quarantine", body.name)));
    let named = |problem: String| format!("{name}: {problem}");
    problems.into_iter().map(named).collect()
}

#[test]
fn the_page_names_every_recipe() {
    let page = read(&path(PAGE));
    for recipe in recipes() {
        let line = format!("`assets/recipes/{}`", name(&recipe));
        assert!(page.contains(&line), "{PAGE} does not name {line}");
    }
}

#[test]
fn the_page_quotes_the_recipes_to_the_letter() {
    let page = read(&path(PAGE));
    let files: Vec<String> = recipes().iter().map(|it| trimmed(&read(it))).collect();
    let blocks = blocks(&page, "ron");
    assert_eq!(blocks.len(), files.len(), "blocks of RON in {PAGE}");
    for block in blocks {
        let quotes = files.iter().any(|file| file.contains(&block));
        assert!(quotes, "no recipe has these lines of {PAGE}:\n{block}");
    }
}

#[test]
fn the_page_quotes_the_example_to_the_letter() {
    let page = read(&path(PAGE));
    let example = trimmed(&read(&path(EXAMPLE)));
    let blocks = blocks(&page, "rust");
    assert_eq!(blocks.len(), recipes().len(), "blocks of Rust in {PAGE}");
    for block in blocks {
        let quotes = example.contains(&block);
        assert!(quotes, "{EXAMPLE} lacks these lines of {PAGE}:\n{block}");
    }
}
