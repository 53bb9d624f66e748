//! The house rules as a test: which folder of `core` may name which, how long files and functions may be, and that
//! every file says what it is. The arrows are those of ARCHITECTURE.md.

use annulus_tests::root;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use syn::spanned::Spanned;
use syn::visit::{self, Visit};

/// Folder of `core/src`, and what it may name besides `units`, `diagnostic`, `locale` and `chance`.
const ARROWS: &[(&str, &[&str])] = &[
    ("units", &[]),
    ("chance", &[]),
    ("diagnostic", &[]),
    ("locale", &[]),
    ("geometry", &[]),
    ("machine", &["geometry", "job"]),
    ("artwork", &["geometry"]),
    ("board", &["artwork", "geometry"]),
    ("job", &["geometry"]),
    ("cam", &["board", "job", "geometry", "machine"]),
    ("post", &["job", "geometry", "machine"]),
    ("project", &["artwork", "board", "cam", "job", "geometry", "machine"]),
    ("proof", &["job", "board", "geometry"]),
    ("motion", &["job", "geometry", "machine"]),
    ("steps", &["motion", "job", "machine"]),
    ("check", &["steps", "job", "machine", "geometry"]),
    ("pins", &["steps", "job", "machine"]),
    ("virtual_drill", &["pins", "steps", "machine", "geometry", "job"]),
    ("sim", &["steps", "motion", "job", "geometry", "machine"]),
    ("queue", &["pins", "steps", "motion", "job", "machine", "geometry"]),
    ("control", &["pins", "check", "steps", "motion", "job", "machine", "geometry"]),
    ("controller", &["control"]),
    ("servo", &[]),
    ("plot", &[]),
    ("wire", &["control", "queue", "steps", "job", "machine"]),
];

/// Files of `link/src`, lowest first, and what each may name: only what lies lower.
const LINK: &[(&str, &[&str])] = &[
    ("bytes", &[]),
    ("crc", &[]),
    ("cobs", &[]),
    ("frame", &["bytes", "cobs", "crc"]),
    ("message", &["bytes"]),
    ("run", &["bytes"]),
    ("chunk", &["bytes", "frame", "message", "run"]),
    ("cutter", &["chunk", "frame", "message", "run"]),
    ("store", &["frame"]),
    ("receiver", &["frame"]),
    ("sender", &["bytes", "chunk", "frame", "message", "receiver", "run", "store"]),
    ("player", &["bytes", "chunk", "frame", "message", "run", "store"]),
    ("adapter", &["bytes", "chunk", "cobs", "crc", "frame", "message", "player", "receiver", "store"]),
];

/// Files of `drill/src` that stand by themselves, and what each may name; all others are the owner, and may name them all.
const DRILL: &[(&str, &[&str])] = &[
    ("files", &[]),
    ("grant", &[]),
    ("journal", &[]),
    ("ticket", &[]),
    ("line", &["owner", "ticket"]),
    ("executor", &["grant"]),
    ("place", &["executor"]),
    ("outside", &["executor", "journal"]),
    ("recording", &["executor", "journal", "owner"]),
    ("alone", ALONE),
    ("controller", &["executor", "files", "journal", "line", "owner", "prepare", "ticket"]),
    ("owner", OWNER),
    ("arming", OWNER),
    ("begin", OWNER),
    ("board", OWNER),
    ("faster", OWNER),
    ("hands", OWNER),
    ("homing", OWNER),
    ("moves", OWNER),
    ("outputs", OWNER),
    ("prepare", &[]),
    ("queue", OWNER),
    ("status", OWNER),
];

/// What the files of the owner may name: it never plays by itself.
const OWNER: &[&str] = &[
    "arming", "begin", "board", "executor", "faster", "hands", "homing", "journal", "moves", "outputs",
    "outside", "owner", "prepare", "queue", "status", "ticket",
];

/// What the drill without threads may name: what the bridge names too.
const ALONE: &[&str] = &[
    "board",
    "executor",
    "files",
    "journal",
    "line",
    "outside",
    "owner",
    "place",
    "prepare",
    "recording",
    "ticket",
];

