//! The sentences, one table a language, made from `www/locales/*.toml` when the crate is built.
//!
//! ```text
//! native   every language is compiled in
//! wasm     English is; the page fetches the file of another when it is chosen, and [`install`]s it once
//! ```
//!
//! Comes in: language, key, arguments. Goes out: text, numbers as the language writes them. Does not know who asks.

mod number;
mod plural;

pub use number::{has_two_marks, number, typed};
pub use plural::{form, forms};

use std::borrow::Cow;
use std::sync::OnceLock;
use toml::de::{DeTable, DeValue};

mod tables {
    include!(concat!(env!("OUT_DIR"), "/locales.rs"));
}

/// The language that every key has, and that stands in where another has a gap.
pub const FALLBACK: &str = "en";

/// A table: keys in order, with their texts.
type Rows = Vec<(&'static str, &'static str)>;

/// The tables that came later, each written once and then only read.
static INSTALLED: [OnceLock<Rows>; tables::LANGUAGES.len()] =
    [const { OnceLock::new() }; tables::LANGUAGES.len()];

/// The languages there are: each by the name of its file, and by its own name.
pub fn languages() -> impl Iterator<Item = (&'static str, &'static str)> {
    tables::LANGUAGES.into_iter()
}

/// The language that serves somebody who reads `tag`, such as `zh-Hans-CN`, if there is one.
pub fn serving(tag: &str) -> Option<&'static str> {
    let first = tag.split(['-', '_', '.']).next().unwrap_or_default();
    languages().map(|(language, _)| language).find(|language| language.eq_ignore_ascii_case(first))
}

/// What `language` is called in the attributes of a page.
pub fn tag(language: &str) -> &str {
    if language == "zh" { "zh-Hans" } else { language }
}

/// Every key of `language` with its text, in order.
pub fn entries(language: &str) -> &'static [(&'static str, &'static str)] {
    let Some(at) = tables::TABLES.iter().position(|(name, _)| *name == language) else { return &[] };
    INSTALLED[at].get().map_or(tables::TABLES[at].1, Vec::as_slice)
}

/// Whether the table of `language` is there.
pub fn has(language: &str) -> bool {
    !entries(language).is_empty()
}

/// Takes the table of `language` in, the text of its file. False where that is no table; one that is there already stays.
pub fn install(language: &str, file: &str) -> bool {
    let place = tables::LANGUAGES.iter().position(|(name, _)| *name == language);
    let (Some(at), Ok(table)) = (place, DeTable::parse(file)) else { return false };
    let mut rows = Rows::new();
    flatten("", table.get_ref(), &mut rows);
    rows.sort_unstable();
    if rows.is_empty() {
        return false;
    }
    INSTALLED[at].get_or_init(|| rows);
    true
}

/// The rows of a table, its inner ones with their names in front. They stay as long as the page does.
fn flatten(prefix: &str, table: &DeTable<'_>, rows: &mut Rows) {
    for (name, value) in table {
        let name = name.get_ref();
        let key = if prefix.is_empty() { name.to_string() } else { format!("{prefix}.{name}") };
        match value.get_ref() {
            DeValue::String(text) => rows.push((key.leak(), text.to_string().leak())),
            DeValue::Table(inner) => flatten(&key, inner, rows),
            _ => {}
        }
    }
}

/// The raw text of `key`, from `language` or else from the fallback, with the language that it is in.
fn found<'a>(language: &'a str, key: &str) -> Option<(&'a str, &'static str)> {
    let find = |language: &'a str| {
        let rows = entries(language);
        rows.binary_search_by_key(&key, |(name, _)| name).ok().map(|index| (language, rows[index].1))
    };
    find(language).or_else(|| find(FALLBACK))
}

/// The raw text of `key`, from `language` or else from the fallback.
pub fn lookup(language: &str, key: &str) -> Option<&'static str> {
    found(language, key).map(|(_, text)| text)
}

/// What stands before an argument that is itself a key.
const WORD: char = '@';

/// An argument that is the word under `key`, in whatever language the sentence around it is.
pub fn word(key: &str) -> String {
    format!("{WORD}{key}")
}

/// What an argument, or a part of one, is made by that is the text under `key` with numbers of its own, in whatever language the
/// sentence around it is.
pub fn phrase(key: &str, numbers: &[(&str, String)]) -> String {
    let numbers: String = numbers.iter().map(|(name, number)| format!(" {name}={number}")).collect();
    format!("{PHRASE}{key}{numbers}{PHRASE_ENDS}")
}

/// What a phrase stands between.
const PHRASE: &str = "@{";
const PHRASE_ENDS: char = '}';

/// The text of what stands inside a phrase; none where nobody made it by [`phrase`].
fn phrase_text(language: &str, inside: &str) -> Option<String> {
    let mut parts = inside.split(' ');
    let key = parts.next()?;
    let numbers = parts.filter_map(|part| part.split_once('='));
    let numbers: Vec<_> = numbers.map(|(name, number)| (name.to_owned(), number.to_owned())).collect();
    let is_whole = names(lookup(language, key)?).all(|name| numbers.iter().any(|(own, _)| own == name));
    is_whole.then(|| text(language, key, &numbers))
}

