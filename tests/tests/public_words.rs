//! The names of the sources against the glossary (`docs/glossary.md`): words that once were said for something that has a word of
//! the trade may not come back as names of types, functions, fields, variants or modules.
//!
//! Comes in: the sources. Goes out: a list of names, each with the word to say. Does not read sentences.

use crate::floor_plan::rust_files;
use annulus_tests::root;
use std::fs;
use std::path::Path;
use syn::visit::{self, Visit};

/// What is not said any more, and what is.
const SAID: &[(&str, &str)] = &[
    ("remark", "diagnostic"),
    ("weight", "severity"),
    ("doubt", "warning"),
    ("loss", "error"),
    ("crumb", "fragment"),
    ("twin", "virtual drill"),
    ("watershed", "voronoi"),
    ("pace", "feed override"),
    ("bore", "mill holes"),
    ("coat", "exposure"),
    ("shelf", "cache"),
    ("initialise", "home"),
    ("waist", "(prose only)"),
    ("groove", "isolation pass"),
    ("ways", "toolpaths"),
    ("hop", "rapid"),
    ("hops", "rapids"),
];

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

fn instead(name: &str) -> Option<&'static str> {
    if KEPT.iter().any(|(kept, _)| *kept == name) {
        return None;
    }
    let own = words(name);
    let says = |old: &str| own.iter().any(|word| word == old || word.strip_suffix('s') == Some(old));
    SAID.iter().find(|(old, _)| says(old)).map(|(_, word)| *word)
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
        for name in names(&text).into_iter().chain([stem(&path)]) {
            if let Some(word) = instead(&name) {
                wrong.push(format!("{}: {name}, say {word}", path.display()));
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
    for (_, word) in SAID.iter().filter(|(_, word)| !word.starts_with('(') && *word != "cache") {
        let word = word.strip_suffix('s').unwrap_or(word);
        assert!(glossary.contains(&format!("**{word}")) || glossary.contains(word), "{word}");
    }
}

#[test]
fn the_rule_can_fail() {
    let seen =
        names("pub struct HopTime { pub weight: u8, own: u8 } enum Hidden { Crumb } pub enum Kind { Crumb }");
    let wrong: Vec<_> = seen.iter().filter_map(|name| instead(name)).collect();
    assert_eq!(wrong, ["rapid", "severity", "fragment"], "{seen:?}");
    assert_eq!(instead("losses"), None);
    assert_eq!((instead("lossless"), instead("shop")), (None, None));
}
