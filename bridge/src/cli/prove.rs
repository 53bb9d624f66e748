//! Proves programs against their design: computes the copper that is left, and its effect on the nets.

use super::files;
use super::findings::{
    FindingReport, GroupReport, as_outcome, as_whole, finding_lines, outcome_line, whole_lines,
};
use super::memory;
use super::prove_files::{self, Given, Laid, Tools};
use super::prove_holes::{Done, OfCopper};
use super::{Answer, Refusal, as_objects, cam, diagnostic_lines, rounded, sentence};
use crate::cli::job;
use annulus_core::board::{Board, Face};
use annulus_core::cam::toolpaths::PlacedBoard;
use annulus_core::cam::work::Work;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::gcode::Interpreter;
use annulus_core::job::{Asked, Program, Promised};
use annulus_core::machine::virtual_drill;
use annulus_core::proof::{FindingKind, ProofOptions, ProofResult, Verdict, Whole};
use annulus_core::units::Length;
use annulus_core::{code, error, note};
use clap::ValueEnum;
use serde::Serialize;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Default thickness of a board.
const THICKNESS: Length = Length::from_um(1_600);

/// Arguments of `annulus prove`.
#[derive(Debug, clap::Args)]
pub(crate) struct ProveArgs {
    /// Read the design: copper, outline and drill files as a file, folder, zip or saved project.
    #[arg(value_name = "JOB")]
    pub(crate) job: PathBuf,
    /// Prove these programs or files for a controller, which run one after the other.
    #[arg(value_name = "FILE", required = true)]
    pub(crate) programs: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) reading: super::ReadingArgs,
    /// Use this job file of the programs for the position of the board, its copies, pins and tools.
    #[arg(long = "job", value_name = "FILE", conflicts_with = "turn")]
    pub(crate) work: Option<PathBuf>,
    /// Prove this side [default: the job file's, or top].
    #[arg(long, value_enum)]
    pub(crate) side: Option<Side>,
    /// Set how the board is flipped for its bottom side, as in `cam`.
    #[arg(long = "flip", alias = "turn", value_enum, default_value_t = Turn::LeftRight)]
    pub(crate) turn: Turn,
    /// Set the thickness of the copper, in µm.
    #[arg(long, value_name = "UM", default_value_t = 35.0, value_parser = |text: &str| within(text, 1.0, 1_000.0, "µm"))]
    pub(crate) copper_um: f64,
    /// Set the thickness of the board, in mm, which holes, slots and the cut-out must go through [default:
    /// from the files, or 1.6].
    #[arg(long, value_name = "MM", value_parser = |text: &str| within(text, 0.1, 20.0, "mm"))]
    pub(crate) board_mm: Option<f64>,
    /// Name a tool that the files don't describe, by its number: 2=end mill 0.8; for one file FILE:2=end mill
    /// 0.8. Separate several with ";".
    #[arg(long, value_delimiter = ';', value_name = "[FILE:]N=TOOL")]
    pub(crate) tools: Vec<String>,
    /// Check the files for this controller: a line that it refuses is an error. With any: lines that every
    /// controller refuses.
    #[arg(long = "for", value_name = "grbl|grblhal|linuxcnc|any", value_parser = interpreter, default_value = "any")]
    pub(crate) for_controller: Interpreter,
    /// Require this distance between nets and copper without a net, in mm.
    #[arg(long = "clearance", value_name = "MM")]
    pub(crate) clearance_mm: Option<f64>,
    /// Accept these problems, by name or by kind.
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
    /// Mirror X.
    LeftRight,
    /// Mirror Y.
    TopBottom,
    /// Don't flip: the program has the coordinates of the files.
    #[value(name = "none", alias = "not")]
    Not,
}

fn interpreter(text: &str) -> Result<Interpreter, String> {
    Interpreter::of(text).ok_or_else(|| "grbl, grblhal, linuxcnc or any".to_owned())
}

/// Parses a length in `unit`.
fn within(text: &str, low: f64, high: f64, unit: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|error| format!("{error}"))?;
    let fits = (low..=high).contains(&value);
    if fits { Ok(value) } else { Err(format!("from {low} to {high} {unit}")) }
}

pub(crate) fn run(args: &ProveArgs) -> Result<Answer, Refusal> {
    job::can_be_accepted(&args.accept)?;
    let read = files::read_board(std::slice::from_ref(&args.job), &args.reading)?;
    let (board, mut diagnostics) = read.board(true);
    let missing: Vec<Diagnostic> = read.artwork.missing(&read.listed).cloned().collect();
    refuse_unsure(&diagnostics, &missing, &args.accept)?;
    diagnostics.extend(missing);
    let tools = Tools::of(&args.tools)?;
    tools.all_given(&args.programs)?;
    let (pages, programs): (Vec<_>, Vec<_>) =
        args.programs.iter().partition(|path| prove_files::is_page(path));
    if !programs.is_empty() {
        let note = |path: &&PathBuf| note!("prove.not_a_program", file = path.display());
        diagnostics.extend(pages.iter().map(note));
    }
    let programs = if programs.is_empty() { pages } else { programs };
    let given: Vec<Given> = programs
        .into_iter()
        .map(|path| prove_files::given(path, &tools, args.for_controller))
        .collect::<Result<_, _>>()?;
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
    own_programs(args, board, work, programs, diagnostics)
}

