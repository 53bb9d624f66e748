//! Written files read again, beside what they are to say (N8, C6).
//!
//! ```text
//!   program ─ shifted as the template says; for a drill file, what one can say ─▶ meant   ┐
//!   files ─── read back ─────────────────────────────────────────────────────▶ written ┴─▶ to be compared
//! ```
//!
//! Comes in: a program, the dialect that it was written in (none for Excellon), its files, a function that compares. Goes out:
//! diagnostics. Lengths in mm. Does not know what a difference is.

use super::dialect::{Dialect, Helix};
use super::names::TemplateKind;
use super::writer::{OutputFile, parts};
use super::{excellon, read_back};
use crate::diagnostic::{Diagnostic, Severity};
use crate::geometry::Point;
use crate::job::{Bit, Command, Program};
use crate::locale;
use crate::units::Length;
use std::collections::BTreeMap;

/// Arcs through places that were rounded may be off by so many units of the last digit.
const UNITS: f64 = 4.0;
/// What is off beside the digits, in mm: whole nanometres, chords of the comparison.
const ROUNDING_MM: f64 = 0.002;
/// Digits of a drill file that writes six where three are not exact.
const DRILL_DECIMALS: u32 = 6;

/// Says what files do otherwise than the program, the first one given, where places and heights may be off by so many mm:
/// the floor `proof` knows that.
pub type Differences<'a> = &'a dyn Fn(&Program, &[Program], (f64, f64)) -> Vec<Diagnostic>;

/// What `files` do otherwise than the `program` that was written in this dialect, none for Excellon; and what else there is to say of
/// them. An error is what must not be run. The words of a template of a person's `own` may be none that are followed: that is a warning.
pub fn proved(
    (dialect, own): (Option<&Dialect>, bool),
    program: &Program,
    files: &[OutputFile],
    differences: Differences<'_>,
) -> Vec<Diagnostic> {
    let (meant, mut diagnostics) = match dialect {
        Some(dialect) => shifted(program, dialect),
        None => (excellon::said(program), Vec::new()),
    };
    let mut written = Vec::new();
    for file in files {
        let bits = file.bits.iter().filter_map(|bit| program.bits.get(*bit as usize));
        let numbered: BTreeMap<u32, Bit> = file.numbers.iter().copied().zip(bits.cloned()).collect();
        // A file that names no tool leaves it to the table of the controller: that has the numbers of the job.
        let back = match read_back(&file.name, &file.text, &BTreeMap::new()) {
            Err(why) if why.code == "readback.no_tool" => read_back(&file.name, &file.text, &numbered),
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
                let said =
                    Diagnostic::new(severity, "written.unread").with("why", why.message(locale::FALLBACK));
                diagnostics.push(Diagnostic { place: why.place, ..said });
                return diagnostics;
            }
        }
    }
    diagnostics.extend(differences(&meant, &written, slack(dialect)));
    diagnostics
}

/// Whether words are of a kind that is not followed, and not wrong.
fn is_foreign(why: &Diagnostic) -> bool {
    ["readback.unknown", "readback.unknown_word", "readback.changes_place"].contains(&why.code.as_str())
}

/// How far places and heights may be off.
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

/// The program, moved as the templates of the dialect say; and that they do.
fn shifted(program: &Program, dialect: &Dialect) -> (Program, Vec<Diagnostic>) {
    let mut moved = program.clone();
    let shift =
        |part: TemplateKind| dialect.templates(part).map_or([Length::ZERO; 2], |templates| templates.shift);
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
    let said = said.map(|[x, y]| Diagnostic::warning("written.moved").with("x", x.mm()).with("y", y.mm()));
    (moved, said.into_iter().collect())
}
