//! Contract about the names of the libraries: each public item has one path.
//!
//! The sources are read, as what rustdoc writes for programs needs a nightly compiler. Items and
//! re-exports that a macro makes are not seen, such as those of the effects, which are in `effect` and in
//! `solver` on purpose.

use crate::contract_layers::{code, files, root};
use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

/// Modules whose names are a second path by intention.
const SECOND: &str = "prelude";

/// The modules of the window are public for its tests only.
const WINDOW: &str = "sandbox";

/// The names in a module.
#[derive(Debug, Default)]
struct Module {
    /// Public modules in it.
    modules: Vec<String>,
    /// Public items that it defines.
    items: Vec<String>,
    /// Names that it imports, each with its path as written, and whether it is re-exported.
    imports: BTreeMap<String, (String, bool)>,
    /// Modules all of whose items it re-exports.
    globs: Vec<String>,
}

impl Module {
    fn of(text: &str) -> Self {
        let mut module = Self::default();
        let text: Vec<_> = code(text).collect();
        for (number, line) in text.iter().enumerate() {
            let words: Vec<_> = line.split_whitespace().collect();
            match words[..] {
                // What is indented belongs to a function, a macro or a test.
                _ if line.starts_with(' ') => {}
                ["pub", "mod", name] if name.ends_with(';') => {
                    module.modules.push(name.trim_end_matches(';').to_owned());
                }
                ["use", ..] | ["pub", "use", ..] | ["pub(crate)" | "pub(super)", "use", ..] => {
                    let whole = text[number..].join("\n");
                    let tree = whole.split(';').next().unwrap_or("");
                    let tree = tree.split_once("use ").map_or("", |(_, tree)| tree);
                    for path in aliased(tree) {
                        module.import(path, words[0] == "pub");
                    }
                }
                ["pub", "mod", ..] => {}
                ["pub", ref rest @ ..] => module.items.extend(defined(rest)),
                _ => {}
            }
        }
        module
    }

    fn is_exported(&self, name: &str) -> bool {
        self.imports
            .get(name)
            .is_some_and(|(_, exported)| *exported)
    }

    fn import(&mut self, (name, path): (String, String), exported: bool) {
        if exported && name == "*" {
            self.globs.push(path.trim_end_matches("::*").to_owned());
            return;
        }
        self.imports.insert(name, (path, exported));
    }
}

