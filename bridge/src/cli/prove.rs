//! Proves programs against the design that they were made for (N8): which copper is left, and what that does to the nets.
//!
//! Comes in: the files of the design, programs, perhaps the job file that they were planned from. Goes out: every finding
//! with place, width, nets and cures, and what is wrong with holes, slots and the edge; exit code 1 while there are findings that
//! nobody has accepted. Does not know how the programs were made.

use super::files;
use super::findings::{finding_lines, finding_object, groups_object, unread, whole_lines, whole_object};
use super::prove_files::{self, Given, Laid, Tools};
use super::prove_holes::Done;
use super::{Answer, Exit, Refusal, cam, diagnostic_lines, diagnostic_objects, rounded};
use crate::cli::job;
use annulus_core::board::{Board, BoardWanted, Face, from_artwork_with};
use annulus_core::cam::toolpaths::PlacedBoard;
use annulus_core::cam::work::Work;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::{Asked, Program, Promised};
use annulus_core::locale;
use annulus_core::machine::virtual_drill;
use annulus_core::proof::{self, FindingKind, ProofOptions, Verdict};
use annulus_core::units::Length;
use clap::ValueEnum;
use serde_json::{Value, json};
use std::path::PathBuf;

/// How thick a board is where nobody says.
const THICKNESS: Length = Length::from_um(1_600);

/// Arguments of `annulus prove`.
#[derive(Debug, clap::Args)]
pub(crate) struct ProveArgs {
    /// The design: copper, outline and drill files; a file, a folder, a zip or a saved project.
    #[arg(value_name = "JOB")]
    pub(crate) job: PathBuf,
    /// Programs, or files written for a controller, that are run on it one after the other.
    #[arg(value_name = "FILE", required = true)]
    pub(crate) programs: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) reading: super::ReadingArgs,
    /// Job file of the programs: the board lies as it says, with its copies and pins, and cures know its bits.
    #[arg(long = "job", value_name = "FILE", conflicts_with = "turn")]
    pub(crate) work: Option<PathBuf>,
    /// The side that is looked at; without it the job file's, else the top.
    #[arg(long, value_enum)]
    pub(crate) side: Option<Side>,
    /// How the board lies when its bottom is up, as `cam` turns it over.
    #[arg(long, value_enum, default_value_t = Turn::LeftRight)]
    pub(crate) turn: Turn,
    /// Thickness of the copper in µm.
    #[arg(long, value_name = "UM", default_value_t = 35.0, value_parser = copper_um)]
    pub(crate) copper_um: f64,
    /// Thickness of the board in mm, through which holes, slots and the cut-out must go; without it what the heads of the files
    /// say, else 1.6.
    #[arg(long, value_name = "MM", value_parser = board_mm)]
    pub(crate) board_mm: Option<f64>,
    /// A tool of the files, by its number, where they do not say what it is: 2=end mill 0.8, of one file FILE:2=end mill 0.8;
    /// several with ";".
    #[arg(long, value_delimiter = ';', value_name = "[FILE:]N=TOOL")]
    pub(crate) tools: Vec<String>,
    /// How far copper that belongs to nothing must be away from the nets, in mm.
    #[arg(long = "clearance", value_name = "MM")]
    pub(crate) clearance_mm: Option<f64>,
    /// Findings that were read and may stay, by name or by kind.
    #[arg(long, value_delimiter = ',', value_name = "ID|KIND")]
    pub(crate) accept: Vec<String>,
}

/// A side of a board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Side {
    /// The component side.
    Top,
    /// The solder side.
    Bottom,
}

/// How a board is flipped for its bottom side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Turn {
    /// X is mirrored.
    LeftRight,
    /// Y is mirrored.
    TopBottom,
    /// Not at all: the program has the coordinates of the files.
    Not,
}

fn copper_um(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|error| format!("{error}"))?;
    if (1.0..=1_000.0).contains(&value) { Ok(value) } else { Err("from 1 to 1000 µm".to_owned()) }
}

