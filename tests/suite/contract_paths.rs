//! Contract about the names of the libraries: each public item has one path.
//!
//! The sources are read, as what rustdoc writes for programs needs a nightly compiler. Items and
//! re-exports that a macro makes are not seen, such as those of the effects, which are in `effect` and in
//! `solver` on purpose.

use crate::{
    contract_layers::root,
    modules::{Import, Name, Package},
};
use std::collections::{BTreeMap, BTreeSet};

/// Modules whose names are a second path by intention.
const SECOND: &str = "prelude";

/// The modules of the window are public for its tests only.
const WINDOW: &str = "sandbox";

/// All public paths of each public item and module, by where it is defined.
fn public_paths(package: &Package) -> BTreeMap<Name, BTreeSet<String>> {
    let mut found = BTreeMap::new();
    visit(package, (String::new(), &Name::new()), &mut found);
    found
}

fn visit(
    package: &Package,
    (path, module): (String, &Name),
    found: &mut BTreeMap<Name, BTreeSet<String>>,
) {
    let here = &package.modules[module];
    let own = here.items.iter().filter(|(_, is_public)| **is_public);
    let own = own.map(|(name, _)| (name, [&module[..], std::slice::from_ref(name)].concat()));
    let others = here.imports.iter().filter(|(_, it)| it.is_public);
    let others = others.map(|(name, it)| (name, package.definition(&it.path)));
    for (name, origin) in own.chain(others) {
        if name == SECOND || name == WINDOW {
            continue;
        }
        let public = joined(&path, name);
        let paths = found.entry(origin.clone()).or_default();
        let is_new = paths.insert(public.clone());
        // Another package that is re-exported as a whole has its own paths.
        let whole = |(_, it): &(_, &Import)| it.is_public && it.path[..] == origin[..1];
        let mut packages = package.modules[&Name::new()].imports.iter();
        if let Some((alias, _)) = packages.find(whole).filter(|_| origin.len() > 1) {
            paths.insert(joined(alias, &origin[1..].join("::")));
        }
        if is_new && package.modules.contains_key(&origin) {
            visit(package, (public, &origin), found);
        }
    }
}

/// Items with several paths, among them all of a public module that are re-exported.
fn ambiguous(package: &Package) -> Vec<BTreeSet<String>> {
    let all = public_paths(package);
    let globs = package.modules.values().flat_map(|it| &it.globs);
    let open = globs.filter(|it| it.is_public && all.contains_key(&it.path));
    let open = open.map(|it| it.path.join("::"));
    let open = open.map(|module| BTreeSet::from([format!("{module}::*"), module]));
    let two = all.values().filter(|paths| paths.len() > 1).cloned();
    two.chain(open).collect()
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
        let package = Package::read(&root().join(folder));
        let count = public_paths(&package).len();
        assert!(
            count > least,
            "{folder}: only {count} items; the scan is broken"
        );
        let ambiguous = ambiguous(&package);
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
        let name = |path: &str| path.split_terminator("::").map(str::to_owned).collect();
        let all = others.iter().copied().chain([("", root)]);
        ambiguous(&Package::of(
            all.map(|(path, text)| (name(path), text.to_owned())),
        ))
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
