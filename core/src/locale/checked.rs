//! Comparison of a key and its arguments with the English table, at compile time.

use super::tables::ARGUMENTS;
use std::cmp::Ordering;

/// True if `key` is a text or a code and takes every name in `given`, and, if `whole`, no other.
pub const fn fits(key: &str, given: &[&str], whole: bool) -> bool {
    let (mut low, mut high) = (0, ARGUMENTS.len());
    while low < high {
        let middle = low + (high - low) / 2;
        let (found, takes) = ARGUMENTS[middle];
        match order(found.as_bytes(), key.as_bytes()) {
            Ordering::Less => low = middle + 1,
            Ordering::Greater => high = middle,
            Ordering::Equal => return has_all(takes, given) && (!whole || has_all(given, takes)),
        }
    }
    false
}

const fn has_all(names: &[&str], wanted: &[&str]) -> bool {
    let mut at = 0;
    while at < wanted.len() {
        let mut other = 0;
        while other < names.len() && !order(names[other].as_bytes(), wanted[at].as_bytes()).is_eq() {
            other += 1;
        }
        if other == names.len() {
            return false;
        }
        at += 1;
    }
    true
}

/// Order of two texts by bytes; `Ord` of the standard library isn't `const`.
const fn order(a: &[u8], b: &[u8]) -> Ordering {
    let mut at = 0;
    while at < a.len() && at < b.len() {
        if a[at] != b[at] {
            return if a[at] < b[at] { Ordering::Less } else { Ordering::Greater };
        }
        at += 1;
    }
    if a.len() < b.len() {
        Ordering::Less
    } else if a.len() > b.len() {
        Ordering::Greater
    } else {
        Ordering::Equal
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::locale::{entries, names};

    #[test]
    fn keys_and_codes_take_exactly_their_arguments() {
        let rows: [(&str, &[&str], bool, bool); 8] = [
            ("test.greeting", &["name", "place"], true, true),
            ("test.greeting", &["name"], true, false),
            ("test.greeting", &["name"], false, true),
            ("test.greeting", &["name", "place", "time"], false, false),
            ("test.greetings", &[], false, false),
            ("files.missing", &["path"], true, true),
            ("files.missing.advice", &[], true, true),
            ("", &[], false, false),
        ];
        for (key, given, whole, expected) in rows {
            assert_eq!(fits(key, given, whole), expected, "{key} {given:?} {whole}");
        }
    }

    #[test]
    fn every_text_fits_its_own_arguments() {
        for (key, text) in entries("en") {
            assert!(fits(key, &names(text).collect::<Vec<_>>(), true), "{key}");
        }
    }
}
