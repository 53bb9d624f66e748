//! Robots: KUKA KRL, ABB RAPID, Fanuc TP, as in the shipped dialects.

use super::hand::{Hand, Tip};
use super::words::number;
use crate::code;
use crate::diagnostic::Diagnostic;
use std::collections::BTreeMap;

/// Starts of KRL statements that change no position.
const KRL_PASSED: &[&str] = &[
    "&",
    "DEF ",
    "INT ",
    "REAL ",
    "BOOL ",
    "DECL ",
    "BAS(#INITMOV,0)",
    "$VEL",
    "$ACC",
    "$OUT",
    "HALT",
    "WAIT SEC ",
];
/// Starts of RAPID statements that change no position.
const RAPID_PASSED: &[&str] = &[
    "PROC main",
    "VAR ",
    "PERS ",
    "CONST ",
    "ConfL",
    "ConfJ",
    "AccSet ",
    "VelSet ",
    "Stop;",
    "WaitTime ",
    "SetDO ",
    "Set ",
    "Reset ",
    "TPErase",
];

/// Frames and tools by name: their values must not change.
#[derive(Default)]
struct Stays(BTreeMap<String, String>);

impl Stays {
    fn same(&mut self, hand: &Hand, name: &str, value: &str) -> Result<(), Diagnostic> {
        let (name, value) = (name.trim().to_owned(), value.trim().to_owned());
        if *self.0.entry(name).or_insert_with(|| value.clone()) == value {
            return Ok(());
        }
        Err(hand.refuse(code!("readback.unknown_word"), value))
    }
}

/// Reads a KRL program: the first DEF of the file.
pub(super) fn krl(hand: &mut Hand, text: &str) -> Result<(), Diagnostic> {
    let mut stays = Stays::default();
    for (number, line) in (1..).zip(text.lines()) {
        hand.at_line(number)?;
        let (code, comment) = line.split_once(';').unwrap_or((line, ""));
        hand.comment(comment);
        let code = code.trim();
        if code == "END" {
            break;
        }
        let fast = code.starts_with("PTP {");
        if let Some(rpm) = called(code, "SPINDLE(") {
            hand.spindle(rpm);
        } else if let Some(tool) = called(code, "BIT(") {
            hand.take(tool as u32);
        } else if let (true, [Some(to)]) = (fast || code.starts_with("LIN "), frames(code).as_slice()) {
            hand.line_to(*to, fast)?;
        } else if let (true, [Some(middle), Some(to)]) = (code.starts_with("CIRC "), frames(code).as_slice())
        {
            hand.arc_through(*middle, *to)?;
        } else if let Some((name, value)) =
            code.split_once('=').filter(|_| code.starts_with("$BASE") || code.starts_with("$TOOL"))
        {
            stays.same(hand, name, value)?;
        } else if !code.is_empty()
            && code != "PTP $AXIS_ACT"
            && !KRL_PASSED.iter().any(|begin| code.starts_with(begin))
        {
            return Err(hand.refuse(code!("readback.unknown_word"), code));
        }
    }
    Ok(())
}

fn called(code: &str, name: &str) -> Option<f64> {
    number(code.strip_prefix(name)?).map(|(number, _)| number)
}

/// Positions of a move: `LIN {X 1.0, Y 2.0, Z 3.0, …}`. `None` for a frame without an axis. Empty if there
/// are words after a frame, because they may round corners or continue along the arc.
fn frames(code: &str) -> Vec<Option<Tip>> {
    let mut places = Vec::new();
    for frame in code.split('{').skip(1) {
        let Some((fields, behind)) = frame.split_once('}') else { return Vec::new() };
        if !["", ","].contains(&behind.trim()) {
            return Vec::new();
        }
        let axis = |name: &str| {
            fields
                .split(',')
                .find_map(|field| number(field.trim().strip_prefix(name)?).map(|(number, _)| number))
        };
        let place = || Some(Tip { x: axis("X ")?, y: axis("Y ")?, z: axis("Z ")? });
        places.push(place());
    }
    places
}

