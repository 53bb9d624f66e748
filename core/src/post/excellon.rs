//! Writes a program as a drill file: Excellon, metric, with decimal points, X and Y on every hit. Coordinates
//! are those of the files that the board was made from. Toolpaths are routed.
//!
//! ```text
//!   height   ─────╮      ╭──tab──╮    ╭────     Excellon has no depth: only motion at the program's lowest
//!                 ╰══════╯       ╰════╯         height is routed (═), M15 down and M16 up
//! ```

use super::arcs::{Curve, Piece, Tip};
use super::dialect::Arcs;
use super::lined::Lined;
use super::number::{Format, TrailingZeros};
use super::read::Centre;
use crate::diagnostic::Diagnostic;
use crate::error;
use crate::geometry::Point;
use crate::job::{Command, CommandPlace, Cutter, Leg, Mark, Program};
use crate::locale::WRITTEN_BY;
use crate::units::Length;

/// Full circles are split in two: many readers ignore one with equal ends.
const CIRCLES: Arcs = Arcs {
    lines_only: false,
    chord_error_mm: 0.005,
    full_circle_parts: 2,
    longest_deg: 180.0,
    shortest_deg: 0.0,
    smallest_mm: 0.0,
    helix: super::dialect::Helix::Arcs,
};

/// Assumed depth of features without depth: through every board.
pub(super) const THROUGH: Length = Length::from_um(2_000);

/// A length in mm with three decimals, or six if three are not exact.
fn number(length: Length) -> String {
    let decimals = if length.nm() % 1_000 == 0 { 3 } else { 6 };
    Format { decimals, trailing: TrailingZeros::All, leading: 1, point: true, plus: false }.text(length.nm())
}

/// The program as a drill file. Refused if the depth matters: for V-bits, and for toolpaths that end above
/// others.
///
/// With `chord_error_mm` arcs are routed as lines with this tolerance.
pub fn excellon(program: &Program, chord_error_mm: Option<f64>) -> Result<String, Diagnostic> {
    lined(program, chord_error_mm).map(|(text, _)| text)
}

pub(super) fn lined(
    program: &Program,
    chord_error_mm: Option<f64>,
) -> Result<(String, Vec<CommandPlace>), Diagnostic> {
    let mut out = Lined::default();
    out.push("M48\n");
    // This line marks the file, so that Annulus does not read it as a drill file of the board.
    out.push(&format!("{WRITTEN_BY}\n"));
    out.push(";FORMAT={-:-/ absolute / metric / decimal}\nFMAT,2\nMETRIC\n");
    for (code, bit) in (1_u32..).zip(&program.bits) {
        out.push(&format!("T{code}C{}\n", number(bit.diameter)));
    }
    out.push("%\nG90\nG05\n");
    let mut router = Router::new(program, chord_error_mm);
    for (index, leg) in (0..).zip(&program.legs) {
        out.now = leg.end(index);
        match leg.mark {
            Mark::ToolChange(bit) => {
                router.bit = bit;
                out.push(&format!("T{}\n", u64::from(bit) + 1));
            }
            Mark::Hole(_) if !leg.commands.iter().any(mills) => {
                let at = place(leg, program.origin);
                out.push(&format!("X{}Y{}\n", number(at.x), number(at.y)));
            }
            Mark::Hole(_) | Mark::Toolpath(_) => router.route(&mut out, (index, leg))?,
            Mark::Prepare | Mark::Finish => {}
        }
    }
    out.push("T0\nM30\n");
    Ok(out.finish())
}

/// The program as far as a drill file expresses it: holes and toolpaths at its lowest height, through the
/// board. Of each tool only the diameter is known.
pub(super) fn said(program: &Program) -> Program {
    let floor = Router::new(program, None).floor;
    let mut said = program.clone();
    for bit in &mut said.bits {
        bit.cutter = Cutter::Drill;
    }
    let down = Command::Plunge { to: -THROUGH, feed_um_per_s: 1, gate: None };
    let up = Command::Retract { to: program.safe_height };
    for leg in &mut said.legs {
        let routes = leg.commands.iter().any(mills);
        let (mut height, mut cutting, mut commands) = (program.safe_height, false, Vec::new());
        for &command in &leg.commands {
            let before = height;
            match command {
                Command::Plunge { to, .. } | Command::Retract { to } => height = to,
                Command::Mill { height: to, .. } | Command::MillArc { height: to, .. } => height = to,
                _ => {}
            }
            let cuts = match command {
                Command::Plunge { .. } => !routes,
                _ => mills(&command) && before == floor && height == floor,
            };
            commands.extend((cuts && !cutting).then_some(down));
            commands.extend((cutting && !cuts).then_some(up));
            cutting = cuts;
            commands.push(match command {
                Command::Plunge { .. } | Command::Retract { .. } => continue,
                Command::Mill { to, feed_um_per_s, .. } if cuts => {
                    Command::Mill { to, height: -THROUGH, feed_um_per_s }
                }
                Command::MillArc { to, center, ccw, feed_um_per_s, .. } if cuts => {
                    Command::MillArc { to, height: -THROUGH, center, ccw, feed_um_per_s }
                }
                Command::Mill { to, .. } | Command::MillArc { to, .. } => Command::Rapid { to },
                other => other,
            });
        }
        commands.extend(cutting.then_some(up));
        leg.commands = commands;
    }
    said
}

