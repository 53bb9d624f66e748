//! Writes all sides of a job as G-code, numbered in running order, and collects the contents of the run
//! sheet.
//!
//! ```text
//!  job ─ each side: plan ─▶ program ─ proof ─┬─ a problem unread on any side: nothing is written
//!                                            └─▶ 01-bottom-… 02-bottom-… 03-top-…  briefing
//! ```
//!
//! The list of lines in the simulation ignores unread problems, because it is not taken to a machine.

use super::cache::Cache;
use super::messages::{Exported, ToExport, ToPlan};
use super::planning::{self, Side};
use super::{part, proving};
use annulus_core::board::Face;
use annulus_core::cam::briefing;
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::error;
use annulus_core::job::{Briefing, Program};
use annulus_core::machine::Machine;
use annulus_core::post::{self, Dialect, Manner, OutputFile};
use annulus_core::{motion, proof, sim};

/// Name of the user's own postprocessor in messages.
pub(super) const OWN: &str = "template.toml";

/// Progress of a side in per cent when it is planned but not proved.
const PLANNED: u64 = 50;

/// Name of a board without a name.
const NAMELESS: &str = "board";

pub(super) fn export(
    wanted: &ToExport,
    cache: &mut Cache,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Exported, Vec<Diagnostic>> {
    let mut unread = Vec::new();
    let mut look = |plan: &ToPlan, side: &Side, cache: &mut Cache, progress: &mut dyn FnMut(u64, u64)| {
        let names = proving::to_be_read(side, &plan.work, cache, progress)?;
        let findings = names.iter().filter(|name| !wanted.read.contains(name)).count();
        let errors =
            side.diagnostics.iter().filter(|diagnostic| diagnostic.is_unacknowledged(&plan.accept)).count();
        if findings + errors > 0 {
            unread.push((plan.work.setup.face, u32::try_from(findings + errors).unwrap_or(u32::MAX)));
        }
        Ok(())
    };
    let sides = planned(wanted, cache, progress, &mut look)?;
    if !unread.is_empty() {
        return Ok(Exported { unread, ..Exported::default() });
    }
    let (sides, briefing) = written(sides, wanted)?;
    Ok(Exported { sides, briefing, unread })
}

/// The files of the side that is up, with the command of each line.
pub(super) fn lines(
    wanted: &ToExport,
    cache: &mut Cache,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Vec<OutputFile>, Vec<Diagnostic>> {
    let sides = planned(wanted, cache, progress, &mut |_, _, _, _| Ok(()))?;
    let up = sides.iter().position(|(face, _)| *face == wanted.plan.work.setup.face);
    let (mut sides, _) = written(sides, wanted)?;
    match up.filter(|up| *up < sides.len()) {
        Some(up) => Ok(sides.swap_remove(up)),
        None => Err(vec![error!("cam.nothing_to_do")]),
    }
}

/// Inspects a planned side and reports its progress.
type Look<'l> =
    dyn FnMut(&ToPlan, &Side, &mut Cache, &mut dyn FnMut(u64, u64)) -> Result<(), Vec<Diagnostic>> + 'l;

/// Plans all sides in running order and calls `look` for each.
fn planned(
    wanted: &ToExport,
    cache: &mut Cache,
    progress: &mut dyn FnMut(u64, u64),
    look: &mut Look<'_>,
) -> Result<Vec<(Face, Side)>, Vec<Diagnostic>> {
    let faces = wanted.plan.work.faces();
    let mut sides: Vec<(Face, Side)> = Vec::new();
    for (done, &face) in (0..).zip(&faces) {
        let mut plan: ToPlan = wanted.plan.clone();
        plan.work.setup.face = face;
        let mut share = |part, parts| progress(done * parts + part, faces.len() as u64 * parts);
        let side = planning::side(&plan, cache, &mut part(&mut share, 0, PLANNED))?;
        look(&plan, &side, cache, &mut part(&mut share, PLANNED, 100))?;
        sides.push((face, side));
    }
    if sides.is_empty() { Err(vec![error!("cam.nothing_to_do")]) } else { Ok(sides) }
}

fn written(
    sides: Vec<(Face, Side)>,
    wanted: &ToExport,
) -> Result<(Vec<Vec<OutputFile>>, Briefing), Vec<Diagnostic>> {
    let machine = wanted.plan.machine.machine()?;
    let briefing = briefed(&sides, wanted, &machine);
    let dialect = dialect(wanted, &Manner { lines_only_mm: wanted.lines_only_mm, ..Manner::on(&machine) })?;
    let mut files: Vec<Vec<OutputFile>> = Vec::new();
    for (index, (face, side)) in sides.into_iter().enumerate() {
        let name = format!("{}-{}", briefing.job, face.name());
        let program = Program { name, ..side.program };
        files.push(dialect(&program, &briefing, index).map_err(|why| vec![why])?);
    }
    Ok((files, briefing))
}

/// Contents of the run sheet, with the times of each tool.
fn briefed(sides: &[(Face, Side)], wanted: &ToExport, machine: &Machine) -> Briefing {
    let work = &wanted.plan.work;
    let name = sides.iter().map(|(_, side)| side.planned.board.name.as_str()).find(|name| !name.is_empty());
    let mut briefed = briefing::briefing(name.unwrap_or(NAMELESS), work, machine);
    for (face, side) in sides {
        let timeline = motion::timeline(&side.program, machine);
        let times_s = timeline.map(|timeline| sim::time_by_bit_s(&timeline)).unwrap_or_default();
        briefing::add_side(&mut briefed, *face, work, (&side.planned, &side.program), &times_s);
    }
    briefed
}

type Writer = Box<dyn Fn(&Program, &Briefing, usize) -> Result<Vec<OutputFile>, Diagnostic>>;

fn dialect(wanted: &ToExport, manner: &Manner) -> Result<Writer, Vec<Diagnostic>> {
    if let Some(text) = &wanted.text {
        let dialect = Dialect::parse(OWN, text).map_err(|why| vec![why])?.in_manner(manner);
        return Ok(Box::new(move |program, briefing, side| {
            proved((Some(&dialect), true), program, post::write_side(&dialect, program, briefing, side)?)
        }));
    }
    let (target, manner) = (wanted.target.clone(), manner.clone());
    let dialect = post::dialect(&target).and_then(Result::ok).map(|dialect| dialect.in_manner(&manner));
    Ok(Box::new(move |program, briefing, side| {
        let files = post::write_for(&target, program, &manner, briefing, side).unwrap_or_else(|| {
            let nearest = post::nearest_target(&target);
            let unknown = error!("post.unknown_target", name = &target, ..);
            Err(unknown.with("nearest", nearest).with("known", post::targets().join(", ")))
        });
        proved((dialect.as_ref(), false), program, files?)
    }))
}

/// Reads the files back and refuses them if they differ from the program.
fn proved(
    dialect: (Option<&Dialect>, bool),
    program: &Program,
    files: Vec<OutputFile>,
) -> Result<Vec<OutputFile>, Diagnostic> {
    let told = post::proved(dialect, program, &files, &proof::differences);
    match told.into_iter().find(|diagnostic| diagnostic.severity == Severity::Error) {
        Some(error) => Err(error),
        None => Ok(files),
    }
}
