//! The board as the virtual drill made it, against the program, at the end of every run (N20).
//!
//! Comes in: every hole and broken bit as it happens, and which legs were run. Goes out: what differs, for everybody, and an
//! alarm where something does. Real machines keep no such record. Does not know the journal.

use super::moves::Work;
use super::owner::Owner;
use annulus_core::control::{Event, Trust};
use annulus_core::machine::Output;
use annulus_core::remark::{Remark, Weight};
use annulus_core::twin::{Drilled, missing_legs, tally};
use annulus_core::wire::{DrilledTold, MissingTold};
use std::sync::{Arc, Mutex, PoisonError};

/// More runs of legs than this are not told: what is missing then is half the board, and the job is run anew.
const MOST_RUNS: usize = 200;

/// What happened to the board since the run began.
#[derive(Default)]
pub(super) struct Log {
    pub(super) holes: Vec<Drilled>,
    pub(super) broken: u32,
}

/// The same, shared with the thread that drills.
pub(super) type Board = Arc<Mutex<Log>>;

/// What is known of the last run.
#[derive(Default)]
pub(super) struct Judged {
    /// Steps that were lost before it began.
    slipped_before: u64,
    pub(super) told: Option<DrilledTold>,
    pub(super) missing: Option<MissingTold>,
}

impl Owner {
    fn slipped(&self) -> u64 {
        self.slips().iter().map(|slip| slip.lost).sum()
    }

    /// A run begins.
    pub(super) fn board_begins(&mut self) {
        *self.hands.board.lock().unwrap_or_else(PoisonError::into_inner) = Log::default();
        self.judged = Judged { slipped_before: self.slipped(), ..Judged::default() };
    }

    /// A run ended at rest.
    pub(super) fn board_ends(&mut self, work: &Work) {
        if self.machine.output != Output::Virtual {
            return;
        }
        let log = std::mem::take(&mut *self.hands.board.lock().unwrap_or_else(PoisonError::into_inner));
        let mm = |axis: usize| self.machine.axis(axis).scale.length(work.job.zero[axis]).mm();
        let (program, run, zero_mm) = (&work.job.program, work.first..work.leg, [mm(0), mm(1)]);
        let found = tally(program, &self.machine, run.clone(), zero_mm, &log.holes);
        let legs = runs(&missing_legs(program, &self.machine, run, zero_mm, &log.holes));
        let told = !legs.is_empty() && legs.len() <= MOST_RUNS;
        self.judged.missing = told.then(|| MissingTold { job: work.job.key.clone(), legs });
        let told = DrilledTold {
            missing: found.missing,
            doubled: found.doubled,
            shifted: found.shifted,
            broken: log.broken,
            slipped_steps: self.slipped().saturating_sub(self.judged.slipped_before),
        };
        self.judged.told = Some(told);
        if told != DrilledTold::default() {
            let why = Remark::new(Weight::Loss, "control.board_differs")
                .with("missing", told.missing)
                .with("doubled", told.doubled)
                .with("shifted", told.shifted)
                .with("broken", told.broken)
                .with("slipped", told.slipped_steps);
            let left = if told.slipped_steps > 0 { Trust::Suspect } else { Trust::Trusted };
            self.pending.push_back(Event::BoardDiffers(why, left));
        }
    }
}

/// Numbers in their order as runs: the first and the one behind the last.
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
