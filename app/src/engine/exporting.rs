//! All sides of a job in a controller's words, numbered in the order of running, and what their run sheet says.
//!
//! ```text
//!  job ─ side by side: plan ─▶ program ─ proof ─┬─ something unread on any side: nothing is written
//!                                               └─▶ 01-bottom-… 02-bottom-… 03-top-…  briefing
//! ```
//!
//! The lines of one side, as they would be in its files, are written for the simulation before anything is read: they are looked
//! at there and not taken to a machine.
//!
//! Comes in: the job, what was read of its findings, a dialect. Goes out: [`Exported`]. Does not know workers, nor downloads.

use super::cache::Cache;
use super::messages::{Exported, ToExport, ToPlan};
use super::planning::{self, Side};
use super::proving;
use super::share::part;
use annulus_core::board::Face;
use annulus_core::cam::briefing;
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::job::{Briefing, Program};
use annulus_core::machine::Machine;
use annulus_core::post::{self, Dialect, Manner, OutputFile};
use annulus_core::{motion, proof, sim};

/// The name of the person's own dialect in diagnostics.
pub(super) const OWN: &str = "template.toml";

/// So many hundredths of a side are done when it is planned, and not proved yet.
const PLANNED: u64 = 50;

/// What a board is called that has no name.
const NAMELESS: &str = "board";

/// Writes what is `wanted`, or says what nobody has read of it.
pub(super) fn export(
    wanted: &ToExport,
    cache: &mut Cache,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Exported, Vec<Diagnostic>> {
    let mut unread = Vec::new();
    let mut look = |plan: &ToPlan, side: &Side, cache: &mut Cache, progress: &mut dyn FnMut(u64, u64)| {
        let names = proving::to_be_read(side, &plan.work, cache, progress);
        let findings = names.iter().filter(|name| !wanted.read.contains(name)).count();
        let errors =
            side.diagnostics.iter().filter(|diagnostic| diagnostic.is_unacknowledged(&plan.accept)).count();
        if findings + errors > 0 {
            unread.push((plan.work.setup.face, u32::try_from(findings + errors).unwrap_or(u32::MAX)));
        }
    };
    let sides = planned(wanted, cache, progress, &mut look)?;
    if !unread.is_empty() {
        return Ok(Exported { unread, ..Exported::default() });
    }
    let (sides, briefing) = written(sides, wanted)?;
    Ok(Exported { sides, briefing, unread })
}

/// The files of the side that is up in what is `wanted`, each line with its command.
pub(super) fn lines(
    wanted: &ToExport,
    cache: &mut Cache,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Vec<OutputFile>, Vec<Diagnostic>> {
    let sides = planned(wanted, cache, progress, &mut |_, _, _, _| {})?;
    let up = sides.iter().position(|(face, _)| *face == wanted.plan.work.setup.face);
    let (mut sides, _) = written(sides, wanted)?;
    match up.filter(|up| *up < sides.len()) {
        Some(up) => Ok(sides.swap_remove(up)),
        None => Err(vec![Diagnostic::error("cam.nothing_to_do")]),
    }
}

/// What looks at a side that was planned, and tells how far it is.
type Look<'l> = dyn FnMut(&ToPlan, &Side, &mut Cache, &mut dyn FnMut(u64, u64)) + 'l;

/// All sides of the job in the order of running; `look` sees each when it is planned.
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
        look(&plan, &side, cache, &mut part(&mut share, PLANNED, 100));
        sides.push((face, side));
    }
    if sides.is_empty() { Err(vec![Diagnostic::error("cam.nothing_to_do")]) } else { Ok(sides) }
}

/// The files of all sides, and what they say of the job.
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

/// What the files say of the job, with the times of its bits.
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

/// What writes one side of a job.
type Writer = Box<dyn Fn(&Program, &Briefing, usize) -> Result<Vec<OutputFile>, Diagnostic>>;

/// What writes in the words that are `wanted`.
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
            let unknown = Diagnostic::error("post.unknown_target").with("name", &target);
            Err(unknown.with("nearest", nearest).with("known", post::targets().join(", ")))
        });
        proved((dialect.as_ref(), false), program, files?)
    }))
}

/// The files, once they are read back and do what their program does.
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
