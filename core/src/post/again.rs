//! Reads written files back and compares them with the program.
//!
//! ```text
//!   program ─ shifted by the template; reduced to what a drill file can express ─▶ meant   ┐
//!   files ─── read back ───────────────────────────────────────────────────────▶ written ┴─▶ compare
//! ```
//!
//! Lengths in mm.

use super::dialect::{Dialect, Helix};
use super::head::parts;
use super::names::TemplateKind;
use super::writer::OutputFile;
use super::{excellon, read_back_for};
use crate::diagnostic::{Diagnostic, Severity};
use crate::gcode::Interpreter;
use crate::geometry::Point;
use crate::job::{Bit, Command, Program};
use crate::locale;
use crate::units::Length;
use crate::{code, warning};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Tolerance of arcs through rounded positions, in units of the last digit.
const UNITS: f64 = 4.0;
/// Further tolerance, in mm: whole nanometres, chords of the comparison.
const ROUNDING_MM: f64 = 0.002;
/// A drill file writes six decimals if three are not exact.
const DRILL_DECIMALS: u32 = 6;

/// Compares the first program with the others, within tolerances for positions and heights, in mm. Passed as
/// a function because `proof` is a layer above.
pub type Differences<'a> = &'a dyn Fn(&Program, &[Program], (f64, f64)) -> Vec<Diagnostic>;

/// Differences between `files` and the `program` written in this dialect (`None` for Excellon), and further
/// diagnostics. An error means that the file must not be run. A user's `own` template may use words that the
/// reader doesn't follow: that is a warning.
pub fn proved(
    (dialect, own): (Option<&Dialect>, bool),
    program: &Program,
    files: &[OutputFile],
    differences: Differences<'_>,
) -> Vec<Diagnostic> {
    let (meant, mut diagnostics) = match dialect {
        Some(dialect) => shifted(program, dialect),
        None => (Cow::Owned(excellon::said(program)), Vec::new()),
    };
    let named = dialect.filter(|_| !own).and_then(|dialect| Interpreter::of(&dialect.name));
    let of = named.unwrap_or_default();
    let mut written = Vec::new();
    for file in files {
        let bits = file.bits.iter().filter_map(|bit| program.bits.get(*bit as usize));
        let numbered: BTreeMap<u32, Bit> = file.numbers.iter().copied().zip(bits.cloned()).collect();
        // A file that names no tool uses the controller's tool table, which has the numbers of the job.
        let back = match read_back_for(&file.name, &file.text, &BTreeMap::new(), of) {
            Err(why) if why.code == "readback.no_tool" => {
                read_back_for(&file.name, &file.text, &numbered, of)
            }
            back => back,
        };
        match back {
            Ok(back) => {
                diagnostics.extend(back.diagnostics);
                let origin = if back.of_files { Point::default() } else { program.origin };
                written.push(Program { origin, ..back.program });
            }
            Err(why) => {
                let severity = if own && is_foreign(&why) { Severity::Warning } else { Severity::Error };
                let said = Diagnostic::new(severity, code!("written.unread"))
                    .with("why", why.message(locale::FALLBACK));
                diagnostics.push(Diagnostic { place: why.place, ..said });
                return diagnostics;
            }
        }
    }
    diagnostics.extend(differences(&meant, &written, slack(dialect)));
    diagnostics
}

/// True if words are merely not supported by the reader, not wrong.
fn is_foreign(why: &Diagnostic) -> bool {
    [code!("readback.unknown"), code!("readback.unknown_word"), code!("readback.changes_place")]
        .contains(&why.code.as_str())
}

/// Tolerance of positions and of heights, in mm.
fn slack(dialect: Option<&Dialect>) -> (f64, f64) {
    let unit = |decimals: u32| libm::pow(10.0, -f64::from(decimals.min(6)));
    let Some(dialect) = dialect else { return (UNITS * unit(DRILL_DECIMALS) + ROUNDING_MM, ROUNDING_MM) };
    let coarsest = ["X", "Y", "I", "J", "R", "CX", "CY", "AX", "AY"]
        .into_iter()
        .map(|name| dialect.numbers.of(name).decimals)
        .min();
    let arcs = &dialect.arcs;
    let lines =
        arcs.lines_only || arcs.shortest_deg > 0.0 || arcs.smallest_mm > 0.0 || arcs.helix == Helix::Lines;
    let chords = if lines { arcs.chord_error_mm } else { 0.0 };
    let depth = unit(dialect.numbers.of("Z").decimals);
    (chords + UNITS * unit(coarsest.unwrap_or_default()) + ROUNDING_MM, depth + ROUNDING_MM)
}

/// The program, shifted as the dialect's templates state, with a note about the shift.
fn shifted<'p>(program: &'p Program, dialect: &Dialect) -> (Cow<'p, Program>, Vec<Diagnostic>) {
    let shift =
        |part: TemplateKind| dialect.templates(part).map_or([Length::ZERO; 2], |templates| templates.shift);
    if TemplateKind::ALL.map(shift).iter().all(|shift| *shift == [Length::ZERO; 2]) {
        return (Cow::Borrowed(program), Vec::new());
    }
    let mut moved = program.clone();
    for (leg, part) in moved.legs.iter_mut().zip(parts(program, dialect)) {
        let [x, y] = shift(part);
        let by = |at: &mut Point| *at = Point::new(at.x + x, at.y + y);
        for command in &mut leg.commands {
            match command {
                Command::Rapid { to } | Command::Mill { to, .. } => by(to),
                Command::MillArc { to, center, .. } => {
                    by(to);
                    by(center);
                }
                _ => {}
            }
        }
    }
    let said = TemplateKind::ALL.map(shift).into_iter().find(|shift| *shift != [Length::ZERO; 2]);
    let said = said.map(|[x, y]| warning!("written.moved", x = x.mm(), y = y.mm()));
    (Cow::Owned(moved), said.into_iter().collect())
}
