//! Numbers as a language writes them, and as people type them.
//!
//! ```text
//! shown  pl   0.8 mm ─▶ 0,8 mm     X12.7 and board-1.2.drl stay: they are no measures
//! typed  0,8  0.8  ０．８ ─▶ 0.8      1,234.5 is refused: it can be read in two ways
//! ```
//!
//! Comes in: text. Goes out: text, or a number. Files are never written with any of this: in them the mark is the point.

/// Words that stand beside the numbers of a measure.
const BESIDE: &[&str] = &[
    "mm", "inch", "in", "µm", "m", "s", "ms", "min", "h", "Hz", "%", "×", "x", "X", "Y", "Z", "°", "…", "–",
    "mm/s", "mm/s²", "mm/s³", "mm²", "px/mm", "rpm", "V", "MB", ";",
];

/// Whether `language` writes the decimal mark as a comma.
fn has_comma(language: &str) -> bool {
    language == "pl"
}

/// A number alone: sign, digits, one point with digits at both sides.
fn is_number(word: &str) -> bool {
    let word = word.trim_matches(['-', '−', '+', '×', '%', '°', ';', '(', ')']);
    let digits = |part: &str| !part.is_empty() && part.bytes().all(|letter| letter.is_ascii_digit());
    word.split_once('.').map_or_else(|| digits(word), |(whole, rest)| digits(whole) && digits(rest))
}

/// `text` with the decimal mark of `language` where it is a measure: numbers and units, and nothing else.
pub fn number(language: &str, text: &str) -> String {
    let measure =
        has_comma(language) && text.split_whitespace().all(|word| is_number(word) || BESIDE.contains(&word));
    if measure { text.replace('.', ",") } else { text.to_owned() }
}

/// What people type for the letters of a number, as ASCII: the wide ones of Chinese keyboards, the true minus.
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

/// Whether a number was meant that has more than one mark, such as `1,234.5`, so that it can be read in two ways.
pub fn has_two_marks(text: &str) -> bool {
    let of_number = |letter: char| letter.is_ascii_digit() || matches!(letter, ',' | '.' | '-' | '+' | ' ');
    marks(text) > 1 && text.trim().chars().map(plain).all(of_number)
}

/// A number typed by a person: `0,8` is `0.8`. Both marks in one number, or a mark of thousands, is no number.
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
    fn measures_have_the_mark_of_their_language() {
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
    fn numbers_as_people_type_them() {
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
    fn what_can_be_read_in_two_ways_is_known() {
        for (text, expected) in
            [("1,234.5", true), ("1.234.567", true), ("0,8", false), ("a.b.c", false), ("", false)]
        {
            assert_eq!(has_two_marks(text), expected, "{text}");
        }
    }
}
