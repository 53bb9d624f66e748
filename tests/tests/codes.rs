//! Checks diagnostic codes against the table of texts: every code in the sources has a text, every text has a
//! code in the sources, and every placeholder is filled where the code is used.
//!
//! ```text
//! Diagnostic::error("queue.no_zero")      a string that looks like a code is one, even in other calls
//! format!("grbl.error_{number}")          means all codes with this beginning
//! .with("row", …)   ("row", …)            fills {row}, in this folder or another that uses the code
//! refuse("queue.no_zero").with("row", …)  an argument given directly to a code must be in its text
//! ```
//!
//! Doesn't check that the right helper is called: `locale::text` panics in tests if a placeholder isn't
//! filled.

use crate::floor_plan::rust_files;
use annulus_core::{cam::parameters, locale, machine};
use annulus_tests::root;
use proc_macro2::{Delimiter, TokenStream, TokenTree};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;

/// Strings that look like codes but are names of undoable fields of the page.
const FIELDS: &[&str] = &[
    "queue.text",
    "servo.depth",
    "servo.duration",
    "servo.e0",
    "servo.gain",
    "servo.height",
    "servo.kd",
    "servo.ki",
    "servo.kp",
    "servo.load",
    "servo.sample",
    "servo.setpoint",
    "servo.tau",
];

/// Common beginnings of several codes.
const BEGINNINGS: &[&str] = &["board.outline"];

/// Arguments that are in no text because a program reads them, and which one.
const READ: &[(&str, &str)] = &[
    ("field", "the Lab marks the argument of the row that is meant"),
    ("found", "JSON has what was found beside what was expected"),
];

const ENDINGS: &[&str] = &[".toml", ".json", ".redb"];

/// Every code with the placeholders of its message and advice.
fn codes() -> BTreeMap<&'static str, BTreeSet<&'static str>> {
    let mut codes: BTreeMap<_, BTreeSet<_>> = BTreeMap::new();
    for (key, text) in locale::entries("en") {
        let Some(code) = key.strip_suffix(".message").or_else(|| key.strip_suffix(".advice")) else {
            continue;
        };
        codes.entry(code).or_default().extend(locale::names(text));
    }
    codes
}

/// The string literal of a token.
fn text(token: &TokenTree) -> Option<String> {
    let TokenTree::Literal(literal) = token else { return None };
    Some(literal.to_string().strip_prefix('"')?.strip_suffix('"')?.to_owned())
}

/// The strings of a source, those that are first in parentheses, and the arguments given directly to a
/// string: `("code").with("name", …)`.
#[derive(Default)]
struct Strings {
    all: BTreeSet<String>,
    opening: BTreeSet<String>,
    given: BTreeSet<(String, String)>,
}

/// The first string in the parentheses of `token`.
fn opening(token: &TokenTree) -> Option<String> {
    let TokenTree::Group(group) = token else { return None };
    let first = group.stream().into_iter().next().filter(|_| group.delimiter() == Delimiter::Parenthesis);
    first.as_ref().and_then(text)
}

/// The arguments that a chain of calls gives to the string in its first parentheses.
fn given(chain: &[TokenTree], out: &mut BTreeSet<(String, String)>) {
    let Some(code) = chain.first().and_then(opening) else { return };
    for call in chain[1..].chunks_exact(3) {
        let [TokenTree::Punct(point), TokenTree::Ident(name), inside @ TokenTree::Group(_)] = call else {
            return;
        };
        if point.as_char() != '.' {
            return;
        }
        if let Some(argument) = opening(inside).filter(|_| name == "with") {
            out.insert((code.clone(), argument));
        }
    }
}

impl Strings {
    /// Reads tokens, except attributes and test code.
    fn read(&mut self, tokens: TokenStream) {
        let (mut is_attribute, mut of_tests) = (false, false);
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        for (at, token) in tokens.iter().enumerate() {
            let is_text = !is_attribute && !of_tests;
            match token {
                TokenTree::Group(group) if is_text => {
                    self.opening.extend(opening(token));
                    given(&tokens[at..], &mut self.given);
                    self.read(group.stream());
                }
                TokenTree::Group(group) if is_attribute => {
                    of_tests |= group.stream().to_string().replace(' ', "") == "cfg(test)";
                }
                TokenTree::Group(group) => of_tests &= group.delimiter() != Delimiter::Brace,
                TokenTree::Punct(sign) => of_tests &= sign.as_char() != ';',
                TokenTree::Literal(_) if is_text => self.all.extend(text(token)),
                _ => {}
            }
            is_attribute = match token {
                TokenTree::Punct(sign) => sign.as_char() == '#' || (is_attribute && sign.as_char() == '!'),
                _ => false,
            };
        }
    }
}

fn strings(source: &str) -> Strings {
    let mut strings = Strings::default();
    strings.read(source.parse().unwrap());
    strings
}

/// The strings per folder in `src`, or per file directly in `src`.
fn floors() -> BTreeMap<String, Strings> {
    let mut floors: BTreeMap<String, Strings> = BTreeMap::new();
    for folder in ["core/src", "host/src", "bridge/src", "app/src"] {
        let mut files = Vec::new();
        rust_files(&root().join(folder), &mut files);
        assert!(files.len() > 10, "the sources of {folder} were not found");
        for path in files.iter().filter(|path| !path.to_string_lossy().replace(".rs", "/").contains("tests/"))
        {
            let inside = path.strip_prefix(root()).unwrap();
            let floor =
                inside.iter().take(3).map(|part| part.to_string_lossy()).collect::<Vec<_>>().join("/");
            let found = strings(&fs::read_to_string(path).unwrap());
            let strings = floors.entry(floor).or_default();
            strings.all.extend(found.all);
            strings.opening.extend(found.opening);
            strings.given.extend(found.given);
        }
    }
    floors
}

