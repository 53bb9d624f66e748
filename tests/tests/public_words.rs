//! The names of the sources against the glossary (`docs/glossary.md`): words that once were said for something that has a word of
//! the trade may not come back as names of types, functions, fields, variants or modules.
//!
//! Comes in: the sources. Goes out: a list of names, each with the word to say. Does not read sentences.

use crate::floor_plan::rust_files;
use annulus_tests::root;
use std::fs;
use std::path::Path;
use syn::visit::{self, Visit};

/// What is not said any more in names, what is, and where; everywhere in the sources where no folder is named. Several words are
/// said one after the other.
const SAID: &[(&str, &str, &str)] = &[
    ("remark", "diagnostic", ""),
    ("weight", "severity", ""),
    ("doubt", "warning", ""),
    ("loss", "error", ""),
    ("crumb", "fragment", ""),
    ("twin", "virtual drill", ""),
    ("watershed", "voronoi", ""),
    ("pace", "feed override", ""),
    ("bore", "mill holes", ""),
    ("shelf", "cache", ""),
    ("desk", "(what it holds)", ""),
    ("initialise", "home", ""),
    ("base", "work zero", "core/src/control"),
    ("base", "work zero", "core/src/wire"),
    ("base", "work zero", "drill/src"),
    ("waist", "(prose only)", ""),
    ("groove", "isolation pass", ""),
    ("ring", "isolation pass", "core/src/cam/toolpaths"),
    ("ways", "toolpaths", ""),
    ("way", "toolpath", "core/src/cam"),
    ("hop", "rapid", ""),
    ("stroke", "drill cycle", "core/src/cam"),
    ("takt", "step", ""),
    ("interrupts takt", "ticks per step", ""),
    ("bit change", "tool change", ""),
    ("change bit", "tool change", ""),
    ("turn over", "flip", ""),
    ("turned over", "flip", ""),
    ("turning over", "flip", ""),
    ("coat", "exposure", ""),
    ("coat", "overlay", "core/src/geometry"),
    ("sheet", "overlay", "core/src/geometry"),
    ("cover", "overlay", "core/src/geometry"),
    ("coarse", "overlay", "core/src/geometry"),
    ("mount", "transform", "core/src/artwork/gerber"),
    ("forms", "aperture", "core/src/artwork/gerber"),
    ("copies", "step and repeat", "core/src/artwork/gerber"),
    ("walk", "flatten", "core/src/artwork/gerber"),
];

/// What modules of a folder are not called any more.
const MODULES: &[(&str, &str, &str)] = &[
    ("beside", "outside_outline", "core/src/cam/toolpaths/checks"),
    ("closed", "no_clearance", "core/src/cam/toolpaths/checks"),
    ("held", "holding", "core/src/cam/toolpaths/checks"),
    ("missing", "no_tool", "core/src/cam/toolpaths/checks"),
    ("twice", "duplicates", "core/src/cam/toolpaths/checks"),
    ("weak", "tab_strength", "core/src/cam/toolpaths/checks"),
];

/// Names of types that say nothing of what they hold.
const TYPES: &[&str] = &["Desk", "Bench", "Shelf", "Sheet"];

/// Names of functions that give a diagnostic: they report. A program that says a line to a person may say so.
const FUNCTIONS: &[(&str, &str)] = &[("told", "core/src"), ("told", "bridge/src"), ("say", "core/src")];

/// Names that keep such a word, and why.
const KEPT: &[(&str, &str)] = &[
    ("hop_time_before_s", "a key of the command line's contract"),
    ("hop_time_after_s", "a key of the command line's contract"),
    ("losses", "how often the picture's device was lost"),
    ("bore", "the colour in a hole"),
    ("both_ways", "English: in either direction"),
    ("tape_twin", "a drill file's second writing"),
];

/// The words of a name: `HopTime` and `rapid_time` are `hop`, `time`.
fn words(name: &str) -> Vec<String> {
    let mut found: Vec<String> = vec![String::new()];
    let mut before = '_';
    for letter in name.chars() {
        if letter == '_' || (letter.is_uppercase() && before.is_lowercase()) {
            found.push(String::new());
        }
        if letter != '_' {
            found.last_mut().unwrap().extend(letter.to_lowercase());
        }
        before = letter;
    }
    found.retain(|word| !word.is_empty());
    found
}

/// Whether `words` says `old`, which may be several words.
fn says(words: &[String], old: &str) -> bool {
    let old: Vec<&str> = old.split(' ').collect();
    let is_same = |word: &String, old: &&str| word == old || word.strip_suffix('s') == Some(old);
    words.windows(old.len()).any(|some| some.iter().zip(&old).all(|(word, old)| is_same(word, old)))
}

