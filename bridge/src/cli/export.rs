//! Writes a program for a controller; `export_board` writes the board itself.

use super::{Answer, Refusal, as_objects, diagnostic_lines, sentence};
use crate::cli::job;
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::error;
use annulus_core::job::{Briefing, Program};
use annulus_core::machine::Machine;
use annulus_core::post::{self, FileSplit, Manner, OutputFile};
use annulus_core::proof;
use annulus_core::wire::program;
use serde::Serialize;
use std::convert::Infallible;
use std::fmt::Display;
use std::fs;
use std::path::{Path, PathBuf};

/// Names of the formats of a board.
pub(super) const BOARD_FORMATS: [&str; 2] = ["gerber", "svg"];
/// Name of the target for Annulus' own program format.
pub(super) const OWN_FORM: &str = "program";

/// Arguments of `annulus export`.
#[derive(Debug, clap::Args)]
pub(crate) struct ExportArgs {
    #[command(flatten)]
    pub(crate) job: super::JobArgs,
    #[command(flatten)]
    pub(crate) target: TargetArgs,
}

/// What is written, and where.
#[derive(Debug, clap::Args)]
pub(crate) struct TargetArgs {
    /// Write for this controller, or with a postprocessor file.
    #[arg(long, value_name = "NAME|FILE", help = known_targets(), value_parser = target_name)]
    pub(crate) to: String,
    /// Replace arcs by lines that deviate at most MM [default without MM: 0.005].
    #[arg(long = "arcs-to-lines", alias = "lines-only", value_name = "MM", num_args = 0..=1,
          require_equals = true, default_missing_value = "0.005", value_parser = chord_error)]
    pub(crate) lines_only_mm: Option<f64>,
    /// Write to this file or folder.
    #[arg(short, long, value_name = "FILE|DIR")]
    pub(crate) output: PathBuf,
}

impl ExportArgs {
    /// True if the board itself is written, not a program.
    pub(super) fn is_of_board(&self) -> bool {
        BOARD_FORMATS.contains(&self.target.to.as_str())
    }
}

/// Help text that lists every controller and format.
fn known_targets() -> String {
    let ([gerber, svg], controllers) = (BOARD_FORMATS, post::targets().join(", "));
    format!(
        "Write for {controllers}, or with your own postprocessor, FILE.toml. {gerber} and {svg} write the \
         board itself"
    )
}

/// A target's own spelling: its name counts in any case. Anything else is the path of a file.
pub(super) fn target_name(text: &str) -> Result<String, Infallible> {
    let mut known = post::targets().into_iter().chain(BOARD_FORMATS).chain([OWN_FORM]);
    let name = known.find(|name| name.eq_ignore_ascii_case(text)).unwrap_or(text);
    Ok(name.to_owned())
}

pub(super) fn chord_error(text: &str) -> Result<f64, String> {
    let found = text.parse().ok().filter(|error: &f64| (1e-4..=1.0).contains(error));
    found.ok_or_else(|| sentence("post.chord_error", &[]))
}

/// Written files.
pub(crate) struct Written {
    pub(crate) names: Vec<String>,
    /// Messages of their proof, without errors.
    pub(crate) diagnostics: Vec<Diagnostic>,
    /// Contents of all files, concatenated.
    pub(crate) bytes: Vec<u8>,
}

pub(crate) fn run(args: &ExportArgs) -> Result<Answer, Refusal> {
    let target = Target::named(&args.target.to)?;
    let job = job::open(&args.job)?;
    let mut program = job.program;
    if program.name.is_empty() || args.target.output.is_dir() {
        program.name = job::stem(&args.job.job).display().to_string();
    }
    let written = write(&args.target, &target, program.clone(), &job.machine)?;
    let assumed = args.job.on.assumed(&job.machine).into_iter().collect();
    let diagnostics = [job.diagnostics, target.warnings(), written.diagnostics, assumed].concat();
    let report = ExportReport {
        to: &args.target.to,
        machine: args.job.on.name(),
        file: written.names.first(),
        files: &written.names,
        bytes: written.bytes.len(),
        sha256: program::key(&written.bytes),
        holes: program.hole_count(),
        toolpaths: program.toolpath_count(),
        tools: program.bits.len(),
        diagnostics,
    };
    Ok(Answer::new(&report, report.text()).on(&args.job.on, &job.machine))
}

#[derive(Serialize)]
struct ExportReport<'a> {
    to: &'a str,
    machine: &'a str,
    file: Option<&'a String>,
    files: &'a [String],
    bytes: usize,
    sha256: String,
    holes: usize,
    toolpaths: usize,
    tools: usize,
    #[serde(serialize_with = "as_objects")]
    diagnostics: Vec<Diagnostic>,
}

impl ExportReport<'_> {
    fn text(&self) -> String {
        let files = self.files.join(", ");
        let words: [(&str, &dyn Display); 3] =
            [("holes", &self.holes), ("toolpaths", &self.toolpaths), ("file", &files)];
        sentence("post.report", &words) + "\n" + &diagnostic_lines(&self.diagnostics)
    }
}

