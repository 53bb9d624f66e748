//! Ends a held job if no terminal is there to resume it. Switches the spindle off and prints the command that
//! resumes the job.

use super::operator::Operator;
use annulus_core::code;
use annulus_core::control::Trust;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::grbl::{EngineAsk, EnginePhase};

impl Operator {
    /// Stops the job, or the motion before it, if it is held and there is no terminal.
    pub(super) fn ends_held(&mut self) {
        use EnginePhase::{Changing, Held, Jogging, Measuring, Probing, Surveying, ToolChange};
        let moves = |phase| matches!(phase, Jogging | Probing | Measuring | Changing | Surveying);
        let phase = self.phase();
        // During a tool change, `resume` can still come through a pipe.
        let is_heard = phase == Some(ToolChange) && self.how.confirm_tools.is_none();
        let stands = self.stands() && !is_heard && (self.begun || phase.is_some_and(moves));
        let is_held = phase == Some(Held) || stands;
        if self.keys.is_none() && self.held.is_over(is_held) {
            self.station.ask(EngineAsk::Stop);
        }
    }

    /// Reports how the ended job was left. Hold and spindle are confirmed only if the job ended with the
    /// position still known.
    pub(super) fn tells_how_it_is_left(&mut self) {
        if !self.held.has_ended() {
            return;
        }
        let is_known = self.now.as_ref().is_some_and(|now| now.trust == Trust::Trusted);
        let code = if is_known && !self.gone && self.ended.is_some() {
            code!("grbl.held_unattended")
        } else {
            code!("grbl.held_unconfirmed")
        };
        let why = Diagnostic::error(code).with("line", self.resume_line());
        self.tells(vec![why.clone()]);
        self.worst = Some(why);
    }

    pub(super) fn resume_line(&self) -> String {
        let port = self.how.port.port.as_deref().unwrap_or("PORT");
        format!("annulus grbl resume --port {port}")
    }
}