/// Reads a RAPID module: its procedure main.
pub(super) fn rapid(hand: &mut Hand, text: &str) -> Result<(), Diagnostic> {
    let mut stays = Stays::default();
    let mut inside = false;
    for (number, line) in (1..).zip(text.lines()) {
        hand.at_line(number)?;
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
        } else if code.starts_with("Move") {
            // Every target is a stop, in one frame and with one tool.
            let (_, frame) = words
                .split_once(",fine,")
                .ok_or_else(|| hand.refuse(code!("readback.unknown_word"), code))?;
            stays.same(hand, "frame", frame)?;
            match (code.get(4..6), targets(code).collect::<Vec<_>>().as_slice()) {
                (Some("L "), [to]) => hand.line_to(*to, false)?,
                (Some("J "), [to]) => hand.line_to(*to, true)?,
                (Some("C "), [middle, to]) => hand.arc_through(*middle, *to)?,
                _ => return Err(hand.refuse(code!("readback.unknown_word"), code)),
            }
        } else if !code.is_empty() && !RAPID_PASSED.iter().any(|begin| code.starts_with(begin)) {
            return Err(hand.refuse(code!("readback.unknown_word"), code));
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

/// Reads a TP program as text: its lines, and the points after them.
pub(super) fn tp(hand: &mut Hand, text: &str) -> Result<(), Diagnostic> {
    let points = points(text);
    let mut stays = Stays::default();
    let mut middle: Option<Tip> = None;
    for (at, line) in (1..).zip(text.lines()).skip_while(|(_, line)| !line.starts_with("/MN")) {
        hand.at_line(at)?;
        if line.starts_with("/POS") {
            break;
        }
        let code =
            line.trim().trim_start_matches(|c: char| c.is_ascii_digit()).trim_start_matches(':').trim();
        let code = code.trim_end_matches(';').trim_end();
        let follows = code.starts_with("P[");
        let moves = follows || ["L ", "C ", "J "].iter().any(|begin| code.starts_with(begin));
        if moves {
            let name = code.split("P[").nth(1).and_then(number).map(|(number, _)| number as u32);
            let begins = code.starts_with("C ");
            let stops = begins || code.ends_with(" FINE");
            let to = name.and_then(|name| points.get(&name).copied()).filter(|_| stops);
            let to = to.ok_or_else(|| hand.refuse(code!("readback.unknown_word"), code))?;
            match (begins, middle.take()) {
                (true, None) => middle = Some(to),
                (false, Some(middle)) if follows => hand.arc_through(middle, to)?,
                (false, None) if !follows => hand.line_to(to, code.starts_with("J "))?,
                _ => return Err(hand.refuse(code!("readback.unknown_word"), code)),
            }
        } else {
            beside(hand, &mut stays, code)?;
        }
    }
    Ok(())
}

/// A line of a TP program without a move.
fn beside(hand: &mut Hand, stays: &mut Stays, code: &str) -> Result<(), Diagnostic> {
    if let Some(comment) = code.strip_prefix('!') {
        hand.comment(comment.trim());
    } else if let Some(tool) = code.strip_prefix("R[1]=").and_then(number) {
        hand.take(tool.0 as u32);
    } else if let Some(speed) = code.strip_prefix("GO[1]=").and_then(number) {
        hand.speed(speed.0);
    } else if code.starts_with("DO[1]=") {
        hand.turn(code.ends_with("=ON"));
    } else if let Some((name, value)) =
        code.split_once('=').filter(|_| code.starts_with("UFRAME_NUM") || code.starts_with("UTOOL_NUM"))
    {
        stays.same(hand, name, value)?;
    } else if !["", "/MN", "PAUSE"].contains(&code)
        && !code.starts_with("DO[")
        && (!code.starts_with("WAIT ") || code.contains("LBL"))
    {
        return Err(hand.refuse(code!("readback.unknown_word"), code));
    }
    Ok(())
}

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
