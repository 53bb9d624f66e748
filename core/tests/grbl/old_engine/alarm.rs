//! Alarms, and whether the position is still valid after one. The serial line has no checksum: one flipped
//! bit turns `ALARM:1` (position lost) into `ALARM:5`, and 3 or 6 into `ALARM:2`.
//!
//! ```text
//!  4  probe already closed     position stays while a probing line is in work: the oldest without an answer
//!  5  probe met nothing        same, and the line must be one that has to meet something (G38.2)
//!  2  soft limit               same for a line that moves, if soft limits are on ($20)
//!  all others                  position lost
//!
//!  4, 5 ─▶ doubted ─┬─ `$X` is accepted ───────────────────────────────────────────────▶ position stays
//!                   └─ behaves as after a limit switch: [MSG:Reset to continue], `$X`
//!                      without answer or refused, restart before the next report ───────▶ position lost
//! ```

use super::asks::{EngineAction, EnginePhase};
use super::engine::Controller;
use super::heard::ReportedState;
use super::settings;
use annulus_core::control::Ending;
use annulus_core::diagnostic::Diagnostic;

/// Message of a controller that accepts nothing before a reset: after a limit switch or a soft limit.
pub(super) const RESET_WANTED: &str = "Reset to continue";
const SOFT_LIMIT: u16 = 2;
const PROBE_CLOSED: u16 = 4;
const PROBE_MISSED: u16 = 5;
const SOFT_LIMITS: u16 = 20;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum ProbeAlarm {
    #[default]
    None,
    Silent,
    Reports,
}

impl Controller {
    /// True if the alarm leaves the position valid: the line in work can end with this alarm. After a reset
    /// no line is in work.
    fn keeps_place(&self, number: u16) -> bool {
        let Some(line) = self.buffer.waiting().next().map(|sent| sent.text.as_str()) else { return false };
        match number {
            SOFT_LIMIT => settings::on(&self.info.values, SOFT_LIMITS) && moves(line),
            PROBE_CLOSED => line.contains("G38."),
            PROBE_MISSED => line.contains("G38.2"),
            _ => false,
        }
    }

    pub(super) fn alarmed(&mut self, number: u16) {
        let why = Diagnostic::error(&settings::alarm_code(number)).with("number", number);
        let why = self.setter_alarm(number).unwrap_or(why);
        let read = self.checked_line();
        let read = read.map_or_else(|| why.clone(), |(name, line)| why.clone().at(&name, line, 1));
        self.check_is_over(Some(read));
        self.found(why);
        let keeps = self.keeps_place(number);
        if !keeps {
            self.lose_place();
        }
        // After limit switch and soft limit alarms (1 to 3) GRBL waits for a reset.
        self.needs_reset |= number <= 3;
        self.survey_is_over(None);
        self.drop_lines();
        if self.run.take().is_some() {
            self.out.push(EngineAction::Ended(Ending::Alarm));
        }
        (self.reset_at, self.after_reset) = (None, None);
        self.set(EnginePhase::Locked);
        self.probe_alarm = if keeps && number != SOFT_LIMIT { ProbeAlarm::Silent } else { ProbeAlarm::None };
    }

    /// The controller is locked and the line with the reason was lost, or it sleeps with its motors off until
    /// it restarts.
    pub(super) fn alarmed_unheard(&mut self, doing: ReportedState) {
        let why = match doing {
            ReportedState::Sleep => Diagnostic::error("grbl.asleep"),
            _ => Diagnostic::error("grbl.alarm_other").with("number", "?"),
        };
        self.lose_place();
        self.found(why.clone());
        (self.needs_reset, self.after_reset) = (true, None);
        self.survey_is_over(None);
        self.check_is_over(Some(why));
        self.drop_lines();
        if self.run.take().is_some() {
            self.out.push(EngineAction::Ended(Ending::Alarm));
        }
        self.set(EnginePhase::Locked);
    }

    pub(super) fn alarm_reported(&mut self, doing: ReportedState, fresh: bool) {
        if fresh && doing == ReportedState::Alarm && self.probe_alarm == ProbeAlarm::Silent {
            self.probe_alarm = ProbeAlarm::Reports;
        }
    }

    pub(super) fn reset_is_wanted(&mut self) {
        match self.phase {
            EnginePhase::Closed | EnginePhase::Greeting => {}
            EnginePhase::Locked => {
                self.unlock_failed();
                self.needs_reset = true;
            }
            _ => self.alarmed_unheard(ReportedState::Alarm),
        }
    }

    pub(super) fn unlock_failed(&mut self) {
        if std::mem::take(&mut self.probe_alarm) != ProbeAlarm::None {
            self.lose_place();
        }
    }

    /// The controller restarts. If it has not even sent a report since the alarm, this was not a probe alarm.
    pub(super) fn alarm_is_over(&mut self) {
        if std::mem::take(&mut self.probe_alarm) == ProbeAlarm::Silent {
            self.lose_place();
        }
    }
}

/// True if one of our lines moves an axis and is subject to soft limit alarms. Jogs are refused there
/// instead.
fn moves(line: &str) -> bool {
    !line.starts_with('$') && !line.contains("G10") && line.contains(['X', 'Y', 'Z'])
}
