//! How GRBL 1.1h reads a line (`protocol.c`, `nuts_bolts.c`, `gcode.c`), compared with the firmware.
//!
//! Doesn't know modal groups.

use super::{Interpreter, Refused};
use crate::code;

/// Digits of a number that GRBL reads, leading zeros included. A later digit before the point counts as a 0.
const READ_DIGITS: i32 = 8;
/// Resets the controller, wherever it is in a line.
const RESET: char = '\u{18}';
/// Largest difference that a dropped digit may make, in units of the line and as a part of the number.
const SMALL: [f64; 2] = [1e-5, 2e-7];
/// Codes with meanings after the point. GRBL doesn't know the other parts of these, and refuses a part of all others as such.
const WITH_PARTS: [u32; 7] = [28, 30, 38, 43, 90, 91, 92];

/// The lines of a text: GRBL takes a carriage return for an end too.
pub fn lines(text: &str) -> impl Iterator<Item = &str> {
    // Both together are one end, as editors count lines.
    text.split('\n').flat_map(|line| line.strip_suffix('\r').unwrap_or(line).split('\r'))
}

/// A line as GRBL takes it.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Bare {
    pub text: String,
    /// Comments in brackets; the last may be open, since it ends with its line.
    pub brackets: Vec<String>,
    /// What follows a semicolon.
    pub remark: Option<String>,
}

/// Parts a line into what GRBL keeps and its comments.
pub fn bare(line: &str) -> Bare {
    let mut bare = Bare::default();
    let mut comment: Option<String> = None;
    for (at, letter) in line.char_indices() {
        match (&mut comment, letter) {
            (Some(_), ')') => bare.brackets.extend(comment.take()),
            (Some(text), _) => text.push(letter),
            (None, '(') => comment = Some(String::new()),
            (None, ';') => {
                bare.remark = line.get(at + 1..).map(str::to_owned);
                break;
            }
            (None, '/') => {}
            (None, _) if letter <= ' ' && letter != RESET => {}
            (None, _) => bare.text.push(letter.to_ascii_uppercase()),
        }
    }
    bare.brackets.extend(comment);
    bare
}

/// The first character in the comments of a line on which GRBL acts as it receives it: hold, reset, and bytes from 128 up, which are the
/// door, overrides and more. Bytes that are no UTF-8 count, since they may be any.
pub fn acts_at_once(line: &str) -> Option<char> {
    let comments = line.find(['(', ';']).and_then(|at| line.get(at..)).unwrap_or_default();
    comments.chars().find(|letter| {
        let mut bytes = [0; 4];
        let bytes = letter.encode_utf8(&mut bytes).bytes();
        matches!(*letter, '!' | RESET | char::REPLACEMENT_CHARACTER) || bytes.into_iter().any(is_command)
    })
}

/// Whether a byte is a command of its own: door, jog cancel, overrides.
fn is_command(byte: u8) -> bool {
    matches!(byte, 0x84 | 0x85 | 0x90..=0x97 | 0x99..=0x9e | 0xa0 | 0xa1)
}

/// The first word of a bare line whose number GRBL reads as another one, because it is too long.
pub fn cut_short(of: Interpreter, bare: &str) -> Option<Refused> {
    if of != Interpreter::Grbl {
        return None;
    }
    let mut rest = bare;
    while let Some(at) = rest.find(|c: char| c.is_ascii_digit() || c == '.') {
        let number = rest.get(at..).unwrap_or_default();
        let end = number.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(number.len());
        let (digits, after) = number.split_at(end);
        if let Ok(exact) = digits.parse::<f64>() {
            let read = as_read(digits);
            if libm::fabs(exact - read) > SMALL[0].max(SMALL[1] * exact) {
                let word = rest.get(..at).map_or(0, |before| before.trim_end_matches(['+', '-']).len());
                let word = rest.get(word.saturating_sub(1)..at + end).unwrap_or(digits).to_owned();
                return Some(Refused { code: code!("gcode.too_many_digits"), word, number: 2 });
            }
        }
        rest = after;
    }
    None
}

/// What GRBL reads of an unsigned number.
fn as_read(digits: &str) -> f64 {
    let (mut value, mut exponent, mut count, mut is_decimal) = (0.0, 0, 0, false);
    for letter in digits.chars() {
        let Some(digit) = letter.to_digit(10) else {
            is_decimal = true;
            continue;
        };
        count += 1;
        if count <= READ_DIGITS {
            value = value * 10.0 + f64::from(digit);
            exponent -= i32::from(is_decimal);
        } else if !is_decimal {
            exponent += 1;
        }
    }
    value * libm::pow(10.0, f64::from(exponent))
}

/// The code, in hundredths, that GRBL takes a number for: the part after the point is rounded to hundredths. The number of its error
/// if it takes it for none.
pub(super) fn code(letter: char, value: f64) -> Result<u32, u16> {
    // As the firmware counts: in single precision, the whole part in a byte.
    let value = value as f32;
    let whole = libm::truncf(value);
    let part = libm::roundf(100.0 * (value - whole));
    if !(0.0..256.0).contains(&whole) || part < 0.0 {
        return Err(if letter == 'M' || (whole >= 256.0 && is_known_in_byte(whole)) { 23 } else { 20 });
    }
    let (whole, part) = (whole as u32, part as u32);
    if letter == 'G' && whole == 49 {
        return Ok(4900);
    }
    let is_free = letter == 'G' && (WITH_PARTS.contains(&whole) || whole == 61) && part < 100;
    if part > 0
        && !is_free
        && (letter == 'M' || super::table::find(Interpreter::Grbl, 'G', whole * 100).is_some())
    {
        return Err(23);
    }
    Ok(whole * 100 + part)
}

/// Whether the whole part of a G word is a code once it is cut to a byte.
fn is_known_in_byte(whole: f32) -> bool {
    let byte = libm::fmodf(whole, 256.0) as u32;
    super::table::find(Interpreter::Grbl, 'G', byte * 100).is_some()
}

/// Whether GRBL finds a circle of this radius through both ends of an arc, in mm: it refuses a half circle that its own rounding makes
/// too wide.
pub fn has_circle(from: [f64; 2], to: [f64; 2], radius: f64) -> bool {
    let [x, y] = [0, 1].map(|axis| to[axis] as f32 - from[axis] as f32);
    let radius = radius as f32;
    4.0 * radius * radius - x * x - y * y >= 0.0
}

/// The number that a controller acts on: GRBL rounds codes and drops the part of a tool's number.
pub fn taken(of: Interpreter, letter: char, value: f64) -> f64 {
    match (of, letter) {
        (Interpreter::Grbl, 'G' | 'M') => code(letter, value).map_or(value, |code| f64::from(code) / 100.0),
        (Interpreter::Grbl, 'T' | 'L' | 'N') => libm::trunc(value),
        _ => value,
    }
}
