//! A port that was opened: whether the board may begin anew by that, as its owner chose it for his machine.
//!
//! ```text
//!  usual   it greets by itself, as most do ──────────────────────────▶ who are you? ($I $$ $# $G)
//!          it says nothing: ? ─ moves ─▶ held ─ rests ─▶ reset ─ greets ┘
//!  never   it says nothing: ? ─ moves, is held … ─▶ waited for ─ rests ─┘     nothing that is written resets or holds it
//! ```
//!
//! Either way its position is known to nobody before it is homed, or its zero set.
//!
//! Comes in: reports of a board that did not greet. Goes out: questions, a reset where that may be. Does not know DTR.

use super::asks::{EngineAction, EnginePhase, signs};
use super::engine::{Controller, Meaning};
use super::heard::ReportedState;
use crate::diagnostic::Diagnostic;
use serde::{Deserialize, Serialize};

/// Under this key the settings of a controller say what opening its port may do to the board: `usual` or `never`.
pub const RESET_KEY: &str = "controller.reset_on_open";

/// What opening the port may do to the board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ResetOnOpen {
    /// It may begin anew: by the line that most boards have for that, and at rest by a reset where it did not greet by itself.
    #[default]
    Usual,
    /// Nothing that is written then resets it.
    Never,
}

impl ResetOnOpen {
    /// Its word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Usual => "usual",
            Self::Never => "never",
        }
    }

    /// The one of this word.
    pub fn of(word: &str) -> Option<Self> {
        [Self::Usual, Self::Never].into_iter().find(|choice| choice.word() == word)
    }
}

impl Controller {
    /// The port was opened.
    pub(super) fn opened(&mut self, may: ResetOnOpen) {
        let now_ms = self.now_ms;
        *self = Self {
            now_ms,
            heard_ms: now_ms,
            since_ms: now_ms,
            phase: EnginePhase::Greeting,
            is_spared: may == ResetOnOpen::Never,
            ..Self::default()
        };
    }

    /// Whether the board is not to be disturbed: nobody knows yet who it is, nor what it is doing.
    pub(super) fn spares(&self) -> bool {
        self.is_spared && self.phase == EnginePhase::Greeting && self.info.banner.is_empty()
    }

    /// A board that did not greet says what it does.
    pub(super) fn strange(&mut self, doing: ReportedState) {
        use ReportedState::{Alarm, Door, Hold, Home, Idle, Jog, Run};
        match doing {
            Idle | Alarm if self.spares() => {
                if self.idle() {
                    self.asks_who();
                }
            }
            _ if self.spares() => self.waits_for_rest(doing),
            // It is brought to rest and made to greet.
            Run | Jog | Home | Hold { rests: false } | Door { rests: false } => self.write(signs::HOLD),
            _ => self.reset(),
        }
    }

    /// Asks the board for everything that it says of itself.
    pub(super) fn asks_who(&mut self) {
        for (index, text) in ["$I", "$$", "$#", "$G"].into_iter().enumerate() {
            self.send(text, Meaning::Greeting(index == 3));
        }
    }

    /// It does something that somebody else began, during which it says nothing of itself.
    fn waits_for_rest(&mut self, doing: ReportedState) {
        if std::mem::replace(&mut self.is_waited_for, true) {
            return;
        }
        let word = match doing {
            ReportedState::Hold { .. } => "Hold",
            ReportedState::Jog => "Jog",
            ReportedState::Door { .. } => "Door",
            ReportedState::Check => "Check",
            ReportedState::Home => "Home",
            ReportedState::Sleep => "Sleep",
            ReportedState::Tool => "Tool",
            ReportedState::Idle | ReportedState::Alarm | ReportedState::Run => "Run",
        };
        self.found(Diagnostic::warning("grbl.busy_at_opening").with("state", word));
    }

    /// Nobody answers any more.
    pub(super) fn silent(&mut self) {
        self.found(Diagnostic::error("grbl.no_answer"));
        // It may hear what it does not answer: what moves is held, where it is ours.
        if !self.spares() {
            self.write(signs::JOG_CANCEL);
            self.write(signs::HOLD);
        }
        self.out.push(EngineAction::Close);
        self.closed();
    }

    /// It has answered all of that. Where it began something meanwhile it refused to say its settings: it is asked again once it rests.
    pub(super) fn is_known(&self) -> bool {
        !self.info.values.is_empty() || !self.spares()
    }

    /// Who it is is known. Whether it is locked its next report says: none before counts.
    pub(super) fn is_met(&mut self) {
        if self.spares() {
            self.status = None;
        }
    }
}
