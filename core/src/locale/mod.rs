//! The texts of all languages, one table each. The build script generates them from `www/locales/*.toml`.
//!
//! ```text
//! native   every language is compiled in
//! wasm     only English is; the page fetches another language when chosen, and [`install`]s it once
//! ```

mod checked;
mod number;
mod plural;

pub use checked::fits;
pub use number::{has_two_marks, number, typed};
pub use plural::{form, forms};

use std::borrow::Cow;
use std::sync::OnceLock;
use toml::de::{DeTable, DeValue};

mod tables {
    include!(concat!(env!("OUT_DIR"), "/locales.rs"));
}

/// This language has every key, and fills the gaps of the others.
pub const FALLBACK: &str = "en";

/// The comment at the head of a drill file that Annulus writes, by which it knows the file again.
pub const WRITTEN_BY: &str = ";Written by Annulus";

/// A table: keys in order, with their texts.
type Rows = Vec<(&'static str, &'static str)>;

/// Tables loaded at run time, each written once and then only read.
static INSTALLED: [OnceLock<Rows>; tables::LANGUAGES.len()] =
    [const { OnceLock::new() }; tables::LANGUAGES.len()];

/// All languages: file name and native name.
pub fn languages() -> impl Iterator<Item = (&'static str, &'static str)> {
    tables::LANGUAGES.into_iter()
}

/// The language for a browser's language tag, for example `zh-Hans-CN`; none if it isn't supported.
pub fn serving(tag: &str) -> Option<&'static str> {
    let first = tag.split(['-', '_', '.']).next().unwrap_or_default();
    languages().map(|(language, _)| language).find(|language| language.eq_ignore_ascii_case(first))
}

pub fn tag(language: &str) -> &str {
    if language == "zh" { "zh-Hans" } else { language }
}

/// Every key of `language` with its text, in order.
pub fn entries(language: &str) -> &'static [(&'static str, &'static str)] {
    let Some(at) = tables::TABLES.iter().position(|(name, _)| *name == language) else { return &[] };
    INSTALLED[at].get().map_or(tables::TABLES[at].1, Vec::as_slice)
}

/// True if the table of `language` is loaded.
pub fn has(language: &str) -> bool {
    !entries(language).is_empty()
}

/// Loads the table of `language` from the text of its file. False if that isn't a table. A loaded table
/// stays.
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

/// Flattens a table into dotted keys. The strings are leaked, because tables are used as long as the page
/// lives.
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

/// The raw text of `key` in `language` or else in the fallback, and the language found.
fn found<'a>(language: &'a str, key: &str) -> Option<(&'a str, &'static str)> {
    let find = |language: &'a str| {
        let rows = entries(language);
        rows.binary_search_by_key(&key, |(name, _)| name).ok().map(|index| (language, rows[index].1))
    };
    find(language).or_else(|| find(FALLBACK))
}

/// The raw text of `key` in `language` or else in the fallback.
pub fn lookup(language: &str, key: &str) -> Option<&'static str> {
    found(language, key).map(|(_, text)| text)
}

/// Prefix of an argument that is itself a key.
const WORD: char = '@';

/// An argument that is translated: the text of `key` in the language of the sentence.
pub fn word(key: &str) -> String {
    format!("{WORD}{key}")
}

/// Part of an argument that is translated: the text of `key`, with its own numbers, in the language of the
/// sentence.
pub fn phrase(key: &str, numbers: &[(&str, String)]) -> String {
    let numbers: String = numbers.iter().map(|(name, number)| format!(" {name}={number}")).collect();
    format!("{PHRASE}{key}{numbers}{PHRASE_ENDS}")
}

/// Delimiters of a phrase.
const PHRASE: &str = "@{";
const PHRASE_ENDS: char = '}';

/// The text of a phrase without its delimiters; none if [`phrase`] didn't make it.
fn phrase_text(language: &str, inside: &str) -> Option<String> {
    let mut parts = inside.split(' ');
    let key = parts.next()?;
    let numbers = parts.filter_map(|part| part.split_once('='));
    let numbers: Vec<_> = numbers.map(|(name, number)| (name.to_owned(), number.to_owned())).collect();
    // A name that a user typed may look like a phrase, but it lacks the numbers.
    let is_whole = names(lookup(language, key)?).all(|name| numbers.iter().any(|(own, _)| own == name));
    is_whole.then(|| text(language, key, &numbers))
}

/// The argument in `language`, with keys and phrases translated.
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

/// The contents of all braces in the raw `text`, in order: argument names, some with word forms after a bar.
pub fn braces(text: &str) -> impl Iterator<Item = &str> {
    let opened = text.match_indices('{').map(|(at, _)| &text[at + 1..]);
    opened.filter_map(|rest| rest.split_once('}').map(|(inside, _)| inside))
}

