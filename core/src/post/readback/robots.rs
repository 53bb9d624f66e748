//! Robots: KUKA KRL, ABB RAPID, Fanuc TP, as the dialects that ship write them.
//!
//! Comes in: text. Goes out: moves for the hand. Does not know frames or orientations: the bit points into the board.

use super::hand::{Hand, Tip};
use super::words::number;
use crate::diagnostic::Diagnostic;
use std::collections::BTreeMap;

/// Reads a KRL program: the first DEF of the file.
pub(super) fn krl(hand: &mut Hand, text: &str) -> Result<(), Diagnostic> {
    for (number, line) in (1..).zip(text.lines()) {
        hand.line = number;
        let (code, comment) = line.split_once(';').unwrap_or((line, ""));
        hand.comment(comment);
        let code = code.trim();
        if code == "END" {
            break;
        }
        if let Some(rpm) = called(code, "SPINDLE(") {
            hand.spindle(rpm);
        } else if let Some(tool) = called(code, "BIT(") {
            hand.take(tool as u32);
        } else if code.starts_with("LIN ") || code.starts_with("PTP {") {
            let to = frames(code).next().unwrap_or(hand.tip);
            hand.line_to(to, code.starts_with("PTP"))?;
        } else if code.starts_with("CIRC ") {
            let mut frames = frames(code);
            let (Some(middle), Some(to)) = (frames.next(), frames.next()) else {
                return Err(hand.refuse("readback.unknown_word", code));
            };
            hand.arc_through(middle, to)?;
        } else if code.contains("_REL")
            || code.starts_with("SLIN")
            || code.starts_with("SCIRC")
            || code.starts_with("LOOP")
        {
            return Err(hand.refuse("readback.unknown_word", code));
        }
    }
    Ok(())
}

fn called(code: &str, name: &str) -> Option<f64> {
    number(code.strip_prefix(name)?).map(|(number, _)| number)
}

/// The places of a line between braces: `{X 1.0, Y 2.0, Z 3.0, …}`.
fn frames(code: &str) -> impl Iterator<Item = Tip> {
    code.split('{').skip(1).filter_map(|frame| {
        let fields = frame.split('}').next()?;
        let axis = |name: &str| {
            fields
                .split(',')
                .find_map(|field| number(field.trim().strip_prefix(name)?).map(|(number, _)| number))
        };
        Some(Tip { x: axis("X ")?, y: axis("Y ")?, z: axis("Z ")? })
    })
}

/// Reads a RAPID module: its procedure main.
pub(super) fn rapid(hand: &mut Hand, text: &str) -> Result<(), Diagnostic> {
    let mut inside = false;
    for (number, line) in (1..).zip(text.lines()) {
        hand.line = number;
        let (code, comment) = line.split_once('!').unwrap_or((line, ""));
        hand.comment(comment);
        let code = code.trim();
        inside |= code.starts_with("PROC main");
        if !inside {
            continue;
        }
        if code == "ENDPROC" {
            break;
        }
        let words = code.trim_end_matches(';');
        if let Some(rpm) = words.strip_prefix("spindle ").and_then(|rpm| rpm.trim().parse().ok()) {
            hand.spindle(rpm);
        } else if let Some(tool) = words.strip_prefix("bit ").and_then(|tool| tool.trim().parse().ok()) {
            hand.take(tool);
        } else if let Some(said) = words.strip_prefix("TPWrite ") {
            hand.comment(said.trim_matches('"'));
        } else if code.starts_with("MoveL") || code.starts_with("MoveJ") {
            let to = targets(code).next().ok_or_else(|| hand.refuse("readback.unknown_word", code))?;
            hand.line_to(to, code.starts_with("MoveJ"))?;
        } else if code.starts_with("MoveC") {
            let mut targets = targets(code);
            let (Some(middle), Some(to)) = (targets.next(), targets.next()) else {
                return Err(hand.refuse("readback.unknown_word", code));
            };
            hand.arc_through(middle, to)?;
        } else if code.starts_with("Move") || code.starts_with("FOR ") || code.starts_with("WHILE ") {
            return Err(hand.refuse("readback.unknown_word", code));
        }
    }
    Ok(())
}

/// The positions of the targets of a line: `[[x,y,z],…]`.
fn targets(code: &str) -> impl Iterator<Item = Tip> {
    code.split("[[").skip(1).filter_map(|target| {
        let mut axes = target.split(']').next()?.split(',').map(|number| number.trim().parse().ok());
        Some(Tip { x: axes.next()??, y: axes.next()??, z: axes.next()?? })
    })
}

/// Reads a TP program as text: its lines, and its points behind them.
pub(super) fn tp(hand: &mut Hand, text: &str) -> Result<(), Diagnostic> {
    let points = points(text);
    let mut rpm = 0.0;
    let mut middle: Option<Tip> = None;
    for (at, line) in (1..).zip(text.lines()).skip_while(|(_, line)| !line.starts_with("/MN")) {
        hand.line = at;
        if line.starts_with("/POS") {
            break;
        }
        let code =
            line.trim().trim_start_matches(|c: char| c.is_ascii_digit()).trim_start_matches(':').trim();
        if let Some(comment) = code.strip_prefix('!') {
            hand.comment(comment.trim_end_matches(';').trim());
        } else if let Some(tool) = code.strip_prefix("R[1]=").and_then(number) {
            hand.take(tool.0 as u32);
        } else if let Some(speed) = code.strip_prefix("GO[1]=").and_then(number) {
            rpm = speed.0;
        } else if code.starts_with("DO[1]=") {
            hand.spindle(if code.contains("ON") { rpm } else { 0.0 });
        }
        let moves = code.starts_with("L ")
            || code.starts_with("C ")
            || code.starts_with("J ")
            || code.starts_with("P[");
        if !moves {
            continue;
        }
        let name = code.split("P[").nth(1).and_then(number).map(|(number, _)| number as u32);
        let to = name.and_then(|name| points.get(&name).copied());
        let to = to.ok_or_else(|| hand.refuse("readback.unknown_word", code))?;
        match (code.starts_with("C "), middle.take()) {
            (true, _) => middle = Some(to),
            (false, Some(middle)) => hand.arc_through(middle, to)?,
            (false, None) => hand.line_to(to, code.starts_with("J "))?,
        }
    }
    Ok(())
}

/// The points behind /POS by their numbers.
fn points(text: &str) -> BTreeMap<u32, Tip> {
    let mut points = BTreeMap::new();
    for entry in text.split("\nP[").skip(1) {
        let axis = |name: &str| {
            let rest = entry.split(name).nth(1)?.trim_start().strip_prefix('=')?;
            number(rest).map(|(number, _)| number)
        };
        let name = number(entry).map(|(number, _)| number as u32);
        let place = || Some(Tip { x: axis("X ")?, y: axis("Y ")?, z: axis("Z ")? });
        points.extend(name.zip(place()));
    }
    points
}
