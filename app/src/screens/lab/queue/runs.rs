//! Runs of the queue in this page's own virtual drill: step, to the breakpoint, to the end, stop, begin anew.
//!
//! ```text
//! order ─▶ Trial.go ─ eight pieces ─▶ breathe ─ eight pieces … ─▶ rest: held │ done │ refused
//! ```
//!
//! Comes in: orders. Goes out: results as signals. An edit of the queue ends its run.

use crate::i18n::{message, say};
use crate::lab::rehearsal::Trial;
use crate::page::open_board;
use annulus_core::queue::{Mode, Queue, Rest, RowResult};
use leptos::prelude::*;
use std::time::Duration;

/// The run of the page.
#[derive(Clone, Copy)]
pub(in crate::screens::lab) struct Runs {
    trial: StoredValue<Option<Trial>, LocalStorage>,
    /// Results, one a line.
    pub(super) results: RwSignal<Vec<RowResult>>,
    /// The line that comes next, while a run is held.
    pub(super) next: RwSignal<Option<usize>>,
    /// It runs now.
    pub(super) running: RwSignal<bool>,
    /// How it ended or why it rests, in words.
    pub(super) said: RwSignal<String>,
}

impl Runs {
    /// Nothing runs.
    pub(in crate::screens::lab) fn new() -> Self {
        Self {
            trial: StoredValue::new_local(None),
            results: RwSignal::new(Vec::new()),
            next: RwSignal::new(None),
            running: RwSignal::new(false),
            said: RwSignal::new(String::new()),
        }
    }

    /// Forgets the run.
    pub(in crate::screens::lab) fn clear(self) {
        self.trial.set_value(None);
        self.running.set(false);
        self.results.set(Vec::new());
        self.next.set(None);
        self.said.set(String::new());
    }

    /// Goes on as far as `mode` says; begins where nothing is held.
    pub(super) fn go(self, queue: &Queue, mode: Mode) {
        if self.running.get_untracked() {
            return;
        }
        let fresh = self.trial.with_value(|trial| trial.as_ref().is_none_or(Trial::ended));
        if fresh {
            let begun = open_board()
                .machine
                .with_untracked(|machine| Trial::begin(machine, queue.clone(), machine.card.names()));
            match begun {
                Ok(trial) => self.trial.set_value(Some(trial)),
                Err(why) => return self.said.set(message(&why)),
            }
        }
        self.running.set(true);
        self.said.set(say!("page.lab.queue.running"));
        self.some(mode);
    }

    /// Some pieces, and then the page breathes.
    fn some(self, mode: Mode) {
        if !self.running.try_get_untracked().unwrap_or_default() {
            return;
        }
        let rest =
            self.trial.try_update_value(|trial| trial.as_mut().and_then(|trial| trial.go(mode))).flatten();
        self.show();
        match rest {
            None => set_timeout(move || self.some(mode), Duration::ZERO),
            Some(rest) => {
                self.running.set(false);
                let holes = self.trial.with_value(|trial| trial.as_ref().map_or(0, Trial::holes));
                self.said.set(match rest {
                    Rest::Held => {
                        say!("page.lab.queue.held", row = self.next.get_untracked().map_or(0, |at| at + 1))
                    }
                    Rest::Done => say!("page.lab.queue.ended", holes = holes),
                    Rest::Stopped => say!("page.lab.queue.stopped_here"),
                    Rest::Failed(why, _) => message(&why),
                });
            }
        }
    }

    fn show(self) {
        self.trial.with_value(|trial| {
            if let Some(trial) = trial {
                self.results.set(trial.results().to_vec());
                self.next.set(if trial.ended() { None } else { trial.row() });
            }
        });
    }
}
