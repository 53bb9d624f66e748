//! The words of sentences against the glossary (`docs/glossary.md`): what a person reads says what the trade says.
//!
//! Comes in: the locale table, the manual, the README, the help of the command line. Goes out: a list of sentences, each with the
//! word to say. Arguments in braces and what is written as code are left out: they are names, which `public_words` reads. Words
//! that English needs for other things (way, pace of a walk, sheet of paper) are not looked for where they mean those.

use crate::floor_plan::rust_files;
use annulus_core::locale;
use annulus_tests::root;
use std::fs;
use syn::visit::{self, Visit};

/// What is not said any more, and what is. A word stands for its plural too.
const SAID: &[(&str, &str)] = &[
    ("takt", "step"),
    ("hop", "rapid"),
    ("crumb", "fragment"),
    ("watershed", "Voronoi isolation"),
    ("groove", "isolation pass"),
    ("twin", "virtual drill"),
    ("pace", "feed override"),
    ("waist", "(nothing)"),
    ("remark", "note, warning or error"),
    ("shelf", "cache"),
    ("desk", "(what it holds)"),
    ("initialise", "home"),
    ("initialize", "home"),
    ("initialisation", "home"),
    ("initialization", "home"),
    ("basing", "set work zero"),
    ("bore", "mill holes and slots"),
    ("bit change", "tool change"),
    ("change of bit", "tool change"),
    ("change of bits", "tool change"),
    ("change the bit", "change the tool"),
    ("turn over", "flip"),
    ("turned over", "flipped"),
    ("turning over", "flip"),
    ("interrupts a step", "ticks per step"),
];

/// Sentences that keep such a word, by a piece of them, and why.
const KEPT: &[(&str, &str)] = &[
    ("the head in remarks of at most 32 letters", "that is what Fanuc's controllers call them"),
    ("how many interrupts a step takes in each state", "the rows of Arendt's table count interrupts"),
];

/// The words of a text without what is in braces or in backticks; a dot stands where a part of a sentence ends.
fn words(sentence: &str) -> Vec<String> {
    let mut plain = String::new();
    let (mut depth, mut is_code) = (0_usize, false);
    for letter in sentence.chars() {
        match letter {
            '`' => is_code = !is_code,
            '{' => depth += 1,
            '}' => depth = depth.saturating_sub(1),
            '.' | ',' | ';' | ':' | '|' | '(' | ')' if depth == 0 && !is_code => plain.push_str(" . "),
            _ if depth == 0 && !is_code => plain.push(letter),
            _ => {}
        }
    }
    let parts = plain.split(|letter: char| !letter.is_alphanumeric() && letter != '.');
    parts.filter(|word| !word.is_empty()).map(str::to_lowercase).collect()
}

/// The word to say instead of one in `sentence`, with that.
fn instead(sentence: &str) -> Option<(&'static str, &'static str)> {
    let rest = KEPT.iter().fold(sentence.to_owned(), |text, (piece, _)| text.replace(piece, "."));
    let own = words(&rest);
    let says = |old: &str| {
        let old: Vec<&str> = old.split(' ').collect();
        let is_same = |word: &String, old: &&str| word == old || word.strip_suffix('s') == Some(old);
        own.windows(old.len()).any(|some| some.iter().zip(&old).all(|(word, old)| is_same(word, old)))
    };
    SAID.iter().find(|(old, _)| says(old)).copied()
}

/// Text that is no program: paragraphs outside of fenced blocks, so that a phrase is found across the end of a line.
fn paragraphs(text: &str) -> Vec<String> {
    let prose: Vec<&str> = text.split("```").step_by(2).collect();
    prose.join("\n\n").split("\n\n").map(|paragraph| paragraph.replace('\n', " ")).collect()
}

/// Help of the command line: the documents of what clap reads.
#[derive(Default)]
struct Help(Vec<String>);

fn documents(attributes: &[syn::Attribute]) -> String {
    let text = |attribute: &syn::Attribute| {
        let syn::Meta::NameValue(meta) = &attribute.meta else { return None };
        let syn::Expr::Lit(syn::ExprLit { lit: syn::Lit::Str(text), .. }) = &meta.value else { return None };
        attribute.path().is_ident("doc").then(|| text.value())
    };
    attributes.iter().filter_map(text).collect()
}

