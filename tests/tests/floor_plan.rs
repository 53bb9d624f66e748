//! Which folders of `core`, `host`, `link` and `bridge` may depend on which, by the tables in
//! ARCHITECTURE.md; and the maximum length of a file.

use annulus_tests::root;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use syn::spanned::Spanned;
use syn::visit::{self, Visit};

/// Modules that everything in `core` may use, and that use nothing.
const COMMON: &[&str] = &["units", "chance", "diagnostic", "locale"];

/// The folders of a package, each with its allowed dependencies.
pub(crate) type Plan = Vec<(String, Vec<String>)>;

/// The first table under `heading` in `text`: folders from the first column, allowed dependencies from the
/// last, without text in parentheses. "all" means all rows above.
pub(crate) fn drawn(text: &str, heading: &str) -> Plan {
    let (_, below) = text.split_once(heading).unwrap_or_else(|| panic!("{heading} is not there"));
    let words = |cell: &str| -> Vec<String> {
        cell.split(',')
            .map(|word| word.split('(').next().unwrap_or_default().trim().trim_matches('`').to_owned())
            .filter(|word| !word.is_empty())
            .collect()
    };
    let lines = below.lines().map(|line| line.trim_start_matches("//!").trim());
    let rows =
        lines.skip_while(|line| !line.starts_with("|---")).skip(1).take_while(|line| line.starts_with('|'));
    let mut plan = Plan::new();
    for row in rows {
        let cells: Vec<&str> = row.trim_matches('|').split('|').collect();
        let (first, last) = (words(cells[0]), words(cells[cells.len() - 1]));
        let all = || plan.iter().map(|(name, _)| name.clone()).collect();
        let may = if last == ["all"] { all() } else { last };
        plan.extend(first.into_iter().map(|name| (name, may.clone())));
    }
    assert!(plan.len() > 3, "{heading}: {} floors", plan.len());
    plan
}

/// The table in ARCHITECTURE.md under `heading`.
pub(crate) fn architecture(heading: &str) -> Plan {
    drawn(&fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap(), heading)
}

/// Allowed dependencies that are not above their user in the table.
pub(crate) fn not_lower(plan: &Plan) -> Vec<String> {
    let mut wrong = Vec::new();
    for (at, (floor, may)) in plan.iter().enumerate() {
        let lower = |name: &&String| plan[..at].iter().any(|(below, _)| below == *name);
        wrong.extend(may.iter().filter(|name| !lower(name)).map(|name| format!("{floor} names {name}")));
    }
    wrong
}

const LONGEST_FILE: usize = 700;

/// Longer files are reported: they need a single subject that justifies it.
const LONG_FILE: usize = 500;

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
        "host/src",
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

/// True if an item is only for tests.
fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg")
            && attribute.parse_args::<syn::Ident>().is_ok_and(|ident| ident == "test")
    })
}

/// True for a file of tests.
fn is_of_tests(path: &Path) -> bool {
    let inside = path.strip_prefix(root()).unwrap_or(path);
    inside.components().skip(2).any(|part| part.as_os_str() == "tests" || part.as_os_str() == "tests.rs")
}

/// Number of lines of a file without its tests.
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

/// Dependencies in a package that its table doesn't allow.
fn off_the_plan(package: &str, plan: &Plan, common: &[&str]) -> Vec<String> {
    let mut wrong = Vec::new();
    for (path, text) in sources() {
        let Some(floor) = floor_of(&path, package).filter(|floor| !["lib", "main"].contains(&floor.as_str()))
        else {
            continue;
        };
        if is_of_tests(&path) {
            continue;
        }
        let drawn = plan.iter().find(|(name, _)| *name == floor);
        let is_common = common.contains(&floor.as_str());
        if drawn.is_none() && !is_common {
            wrong.push(format!("{}: {floor} is not on the plan", path.display()));
            continue;
        }
        let mut names = Names::default();
        names.visit_file(&syn::parse_file(&text).unwrap());
        for name in names.0 {
            let known = plan.iter().any(|(other, _)| *other == name);
            let may = name == floor || drawn.is_some_and(|(_, allowed)| allowed.contains(&name));
            if known && !may {
                wrong.push(format!("{}: {floor} must not name {name}", path.display()));
            }
        }
    }
    wrong
}

/// Rows of a table without a folder or file in the package.
pub(crate) fn only_drawn(package: &str, plan: &Plan) -> Vec<String> {
    let there = |name: &str| {
        let folder = root().join(package);
        folder.join(name).is_dir() || folder.join(format!("{name}.rs")).is_file()
    };
    let gone = plan.iter().filter(|(name, _)| !there(name));
    gone.map(|(name, _)| format!("{package}: {name} is drawn and is not there")).collect()
}

#[test]
fn every_module_dependency_is_in_the_plan() {
    let core = architecture("## Modules of core");
    let mut wrong = off_the_plan("core/src", &core, COMMON);
    wrong.extend(only_drawn("core/src", &core));
    let link = fs::read_to_string(root().join("link/src/lib.rs")).unwrap();
    let stacked = [
        ("host/src", architecture("## Modules of host")),
        ("link/src", drawn(&link, "//! Files, lowest first")),
        ("bridge/src", architecture("## Modules of bridge")),
    ];
    for (package, plan) in &stacked {
        wrong.extend(off_the_plan(package, plan, &[]));
        wrong.extend(only_drawn(package, plan));
        wrong.extend(not_lower(plan));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn files_are_short() {
    let mut wrong = Vec::new();
    for (path, text) in sources() {
        let lines = if is_of_tests(&path) { 0 } else { lines_without_tests(&text) };
        if lines > LONGEST_FILE {
            wrong.push(format!("{}: {lines} lines, at most {LONGEST_FILE}", path.display()));
        }
        if lines > LONG_FILE {
            println!("{}: {lines} lines; does its one subject need them?", path.display());
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Checks that the rule can fail.
#[test]
fn floor_plan_rules_detect_violations() {
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
    let plan = drawn(
        "# p\n| f | x |\n|---|---|\n| `a`, b | |\n| `c` | a, d |\n| d (half) | all |\n\n| e | |",
        "# p",
    );
    let names = |list: &[&str]| list.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
    assert_eq!(plan[2..], [("c".to_owned(), names(&["a", "d"])), ("d".to_owned(), names(&["a", "b", "c"]))]);
    assert_eq!(not_lower(&plan), ["c names d"]);
}
