//! Every text on the page is in the locale tables, and every text of the tables is used. Parses Rust only as
//! far as string literals. Whether a key exists and gets its arguments is checked by the compiler.

use annulus_core::cam::parameters;
use annulus_core::cam::work::OperationKind;
use annulus_core::locale;
use annulus_core::machine::{Field, Group, SECTIONS, ValueKind};
use annulus_tests::root;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn sources(folder: &Path, out: &mut Vec<(PathBuf, String)>) {
    let mut paths: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.retain(|path| !path.ends_with("tests.rs") && !path.ends_with("tests"));
    for path in paths {
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = fs::read_to_string(&path).unwrap();
            let end = text.find("\n#[cfg(test)]\nmod tests {").unwrap_or(text.len());
            out.push((path, text[..end].to_owned()));
        }
    }
}

/// A string literal with the code before and after it, without spaces.
struct Literal {
    before: String,
    text: String,
    behind: String,
    line: usize,
}

/// Every string literal outside comments.
fn literals(source: &str) -> Vec<Literal> {
    let mut found = Vec::new();
    let mut at = 0;
    let bytes = source.as_bytes();
    while at < bytes.len() {
        if source[at..].starts_with("//") {
            at += source[at..].find('\n').unwrap_or(source.len() - at);
        } else if bytes[at] == b'\'' && source[at..].starts_with("'\"'") {
            at += 3;
        } else if bytes[at] == b'"' {
            let start = at + 1;
            at = start;
            while at < bytes.len() && bytes[at] != b'"' {
                at += if bytes[at] == b'\\' { 2 } else { 1 };
            }
            let packed = |text: &str| text.split_whitespace().collect::<String>();
            let before: String = source[..start - 1].chars().rev().take(40).collect();
            let before: String = packed(&before.chars().rev().collect::<String>());
            let behind: String = packed(&source[at + 1..].chars().take(12).collect::<String>());
            let line = source[..start].lines().count();
            found.push(Literal { before, text: source[start..at].to_owned(), behind, line });
            at += 1;
        } else {
            at += source[at..].chars().next().map_or(1, char::len_utf8);
        }
    }
    found
}

fn is_key(literal: &Literal) -> bool {
    let called = |call: &str| {
        let name = literal.before.strip_suffix(call)?;
        (!name.ends_with(|last: char| last.is_alphanumeric() || last == '_')).then_some(())
    };
    ["t!(", "say!(", "key!("].into_iter().any(|call| called(call).is_some())
}

/// True for a word as people write it (a capital, then lower case), or for a literal used as a child element.
fn looks_like_words(literal: &Literal) -> bool {
    let is_name_of_key =
        literal.behind.starts_with("=>") || literal.behind.starts_with('|') || literal.before.ends_with('|');
    let letters: Vec<char> = literal.text.chars().collect();
    let sentence = letters.windows(3).enumerate().any(|(at, three)| {
        let begins = at == 0 || letters[at - 1] == ' ';
        begins && three[0].is_uppercase() && three[1].is_lowercase() && three[2].is_lowercase()
    });
    let shown = literal.before.ends_with(".child(")
        && letters.windows(2).any(|two| two.iter().all(|c| c.is_alphabetic()));
    (sentence && !is_name_of_key && !literal.text.contains('+') && !literal.before.ends_with("reason="))
        || shown
}

fn page() -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    sources(&root().join("app/src"), &mut found);
    found
}

#[test]
fn screens_contain_no_literal_text() {
    let mut bare = Vec::new();
    for (path, text) in page() {
        let inside = path.strip_prefix(root().join("app/src")).unwrap();
        if !inside.starts_with("screens") && !inside.starts_with("widgets") {
            continue;
        }
        for literal in literals(&text).iter().filter(|literal| !is_key(literal) && looks_like_words(literal))
        {
            bare.push(format!("{}:{}: {:?}", path.display(), literal.line, literal.text));
        }
        if text.contains("view!") {
            bare.push(format!("{}: view! writes markup, which the security policy refuses", path.display()));
        }
    }
    assert!(bare.is_empty(), "text that is not in the locale tables:\n{}", bare.join("\n"));
}

/// The keys that the page composes from job parameters and the words of their choices.
fn keys_of<T>(rows: &[Field<T>]) -> impl Iterator<Item = String> {
    rows.iter().flat_map(|row| {
        let words: &[&str] = if let ValueKind::Choice(words) = row.kind { words } else { &[] };
        let name = format!("page.cam.row.{}", row.key.replace('.', "_"));
        words.iter().map(|word| format!("page.cam.word.{word}")).chain([name]).collect::<Vec<_>>()
    })
}

#[test]
fn every_text_is_used() {
    let mut files = Vec::new();
    for folder in ["core/src", "host/src", "bridge/src", "app/src"] {
        sources(&root().join(folder), &mut files);
    }
    let all: String = files.into_iter().map(|(_, text)| text).collect();
    let mut used: BTreeSet<String> = all.split('"').map(str::to_owned).collect();
    used.extend(
        keys_of(parameters::SETUP).chain(keys_of(parameters::BIT)).chain(keys_of(parameters::OPERATION)),
    );
    // The locale tables use the language's name when they are built.
    used.insert("page.language".to_owned());
    used.extend(OperationKind::WORDS.iter().map(|word| format!("page.cam.word.{word}")));
    // `format!("grbl.error_{number}")` uses all texts whose keys start with `grbl.error_`.
    let begun: Vec<_> =
        all.split('"').filter_map(|text| text.split_once('{')).map(|(begins, _)| begins).collect();
    let is_beginning =
        |text: &str| text.contains('.') && text.chars().all(|c| c.is_ascii_lowercase() || "._".contains(c));
    let begun: BTreeSet<_> = begun.into_iter().filter(|text| is_beginning(text)).collect();
    let is_begun = |key: &str| begun.iter().any(|begins| format!("{key}.").starts_with(*begins));
    let is_used = |key: &str| used.contains(key) || is_begun(key);
    let stem = |key: &'static str| key.strip_suffix(".message").or_else(|| key.strip_suffix(".advice"));
    let left: BTreeSet<_> = locale::entries("en")
        .iter()
        .filter_map(|(key, _)| stem(key).or_else(|| key.starts_with("page.").then_some(key)))
        .filter(|key| !is_used(key))
        .collect();
    assert!(left.is_empty(), "texts that nothing shows:\n{left:#?}");
}

#[test]
fn every_section_and_group_of_the_settings_has_a_name() {
    for section in SECTIONS {
        let name = section.name;
        assert!(locale::lookup("en", &format!("page.section.{name}")).is_some(), "{name}");
    }
    for group in Group::ALL.map(Group::word) {
        assert!(locale::lookup("en", &format!("page.group.{group}")).is_some(), "{group}");
    }
}

#[test]
fn literal_scan_finds_planted_texts() {
    let rows = [
        (r#"span().child("Open files")"#, true),
        (r#"span().child("mm")"#, true),
        (r#"let text = "Drop them here";"#, true),
        (r#"span().child(t!("page.open"))"#, false),
        (r#"div().class("button large")"#, false),
        (r#"match key { "ArrowDown" => 1 }"#, false),
        ("// \"Nothing said\"", false),
        (r#"path().attr("d", "M12 3a9 9 0")"#, false),
    ];
    for (source, expected) in rows {
        let found = literals(source).iter().any(|literal| !is_key(literal) && looks_like_words(literal));
        assert_eq!(found, expected, "{source}");
    }
}
