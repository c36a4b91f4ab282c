//! Contracts about the source: which operations the solver may use, and which module may depend on
//! which.

use proc_macro2::{TokenStream, TokenTree};
use std::{
    cmp::Reverse,
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
    process::Command,
};
use syn::{
    ItemMod, ItemUse, Macro, UseTree, Visibility, parse_quote,
    visit::{self, Visit},
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
    ("src", 1500, &[24, 4]),
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
pub fn code(text: &str) -> impl Iterator<Item = &str> {
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

/// The path of a module or an item in its package: `["effects", "bend", "Bend"]`.
type Name = Vec<String>;

/// The modules of a package, in files and in braces, without tests.
#[derive(Default)]
struct Package {
    modules: BTreeMap<Name, Module>,
    files: BTreeSet<Name>,
    /// The module that is being read.
    at: Name,
}

#[derive(Default)]
struct Module {
    /// What it imports, each by its name here, and whether that is also an export.
    imports: BTreeMap<String, (Name, bool)>,
    /// Modules of which it imports everything.
    globs: Vec<Name>,
    /// Paths in its code, and the first word of each and of shorter ones.
    paths: Vec<Name>,
    words: BTreeSet<String>,
}

impl Package {
    fn read(folder: &Path) -> Self {
        let all = files(folder).into_iter().map(|(path, text)| {
            let path = path
                .strip_prefix(folder)
                .expect("below it")
                .with_extension("");
            let parts = path.iter().map(|part| part.to_string_lossy().into_owned());
            (
                parts
                    .filter(|part| part != "mod" && part != "lib")
                    .collect(),
                text,
            )
        });
        Self::of(all)
    }

    /// From its files.
    fn of(files: impl IntoIterator<Item = (Name, String)>) -> Self {
        let mut package = Self::default();
        for (name, text) in files {
            let file = syn::parse_file(&text).unwrap_or_else(|error| panic!("{name:?}: {error}"));
            package.files.insert(name.clone());
            package.modules.insert(name.clone(), Module::default());
            package.at = name;
            package.visit_file(&file);
        }
        package
    }

    fn here(&mut self) -> &mut Module {
        self.modules.entry(self.at.clone()).or_default()
    }

    /// A path in the module that is being read, from the root.
    fn absolute(&self, path: &[String]) -> Name {
        let mut at = self.at.clone();
        for part in path {
            match part.as_str() {
                "crate" => at.clear(),
                "self" => {}
                "super" => drop(at.pop()),
                _ => at.push(part.clone()),
            }
        }
        at
    }

    fn name(&mut self, path: &[String]) {
        let absolute = self.absolute(path);
        self.here().words.extend(path.first().cloned());
        if path.len() > 1 {
            self.here().paths.push(absolute);
        }
    }

    fn import(&mut self, tree: &UseTree, path: &[String], is_export: bool) {
        let longer = |word: &dyn ToString| [path, &[word.to_string()]].concat();
        let (path, alias) = match tree {
            UseTree::Path(tree) => return self.import(&tree.tree, &longer(&tree.ident), is_export),
            UseTree::Group(group) => {
                let items = group.items.iter();
                return items.for_each(|item| self.import(item, path, is_export));
            }
            UseTree::Glob(_) => {
                let all = self.absolute(path);
                return self.here().globs.push(all);
            }
            UseTree::Name(name) if name.ident == "self" => (path.to_vec(), path.last().cloned()),
            UseTree::Name(name) => (longer(&name.ident), Some(name.ident.to_string())),
            UseTree::Rename(name) => (longer(&name.ident), Some(name.rename.to_string())),
        };
        let import = (self.absolute(&path), is_export);
        self.here()
            .imports
            .extend(alias.map(|alias| (alias, import)));
    }

    /// Names the paths in the code of a macro.
    fn tokens(&mut self, tokens: TokenStream) {
        let (mut path, mut colons) = (Name::new(), 0);
        for token in tokens {
            let is_longer = colons == 2;
            match token {
                TokenTree::Punct(punct) if punct.as_char() == ':' => {
                    colons += 1;
                    continue;
                }
                TokenTree::Ident(word) if is_longer => path.push(word.to_string()),
                TokenTree::Ident(word) => {
                    self.name(&path);
                    path = vec![word.to_string()];
                }
                TokenTree::Group(group) => self.tokens(group.stream()),
                _ => {}
            }
            colons = 0;
        }
        self.name(&path);
    }

    /// The module that defines what a path names, as far as it is in the package and re-exports lead
    /// there in so many steps.
    fn origin(&self, path: &[String], steps: usize) -> Option<&[String]> {
        let known = |end| self.modules.get_key_value(&path[..end]);
        let (at, module) = (0..=path.len()).rev().find_map(known)?;
        let Some((name, rest)) = path[at.len()..].split_first() else {
            return Some(at);
        };
        let steps = steps.checked_sub(1)?;
        let import = module.imports.get(name).map(|(from, _)| from);
        if let Some(from) = import.filter(|from| !from.starts_with(&path[..=at.len()])) {
            return self.origin(&[&from[..], rest].concat(), steps);
        }
        let mut globs = module.globs.iter().filter(|all| *all != at);
        let through = globs.find_map(|all| {
            let found = self.origin(&[&all[..], &path[at.len()..]].concat(), steps);
            found.filter(|found| !found.is_empty() && *found != all)
        });
        through.or(Some(at))
    }

    /// The files that each file imports, other than to re-export them; the root is not a file here.
    fn dependencies(&self) -> BTreeMap<Name, BTreeSet<Name>> {
        let file = |module: &[String]| {
            let mut parents = (1..=module.len()).rev().map(|end| &module[..end]);
            parents
                .find(|parent| self.files.contains(*parent))
                .map(<[_]>::to_vec)
        };
        let mut all = BTreeMap::<_, BTreeSet<_>>::new();
        for (at, module) in &self.modules {
            let Some(own) = file(at) else { continue };
            let imports = module.imports.iter();
            let imports =
                imports.filter(|(name, (_, is_export))| !is_export || module.words.contains(*name));
            let imports = imports.map(|(_, (from, _))| from);
            let paths = imports.chain(&module.paths).chain(&module.globs);
            let origins = paths.filter_map(|path| file(self.origin(path, 8)?));
            let others = origins.filter(|other| *other != own);
            all.entry(own.clone()).or_default().extend(others);
        }
        all
    }
}

impl<'ast> Visit<'ast> for Package {
    fn visit_item_mod(&mut self, item: &'ast ItemMod) {
        if item.content.is_some() && !item.attrs.contains(&parse_quote!(#[cfg(test)])) {
            self.at.push(item.ident.to_string());
            self.here();
            visit::visit_item_mod(self, item);
            self.at.pop();
        }
    }

    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        self.import(&item.tree, &[], !matches!(item.vis, Visibility::Inherited));
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let words = path.segments.iter().map(|part| part.ident.to_string());
        self.name(&words.collect::<Vec<_>>());
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, item: &'ast Macro) {
        self.tokens(item.tokens.clone());
    }

    /// `pub(in path)` is no import.
    fn visit_visibility(&mut self, _: &'ast Visibility) {}
}

/// A file imports what it names by a path or in a macro, from where re-exports lead.
#[test]
fn imports_are_found_through_re_exports_paths_and_macros() {
    let files = [
        ("", "pub use low::all::*;\npub use high::High;"),
        (
            "low",
            "pub(crate) mod all {\n    pub use super::super::bend::Bend;\n}",
        ),
        (
            "bend",
            "pub struct Bend;\n#[cfg(test)]\nmod tests {\n    use crate::High;\n}",
        ),
        (
            "high",
            "pub use crate::low;\nuse crate::Bend as B;\npub struct High;",
        ),
        ("path", "fn f() -> crate::High {\n    todo!()\n}"),
        ("tokens", "print!(\"{}\", crate::high::High);"),
    ];
    let name = |text: &str| {
        text.split_terminator("::")
            .map(str::to_owned)
            .collect::<Name>()
    };
    let package = Package::of(files.map(|(at, text)| (name(at), text.to_owned())));
    let found = package.dependencies();
    let found: Vec<_> = found
        .iter()
        .map(|(from, to)| (from.join("::"), to.iter().flatten().collect::<Vec<_>>()))
        .collect();
    let expected = [
        ("bend", ""),
        ("high", "bend"),
        ("low", ""),
        ("path", "high"),
        ("tokens", "high"),
    ];
    for ((from, to), (file, imports)) in found.iter().zip(expected) {
        assert_eq!((from.as_str(), to), (file, &name(imports).iter().collect()));
    }
    assert_eq!(found.len(), expected.len());
}
