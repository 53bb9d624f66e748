//! Proves written files: read back, laid on the board side by side, swept with the tools that they state (N8, C6).
//!
//! ```text
//!   FILE… ─ read back ─▶ programs, by the side of their heads ─┬─ top ─▶ board as it lies ─▶ proof ─┐
//!   JOB, job file ─▶ how the board lies, where its zero is ────┴─ bottom ─ turned ──────────▶ proof ─┴─▶ findings, copper, holes
//! ```
//!
//! Comes in: the board, the job that lays it, programs and files. Goes out: what they do to copper and holes. Does not know how
//! the files were made.

use super::findings::{finding_lines, finding_object, groups_object, unread, whole_lines, whole_object};
use super::{Answer, Exit, Refusal, diagnostic_lines, diagnostic_objects, rounded};
use crate::cli::job;
use annulus_core::board::{Board, Face};
use annulus_core::cam::toolpaths::Scene;
use annulus_core::cam::work::Work;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Point;
use annulus_core::job::{Bit, Program};
use annulus_core::locale;
use annulus_core::post::{self, Written};
use annulus_core::proof::{self, Drilled, Options, Verdict};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::Path;

/// Places of holes that are named.
const NAMED: usize = 5;

/// A program, or a file read back.
pub(super) enum Given {
    /// One of Annulus' own: it knows where its zero is.
    Own(Program),
    /// A file in the words of a controller.
    File(Box<Written>),
}

/// What stands in the file at `path`.
pub(super) fn given(path: &Path, tools: &BTreeMap<u32, Bit>) -> Result<Given, Refusal> {
    if let Some(program) = job::program_file(path)? {
        return Ok(Given::Own(program));
    }
    let trouble = |error: std::io::Error| {
        let why = Diagnostic::error("job.unreadable").with("file", path.display());
        Refusal::surroundings(why.with("reason", error))
    };
    let name = path.display().to_string();
    let mut bytes = Vec::new();
    let file = fs::File::open(path).map_err(trouble)?;
    // One byte more than may be read: the file may grow meanwhile, or be a pipe that has no length.
    file.take(Written::LARGEST as u64 + 1).read_to_end(&mut bytes).map_err(trouble)?;
    if bytes.len() > Written::LARGEST {
        return Err(Refusal::content(Diagnostic::error("readback.too_large").at(&name, 0, 0)));
    }
    let text = String::from_utf8_lossy(&bytes);
    let written = post::read_back(&name, &text, tools).map_err(Refusal::content)?;
    Ok(Given::File(Box::new(written)))
}

/// The tools of `--tools`: a number and a title each.
pub(super) fn tools(said: &[String]) -> Result<BTreeMap<u32, Bit>, Refusal> {
    let tool = |text: &String| {
        let (number, title) = text.split_once('=')?;
        Some((number.trim().parse().ok()?, post::titled(title)?))
    };
    let faulty = |text: &String| Refusal::usage(Diagnostic::error("prove.bad_tool").with("found", text));
    said.iter().map(|text| tool(text).ok_or_else(|| faulty(text))).collect()
}

/// The programs for one side, and the board as it lies for them.
pub(super) struct Laid {
    pub(super) face: Face,
    pub(super) board: Board,
    pub(super) programs: Vec<Program>,
    pub(super) diagnostics: Vec<Diagnostic>,
}

/// Lays the board for every side that programs are for: as their heads say, else `face`, else the side that the job has up.
pub(super) fn laid(board: &Board, work: &Work, face: Option<Face>, given: Vec<Given>) -> Vec<Laid> {
    let mut sides: Vec<Laid> = Vec::new();
    for one in given {
        let (mut program, side, of_files, diagnostics) = match one {
            Given::Own(program) => (program, None, None, Vec::new()),
            Given::File(written) => {
                let Written { program, side, of_files, diagnostics } = *written;
                (program, side, Some(of_files), diagnostics)
            }
        };
        let said = side.as_deref().map(|side| if side == "bottom" { Face::Bottom } else { Face::Top });
        let face = said.or(face).unwrap_or(work.setup.face);
        let known = sides.iter().position(|side| side.face == face);
        let work =
            Work { setup: annulus_core::cam::work::Setup { face, ..work.setup.clone() }, ..Work::default() };
        let scene = Scene::of(board, &work);
        match of_files {
            Some(true) => program.origin = Point::default(),
            Some(false) => program.origin = scene.origin,
            None => {}
        }
        match known.and_then(|at| sides.get_mut(at)) {
            Some(side) => {
                side.programs.push(program);
                side.diagnostics.extend(diagnostics);
            }
            None => sides.push(Laid { face, board: scene.board, programs: vec![program], diagnostics }),
        }
    }
    sides
}

