//! Plural forms by the CLDR rules, for the supported languages.
//!
//! ```text
//! en  1 | else                    hole | holes
//! pl  1 | 2–4 | 5– | fractions    otwór | otwory | otworów | otworu
//! zh  one form for all            孔
//! ```
//!
//! Three short rules instead of a library, because a library would add the rules of two hundred languages to
//! the page. Tests compare these rules with the library of the Unicode consortium, number by number.

/// Index of the form for `number` in `language`; the last form if `number` isn't a number.
pub fn form(language: &str, number: &str) -> usize {
    let whole = number.strip_prefix('-').unwrap_or(number).parse::<u64>().ok();
    match (language, whole) {
        ("zh", _) | ("pl", Some(1)) | (_, Some(1)) => 0,
        ("pl", Some(number)) => {
            let few = (2..=4).contains(&(number % 10)) && !(12..=14).contains(&(number % 100));
            if few { 1 } else { 2 }
        }
        ("pl", None) => 3,
        _ => 1,
    }
}

/// Number of forms in `language`. The last one, for fractions, may be omitted.
pub fn forms(language: &str) -> usize {
    match language {
        "zh" => 1,
        "pl" => 4,
        _ => 2,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_number_has_its_plural_form() {
        let rows = [
            ("en", "1", 0),
            ("en", "0", 1),
            ("en", "21", 1),
            ("en", "1.5", 1),
            ("en", "–", 1),
            ("pl", "1", 0),
            ("pl", "3", 1),
            ("pl", "22", 1),
            ("pl", "0", 2),
            ("pl", "5", 2),
            ("pl", "12", 2),
            ("pl", "112", 2),
            ("pl", "21", 2),
            ("pl", "1.5", 3),
            ("zh", "1", 0),
            ("zh", "7", 0),
        ];
        for (language, number, expected) in rows {
            assert_eq!(form(language, number), expected, "{language} {number}");
            assert!(form(language, number) < forms(language));
        }
    }
}