/// The argument names in the raw `text`, in order.
pub fn names(text: &str) -> impl Iterator<Item = &str> {
    braces(text).filter_map(|inside| inside.split('|').next())
}

/// The text of `key`, with every `{name}` replaced by its argument:
/// - an argument of [`word`] is translated,
/// - a measure gets the decimal mark of the language,
/// - quoted arguments stay unchanged,
/// - `{name|hole|holes}` becomes the form for the number.
///
/// An unknown key returns the key itself, so that a gap is visible. A missing argument fails in debug builds;
/// in release builds it becomes a dash.
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
            // Quoted arguments are names, never measures.
            (Some((_, value)), None) if out.ends_with(QUOTES) => out.push_str(&argument(language, value)),
            (Some((_, value)), None) => out.push_str(&number(language, &argument(language, value))),
            _ => out.push(LEFT_OUT),
        }
        rest = &rest[open + close + 1..];
    }
    out.push_str(rest);
    out
}

/// Replaces a missing argument, because users can't read braces.
const LEFT_OUT: char = '–';

/// Opening quotation marks of the languages.
const QUOTES: [char; 4] = ['"', '„', '“', '「'];

/// The form in `forms` for the number `value`; the last one if that form is missing.
fn form_of<'a>(language: &str, value: &str, forms: &'a str) -> &'a str {
    let mut all = forms.split('|');
    all.nth(form(language, value.trim())).or_else(|| forms.split('|').next_back()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_replace_their_names() {
        let args = ["place", "name"].map(|name| (name.to_owned(), "T7".to_owned()));
        assert_eq!(text("en", "test.greeting", &args), "Tool T7 is T7.");
        assert_eq!(names("{place|a|b} of {count}").collect::<Vec<_>>(), ["place", "count"]);
    }

    #[test]
    #[cfg(not(debug_assertions))]
    fn missing_argument_is_a_dash() {
        assert_eq!(text("en", "test.greeting", &[("name".to_owned(), "T7".to_owned())]), "Tool T7 is –.");
    }

    #[test]
    #[cfg(debug_assertions)]
    #[should_panic(expected = "test.greeting takes more than it is given")]
    fn missing_argument_fails_the_test() {
        text("en", "test.greeting", &[("name".to_owned(), "T7".to_owned())]);
    }

    #[test]
    fn word_arguments_follow_the_language() {
        let place = ("place".to_owned(), "here".to_owned());
        let said = |value| text("xx", "test.greeting", &[("name".to_owned(), value), place.clone()]);
        assert_eq!(said(word("page.cam.word.cut_out")), "Tool Cut out is here.");
        assert_eq!(said("@home".to_owned()), "Tool @home is here.", "a person may begin a name so");
    }

    #[test]
    fn phrase_arguments_follow_language_and_decimal_mark() {
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
            // Names that a user typed.
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
    fn plural_words_follow_their_number() {
        let said =
            |count: &str| text("en", "plan.no_size.message", &[("holes".to_owned(), count.to_owned())]);
        assert_eq!(said("1"), "1 hole has no size in the files.");
        assert_eq!(said("0"), "0 holes have no size in the files.");
        assert_eq!(said("21"), "21 holes have no size in the files.");
    }

    #[test]
    fn no_text_has_a_plural_after_one() {
        // Limits are never one.
        let bounds = ["most", "megabytes", "files", "runs"];
        let nouns = [
            "hole", "slot", "problem", "line", "layer", "contour", "position", "toolpath", "tool", "row",
            "cycle", "stroke", "step", "net", "island", "piece", "segment",
        ];
        // In this message, "steps" is a verb.
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
    fn slot_and_gap_are_two_words_in_polish() {
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
    fn missing_plural_form_is_the_last_one() {
        let said = |count| form_of("pl", count, "otwór|otwory|otworów");
        assert_eq!(["1", "4", "12", "2.5"].map(said), ["otwór", "otwory", "otworów", "otworów"]);
    }

    #[test]
    fn language_is_found_by_its_browser_tag() {
        let rows = [("en-GB", Some("en")), ("EN", Some("en")), ("xx", None), ("", None)];
        for (tag, expected) in rows {
            assert_eq!(serving(tag), expected, "{tag}");
        }
    }

    #[test]
    fn invalid_table_is_not_installed() {
        assert!(!install("en", "no table = ["));
        assert!(!install("en", "number = 3"));
        assert!(!install("xx", "[a]\nb = \"c\""));
        assert_eq!(lookup("en", "page.name"), Some("Annulus"));
    }

    #[test]
    fn language_file_becomes_ordered_rows() {
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
    fn unknown_key_is_shown_rather_than_blank() {
        assert_eq!(text("en", "no.such.key", &[]), "no.such.key");
    }

    #[test]
    fn unknown_language_falls_back_to_english() {
        assert_eq!(lookup("xx", "test.greeting"), lookup("en", "test.greeting"));
    }
}
