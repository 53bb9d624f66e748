//! What page and worker say to each other, as plain data. Page and worker are the same build, so nothing here needs to
//! stay readable for long.
//!
//! Comes in, goes out: messages. Does not know how they travel.

use crate::view::Mesh;
use annulus_core::board::changes::BoardChanges;
use annulus_core::board::drawing::Imported;
use annulus_core::board::{Board, Face};
use annulus_core::cam::work::Work;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::{Bounds, Point};
use annulus_core::job::Briefing;
use annulus_core::machine::{self, Machine, Value};
use annulus_core::motion::Timeline;
use annulus_core::post::{self, OutputFile, RunSheet};
use annulus_core::project::saved::{Project, SaidOfFiles};
use annulus_core::proof::{Finding, Group, Whole};
use annulus_core::units::Length;
use serde::{Deserialize, Serialize};

/// One request with its number.
#[derive(Debug, Serialize, Deserialize)]
pub struct Envelope {
    /// Number of the request; the answer bears it too.
    pub id: u32,
    /// What is wanted.
    pub request: Request,
}

/// What can be asked of the worker. A new worker has no board: it is given the files again first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Request {
    /// Take a saved project apart.
    Open(ToOpen),
    /// Make the file of a project.
    Save(Project),
    /// Read files and make the board of some of them.
    Read(ToRead),
    /// Read files for what they draw, to be drawn over.
    Trace(ToRead),
    /// Write what lies over files, as files or as a picture.
    WriteOver(ToWriteOver),
    /// Plan the operations of a job, make the program.
    Plan(ToPlan),
    /// Look at what copper a program leaves.
    Prove(ToProve),
    /// Write all sides of a job in a controller's words.
    Export(ToExport),
    /// Write the side that is up, to be followed line by line in the simulation.
    Lines(ToExport),
    /// Look for faults in a dialect, and at what it makes.
    Check(ToWrite),
    /// Turn a program into moves and steps.
    Time(ToTime),
    /// Compare a board with what it was in files from before.
    Compare(Box<ToCompare>),
    /// Carve what was done of the other side before.
    Underside(ToUnderside),
}

/// A project to open.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ToOpen {
    /// Its name, for diagnostics.
    pub name: String,
    /// Its bytes.
    pub bytes: Vec<u8>,
}

/// A drawing over files to be written.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ToWriteOver {
    /// The files, and the drawing among them.
    pub read: ToRead,
    /// As a picture, else as files in one zip.
    pub picture: bool,
}

/// It is written.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WrittenOver {
    /// Name of the file to save.
    pub name: String,
    /// What is in it.
    pub bytes: Vec<u8>,
    /// It is a picture.
    pub is_picture: bool,
    /// What of the drawing fits its files no longer.
    pub lost: Vec<Diagnostic>,
}

/// Files to read.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ToRead {
    /// The number by which the board shall be known.
    pub board_key: u32,
    /// Names and bytes; zips are opened. Drawings among them are laid over the others.
    pub files: Vec<(String, Vec<u8>)>,
    /// What a person says of them.
    pub said: SaidOfFiles,
    /// The job file of a saved project; without it the board opens with what fits it.
    pub job: Option<String>,
    /// The machine, for the job that the board opens with; none for the virtual drill.
    pub machine: Option<Settings>,
}

/// Two sets of files of one board.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToCompare {
    /// Those from before.
    pub before: ToRead,
    /// Those that are open.
    pub now: ToRead,
    /// The job, made for the board before.
    pub work: Work,
}

/// What changed from one set of files to another.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Compared {
    /// What changed; its copper without the areas.
    pub changes: BoardChanges,
    /// Those areas, side by side.
    pub marks: Vec<CopperMarks>,
    /// The job with its places where they were on the board, where that is another one.
    pub work: Option<Work>,
}

/// The copper of a side that came and that went, as triangles in mm from the corner of [`Reading::body`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CopperMarks {
    /// Which side.
    pub face: Face,
    /// What came.
    pub added: Mesh,
    /// What went.
    pub gone: Mesh,
}

