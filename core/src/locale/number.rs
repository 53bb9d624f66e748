//! Numbers in the notation of a language, and numbers that users type.
//!
//! ```text
//! shown  pl   0.8 mm ─▶ 0,8 mm     X12.7 and board-1.2.drl stay, because they are no measures
//! typed  0,8  0.8  ０．８ ─▶ 0.8      1,234.5 is refused, because it is ambiguous
//! ```
//!
//! Written files never use this: their decimal mark is always the point.

/// Words that may appear next to the numbers of a measure.
const BESIDE: &[&str] = &[
    "mm", "inch", "in", "µm", "m", "s", "ms", "min", "h", "Hz", "%", "×", "x", "X", "Y", "Z", "°", "…", "–",
    "mm/s", "mm/s²", "mm/s³", "mm²", "px/mm", "rpm", "V", "MB", ";",
];

fn has_comma(language: &str) -> bool {
    language == "pl"
}

/// True for a number: sign, digits, at most one point with digits on both sides.
fn is_number(word: &str) -> bool {
    let word = word.trim_matches(['-', '−', '+', '×', '%', '°', ';', '(', ')']);
    let digits = |part: &str| !part.is_empty() && part.bytes().all(|letter| letter.is_ascii_digit());
    word.split_once('.').map_or_else(|| digits(word), |(whole, rest)| digits(whole) && digits(rest))
}

/// `text` with the decimal mark of `language`, if it is a measure: only numbers and units.
pub fn number(language: &str, text: &str) -> String {
    let measure =
        has_comma(language) && text.split_whitespace().all(|word| is_number(word) || BESIDE.contains(&word));
    if measure { text.replace('.', ",") } else { text.to_owned() }
}

/// Converts the characters of a typed number to ASCII: full-width forms of Chinese keyboards, the real minus
/// sign.
fn plain(letter: char) -> char {
    match letter {
        '０'..='９' => char::from_u32(u32::from(letter) - 0xFEE0).unwrap_or(letter),
        '，' | '、' => ',',
        '．' | '。' => '.',
        '－' | '−' => '-',
        other => other,
    }
}

fn marks(text: &str) -> usize {
    text.chars().map(plain).filter(|letter| matches!(letter, ',' | '.')).count()
}

/// True for an ambiguous number with more than one mark, for example `1,234.5`.
pub fn has_two_marks(text: &str) -> bool {
    let of_number = |letter: char| letter.is_ascii_digit() || matches!(letter, ',' | '.' | '-' | '+' | ' ');
    marks(text) > 1 && text.trim().chars().map(plain).all(of_number)
}

/// Parses a typed number: `0,8` is `0.8`. None if it has both marks or a thousands separator.
pub fn typed(text: &str) -> Option<f64> {
    let text = text.trim();
    if marks(text) > 1 || text.is_empty() || text.contains(char::is_whitespace) {
        return None;
    }
    let plain: String = text.chars().map(plain).collect();
    plain.replace(',', ".").parse().ok().filter(|value: &f64| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measures_have_the_decimal_mark_of_the_language() {
        let rows = [
            ("0.8", "0,8"),
            ("-12.700", "-12,700"),
            ("0.8 mm", "0,8 mm"),
            ("100.5 × 80.0 mm", "100,5 × 80,0 mm"),
            ("1.5 2.25", "1,5 2,25"),
            ("85 %", "85 %"),
            ("X12.7", "X12.7"),
            ("T1C0.8", "T1C0.8"),
            ("board-1.2.drl", "board-1.2.drl"),
            ("0.1.0", "0.1.0"),
            ("my board 1.2", "my board 1.2"),
            ("", ""),
        ];
        for (text, polish) in rows {
            assert_eq!(number("pl", text), polish);
            assert_eq!(number("en", text), text);
            assert_eq!(number("zh", text), text);
        }
    }

    #[test]
    fn typed_numbers_are_read() {
        let rows = [
            ("0,8", Some(0.8)),
            (" 12.5 ", Some(12.5)),
            ("０．８", Some(0.8)),
            ("－３，５", Some(-3.5)),
            ("1,234.5", None),
            ("1.234.567", None),
            ("1 000", None),
            ("", None),
            ("-3", Some(-3.0)),
            ("1e999", None),
            ("three", None),
        ];
        for (text, value) in rows {
            assert_eq!(typed(text), value, "{text:?}");
        }
    }

    #[test]
    fn ambiguous_marks_are_recognised() {
        for (text, expected) in
            [("1,234.5", true), ("1.234.567", true), ("0,8", false), ("a.b.c", false), ("", false)]
        {
            assert_eq!(has_two_marks(text), expected, "{text}");
        }
    }
}
