//! A Gerber text cut into blocks at `*` and `%`.
//!
//! Comes in: bytes. Goes out: [`Block`]s with the line each starts in. Does not tell commands apart: what a block is shows
//! in its first two bytes, so that a lost `%` loses nothing else.
//!
//! ```text
//!  %FSLAX24Y24*%   G04 100% of it*   X100Y200D01*   %AMT*1,1,$1,0,0*%
//!  ╰───block──╯    ╰───block────╯    ╰──block──╯    ╰─╯ ╰──block──╯
//! ```

use crate::artwork::number::Decimal;

/// One block, without the star behind it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block<'a> {
    /// Its bytes; white space may stand inside.
    pub(super) text: &'a [u8],
    /// The line it starts in, from 1.
    pub(super) line: u32,
}

/// The numbers of one block of words.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Numbers {
    pub(super) x: Option<Decimal>,
    pub(super) y: Option<Decimal>,
    pub(super) i: Option<Decimal>,
    pub(super) j: Option<Decimal>,
}

/// The blocks of a text.
pub(super) fn blocks(text: &[u8]) -> impl Iterator<Item = Block<'_>> {
    let (mut at, mut line) = (0_usize, 1_u32);
    std::iter::from_fn(move || {
        while let Some(&byte) = text.get(at) {
            if byte == b'\n' {
                line += 1;
            } else if byte != b'%' && byte != b'*' && !byte.is_ascii_whitespace() {
                break;
            }
            at += 1;
        }
        let rest = text.get(at..).filter(|rest| !rest.is_empty())?;
        let comment = matches!(rest, [b'G', b'0', b'4', ..] | [b'G', b'4', b' ', ..]);
        let length = if comment {
            rest.iter().position(|&byte| byte == b'*')
        } else {
            rest.iter().position(|&byte| byte == b'*' || byte == b'%')
        };
        let block = Block { text: rest.get(..length.unwrap_or(rest.len()))?, line };
        line += block.text.iter().filter(|&&byte| byte == b'\n').count() as u32;
        at += block.text.len() + 1;
        Some(block)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_know_their_lines() {
        let text = b"%FSLAX24Y24*\nMOIN*%\nG04 100% of\nit*X1\nY2D01*\n%AMT*\n1,1,$1,0,0*%M02";
        let found: Vec<_> = blocks(text).map(|block| (block.line, block.text)).collect();
        let want: [(u32, &[u8]); 7] = [
            (1, b"FSLAX24Y24"),
            (2, b"MOIN"),
            (3, b"G04 100% of\nit"),
            (4, b"X1\nY2D01"),
            (6, b"AMT"),
            (7, b"1,1,$1,0,0"),
            (7, b"M02"),
        ];
        assert_eq!(found, want);
    }
}
