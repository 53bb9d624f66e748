//! Bytes as lines of text: byte-order marks, UTF-16, and all line ends.

use std::borrow::Cow;

/// The text without a byte-order mark. UTF-16 is narrowed to bytes; other characters than ASCII become `?`.
pub(super) fn decode(bytes: &[u8]) -> Cow<'_, [u8]> {
    match bytes {
        [0xEF, 0xBB, 0xBF, rest @ ..] => Cow::Borrowed(rest),
        [0xFF, 0xFE, rest @ ..] => Cow::Owned(narrow(rest, u16::from_le_bytes)),
        [0xFE, 0xFF, rest @ ..] => Cow::Owned(narrow(rest, u16::from_be_bytes)),
        _ => Cow::Borrowed(bytes),
    }
}

fn narrow(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Vec<u8> {
    let (pairs, _) = bytes.as_chunks::<2>();
    pairs.iter().map(|&pair| u8::try_from(unit(pair)).ok().filter(u8::is_ascii).unwrap_or(b'?')).collect()
}

/// Letters in layer words that macOS stores as two characters: the composed letter, the plain letter, the
/// combining mark.
const COMPOSED: [(char, char, char); 44] = [
    ('ä', 'a', '\u{308}'),
    ('ë', 'e', '\u{308}'),
    ('ï', 'i', '\u{308}'),
    ('ö', 'o', '\u{308}'),
    ('ü', 'u', '\u{308}'),
    ('á', 'a', '\u{301}'),
    ('é', 'e', '\u{301}'),
    ('í', 'i', '\u{301}'),
    ('ó', 'o', '\u{301}'),
    ('ú', 'u', '\u{301}'),
    ('ý', 'y', '\u{301}'),
    ('ć', 'c', '\u{301}'),
    ('ń', 'n', '\u{301}'),
    ('ś', 's', '\u{301}'),
    ('ź', 'z', '\u{301}'),
    ('à', 'a', '\u{300}'),
    ('è', 'e', '\u{300}'),
    ('ì', 'i', '\u{300}'),
    ('ò', 'o', '\u{300}'),
    ('ù', 'u', '\u{300}'),
    ('â', 'a', '\u{302}'),
    ('ê', 'e', '\u{302}'),
    ('î', 'i', '\u{302}'),
    ('ô', 'o', '\u{302}'),
    ('û', 'u', '\u{302}'),
    ('ã', 'a', '\u{303}'),
    ('ñ', 'n', '\u{303}'),
    ('õ', 'o', '\u{303}'),
    ('ç', 'c', '\u{327}'),
    ('ą', 'a', '\u{328}'),
    ('ę', 'e', '\u{328}'),
    ('ż', 'z', '\u{307}'),
    ('ő', 'o', '\u{30b}'),
    ('ű', 'u', '\u{30b}'),
    ('å', 'a', '\u{30a}'),
    ('ů', 'u', '\u{30a}'),
    ('č', 'c', '\u{30c}'),
    ('ď', 'd', '\u{30c}'),
    ('ě', 'e', '\u{30c}'),
    ('ř', 'r', '\u{30c}'),
    ('š', 's', '\u{30c}'),
    ('ž', 'z', '\u{30c}'),
    ('й', 'и', '\u{306}'),
    ('ё', 'е', '\u{308}'),
];

/// Composes letters and combining marks, for file names from macOS. Drops unknown marks.
pub(super) fn composed(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        let before = out.chars().next_back();
        let whole = before.and_then(|before| with_mark(before, letter));
        if let Some(whole) = whole {
            out.pop();
            out.push(whole);
        } else if !('\u{300}'..='\u{36f}').contains(&letter) {
            out.push(letter);
        }
    }
    out
}

/// Composes a letter with the following mark or Korean syllable part.
fn with_mark(before: char, mark: char) -> Option<char> {
    let (base, next) = (u32::from(before), u32::from(mark));
    let code = match mark {
        '\u{3099}' => base + 1,
        '\u{309a}' => base + 2,
        // Korean: a vowel after the initial consonant, then the final consonant.
        '\u{1161}'..='\u{1175}' if (0x1100..=0x1112).contains(&base) => {
            0xac00 + ((base - 0x1100) * 21 + next - 0x1161) * 28
        }
        '\u{11a8}'..='\u{11c2}' if (0xac00..=0xd7a3).contains(&base) && (base - 0xac00) % 28 == 0 => {
            base + next - 0x11a7
        }
        _ => {
            let small = before.to_lowercase().next()?;
            let row = COMPOSED.iter().find(|(_, letter, own)| (*letter, *own) == (small, mark))?;
            return if small == before { Some(row.0) } else { row.0.to_uppercase().next() };
        }
    };
    char::from_u32(code)
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Line<'a> {
    /// From 1.
    pub(super) number: u32,
    pub(super) text: &'a [u8],
}

/// The end of the line that starts at `from`, and the start of the next one. Line ends are LF, CR LF and CR.
pub(super) fn line_end(bytes: &[u8], from: usize) -> (usize, usize) {
    let rest = bytes.get(from..).unwrap_or_default();
    match rest.iter().position(|&byte| byte == b'\n' || byte == b'\r') {
        None => (bytes.len(), bytes.len()),
        Some(length) => {
            let end = from + length;
            let both = bytes.get(end) == Some(&b'\r') && bytes.get(end + 1) == Some(&b'\n');
            (end, end + if both { 2 } else { 1 })
        }
    }
}

pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = Line<'_>> {
    let (mut at, mut number) = (0, 0);
    std::iter::from_fn(move || {
        if at >= bytes.len() {
            return None;
        }
        let (end, next) = line_end(bytes, at);
        let text = bytes.get(at..end)?;
        at = next;
        number += 1;
        Some(Line { number, text })
    })
}

pub(super) fn holds(text: &[u8], word: &str) -> bool {
    word.is_empty() || text.windows(word.len()).any(|window| window.eq_ignore_ascii_case(word.as_bytes()))
}

pub(super) fn starts(text: &[u8], word: &str) -> bool {
    text.get(..word.len()).is_some_and(|front| front.eq_ignore_ascii_case(word.as_bytes()))
}

pub(super) fn front(bytes: &[u8], most: usize) -> &[u8] {
    bytes.get(..most).unwrap_or(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_end_ends_one_line() {
        let found: Vec<_> = lines(b"a\r\nb\rc\n\nd").map(|line| (line.number, line.text)).collect();
        assert_eq!(found, [(1, &b"a"[..]), (2, b"b"), (3, b"c"), (4, b""), (5, b"d")]);
    }

    #[test]
    fn byte_order_marks_and_utf16_are_decoded() {
        assert_eq!(&*decode(b"\xEF\xBB\xBFM48"), b"M48");
        assert_eq!(&*decode(b"\xFF\xFEM\x004\x008\x00"), b"M48");
        assert_eq!(&*decode(b"\xFE\xFF\x00M\x20\xAC"), b"M?");
    }

    #[test]
    fn decomposed_letters_are_composed() {
        for (apart, whole) in [
            ("Lo\u{308}tseite", "Lötseite"),
            ("LO\u{308}TSEITE", "LÖTSEITE"),
            ("miedz\u{301}", "miedź"),
            ("ト\u{3099}リル", "ドリル"),
            ("\u{1112}\u{1161}\u{1106}\u{1167}\u{11ab}", "하면"),
            ("x\u{323}top", "xtop"),
            ("Lötseite", "Lötseite"),
        ] {
            assert_eq!(composed(apart), whole);
        }
    }
}
