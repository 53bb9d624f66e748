//! The sentences, one table a language, made from `www/locales/*.toml` when the crate is built.
//!
//! Comes in: language, key, arguments. Goes out: text. Does not know who asks.

mod tables {
    include!(concat!(env!("OUT_DIR"), "/locales.rs"));
}

/// The language that every key has, and that stands in where another has a gap.
pub const FALLBACK: &str = "en";

/// The languages there are, by file name.
pub fn languages() -> impl Iterator<Item = &'static str> {
    tables::TABLES.iter().map(|(language, _)| *language)
}

/// Every key of `language` with its text, in order.
pub fn entries(language: &str) -> &'static [(&'static str, &'static str)] {
    tables::TABLES.iter().find(|(name, _)| *name == language).map_or(&[], |(_, rows)| rows)
}

/// The raw text of `key`, from `language` or else from the fallback.
pub fn lookup(language: &str, key: &str) -> Option<&'static str> {
    let find = |language| {
        let rows = entries(language);
        rows.binary_search_by_key(&key, |(name, _)| name).ok().map(|index| rows[index].1)
    };
    find(language).or_else(|| find(FALLBACK))
}

/// What stands before an argument that is itself a key.
const WORD: char = '@';

/// An argument that is the word under `key`, in whatever language the sentence around it is.
pub fn word(key: &str) -> String {
    format!("{WORD}{key}")
}

/// What an argument says in `language`: its word where it is a key, else what it is.
fn argument<'a>(language: &str, value: &'a str) -> &'a str {
    value.strip_prefix(WORD).and_then(|key| lookup(language, key)).unwrap_or(value)
}

/// The text of `key` with every `{name}` replaced by its argument; one made by [`word`] is put into the language. Of
/// `{name|hole|holes}` the first word stands where the argument is 1, the second one else. An unknown key gives the key itself,
/// so that a gap is seen and never blank.
pub fn text(language: &str, key: &str, args: &[(String, String)]) -> String {
    let Some(raw) = lookup(language, key) else { return key.to_owned() };
    let mut out = String::with_capacity(raw.len());
    let mut rest = raw;
    while let Some(open) = rest.find('{') {
        out.push_str(&rest[..open]);
        let Some(close) = rest[open..].find('}') else { break };
        let inside = &rest[open + 1..open + close];
        let mut forms = inside.split('|');
        let name = forms.next().unwrap_or_default();
        match (args.iter().find(|(argument, _)| argument == name), forms.next(), forms.next()) {
            (Some((_, value)), Some(one), Some(many)) => out.push_str(if value == "1" { one } else { many }),
            (Some((_, value)), ..) => out.push_str(argument(language, value)),
            _ => out.push_str(&rest[open..=open + close]),
        }
        rest = &rest[open + close + 1..];
    }
    out.push_str(rest);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_go_where_their_names_stand() {
        let args = [("name".to_owned(), "T7".to_owned())];
        assert_eq!(text("en", "test.greeting", &args), "Tool T7 is {unknown}.");
    }

    #[test]
    fn arguments_that_are_words_follow_the_language() {
        let said = |value: String| text("xx", "test.greeting", &[("name".to_owned(), value)]);
        assert_eq!(said(word("page.cam.word.cut_out")), "Tool Cut out is {unknown}.");
        assert_eq!(said("@home".to_owned()), "Tool @home is {unknown}.", "a person may begin a name so");
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
            let names = raw.split('{').skip(1).filter_map(|part| part.split(['}', '|']).next());
            let args: Vec<_> = names
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
    fn an_unknown_key_is_shown_rather_than_blank() {
        assert_eq!(text("en", "no.such.key", &[]), "no.such.key");
    }

    #[test]
    fn an_unknown_language_falls_back() {
        assert_eq!(lookup("xx", "test.greeting"), lookup("en", "test.greeting"));
    }
}
