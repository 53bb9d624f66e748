//! Splits a Gerber text into blocks at `*` and `%`. Removes line ends inside blocks, where they have no
//! meaning; raises lower-case layers to upper case first. Also parses numbers after letters for all commands.
//!
//! ```text
//!  %FSLAX24Y24*%   G04 100% of it*   X100Y200D01*   %AMT*1,1,$1,0,0*%
//!  ╰───block──╯    ╰───block────╯    ╰──block──╯    ╰─╯ ╰──block──╯
//! ```

use crate::artwork::number::{Decimal, decimal};
use crate::artwork::text::front;
use std::borrow::Cow;

/// Number of bytes searched for the first commands.
const LOOKED_AT: usize = 64 * 1024;

/// Line and column in a text, from 1; 0 for the whole text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct At {
    pub(super) line: u32,
    pub(super) column: u32,
}

/// A block, without its final `*`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block<'a> {
    /// Its bytes without line ends; can contain spaces.
    pub(super) text: &'a [u8],
    /// The block as in the file, with line ends.
    pub(super) written: &'a [u8],
    pub(super) at: At,
    start: usize,
    /// True if it ends with `*` or `%`, false if it ends with the file.
    pub(super) ended: bool,
}

impl<'a> Block<'a> {
    pub(super) const fn made(text: &'a [u8]) -> Self {
        Self { text, written: text, at: At { line: 0, column: 0 }, start: 0, ended: true }
    }

    /// Its bytes without line ends, which can be anywhere in a word. A comment keeps them.
    pub(super) fn joined(&self) -> Cow<'a, [u8]> {
        let is_plain = || matches!(self.text, [b'G' | b'g', b'0', b'4', ..] | [b'G' | b'g', b'4', b' ', ..]);
        if !self.text.iter().any(is_line_end) || is_plain() {
            return Cow::Borrowed(self.text);
        }
        Cow::Owned(self.text.iter().copied().filter(|byte| !is_line_end(byte)).collect())
    }

    pub(super) const fn with<'b>(&self, joined: &'b [u8]) -> Block<'b>
    where
        'a: 'b,
    {
        Block { text: joined, written: self.written, at: self.at, start: self.start, ended: self.ended }
    }

    /// True if the block is complete without `*` at the end of the file: the end command, or a comment.
    pub(super) fn is_whole(&self) -> bool {
        matches!(self.text.trim_ascii(), b"M02" | b"M00" | b"M2" | b"M0" | [b'G' | b'g', b'0', b'4', ..])
    }

    /// The position of one of its bytes.
    pub(super) fn place(&self, offset: usize) -> At {
        // Skip line ends, which were removed from `text`.
        let out = self.written.len() != self.text.len();
        let mut kept = (0..).zip(self.written).filter(|(_, byte)| !(out && is_line_end(byte)));
        let before = front(self.written, kept.nth(offset).map_or(self.written.len(), |(at, _)| at));
        let (lines, tail) = lines(before);
        match lines {
            0 => At { line: self.at.line, column: self.at.column + tail },
            _ => At { line: self.at.line + lines, column: 1 + tail },
        }
    }
}

/// The end-of-text mark (^Z) that some programs write.
const END_OF_TEXT: u8 = 0x1A;

const fn is_line_end(byte: &u8) -> bool {
    matches!(*byte, b'\r' | b'\n')
}

/// The number of line ends in a text, and the number of bytes after the last one.
fn lines(text: &[u8]) -> (u32, u32) {
    let ends = text.iter().filter(|&&byte| byte == b'\n').count();
    let tail = text.iter().rev().take_while(|&&byte| byte != b'\n').count();
    (ends as u32, tail as u32)
}

