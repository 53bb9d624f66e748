//! The written program beside the playback: which of its lines is done at the second on show, which second a line leads to.
//!
//! ```text
//! shown, a plan in time ─▶ the worker writes ─▶ WrittenProgram: rows of files and lines ─┬─ second ─▶ row
//!                    another plan, another controller: written anew               └─ row ─▶ second
//! ```
//!
//! Comes in: wishes, answers of the worker, the second on show. Goes out: requests, the row in work. Does not know the words of
//! controllers.

use super::asked::{board_is_gone, files_first};
use super::{Effect, Model, export, play};
use crate::engine::Stopped;
use crate::engine::messages::{Answer, Request, Timed, ToExport};
use crate::keys::Tab;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::post::OutputFile;
use annulus_core::sim::ProgramLines;
use std::sync::Arc;

/// A press on a line shows this much of it, s: at its very beginning the line before is done.
const INSIDE_S: f64 = 2e-6;

/// A program as it is written: rows of lines, over those of each file a row with its name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WrittenProgram {
    text: String,
    /// Where each row ends in the text.
    ends: Vec<u32>,
    /// The first row of each file, which is its name.
    files: Vec<u32>,
    lines: ProgramLines,
}

impl WrittenProgram {
    /// Of `files`, in the order of running.
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

    /// How many rows there are.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// There is none.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// A row: its number in its file, from 1, where it is no name, and what it says.
    pub fn row(&self, row: usize) -> Option<(Option<usize>, &str)> {
        let end = *self.ends.get(row)? as usize;
        let start =
            row.checked_sub(1).and_then(|before| self.ends.get(before)).map_or(0, |end| *end as usize);
        let file = self.files.partition_point(|first| *first as usize <= row).checked_sub(1)?;
        let number = row - *self.files.get(file)? as usize;
        Some(((number > 0).then_some(number), self.text.get(start..end)?))
    }

    /// Whether two rows are done together.
    pub fn are_together(&self, row: usize, other: usize) -> bool {
        self.lines.are_together(row, other)
    }
}

/// The lines.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Listing {
    /// They are looked at, and not the steps.
    pub shown: bool,
    /// The program, once it is written.
    pub written: Option<Arc<WrittenProgram>>,
    /// Why it is not.
    pub refused: Vec<Diagnostic>,
    /// The row that was pressed, and the second it led to.
    pressed: Option<(usize, f64)>,
    /// What is being written or was written last: the plan in time, and in whose words.
    of: Option<(Arc<Timed>, String, Option<String>, bool)>,
    /// The request whose answer is waited for, what was asked, and whether the worker was given the board anew.
    number: Option<(u32, Box<ToExport>, bool)>,
}

/// What happens to them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ListingEvent {
    /// The lines are looked at, or the steps.
    Show {
        /// The lines.
        on: bool,
    },
    /// To the second of a row.
    Press {
        /// Which.
        row: usize,
    },
    /// To the row before or after the one in work.
    Walk {
        /// How many rows on.
        by: i64,
    },
}

impl Listing {
    /// Whether this request is waited for.
    pub(super) fn waits_for(&self, wanted: u32) -> bool {
        self.number.as_ref().is_some_and(|(number, ..)| *number == wanted)
    }

    /// It is being written.
    pub fn is_on_the_way(&self) -> bool {
        self.number.is_some()
    }

    fn forget(&mut self) {
        (self.written, self.refused, self.pressed) = (None, Vec::new(), None);
    }
}

/// The row that is done at the second on show.
pub fn row_now(model: &Model) -> Option<usize> {
    let (lines, play) = (&model.lines, &model.play);
    let written = lines.written.as_ref().filter(|_| lines.shown)?;
    if let Some((row, _)) = lines.pressed.filter(|(_, at_s)| (*at_s - play.at_s).abs() < f64::EPSILON) {
        return Some(row);
    }
    written.lines.line_of(play.playback.as_ref()?.command_at(play.at_s)?)
}

/// Takes one event in.
pub(super) fn update(model: &mut Model, event: ListingEvent) -> Vec<Effect> {
    match event {
        ListingEvent::Show { on } => {
            model.lines.shown = on;
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

/// The program is written where its lines are looked at, and anew where the plan or the controller is another.
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

/// The answer to what was on its way.
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

/// The worker does not know the board: it is given the files first.
fn written_anew(model: &mut Model, wanted: Box<ToExport>) -> Vec<Effect> {
    let request = Request::Lines((*wanted).clone());
    let Some((number, effects)) = files_first(model, &wanted.plan, request) else { return Vec::new() };
    model.lines.number = Some((number, wanted, true));
    effects
}
