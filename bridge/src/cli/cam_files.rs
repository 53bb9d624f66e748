//! Writes the files of a planned job: its programs, numbered in running order, and the run sheet.

use super::export::Target;
use super::{Refusal, ToolReport, rounded, sentence};
use crate::cli::job;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::job::{Briefing, Command, Mark, Program, SideBriefing, ToolBriefing};
use annulus_core::locale;
use annulus_core::post::{self, Manner, OutputFile};
use annulus_core::wire::program;
use serde::Serialize;
use std::borrow::Cow;
use std::fmt::Display;
use std::path::Path;

const RUN_SHEET: &str = "run-sheet.html";

/// An output file: from the postprocessor, or a program in Annulus' own format.
struct Output<'a> {
    name: Cow<'a, str>,
    bytes: Cow<'a, [u8]>,
    bits: Cow<'a, [u32]>,
}

/// A written file.
#[derive(Serialize)]
pub(super) struct FileReport {
    pub(super) file: String,
    side: Option<String>,
    operation: String,
    /// The tool, if it is the only one.
    tool: Option<ToolReport>,
    time_s: Option<f64>,
    /// The deepest cut, below the board's surface.
    depth_mm: f64,
    /// The feed, if all tools have the same: in XY, or of a drill downward.
    feed_mm_per_min: Option<f64>,
    tools: Vec<ToolReport>,
    bytes: usize,
    sha256: String,
}

impl FileReport {
    /// One row for the person at the machine: tool, time, depth and feed.
    pub(super) fn row(&self) -> String {
        let names: Vec<&str> = self.tools.iter().map(|tool| tool.name.as_str()).collect();
        let time = self.time_s.map_or_else(|| "–".to_owned(), minutes);
        let feed = self.feed_mm_per_min.map_or_else(|| "–".to_owned(), |feed| format!("{feed:.0}"));
        let words: [(&str, &dyn Display); 5] = [
            ("file", &self.file),
            ("tool", &names.join(", ")),
            ("time", &time),
            ("depth", &format!("{:.2}", self.depth_mm)),
            ("feed", &feed),
        ];
        sentence("cam.report.row", &words) + "\n"
    }
}

/// A duration, rounded to seconds.
fn minutes(seconds: f64) -> String {
    let seconds = seconds.round();
    let (whole, rest) = ((seconds / 60.0).floor(), seconds % 60.0);
    if whole > 0.0 { format!("{whole} min {rest} s") } else { format!("{rest} s") }
}

/// How deep and how fast one tool cuts.
#[derive(Clone, Copy, Default)]
struct ToolCut {
    depth_mm: f64,
    plunge_um_per_s: u32,
    /// 0 for a tool that only drills.
    mill_um_per_s: u32,
}

/// The cuts of each tool of `program`, in its order.
fn cuts(program: &Program) -> Vec<ToolCut> {
    let mut cuts = vec![ToolCut::default(); program.bits.len()];
    let mut bit = 0;
    for leg in &program.legs {
        if let Mark::ToolChange(next) = leg.mark {
            bit = next as usize;
        }
        let Some(cut) = cuts.get_mut(bit) else { continue };
        for command in &leg.commands {
            let height = match *command {
                Command::Plunge { to, feed_um_per_s, .. } => {
                    cut.plunge_um_per_s = cut.plunge_um_per_s.max(feed_um_per_s);
                    to
                }
                Command::Mill { height, feed_um_per_s, .. }
                | Command::MillArc { height, feed_um_per_s, .. } => {
                    cut.mill_um_per_s = cut.mill_um_per_s.max(feed_um_per_s);
                    height
                }
                _ => continue,
            };
            cut.depth_mm = cut.depth_mm.max(-height.mm());
        }
    }
    cuts
}

#[derive(Default)]
pub(super) struct Written {
    /// Grouped by side.
    pub(super) files: Vec<Vec<FileReport>>,
    /// Path of the run sheet, if written.
    pub(super) run_sheet: Option<String>,
    /// Messages from the proof of the files.
    pub(super) diagnostics: Vec<Diagnostic>,
    /// Why nothing was written: a file would differ from its program.
    pub(super) why: Option<Diagnostic>,
}