fn board_mm(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|error| format!("{error}"))?;
    if (0.1..=20.0).contains(&value) { Ok(value) } else { Err("from 0.1 to 20 mm".to_owned()) }
}

/// Runs the command.
pub(crate) fn run(args: &ProveArgs) -> Result<Answer, Refusal> {
    job::can_be_accepted(&args.accept)?;
    let read = files::read_board(std::slice::from_ref(&args.job), &args.reading)?;
    let wanted = BoardWanted { copper: true, aligned: read.said.aligned };
    let (board, mut diagnostics) = from_artwork_with(&read.artwork, &read.used, wanted);
    diagnostics.extend(read.drawn);
    let tools = Tools::of(&args.tools)?;
    tools.all_given(&args.programs)?;
    let given: Vec<Given> =
        args.programs.iter().map(|path| prove_files::given(path, &tools)).collect::<Result<_, _>>()?;
    let work = work(args, &board, read.job.as_deref())?;
    let side =
        |one: &Given| if let Given::Own(program) = one { prove_files::own_side(program) } else { None };
    let named = |face: Face| given.iter().any(|one| side(one) == Some(face));
    let both = args.side.is_none() && named(Face::Top) && named(Face::Bottom);
    if both || given.iter().any(|one| matches!(one, Given::File(_))) {
        return files(args, &board, work, given, diagnostics);
    }
    let own = |one: Given| if let Given::Own(program) = one { Some(program) } else { None };
    let programs: Vec<Program> = given.into_iter().filter_map(own).collect();
    // Against an outline that is not the board's nothing is proved.
    let about_outline = |diagnostic: &&Diagnostic| diagnostic.code.starts_with("board.outline");
    if let Some(error) =
        diagnostics.iter().filter(about_outline).find(|diagnostic| diagnostic.is_unacknowledged(&args.accept))
    {
        return Err(Refusal::content(error.clone()));
    }
    own_programs(args, board, work, programs, diagnostics)
}

/// Proves programs of our own, all on one side.
fn own_programs(
    args: &ProveArgs,
    board: Board,
    work: Option<Work>,
    programs: Vec<Program>,
    mut diagnostics: Vec<Diagnostic>,
) -> Result<Answer, Refusal> {
    let named = programs.iter().find_map(prove_files::own_side);
    let face = match (args.side, named, &work) {
        (Some(Side::Bottom), ..) => Face::Bottom,
        (Some(Side::Top), ..) => Face::Top,
        (None, Some(named), _) => named,
        (None, None, work) => work.as_ref().map_or(Face::Top, |work| work.setup.face),
    };
    let side = laid(board, work.as_ref(), (face, args.turn), programs);
    copper_or_none(args, &side)?;
    let (asked, is_planned) = (asked(args, work.as_ref(), &[face], None), work.is_some());
    let promised = work.map(|work| work.promised(face)).unwrap_or_default();
    let options = ProofOptions { measured: true, ..measured(args, ProofOptions::of(face, promised)) };
    let verdict = proof::prove(&side.board, &side.programs, &options);
    let copper = side.board.copper.iter().find(|copper| copper.face == face);
    if verdict.islands == 0 && copper.is_some_and(|copper| !copper.region.is_empty()) {
        let why = Diagnostic::error("proof.no_island").with("path", args.job.display());
        return Err(Refusal::content(why));
    }
    let isolates = !verdict.findings.iter().any(|finding| finding.kind == FindingKind::NotIsolated);
    let done = Done::of(std::slice::from_ref(&side), &asked, isolates || is_planned);
    diagnostics
        .extend((!side.has_copper()).then(|| Diagnostic::note("prove.no_copper").with("side", face.name())));
    diagnostics.extend(done.diagnostics());
    let mut object = verdict_object(&verdict, &args.accept);
    if let Value::Object(rows) = &mut object {
        rows.insert("copper_lost_mm2".to_owned(), rounded(verdict.lost_mm2).into());
        rows.extend(done.rows());
        rows.insert("diagnostics".to_owned(), diagnostic_objects(&diagnostics).into());
    }
    let text = verdict_text(&verdict, &args.accept) + &diagnostic_lines(&diagnostics);
    let unread = unread(&verdict.groups, &args.accept) + done.unread(&args.accept);
    if unread == 0 {
        return Ok(Answer { object, text, exit: Exit::Done });
    }
    let why = Diagnostic::error("proof.unread_findings").with("count", unread);
    Ok(Answer::refused(object, &text, why))
}

