//! The files of a package and their dependencies, from the sources. A re-export of a folder leads to the file
//! that defines the name.

use crate::floor_plan::rust_files;
use annulus_tests::root;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use syn::visit::{self, Visit};

/// The files of a package by module path: `["model", "link", "stop"]`.
pub(crate) type Modules = BTreeMap<Vec<String>, Names>;

/// Maximum number of `use` steps to follow, because re-exports can be circular.
const MOST_TURNS: usize = 8;

/// The module path of a file.
fn module_of(source: &Path, path: &Path) -> Vec<String> {
    let inside = path.strip_prefix(source).unwrap().with_extension("");
    let mut parts: Vec<String> =
        inside.components().map(|part| part.as_os_str().to_string_lossy().into_owned()).collect();
    if matches!(parts.last().map(String::as_str), Some("mod" | "lib" | "main")) {
        parts.pop();
    }
    parts
}

fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg")
            && attribute.parse_args::<syn::Ident>().is_ok_and(|ident| ident == "test")
    })
}

/// All paths in a file, the number of its statics, and its imports with their origin.
#[derive(Default)]
pub(crate) struct Names {
    /// All paths, segment by segment.
    pub(crate) paths: Vec<Vec<String>>,
    pub(crate) statics: usize,
    taken_in: BTreeMap<String, Vec<String>>,
}

impl Names {
    /// The names in a source, without tests.
    pub(crate) fn read(text: &str) -> Self {
        let mut names = Self::default();
        names.visit_file(&syn::parse_file(text).unwrap());
        names
    }

    fn tree(&mut self, before: &[String], tree: &syn::UseTree) {
        let with = |ident: &syn::Ident| before.iter().cloned().chain([ident.to_string()]).collect::<Vec<_>>();
        match tree {
            syn::UseTree::Path(path) => self.tree(&with(&path.ident), &path.tree),
            syn::UseTree::Name(name) => self.take_in(&name.ident, with(&name.ident)),
            syn::UseTree::Rename(name) => self.take_in(&name.rename, with(&name.ident)),
            syn::UseTree::Glob(_) => self.paths.push(before.to_vec()),
            syn::UseTree::Group(group) => group.items.iter().for_each(|item| self.tree(before, item)),
        }
    }

    fn take_in(&mut self, name: &syn::Ident, path: Vec<String>) {
        self.taken_in.insert(name.to_string(), path.clone());
        self.paths.push(path);
    }
}

impl<'ast> Visit<'ast> for Names {
    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        if !is_test(&item.attrs) {
            self.tree(&[], &item.tree);
        }
    }
    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        if !is_test(&item.attrs) {
            visit::visit_item_mod(self, item);
        }
    }
    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        if !is_test(&item.attrs) {
            visit::visit_item_fn(self, item);
        }
    }
    fn visit_item_impl(&mut self, item: &'ast syn::ItemImpl) {
        if !is_test(&item.attrs) {
            visit::visit_item_impl(self, item);
        }
    }
    fn visit_path(&mut self, path: &'ast syn::Path) {
        self.paths.push(path.segments.iter().map(|segment| segment.ident.to_string()).collect());
        visit::visit_path(self, path);
    }
    fn visit_item_static(&mut self, item: &'ast syn::ItemStatic) {
        self.statics += 1;
        visit::visit_item_static(self, item);
    }
    fn visit_item_macro(&mut self, item: &'ast syn::ItemMacro) {
        if item.mac.path.is_ident("thread_local") {
            self.statics += item.mac.tokens.to_string().matches("static ").count();
        }
        visit::visit_item_macro(self, item);
    }
}

/// Every file of a package with its names, without tests.
pub(crate) fn modules(source: &str) -> Modules {
    let source = root().join(source);
    let mut files = Vec::new();
    rust_files(&source, &mut files);
    assert!(files.len() > 10, "the sources were not found");
    let named = files
        .into_iter()
        .map(|path| (module_of(&source, &path), Names::read(&fs::read_to_string(&path).unwrap())));
    named
        .filter(|(module, _)| !module.iter().any(|part| part == "tests" || part == "browser_tests"))
        .collect()
}

/// The module of the package that `path`, used in `module`, leads to.
pub(crate) fn target<'a>(
    module: &[String],
    path: &[String],
    modules: &'a Modules,
) -> Option<&'a Vec<String>> {
    follow(module, path, modules, MOST_TURNS)
}