/// True if `text` names `code`, entirely or by its beginning.
fn names(text: &str, code: &str) -> bool {
    let begins = || {
        text.split_once('{')
            .is_some_and(|(start, _)| is_word(start) && format!("{code}.message").starts_with(start))
    };
    text == code || begins()
}

/// True if `text` looks like a code: lower-case words separated by points.
fn is_word(text: &str) -> bool {
    let letters =
        |letter: char| letter.is_ascii_lowercase() || letter.is_ascii_digit() || matches!(letter, '_' | '.');
    text.contains('.')
        && text.starts_with(|first: char| first.is_ascii_lowercase())
        && text.chars().all(letters)
}

/// True if this or another table has `text`.
fn is_known(text: &str, codes: &BTreeMap<&str, BTreeSet<&str>>) -> bool {
    machine::setting(text).is_some()
        || parameters::OPERATION.iter().any(|row| row.key == text)
        || codes.contains_key(text)
        || locale::lookup("en", text).is_some()
        || FIELDS.contains(&text)
        || BEGINNINGS.contains(&text)
        || ENDINGS.iter().any(|ending| text.ends_with(ending))
}

/// Strings of the sources that look like codes but are in no table.
fn unknown(strings: &Strings, codes: &BTreeMap<&str, BTreeSet<&str>>) -> Vec<String> {
    let families: BTreeSet<&str> = codes.keys().filter_map(|code| code.split('.').next()).collect();
    let is_like = |text: &&String| {
        let is_whole = is_word(text) && !text.ends_with(['.', '_']);
        is_whole && text.split('.').next().is_some_and(|first| families.contains(first))
    };
    strings.all.iter().filter(is_like).filter(|text| !is_known(text, codes)).cloned().collect()
}

/// The placeholders that no folder using `code` fills; empty if none uses it.
fn gaps(
    code: &str,
    wanted: &BTreeSet<&'static str>,
    floors: &BTreeMap<String, Strings>,
) -> Option<Vec<&'static str>> {
    let naming: Vec<_> =
        floors.values().filter(|floor| floor.all.iter().any(|text| names(text, code))).collect();
    let is_gap = |name: &&&str| !naming.iter().any(|floor| floor.opening.contains(**name));
    (!naming.is_empty()).then(|| wanted.iter().filter(is_gap).copied().collect())
}

/// Arguments given to codes whose text doesn't contain them, and that no program reads.
fn unsaid(strings: &Strings, codes: &BTreeMap<&str, BTreeSet<&str>>) -> Vec<String> {
    let is_unsaid = |code: &str, name: &str| {
        let of_code = codes.get(code).is_some_and(|wanted| !wanted.contains(name));
        of_code && !READ.iter().any(|(read, _)| *read == name)
    };
    let rows = strings.given.iter().filter(|(code, name)| is_unsaid(code, name));
    rows.map(|(code, name)| format!("{code} does not say {{{name}}}")).collect()
}

#[test]
fn every_code_has_a_text_and_every_text_a_code() {
    let (codes, floors) = (codes(), floors());
    let mut wrong = Vec::new();
    for (floor, strings) in &floors {
        wrong.extend(
            unknown(strings, &codes).into_iter().map(|text| format!("{floor}: \"{text}\" has no sentence")),
        );
    }
    wrong.extend(floors.values().flat_map(|strings| unsaid(strings, &codes)));
    for (code, wanted) in &codes {
        match gaps(code, wanted, &floors) {
            None => wrong.push(format!("{code}: nobody says it")),
            Some(gaps) if !gaps.is_empty() => wrong.push(format!("{code}: nobody fills {gaps:?}")),
            Some(_) => {}
        }
    }
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn code_scan_finds_planted_errors() {
    let source = r#"
        //! "queue.comment"
        #[doc = "queue.attribute"]
        fn a() { refuse("queue.one", 3).with("row", format!("queue.two_{n}")) }
        #[cfg(test)]
        mod tests { fn b() { error("queue.of_tests").with("turn", 1) } }
        #[cfg(test)]
        mod elsewhere;
        fn c() -> (&str, f64) { ("size", 1.0) }
    "#;
    let found = strings(source);
    assert_eq!(found.all, ["queue.one", "queue.two_{n}", "row", "size"].map(str::to_owned).into());
    assert_eq!(found.opening, ["queue.one", "queue.two_{n}", "row", "size"].map(str::to_owned).into());
    assert!(names("queue.two_{n}", "queue.two_7") && !names("queue.two_{n}", "queue.one"));
    let known = BTreeMap::from([("queue.two_7", BTreeSet::from(["row", "turn"]))]);
    assert_eq!(unknown(&found, &known), ["queue.one"]);
    assert_eq!(
        found.given,
        [("queue.one", "row")].map(|(code, name)| (code.to_owned(), name.to_owned())).into()
    );
    let taking = |name| BTreeMap::from([("queue.one", BTreeSet::from([name]))]);
    assert!(unsaid(&found, &taking("row")).is_empty());
    assert_eq!(unsaid(&found, &taking("turn")), ["queue.one does not say {row}"]);
    let floors = BTreeMap::from([("queue".to_owned(), found)]);
    assert_eq!(gaps("queue.two_7", &known["queue.two_7"], &floors), Some(vec!["turn"]));
    assert_eq!(gaps("queue.three", &known["queue.two_7"], &floors), None);
}
