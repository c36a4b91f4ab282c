//! Contract about the documentation: each type that one starts with has an example.

use crate::contract_layers::{files, root};
use std::{collections::BTreeMap, fs};

/// Quantities are rows of a table, whose example is that of their module.
const QUANTITIES: &str = "quantity.rs";

/// The names that the prelude exports.
fn prelude() -> Vec<String> {
    let text = fs::read_to_string(root().join("src/prelude.rs")).expect("it is there");
    let (_, exports) = text.split_once("pub use").expect("it exports names");
    let words = exports.split(|c: char| !c.is_alphanumeric() && c != '_');
    let names = words.filter(|word| word.starts_with(char::is_uppercase));
    names.map(str::to_owned).collect()
}

/// Names of public types, each with whether its documentation has an example.
fn documented() -> BTreeMap<String, bool> {
    let mut types = BTreeMap::new();
    for folder in ["src", "crates/solver/src"] {
        for (_, text) in files(&root().join(folder)) {
            let lines: Vec<_> = text.lines().map(str::trim_start).collect();
            for (number, line) in lines.iter().enumerate() {
                let words: Vec<_> = line.split(|c: char| !c.is_alphanumeric()).collect();
                let name = match words[..] {
                    ["pub", "struct" | "enum" | "trait", name, ..] => name,
                    // One that a macro defines: a name alone, after its documentation.
                    [name] if name.starts_with(char::is_uppercase) => name,
                    _ => continue,
                };
                let above = lines[..number].iter().rev().take_while(|it| !it.is_empty());
                let has_example = above.clone().any(|it| it.starts_with("/// ```"));
                *types.entry(name.to_owned()).or_default() |= has_example;
            }
        }
    }
    let quantities = root().join("crates/solver/src").join(QUANTITIES);
    let quantities = fs::read_to_string(quantities).expect("readable");
    for line in quantities.lines() {
        if let Some((name, _)) = line.trim_start().split_once('(')
            && name.starts_with(char::is_uppercase)
            && name.chars().all(char::is_alphanumeric)
        {
            types.insert(name.to_owned(), true);
        }
    }
    types
}

#[test]
fn each_type_of_the_prelude_has_an_example() {
    let documented = documented();
    let names = prelude();
    assert!(names.len() > 40, "{names:?}");
    let without = names
        .iter()
        .filter(|name| documented.get(*name) != Some(&true));
    let without: Vec<_> = without.collect();
    assert!(
        without.is_empty(),
        "without an example in their documentation: {without:?}"
    );
}