fn follow<'a>(
    module: &[String],
    path: &[String],
    modules: &'a Modules,
    turns: usize,
) -> Option<&'a Vec<String>> {
    let mut rest = path;
    let mut base: Vec<String> = match rest.first()?.as_str() {
        "crate" => Vec::new(),
        "super" | "self" => module.to_vec(),
        _ => {
            let child: Vec<String> = module.iter().chain(&rest[..1]).cloned().collect();
            if !modules.contains_key(&child) {
                return None;
            }
            module.to_vec()
        }
    };
    while let Some(first) = rest.first() {
        match first.as_str() {
            "crate" | "self" => {}
            "super" => drop(base.pop()),
            _ => break,
        }
        rest = &rest[1..];
    }
    while let Some((part, after)) = rest.split_first() {
        base.push(part.clone());
        if !modules.contains_key(&base) {
            base.pop();
            let from = modules.get(&base)?.taken_in.get(part).filter(|_| turns > 0);
            let whole = from.map(|from| from.iter().chain(after).cloned().collect::<Vec<_>>());
            let found = whole.and_then(|whole| follow(&base, &whole, modules, turns - 1));
            return found.or_else(|| modules.get_key_value(&base).map(|(found, _)| found));
        }
        rest = after;
    }
    modules.get_key_value(&base).map(|(found, _)| found)
}

/// Dependencies between files. A folder and the files in it belong together, so those don't count.
fn arrows(modules: &Modules) -> BTreeMap<&Vec<String>, BTreeSet<&Vec<String>>> {
    modules
        .iter()
        .map(|(module, names)| {
            let to = names.paths.iter().filter_map(|path| target(module, path, modules));
            let beside = |to: &&Vec<String>| !to.starts_with(module) && !module.starts_with(to);
            (module, to.filter(beside).collect())
        })
        .collect()
}

/// Groups of files that depend on each other in a circle.
pub(crate) fn circles(modules: &Modules) -> Vec<String> {
    let arrows = arrows(modules);
    let reach = |from: &Vec<String>| {
        let mut seen: BTreeSet<&Vec<String>> = BTreeSet::new();
        let mut open: Vec<&Vec<String>> = arrows.get(from).into_iter().flatten().copied().collect();
        while let Some(one) = open.pop() {
            if seen.insert(one) {
                open.extend(arrows.get(one).into_iter().flatten().copied());
            }
        }
        seen
    };
    let reached: BTreeMap<_, _> = modules.keys().map(|module| (module, reach(module))).collect();
    let round = modules.keys().filter(|module| reached[module].contains(module));
    let names = |module: &Vec<String>| {
        let group = reached[module].iter().filter(|other| reached[**other].contains(module));
        group.map(|one| one.join("/")).collect::<Vec<_>>().join(" ─ ")
    };
    let found: BTreeSet<String> = round.map(names).collect();
    found.into_iter().collect()
}

/// Packages without circular dependencies between files.
const WITHOUT_CIRCLES: &[&str] = &["core/src", "app/src", "bridge/src", "host/src", "link/src"];
/// The only group of files that may form a circle: the activities of the GRBL engine, which lead to each other.
const ALLOWED: &str = "core/src: grbl/activity ─ ";

#[test]
fn modules_have_no_circular_dependencies() {
    let found: Vec<String> = WITHOUT_CIRCLES
        .iter()
        .flat_map(|source| {
            circles(&modules(source)).into_iter().map(move |circle| format!("{source}: {circle}"))
        })
        .collect();
    let found: Vec<String> = found.into_iter().filter(|circle| !circle.starts_with(ALLOWED)).collect();
    assert!(found.is_empty(), "{} circles:\n{}", found.len(), found.join("\n"));
}

/// Checks that the rule can fail.
#[test]
fn circle_through_a_folder_export_is_found() {
    let at = |path: &str| path.split('/').map(str::to_owned).collect::<Vec<_>>();
    let rows: [(&str, &str); 4] = [
        ("a", "use crate::b::f; static S: u8 = 0;"),
        ("b", "fn f() { crate::c::d::g() }"),
        ("c", "mod d; thread_local! { static T: u8 = 0; }"),
        ("c/d", "use super::super::a; pub fn g() {}"),
    ];
    let read: Modules = rows.iter().map(|(module, text)| (at(module), Names::read(text))).collect();
    assert_eq!(circles(&read), ["a ─ b ─ c/d"]);
    assert_eq!(read.values().map(|names| names.statics).sum::<usize>(), 2);
    let rows = [
        ("a", "mod b; mod c; pub use b::B; use c::{self, C};"),
        ("a/b", "use super::c::C; pub struct B;"),
        ("a/c", "use crate::a::B; pub struct C;"),
        ("a/d", "use super::C; #[cfg(test)] use super::e::E;"),
        ("a/e", "use super::d; use super::e;"),
    ];
    let read: Modules = rows.iter().map(|(module, text)| (at(module), Names::read(text))).collect();
    assert_eq!(circles(&read), ["a/b ─ a/c"]);
}
