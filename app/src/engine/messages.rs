//! Messages between page and worker, as plain data. Both are the same build, so the format need not stay
//! compatible.

use crate::view::Mesh;
use annulus_core::artwork::{Counts, FileRead, Role, Side};
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
use annulus_core::proof::Verdict;
use annulus_core::units::Length;
use serde::{Deserialize, Serialize};

#[derive(Debug, Serialize, Deserialize)]
pub struct Envelope {
    /// Repeated in the answer.
    pub id: u32,
    pub request: Request,
}

/// Requests to a worker. A new worker has no board: it must be sent the files first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Request {
    Open(ToOpen),
    Save(Project),
    Read(ToRead),
    Trace(ToRead),
    /// Export a drawing over files, as files or as a picture.
    WriteOver(ToWriteOver),
    Plan(ToPlan),
    Prove(ToProve),
    /// Write all sides of a job as G-code.
    Export(ToExport),
    /// Write the side that is up, for the list of lines in the simulation.
    Lines(ToExport),
    Check(ToWrite),
    Time(ToTime),
    Compare(Box<ToCompare>),
    Underside(ToUnderside),
}

#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ToOpen {
    /// File name, for messages.
    pub name: String,
    pub bytes: Vec<u8>,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ToWriteOver {
    pub read: ToRead,
    /// As a picture; else as files in a zip.
    pub picture: bool,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WrittenOver {
    pub name: String,
    pub bytes: Vec<u8>,
    pub is_picture: bool,
    /// Parts of the drawing that no longer match their files.
    pub lost: Vec<Diagnostic>,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ToRead {
    pub board_key: u32,
    /// Names and bytes. Zips are unpacked; drawings are applied to the other files.
    pub files: Vec<(String, Vec<u8>)>,
    /// The user's choices for the import.
    pub said: SaidOfFiles,
    /// The job of a saved project; else the default job.
    pub job: Option<String>,
    /// The machine for the default job; `None` for the virtual drill.
    pub machine: Option<Settings>,
}

/// Two versions of a board's files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToCompare {
    pub before: ToRead,
    /// The open files.
    pub now: ToRead,
    /// The job, made for the board before.
    pub work: Work,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Compared {
    /// The changes; those of the copper without areas.
    pub changes: BoardChanges,
    /// The changed areas of the copper, one entry per side.
    pub marks: Vec<CopperMarks>,
    /// The job with its positions moved along with the board; `None` if nothing moved.
    pub work: Option<Work>,
}

/// Added and removed copper of a side, as triangles in mm from the corner of [`Reading::body`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CopperMarks {
    pub face: Face,
    pub added: Mesh,
    pub gone: Mesh,
}

/// Result of a reading. The worker keeps the copper's areas under `board_key`; the page gets triangles.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// All files, including those in zips, in order.
    pub files: Vec<FileRow>,
    /// Indices of the files that the board was built from.
    pub used: Vec<u32>,
    /// The boards in the files, if there are several.
    pub boards: Vec<BoardRow>,
    /// The board without areas of copper.
    pub board: Board,
    pub board_key: u32,
    /// Box of the board: its outline, or everything with a margin.
    pub body: Option<Bounds>,
    /// Layers to display, the lowest first.
    pub layers: Vec<LayerRow>,
    pub work: Work,
    pub diagnostics: Vec<Diagnostic>,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BoardRow {
    pub name: String,
    /// Indices in [`Reading::files`].
    pub files: Vec<u32>,
    /// Index of the file whose layer is the preview.
    pub picture_of: Option<u32>,
    /// Triangles of that layer, in mm.
    pub mesh: Mesh,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LayerRow {
    /// Index in [`Reading::files`], if the layer is that of a single file.
    pub file: Option<u32>,
    pub role: Role,
    pub side: Option<Side>,
    /// Number of connected areas.
    pub islands: u32,
    /// Triangles in mm from the corner of [`Reading::body`].
    pub mesh: Mesh,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FileRow {
    /// Without its contents.
    pub read: FileRead,
    pub drill: Option<Counts>,
}

impl FileRow {
    pub fn of(mut read: FileRead) -> Self {
        let drill = read.drill.take().map(|drill| drill.totals());
        read.gerber = None;
        Self { read, drill }
    }

    /// True if the holes match the copper only after a shift.
    pub fn is_shifted(&self) -> bool {
        self.read.evidence.as_ref().is_some_and(|evidence| evidence.shift_mm.is_some())
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToPlan {
    /// A board that this worker has read; else it refuses with `engine.board_gone`.
    pub board_key: u32,
    pub machine: Settings,
    pub work: Work,
    /// Diameter of the tool in the spindle, which is used first; `None` for ascending sizes.
    pub loaded: Option<Length>,
    /// Codes of accepted errors.
    pub accept: Vec<String>,
    /// Key of the placed board that the page has; the answer includes the board only if the key differs.
    pub laid: Option<String>,
}

/// A program to prove, against the placed board that it was planned for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToProve {
    pub board_key: u32,
    /// The program's bytes.
    pub program: Vec<u8>,
    /// The job: its current side, the tools for fixes, and the promised limits.
    pub work: Work,
}

/// A job to write as G-code: all sides, if no problem is unread.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToExport {
    pub plan: ToPlan,
    /// Names of the problems that were read.
    pub read: Vec<String>,
    pub target: String,
    /// Text of the user's own postprocessor, which takes precedence over `target`.
    pub text: Option<String>,
    /// Replace arcs by lines with at most this deviation, in mm.
    pub lines_only_mm: Option<f64>,
}

/// A written job; empty if a problem is unread.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Exported {
    /// Programs of each side, in running order.
    pub sides: Vec<Vec<OutputFile>>,
    /// Contents of the run sheet, without language.
    pub briefing: Briefing,
    /// Per side: the number of unread problems of the proof and errors of the plan.
    pub unread: Vec<(Face, u32)>,
}

impl Exported {
    /// All programs in running order.
    pub fn files(&self) -> impl Iterator<Item = &OutputFile> {
        self.sides.iter().flatten()
    }

    /// The run sheet in `language`. Built by the page, because a worker has only the built-in language.
    pub fn sheet(&self, language: &str) -> RunSheet {
        post::run_sheet(language, &self.briefing, &self.sides)
    }
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ToWrite {
    /// The program's bytes; empty if there is no program yet.
    pub program: Vec<u8>,
    pub text: String,
    /// The machine, if known: its rapid heights, tool change height and times affect the output.
    pub machine: Option<Settings>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToUnderside {
    /// The job and its planning options; the side that is up is displayed.
    pub plan: ToPlan,
    /// The displayed box in work coordinates.
    pub bounds: Bounds,
}

/// A tile of the cuts from below: [`annulus_core::sim::TILE`] cells per side.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct UnderTile {
    /// Its first cell as seen from above, counted from the low corner.
    pub first: [u32; 2],
    /// Depths from below in µm, row by row.
    pub depths_um: Vec<u16>,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Checked {
    /// Errors in the order of the text.
    pub faults: Vec<Diagnostic>,
    /// Warnings, if there are no errors.
    pub warnings: Vec<Diagnostic>,
    pub output: String,
    /// The output is that of the program.
    pub of_program: bool,
}

/// As JSON text: fixes serialize in the form of reports, which postcard cannot read back.
mod as_json {
    use annulus_core::proof::Verdict;
    use serde::{Deserialize, Deserializer, Serializer, de, ser};

    pub(super) fn serialize<S: Serializer>(verdict: &Verdict, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&serde_json::to_string(verdict).map_err(ser::Error::custom)?)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Verdict, D::Error> {
        serde_json::from_str(&String::deserialize(deserializer)?).map_err(de::Error::custom)
    }
}

/// The board as placed for a plan: repeated, flipped.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Laid {
    /// The placement differs from the files.
    pub turned: bool,
    /// Without areas of copper.
    pub board: Board,
    pub body: Option<Bounds>,
    pub layers: Vec<LayerRow>,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlanReady {
    /// Position in the files' coordinates that becomes the work zero.
    pub origin: Point,
    /// Areas that tools must avoid, in the files' coordinates of the placed board.
    pub zones: Vec<Bounds>,
    /// For every toolpath of the program, the index of its operation.
    pub toolpath_operations: Vec<u16>,
    pub laid_key: String,
    /// The placed board, if the page does not have it.
    pub laid: Option<Laid>,
    /// Drilling tools in order of use.
    pub bits: Vec<PlannedBit>,
    /// Rapid travel of the drills with the holes in file order, mm.
    pub travel_before_mm: f64,
    /// Rapid travel of the drills as planned, mm.
    pub travel_after_mm: f64,
    /// Rapid time of the drills with the holes in file order, s.
    pub hop_time_before_s: f64,
    /// Rapid time of the drills as planned, s.
    pub hop_time_after_s: f64,
    /// The program's bytes, to upload.
    pub program: Vec<u8>,
    /// SHA-256 of the bytes.
    pub key: String,
    pub diagnostics: Vec<Diagnostic>,
}

#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlannedBit {
    pub diameter: Length,
    /// Sizes in the files that this tool drills.
    pub sizes: Vec<Length>,
    /// Indices of the board's holes, in drilling order.
    pub holes: Vec<u32>,
}

impl PlanReady {
    /// All holes in drilling order.
    pub fn order(&self) -> Vec<u32> {
        self.bits.iter().flat_map(|bit| bit.holes.iter().copied()).collect()
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToTime {
    pub program: Vec<u8>,
    pub machine: Settings,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Timed {
    pub timeline: Timeline,
    /// SHA-256 of the step stream, compared with the bridge's before the start.
    pub stream_digest: String,
    pub total_s: f64,
    /// Steps of X, Y and Z.
    pub steps: [u64; 3],
    pub holes: u32,
}

/// A machine's settings as JSON, as on the bridge's socket.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Settings(String);

impl Settings {
    pub fn of(machine: &Machine) -> Self {
        Self::from_values(&machine::read(machine))
    }

    /// From keys and values as the bridge sends them.
    pub fn from_values(values: &[(String, Value)]) -> Self {
        Self(serde_json::to_string(values).unwrap_or_default())
    }

    pub fn machine(&self) -> Result<Machine, Vec<Diagnostic>> {
        let values: Vec<(String, Value)> = serde_json::from_str(&self.0).unwrap_or_default();
        machine::apply(&machine::virtual_drill(), &values)
    }
}

#[derive(Debug, Serialize, Deserialize)]
pub enum WorkerReport {
    Progress {
        id: u32,
        done: u64,
        total: u64,
    },
    /// Answer of a request, or the reasons for a refusal.
    Done {
        id: u32,
        answer: Result<Answer, Vec<Diagnostic>>,
    },
    Panicked(String),
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Traced {
    pub imported: Vec<Imported>,
    /// The board's outline, in mm from the files' origin.
    pub outline_mm: Vec<Vec<[f32; 2]>>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Answer {
    Opened(Project),
    Saved(Vec<u8>),
    Read(Box<Reading>),
    Traced(Traced),
    WrittenOver(Box<WrittenOver>),
    Planned(Box<PlanReady>),
    /// Without the copper left.
    Proved(#[serde(with = "as_json")] Verdict),
    Exported(Box<Exported>),
    /// For [`Request::Lines`]: the files of the side, in running order.
    Lines(Vec<OutputFile>),
    Checked(Checked),
    Timed(Timed),
    Compared(Box<Compared>),
    Underside(Vec<UnderTile>),
}

#[derive(Debug, Serialize, Deserialize)]
pub enum ToDrill {
    /// Start the machine of the worker's name, at this multiple of real time.
    Start {
        speed: f64,
    },
    /// The port of an adapter is open: start its machine, or continue after a replug.
    AdapterOpened,
    /// A message of `wire`, as JSON.
    Frame(String),
    Bytes(Vec<u8>),
    /// The bytes for the port were passed on.
    Carried,
    Unplugged,
    Upload {
        number: u32,
        key: String,
        program: Vec<u8>,
    },
    Fetch {
        number: u32,
        key: String,
    },
}

#[derive(Debug, Serialize, Deserialize)]
pub enum FromDrill {
    /// A message of `wire`, as JSON.
    Frame(String),
    Bytes(Vec<u8>),
    /// Answer to an upload, without bytes, or to a fetch.
    Program {
        number: u32,
        answer: Result<Vec<u8>, Diagnostic>,
    },
    /// This browser keeps no files for this site.
    NothingKept,
    /// Nothing answered at this baud rate.
    Silent,
    /// The link is lost, or the worker has crashed.
    Lost,
}