/// What an argument says in `language`: its word where it is a key, its phrases in words, else what it is.
fn argument<'a>(language: &str, value: &'a str) -> Cow<'a, str> {
    if let Some(word) = value.strip_prefix(WORD).and_then(|key| lookup(language, key)) {
        return Cow::Borrowed(word);
    }
    let (mut out, mut rest) = (String::new(), value);
    while let Some((before, opened)) = rest.split_once(PHRASE) {
        let Some((inside, after)) = opened.split_once(PHRASE_ENDS) else { break };
        out.push_str(before);
        match phrase_text(language, inside) {
            Some(text) => out.push_str(&text),
            None => out.extend([PHRASE, inside, "}"]),
        }
        rest = after;
    }
    if out.is_empty() { Cow::Borrowed(rest) } else { Cow::Owned(out + rest) }
}

/// What stands in the braces of the raw `text`, in order: names of arguments, some with forms of a word behind them.
pub fn braces(text: &str) -> impl Iterator<Item = &str> {
    let opened = text.match_indices('{').map(|(at, _)| &text[at + 1..]);
    opened.filter_map(|rest| rest.split_once('}').map(|(inside, _)| inside))
}

/// The names of the arguments that the raw `text` takes, in order.
pub fn names(text: &str) -> impl Iterator<Item = &str> {
    braces(text).filter_map(|inside| inside.split('|').next())
}

/// The text of `key` with every `{name}` replaced by its argument: one made by [`word`] is put into the language, a measure has the
/// decimal mark of the language, and what stands in quotes is quoted as it is. Of `{name|hole|holes}` the form stands that goes with
/// the number. An unknown key gives the key itself, so that a gap is seen and never blank. An argument that is left out stops every test; a person
/// sees a dash.
pub fn text(language: &str, key: &str, args: &[(String, String)]) -> String {
    let Some((language, raw)) = found(language, key) else { return key.to_owned() };
    debug_assert!(
        names(raw).all(|name| args.iter().any(|(argument, _)| argument == name)),
        "{key} takes more than it is given: {raw} {args:?}"
    );
    let mut out = String::with_capacity(raw.len());
    let mut rest = raw;
    while let Some(open) = rest.find('{') {
        out.push_str(&rest[..open]);
        let Some(close) = rest[open..].find('}') else { break };
        let inside = &rest[open + 1..open + close];
        let (name, forms) =
            inside.split_once('|').map_or((inside, None), |(name, forms)| (name, Some(forms)));
        match (args.iter().find(|(argument, _)| argument == name), forms) {
            (Some((_, value)), Some(forms)) => out.push_str(form_of(language, value, forms)),
            (Some((_, value)), None) if out.ends_with(QUOTES) => out.push_str(&argument(language, value)),
            (Some((_, value)), None) => out.push_str(&number(language, &argument(language, value))),
            _ => out.push(LEFT_OUT),
        }
        rest = &rest[open + close + 1..];
    }
    out.push_str(rest);
    out
}

/// What stands for an argument that is left out: braces are nobody's to read.
const LEFT_OUT: char = '–';

/// What begins a quotation in one of the languages.
const QUOTES: [char; 4] = ['"', '„', '“', '「'];