/// Diagnostics that make a design uncertain: its outline or a layer may be the wrong one.
const UNSURE: [&str; 12] = [
    code!("board.outline_broken"),
    code!("board.outline_elsewhere"),
    code!("board.outline_open"),
    code!("set.copper_left_out"),
    code!("set.drawn_as_opening"),
    code!("set.misses_holes"),
    code!("set.only_copper"),
    code!("set.pads_alone"),
    code!("set.side_disputed"),
    code!("set.side_guessed"),
    code!("set.side_unknown"),
    code!("set.two_layers"),
];

/// Refuses a design with an uncertain outline or layer, or with a missing file: a proof against it means
/// nothing.
fn refuse_unsure(said: &[Diagnostic], missing: &[Diagnostic], accept: &[String]) -> Result<(), Refusal> {
    let matters = |one: &&Diagnostic| UNSURE.contains(&one.code.as_str());
    let mut matter = said.iter().filter(matters).chain(missing);
    let all = || said.iter().chain(missing).cloned().collect();
    let first = matter.find(|one| one.is_unacknowledged(accept));
    first.map_or(Ok(()), |first| Err(Refusal::content(first.clone()).among(all())))
}

/// Proves programs in Annulus' own format, all on one side.
fn own_programs(
    args: &ProveArgs,
    board: Board,
    work: Option<Work>,
    programs: Vec<Program>,
    diagnostics: Vec<Diagnostic>,
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
    let asked = (asked(args, work.as_ref(), &[face], None), work.is_some());
    let promised = work.map(|work| work.promised(face)).unwrap_or_default();
    let options = |face| measured(args, ProofOptions::of(face, promised.clone()));
    prove_sides(args, std::slice::from_ref(&side), &options, asked, diagnostics, true)
}

/// Refuses a side without copper if another side has some: the side is wrong. On a board without copper, the
/// rest is proved.
fn copper_or_none(args: &ProveArgs, side: &Laid) -> Result<(), Refusal> {
    if side.has_copper() || side.board.copper.iter().all(|copper| copper.region.is_empty()) {
        return Ok(());
    }
    let why = error!("proof.no_copper", side = side.face.name(), ..);
    Err(Refusal::content(why.with("path", args.job.display())))
}

/// Requirements beyond the copper: from the job if there is one. `said` is the board thickness in the files.
fn asked(args: &ProveArgs, work: Option<&Work>, faces: &[Face], said: Option<Length>) -> Asked {
    let thickness = args.board_mm.map(Length::from_mm).or(said).unwrap_or(THICKNESS);
    work.map_or(Asked::nothing(thickness), |work| work.asked(faces, thickness, &virtual_drill()))
}

/// Proves files for a controller, each on its side. Without a job, the board has the position that `cam`
/// gives it.
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
        // A job that was not planned promises only its tools.
        let bits = || Promised { owned: work.bits.clone(), ..Promised::default() };
        measured(args, ProofOptions::of(face, if planned { promised } else { bits() }))
    };
    prove_sides(args, &sides, &options, (asked, planned), diagnostics, false)
}

/// Proves all sides. `options` are those of a side of the job. Annulus' own programs are on one side, which
/// is proved even without copper.
fn prove_sides(
    args: &ProveArgs,
    sides: &[Laid],
    options: &dyn Fn(Face) -> ProofOptions,
    (asked, is_planned): (Asked, bool),
    mut diagnostics: Vec<Diagnostic>,
    is_own: bool,
) -> Result<Answer, Refusal> {
    let mut of_copper = OfCopper { isolates: false, stays: false, planned: is_planned };
    let mut reports = Vec::new();
    for side in sides {
        diagnostics.extend(side.diagnostics.iter().cloned());
        if !side.has_copper() {
            diagnostics.push(note!("prove.no_copper", side = side.face.name()));
            if !is_own {
                continue;
            }
        }
        let asked = ProofOptions { face: side.face, measured: true, ..options(side.face) };
        cam::refuse_too_large(&side.board, &side.programs)?;
        let verdict = memory::prove(&side.board, &side.programs, &asked);
        let copper = side.board.copper.iter().find(|copper| copper.face == side.face);
        if verdict.islands == 0 && copper.is_some_and(|copper| !copper.region.is_empty()) {
            let path = if is_own { args.job.display().to_string() } else { "JOB".to_owned() };
            return Err(Refusal::content(error!("proof.no_island", path = path)));
        }
        of_copper.isolates |= verdict.outcome.isolates;
        of_copper.stays |= stays(&verdict);
        let face = (!is_own).then_some(side.face.name());
        reports.push(SideReport::of(face, verdict, &args.accept));
    }
    let done = Done::of(sides, &asked, of_copper);
    diagnostics.extend(done.diagnostics());
    let open: usize = reports.iter().map(SideReport::open).sum();
    let unread = open + done.unread(&args.accept);
    let mut text: String = reports.iter().map(SideReport::text).collect();
    if reports.is_empty() {
        text += &outcome_line(&ProofResult::default(), unread);
    }
    text.extend(reports.iter().map(|side| outcome_line(&side.outcome, unread)));
    text += &diagnostic_lines(&diagnostics);
    let report = ProofReport {
        copper_lost_mm2: rounded(reports.iter().map(|side| side.lost_mm2).sum()),
        copper: if is_own { json!(reports.first()) } else { of_sides(reports, open) },
        done: done.object(),
        diagnostics: &diagnostics,
    };
    let why = error!("proof.unread_findings", count = unread);
    Ok(Answer::new(&report, text).with_error((unread > 0).then_some(why)))
}

