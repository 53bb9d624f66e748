//! Bytes made into lines: byte-order marks, UTF-16, and every kind of line end.
//!
//! Comes in: the bytes of a file. Goes out: ASCII-compatible bytes, and its lines numbered from 1. Knows no format.

use std::borrow::Cow;

/// The text of a file: without a byte-order mark, UTF-16 narrowed to bytes (what is not ASCII becomes `?`).
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

/// One line without its end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line<'a> {
    /// Number, from 1.
    pub(super) number: u32,
    /// Its bytes.
    pub(super) text: &'a [u8],
}

/// Where the line that starts at `from` ends, and where the next one starts. Line ends are LF, CR LF and CR.
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

/// The lines of a text.
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

/// Whether `text` holds `word`, whatever the case.
pub(super) fn holds(text: &[u8], word: &str) -> bool {
    word.is_empty() || text.windows(word.len()).any(|window| window.eq_ignore_ascii_case(word.as_bytes()))
}

/// Whether `text` starts with `word`, whatever the case.
pub(super) fn starts(text: &[u8], word: &str) -> bool {
    text.get(..word.len()).is_some_and(|front| front.eq_ignore_ascii_case(word.as_bytes()))
}

/// The first bytes of a text, enough to know what it is.
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
    fn marks_and_wide_text_are_taken_off() {
        assert_eq!(&*decode(b"\xEF\xBB\xBFM48"), b"M48");
        assert_eq!(&*decode(b"\xFF\xFEM\x004\x008\x00"), b"M48");
        assert_eq!(&*decode(b"\xFE\xFF\x00M\x20\xAC"), b"M?");
    }
}