/// Folders and files of `bridge/src`, lowest first, and what each may name: only what lies lower.
const BRIDGE: &[(&str, &[&str])] = &[
    ("quiet", &[]),
    ("own", &[]),
    ("refusal", &[]),
    ("signals", &["refusal"]),
    ("machine_file", &["own", "refusal"]),
    ("journal", &["quiet"]),
    ("serial", &[]),
    ("adapter", &["serial"]),
    ("outputs", &["own"]),
    ("executor", &["own", "outputs", "signals"]),
    ("lab", &[]),
    ("controller", &["machine_file", "serial"]),
    ("drill", &["adapter", "executor", "journal", "machine_file", "own", "refusal"]),
    ("server", &["drill", "machine_file", "own", "refusal"]),
    (
        "cli",
        &[
            "adapter",
            "controller",
            "drill",
            "executor",
            "journal",
            "lab",
            "machine_file",
            "outputs",
            "own",
            "refusal",
            "serial",
            "server",
            "signals",
        ],
    ),
];

const LONGEST_FILE: usize = 700;

/// Longer files than this are told: they should have one subject that needs it.
const LONG_FILE: usize = 500;
const LONGEST_FUNCTION: usize = 70;

/// The sources below a folder, in order.
pub(crate) fn rust_files(folder: &Path, out: &mut Vec<PathBuf>) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    let mut paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() {
            rust_files(&path, out);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            out.push(path);
        }
    }
}

fn sources() -> Vec<(PathBuf, String)> {
    let mut files = Vec::new();
    let folders = [
        "core/src",
        "drill/src",
        "link/src",
        "app/src",
        "bridge/src",
        "bridge/firmware/src",
        "tests/src",
        "xtask/src",
    ];
    for folder in folders {
        rust_files(&root().join(folder), &mut files);
    }
    assert!(files.len() > 20, "the sources were not found");
    files.into_iter().map(|path| (path.clone(), fs::read_to_string(path).unwrap())).collect()
}

/// Whether an item is there for the tests alone.
fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg")
            && attribute.parse_args::<syn::Ident>().is_ok_and(|ident| ident == "test")
    })
}

/// Whether a file is one of tests as a whole.
fn is_of_tests(path: &Path) -> bool {
    let inside = path.strip_prefix(root()).unwrap_or(path);
    inside.components().skip(2).any(|part| part.as_os_str() == "tests" || part.as_os_str() == "tests.rs")
}

/// Lines of a file, those of its tests apart, wherever they stand.
fn lines_without_tests(text: &str) -> usize {
    let lines_of = |item: &syn::Item| match item {
        syn::Item::Mod(module) if is_test(&module.attrs) => {
            item.span().end().line - item.span().start().line + 1
        }
        _ => 0,
    };
    let file = syn::parse_file(text).unwrap();
    text.lines().count() - file.items.iter().map(lines_of).sum::<usize>()
}

fn floor_of(path: &Path, package: &str) -> Option<String> {
    let inside = path.strip_prefix(root().join(package)).ok()?;
    let first = inside.components().next()?.as_os_str().to_string_lossy().into_owned();
    Some(first.trim_end_matches(".rs").to_owned())
}

#[derive(Default)]
struct Names(BTreeSet<String>);

impl Names {
    fn use_tree(&mut self, tree: &syn::UseTree) {
        match tree {
            syn::UseTree::Path(path) if path.ident == "crate" => match &*path.tree {
                syn::UseTree::Path(next) => {
                    self.0.insert(next.ident.to_string());
                }
                syn::UseTree::Name(next) => {
                    self.0.insert(next.ident.to_string());
                }
                syn::UseTree::Group(group) => {
                    for item in &group.items {
                        let inner = syn::parse_quote!(crate::#item);
                        self.use_tree(&inner);
                    }
                }
                _ => {}
            },
            syn::UseTree::Group(group) => group.items.iter().for_each(|item| self.use_tree(item)),
            _ => {}
        }
    }
}

impl<'ast> Visit<'ast> for Names {
    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        self.use_tree(&item.tree);
    }
    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        if !is_test(&item.attrs) {
            visit::visit_item_mod(self, item);
        }
    }
    fn visit_path(&mut self, path: &'ast syn::Path) {
        let mut segments = path.segments.iter();
        if segments.next().is_some_and(|segment| segment.ident == "crate") {
            self.0.extend(segments.next().map(|segment| segment.ident.to_string()));
        }
        visit::visit_path(self, path);
    }
}

