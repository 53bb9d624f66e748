//! Compares the board that the virtual drill made with the program, after every run.
//!
//! ```text
//! record   │ … other jobs … │ this job, before it was interrupted │ this run
//!                           └ start of the job: in the journal
//! ```
//!
//! The hole at which a job resumed may exist already: by design at most one hole is drilled twice. That is
//! reported without an alarm; any other repeated hole raises one.
//!
//! Real machines keep no record.

use super::Owner;
use super::work::Work;
use annulus_core::control::{Event, Trust};
use annulus_core::error;
use annulus_core::machine::Output;
use annulus_core::virtual_drill::{VirtualHole, made_again, missing_legs, tally};
use annulus_core::wire::{DrilledReport, MissingReport};
use std::sync::{Arc, Mutex, PoisonError};

/// Longest list of missing legs to report: beyond that, half the board is missing and the job must be run
/// again.
const MOST_RUNS: usize = 200;

#[derive(Default)]
pub(crate) struct Log {
    pub(crate) holes: Vec<VirtualHole>,
    pub(crate) broken: u32,
}

/// The log, shared with the drilling thread.
pub(crate) type Board = Arc<Mutex<Log>>;

#[derive(Default)]
pub(crate) struct Judged {
    slipped_before: u64,
    /// Holes that this job drilled before it resumed.
    before: Vec<VirtualHole>,
    /// Holes that existed when the job resumed and were drilled again: numbers in order, from 1.
    pub(crate) twice: Vec<u32>,
    pub(crate) told: Option<DrilledReport>,
    pub(crate) missing: Option<MissingReport>,
}

impl Owner {
    fn slipped(&self) -> u64 {
        self.slips().iter().map(|slip| slip.lost).sum()
    }

    pub(crate) fn board_begins(&mut self, work: &Work, record_from: Option<u64>) {
        *self.hands.board.lock().unwrap_or_else(PoisonError::into_inner) = Log::default();
        let taken_up = record_from.filter(|_| work.first > 0 && self.machine.output == Output::Virtual);
        let before = taken_up.and_then(|from| {
            let text = self.outside.recorded(from)?;
            Some(text.lines().filter_map(drilled).collect())
        });
        let before = before.unwrap_or_default();
        self.judged = Judged { slipped_before: self.slipped(), before, ..Judged::default() };
    }

    pub(crate) fn board_ends(&mut self, work: &Work) {
        if self.machine.output != Output::Virtual {
            return;
        }
        let log = std::mem::take(&mut *self.hands.board.lock().unwrap_or_else(PoisonError::into_inner));
        let mm = |axis: usize| self.machine.axis(axis).scale.length(work.job.zero[axis]).mm();
        let (program, run, zero_mm) = (&work.job.program, work.first..work.leg, [mm(0), mm(1)]);
        let found = tally(program, &self.machine, run.clone(), zero_mm, &log.holes);
        let before = std::mem::take(&mut self.judged.before);
        let again = made_again(program, &self.machine, run.clone(), zero_mm, &before, &log.holes);
        self.judged.twice = again.by_design;
        let legs = runs(&missing_legs(program, &self.machine, run, zero_mm, &log.holes));
        let told = !legs.is_empty() && legs.len() <= MOST_RUNS;
        self.judged.missing = told.then(|| MissingReport { job: work.job.key.clone(), legs });
        let told = DrilledReport {
            missing: found.missing,
            doubled: found.doubled + again.besides,
            shifted: found.shifted,
            broken: log.broken,
            slipped_steps: self.slipped().saturating_sub(self.judged.slipped_before),
        };
        self.judged.told = Some(told);
        if told != DrilledReport::default() {
            let why = error!(
                "control.board_differs",
                missing = told.missing,
                doubled = told.doubled,
                shifted = told.shifted,
                broken = told.broken,
                slipped = told.slipped_steps
            );
            let left = if told.slipped_steps > 0 { Trust::Suspect } else { Trust::Trusted };
            self.pending.push_back(Event::BoardDiffers { alarm: why, left });
        }
    }
}

pub fn line(hole: &VirtualHole) -> String {
    let spindle = if hole.spindle == 0 { String::new() } else { format!(" Z{}", hole.spindle + 1) };
    let bit = hole.bit_mm.map_or(String::new(), |mm| format!(" D{mm:.4}"));
    format!("{:.4} {:.4} {:.4}{spindle}{bit}\n", hole.x_mm, hole.y_mm, hole.depth_mm)
}

pub(crate) fn drilled(line: &str) -> Option<VirtualHole> {
    let mut words = line.split(' ');
    let mut number = || words.next()?.parse::<f64>().ok();
    let (x_mm, y_mm, depth_mm) = (number()?, number()?, number()?);
    let (mut spindle, mut bit_mm) = (1_u8, None);
    for word in words {
        match word.split_at_checked(1)? {
            ("Z", number) => spindle = number.parse().ok()?,
            ("D", mm) => bit_mm = Some(mm.parse().ok()?),
            _ => return None,
        }
    }
    Some(VirtualHole { x_mm, y_mm, depth_mm, tick: 0, spindle: spindle.checked_sub(1)?, bit_mm })
}

/// Groups sorted numbers into half-open ranges.
fn runs(legs: &[usize]) -> Vec<(u32, u32)> {
    let mut runs: Vec<(u32, u32)> = Vec::new();
    for leg in legs.iter().filter_map(|leg| u32::try_from(*leg).ok()) {
        match runs.last_mut() {
            Some((_, end)) if *end == leg => *end = leg + 1,
            _ => runs.push((leg, leg + 1)),
        }
    }
    runs
}