/// Refuses a side without copper where another one has some: the side is wrong. On a board without any, the rest is proved.
fn copper_or_none(args: &ProveArgs, side: &Laid) -> Result<(), Refusal> {
    if side.has_copper() || side.board.copper.iter().all(|copper| copper.region.is_empty()) {
        return Ok(());
    }
    let why = Diagnostic::error("proof.no_copper").with("side", side.face.name());
    Err(Refusal::content(why.with("path", args.job.display())))
}

/// What is asked beyond the copper: by the job, else by nobody. `said` is how thick the files say that the board is.
fn asked(args: &ProveArgs, work: Option<&Work>, faces: &[Face], said: Option<Length>) -> Asked {
    let thickness = args.board_mm.map(Length::from_mm).or(said).unwrap_or(THICKNESS);
    work.map_or(Asked::nothing(thickness), |work| work.asked(faces, thickness))
}

/// Proves files written for a controller, on the sides that they are for. Without a job the board lies as `cam` lays it.
fn files(
    args: &ProveArgs,
    board: &Board,
    work: Option<Work>,
    given: Vec<Given>,
    diagnostics: Vec<Diagnostic>,
) -> Result<Answer, Refusal> {
    let planned = work.is_some();
    let work = work.unwrap_or_else(|| Work::default_for(board, &virtual_drill()));
    let face = args.side.map(|side| if side == Side::Bottom { Face::Bottom } else { Face::Top });
    let said = given.iter().filter_map(Given::thickness).max();
    let sides = prove_files::laid(board, &work, face, given);
    sides.iter().try_for_each(|side| copper_or_none(args, side))?;
    let faces: Vec<Face> = sides.iter().map(|side| side.face).collect();
    let asked = asked(args, Some(&work).filter(|_| planned), &faces, said);
    let options = |face| {
        let promised = work.promised(face);
        // A job that nobody planned promises nothing but its bits.
        let bits = || Promised { owned: work.bits.clone(), ..Promised::default() };
        measured(args, ProofOptions::of(face, if planned { promised } else { bits() }))
    };
    prove_sides(&sides, &options, (&asked, planned), &args.accept, diagnostics)
}