/// What to say for a name in a file of the repository.
fn instead(name: &str, place: &str) -> Option<&'static str> {
    if KEPT.iter().any(|(kept, _)| *kept == name) {
        return None;
    }
    if TYPES.contains(&name) {
        return Some("what it holds");
    }
    if FUNCTIONS.iter().any(|(function, folder)| name == *function && place.starts_with(folder)) {
        return Some("report");
    }
    let own = words(name);
    SAID.iter()
        .find(|(old, _, folder)| place.starts_with(folder) && says(&own, old))
        .map(|(_, word, _)| *word)
}

/// What to say for the module that a file is.
fn module_instead(name: &str, path: &Path, place: &str) -> Option<&'static str> {
    let is_said = |(old, _, folder): &&(&str, &str, &str)| {
        name == *old && stem(path) == name && place.starts_with(folder)
    };
    MODULES.iter().find(is_said).map(|(_, word, _)| *word)
}

/// Names that others see: items that are not private, their fields and variants.
#[derive(Default)]
struct Names(Vec<String>);

fn is_seen(visibility: &syn::Visibility) -> bool {
    !matches!(visibility, syn::Visibility::Inherited)
}

impl Names {
    fn item(&mut self, visibility: &syn::Visibility, ident: &syn::Ident) {
        if is_seen(visibility) {
            self.0.push(ident.to_string());
        }
    }
}

impl<'ast> Visit<'ast> for Names {
    fn visit_item_struct(&mut self, item: &'ast syn::ItemStruct) {
        self.item(&item.vis, &item.ident);
        visit::visit_item_struct(self, item);
    }
    fn visit_item_enum(&mut self, item: &'ast syn::ItemEnum) {
        self.item(&item.vis, &item.ident);
        if is_seen(&item.vis) {
            self.0.extend(item.variants.iter().map(|variant| variant.ident.to_string()));
        }
    }
    fn visit_item_trait(&mut self, item: &'ast syn::ItemTrait) {
        self.item(&item.vis, &item.ident);
    }
    fn visit_item_type(&mut self, item: &'ast syn::ItemType) {
        self.item(&item.vis, &item.ident);
    }
    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        self.item(&item.vis, &item.sig.ident);
    }
    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        self.item(&item.vis, &item.sig.ident);
    }
    fn visit_field(&mut self, field: &'ast syn::Field) {
        if let Some(ident) = &field.ident {
            self.item(&field.vis, ident);
        }
    }
}

fn names(text: &str) -> Vec<String> {
    let mut names = Names::default();
    names.visit_file(&syn::parse_file(text).unwrap());
    names.0
}

fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}

#[test]
fn public_names_are_words_of_the_trade() {
    let mut files = Vec::new();
    for folder in ["core/src", "drill/src", "link/src", "app/src", "bridge/src", "bridge/firmware/src"] {
        rust_files(&root().join(folder), &mut files);
    }
    assert!(files.len() > 200, "the sources were not found");
    let mut wrong = Vec::new();
    for path in files {
        let text = fs::read_to_string(&path).unwrap();
        let place = path.strip_prefix(root()).unwrap().display().to_string();
        for name in names(&text).into_iter().chain([stem(&path)]) {
            if let Some(word) = instead(&name, &place).or_else(|| module_instead(&name, &path, &place)) {
                wrong.push(format!("{place}: {name}, say {word}"));
            }
        }
    }
    wrong.sort();
    wrong.dedup();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_word_to_say_is_in_the_glossary() {
    let glossary = fs::read_to_string(root().join("docs/glossary.md")).unwrap().to_lowercase();
    let is_own = |word: &str| {
        word.starts_with('(') || word.contains('_') || ["cache", "overlay", "ticks per step"].contains(&word)
    };
    for (_, word, _) in SAID.iter().filter(|(_, word, _)| !is_own(word)) {
        let word = word.strip_suffix('s').unwrap_or(word);
        assert!(glossary.contains(word), "{word}");
    }
}

#[test]
fn the_rule_can_fail() {
    let seen =
        names("pub struct HopTime { pub weight: u8, own: u8 } enum Hidden { Crumb } pub enum Kind { Crumb }");
    let wrong: Vec<_> = seen.iter().filter_map(|name| instead(name, "core/src/a.rs")).collect();
    assert_eq!(wrong, ["rapid", "severity", "fragment"], "{seen:?}");
    let rows = [
        ("losses", "core/src/a.rs", None),
        ("lossless", "core/src/a.rs", None),
        ("shop", "core/src/a.rs", None),
        ("ChangeBits", "core/src/a.rs", Some("tool change")),
        ("bit_changed", "core/src/a.rs", None),
        ("turned_over", "app/src/a.rs", Some("flip")),
        ("strokes", "core/src/cam/a.rs", Some("drill cycle")),
        ("strokes", "core/src/servo/a.rs", None),
        ("Sheet", "app/src/a.rs", Some("what it holds")),
        ("RunSheet", "app/src/a.rs", None),
        ("told", "core/src/a.rs", Some("report")),
        ("say", "bridge/src/a.rs", None),
    ];
    for (name, place, word) in rows {
        assert_eq!(instead(name, place), word, "{name}");
    }
}