/// Of `forms`, the one that goes with the number `value`; where it was left out, the last.
fn form_of<'a>(language: &str, value: &str, forms: &'a str) -> &'a str {
    let mut all = forms.split('|');
    all.nth(form(language, value.trim())).or_else(|| forms.split('|').next_back()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_go_where_their_names_stand() {
        let args = ["place", "name"].map(|name| (name.to_owned(), "T7".to_owned()));
        assert_eq!(text("en", "test.greeting", &args), "Tool T7 is T7.");
        assert_eq!(names("{place|a|b} of {count}").collect::<Vec<_>>(), ["place", "count"]);
    }

    #[test]
    #[cfg(not(debug_assertions))]
    fn an_argument_that_is_left_out_is_a_dash() {
        assert_eq!(text("en", "test.greeting", &[("name".to_owned(), "T7".to_owned())]), "Tool T7 is –.");
    }

    #[test]
    #[cfg(debug_assertions)]
    #[should_panic(expected = "test.greeting takes more than it is given")]
    fn an_argument_that_is_left_out_stops_the_test() {
        text("en", "test.greeting", &[("name".to_owned(), "T7".to_owned())]);
    }

    #[test]
    fn arguments_that_are_words_follow_the_language() {
        let place = ("place".to_owned(), "here".to_owned());
        let said = |value| text("xx", "test.greeting", &[("name".to_owned(), value), place.clone()]);
        assert_eq!(said(word("page.cam.word.cut_out")), "Tool Cut out is here.");
        assert_eq!(said("@home".to_owned()), "Tool @home is here.", "a person may begin a name so");
    }

    #[test]
    fn arguments_that_are_phrases_follow_the_language_and_its_decimal_mark() {
        let vee = phrase("tool.vee", &[("angle", "30".to_owned()), ("tip", "0.1".to_owned())]);
        let drill = phrase("tool.drill", &[("size", "0.8".to_owned())]);
        let rows = [
            (vee.clone(), "V-bit 30°, tip 0.1", "frez V 30°, ostrze 0,1"),
            (
                format!("{drill}, {vee}"),
                "drill 0.8, V-bit 30°, tip 0.1",
                "wiertło 0,8, frez V 30°, ostrze 0,1",
            ),
            (format!("my 0.8 · {drill}"), "my 0.8 · drill 0.8", "my 0.8 · wiertło 0,8"),
            // Names that a person gave.
            ("@{tool.vee}".to_owned(), "@{tool.vee}", "@{tool.vee}"),
            ("@{no.key} 0.5".to_owned(), "@{no.key} 0.5", "@{no.key} 0.5"),
            ("@{tool.vee".to_owned(), "@{tool.vee", "@{tool.vee"),
        ];
        for (name, english, polish) in rows {
            for (language, wanted) in [("en", english), ("pl", polish)] {
                let said = text(language, "preflight.first_bit.message", &[("bit".to_owned(), name.clone())]);
                assert!(said.contains(wanted), "{said}");
            }
        }
    }

    #[test]
    fn words_follow_their_number() {
        let said =
            |count: &str| text("en", "plan.no_size.message", &[("holes".to_owned(), count.to_owned())]);
        assert_eq!(said("1"), "1 hole has no size in the files.");
        assert_eq!(said("0"), "0 holes have no size in the files.");
        assert_eq!(said("21"), "21 holes have no size in the files.");
    }

    #[test]
    fn no_sentence_counts_one_thing_as_many() {
        // Bounds are never one.
        let bounds = ["most", "megabytes", "files", "runs"];
        let nouns = [
            "hole", "slot", "finding", "line", "layer", "contour", "place", "way", "bit", "row", "stroke",
            "step", "net", "island", "piece",
        ];
        // Here "steps" is what an axis does.
        for (key, raw) in entries("en").iter().filter(|(key, _)| *key != "check.direction_setup.message") {
            let args: Vec<_> = names(raw)
                .map(|name| (name.to_owned(), if bounds.contains(&name) { "7" } else { "1" }.to_owned()))
                .collect();
            let said = text("en", key, &args);
            for noun in nouns {
                let many = format!("1 {noun}s");
                let found =
                    said.find(&many).filter(|&at| !said[..at].ends_with(|c: char| c.is_ascii_digit()));
                assert!(found.is_none(), "{key}: {said}");
            }
        }
    }

    #[test]
    fn a_slot_and_a_gap_of_copper_are_two_words_in_polish() {
        let has = |text: &str, words: [&str; 2]| words.iter().any(|word| text.to_lowercase().contains(word));
        let mut gaps = 0;
        for (key, english) in entries("en") {
            let polish = lookup("pl", key).unwrap_or_default();
            let (slot, gap) = (has(english, ["slot ", "slots"]), has(english, [" gap", "gap "]));
            assert!(slot || !gap || !polish.to_lowercase().contains("szczelin"), "{key}: {polish}");
            gaps += u32::from(gap && polish.to_lowercase().contains("odstęp"));
        }
        assert!(gaps > 10, "gaps have a word: {gaps}");
    }

    #[test]
    fn a_form_that_is_left_out_is_the_last_one() {
        let said = |count| form_of("pl", count, "otwór|otwory|otworów");
        assert_eq!(["1", "4", "12", "2.5"].map(said), ["otwór", "otwory", "otworów", "otworów"]);
    }

    #[test]
    fn a_language_is_found_by_what_a_browser_calls_it() {
        let rows = [("en-GB", Some("en")), ("EN", Some("en")), ("xx", None), ("", None)];
        for (tag, expected) in rows {
            assert_eq!(serving(tag), expected, "{tag}");
        }
    }

    #[test]
    fn what_is_no_table_is_not_taken_in() {
        assert!(!install("en", "no table = ["));
        assert!(!install("en", "number = 3"));
        assert!(!install("xx", "[a]\nb = \"c\""));
        assert_eq!(lookup("en", "page.name"), Some("Annulus"));
    }

    #[test]
    fn a_file_becomes_rows_in_order() {
        let mut rows = Rows::new();
        flatten(
            "",
            DeTable::parse("z = \"1\"\n[b]\nd = \"2\"\n[b.c]\ne = \"3\"").unwrap().get_ref(),
            &mut rows,
        );
        rows.sort_unstable();
        assert_eq!(rows, [("b.c.e", "3"), ("b.d", "2"), ("z", "1")]);
    }

    #[test]
    fn an_unknown_key_is_shown_rather_than_blank() {
        assert_eq!(text("en", "no.such.key", &[]), "no.such.key");
    }

    #[test]
    fn an_unknown_language_falls_back() {
        assert_eq!(lookup("xx", "test.greeting"), lookup("en", "test.greeting"));
    }
}
