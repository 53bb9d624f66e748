//! Drill files as Annulus writes them: Excellon, metric, with points, X and Y on every hit, toolpaths routed.

use super::hand::{Hand, Tip};
use super::titles::titled;
use super::words::{Word, bare, of};
use crate::code;
use crate::diagnostic::Diagnostic;
use crate::post::excellon::THROUGH;

const OVER_MM: f64 = 2.0;

pub(super) fn read(hand: &mut Hand, text: &str) -> Result<(), Diagnostic> {
    let (mut head, mut routing, mut down, mut code) = (true, false, false, 0);
    for (line_number, line) in (1..).zip(text.lines()) {
        hand.at_line(line_number)?;
        let line = bare(line.split(';').next().unwrap_or_default());
        if line == "%" {
            head = false;
            hand.spindle(1.0);
            continue;
        }
        if head && !line.starts_with('T') {
            if line.contains("INCH") {
                return Err(hand.refuse(code!("readback.inch_drills"), &line));
            }
            continue;
        }
        let words = of(&line).map_err(|_| hand.refuse(code!("readback.unknown_word"), &line))?;
        let letter = |name| {
            words.iter().find_map(|word| match word {
                Word::Letter(letter, number) if *letter == name => Some(*number),
                _ => None,
            })
        };
        if let Some(tool) = letter('T').filter(|tool| *tool >= 1.0) {
            match letter('C') {
                Some(size) => hand.know(
                    tool as u32,
                    titled(&format!("drill {size}"))
                        .ok_or_else(|| hand.refuse(code!("readback.unknown_word"), &line))?,
                ),
                None => hand.take(tool as u32),
            }
            continue;
        }
        match letter('M').map(|code| code as u32) {
            Some(15) => {
                down = true;
                hand.line_to(Tip { z: -THROUGH.mm(), ..hand.tip }, false)?;
            }
            Some(16 | 17) => {
                down = false;
                hand.line_to(Tip { z: OVER_MM, ..hand.tip }, true)?;
            }
            Some(30) => break,
            _ => {}
        }
        if let Some(word) = letter('G').map(|code| code as u32) {
            routing = matches!(word, 0..=3) || (routing && word != 5);
            code = word;
        }
        let (Some(x), Some(y)) = (letter('X'), letter('Y')) else { continue };
        let to = Tip { x, y, z: if down { -THROUGH.mm() } else { OVER_MM } };
        match (routing, code) {
            (true, 2 | 3) if down => {
                let centre =
                    (hand.tip.x + letter('I').unwrap_or(0.0), hand.tip.y + letter('J').unwrap_or(0.0));
                hand.arc_to(to, centre, code == 3)?;
            }
            (true, _) => hand.line_to(to, !down)?,
            (false, _) => {
                hand.line_to(to, true)?;
                hand.line_to(Tip { z: -THROUGH.mm(), ..to }, false)?;
                hand.line_to(to, true)?;
            }
        }
    }
    Ok(())
}