/// All paths in a use tree, as in `a::{b, c::d}`.
fn paths(tree: &str) -> Vec<String> {
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

/// The paths in a use tree, each with the name by which it is imported.
fn aliased(tree: &str) -> Vec<(String, String)> {
    if let Some((path, name)) = tree.split_once(" as ").filter(|_| !tree.contains('{')) {
        return vec![(name.trim().to_owned(), path.trim().to_owned())];
    }
    let named = |path: String| {
        let path = path.trim_end_matches("::self").to_owned();
        let name = path.rsplit("::").next().unwrap_or("").to_owned();
        (name, path)
    };
    paths(tree).into_iter().map(named).collect()
}

/// The name of an item from the words after `pub`.
fn defined(words: &[&str]) -> Option<String> {
    const KINDS: [&str; 8] = [
        "const", "enum", "fn", "static", "struct", "trait", "type", "union",
    ];
    // `const fn` is a function.
    let mut words = words
        .iter()
        .skip_while(|word| ["async", "const", "unsafe"].contains(word));
    let name = match words.next()? {
        kind if KINDS.contains(kind) => words.next()?,
        name => name,
    };
    let end = name.find(|c: char| !c.is_alphanumeric() && c != '_');
    Some(name[..end.unwrap_or(name.len())].to_owned())
}

/// A library: its modules by path, with that of the root empty.
struct Library(BTreeMap<String, Module>);

impl Library {
    fn read(folder: &Path) -> Self {
        let modules = files(folder).into_iter().map(|(path, text)| {
            let path = path.strip_prefix(folder).expect("below it");
            let path = path.with_extension("");
            let parts = path.iter().map(|part| part.to_string_lossy().into_owned());
            let parts: Vec<_> = parts.filter(|it| it != "mod" && it != "lib").collect();
            (parts.join("::"), Module::of(&text))
        });
        Self(modules.collect())
    }

    /// The absolute path of what a module names by a path; that of another package is left as it is.
    fn absolute(&self, module: &str, path: &str) -> String {
        let mut at: Vec<_> = module.split("::").filter(|it| !it.is_empty()).collect();
        let mut parts = path.split("::").peekable();
        match parts.peek().copied() {
            Some("crate") => {
                parts.next();
                at.clear();
            }
            Some("self" | "super") => {
                parts.next_if_eq(&"self");
            }
            Some(first) => {
                let here = &self.0[module];
                let import = here.imports.get(first).map(|(other, _)| other);
                // A name that begins with itself is of a module or of another package.
                if let Some(other) = import.filter(|it| it.split("::").next() != Some(first)) {
                    let rest = path.strip_prefix(first).unwrap_or("");
                    return self.absolute(module, &format!("{other}{rest}"));
                }
                if !self.0.contains_key(&joined(module, first)) {
                    return path.to_owned();
                }
            }
            None => {}
        }
        while parts.next_if_eq(&"super").is_some() {
            at.pop();
        }
        at.extend(parts);
        at.join("::")
    }

    /// Where an item is defined that is named by an absolute path, after re-exports.
    fn origin(&self, path: String) -> String {
        let (module, name) = path.rsplit_once("::").unwrap_or(("", &path));
        let import = self.0.get(module).and_then(|it| it.imports.get(name));
        match import.map(|(other, _)| self.absolute(module, other)) {
            Some(other) if other != path => self.origin(other),
            _ => path,
        }
    }

    /// All public paths of each public item and module, by its origin.
    fn public_paths(&self) -> BTreeMap<String, BTreeSet<String>> {
        let mut found = BTreeMap::new();
        self.visit("", "", &mut found);
        found
    }

    fn visit(&self, path: &str, module: &str, found: &mut BTreeMap<String, BTreeSet<String>>) {
        let here = &self.0[module];
        let own = here.modules.iter().chain(&here.items);
        let own = own.map(|name| (name, joined(module, name)));
        let others = here.imports.iter().filter(|(_, (_, exported))| *exported);
        let others = others.map(|(name, (other, _))| {
            let origin = self.origin(self.absolute(module, other));
            (name, origin)
        });
        for (name, origin) in own.chain(others) {
            if name == SECOND || name == WINDOW {
                continue;
            }
            let public = joined(path, name);
            let paths = found.entry(origin.clone()).or_default();
            let is_new = paths.insert(public.clone());
            // Another package that is re-exported as a whole has its own paths.
            let package = origin.split("::").next().unwrap_or("");
            if !module.is_empty() && self.0[""].is_exported(package) {
                paths.insert(origin.clone());
            }
            if is_new && self.0.contains_key(&origin) {
                self.visit(&public, &origin, found);
            }
        }
    }

    /// Items with several paths, among them all of a public module that are re-exported.
    fn ambiguous(&self) -> Vec<BTreeSet<String>> {
        let all = self.public_paths();
        let globs = self.0.iter().flat_map(|(module, it)| {
            let each = it.globs.iter();
            each.map(|path| self.absolute(module, path))
        });
        let open = globs.filter(|module| all.contains_key(module));
        let open = open.map(|module| BTreeSet::from([format!("{module}::*"), module]));
        let two = all.values().filter(|paths| paths.len() > 1).cloned();
        two.chain(open).collect()
    }
}

fn joined(module: &str, name: &str) -> String {
    match module {
        "" => name.to_owned(),
        _ => format!("{module}::{name}"),
    }
}

/// Preludes and the components of effects aside, an item is documented in one place, is imported in
/// one way, and two paths in an error message are two items.
#[test]
fn every_public_item_has_one_path() {
    // Far fewer would mean that the sources are not understood.
    for (folder, least) in [
        ("src", 300),
        ("crates/mesh/src", 25),
        ("crates/solver/src", 300),
    ] {
        let library = Library::read(&root().join(folder));
        let count = library.public_paths().len();
        assert!(
            count > least,
            "{folder}: only {count} items; the scan is broken"
        );
        let ambiguous = library.ambiguous();
        assert!(
            ambiguous.is_empty(),
            "{folder}: make the module private, or drop the re-export:\n{ambiguous:#?}"
        );
    }
}

/// Of each kind of second path there is one here.
#[test]
fn second_paths_are_found() {
    let ambiguous = |root: &str, others: &[(&str, &str)]| {
        let all = others.iter().copied().chain([("", root)]);
        let all = all.map(|(path, text)| (path.to_owned(), Module::of(text)));
        Library(all.collect()).ambiguous()
    };
    let set = |paths: &[&str]| {
        paths
            .iter()
            .map(|&it| it.to_owned())
            .collect::<BTreeSet<_>>()
    };
    let shape = ("shape", "pub struct Shape {\n    pub size: f32,\n}\n");
    assert!(ambiguous("mod shape;\npub use shape::Shape;", &[shape]).is_empty());
    let (short, long) = ("Shape", "shape::Shape");
    let two = [set(&[short, long])];
    assert_eq!(
        ambiguous("pub mod shape;\npub use shape::{Other, Shape};", &[shape]),
        two
    );
    assert_eq!(
        ambiguous(
            "pub mod shape;\nmod inner;\npub use inner::Shape;",
            &[shape, ("inner", "pub use super::shape::Shape;")]
        ),
        two
    );
    assert_eq!(
        ambiguous(
            "mod shape;\npub use shape::Shape;\npub use shape::Shape as Form;",
            &[shape]
        ),
        [set(&["Form", short])]
    );
    // The items of a module that is public twice, and the module.
    assert_eq!(
        ambiguous(
            "pub mod a;\npub use a::shape;",
            &[("a", "pub mod shape;"), ("a::shape", shape.1)]
        ),
        [set(&["a::shape", "shape"]), set(&["a::shape::Shape", long])]
    );
    // An item of a package that is re-exported as a whole.
    assert_eq!(
        ambiguous(
            "pub use pliant_solver as solver;\npub mod shape;",
            &[(
                "shape",
                "pub use crate::solver::{\n    Body,\n    kernel,\n};"
            )]
        ),
        [
            set(&["shape::Body", "solver::Body"]),
            set(&["shape::kernel", "solver::kernel"])
        ]
    );
    // A function of the name of its module.
    let modules = [
        ("a", "mod work;\npub use work::work;"),
        ("a::work", "pub fn work() {}"),
    ];
    assert!(ambiguous("mod a;\npub use a::work;\npub const fn most() {}", &modules).is_empty());
}
