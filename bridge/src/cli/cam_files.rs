//! The files of a planned job: its programs, numbered in the order of running, and the run sheet beside them.
//!
//! Comes in: the programs of all sides, the briefing of the job. Goes out: files in a folder, whole or not at all, and an object
//! about each. Does not know how a job is planned.

use super::export::Target;
use super::{Refusal, rounded, tool_object};
use crate::cli::job;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::{Briefing, Program, ToolBriefing};
use annulus_core::locale;
use annulus_core::post::{self, Manner, OutputFile};
use annulus_core::wire::program;
use serde_json::{Value, json};
use std::path::Path;

/// The name of the run sheet.
const RUN_SHEET: &str = "run-sheet.html";

/// A file to be written: what post made, or a program in Annulus' own form.
struct Output {
    name: String,
    bytes: Vec<u8>,
    bits: Vec<u32>,
}

/// What was written.
#[derive(Default)]
pub(super) struct Written {
    /// An object about each file, side by side.
    pub(super) files: Vec<Vec<Value>>,
    /// Where the run sheet is, if one was written.
    pub(super) run_sheet: Option<String>,
    /// What the proof of the files says.
    pub(super) diagnostics: Vec<Diagnostic>,
    /// Why nothing was written: the files would not do what their programs do.
    pub(super) why: Option<Diagnostic>,
}

/// Writes the files of all sides into `folder`, once all of them could be made and do what their programs do, but for what is
/// in `accept`. `programs` are the sides of the `briefing`;
/// without a target they are written in Annulus' own form, without a run sheet. Single files are called `stem` and the side.
pub(super) fn write(
    target: Option<&Target>,
    manner: &Manner,
    (folder, stem): (&Path, &str),
    programs: &[&Program],
    (briefing, accept): (&Briefing, &[String]),
) -> Result<Written, Refusal> {
    let mut written = Written::default();
    let mut made = Vec::new();
    let mut posted = Vec::new();
    for (index, (program, side)) in programs.iter().zip(&briefing.sides).enumerate() {
        let name = format!("{stem}-{}", side.side);
        let Some(target) = target else {
            let bits = (0..).zip(&program.bits).map(|(bit, _)| bit).collect();
            made.push(vec![Output {
                name: format!("{name}.program"),
                bytes: program::encode(program),
                bits,
            }]);
            continue;
        };
        let program = Program { name, ..(*program).clone() };
        let files = target.files(&program, manner, Some((briefing, index)))?;
        written.diagnostics.extend(target.proved(&program, manner, &files));
        made.push(files.iter().map(output).collect());
        posted.push(files);
    }
    written.why = written.diagnostics.iter().find(|diagnostic| diagnostic.is_unacknowledged(accept)).cloned();
    if written.why.is_some() {
        return Ok(written);
    }
    std::fs::create_dir_all(folder).map_err(|error| {
        let why = Diagnostic::error("job.not_written").with("file", folder.display());
        Refusal::surroundings(why.with("reason", error))
    })?;
    for (index, files) in made.into_iter().enumerate() {
        let tools = briefing.sides.get(index).map_or(&[][..], |side| &side.tools);
        let objects = files.into_iter().map(|file| {
            let path = folder.join(&file.name);
            job::write_output(&path, &file.bytes)?;
            let side = briefing.sides.get(index).map(|side| side.side.as_str());
            Ok(object(&path, &file, side, tools))
        });
        written.files.push(objects.collect::<Result<Vec<_>, Refusal>>()?);
    }
    if target.is_some() {
        let path = folder.join(RUN_SHEET);
        let sheet = post::run_sheet(locale::FALLBACK, briefing, &posted).html();
        job::write_output(&path, sheet.as_bytes())?;
        written.run_sheet = Some(path.display().to_string());
    }
    Ok(written)
}

fn output(file: &OutputFile) -> Output {
    Output { name: file.name.clone(), bytes: file.text.clone().into_bytes(), bits: file.bits.clone() }
}

/// A file for scripts. Where it has several tools, they are all in `tools` and none is `tool`.
fn object(path: &Path, file: &Output, side: Option<&str>, tools: &[ToolBriefing]) -> Value {
    let own: Vec<&ToolBriefing> = file.bits.iter().filter_map(|bit| tools.get(*bit as usize)).collect();
    let mut operations: Vec<&str> = Vec::new();
    for word in own.iter().flat_map(|tool| &tool.operations) {
        if !operations.contains(&word.as_str()) {
            operations.push(word);
        }
    }
    let objects: Vec<Value> = own.iter().map(|tool| tool_object(&tool.tool)).collect();
    let time: Option<f64> = own.iter().map(|tool| tool.time_s).sum();
    json!({
        "file": path.display().to_string(),
        "side": side,
        "operation": operations.join("+"),
        "tool": match objects.as_slice() { [only] => only.clone(), _ => Value::Null },
        "time_s": time.map(rounded),
        "tools": objects,
        "bytes": file.bytes.len(),
        "sha256": program::key(&file.bytes),
    })
}
