//! The guide: its programs are examples, which are compiled; its scenes run and are accepted; the
//! links of all documents lead to files and headings that exist.

use crate::contract_layers::{files, root};
use pliant::scene::{Scene, run::run};
use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

/// The guide for the first minutes.
const GUIDE: &str = "docs/getting-started.md";

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The code blocks of the guide in a language, at least one.
fn blocks(language: &str) -> Vec<String> {
    let text = read(&root().join(GUIDE));
    let fence = format!("```{language}\n");
    let rests = text.split(fence.as_str()).skip(1);
    let blocks = rests.map(|rest| rest.split("```").next().unwrap_or(rest).trim().to_owned());
    let blocks: Vec<String> = blocks.collect();
    assert!(!blocks.is_empty(), "{GUIDE} has no block {fence}");
    blocks
}

#[test]
fn programs_of_the_guide_are_examples() {
    let examples = files(&root().join("examples"));
    for program in blocks("rust") {
        assert!(
            examples.iter().any(|(_, text)| text.trim() == program),
            "not the text of a file in examples/:\n{program}"
        );
    }
}

#[test]
fn scenes_of_the_guide_are_accepted() {
    for text in blocks("ron") {
        let scene = Scene::parse(GUIDE, &text).unwrap_or_else(|error| panic!("{error}\n{text}"));
        let built = scene
            .build()
            .unwrap_or_else(|error| panic!("{error}\n{text}"));
        let outcome = run(&built, &scene.run_options(), |_| ()).expect("nothing is overridden");
        assert!(outcome.accepted(), "{:?}\n{text}", outcome.reasons);
    }
}

/// Markdown files of a folder, recursively, without those of packages that are built there.
fn documents_in(folder: &Path) -> Vec<PathBuf> {
    let mut all = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder of the project") {
        let path = entry.expect("a readable folder").path();
        if path.is_dir() && !path.ends_with("target") {
            all.extend(documents_in(&path));
        } else if path.extension().is_some_and(|extension| extension == "md") {
            all.push(path);
        }
    }
    all
}

/// The documents of the project.
fn documents() -> Vec<PathBuf> {
    let files = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(|name| root().join(name));
    let folders = ["docs", "benches", "assets"].map(|name| documents_in(&root().join(name)));
    files.into_iter().chain(folders.concat()).collect()
}

/// Lines of a document outside of its code blocks.
fn prose(text: &str) -> impl Iterator<Item = &str> {
    let mut is_code = false;
    text.lines().filter(move |line| {
        let is_fence = line.trim_start().starts_with("```");
        is_code ^= is_fence;
        !is_code && !is_fence
    })
}

/// The anchor of a heading on GitHub: in lower case, with hyphens for spaces, without what is no
/// letter, digit, hyphen or underscore.
fn slug(heading: &str) -> String {
    let is_kept = |c: &char| c.is_alphabetic() || c.is_ascii_digit() || "-_ ".contains(*c);
    let lower = heading.to_lowercase();
    let kept = lower.chars().filter(is_kept);
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

/// The text of a heading, if the line is one.
fn heading(line: &str) -> Option<&str> {
    let text = line.trim_start_matches('#');
    let level = line.len() - text.len();
    let text = text.strip_prefix(' ')?.trim();
    (1..=6).contains(&level).then_some(text)
}

/// Anchors of the headings of a document. Of headings with the same text, all but the first are
/// numbered.
fn anchors(text: &str) -> BTreeSet<String> {
    let mut counts = BTreeMap::<String, u32>::new();
    let mut all = BTreeSet::new();
    for anchor in prose(text).filter_map(heading).map(slug) {
        let before = counts.entry(anchor.clone()).or_default();
        all.insert(match *before {
            0 => anchor,
            number => format!("{anchor}-{number}"),
        });
        *before += 1;
    }
    all
}

/// Targets of the links and pictures of a document.
fn targets(text: &str) -> Vec<&str> {
    fn target(rest: &str) -> &str {
        rest.split([')', ' ']).next().unwrap_or_default()
    }
    let rests = prose(text).flat_map(|line| line.split("](").skip(1));
    rests.map(target).collect()
}

/// What is wrong with a relative link in a document.
fn problem(document: &Path, target: &str) -> Option<&'static str> {
    let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
    let path = match file {
        "" => document.to_owned(),
        _ => document.parent().expect("a file is in a folder").join(file),
    };
    if !path.exists() {
        return Some("no such file");
    }
    let is_there = anchor.is_empty() || anchors(&read(&path)).contains(anchor);
    (!is_there).then_some("no such heading")
}

#[test]
fn links_of_the_documents_lead_to_files_and_headings() {
    let mut checked = 0;
    let mut broken = Vec::new();
    for document in documents() {
        let text = read(&document);
        for target in targets(&text) {
            if target.contains("://") || target.starts_with("mailto:") {
                continue;
            }
            checked += 1;
            if let Some(problem) = problem(&document, target) {
                broken.push(format!("{}: {target}: {problem}", document.display()));
            }
        }
    }
    assert!(broken.is_empty(), "\n{}\n", broken.join("\n"));
    assert!(checked > 200, "{checked} links were found");
}

/// Headings with code, with signs and letters that are not ASCII, and with the same text; a comment
/// in a code block is none.
#[test]
fn anchors_of_headings_are_those_of_github() {
    let text = "# What each effect costs\n```sh\n# a comment\n```\n### `self_contact`\n\
                ## Size: 10 µm, 2³ cells?\n#not a heading\n## Cost\n## Cost\n";
    let expected = [
        "cost",
        "cost-1",
        "self_contact",
        "size-10-µm-2-cells",
        "what-each-effect-costs",
    ];
    assert_eq!(anchors(text), BTreeSet::from(expected.map(str::to_owned)));
}

/// A page that opens with megabytes is not read where the net is slow.
#[test]
fn the_moving_picture_of_the_readme_is_small() {
    let film = fs::metadata(root().join("assets/readme/film.gif")).expect("it is there");
    assert!(film.len() <= 3_000_000, "{} bytes", film.len());
}