/// What was read. The areas of the copper stay with the worker, which knows them by `board_key`; the page gets their triangles.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// Every file and every member of every zip, in order.
    pub files: Vec<FileRow>,
    /// Which of them the board was made of.
    pub used: Vec<u32>,
    /// The boards that they are of, where that is more than one.
    pub boards: Vec<BoardRow>,
    /// The board without the areas of its copper.
    pub board: Board,
    /// The number by which the worker knows the whole board.
    pub board_key: u32,
    /// The box of the board: its outline, or whatever there is with a margin.
    pub body: Option<Bounds>,
    /// Layers to be seen, the lowest first.
    pub layers: Vec<LayerRow>,
    /// The job that it opens with.
    pub work: Work,
    /// What was found in making it.
    pub diagnostics: Vec<Diagnostic>,
}

/// One of several boards, to be chosen from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BoardRow {
    /// Its name.
    pub name: String,
    /// Its rows in [`Reading::files`].
    pub files: Vec<u32>,
    /// The row of the layer that stands for it in the picture.
    pub picture_of: Option<u32>,
    /// The triangles of that layer, in mm.
    pub mesh: Mesh,
}

/// One layer as the picture shows it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LayerRow {
    /// The row of [`Reading::files`] it came from, where it came from one file.
    pub file: Option<u32>,
    /// `copper`, `mask`, ….
    pub role: String,
    /// `top`, `bottom` or `inner`.
    pub side: Option<String>,
    /// How many connected pieces it has.
    pub islands: u32,
    /// Its triangles, in mm from the corner of [`Reading::body`].
    pub mesh: Mesh,
}

/// One file, as the import review shows it. The words are those of `annulus inspect --json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FileRow {
    /// Its name, for example `board.zip!/drill.drl`.
    pub name: String,
    /// `drill`, `gerber`, `report`, `archive`, `refused` or `unknown`.
    pub kind: String,
    /// `drill`, `copper`, `outline`, ….
    pub role: String,
    /// `top`, `bottom` or `inner`.
    pub side: Option<String>,
    /// Why it is taken for what it is.
    pub reason: Diagnostic,
    /// Plated, not plated, or not said.
    pub plated: Option<bool>,
    /// The program that wrote it.
    pub generator: Option<String>,
    /// For drill files: how its numbers are read.
    pub drill: Option<DrillRow>,
    /// Its holes lie on the copper only when they are moved.
    pub shifted: bool,
    /// What was found in it.
    pub diagnostics: Vec<Diagnostic>,
}

/// What a drill file holds and how it was read.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DrillRow {
    /// `mm` or `inch`.
    pub units: Option<String>,
    /// Digits before and behind the point, where it is not written.
    pub digits: Option<(u8, u8)>,
    /// `leading`, `trailing`, `none` or `decimal`.
    pub zeros: Option<String>,
    /// What that rests on: `person`, `header`, `comment`, `companion`, `copper`, `shape` or `default`.
    pub evidence: String,
    /// Share of holes on copper under this reading, 0 to 1.
    pub score: Option<f64>,
    /// The same for the best other reading.
    pub runner_up: Option<f64>,
    /// That other reading, for people.
    pub runner_up_reading: Option<String>,
    /// Where its holes would lie.
    pub runner_up_holes: Vec<Point>,
    /// Single holes.
    pub hits: u32,
    /// Straight slots.
    pub slots: u32,
    /// Routed paths.
    pub routes: u32,
    /// Sizes of its tools, in the file's order.
    pub tools: Vec<ToolRow>,
}

/// One tool of a drill file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ToolRow {
    /// Its number in the file.
    pub code: u32,
    /// Its diameter, if the file says.
    pub diameter: Option<Length>,
    /// Holes and slots made with it.
    pub uses: u32,
}

/// A board to plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToPlan {
    /// The number of a board that this worker has read; one that has not refuses with `engine.board_gone`.
    pub board_key: u32,
    /// The machine.
    pub machine: Settings,
    /// The job.
    pub work: Work,
    /// The bit in the spindle: it goes first. None for ascending sizes.
    pub loaded: Option<Length>,
    /// Codes of errors that a person has seen.
    pub accept: Vec<String>,
    /// How the board lies in the picture; it is sent again only where it lies otherwise.
    pub laid: Option<String>,
}

/// A program to prove. The board is the one it was planned for, as it lies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToProve {
    /// The number of the board.
    pub board_key: u32,
    /// The program's bytes.
    pub program: Vec<u8>,
    /// The job, for the side that is up, the bits for cures, and what was agreed to.
    pub work: Work,
}

