//! What a person does at the board itself: a door that is opened, a button that holds, a tool that the board wants to be given by hand.
//! Nothing is answered meanwhile, and it goes on when it is told to. While a job is on its path, that is the business of `look`.
//!
//! ```text
//!  reports   Jog  Door:0  Door:0 ─ told, may be resumed ─ Idle
//! ```
//!
//! Comes in: reports. Goes out: a sentence, and the sign that leads on. Does not know what it was that is held.

use super::asks::{EnginePhase, signs};
use super::engine::Controller;
use super::heard::ReportedState;
use crate::diagnostic::Diagnostic;

/// Reports of it before it is believed: what comes to rest by our own sign may say so once.
const REPORTS: u32 = 2;

impl Controller {
    /// Whether something at the board itself holds what is in work, or keeps anything from being begun: it waits for Resume.
    pub fn stands(&self) -> bool {
        self.stand_reports >= REPORTS && self.may_stand()
    }

    /// Whether it is none of ours that it stands: no job is on its path, and nothing was told to come to rest.
    fn may_stand(&self) -> bool {
        use EnginePhase::{Changing, Jogging, Measuring, Probing, Ready, Surveying, ToolChange};
        match self.phase {
            Jogging => !self.jog_is_to_end(),
            phase => matches!(phase, Ready | Probing | Surveying | Measuring | Changing | ToolChange),
        }
    }

    /// A report.
    pub(super) fn stand_reported(&mut self, doing: ReportedState, fresh: bool) {
        let code = match doing {
            ReportedState::Door { .. } => "grbl.door",
            ReportedState::Hold { .. } => "grbl.held_there",
            ReportedState::Tool => "grbl.tool_there",
            _ => {
                self.stand_reports = 0;
                return;
            }
        };
        if fresh {
            self.stand_reports = self.stand_reports.saturating_add(1);
            if self.stand_reports == REPORTS && self.may_stand() {
                self.found(Diagnostic::warning(code));
            }
        }
    }

    /// It goes on.
    pub(super) fn resume_there(&mut self) {
        (self.stand_reports, self.rests_overdue, self.moved_ms) = (0, 0, self.now_ms);
        self.write(signs::RESUME);
    }
}