/// All sides, then their problems together.
fn of_sides(mut sides: Vec<SideReport>, open: usize) -> Value {
    let findings: Vec<_> = sides.iter_mut().filter_map(|side| side.findings.take()).flatten().collect();
    json!({ "sides": sides, "findings": findings, "unread": open })
}

#[derive(Serialize)]
struct ProofReport<'a> {
    /// The only side, or all of them.
    #[serde(flatten)]
    copper: Value,
    copper_lost_mm2: f64,
    #[serde(flatten)]
    done: Value,
    #[serde(serialize_with = "as_objects")]
    diagnostics: &'a [Diagnostic],
}

/// The copper of one side. If it is the only one, it has no name.
#[derive(Serialize)]
struct SideReport {
    #[serde(skip_serializing_if = "Option::is_none")]
    face: Option<&'static str>,
    islands: u32,
    nets: u32,
    #[serde(serialize_with = "as_outcome")]
    outcome: ProofResult,
    pieces_left: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    unread: Option<usize>,
    groups: Vec<GroupReport>,
    #[serde(serialize_with = "as_whole")]
    whole: Option<Whole>,
    #[serde(skip_serializing_if = "Option::is_none")]
    findings: Option<Vec<FindingReport>>,
    more: u32,
    #[serde(skip)]
    lost_mm2: f64,
}

impl SideReport {
    fn of(face: Option<&'static str>, verdict: Verdict, accept: &[String]) -> Self {
        let finding = |finding| FindingReport::of(finding, accept, face);
        let groups = verdict.groups.iter().map(|group| GroupReport::of(group, accept)).collect();
        let report = Self {
            face,
            islands: verdict.islands,
            nets: verdict.nets,
            outcome: verdict.outcome,
            pieces_left: verdict.left.islands.len(),
            unread: None,
            groups,
            whole: verdict.whole,
            findings: Some(verdict.findings.iter().map(finding).collect()),
            more: verdict.more,
            lost_mm2: verdict.lost_mm2,
        };
        Self { unread: face.is_none().then_some(report.open()), ..report }
    }

    /// Number of problems that are not accepted.
    fn open(&self) -> usize {
        self.groups.iter().map(|group| group.unread).sum()
    }

    /// A summary line, then the problems.
    fn text(&self) -> String {
        let findings = self.findings.as_deref().unwrap_or_default();
        let key = if self.face.is_some() { "prove.report.side" } else { "proof.report.head" };
        let head = sentence(
            key,
            &[
                ("side", &self.face.unwrap_or_default()),
                ("islands", &self.islands),
                ("nets", &self.nets),
                ("pieces", &self.pieces_left),
                ("findings", &(findings.len() + self.more as usize)),
                ("unread", &self.open()),
                ("lost", &format!("{:.3}", self.lost_mm2)),
            ],
        );
        head + "\n" + &finding_lines(&self.groups, findings) + &whole_lines(self.whole.as_ref())
    }
}

/// Returns `true` if nets stay joined because nothing is milled between them.
fn stays(verdict: &Verdict) -> bool {
    verdict.findings.iter().any(|finding| finding.kind == FindingKind::NotIsolated)
}

/// Adds the user's copper thickness and clearance.
fn measured(args: &ProveArgs, options: ProofOptions) -> ProofOptions {
    let copper_thickness = Length::from_mm(args.copper_um / 1e3);
    ProofOptions { copper_thickness, clearance: args.clearance_mm.map(Length::from_mm), ..options }
}

/// The job of the job file, or of the saved project, if there is one.
fn work(args: &ProveArgs, board: &Board, saved: Option<&str>) -> Result<Option<Work>, Refusal> {
    // Setup and bits do not depend on the machine.
    let machine = virtual_drill();
    let opened = job::opened(board, saved, &machine)?;
    match &args.work {
        Some(path) => cam::job_file(path, &opened).map(Some),
        None => Ok(saved.map(|_| opened)),
    }
}

/// The board with `face` up, as in the job; without a job, flipped for its bottom side.
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