/// Raises a layer in lower case to upper case, except comments, names and attributes. Other layers stay
/// unchanged.
pub(super) fn raised(text: &[u8]) -> Cow<'_, [u8]> {
    let small = [b"%fs", b"%mo", b"%ad", b"*fs", b"*mo"];
    if !front(text, LOOKED_AT).windows(3).any(|window| small.iter().any(|mark| window == *mark)) {
        return Cow::Borrowed(text);
    }
    let mut capitals = text.to_vec();
    for block in blocks(text) {
        let length = match block.text.to_ascii_uppercase().get(..3) {
            Some(b"G04") => 3,
            Some([b'T', b'F' | b'A' | b'O' | b'D', _] | [b'I' | b'L', b'N', _] | [b'I', b'F', _]) => 2,
            _ => block.text.len(),
        };
        let end = block.start + length;
        capitals.get_mut(block.start..end).unwrap_or_default().make_ascii_uppercase();
    }
    Cow::Owned(capitals)
}

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Numbers {
    pub(super) x: Option<Decimal>,
    pub(super) y: Option<Decimal>,
    pub(super) i: Option<Decimal>,
    pub(super) j: Option<Decimal>,
}

pub(super) fn blocks(text: &[u8]) -> impl Iterator<Item = Block<'_>> {
    // The line of the next byte, and the offset of that line.
    let (mut at, mut line, mut first) = (0_usize, 1_u32, 0_usize);
    std::iter::from_fn(move || {
        while let Some(&byte) = text.get(at) {
            if byte == b'\n' {
                (line, first) = (line + 1, at + 1);
            } else if byte != b'%' && byte != b'*' && byte != END_OF_TEXT && !byte.is_ascii_whitespace() {
                break;
            }
            at += 1;
        }
        let rest = text.get(at..).filter(|rest| !rest.is_empty())?;
        let comment = matches!(rest, [b'G' | b'g', b'0', b'4', ..] | [b'G' | b'g', b'4', b' ', ..]);
        let length = if comment {
            rest.iter().position(|&byte| byte == b'*')
        } else {
            rest.iter().position(|&byte| byte == b'*' || byte == b'%')
        };
        let inner = rest.get(..length.unwrap_or(rest.len()))?;
        let place = At { line, column: (at - first) as u32 + 1 };
        let block = Block { text: inner, written: inner, at: place, start: at, ended: length.is_some() };
        at += inner.len();
        let (more, tail) = lines(inner);
        if more > 0 {
            (line, first) = (line + more, at - tail as usize);
        }
        at += 1;
        Some(block)
    })
}

/// A number with nothing else; none if there is more.
pub(super) fn number(text: &[u8]) -> Option<f64> {
    decimal(text).filter(|(_, used)| *used == text.len()).map(|(number, _)| plain(number))
}

/// The numbers after letters, each letter at most once; none if there is anything else.
pub(super) fn fields<const COUNT: usize>(
    text: &[u8],
    letters: [u8; COUNT],
) -> Option<[Option<Decimal>; COUNT]> {
    let mut found = [None; COUNT];
    let mut rest = text.trim_ascii();
    while let Some((letter, behind)) = rest.split_first() {
        let slot = found.get_mut(letters.iter().position(|known| known == letter)?)?;
        let (number, used) = decimal(behind)?;
        if slot.replace(number).is_some() {
            return None;
        }
        rest = behind.get(used..)?.trim_ascii_start();
    }
    Some(found)
}

/// The value of a number, with an explicit point.
pub(super) fn plain(number: Decimal) -> f64 {
    number.mantissa as f64 / libm::pow(10.0, f64::from(number.decimals))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_have_their_lines_and_columns() {
        let text = b"%FSLAX24Y24*\nMOIN*%\nG04 100% of\nit*X1\nY2D01*\n%AMT*\n1,1,$1,0,0*%M02";
        let found: Vec<_> =
            blocks(text).map(|block| (block.at.line, block.at.column, block.text, block.ended)).collect();
        let want: [(u32, u32, &[u8], bool); 7] = [
            (1, 2, b"FSLAX24Y24", true),
            (2, 1, b"MOIN", true),
            (3, 1, b"G04 100% of\nit", true),
            (4, 4, b"X1\nY2D01", true),
            (6, 2, b"AMT", true),
            (7, 1, b"1,1,$1,0,0", true),
            (7, 13, b"M02", false),
        ];
        assert_eq!(found, want);
        let block = blocks(text).nth(3).unwrap();
        let place = |offset| (block.place(offset).line, block.place(offset).column);
        assert_eq!([0, 1, 3, 5].map(place), [(4, 4), (4, 5), (5, 1), (5, 3)]);
    }
}