/// Writes the files of all sides into `folder`. All files must be made and match their programs first, except
/// for codes in `accept`. `programs` are the sides of `briefing`. Without a target, writes Annulus' own
/// format and no run sheet. Single files are named after `stem` and the side.
pub(super) fn write(
    target: Option<&Target>,
    manner: &Manner,
    (folder, stem): (&Path, &str),
    programs: Vec<&mut Program>,
    (briefing, accept): (&Briefing, &[String]),
) -> Result<Written, Refusal> {
    let mut written = Written::default();
    let mut made = Vec::new();
    let mut posted = Vec::new();
    let by_side: Vec<Vec<ToolCut>> = programs.iter().map(|program| cuts(program)).collect();
    for (index, (program, side)) in programs.into_iter().zip(&briefing.sides).enumerate() {
        let name = format!("{stem}-{}", side.side);
        let Some(target) = target else {
            made.push(vec![own_form(name, program)]);
            continue;
        };
        // Renamed only for its files: a copy would double the memory.
        let called = std::mem::replace(&mut program.name, name);
        let files = target.files(program, manner, Some((briefing, index)));
        let proved = files.map(|files| (target.proved(program, manner, &files), files));
        program.name = called;
        let (diagnostics, files) = proved?;
        written.diagnostics.extend(diagnostics);
        posted.push(files);
    }
    made.extend(posted.iter().map(|files| files.iter().map(output).collect()));
    written.why = written.diagnostics.iter().find(|diagnostic| diagnostic.is_unacknowledged(accept)).cloned();
    if written.why.is_some() {
        return Ok(written);
    }
    std::fs::create_dir_all(folder).map_err(|error| {
        let why = error!("job.not_written", file = folder.display(), ..);
        Refusal::surroundings(why.with("reason", error))
    })?;
    for (index, files) in made.into_iter().enumerate() {
        let reports = files.into_iter().map(|file| {
            let path = folder.join(&*file.name);
            job::write_output(&path, &file.bytes)?;
            let cuts = by_side.get(index).map(Vec::as_slice).unwrap_or_default();
            Ok(report(&path, &file, briefing.sides.get(index), cuts))
        });
        written.files.push(reports.collect::<Result<Vec<_>, Refusal>>()?);
    }
    if target.is_some() {
        let path = folder.join(RUN_SHEET);
        let sheet = post::run_sheet(locale::FALLBACK, briefing, &posted).html();
        job::write_output(&path, sheet.as_bytes())?;
        written.run_sheet = Some(path.display().to_string());
    }
    Ok(written)
}

fn output(file: &OutputFile) -> Output<'_> {
    Output {
        name: Cow::Borrowed(&file.name),
        bytes: Cow::Borrowed(file.text.as_bytes()),
        bits: Cow::Borrowed(&file.bits),
    }
}

fn own_form(name: String, program: &Program) -> Output<'static> {
    let bits = (0..).zip(&program.bits).map(|(bit, _)| bit).collect();
    Output { name: Cow::Owned(name + ".program"), bytes: Cow::Owned(program::encode(program)), bits }
}

fn report(path: &Path, file: &Output<'_>, side: Option<&SideBriefing>, cuts: &[ToolCut]) -> FileReport {
    let tools: &[ToolBriefing] = side.map_or(&[][..], |side| &side.tools);
    let own: Vec<&ToolBriefing> = file.bits.iter().filter_map(|bit| tools.get(*bit as usize)).collect();
    let mut operations: Vec<&str> = Vec::new();
    for word in own.iter().flat_map(|tool| &tool.operations) {
        if !operations.contains(&word.as_str()) {
            operations.push(word);
        }
    }
    let tools: Vec<ToolReport> = own.iter().map(|tool| ToolReport::of(&tool.tool)).collect();
    let cuts: Vec<&ToolCut> = file.bits.iter().filter_map(|bit| cuts.get(*bit as usize)).collect();
    let feed = |cut: &ToolCut| {
        let um_per_s = if cut.mill_um_per_s > 0 { cut.mill_um_per_s } else { cut.plunge_um_per_s };
        rounded(f64::from(um_per_s) * 60.0 / 1e3)
    };
    let same_feed = |first: f64| cuts.iter().all(|cut| feed(cut) == first);
    let time_s: Option<f64> = own.iter().map(|tool| tool.time_s).sum();
    FileReport {
        file: path.display().to_string(),
        side: side.map(|side| side.side.clone()),
        operation: operations.join("+"),
        tool: if let [only] = tools.as_slice() { Some(only.clone()) } else { None },
        time_s: time_s.map(rounded),
        depth_mm: rounded(cuts.iter().map(|cut| cut.depth_mm).fold(0.0, f64::max)),
        feed_mm_per_min: cuts.first().map(|cut| feed(cut)).filter(|first| same_feed(*first)),
        tools,
        bytes: file.bytes.len(),
        sha256: program::key(&file.bytes),
    }
}