/// A job to be written in a controller's words: all of its sides, once nothing in them is unread.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToExport {
    /// The job and what it is planned with, whatever side is up in it.
    pub plan: ToPlan,
    /// Names of findings that were read.
    pub read: Vec<String>,
    /// What it is written for: a name that ships.
    pub target: String,
    /// The text of a dialect of the person's own, which goes before the name.
    pub text: Option<String>,
    /// Arcs become lines that are at most so far off, in mm.
    pub lines_only_mm: Option<f64>,
}

/// A job that was written; nothing is, while something in it is unread.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Exported {
    /// The programs of each side, in the order of running.
    pub sides: Vec<Vec<OutputFile>>,
    /// What the run sheet says of them, in no language yet.
    pub briefing: Briefing,
    /// What nobody has read yet, side by side: findings of the proof and errors of the plan.
    pub unread: Vec<(Face, u32)>,
}

impl Exported {
    /// All programs, in the order of running.
    pub fn files(&self) -> impl Iterator<Item = &OutputFile> {
        self.sides.iter().flatten()
    }

    /// What the person takes to the machine, in `language`. The page makes it: a worker knows no language but its own.
    pub fn sheet(&self, language: &str) -> RunSheet {
        post::run_sheet(language, &self.briefing, &self.sides)
    }
}

/// A program to be written in a controller's words, while its template is edited.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ToWrite {
    /// The program's bytes; none of them where there is no program yet.
    pub program: Vec<u8>,
    /// The text of the dialect.
    pub text: String,
    /// The machine that it is for, where that is known: how near to the board bits fall fast, how high they are changed, how
    /// long all of it takes.
    pub machine: Option<Settings>,
}

/// A board whose other side was done before.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToUnderside {
    /// The job and what it is planned with; the side that is up in it is looked at.
    pub plan: ToPlan,
    /// The box of the board that is looked at, in work coordinates.
    pub bounds: Bounds,
}

/// A tile of what is cut from below: [`annulus_core::sim::TILE`] cells along each side.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct UnderTile {
    /// Its first cell as seen from above, counted from the low corner.
    pub first: [u32; 2],
    /// Depths from below in µm, row by row.
    pub depths_um: Vec<u16>,
}

/// What is to be said of a dialect.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Checked {
    /// What is wrong with it, in the order of its text.
    pub faults: Vec<Diagnostic>,
    /// What it leaves uncertain, where it has no faults.
    pub warnings: Vec<Diagnostic>,
    /// What it makes of the program, or of a small sample.
    pub output: String,
    /// That is the program, and not the sample.
    pub of_program: bool,
}

/// What the proof found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Proved {
    /// The worst first.
    #[serde(with = "as_json")]
    pub findings: Vec<Finding>,
    /// How many more there are.
    pub more: u32,
    /// All of them by what they have in common, in the same order.
    pub groups: Vec<Group>,
    /// What a change of the whole job opens, where gaps are not open.
    pub whole: Option<Whole>,
    /// Islands of copper that shall stay.
    pub islands: u32,
    /// Nets that they belong to.
    pub nets: u32,
}

/// Findings name their cures as people write them in reports, which the bytes between page and worker cannot.
mod as_json {
    use annulus_core::proof::Finding;
    use serde::{Deserialize, Deserializer, Serializer, de, ser};

    pub(super) fn serialize<S: Serializer>(findings: &[Finding], serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&serde_json::to_string(findings).map_err(ser::Error::custom)?)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Finding>, D::Error> {
        serde_json::from_str(&String::deserialize(deserializer)?).map_err(de::Error::custom)
    }
}

/// The board as it lies for a plan: copied, turned over.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Laid {
    /// It lies otherwise than the files show it.
    pub turned: bool,
    /// Without the areas of its copper.
    pub board: Board,
    /// Its box.
    pub body: Option<Bounds>,
    /// Layers to be seen.
    pub layers: Vec<LayerRow>,
}

