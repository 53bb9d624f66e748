//! Heidenhain Klartext: L, CC, C, CP, TOOL CALL.

use super::hand::{Hand, Tip};
use super::words::number;
use crate::code;
use crate::diagnostic::Diagnostic;

/// Assumed height of the machine's own positions, in mm.
const TOP_MM: f64 = 100.0;
/// Words that switch the spindle on, off, and words that change no position.
const TURN: &[&str] = &["M3", "M03", "M4", "M04", "M13", "M14"];
const STAND: &[&str] = &["M5", "M05"];
const PASSED: &[&str] =
    &["M0", "M00", "M1", "M01", "M2", "M02", "M30", "M7", "M07", "M8", "M08", "M9", "M09"];

pub(super) fn read(hand: &mut Hand, text: &str) -> Result<(), Diagnostic> {
    let (mut scale, mut centre) = (1.0, (0.0, 0.0));
    let mut unknown = false;
    for (number, line) in (1..).zip(text.lines()) {
        hand.at_line(number)?;
        let (line, comment) =
            line.split_once(';').map_or((line, None), |(line, comment)| (line, Some(comment)));
        if let Some(comment) = comment {
            hand.comment(comment.trim());
        }
        let line = line.trim().trim_start_matches(|c: char| c.is_ascii_digit()).trim();
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            ["BEGIN", "PGM", .., unit] => scale = if *unit == "INCH" { 25.4 } else { 1.0 },
            ["END", "PGM", ..] => break,
            ["TOOL", "CALL", rest @ ..] => tool(hand, rest)?,
            ["CC", rest @ ..] => {
                if let Some(word) = rest.iter().find(|word| word.starts_with('I')) {
                    return Err(hand.refuse(code!("readback.changes_place"), format!("CC {word}")));
                }
                only(hand, rest, &["X", "Y"], &[])?;
                let (Some(x), Some(y)) = (axis(rest, "X"), axis(rest, "Y")) else {
                    return Err(hand.refuse(code!("readback.unknown_word"), line));
                };
                centre = (x * scale, y * scale);
            }
            ["L", rest @ .., "M91"] => {
                up(hand, rest)?;
                unknown = true;
            }
            ["L", rest @ ..] => {
                only(hand, rest, &["X", "Y", "Z", "IX", "IY", "IZ", "F"], &["FMAX", "FAUTO"])?;
                let to = place(hand.tip, rest, scale);
                unknown &= axis(rest, "Z").is_none();
                known(hand, unknown && !rest.contains(&"FMAX"))?;
                spindle(hand, rest, true);
                hand.line_to(to, rest.contains(&"FMAX"))?;
                spindle(hand, rest, false);
            }
            ["C", rest @ ..] => {
                only(hand, rest, &["X", "Y", "Z", "IX", "IY", "IZ", "F"], &["DR+", "DR-"])?;
                let to = place(hand.tip, rest, scale);
                known(hand, unknown)?;
                arc(hand, rest, to, centre)?;
            }
            ["CP", rest @ ..] => {
                only(hand, rest, &["IPA", "IZ", "F"], &["DR+", "DR-"])?;
                known(hand, unknown)?;
                let turn = axis(rest, "IPA").unwrap_or(0.0).to_radians();
                let to = Tip {
                    z: hand.tip.z + axis(rest, "IZ").unwrap_or(0.0) * scale,
                    ..turned(hand.tip, centre, turn)
                };
                arc(hand, rest, to, centre)?;
            }
            [word] if TURN.contains(word) || STAND.contains(word) => {
                spindle(hand, &words, true);
                spindle(hand, &words, false);
            }
            [] | ["CYCL", "DEF", "9.0" | "9.1", ..] | ["BLK", ..] => {}
            [word] if PASSED.contains(word) => {}
            [word, ..] => return Err(hand.refuse(code!("readback.unknown_word"), word)),
        }
    }
    Ok(())
}

/// Up to a machine position: only the machine's top is certainly over the board.
fn up(hand: &mut Hand, words: &[&str]) -> Result<(), Diagnostic> {
    only(hand, words, &["Z", "F"], &["FMAX", "FAUTO"])?;
    if axis(words, "Z").is_none_or(|height| height < 0.0) {
        return Err(hand.refuse(code!("readback.changes_place"), "M91"));
    }
    hand.line_to(Tip { z: TOP_MM, ..hand.tip }, true)
}