/// Proves all sides. `options` are those of a side of the job.
fn prove_sides(
    sides: &[Laid],
    options: &dyn Fn(Face) -> ProofOptions,
    (asked, is_planned): (&Asked, bool),
    accept: &[String],
    mut diagnostics: Vec<Diagnostic>,
) -> Result<Answer, Refusal> {
    let (mut text, mut findings, mut reports, mut lost, mut open, mut isolates) =
        (String::new(), Vec::new(), Vec::new(), 0.0, 0, true);
    for side in sides {
        diagnostics.extend(side.diagnostics.iter().cloned());
        if !side.has_copper() {
            diagnostics.push(Diagnostic::note("prove.no_copper").with("side", side.face.name()));
            continue;
        }
        let asked = ProofOptions { face: side.face, measured: true, ..options(side.face) };
        let verdict = proof::prove(&side.board, &side.programs, &asked);
        let copper = side.board.copper.iter().find(|copper| copper.face == side.face);
        if verdict.islands == 0 && copper.is_some_and(|copper| !copper.region.is_empty()) {
            return Err(Refusal::content(Diagnostic::error("proof.no_island").with("path", "JOB")));
        }
        lost += verdict.lost_mm2;
        open += unread(&verdict.groups, accept);
        isolates &= !verdict.findings.iter().any(|finding| finding.kind == FindingKind::NotIsolated);
        findings.extend(
            verdict.findings.iter().map(|finding| with_face(finding_object(finding, accept), side.face)),
        );
        text += &side_text(side.face, &verdict, accept);
        reports.push(side_object(side.face, &verdict, accept));
    }
    let done = Done::of(sides, asked, isolates || is_planned);
    let unseen = done.unread(accept);
    diagnostics.extend(done.diagnostics());
    text += &diagnostic_lines(&diagnostics);
    let mut object = json!({
        "sides": reports,
        "findings": findings,
        "unread": open,
        "copper_lost_mm2": rounded(lost),
    });
    if let Value::Object(rows) = &mut object {
        rows.extend(done.rows());
        rows.insert("diagnostics".to_owned(), diagnostic_objects(&diagnostics).into());
    }
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

fn side_text(face: Face, verdict: &Verdict, accept: &[String]) -> String {
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

/// With what a person says of the copper.
fn measured(args: &ProveArgs, options: ProofOptions) -> ProofOptions {
    let copper_thickness = Length::from_mm(args.copper_um / 1e3);
    ProofOptions { copper_thickness, clearance: args.clearance_mm.map(Length::from_mm), ..options }
}

/// The work of the job file, else of the saved project, if there is one.
fn work(args: &ProveArgs, board: &Board, saved: Option<&str>) -> Result<Option<Work>, Refusal> {
    // Setup and bits do not depend on the machine.
    let machine = virtual_drill();
    let opened = job::opened(board, saved, &machine)?;
    match &args.work {
        Some(path) => cam::job_file(path, &opened, &machine).map(Some),
        None => Ok(saved.map(|_| opened)),
    }
}

/// The board with `face` up: as the job lays it, else by itself, turned over for its bottom.
fn laid(board: Board, work: Option<&Work>, (face, turn): (Face, Turn), programs: Vec<Program>) -> Laid {
    let (board, pins) = match (work, face, turn) {
        (Some(work), ..) => {
            let mut work = work.clone();
            work.setup.face = face;
            let scene = PlacedBoard::of(&board, &work);
            (scene.board, scene.pins)
        }
        (None, Face::Top, _) | (None, _, Turn::Not) => (board, 0..0),
        (None, Face::Bottom, turn) => (board.turned(turn == Turn::LeftRight), 0..0),
    };
    Laid { face, board, pins, programs, diagnostics: Vec::new() }
}

/// A verdict for scripts.
fn verdict_object(verdict: &Verdict, accept: &[String]) -> Value {
    json!({
        "islands": verdict.islands,
        "nets": verdict.nets,
        "pieces_left": verdict.left.islands.len(),
        "unread": unread(&verdict.groups, accept),
        "groups": groups_object(&verdict.groups, accept),
        "whole": verdict.whole.as_ref().map(whole_object),
        "findings": verdict.findings.iter().map(|f| finding_object(f, accept)).collect::<Vec<_>>(),
        "more": verdict.more,
    })
}

/// A verdict for people: a line in front, then the findings.
fn verdict_text(verdict: &Verdict, accept: &[String]) -> String {
    let say = |key: &str, words: &[(&str, String)]| {
        let words: Vec<_> = words.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
        locale::text("en", key, &words) + "\n"
    };
    let findings = &verdict.findings;
    let out = say(
        "proof.report.head",
        &[
            ("islands", verdict.islands.to_string()),
            ("nets", verdict.nets.to_string()),
            ("pieces", verdict.left.islands.len().to_string()),
            ("findings", (findings.len() + verdict.more as usize).to_string()),
            ("unread", unread(&verdict.groups, accept).to_string()),
        ],
    );
    if findings.is_empty() {
        return out + &say("proof.report.none", &[]);
    }
    out + &finding_lines(&verdict.groups, findings, accept) + &whole_lines(verdict.whole.as_ref())
}