fn is_read_by_clap(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let syn::Meta::List(list) = &attribute.meta else { return false };
        let derived = list.tokens.to_string();
        let is_of_clap = |word: &str| ["Args", "Parser", "Subcommand", "ValueEnum"].contains(&word.trim());
        attribute.path().is_ident("derive") && derived.split([',', ':']).any(is_of_clap)
    })
}

impl<'ast> Visit<'ast> for Help {
    fn visit_item_struct(&mut self, item: &'ast syn::ItemStruct) {
        if is_read_by_clap(&item.attrs) {
            self.0.push(documents(&item.attrs));
            self.0.extend(item.fields.iter().map(|field| documents(&field.attrs)));
        }
        visit::visit_item_struct(self, item);
    }
    fn visit_item_enum(&mut self, item: &'ast syn::ItemEnum) {
        if is_read_by_clap(&item.attrs) {
            let variants = item.variants.iter();
            self.0.push(documents(&item.attrs));
            self.0.extend(variants.clone().map(|variant| documents(&variant.attrs)));
            self.0.extend(variants.flat_map(|variant| &variant.fields).map(|field| documents(&field.attrs)));
        }
        visit::visit_item_enum(self, item);
    }
}

fn help(text: &str) -> Vec<String> {
    let mut help = Help::default();
    help.visit_file(&syn::parse_file(text).unwrap());
    help.0.retain(|sentence| !sentence.is_empty());
    help.0
}

/// What is said where, and how many sentences there are.
fn wrong(place: &str, sentences: &[String]) -> Vec<String> {
    let row = |sentence: &String| {
        instead(sentence).map(|(old, word)| format!("{place}: not {old}, say {word}: {}", sentence.trim()))
    };
    sentences.iter().filter_map(row).collect()
}

#[test]
fn sentences_of_every_table_are_in_the_words_of_the_trade() {
    let rows = locale::entries("en").iter();
    let wrong: Vec<String> =
        rows.flat_map(|(key, text)| wrong(key, std::slice::from_ref(&(*text).to_owned()))).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_manual_is_in_the_words_of_the_trade() {
    let mut files = vec![root().join("README.md")];
    files.extend(fs::read_dir(root().join("docs/manual")).unwrap().map(|entry| entry.unwrap().path()));
    files.retain(|path| path.extension().is_some_and(|extension| extension == "md"));
    assert!(files.len() > 10, "the manual was not found");
    let found = files.iter().flat_map(|path| {
        let place = path.strip_prefix(root()).unwrap().display().to_string();
        wrong(&place, &paragraphs(&fs::read_to_string(path).unwrap()))
    });
    let found: Vec<String> = found.collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn the_help_of_the_command_line_is_in_the_words_of_the_trade() {
    let (mut files, mut found, mut count) = (Vec::new(), Vec::new(), 0);
    rust_files(&root().join("bridge/src/cli"), &mut files);
    for path in files {
        let sentences = help(&fs::read_to_string(&path).unwrap());
        count += sentences.len();
        found.extend(wrong(&path.strip_prefix(root()).unwrap().display().to_string(), &sentences));
    }
    assert!(count > 100, "{count} sentences of help: they were not found");
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn the_rule_of_sentences_can_fail() {
    let rows = [
        ("Change the bits, then go on.", Some("change the tool")),
        ("After a bit change.", Some("tool change")),
        ("{twin} beside it", None),
        ("annulus `--hop 3`, shopping", None),
        ("Two hops more", Some("rapid")),
        ("in place of the change; the bit is in", None),
        ("The old bit. Changes follow.", None),
        ("Not turned over yet", Some("flipped")),
        ("the head in remarks of at most 32 letters", None),
    ];
    for (sentence, word) in rows {
        assert_eq!(instead(sentence).map(|(_, word)| word), word, "{sentence}");
    }
    assert_eq!(paragraphs("a bit\nchange\n```\nhop\n```\nend"), ["a bit change", "", "end"]);
    let clap = "#[derive(clap::Args)] struct A { /** A hop. */ x: u8 } #[derive(Debug)] struct B { /** A twin. */ y: u8 }";
    assert_eq!(help(clap), [" A hop. "]);
}
