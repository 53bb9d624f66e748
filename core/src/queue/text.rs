//! Parses a queue from text, one row per line, and prints it.
//!
//! ```text
//! * MOVE_TO 10.5 20   ; a note
//! │ │       └ arguments, in the order of the table
//! │ └ command: the table's name or the paper's, in any case
//! └ breakpoint
//! ```
//!
//! The decimal mark is a point or a comma. Empty lines and lines with only a note are preserved.

use super::blocks::{Queue, QueueRow, link};
use super::words::{Argument, ArgumentKind, ArgumentValue, WORDS, Word, WorkCommand};
use super::{LONGEST_TEXT, MOST_ROWS};
use crate::diagnostic::{Diagnostic, letters_apart};
use crate::units::{Length, NM_PER_MM};
use crate::{code, error};

/// After this many errors the rest of the text is ignored.
const MOST_REFUSALS: usize = 50;

const LONGEST_NAME: usize = 32;

/// Decimals of a millimetre: nanometre resolution.
const DECIMALS: usize = 6;

/// A word of a line, with its column in bytes from 1.
struct Token<'a> {
    text: &'a str,
    column: usize,
}

/// An error without its line: column and diagnostic.
type Refused = (usize, Diagnostic);

/// Parses `text`, or returns all errors, line by line. `file` is the file name in locations.
pub fn read(file: &str, text: &str) -> Result<Queue, Vec<Diagnostic>> {
    if text.len() > LONGEST_TEXT {
        let why = error!("queue.too_long", bytes = text.len(), most = LONGEST_TEXT);
        return Err(vec![why.at(file, 0, 0)]);
    }
    let lines: Vec<&str> = text.lines().collect();
    if lines.len() > MOST_ROWS {
        let why = error!("queue.too_many_rows", rows = lines.len(), most = MOST_ROWS);
        return Err(vec![why.at(file, 0, 0)]);
    }
    let mut rows = Vec::with_capacity(lines.len());
    let mut refusals = Vec::new();
    for (number, line) in (1..).zip(lines) {
        match read_row(file, number, line) {
            Ok(row) => rows.push(row),
            Err(why) => refusals.push(why),
        }
        if refusals.len() >= MOST_REFUSALS {
            break;
        }
    }
    if !refusals.is_empty() {
        return Err(refusals);
    }
    match link(&rows) {
        Ok(links) => Ok(Queue { rows, links }),
        Err((row, why)) => Err(vec![why.at(file, u32::try_from(row + 1).unwrap_or(u32::MAX), 1)]),
    }
}

pub fn read_row(file: &str, number: u32, line: &str) -> Result<QueueRow, Diagnostic> {
    row(line).map_err(|(column, why)| {
        let column = u32::try_from(column).unwrap_or(u32::MAX);
        why.with("row", number).at(file, number, column)
    })
}

fn row(line: &str) -> Result<QueueRow, Refused> {
    if let Some(at) = line.find(|c: char| c.is_control() && c != '\t') {
        return Err((at + 1, error!("queue.control_character", ..)));
    }
    let (code, note) = match line.find([';', '#']) {
        Some(at) => (&line[..at], Some(line[at + 1..].trim().to_owned())),
        None => (line, None),
    };
    let (breakpoint, code, shift) = match code.trim_start().strip_prefix('*') {
        Some(rest) => (true, rest, code.len() - rest.len()),
        None => (false, code, 0),
    };
    let tokens = tokens(code, shift);
    let Some((first, rest)) = tokens.split_first() else {
        if breakpoint {
            return Err((shift, error!("queue.breakpoint_alone", ..)));
        }
        return Ok(QueueRow { breakpoint, command: None, note });
    };
    let word = Word::find(first.text).ok_or_else(|| (first.column, unknown(first.text)))?;
    let values = arguments(word, rest, code.trim_end().len() + shift + 1)?;
    Ok(QueueRow { breakpoint, command: Some(word.command(&values)), note })
}

fn tokens(code: &str, shift: usize) -> Vec<Token<'_>> {
    let begins = |text: &str| text.as_ptr() as usize - code.as_ptr() as usize;
    code.split_whitespace().map(|text| Token { text, column: begins(text) + shift + 1 }).collect()
}

