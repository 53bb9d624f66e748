//! Writes the job as G-code files or a run sheet, and saves the project.
//!
//! ```text
//! Write ─▶ in progress ─▶ files saved │ run sheet shown │ problems to be read first │ refused
//! ```
//!
//! The outcome disappears when the job changes, and with the panel.

use super::asked::{Basis, WorkerTask, board_is_gone, files_first};
use super::{Effect, Lane, Model};
use crate::engine::Stopped;
use crate::engine::messages::{Answer, Exported, Request, ToExport};
use crate::said::key;
use annulus_core::artwork;
use annulus_core::board::Face;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::post::RunSheet;
use annulus_core::project;
use annulus_core::project::saved::Project;

pub const RUN_SHEET: &str = "run-sheet.html";

/// Largest deviation of line segments from the arc that they replace, in mm.
pub const CHORD_ERROR_MM: f64 = 0.005;

#[derive(Clone, Debug, PartialEq)]
pub enum ExportOutcome {
    /// Names of the saved files, in running order.
    Saved { names: Vec<String> },
    /// Nothing was saved, because the user has not read all problems.
    Unread { sides: Vec<(Face, u32)> },
    /// The files could not be packed.
    Refused { why: Diagnostic },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    Files,
    RunSheet,
}

#[derive(Clone, Debug, PartialEq)]
enum OnTheWay {
    Writing { number: u32, purpose: Purpose, wanted: Box<ToExport>, reread: bool, share: f64 },
    Saving { number: u32 },
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Export {
    on_the_way: Option<OnTheWay>,
    /// The panel is shown.
    pub open: bool,
    pub lines_only: bool,
    pub outcome: Option<ExportOutcome>,
    pub refused: Vec<Diagnostic>,
    pub run_sheet: Option<RunSheet>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum ExportEvent {
    /// Show or close the panel.
    Panel {
        on: bool,
    },
    /// Replace arcs by lines or not.
    LinesOnly {
        on: bool,
    },
    Write {
        purpose: Purpose,
    },
    /// Save the project: files, import choices and job.
    SaveProject,
    SaveRunSheet,
    CloseRunSheet,
}

impl Export {
    pub(super) fn waits_for(&self, wanted: u32) -> bool {
        matches!(
            &self.on_the_way,
            Some(OnTheWay::Writing { number, .. } | OnTheWay::Saving { number }) if *number == wanted
        )
    }

    pub fn task(&self) -> Option<WorkerTask> {
        match &self.on_the_way {
            Some(OnTheWay::Writing { share, .. }) => {
                Some(WorkerTask { word: key!("page.task.writing"), share: *share })
            }
            _ => None,
        }
    }
}

/// The board's worker was terminated; saving the project uses another worker and continues.
pub(super) fn called_off(model: &mut Model) {
    let export = &mut model.export;
    export.on_the_way = export.on_the_way.take().filter(|one| matches!(one, OnTheWay::Saving { .. }));
}

/// Drops the outcome, because the job changed.
pub(super) fn forget(model: &mut Model) {
    model.export.outcome = None;
    model.export.refused = Vec::new();
}

pub(super) fn progress(model: &mut Model, wanted: u32, done_share: f64) {
    if let Some(OnTheWay::Writing { number, share, .. }) = &mut model.export.on_the_way
        && *number == wanted
    {
        *share = done_share;
    }
}

pub(super) fn update(model: &mut Model, event: ExportEvent) -> Vec<Effect> {
    match event {
        ExportEvent::Panel { on } => {
            model.export.open = on;
            forget(model);
        }
        ExportEvent::LinesOnly { on } => model.export.lines_only = on,
        ExportEvent::Write { purpose } => return write(model, purpose),
        ExportEvent::SaveProject => return save_project(model),
        ExportEvent::SaveRunSheet => {
            let sheet = model.export.run_sheet.as_ref();
            return sheet
                .map(|sheet| saved(RUN_SHEET, "text/html", sheet.html().into_bytes()))
                .into_iter()
                .collect();
        }
        ExportEvent::CloseRunSheet => model.export.run_sheet = None,
    }
    Vec::new()
}

fn saved(name: &str, kind: &'static str, bytes: Vec<u8>) -> Effect {
    Effect::Save { name: name.to_owned(), kind, bytes }
}

/// The current job with the selected output options; `None` without a board.
pub(super) fn wanted(model: &Model) -> Option<ToExport> {
    Some(ToExport {
        plan: Basis::of(model)?.to_plan(None),
        read: model.job.read.iter().cloned().collect(),
        target: model.template.target.clone(),
        text: model.template.own_text(),
        lines_only_mm: model.export.lines_only.then_some(CHORD_ERROR_MM),
    })
}

fn write(model: &mut Model, purpose: Purpose) -> Vec<Effect> {
    let Some(wanted) = wanted(model) else { return Vec::new() };
    let number = model.next_request();
    let request = Request::Export(wanted.clone());
    let wanted = Box::new(wanted);
    model.export.on_the_way = Some(OnTheWay::Writing { number, purpose, wanted, reread: false, share: 0.0 });
    vec![Effect::ask(number, request)]
}

/// The open board, its import choices and its job.
fn project(model: &Model) -> Option<Project> {
    let document = model.board.document.as_ref()?;
    let job = model.job.work.as_ref().map(|work| project::write(work));
    Some(Project { files: model.draw.files_of(document), said: document.said.clone(), job })
}

pub(super) fn save_project(model: &mut Model) -> Vec<Effect> {
    let Some(project) = project(model) else { return Vec::new() };
    let number = model.next_request();
    model.export.on_the_way = Some(OnTheWay::Saving { number });
    vec![Effect::Ask { lane: Lane::Beside, number, request: Box::new(Request::Save(project)) }]
}

fn board_name(model: &Model) -> String {
    let name = model.board.document.as_ref().map(|open| open.reading.board.name.clone());
    name.filter(|name| !name.is_empty()).unwrap_or_else(|| "board".to_owned())
}

pub(super) fn answered(model: &mut Model, answer: Result<Answer, Stopped>) -> Vec<Effect> {
    match (model.export.on_the_way.take(), answer) {
        (Some(OnTheWay::Writing { purpose, wanted, reread: false, .. }), answer)
            if board_is_gone(&answer) =>
        {
            written_anew(model, purpose, wanted)
        }
        (Some(_), Err(Stopped::Refused(why))) => {
            // A shortcut or a command may have asked without the panel, which shows why.
            (model.export.refused, model.export.open) = (why, true);
            Vec::new()
        }
        (Some(OnTheWay::Writing { purpose, .. }), Ok(Answer::Exported(exported))) => {
            model.export.refused = Vec::new();
            written(model, purpose, *exported)
        }
        (Some(OnTheWay::Saving { .. }), Ok(Answer::Saved(bytes))) => {
            model.export.refused = Vec::new();
            vec![saved(&format!("{}.annulus", board_name(model)), "application/zip", bytes)]
        }
        (Some(_), _) => {
            model.export.refused = Vec::new();
            Vec::new()
        }
        (None, _) => Vec::new(),
    }
}

/// The worker lost the board: sends it the files first.
fn written_anew(model: &mut Model, purpose: Purpose, wanted: Box<ToExport>) -> Vec<Effect> {
    let request = Request::Export((*wanted).clone());
    let Some((number, effects)) = files_first(model, &wanted.plan, request) else { return Vec::new() };
    model.export.on_the_way = Some(OnTheWay::Writing { number, purpose, wanted, reread: true, share: 0.0 });
    effects
}

fn written(model: &mut Model, purpose: Purpose, exported: Exported) -> Vec<Effect> {
    if !exported.unread.is_empty() {
        model.export.outcome = Some(ExportOutcome::Unread { sides: exported.unread });
        model.export.open = true;
        return Vec::new();
    }
    match purpose {
        Purpose::RunSheet => {
            model.export.run_sheet = Some(exported.sheet(&model.frame.language));
            // One dialog at a time; only the sheet is printed.
            (model.export.outcome, model.export.open) = (None, false);
            Vec::new()
        }
        Purpose::Files => {
            let (outcome, file) = packed(model, &exported);
            model.export.outcome = Some(outcome);
            file.into_iter().collect()
        }
    }
}

/// A single program as it is; several in a zip with the run sheet.
fn packed(model: &Model, exported: &Exported) -> (ExportOutcome, Option<Effect>) {
    let names: Vec<String> = exported.files().map(|file| file.name.clone()).collect();
    let mut files: Vec<_> =
        exported.files().map(|file| (file.name.clone(), file.text.clone().into_bytes())).collect();
    if files.len() == 1 {
        let file = files.pop().map(|(name, text)| saved(&name, "text/plain", text));
        return (ExportOutcome::Saved { names }, file);
    }
    let name = format!("{}-{}.zip", board_name(model), model.template.target);
    files.push((RUN_SHEET.to_owned(), exported.sheet(&model.frame.language).html().into_bytes()));
    match artwork::packed(&files) {
        Ok(bytes) => (ExportOutcome::Saved { names }, Some(saved(&name, "application/zip", bytes))),
        Err(why) => (ExportOutcome::Refused { why }, None),
    }
}
