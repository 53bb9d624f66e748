//! Splits one line of an Excellon program.
//!
//! ```text
//! N30 t01c0.8128F200 (hole comment) ; more
//! └┬┘ └──────┬─────┘ └────┬───────┘ └─┬──┘
//! number   words        ignored     comment
//! ```

use crate::artwork::number::{Decimal, decimal};
use nom::branch::alt;
use nom::bytes::complete::{tag, take_till, take_while_m_n, take_while1};
use nom::character::complete::{digit0, digit1, one_of};
use nom::combinator::{opt, recognize, value};
use nom::multi::many0_count;
use nom::sequence::preceded;
use nom::{IResult, Parser};

/// The end-of-text mark (^Z) that some programs write.
const END_OF_TEXT: u8 = 0x1A;

/// A line with more words isn't a program.
const MOST_WORDS: usize = 64;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Word {
    pub(super) letter: u8,
    /// None if it can't be parsed.
    pub(super) number: Option<Decimal>,
    /// Column in bytes, from 1.
    pub(super) column: u32,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Content<'a> {
    Blank,
    /// `%` alone: end of the header, or start of the tape.
    Percent,
    /// A keyword with arguments.
    Statement {
        keyword: &'a [u8],
        /// The text after the first comma; can be empty.
        args: &'a [u8],
    },
    /// A line marked with `/`, which a machine may skip.
    Optional,
    Words(Vec<Word>),
    /// Words up to the column where something else starts.
    Garbled(Vec<Word>, u32),
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Parsed<'a> {
    pub(super) content: Content<'a>,
    /// The text after `;`.
    pub(super) comment: Option<&'a [u8]>,
}

pub(super) fn parse(line: &[u8]) -> Parsed<'_> {
    let (code, comment) = match line.iter().position(|&byte| byte == b';') {
        Some(at) => (line.get(..at).unwrap_or_default(), line.get(at + 1..)),
        None => (line, None),
    };
    let content = match front(code) {
        Ok((rest, _)) => content(code, rest),
        Err(_) => Content::Blank,
    };
    Parsed { content, comment }
}

fn content<'a>(code: &'a [u8], rest: &'a [u8]) -> Content<'a> {
    match rest.trim_ascii_end() {
        [] => Content::Blank,
        [b'%', ..] => Content::Percent,
        [b'/', rest @ ..] if gap(rest).is_ok_and(|(behind, ())| behind.is_empty()) => Content::Blank,
        [b'/', ..] => Content::Optional,
        trimmed => match statement(trimmed) {
            Ok((_, (keyword, args))) => {
                Content::Statement { keyword, args: args.strip_prefix(b",").unwrap_or(args).trim_ascii() }
            }
            Err(_) => words(trimmed, code.len() - rest.len()),
        },
    }
}

/// White space and comments in parentheses; an unclosed one extends to the end of the line.
fn gap(input: &[u8]) -> IResult<&[u8], ()> {
    let blank = take_while1(|byte: u8| byte.is_ascii_whitespace() || byte == 0 || byte == END_OF_TEXT);
    let bracket = recognize((tag("("), take_till(|byte| byte == b')'), opt(tag(")"))));
    value((), many0_count(alt((blank, bracket)))).parse(input)
}

/// Leading white space and a line number.
fn front(input: &[u8]) -> IResult<&[u8], ()> {
    value((), (gap, opt((one_of("Nn"), digit1, gap)))).parse(input)
}

/// `METRIC,LZ`, `M47,TEXT`, `R,H`: at least two letters, or a code with a comma.
fn statement(input: &[u8]) -> IResult<&[u8], (&[u8], &[u8])> {
    let letter = |byte: u8| byte.is_ascii_alphabetic();
    let code = recognize((take_while_m_n(1, 1, letter), digit0));
    let keyword = take_while_m_n(2, 40, letter);
    let args = nom::combinator::rest;
    alt(((code, preceded(tag(","), nom::combinator::rest)), (keyword, args))).parse(input)
}

fn words<'a>(rest: &[u8], start: usize) -> Content<'a> {
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(tail) = rest.get(at..) {
        let skipped = gap(tail).map_or(0, |(after, ())| tail.len() - after.len());
        at += skipped;
        let column = (start + at + 1) as u32;
        match rest.get(at) {
            None => break,
            Some(letter) if letter.is_ascii_alphabetic() && found.len() < MOST_WORDS => {
                let behind = rest.get(at + 1..).unwrap_or_default();
                let blanks = behind.iter().take_while(|byte| matches!(byte, b' ' | b'\t')).count();
                let number = behind.get(blanks..).and_then(decimal);
                at += 1 + number.map_or(0, |(_, used)| blanks + used);
                let number = number.map(|(number, _)| number);
                found.push(Word { letter: letter.to_ascii_uppercase(), number, column });
            }
            Some(_) => return Content::Garbled(found, column),
        }
    }
    Content::Words(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_split_into_words() {
        for (line, want) in [
            ("", "Blank"),
            ("  % ", "Percent"),
            ("; only a comment", "Blank"),
            ("METRIC,LZ,000.000", "METRIC | LZ,000.000"),
            ("metric (hole comment)", "metric | (hole comment)"),
            ("M47,LOAD BOARD", "M47 | LOAD BOARD"),
            ("R,H", "R | H"),
            ("N30 t01c0.8128 (a) F2", "T1@5 C8128@8 F2@20"),
            ("X001Y03M30", "X1@1 Y3@5 M30@8"),
            ("X1.2.3Y4", "X12@1 garbled at 5"),
            ("X--5.0", "X?@1 garbled at 2"),
            ("X 1.0 Y -2.0", "X10@1 Y-20@7"),
            ("\x1A", "Blank"),
            ("/X1", "Optional"),
            ("N5 / (nothing)", "Blank"),
        ] {
            let words = |words: &[Word]| -> Vec<String> {
                let number = |word: &Word| word.number.map_or("?".to_owned(), |n| n.mantissa.to_string());
                words.iter().map(|w| format!("{}{}@{}", char::from(w.letter), number(w), w.column)).collect()
            };
            let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
            let found = match parse(line.as_bytes()).content {
                Content::Statement { keyword, args } => format!("{} | {}", text(keyword), text(args)),
                Content::Words(found) => words(&found).join(" "),
                Content::Garbled(found, column) => format!("{} garbled at {column}", words(&found).join(" ")),
                other => format!("{other:?}"),
            };
            assert_eq!(found, want, "{line}");
        }
    }
}
