//! The house rules of the page as a test: which folder of `app/src` may name which, that no files name each other in a circle, and
//! how many things live as long as the page. The arrows are those of ARCHITECTURE.md.

use crate::floor_plan::rust_files;
use annulus_tests::root;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use syn::visit::{self, Visit};

/// What of the browser a file may name, or not.
const BROWSER: &[&str] = &["web_sys", "js_sys", "wasm_bindgen", "leptos"];

/// What lies above everything that does not know the page.
const ABOVE: &[&str] = &["effects", "page", "screens", "widgets", "i18n"];

/// Folder or file of `app/src`, and what of the page or of the browser it must not name.
const NOT: &[(&str, &[&[&str]])] = &[
    ("model", &[BROWSER, ABOVE]),
    ("lab", &[BROWSER, ABOVE, &["model"]]),
    ("drawing", &[BROWSER, ABOVE, &["model", "engine"]]),
    ("workbench", &[ABOVE, &["web_sys", "leptos", "model"]]),
    ("engine", &[ABOVE, &["leptos", "model"]]),
    ("view", &[ABOVE, &["leptos", "model", "engine"]]),
    ("page", &[&["web_sys", "js_sys", "effects", "screens", "widgets", "i18n"]]),
    ("effects", &[&["screens"]]),
    ("screens", &[&["effects"]]),
    ("widgets", &[&["effects", "screens", "engine"]]),
];

/// Everything that lives as long as the page: the running page, and the pictures there are.
const MOST_STATICS: usize = 2;

/// The path of a file's module: `["model", "link", "stop"]`.
fn module_of(path: &Path) -> Vec<String> {
    let inside = path.strip_prefix(root().join("app/src")).unwrap().with_extension("");
    let mut parts: Vec<String> =
        inside.components().map(|part| part.as_os_str().to_string_lossy().into_owned()).collect();
    if matches!(parts.last().map(String::as_str), Some("mod" | "lib")) {
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

/// All paths that a file names, and its statics.
#[derive(Default)]
struct Names {
    paths: Vec<Vec<String>>,
    statics: usize,
}

impl Names {
    fn tree(&mut self, before: &[String], tree: &syn::UseTree) {
        let with = |ident: &syn::Ident| before.iter().cloned().chain([ident.to_string()]).collect::<Vec<_>>();
        match tree {
            syn::UseTree::Path(path) => self.tree(&with(&path.ident), &path.tree),
            syn::UseTree::Name(name) => self.paths.push(with(&name.ident)),
            syn::UseTree::Rename(name) => self.paths.push(with(&name.ident)),
            syn::UseTree::Glob(_) => self.paths.push(before.to_vec()),
            syn::UseTree::Group(group) => group.items.iter().for_each(|item| self.tree(before, item)),
        }
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

/// Every file of the page without its tests: its module, and what it names.
fn page() -> BTreeMap<Vec<String>, Names> {
    let mut files = Vec::new();
    rust_files(&root().join("app/src"), &mut files);
    assert!(files.len() > 50, "the sources were not found");
    let named = files.into_iter().map(|path| {
        let mut names = Names::default();
        names.visit_file(&syn::parse_file(&fs::read_to_string(&path).unwrap()).unwrap());
        (module_of(&path), names)
    });
    named
        .filter(|(module, _)| !module.iter().any(|part| part == "tests" || part == "browser_tests"))
        .collect()
}

/// Where `path`, named in `module`, leads to, as far as it is a module of the page.
fn target<'a>(
    module: &[String],
    path: &[String],
    modules: &'a BTreeMap<Vec<String>, Names>,
) -> Option<&'a Vec<String>> {
    let mut rest = path;
    let mut base: Vec<String> = match rest.first()?.as_str() {
        "crate" => Vec::new(),
        "super" | "self" => module.to_vec(),
        _ => {
            let child: Vec<String> = module.iter().chain(&rest[..1]).cloned().collect();
            return modules.get_key_value(&child).map(|(found, _)| found);
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
    for part in rest {
        base.push(part.clone());
        if !modules.contains_key(&base) {
            base.pop();
            break;
        }
    }
    modules.get_key_value(&base).map(|(found, _)| found)
}

#[test]
fn every_arrow_of_the_page_is_on_the_plan() {
    let modules = page();
    let mut wrong = Vec::new();
    for (module, names) in &modules {
        let Some((_, not)) = NOT.iter().find(|(floor, _)| module.first().is_some_and(|first| first == floor))
        else {
            continue;
        };
        for path in &names.paths {
            let outside = path.first().filter(|first| BROWSER.contains(&first.as_str())).cloned();
            let inside = target(module, path, &modules).and_then(|to| to.first()).cloned();
            let own = |name: &String| module.first() == Some(name);
            let named = outside
                .or(inside)
                .filter(|name| not.iter().any(|names| names.contains(&name.as_str())) && !own(name));
            if let Some(name) = named {
                wrong.push(format!("{} must not name {name}", module.join("/")));
            }
        }
    }
    wrong.dedup();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A folder and the files in it belong together: what is counted are the arrows between files of which neither is above the other.
fn arrows(modules: &BTreeMap<Vec<String>, Names>) -> BTreeMap<&Vec<String>, BTreeSet<&Vec<String>>> {
    modules
        .iter()
        .map(|(module, names)| {
            let to = names.paths.iter().filter_map(|path| target(module, path, modules));
            let beside = |to: &&Vec<String>| !to.starts_with(module) && !module.starts_with(to);
            (module, to.filter(beside).collect())
        })
        .collect()
}

/// The files that can be reached from each other, in groups of more than one.
fn circles(modules: &BTreeMap<Vec<String>, Names>) -> Vec<String> {
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

#[test]
fn no_files_of_the_page_name_each_other_in_a_circle() {
    let found = circles(&page());
    assert!(found.is_empty(), "{} circles:\n{}", found.len(), found.join("\n"));
}

#[test]
fn little_lives_as_long_as_the_page() {
    let modules = page();
    let found: Vec<String> = modules
        .iter()
        .filter(|(_, names)| names.statics > 0)
        .map(|(module, names)| format!("{}: {}", module.join("/"), names.statics))
        .collect();
    let all: usize = modules.values().map(|names| names.statics).sum();
    assert!(all <= MOST_STATICS, "{all} statics, at most {MOST_STATICS}:\n{}", found.join("\n"));
}

/// A rule that cannot fail is no rule.
#[test]
fn the_rules_of_the_page_can_fail() {
    let file = |text: &str| {
        let mut names = Names::default();
        names.visit_file(&syn::parse_file(text).unwrap());
        names
    };
    let at = |path: &str| path.split('/').map(str::to_owned).collect::<Vec<_>>();
    let modules: BTreeMap<_, _> = [
        (at("a"), file("use crate::b::f; static S: u8 = 0;")),
        (at("b"), file("fn f() { crate::c::d::g() }")),
        (at("c"), file("mod d; thread_local! { static T: u8 = 0; }")),
        (at("c/d"), file("use super::super::a; pub fn g() {}")),
    ]
    .into();
    assert_eq!(circles(&modules), ["a ─ b ─ c/d"]);
    assert_eq!(modules.values().map(|names| names.statics).sum::<usize>(), 2);
}