/// Proves all sides. `options` are those of a side of the job.
pub(super) fn prove(
    sides: &[Laid],
    options: &dyn Fn(Face) -> Options,
    accept: &[String],
    mut diagnostics: Vec<Diagnostic>,
) -> Result<Answer, Refusal> {
    let drilled =
        proof::drilled(&sides.iter().map(|side| (&side.board, side.programs.as_slice())).collect::<Vec<_>>());
    let (mut text, mut findings, mut reports, mut lost, mut open) =
        (String::new(), Vec::new(), Vec::new(), 0.0, 0);
    for side in sides {
        let asked = Options { face: side.face, measured: true, ..options(side.face) };
        let verdict = proof::prove(&side.board, &side.programs, &asked);
        let copper = side.board.copper.iter().find(|copper| copper.face == side.face);
        if verdict.islands == 0 && copper.is_some_and(|copper| !copper.region.is_empty()) {
            return Err(Refusal::content(Diagnostic::error("proof.no_island").with("path", "JOB")));
        }
        lost += verdict.lost_mm2;
        open += unread(&verdict.groups, accept);
        findings.extend(
            verdict.findings.iter().map(|finding| with_face(finding_object(finding, accept), side.face)),
        );
        text += &sentences(side.face, &verdict, accept);
        reports.push(side_object(side.face, &verdict, accept));
        diagnostics.extend(side.diagnostics.iter().cloned());
    }
    let holes = hole_diagnostics(&drilled);
    let accepted = |diagnostic: &&Diagnostic| accept.contains(&diagnostic.code);
    let unseen = holes.iter().filter(|diagnostic| !accepted(diagnostic)).count();
    diagnostics.extend(holes);
    text += &diagnostic_lines(&diagnostics);
    let object = json!({
        "sides": reports,
        "findings": findings,
        "unread": open,
        "copper_lost_mm2": rounded(lost),
        "drilled": {
            "missing": drilled.missing.len(),
            "doubled": drilled.doubled.len(),
            "shifted": drilled.shifted.len(),
        },
        "diagnostics": diagnostic_objects(&diagnostics),
    });
    if open + unseen == 0 {
        return Ok(Answer { object, text, exit: Exit::Done });
    }
    let why = Diagnostic::error("proof.unread_findings").with("count", open + unseen);
    Ok(Answer::refused(object, &text, why))
}

fn with_face(mut finding: Value, face: Face) -> Value {
    if let Value::Object(rows) = &mut finding {
        rows.insert("face".to_owned(), face.name().into());
    }
    finding
}

fn side_object(face: Face, verdict: &Verdict, accept: &[String]) -> Value {
    json!({
        "face": face.name(),
        "islands": verdict.islands,
        "nets": verdict.nets,
        "pieces_left": verdict.left.islands.len(),
        "groups": groups_object(&verdict.groups, accept),
        "whole": verdict.whole.as_ref().map(whole_object),
        "more": verdict.more,
    })
}

fn sentences(face: Face, verdict: &Verdict, accept: &[String]) -> String {
    let unread = unread(&verdict.groups, accept);
    let words = [
        ("side", face.name().to_owned()),
        ("islands", verdict.islands.to_string()),
        ("nets", verdict.nets.to_string()),
        ("findings", (verdict.findings.len() + verdict.more as usize).to_string()),
        ("unread", unread.to_string()),
        ("lost", format!("{:.3}", verdict.lost_mm2)),
    ];
    let words = words.map(|(name, value)| (name.to_owned(), value));
    let head = locale::text("en", "prove.report.side", &words) + "\n";
    head + &finding_lines(&verdict.groups, &verdict.findings, accept) + &whole_lines(verdict.whole.as_ref())
}

/// What is wrong with the holes, by kind.
fn hole_diagnostics(drilled: &Drilled) -> Vec<Diagnostic> {
    let rows = [
        ("prove.missing", &drilled.missing),
        ("prove.doubled", &drilled.doubled),
        ("prove.shifted", &drilled.shifted),
    ];
    let said = rows.into_iter().filter(|(_, places)| !places.is_empty()).map(|(code, places)| {
        let named = places.iter().take(NAMED).map(|at| format!("X {:.2} Y {:.2}", at.x.mm(), at.y.mm()));
        let named: Vec<String> = named.collect();
        Diagnostic::error(code).with("count", places.len()).with("places", named.join(", "))
    });
    said.collect()
}