fn mills(command: &Command) -> bool {
    matches!(command, Command::Mill { .. } | Command::MillArc { .. })
}

/// Position of a drilled leg, in the files' coordinates.
fn place(leg: &Leg, origin: Point) -> Point {
    let rapid = leg.commands.iter().find_map(|command| match command {
        Command::Rapid { to } => Some(*to),
        _ => None,
    });
    let at = rapid.unwrap_or_default();
    Point::new(at.x + origin.x, at.y + origin.y)
}

struct Router<'a> {
    program: &'a Program,
    /// The lowest height of all milling.
    floor: Length,
    bit: u32,
    down: bool,
    arcs: Arcs,
}

impl<'a> Router<'a> {
    fn new(program: &'a Program, chord_error_mm: Option<f64>) -> Self {
        let lines_only = chord_error_mm.is_some();
        let heights = program.legs.iter().filter(|leg| leg.commands.iter().any(mills)).flat_map(|leg| {
            leg.commands.iter().filter_map(|command| match *command {
                Command::Mill { height, .. } | Command::MillArc { height, .. } => Some(height),
                _ => None,
            })
        });
        let chord_error_mm = chord_error_mm.unwrap_or(CIRCLES.chord_error_mm);
        let arcs = Arcs { lines_only, chord_error_mm, ..CIRCLES };
        Self { program, floor: heights.min().unwrap_or_default(), bit: 0, down: false, arcs }
    }

    fn route(&mut self, out: &mut Lined, (index, leg): (u32, &Leg)) -> Result<(), Diagnostic> {
        let bit = self.program.bits.get(self.bit as usize);
        if let Some(bit) = bit.filter(|bit| matches!(bit.cutter, Cutter::Vee { .. })) {
            return Err(error!("post.excellon_vee", bit = bit.called()));
        }
        let before = out.place();
        let start = self.program.start_of_leg(index as usize);
        let mut tip = Tip { at: start, height: self.program.safe_height };
        for (place, command) in leg.placed(index) {
            out.now = place;
            let to = match command {
                Command::Rapid { to } => Tip { at: to, ..tip },
                Command::Plunge { to, .. } | Command::Retract { to } => Tip { height: to, ..tip },
                Command::Mill { to, height, .. } | Command::MillArc { to, height, .. } => {
                    Tip { at: to, height }
                }
                _ => continue,
            };
            let cuts = mills(&command) && tip.height == self.floor && to.height == self.floor;
            if cuts {
                self.lower(out, tip.at);
                match command {
                    Command::MillArc { center, ccw, .. } => {
                        self.arc(out, Curve { from: tip, to, centre: center, ccw });
                    }
                    _ => out.push(&format!("G01{}\n", self.words(to.at))),
                }
            } else if to != tip {
                self.raise(out);
            }
            tip = to;
        }
        self.raise(out);
        if out.place() == before {
            let diagnostic = error!("post.excellon_depth", ..);
            return Err(diagnostic.with("lowest", self.floor.mm()));
        }
        out.push("G05\n");
        Ok(())
    }

    fn arc(&self, out: &mut Lined, curve: Curve) {
        let mut from = curve.from;
        for piece in curve.pieces(&self.arcs, Centre::Said, |at| at) {
            let (to, code) = match piece {
                Piece::Line(to) => (to, "G01"),
                Piece::Arc(to, _) if curve.ccw => (to, "G03"),
                Piece::Arc(to, _) => (to, "G02"),
            };
            out.push(&format!("{code}{}", self.words(to.at)));
            if code != "G01" {
                let (i, j) = (curve.centre.x - from.at.x, curve.centre.y - from.at.y);
                out.push(&format!("I{}J{}", number(i), number(j)));
            }
            out.push("\n");
            from = to;
        }
    }

    fn words(&self, at: Point) -> String {
        let origin = self.program.origin;
        format!("X{}Y{}", number(at.x + origin.x), number(at.y + origin.y))
    }

    fn lower(&mut self, out: &mut Lined, at: Point) {
        if !self.down {
            out.push(&format!("G00{}\nM15\n", self.words(at)));
            self.down = true;
        }
    }

    fn raise(&mut self, out: &mut Lined) {
        if self.down {
            out.push("M16\n");
            self.down = false;
        }
    }
}