/// What in a package points where its plan does not let it.
fn off_the_plan(package: &str, arrows: &[(&str, &[&str])], common: &[&str]) -> Vec<String> {
    let mut wrong = Vec::new();
    for (path, text) in sources() {
        let Some(floor) = floor_of(&path, package).filter(|floor| !["lib", "main"].contains(&floor.as_str()))
        else {
            continue;
        };
        if is_of_tests(&path) {
            continue;
        }
        let Some((_, allowed)) = arrows.iter().find(|(name, _)| *name == floor) else {
            wrong.push(format!("{}: {floor} is not on the plan", path.display()));
            continue;
        };
        let mut names = Names::default();
        names.visit_file(&syn::parse_file(&text).unwrap());
        for name in names.0 {
            let known = arrows.iter().any(|(other, _)| *other == name);
            let may = common.contains(&name.as_str()) || name == floor || allowed.contains(&name.as_str());
            if known && !may {
                wrong.push(format!("{}: {floor} must not name {name}", path.display()));
            }
        }
    }
    wrong
}

#[test]
fn every_arrow_is_on_the_plan() {
    let mut wrong = off_the_plan("core/src", ARROWS, &["chance", "units", "diagnostic", "locale"]);
    wrong.extend(off_the_plan("drill/src", DRILL, &[]));
    wrong.extend(off_the_plan("link/src", LINK, &[]));
    wrong.extend(off_the_plan("bridge/src", BRIDGE, &[]));
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    for floors in [LINK, BRIDGE] {
        for (at, (floor, allowed)) in floors.iter().enumerate() {
            let lower = |name: &&str| floors[..at].iter().any(|(below, _)| *below == *name);
            assert!(allowed.iter().all(lower), "{floor} names only what lies lower");
        }
    }
}

#[test]
fn files_are_short_and_say_what_they_are() {
    let mut wrong = Vec::new();
    for (path, text) in sources() {
        let lines = if is_of_tests(&path) { 0 } else { lines_without_tests(&text) };
        if lines > LONGEST_FILE {
            wrong.push(format!("{}: {lines} lines, at most {LONGEST_FILE}", path.display()));
        }
        if lines > LONG_FILE {
            println!("{}: {lines} lines; does its one subject need them?", path.display());
        }
        if !text.starts_with("//!") {
            wrong.push(format!("{}: does not open with what it is", path.display()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

struct Functions<'a> {
    path: &'a Path,
    wrong: Vec<String>,
}

impl Functions<'_> {
    fn measure(&mut self, name: &syn::Ident, body: &syn::Block) {
        let (first, last) = (body.span().start().line, body.span().end().line);
        let lines = last - first + 1;
        if lines > LONGEST_FUNCTION {
            let path = self.path.display();
            self.wrong
                .push(format!("{path}:{first}: fn {name} has {lines} lines, at most {LONGEST_FUNCTION}"));
        }
    }
}

impl<'ast> Visit<'ast> for Functions<'_> {
    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        self.measure(&item.sig.ident, &item.block);
        visit::visit_item_fn(self, item);
    }
    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        self.measure(&item.sig.ident, &item.block);
        visit::visit_impl_item_fn(self, item);
    }
}

#[test]
fn functions_are_short() {
    let mut wrong = Vec::new();
    for (path, text) in sources() {
        let mut functions = Functions { path: &path, wrong: Vec::new() };
        functions.visit_file(&syn::parse_file(&text).unwrap());
        wrong.extend(functions.wrong);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A rule that cannot fail is no rule.
#[test]
fn the_rules_can_fail() {
    let mut names = Names::default();
    names.visit_file(
        &syn::parse_file("use crate::{motion::profile, units::Length}; fn f() { crate::cam::plan() }")
            .unwrap(),
    );
    assert_eq!(names.0.into_iter().collect::<Vec<_>>(), ["cam", "motion", "units"]);
    assert_eq!(
        lines_without_tests("//! x\n#[cfg(test)]\nmod tests;\nfn f() {}\n#[cfg(test)]\nmod more {\n}\n"),
        2
    );
    let long = format!("fn f() {{\n{}}}\n", "g();\n".repeat(LONGEST_FUNCTION));
    let mut functions = Functions { path: Path::new("x.rs"), wrong: Vec::new() };
    functions.visit_file(&syn::parse_file(&long).unwrap());
    assert_eq!(functions.wrong.len(), 1);
}