/// A target controller.
pub(crate) enum Target {
    /// A built-in postprocessor.
    Shipped(String),
    /// A user's postprocessor.
    Own(Box<post::Dialect>),
}

impl Target {
    /// Looks up the built-in postprocessor, or reads the postprocessor file, `to`.
    pub(crate) fn named(to: &str) -> Result<Self, Refusal> {
        if post::targets().contains(&to) {
            return Ok(Self::Shipped(to.to_owned()));
        }
        let text = own(to, &post::targets())?;
        let faults = post::check(to, &text);
        if faults.len() > 1 {
            return Err(Refusal::content(faulty(to, &faults)));
        }
        post::Dialect::parse(to, &text).map(|dialect| Self::Own(Box::new(dialect))).map_err(Refusal::content)
    }

    /// Warnings about uncertain output of a user's postprocessor. Built-in ones have none.
    pub(crate) fn warnings(&self) -> Vec<Diagnostic> {
        match self {
            Self::Shipped(_) => Vec::new(),
            Self::Own(dialect) => post::warnings(dialect),
        }
    }

    /// The files of `program`. With a briefing and the index of the side, they are part of a job.
    pub(crate) fn files(
        &self,
        program: &Program,
        manner: &Manner,
        briefing: Option<(&Briefing, usize)>,
    ) -> Result<Vec<OutputFile>, Refusal> {
        let alone = Briefing::of(program);
        let (briefing, side) = briefing.unwrap_or((&alone, 0));
        let written = match self {
            Self::Shipped(name) => {
                post::write_for(name, program, manner, briefing, side).unwrap_or_else(|| Ok(Vec::new()))
            }
            Self::Own(dialect) => {
                post::write_side(&dialect.as_ref().clone().in_manner(manner), program, briefing, side)
            }
        };
        written.map_err(Refusal::content)
    }

    /// Differences between `files` and the `program` that they were written from, and other messages. A file
    /// with errors must not run.
    pub(crate) fn proved(&self, program: &Program, manner: &Manner, files: &[OutputFile]) -> Vec<Diagnostic> {
        let (dialect, own) = match self {
            Self::Shipped(name) => (post::dialect(name).and_then(Result::ok), false),
            Self::Own(dialect) => (Some(dialect.as_ref().clone()), true),
        };
        let dialect = dialect.map(|dialect| dialect.in_manner(manner));
        post::proved((dialect.as_ref(), own), program, files, &proof::differences)
    }
}

/// Error for a postprocessor file with `faults`: a single fault unchanged; otherwise the first and their
/// number.
pub(super) fn faulty(name: &str, faults: &[Diagnostic]) -> Diagnostic {
    let diagnostic = error!("post.faults", count = faults.len(), file = name, ..);
    match faults {
        [only] => only.clone(),
        [first, ..] => {
            Diagnostic { place: first.place.clone(), ..diagnostic.with("first", first.message("en")) }
        }
        [] => diagnostic,
    }
}

/// Reads the user's postprocessor file `name`. Refuses any other name, because it is not in `known`.
pub(super) fn own(name: &str, known: &[&str]) -> Result<String, Refusal> {
    let path = Path::new(name);
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) {
        return read(path);
    }
    let why = error!("post.unknown_target", name = name, ..).with("nearest", post::nearest_target(name));
    Err(Refusal::usage(why.with("known", known.join(", "))))
}

/// Reads a postprocessor or job file.
pub(super) fn read(path: &Path) -> Result<String, Refusal> {
    fs::read_to_string(path).map_err(|error| job::unreadable(path, &error))
}

/// Writes `program` for `target`, into a folder or as one named file. The file's name then becomes the
/// program's name.
pub(crate) fn write(
    args: &TargetArgs,
    target: &Target,
    mut program: Program,
    machine: &Machine,
) -> Result<Written, Refusal> {
    let folder = args.output.is_dir();
    if !folder && let Some(stem) = args.output.file_stem() {
        program.name = stem.to_string_lossy().into_owned();
    }
    // One file is named, so it contains everything.
    let files = (!folder).then_some(FileSplit::Job);
    let manner = Manner { lines_only_mm: args.lines_only_mm, files, ..Manner::on(machine) };
    let files = target.files(&program, &manner, None)?;
    if !folder && files.len() > 1 {
        let diagnostic = error!("post.several_files", count = files.len(), ..);
        return Err(Refusal::usage(diagnostic.with("file", args.output.display())));
    }
    let diagnostics = target.proved(&program, &manner, &files);
    if let Some(error) = diagnostics.iter().find(|diagnostic| diagnostic.severity == Severity::Error) {
        return Err(Refusal { diagnostics: diagnostics.clone(), ..Refusal::content(error.clone()) });
    }
    let mut written = Written { names: Vec::new(), diagnostics, bytes: Vec::new() };
    for file in files {
        let path = if folder { args.output.join(&file.name) } else { args.output.clone() };
        job::write_output(&path, file.text.as_bytes())?;
        written.names.push(path.display().to_string());
        written.bytes.extend(file.text.into_bytes());
    }
    Ok(written)
}
