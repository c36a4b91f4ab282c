//! The modules of a package, as the source has them: what they define, import and export.

use crate::contract_layers::files;
use proc_macro2::{TokenStream, TokenTree};
use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};
use syn::{
    Block, Item, ItemMod, ItemUse, Macro, UseTree, Visibility, parse_quote,
    visit::{self, Visit},
};

/// The path of a module or an item in its package: `["effects", "bend", "Bend"]`.
pub type Name = Vec<String>;

/// The modules of a package, in files and in braces, without tests.
#[derive(Default)]
pub struct Package {
    pub modules: BTreeMap<Name, Module>,
    files: BTreeSet<Name>,
    /// The module that is being read.
    at: Name,
}

#[derive(Default)]
pub struct Module {
    /// What it defines, and whether that is public.
    pub items: BTreeMap<String, bool>,
    /// What it imports, by its name here.
    pub imports: BTreeMap<String, Import>,
    /// Modules of which it imports everything.
    pub globs: Vec<Import>,
    /// Paths in its code, and the first word of each and of shorter ones.
    paths: Vec<Name>,
    words: BTreeSet<String>,
}

pub struct Import {
    /// From the root of the package, or the path of another.
    pub path: Name,
    /// Whether it is also an export to other modules, and to other packages.
    is_export: bool,
    pub is_public: bool,
}

impl Package {
    pub fn read(folder: &Path) -> Self {
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
    pub fn of(files: impl IntoIterator<Item = (Name, String)>) -> Self {
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

    fn import(&mut self, tree: &UseTree, path: &[String], visibility: &Visibility) {
        let longer = |word: &dyn ToString| [path, &[word.to_string()]].concat();
        let (path, alias) = match tree {
            UseTree::Path(tree) => {
                return self.import(&tree.tree, &longer(&tree.ident), visibility);
            }
            UseTree::Group(group) => {
                let items = group.items.iter();
                return items.for_each(|item| self.import(item, path, visibility));
            }
            UseTree::Glob(_) => (path.to_vec(), None),
            UseTree::Name(name) if name.ident == "self" => (path.to_vec(), path.last().cloned()),
            UseTree::Name(name) => (longer(&name.ident), Some(name.ident.to_string())),
            UseTree::Rename(name) => (longer(&name.ident), Some(name.rename.to_string())),
        };
        let import = Import {
            path: self.absolute(&path),
            is_export: !matches!(visibility, Visibility::Inherited),
            is_public: matches!(visibility, Visibility::Public(_)),
        };
        match alias {
            Some(alias) => drop(self.here().imports.insert(alias, import)),
            None => self.here().globs.push(import),
        }
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

    /// The path under which an item or a module is defined, after re-exports by name.
    pub fn definition(&self, path: &[String]) -> Name {
        let known = |end| self.modules.get_key_value(&path[..end]);
        let found = (0..path.len()).rev().find_map(known);
        let followed = found.and_then(|(at, module)| {
            let (named, rest) = path.split_at(at.len() + 1);
            // A module may have a function of its name.
            let into = module
                .imports
                .get(&path[at.len()])
                .filter(|_| self.modules.contains_key(named));
            let into = into.map(|it| &it.path[..]).filter(|it| *it != named);
            Some([into.or(module.followed(named))?, rest].concat())
        });
        followed.map_or(path.to_vec(), |path| self.definition(&path))
    }

    /// The module that defines what a path names, as far as it is in the package and at most `steps`
    /// re-exports lead there.
    fn origin(&self, path: &[String], steps: usize) -> Option<&[String]> {
        let known = |end| self.modules.get_key_value(&path[..end]);
        let (at, module) = (0..=path.len()).rev().find_map(known)?;
        let Some((_, rest)) = path[at.len()..].split_first() else {
            return Some(at);
        };
        let steps = steps.checked_sub(1)?;
        if let Some(from) = module.followed(&path[..=at.len()]) {
            return self.origin(&[from, rest].concat(), steps);
        }
        let mut globs = module
            .globs
            .iter()
            .map(|it| &it.path)
            .filter(|all| *all != at);
        let through = globs.find_map(|all| {
            let found = self.origin(&[&all[..], &path[at.len()..]].concat(), steps);
            found.filter(|found| !found.is_empty() && *found != all)
        });
        through.or(Some(at))
    }

    /// The files that each file imports, other than to re-export them; the root is not a file here.
    pub fn dependencies(&self) -> BTreeMap<Name, BTreeSet<Name>> {
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
                imports.filter(|(name, it)| !it.is_export || module.words.contains(*name));
            let imports = imports.map(|(_, it)| it).chain(&module.globs);
            let paths = imports.map(|it| &it.path).chain(&module.paths);
            let origins = paths.filter_map(|path| file(self.origin(path, 8)?));
            let others = origins.filter(|other| *other != own);
            all.entry(own.clone()).or_default().extend(others);
        }
        all
    }
}

impl Module {
    /// Where an import of it leads that is named by a path: not if it is of the same name.
    fn followed(&self, path: &[String]) -> Option<&[String]> {
        let import = self.imports.get(path.last()?)?;
        (!import.path.starts_with(path)).then_some(&import.path)
    }
}

impl<'ast> Visit<'ast> for Package {
    fn visit_item(&mut self, item: &'ast Item) {
        let defined = match item {
            Item::Const(it) => Some((&it.ident, &it.vis)),
            Item::Enum(it) => Some((&it.ident, &it.vis)),
            Item::Fn(it) => Some((&it.sig.ident, &it.vis)),
            Item::Mod(it) => Some((&it.ident, &it.vis)),
            Item::Static(it) => Some((&it.ident, &it.vis)),
            Item::Struct(it) => Some((&it.ident, &it.vis)),
            Item::Trait(it) => Some((&it.ident, &it.vis)),
            Item::Type(it) => Some((&it.ident, &it.vis)),
            Item::Union(it) => Some((&it.ident, &it.vis)),
            _ => None,
        };
        let defined = defined.map(|(name, visibility)| {
            (
                name.to_string(),
                matches!(visibility, Visibility::Public(_)),
            )
        });
        self.here().items.extend(defined);
        visit::visit_item(self, item);
    }

    /// What a function defines within itself is no item of its module.
    fn visit_block(&mut self, block: &'ast Block) {
        let items = std::mem::take(&mut self.here().items);
        visit::visit_block(self, block);
        self.here().items = items;
    }

    fn visit_item_mod(&mut self, item: &'ast ItemMod) {
        if item.content.is_some() && !item.attrs.contains(&parse_quote!(#[cfg(test)])) {
            self.at.push(item.ident.to_string());
            self.here();
            visit::visit_item_mod(self, item);
            self.at.pop();
        }
    }

    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        self.import(&item.tree, &[], &item.vis);
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
