//! The codes of diagnostics against the table of sentences, which is the table of codes: what the sources name has its sentence,
//! every sentence is of a code that somebody names, and whatever stands in its braces is filled where the code is named.
//!
//! ```text
//! Diagnostic::error("queue.no_zero")      a string that looks like a code: it is one, also where a helper is given it
//! format!("grbl.error_{number}")          names all that begin so
//! .with("row", …)   ("row", …)            a name that opens a bracket fills {row}, in its floor or one that names the code too
//! refuse("queue.no_zero").with("row", …)  and what is given to a code where it is named stands in its sentence
//! ```
//!
//! Comes in: the sources without their tests, the table. Goes out: a list of what is wrong. Whether the right helper is called is not
//! seen here: `locale::text` stops every test that says a sentence with a gap.

use crate::floor_plan::rust_files;
use annulus_core::{cam::parameters, locale, machine};
use annulus_tests::root;
use proc_macro2::{Delimiter, TokenStream, TokenTree};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;

/// What looks like a code and is none: the fields of the page that are undone by their names.
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

/// What several codes begin with.
const BEGINNINGS: &[&str] = &["board.outline"];

/// Arguments that no sentence says, because a program reads them, and which.
const READ: &[(&str, &str)] = &[
    ("field", "the Lab marks the argument of the row that is meant"),
    ("found", "JSON has what was found beside what was expected"),
];

/// Endings of files.
const ENDINGS: &[&str] = &[".toml", ".json", ".redb"];

/// Every code with the names in the braces of its message and advice.
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

/// The string that a token is.
fn text(token: &TokenTree) -> Option<String> {
    let TokenTree::Literal(literal) = token else { return None };
    Some(literal.to_string().strip_prefix('"')?.strip_suffix('"')?.to_owned())
}

/// The strings of a source, those of them that open a bracket, and which argument a string is given at once: `("code").with("name", …)`.
#[derive(Default)]
struct Strings {
    all: BTreeSet<String>,
    opening: BTreeSet<String>,
    given: BTreeSet<(String, String)>,
}

/// The string that opens the brackets of `token`.
fn opening(token: &TokenTree) -> Option<String> {
    let TokenTree::Group(group) = token else { return None };
    let first = group.stream().into_iter().next().filter(|_| group.delimiter() == Delimiter::Parenthesis);
    first.as_ref().and_then(text)
}

/// What a chain of calls gives to the string that opens its first brackets.
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
    /// Takes in what is neither an attribute nor for tests alone.
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

/// The strings of every floor: of a folder in `src`, or of a file that lies there by itself.
fn floors() -> BTreeMap<String, Strings> {
    let mut floors: BTreeMap<String, Strings> = BTreeMap::new();
    for folder in ["core/src", "drill/src", "bridge/src", "app/src"] {
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

/// Whether `text` names `code`: as it is, or by how it begins.
fn names(text: &str, code: &str) -> bool {
    let begins = || {
        text.split_once('{')
            .is_some_and(|(start, _)| is_word(start) && format!("{code}.message").starts_with(start))
    };
    text == code || begins()
}

/// Whether `text` is made as codes are: small letters with points between them.
fn is_word(text: &str) -> bool {
    let letters =
        |letter: char| letter.is_ascii_lowercase() || letter.is_ascii_digit() || matches!(letter, '_' | '.');
    text.contains('.')
        && text.starts_with(|first: char| first.is_ascii_lowercase())
        && text.chars().all(letters)
}

/// Whether the table, or another one, has `text`.
fn is_known(text: &str, codes: &BTreeMap<&str, BTreeSet<&str>>) -> bool {
    machine::setting(text).is_some()
        || parameters::OPERATION.iter().any(|row| row.key == text)
        || codes.contains_key(text)
        || locale::lookup("en", text).is_some()
        || FIELDS.contains(&text)
        || BEGINNINGS.contains(&text)
        || ENDINGS.iter().any(|ending| text.ends_with(ending))
}

/// Strings of the sources that look like codes and are in no table.
fn unknown(strings: &Strings, codes: &BTreeMap<&str, BTreeSet<&str>>) -> Vec<String> {
    let families: BTreeSet<&str> = codes.keys().filter_map(|code| code.split('.').next()).collect();
    let is_like = |text: &&String| {
        let is_whole = is_word(text) && !text.ends_with(['.', '_']);
        is_whole && text.split('.').next().is_some_and(|first| families.contains(first))
    };
    strings.all.iter().filter(is_like).filter(|text| !is_known(text, codes)).cloned().collect()
}

/// What no floor that names `code` fills; nothing where none names it.
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

/// What is given to codes that do not say it, nor does a program read it.
fn unsaid(strings: &Strings, codes: &BTreeMap<&str, BTreeSet<&str>>) -> Vec<String> {
    let is_unsaid = |code: &str, name: &str| {
        let of_code = codes.get(code).is_some_and(|wanted| !wanted.contains(name));
        of_code && !READ.iter().any(|(read, _)| *read == name)
    };
    let rows = strings.given.iter().filter(|(code, name)| is_unsaid(code, name));
    rows.map(|(code, name)| format!("{code} does not say {{{name}}}")).collect()
}

#[test]
fn every_code_has_its_sentence_and_every_sentence_its_code() {
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
fn the_scan_of_codes_finds_what_it_is_for() {
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