/// A plan and its program.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlanReady {
    /// The place in the files' coordinates that becomes the work zero.
    pub origin: Point,
    /// Where no bit may go, in the files' coordinates as the board lies.
    pub zones: Vec<Bounds>,
    /// For every way of the program, the operation that it belongs to.
    pub toolpath_operations: Vec<u16>,
    /// How the board lies.
    pub laid_key: String,
    /// The board as it lies, where that was not known.
    pub laid: Option<Laid>,
    /// Bits that drill, in order of use.
    pub bits: Vec<PlannedBit>,
    /// Length of the toolpaths as in the file, mm.
    pub travel_before_mm: f64,
    /// The same as planned.
    pub travel_after_mm: f64,
    /// Time of the toolpaths as in the file, s.
    pub hop_time_before_s: f64,
    /// The same as planned.
    pub hop_time_after_s: f64,
    /// The program's bytes, to be uploaded.
    pub program: Vec<u8>,
    /// Their SHA-256.
    pub key: String,
    /// What was found in planning.
    pub diagnostics: Vec<Diagnostic>,
}

/// One bit of a plan.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlannedBit {
    /// Its diameter.
    pub diameter: Length,
    /// The sizes in the files that it stands in for.
    pub sizes: Vec<Length>,
    /// Holes in order, as indices into the board's holes.
    pub holes: Vec<u32>,
}

impl PlanReady {
    /// All holes in order of drilling.
    pub fn order(&self) -> Vec<u32> {
        self.bits.iter().flat_map(|bit| bit.holes.iter().copied()).collect()
    }
}

/// A program to time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToTime {
    /// Its bytes.
    pub program: Vec<u8>,
    /// The machine.
    pub machine: Settings,
}

/// A program in time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Timed {
    /// Every move, for playback.
    pub timeline: Timeline,
    /// SHA-256 of the step stream, to be compared with the bridge's before Start.
    pub stream_digest: String,
    /// How long all of it takes, s.
    pub total_s: f64,
    /// Steps of X, Y and Z.
    pub steps: [u64; 3],
    /// Holes drilled.
    pub holes: u32,
}

/// A machine as it travels: its settings as JSON, as on the bridge's socket.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Settings(String);

impl Settings {
    /// The settings of `machine`.
    pub fn of(machine: &Machine) -> Self {
        Self::from_values(&machine::read(machine))
    }

    /// Keys and values, as the bridge tells them.
    pub fn from_values(values: &[(String, Value)]) -> Self {
        Self(serde_json::to_string(values).unwrap_or_default())
    }

    /// The machine, or what is wrong with it.
    pub fn machine(&self) -> Result<Machine, Vec<Diagnostic>> {
        let values: Vec<(String, Value)> = serde_json::from_str(&self.0).unwrap_or_default();
        machine::apply(&machine::virtual_drill(), &values)
    }
}

/// What the worker says.
#[derive(Debug, Serialize, Deserialize)]
pub enum WorkerReport {
    /// How far a request is.
    Progress {
        /// Which.
        id: u32,
        /// Done so far.
        done: u64,
        /// In all.
        total: u64,
    },
    /// A request is done, or refused for reasons.
    Done {
        /// Which.
        id: u32,
        /// The answer.
        answer: Result<Answer, Vec<Diagnostic>>,
    },
    /// Its last words.
    Panicked(String),
}

/// What files draw.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Traced {
    /// What of it can be caught.
    pub imported: Vec<Imported>,
    /// The closed lines of the board's edge, in mm from the files' zero point.
    pub outline_mm: Vec<Vec<[f32; 2]>>,
}

/// Answers, one kind a request.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Answer {
    /// To [`Request::Open`].
    Opened(Project),
    /// To [`Request::Save`].
    Saved(Vec<u8>),
    /// To [`Request::Read`].
    Read(Box<Reading>),
    /// To [`Request::Trace`].
    Traced(Traced),
    /// To [`Request::WriteOver`].
    WrittenOver(Box<WrittenOver>),
    /// To [`Request::Plan`].
    Planned(Box<PlanReady>),
    /// To [`Request::Prove`].
    Proved(Proved),
    /// To [`Request::Export`].
    Exported(Box<Exported>),
    /// To [`Request::Lines`]: the files of the side, in the order of running.
    Lines(Vec<OutputFile>),
    /// To [`Request::Check`].
    Checked(Checked),
    /// To [`Request::Time`].
    Timed(Timed),
    /// To [`Request::Compare`].
    Compared(Box<Compared>),
    /// To [`Request::Underside`].
    Underside(Vec<UnderTile>),
}
