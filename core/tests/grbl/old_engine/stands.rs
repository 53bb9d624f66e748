//! Holds from the machine itself: an opened door, a hold button, a tool that the controller waits for. Lines
//! get no answer meanwhile, and Resume continues. During a job's motion `look` handles this.
//!
//! ```text
//!  reports   Jog  Door:0  Door:0 ─ reported, can be resumed ─ Idle
//! ```

use super::asks::{EnginePhase, signs};
use super::engine::Controller;
use super::heard::ReportedState;
use annulus_core::diagnostic::Diagnostic;

const REPORTS: u32 = 2;

impl Controller {
    /// True if the machine holds the current activity, or prevents a new one, and waits for Resume.
    pub fn stands(&self) -> bool {
        self.stand_reports >= REPORTS && self.may_stand()
    }

    /// True if a Hold or Door report must come from the machine: no job is moving and we requested no stop.
    fn may_stand(&self) -> bool {
        use EnginePhase::{Changing, Jogging, Measuring, Probing, Ready, Surveying, ToolChange};
        match self.phase {
            Jogging => !self.jog_is_to_end(),
            phase => matches!(phase, Ready | Probing | Surveying | Measuring | Changing | ToolChange),
        }
    }

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

    pub(super) fn resume_there(&mut self) {
        (self.stand_reports, self.rests_overdue, self.moved_ms) = (0, 0, self.now_ms);
        self.write(signs::RESUME);
    }
}
