//! The written program next to the playback: maps the displayed second to a line, and a line to its second.
//!
//! ```text
//! list shown, plan timed ─▶ the worker writes ─▶ WrittenProgram: rows of files and lines ─┬─ second ─▶ row
//!                    another plan or postprocessor: written again                     └─ row ─▶ second
//! ```

use super::asked::{board_is_gone, files_first};
use super::{Effect, Model, export, play};
use crate::engine::Stopped;
use crate::engine::messages::{Answer, Request, Timed, ToExport};
use crate::keys::Tab;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::post::OutputFile;
use annulus_core::sim::ProgramLines;
use std::sync::Arc;

/// Offset into a selected line, s: at its exact start the line before is still the current one.
const INSIDE_S: f64 = 2e-6;

/// A written program: for each file a row with its name, then a row per line.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WrittenProgram {
    text: String,
    /// End of each row in the text.
    ends: Vec<u32>,
    /// First row of each file, which is its name.
    files: Vec<u32>,
    lines: ProgramLines,
}

impl WrittenProgram {
    pub fn of(files: &[OutputFile]) -> Self {
        let mut written = Self::default();
        let mut commands = Vec::new();
        for file in files {
            written.files.push(written.ends.len() as u32);
            let lines = std::iter::once(file.name.as_str()).chain(file.text.lines());
            for line in lines {
                written.text.push_str(line);
                written.ends.push(written.text.len() as u32);
            }
            commands.extend(file.commands.first());
            commands.extend(&file.commands);
            let last = commands.last().copied().unwrap_or_default();
            commands.resize(written.ends.len(), last);
        }
        written.lines = ProgramLines::new(commands);
        written
    }

    pub fn len(&self) -> usize {
        self.ends.len()
    }

    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// Line number in its file, from 1 (`None` for a name), and the row's text.
    pub fn row(&self, row: usize) -> Option<(Option<usize>, &str)> {
        let end = *self.ends.get(row)? as usize;
        let start =
            row.checked_sub(1).and_then(|before| self.ends.get(before)).map_or(0, |end| *end as usize);
        let file = self.files.partition_point(|first| *first as usize <= row).checked_sub(1)?;
        let number = row - *self.files.get(file)? as usize;
        Some(((number > 0).then_some(number), self.text.get(start..end)?))
    }

    pub fn are_together(&self, row: usize, other: usize) -> bool {
        self.lines.are_together(row, other)
    }
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Listing {
    /// The list is shown instead of the steps.
    pub shown: bool,
    pub written: Option<Arc<WrittenProgram>>,
    /// Why it could not be written.
    pub refused: Vec<Diagnostic>,
    /// The selected row and its second.
    pressed: Option<(usize, f64)>,
    /// Inputs of the last request: plan, postprocessor name and text, and whether arcs become lines.
    of: Option<(Arc<Timed>, String, Option<String>, bool)>,
    /// The awaited request, its contents, and whether the worker was sent the board again.
    number: Option<(u32, Box<ToExport>, bool)>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ListingEvent {
    Show {
        on: bool,
    },
    Press {
        row: usize,
    },
    /// Jump to a row relative to the current one.
    Walk {
        by: i64,
    },
}

impl Listing {
    pub(super) fn waits_for(&self, wanted: u32) -> bool {
        self.number.as_ref().is_some_and(|(number, ..)| *number == wanted)
    }

    pub fn is_on_the_way(&self) -> bool {
        self.number.is_some()
    }

    fn forget(&mut self) {
        (self.written, self.refused, self.pressed) = (None, Vec::new(), None);
    }
}

pub fn row_now(model: &Model) -> Option<usize> {
    let (lines, play) = (&model.lines, &model.play);
    let written = lines.written.as_ref().filter(|_| lines.shown)?;
    if let Some((row, _)) = lines.pressed.filter(|(_, at_s)| (*at_s - play.at_s).abs() < f64::EPSILON) {
        return Some(row);
    }
    written.lines.line_of(play.playback.as_ref()?.command_at(play.at_s)?)
}

pub(super) fn update(model: &mut Model, event: ListingEvent) -> Vec<Effect> {
    match event {
        ListingEvent::Show { on } => {
            model.lines.shown = on;
            // Opening the list again retries a request that was cancelled or refused.
            if !model.lines.is_on_the_way() && model.lines.written.is_none() {
                model.lines.of = None;
            }
        }
        ListingEvent::Press { row } => press(model, row),
        ListingEvent::Walk { by } => {
            let count = model.lines.written.as_ref().map_or(0, |written| written.len());
            let row = row_now(model).unwrap_or(0) as i64 + by;
            press(model, usize::try_from(row).unwrap_or(0).min(count.saturating_sub(1)));
        }
    }
    Vec::new()
}

fn press(model: &mut Model, row: usize) {
    let (Some(written), Some(playback)) = (&model.lines.written, &model.play.playback) else { return };
    if row < written.len() {
        let at_s = written.lines.start_s(row, playback) + INSIDE_S;
        play::hold(&mut model.play, at_s);
        model.lines.pressed = Some((row, model.play.at_s));
    }
}

/// Writes the program if the list is shown, and again if the plan or postprocessor changed.
pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
    let Some(timed) = model.board.timed.clone().filter(|_| !model.board.stale) else {
        model.lines.forget();
        model.lines.of = None;
        return Vec::new();
    };
    let wanted = model.lines.shown && model.frame.tab == Tab::Simulate && !model.lines.is_on_the_way();
    if !wanted || is_same(model, &timed) {
        return Vec::new();
    }
    model.lines.forget();
    let (target, text) = (model.template.target.clone(), model.template.own_text());
    model.lines.of = Some((timed, target, text, model.export.lines_only));
    let Some(wanted) = export::wanted(model) else { return Vec::new() };
    let number = model.next_request();
    let request = Request::Lines(wanted.clone());
    model.lines.number = Some((number, Box::new(wanted), false));
    vec![Effect::ask(number, request)]
}

fn is_same(model: &Model, timed: &Arc<Timed>) -> bool {
    model.lines.of.as_ref().is_some_and(|(of, target, text, lines_only)| {
        Arc::ptr_eq(of, timed)
            && *target == model.template.target
            && *text == model.template.own_text()
            && *lines_only == model.export.lines_only
    })
}

pub(super) fn answered(model: &mut Model, answer: Result<Answer, Stopped>) -> Vec<Effect> {
    let Some((_, wanted, reread)) = model.lines.number.take() else { return Vec::new() };
    if !reread && board_is_gone(&answer) {
        return written_anew(model, wanted);
    }
    match answer {
        Ok(Answer::Lines(files)) => model.lines.written = Some(Arc::new(WrittenProgram::of(&files))),
        Err(Stopped::Refused(why)) => model.lines.refused = why,
        _ => {}
    }
    Vec::new()
}

/// The worker lost the board: sends it the files first.
fn written_anew(model: &mut Model, wanted: Box<ToExport>) -> Vec<Effect> {
    let request = Request::Lines((*wanted).clone());
    let Some((number, effects)) = files_first(model, &wanted.plan, request) else { return Vec::new() };
    model.lines.number = Some((number, wanted, true));
    effects
}
