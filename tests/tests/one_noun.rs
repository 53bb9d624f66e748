//! A public noun has one meaning: a type that everybody may name is defined once in all crates.
//!
//! Comes in: the sources, and `tests/nouns_twice.toml`, which lists the nouns that are defined more than once and why that is no
//! second meaning. Goes out: nouns that are in no list, and rows of the list that are no longer true, so that it only shrinks. Does
//! not read what is private to its crate or module.

use crate::floor_plan::rust_files;
use annulus_tests::root;
use std::collections::BTreeMap;
use std::fs;
use syn::visit::Visit;

/// How many rows the list has at most. Whoever takes one out lowers it.
const MOST: usize = 10;

/// Names of types that everybody may name.
#[derive(Default)]
struct Nouns(Vec<String>);

impl Nouns {
    fn noun(&mut self, visibility: &syn::Visibility, name: &syn::Ident) {
        if matches!(visibility, syn::Visibility::Public(_)) {
            self.0.push(name.to_string());
        }
    }
}

impl<'ast> Visit<'ast> for Nouns {
    fn visit_item_struct(&mut self, item: &'ast syn::ItemStruct) {
        self.noun(&item.vis, &item.ident);
    }
    fn visit_item_enum(&mut self, item: &'ast syn::ItemEnum) {
        self.noun(&item.vis, &item.ident);
    }
    fn visit_item_type(&mut self, item: &'ast syn::ItemType) {
        self.noun(&item.vis, &item.ident);
    }
    fn visit_item_trait(&mut self, item: &'ast syn::ItemTrait) {
        self.noun(&item.vis, &item.ident);
    }
}

fn nouns(text: &str) -> Vec<String> {
    let mut nouns = Nouns::default();
    nouns.visit_file(&syn::parse_file(text).unwrap());
    nouns.0
}

/// The list: each noun with how often it is defined. Every row says why.
fn listed() -> BTreeMap<String, usize> {
    let text = fs::read_to_string(root().join("tests/nouns_twice.toml")).unwrap();
    let rows: toml::Table = text.parse().unwrap();
    let row = |(noun, row): (String, toml::Value)| {
        let why = row.get("why").and_then(toml::Value::as_str).unwrap_or_default();
        assert!(why.len() > 10, "{noun} does not say why");
        (noun, row["times"].as_integer().unwrap() as usize)
    };
    rows.into_iter().map(row).collect()
}

/// What is defined where, against the list.
fn wrong(defined: &BTreeMap<String, Vec<String>>, listed: &BTreeMap<String, usize>) -> Vec<String> {
    let times = |noun: &String| listed.get(noun).copied().unwrap_or(1);
    let again = defined
        .iter()
        .filter(|(noun, places)| places.len() > times(noun))
        .map(|(noun, places)| format!("{noun} is defined in {}", places.join(", ")));
    let stale = listed.iter().filter(|(noun, times)| {
        **times < 2 || defined.get(*noun).is_none_or(|places| places.len() < **times)
    });
    again.chain(stale.map(|(noun, times)| format!("{noun} is not defined {times} times any more"))).collect()
}

#[test]
fn public_nouns_are_defined_once() {
    let mut defined: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for folder in ["core/src", "drill/src", "link/src", "bridge/src", "app/src"] {
        let mut files = Vec::new();
        rust_files(&root().join(folder), &mut files);
        assert!(files.len() > 5, "the sources of {folder} were not found");
        for path in files {
            let place = path.strip_prefix(root()).unwrap().display().to_string();
            for noun in nouns(&fs::read_to_string(&path).unwrap()) {
                defined.entry(noun).or_default().push(place.clone());
            }
        }
    }
    assert!(defined.len() > 300, "{} nouns: they were not found", defined.len());
    let listed = listed();
    let wrong = wrong(&defined, &listed);
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
    assert_eq!(listed.len(), MOST, "rows in tests/nouns_twice.toml; it only shrinks");
}

#[test]
fn the_rule_of_one_meaning_can_fail() {
    let own = nouns(
        "pub struct Part; pub(crate) struct Row; struct Own; pub mod a { pub enum Part {} } pub type Slot = u8; pub trait Way {}",
    );
    assert_eq!(own, ["Part", "Part", "Slot", "Way"]);
    let mut defined: BTreeMap<String, Vec<String>> = BTreeMap::new();
    own.into_iter().for_each(|noun| defined.entry(noun).or_default().push("a.rs".to_owned()));
    let listed =
        |times: &[(&str, usize)]| times.iter().map(|&(noun, times)| (noun.to_owned(), times)).collect();
    assert_eq!(wrong(&defined, &listed(&[])), ["Part is defined in a.rs, a.rs"]);
    assert!(wrong(&defined, &listed(&[("Part", 2)])).is_empty());
    assert_eq!(wrong(&defined, &listed(&[("Part", 3)])), ["Part is not defined 3 times any more"]);
    assert_eq!(
        wrong(&defined, &listed(&[("Part", 2), ("Slot", 2)])),
        ["Slot is not defined 2 times any more"]
    );
    assert_eq!(wrong(&defined, &listed(&[("Part", 2), ("Slot", 1)])).len(), 1);
}