/// Refuses to cut if the height is `unknown`: the last move was in machine coordinates.
fn known(hand: &Hand, unknown: bool) -> Result<(), Diagnostic> {
    if unknown { Err(hand.refuse(code!("readback.place_unknown"), 'Z')) } else { Ok(()) }
}

/// Loads a tool by number, and sets the speed. Refuses changes of length or radius, and tool names, because
/// they give no size.
fn tool(hand: &mut Hand, words: &[&str]) -> Result<(), Diagnostic> {
    let (number, words) = match words {
        [first, rest @ ..] => first.parse().map_or((None, words), |number| (Some(number), rest)),
        [] => (None, words),
    };
    if let Some(word) = words.iter().find(|word| word.starts_with("DL") || word.starts_with("DR")) {
        return Err(hand.refuse(code!("readback.changes_place"), word));
    }
    only(hand, words, &["S", "F"], &["Z"])?;
    if let Some(number) = number {
        hand.take(number);
    }
    if let Some(rpm) = axis(words, "S") {
        hand.speed(rpm);
    }
    Ok(())
}

/// Refuses a block with other words than numbers by these names, these words, and words that change no
/// position.
fn only(hand: &Hand, words: &[&str], names: &[&str], also: &[&str]) -> Result<(), Diagnostic> {
    let followed = |word: &str| {
        let known = also.contains(&word) || word == "R0";
        known
            || [PASSED, TURN, STAND].iter().any(|list| list.contains(&word))
            || names.iter().any(|name| axis(&[word], name).is_some())
    };
    let Some(word) = words.iter().find(|word| !followed(word)) else { return Ok(()) };
    let is_place = ["RL", "RR"].contains(word) || word.starts_with('M');
    Err(hand.refuse(
        if is_place { code!("readback.changes_place") } else { code!("readback.unknown_word") },
        word,
    ))
}

/// Applies the spindle words of a block: on before the move, off after it.
fn spindle(hand: &mut Hand, words: &[&str], before: bool) {
    if words.iter().any(|word| (if before { TURN } else { STAND }).contains(word)) {
        hand.turn(before);
    }
}

/// Moves along an arc; the direction must be given.
fn arc(hand: &mut Hand, words: &[&str], to: Tip, centre: (f64, f64)) -> Result<(), Diagnostic> {
    if words.contains(&"DR+") == words.contains(&"DR-") {
        return Err(hand.refuse(code!("readback.unknown_word"), "C"));
    }
    spindle(hand, words, true);
    hand.arc_to(to, centre, words.contains(&"DR+"))?;
    spindle(hand, words, false);
    Ok(())
}

/// The number after the name of an axis, with nothing after it.
fn axis(words: &[&str], name: &str) -> Option<f64> {
    let value = words.iter().find_map(|word| {
        word.strip_prefix(name).filter(|rest| {
            rest.starts_with(['+', '-', '.', '0', '1', '2', '3', '4', '5', '6', '7', '8', '9'])
        })
    })?;
    number(value).filter(|(_, rest)| rest.is_empty()).map(|(number, _)| number)
}

/// Target of a move: axes that are not named stay; a leading I makes them relative.
fn place(from: Tip, words: &[&str], scale: f64) -> Tip {
    let own = |name: &str, incremental: &str, before: f64| match (axis(words, name), axis(words, incremental))
    {
        (Some(mm), _) => mm * scale,
        (None, Some(by)) => before + by * scale,
        (None, None) => before,
    };
    Tip { x: own("X", "IX", from.x), y: own("Y", "IY", from.y), z: own("Z", "IZ", from.z) }
}

fn turned(from: Tip, (x, y): (f64, f64), turn: f64) -> Tip {
    let (dx, dy) = (from.x - x, from.y - y);
    // Full turns end at their start.
    let rest = libm::fmod(turn, std::f64::consts::TAU);
    if libm::fabs(rest) < 1e-6 {
        return from;
    }
    let (sine, cosine) = (libm::sin(rest), libm::cos(rest));
    Tip { x: x + dx * cosine - dy * sine, y: y + dx * sine + dy * cosine, ..from }
}
