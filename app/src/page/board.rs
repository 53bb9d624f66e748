//! The open board as signals.
//!
//! Goes out: signals to be read. Does not know how they are shown.

use super::signals as all;
use super::slots::Slots;
use crate::engine::messages::{PlanReady, Proved, Timed};
use crate::keys::Tab;
use crate::model::board::{left_out, problems, unread};
use crate::model::{BoardBefore, Document, Job, LaidBoard, NewExports, Offer, Unseen, WorkerTask};
use crate::picture;
use crate::toolpaths::Toolpaths;
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::job::Program;
use annulus_core::machine::Machine;
use annulus_core::units::Length;
use leptos::prelude::*;
use std::collections::BTreeSet;
use std::sync::Arc;

/// The open board and all that follows from it.
#[derive(Clone, Copy)]
pub struct OpenBoard {
    /// The board.
    pub document: ReadSignal<Option<Arc<Document>>>,
    /// What was open before the review, to go back to.
    pub before: ReadSignal<Option<Arc<BoardBefore>>>,
    /// Its import review is on show.
    pub reviewing: ReadSignal<bool>,
    /// Errors that were seen, by code.
    pub accepted: ReadSignal<BTreeSet<String>>,
    /// The bit in the spindle, if it is to go first.
    pub loaded: ReadSignal<Option<Length>>,
    /// The plan.
    pub plan: ReadSignal<Option<Arc<PlanReady>>>,
    /// The plan in time.
    pub timed: ReadSignal<Option<Arc<Timed>>>,
    /// The board as it lies for the plan.
    pub laid: ReadSignal<Option<Arc<LaidBoard>>>,
    /// What the plan does.
    pub program: ReadSignal<Option<Arc<Program>>>,
    /// What the proof says of the plan.
    pub proved: ReadSignal<Option<Arc<Proved>>>,
    /// The planned job.
    pub job: ReadSignal<Option<Arc<Job>>>,
    /// Why there is no plan.
    pub refused: ReadSignal<Vec<Diagnostic>>,
    /// The plan on show is that of an older job.
    pub stale: ReadSignal<bool>,
    /// What files and plan have to say that is more than a note, the first hundred.
    pub problems: Memo<Vec<Diagnostic>>,
    /// Errors of the plan on show: what of the board it leaves out.
    pub left_out: Memo<Vec<Diagnostic>>,
    /// The paths of the planned program.
    pub toolpaths: Memo<Option<Arc<Toolpaths>>>,
    /// What the page is called; none where neither a board nor a job has a name.
    pub title: ReadSignal<Option<String>>,
    /// The machine that is planned for.
    pub machine: ReadSignal<Arc<Machine>>,
    /// Long work in the worker.
    pub task: ReadSignal<Option<WorkerTask>>,
    /// What there is to restore, the latest first.
    pub offers: ReadSignal<Vec<Offer>>,
    /// So many bytes the browser uses for the page; none where it does not tell.
    pub kept_bytes: ReadSignal<Option<u64>>,
    /// Why the open project cannot be kept: the key of a sentence.
    pub unkept: ReadSignal<Option<&'static str>>,
    /// New exports of the board, as long as they are shown.
    pub anew: ReadSignal<Option<Arc<NewExports>>>,
}

/// The open board.
pub fn open_board() -> OpenBoard {
    all().board
}

pub(super) fn signals(slots: &mut Slots) -> OpenBoard {
    let document = slots.handle(|model| &model.board.document);
    let plan = slots.handle(|model| &model.board.plan);
    let (program, laid) =
        (slots.handle(|model| &model.board.program), slots.handle(|model| &model.board.laid));
    let refused = slots.part(|model| &model.board.refused);
    let problems = Memo::new(move |_| {
        document.with(|document| {
            plan.with(|plan| refused.with(|refused| problems(refused, plan.as_deref(), document.as_deref())))
        })
    });
    OpenBoard {
        document,
        before: slots.handle(|model| &model.before),
        reviewing: slots.part(|model| &model.board.reviewing),
        accepted: slots.part(|model| &model.board.accepted),
        loaded: slots.part(|model| &model.board.loaded),
        plan,
        timed: slots.handle(|model| &model.board.timed),
        laid,
        program,
        proved: slots.handle(|model| &model.board.proved),
        job: slots.handle(|model| &model.board.job),
        refused,
        stale: slots.part(|model| &model.board.stale),
        problems,
        left_out: Memo::new(move |_| plan.with(|plan| left_out(plan.as_deref()).cloned().collect())),
        toolpaths: Memo::new(move |_| {
            let program = program.get()?;
            let body = laid.with(|laid| laid.as_ref().and_then(|laid| laid.laid.body));
            Some(Arc::new(picture::program_in(&program, body)))
        }),
        title: slots.made(|model| model.title().map(str::to_owned)),
        machine: slots.kept(|model| &model.machine),
        task: slots.made(|model| model.task()),
        offers: slots.part(|model| &model.keeping.offers),
        kept_bytes: slots.part(|model| &model.keeping.bytes),
        unkept: slots.part(|model| &model.keeping.failed),
        anew: slots.handle(|model| &model.anew.shown),
    }
}

impl OpenBoard {
    /// What of the files a person has to see first.
    pub fn unseen(self) -> Option<Unseen> {
        let accepted = self.accepted.get();
        self.document.with(|document| document.as_ref()?.unseen(&accepted))
    }

    /// Errors of files or plan that nobody has seen yet; planning waits for that.
    pub fn waits_for_person(self) -> bool {
        let unseen = |diagnostic: &Diagnostic| {
            diagnostic.severity == Severity::Error
                && self.accepted.with(|accepted| !accepted.contains(&diagnostic.code))
        };
        self.problems.with(|problems| problems.iter().any(unseen))
    }

    /// How much waits for a person on a screen: errors of the files that nobody has seen, and what is wrong with the job.
    pub fn to_fix(self, tab: Tab) -> usize {
        let accepted = self.accepted.get();
        match tab {
            Tab::Board => self.document.with(|document| {
                document.as_ref().map_or(0, |document| document.unseen_errors(&accepted).count())
            }),
            Tab::Cam => {
                let unseen = |why: &&Diagnostic| !accepted.contains(&why.code);
                self.unread() + self.refused.with(|refused| refused.iter().filter(unseen).count())
            }
            _ => 0,
        }
    }

    /// How many findings nobody has read yet, and how many errors of the plan nobody has seen.
    pub fn unread(self) -> usize {
        let read = all().job.read;
        self.plan.with(|plan| {
            self.proved.with(|proved| {
                self.accepted.with(|accepted| {
                    read.with(|read| unread(plan.as_deref(), proved.as_deref(), accepted, read))
                })
            })
        })
    }

    /// Whether the plan on show may be exported or sent: it is that of the job, it is proved, every finding was read and every
    /// error seen.
    pub fn cleared(self) -> bool {
        self.proved.with(Option::is_some) && !self.stale.get() && self.unread() == 0
    }
}