fn arguments(word: &Word, tokens: &[Token<'_>], end: usize) -> Result<Vec<ArgumentValue>, Refused> {
    let mut values = Vec::with_capacity(word.arguments.len());
    for (index, argument) in word.arguments.iter().enumerate() {
        match tokens.get(index) {
            Some(token) => values.push(value(argument, token.text).map_err(|why| (token.column, why))?),
            None if argument.optional => break,
            None => {
                let why = error!("queue.missing", word = word.name, field = argument.name, ..);
                return Err((end, why));
            }
        }
    }
    match tokens.get(word.arguments.len()) {
        None => Ok(values),
        Some(token) => {
            let names: Vec<_> = word.arguments.iter().map(|argument| argument.name).collect();
            let takes = if names.is_empty() { "–".to_owned() } else { names.join(" ") };
            let why = error!("queue.surplus", word = word.name, found = token.text, ..);
            Err((token.column, why.with("takes", takes)))
        }
    }
}

fn value(argument: &Argument, text: &str) -> Result<ArgumentValue, Diagnostic> {
    let refused = |code: &str| Diagnostic::error(code).with("field", argument.name).with("found", text);
    let range = |low: i64, high: i64| {
        let why = refused(code!("queue.out_of_range")).with("low", low).with("high", high);
        why.with("unit", argument.unit)
    };
    match argument.kind {
        ArgumentKind::Whole(low, high) => {
            let number = whole(text).ok_or_else(|| refused(code!("queue.not_whole")))?;
            if (low..=high).contains(&number) {
                Ok(ArgumentValue::Whole(number))
            } else {
                Err(range(low, high))
            }
        }
        ArgumentKind::Mm(low, high) => {
            let length = millimetres(text).map_err(refused)?;
            let inside = (low * NM_PER_MM..=high * NM_PER_MM).contains(&length.nm());
            if inside { Ok(ArgumentValue::Mm(length)) } else { Err(range(low, high)) }
        }
        ArgumentKind::Choice(words) => match words.iter().find(|word| word.eq_ignore_ascii_case(text)) {
            Some(word) => Ok(ArgumentValue::Text((*word).to_owned())),
            None => Err(refused(code!("queue.not_a_choice")).with("words", words.join(", "))),
        },
        ArgumentKind::Name => {
            let letters = text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
            let begins = text.starts_with(|c: char| c.is_ascii_alphabetic());
            if letters && begins && text.len() <= LONGEST_NAME {
                Ok(ArgumentValue::Text(text.to_owned()))
            } else {
                Err(refused(code!("queue.bad_name")).with("longest", LONGEST_NAME))
            }
        }
    }
}

/// Parses an integer. Huge numbers saturate, so that the range check reports them.
fn whole(text: &str) -> Option<i64> {
    let (negative, digits) = signed(text);
    if digits.is_empty() || !digits.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let size = digits.parse::<i64>().unwrap_or(i64::MAX);
    Some(if negative { -size } else { size })
}

fn signed(text: &str) -> (bool, &str) {
    match text.strip_prefix('-') {
        Some(digits) => (true, digits),
        None => (false, text.strip_prefix('+').unwrap_or(text)),
    }
}

/// Parses millimetres with nanometre resolution, or returns the code of the error.
fn millimetres(text: &str) -> Result<Length, &'static str> {
    let (negative, digits) = signed(text);
    let marks = digits.bytes().filter(|byte| matches!(byte, b'.' | b',')).count();
    if marks > 1 {
        return Err(code!("queue.two_marks"));
    }
    let (whole, fraction) = digits.split_once(['.', ',']).unwrap_or((digits, ""));
    let all_digits = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
    if whole.len() + fraction.len() == 0 || !all_digits(whole) || !all_digits(fraction) {
        return Err(code!("queue.bad_number"));
    }
    if fraction.len() > DECIMALS {
        return Err(code!("queue.too_fine"));
    }
    // Huge values stay out of range without overflowing.
    let millimetres =
        if whole.is_empty() { 0 } else { whole.parse::<i64>().unwrap_or(i64::MAX).min(1_000_000) };
    let padded = format!("{fraction:0<DECIMALS$}");
    let nm = millimetres * NM_PER_MM + padded.parse::<i64>().unwrap_or(0);
    Ok(Length::from_nm(if negative { -nm } else { nm }))
}

fn unknown(text: &str) -> Diagnostic {
    let wanted = text.to_ascii_uppercase();
    let names = WORDS.iter().flat_map(|word| word.spellings().map(move |name| (name, word.name)));
    let apart = |name: &str| {
        let begins = wanted.len() > 1 && name.to_ascii_uppercase().starts_with(&wanted);
        if begins { 0 } else { letters_apart(&wanted, &name.to_ascii_uppercase()) }
    };
    let near = names.map(|(name, word)| (apart(name), word)).min();
    let near = near.filter(|(apart, _)| *apart <= 3 && 2 * apart < wanted.len());
    let found: String = text.chars().take(40).collect();
    match near {
        Some((_, near)) => error!("queue.unknown_word", found = found, near = near, ..),
        None => {
            let words: Vec<_> = WORDS.iter().map(|word| word.name).collect();
            error!("queue.unknown_far", found = found, words = words.join(", "), ..)
        }
    }
}

/// Prints the queue so that [`read`] returns an equal queue.
pub fn print(queue: &Queue) -> String {
    let mut out = String::new();
    let mut depth = 0_usize;
    for row in queue.rows() {
        if row.command == Some(WorkCommand::End) {
            depth = depth.saturating_sub(1);
        }
        let line = print_row(row, depth);
        out.push_str(line.trim_end());
        out.push('\n');
        if matches!(row.command, Some(WorkCommand::Repeat { .. } | WorkCommand::Sub { .. })) {
            depth += 1;
        }
    }
    out
}

fn print_row(row: &QueueRow, depth: usize) -> String {
    let mut line = if row.breakpoint { "* ".to_owned() } else { "  ".to_owned() };
    line.push_str(&"  ".repeat(depth));
    if let Some(command) = &row.command {
        let (word, values) = command.split();
        line.push_str(word.name);
        for value in values {
            line.push(' ');
            line.push_str(&value.to_string());
        }
    }
    if let Some(note) = &row.note {
        line.push_str(if row.command.is_some() { "  ; " } else { "; " });
        line.push_str(note);
    }
    line
}

impl std::fmt::Display for ArgumentValue {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Whole(whole) => write!(out, "{whole}"),
            Self::Text(text) => out.write_str(text),
            Self::Mm(length) => {
                let (sign, size) = (if length.nm() < 0 { "-" } else { "" }, length.nm().unsigned_abs());
                let (whole, fraction) = (size / NM_PER_MM as u64, size % NM_PER_MM as u64);
                let decimals = format!("{fraction:06}");
                let decimals = decimals.trim_end_matches('0');
                let mark = if decimals.is_empty() { "" } else { "." };
                write!(out, "{sign}{whole}{mark}{decimals}")
            }
        }
    }
}
