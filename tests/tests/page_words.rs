//! Every text on the page is in the locale tables, and every key has a text. Parses Rust only as far as
//! string literals.

use annulus_core::cam::parameters::{self, Parameter};
use annulus_core::cam::work::OperationKind;
use annulus_core::locale;
use annulus_core::machine::ValueKind;
use annulus_tests::root;
use proc_macro2::{TokenStream, TokenTree};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn sources(folder: &Path, out: &mut Vec<(PathBuf, String)>) {
    let mut paths: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = fs::read_to_string(&path).unwrap();
            let end = text.find("\n#[cfg(test)]").unwrap_or(text.len());
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
fn every_key_of_the_page_has_its_text() {
    let mut missing = Vec::new();
    for (path, text) in page() {
        for literal in literals(&text).iter().filter(|literal| is_key(literal)) {
            let key = &literal.text;
            let diagnostic = [".message", ".advice"]
                .iter()
                .all(|part| locale::lookup("en", &format!("{key}{part}")).is_some());
            if locale::lookup("en", key).is_none() && !diagnostic {
                missing.push(format!("{}:{}: {key}", path.display(), literal.line));
            }
        }
    }
    assert!(missing.is_empty(), "keys without text:\n{}", missing.join("\n"));
}

/// The keys of every `t!` and `say!` in the tokens, with their argument names.
fn said(tokens: TokenStream, out: &mut Vec<(String, BTreeSet<String>)>) {
    let tokens: Vec<_> = tokens.into_iter().collect();
    for (at, token) in tokens.iter().enumerate() {
        let TokenTree::Group(group) = token else { continue };
        said(group.stream(), out);
        let is_call = at > 1 && ["t", "say"].contains(&tokens[at - 2].to_string().as_str());
        let inside: Vec<String> = group.stream().into_iter().map(|token| token.to_string()).collect();
        let key = inside.first().and_then(|first| first.strip_prefix('"')?.strip_suffix('"'));
        if let Some(key) = key.filter(|_| is_call && tokens[at - 1].to_string() == "!") {
            let named = inside.windows(3).filter(|three| three[0] == "," && three[2] == "=");
            out.push((key.to_owned(), named.map(|three| three[1].clone()).collect()));
        }
    }
}

#[test]
fn page_texts_get_exactly_their_arguments() {
    let mut all = Vec::new();
    page().into_iter().for_each(|(_, text)| said(text.parse().unwrap(), &mut all));
    assert!(all.len() > 500, "{} sentences: they were not found", all.len());
    let takes = |key: &str| {
        locale::lookup("en", key).map(|text| locale::names(text).map(str::to_owned).collect::<BTreeSet<_>>())
    };
    let wrong: Vec<_> = all
        .iter()
        .filter(|(key, given)| takes(key).is_some_and(|takes| takes != *given))
        .map(|(key, given)| format!("{key} takes {:?}, is given {given:?}", takes(key)))
        .collect();
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
    let mut one = Vec::new();
    said(r#"a(say!("page.x", n = 3, of = f(x == 1)), t!("page.y"))"#.parse().unwrap(), &mut one);
    let given = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect::<BTreeSet<_>>();
    assert_eq!(one, [("page.x".to_owned(), given(&["n", "of"])), ("page.y".to_owned(), given(&[]))]);
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
fn keys_of<T>(rows: &[Parameter<T>]) -> impl Iterator<Item = String> {
    rows.iter().flat_map(|row| {
        let words: &[&str] = if let ValueKind::Choice(words) = row.kind { words } else { &[] };
        let name = format!("page.cam.row.{}", row.key.replace('.', "_"));
        words.iter().map(|word| format!("page.cam.word.{word}")).chain([name]).collect::<Vec<_>>()
    })
}

#[test]
fn page_has_no_unused_texts() {
    let all: String = page().into_iter().map(|(_, text)| text).collect();
    let mut used: BTreeSet<String> = literals(&all).into_iter().map(|literal| literal.text).collect();
    used.extend(
        keys_of(parameters::SETUP).chain(keys_of(parameters::BIT)).chain(keys_of(parameters::OPERATION)),
    );
    // The locale tables use the language's name when they are built.
    used.insert("page.language".to_owned());
    used.extend(OperationKind::WORDS.iter().map(|word| format!("page.cam.word.{word}")));
    let stem = |key: &str| {
        key.strip_suffix(".message").or_else(|| key.strip_suffix(".advice")).unwrap_or(key).to_owned()
    };
    let left: Vec<_> = locale::entries("en")
        .iter()
        .map(|(key, _)| stem(key))
        .filter(|key| key.starts_with("page.") && !used.contains(key))
        .collect();
    assert!(left.is_empty(), "sentences nobody says:\n{}", left.join("\n"));
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
