//! Recognises machine programs, which are no drill files: those written by Annulus, and other G-code.
//!
//! ```text
//!   (job: amp) (side: top)      0 BEGIN PGM AMP MM      MODULE amp_top     /PROG AMP     G21 … G1 Z-0.1 F120
//! ```
//!
//! Excellon without a header has no Z, no M3 and no F after G1; that distinguishes it.

use super::number::decimal;
use super::text::{holds, lines, starts};

/// Lines in which a program identifies itself.
const HEAD_LINES: usize = 40;
const LOOKED_AT: usize = 400;
/// First words of programs for controllers and robots.
const BEGINNINGS: [&str; 8] = ["/PROG", "MODULE ", "&ACCESS", "&REL", "&PARAM", "%%%", "DEF ", "BEGIN PGM"];

/// The comment line that marks drill files written by Annulus for a planned job.
pub use crate::locale::WRITTEN_BY as OURS;

/// True for a drill file that Annulus wrote for a planned job.
pub(super) fn is_our_drill(text: &[u8]) -> bool {
    lines(text).take(HEAD_LINES).any(|line| line.text.trim_ascii().eq_ignore_ascii_case(OURS.as_bytes()))
}

pub(super) fn is_one(text: &[u8]) -> bool {
    if holds(text, "%FS")
        || lines(text).take(LOOKED_AT).any(|line| line.text.trim_ascii().eq_ignore_ascii_case(b"M48"))
    {
        return false;
    }
    is_ours(text) || is_begun(text) || is_gcode(text)
}

/// The head of Annulus programs: `job: …` and `side: …`, each in a comment.
fn is_ours(text: &[u8]) -> bool {
    let says = |word: &str| {
        let comments = lines(text).take(HEAD_LINES).map(|line| bare(line.text));
        comments.into_iter().any(|line| starts(line, word))
    };
    says("job: ") && (says("side: ") || says("tool "))
}

/// A line without its number and comment mark.
fn bare(line: &[u8]) -> &[u8] {
    let mark = |byte: &u8| byte.is_ascii_whitespace() || byte.is_ascii_digit() || b"Nn;(!:*#-".contains(byte);
    let start = line.iter().position(|byte| !mark(byte)).unwrap_or(line.len());
    line.get(start..).unwrap_or_default()
}

fn is_begun(text: &[u8]) -> bool {
    lines(text).take(3).map(|line| line.text.trim_ascii()).any(|line| {
        let line = line.strip_prefix(b"0 ").unwrap_or(line);
        BEGINNINGS.iter().any(|word| starts(line, word))
    })
}

/// G-code for a mill, a printer or a laser: moves, and a Z, a spindle or a feed between them.
fn is_gcode(text: &[u8]) -> bool {
    let (mut moves, mut machine) = (0, 0);
    for line in lines(text).take(LOOKED_AT) {
        let Some(words) = words(line.text.trim_ascii()) else { continue };
        let has = |letter: u8| words.iter().any(|(of, _)| *of == letter);
        let is = |letter: u8, values: &[u32]| {
            words.iter().any(|(of, value)| *of == letter && values.contains(value))
        };
        let goes = is(b'G', &[0, 1, 2, 3, 81, 82, 83, 73]) || has(b'X') || has(b'Y') || has(b'Z');
        moves += usize::from(goes);
        // Only Excellon has these: units, and codes that plunge and retract the tool around a path.
        if is(b'M', &[15, 16, 17, 71, 72]) || is(b'G', &[5]) {
            return false;
        }
        let spindle = is(b'M', &[3, 4]);
        // A laser program has neither Z nor plane.
        let speed = spindle && has(b'S');
        let units = is(b'G', &[20, 21]);
        let height = has(b'Z');
        let plane = is(b'G', &[17, 43, 49, 54, 61, 64, 94, 98, 99]) && !has(b'X');
        let feed = is(b'G', &[1]) && has(b'F');
        machine += usize::from(height) * 2;
        machine += [spindle, speed, units, plane, feed].into_iter().map(usize::from).sum::<usize>();
    }
    moves > 0 && machine >= 2
}

/// The words of a block: capital letters with the integer part of their numbers; none if it isn't a block.
fn words(line: &[u8]) -> Option<Vec<(u8, u32)>> {
    let mut words = Vec::new();
    let mut rest = line;
    while let Some((letter, behind)) = rest.split_first() {
        match letter {
            b';' => break,
            b'(' => {
                rest = behind
                    .iter()
                    .position(|byte| *byte == b')')
                    .and_then(|at| behind.get(at + 1..))
                    .unwrap_or_default();
            }
            b'/' | b'%' => rest = behind,
            _ if letter.is_ascii_whitespace() => rest = behind,
            _ if letter.is_ascii_alphabetic() => {
                let behind = behind.trim_ascii_start();
                let (number, used) = decimal(behind)?;
                let whole = 10_u64
                    .checked_pow(u32::from(number.decimals))
                    .map_or(0, |unit| number.mantissa.unsigned_abs() / unit);
                words.push((letter.to_ascii_uppercase(), u32::try_from(whole).unwrap_or(u32::MAX)));
                rest = behind.get(used..).unwrap_or_default();
            }
            _ => return None,
        }
    }
    Some(words)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn machine_programs_are_distinct_from_drill_files() {
        for (text, want) in [
            ("(job: amp)\n(side: top)\nG21\nG90\n", true),
            ("%\nO1001 (AMP_TOP)\nN10 (JOB: AMP)\nN20 (SIDE: TOP)\n", true),
            ("; job: amp\n; side: bottom\n", true),
            ("0 BEGIN PGM AMP MM\n1 ; job: amp\n", true),
            ("MODULE amp_top\n  ! job: amp\n", true),
            ("/PROG  AMP\n/ATTR\n", true),
            ("&ACCESS RVP\nDEF amp()\n", true),
            (
                "(FlatCAM)\nG20\nG90\nG94\nG01 F2.00\nG00 Z0.1000\nM03 S1000\nG00 X0.1 Y0.2\nG01 Z-0.0024\n",
                true,
            ),
            ("G21\nG90\nM3 S0\nG1 X1 Y1 F600 S200\n", true),
            ("G21\nG90\nM3 S255\nG0 X1 Y1 F1000\nG1 X5 S128\nM5\n", true),
            ("N1 G21\nN2 G90\nN3 M3\nN4 G0 X1 Y1\n", true),
            ("T1\nM6\nG0 X1 Y2\nG81 X1. Y2. Z-2. R1. F100\n", true),
            ("M48\nMETRIC\nT1C0.8\n%\nT1\nX1.0Y1.0\nM30\n", false),
            ("%\nT01\nX002000Y003000\nM30\n", false),
            ("M72\nG90\nT1\nG00X1.0Y1.0\nM15\nG01X2.0Y1.0\nM16\nM30\n", false),
            ("M48\nMETRIC\nT1C0.8F200S300\n%\nG05\nT1\nX1Y1\nM30\n", false),
            ("G81X1.0Y1.0\nG81X5.0Y1.0\n", false),
            ("hello, this is Z\n", false),
            ("; side: none\nX1Y1\n", false),
        ] {
            assert_eq!(is_one(text.as_bytes()), want, "{text}");
        }
    }
}
