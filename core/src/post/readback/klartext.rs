//! Heidenhain Klartext: L, CC, C, CP, TOOL CALL.
//!
//! Comes in: text. Goes out: moves for the hand. Does not know cycles: what it does not follow is refused.

use super::hand::{Hand, Tip};
use super::words::number;
use crate::diagnostic::Diagnostic;

/// Reads the file.
pub(super) fn read(hand: &mut Hand, text: &str) -> Result<(), Diagnostic> {
    let (mut scale, mut centre, mut rpm) = (1.0, (0.0, 0.0), 0.0);
    for (number, line) in (1..).zip(text.lines()) {
        hand.line = number;
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
            ["TOOL", "CALL", rest @ ..] => {
                if let Some(tool) = rest.first().and_then(|word| word.parse().ok()) {
                    hand.take(tool);
                }
                rpm = axis(rest, "S").unwrap_or(rpm);
            }
            ["CC", rest @ ..] => {
                let own = |name, before| axis(rest, name).map_or(before, |mm| mm * scale);
                centre = (own("X", centre.0), own("Y", centre.1));
            }
            ["L", rest @ ..] => {
                let to = place(hand.tip, rest, scale);
                hand.line_to(to, rest.contains(&"FMAX"))?;
            }
            ["C", rest @ ..] => {
                let to = place(hand.tip, rest, scale);
                hand.arc_to(to, centre, rest.contains(&"DR+"))?;
            }
            ["CP", rest @ ..] => {
                let turn = axis(rest, "IPA").unwrap_or(0.0).to_radians();
                let to = Tip {
                    z: hand.tip.z + axis(rest, "IZ").unwrap_or(0.0) * scale,
                    ..turned(hand.tip, centre, turn)
                };
                hand.arc_to(to, centre, rest.contains(&"DR+"))?;
            }
            ["M3" | "M4" | "M03" | "M04"] => hand.spindle(rpm),
            ["M5" | "M05"] => hand.spindle(0.0),
            [] | ["CYCL", "DEF", "9.0" | "9.1", ..] | ["M30" | "M2" | "M02" | "M8" | "M9"] | ["BLK", ..] => {}
            [word, ..] => return Err(hand.refuse("readback.unknown_word", word)),
        }
    }
    Ok(())
}

/// The number behind the name of an axis.
fn axis(words: &[&str], name: &str) -> Option<f64> {
    let value = words.iter().find_map(|word| {
        word.strip_prefix(name).filter(|rest| {
            rest.starts_with(['+', '-', '.', '0', '1', '2', '3', '4', '5', '6', '7', '8', '9'])
        })
    })?;
    number(value).map(|(number, _)| number)
}

/// Where a move ends: axes that are not named stay; with an I in front they count from here.
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
    // Whole turns end where they begin.
    let rest = libm::fmod(turn, std::f64::consts::TAU);
    if libm::fabs(rest) < 1e-6 {
        return from;
    }
    let (sine, cosine) = (libm::sin(rest), libm::cos(rest));
    Tip { x: x + dx * cosine - dy * sine, y: y + dx * sine + dy * cosine, ..from }
}
