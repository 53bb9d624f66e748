//! Alarms, and what is believed of the place behind one. The line has no checksum: one bit that was changed on the way makes `ALARM:5`
//! of `ALARM:1`, where the place is lost, and `ALARM:2` of 3 and 6.
//!
//! ```text
//!  4  the probe was closed     the place stays while a probing line is in work: the oldest without an answer
//!  5  the probe met nothing    the same, and the line has to meet something (G38.2)
//!  2  a soft limit             the same of a line that moves, where soft limits are on ($20)
//!  all others                  the place is lost
//!
//!  4, 5 ─▶ doubted ─┬─ `$X` is taken ─────────────────────────────────────────────────────────────▶ the place stays
//!                   └─ as after a switch: [MSG:Reset to continue], `$X` without an answer or
//!                      refused, begun anew before a report came ──────────────────────────────────▶ the place is lost
//! ```
//!
//! Comes in: alarms, what follows them. Goes out: trust, the end of what was in work. Does not know what locked the board.

use super::asks::{EngineAction, EnginePhase};
use super::engine::Controller;
use super::heard::ReportedState;
use super::settings;
use crate::control::Ending;
use crate::diagnostic::Diagnostic;

/// What a board says that does nothing more before a reset: after a switch and after a soft limit.
pub(super) const RESET_WANTED: &str = "Reset to continue";
/// Alarms: a soft limit; a probe that was closed already; one that met nothing.
const SOFT_LIMIT: u16 = 2;
const PROBE_CLOSED: u16 = 4;
const PROBE_MISSED: u16 = 5;
/// `$20`: soft limits.
const SOFT_LIMITS: u16 = 20;

/// Whether an alarm of the probe that was believed may have been that of a switch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum ProbeAlarm {
    /// It is not doubted.
    #[default]
    None,
    /// It may, and the board has said nothing since.
    Silent,
    /// It may; the board reports, as most do not after a switch.
    Reports,
}

impl Controller {
    /// Whether an alarm leaves the place as it was: the line in work is one that can end so. A report of it that comes behind a reset
    /// has none.
    fn keeps_place(&self, number: u16) -> bool {
        let Some(line) = self.buffer.waiting().next().map(|sent| sent.text.as_str()) else { return false };
        match number {
            SOFT_LIMIT => settings::on(&self.info.values, SOFT_LIMITS) && moves(line),
            PROBE_CLOSED => line.contains("G38."),
            PROBE_MISSED => line.contains("G38.2"),
            _ => false,
        }
    }

    /// It locked itself, and said why.
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
        // It waits for a reset after the switches and the soft limit have spoken.
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

    /// It is locked, and the line that said why was lost on the way; or it sleeps, its motors let go of, until it begins anew.
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

    /// A report while it is locked.
    pub(super) fn alarm_reported(&mut self, doing: ReportedState, fresh: bool) {
        if fresh && doing == ReportedState::Alarm && self.probe_alarm == ProbeAlarm::Silent {
            self.probe_alarm = ProbeAlarm::Reports;
        }
    }

    /// It says that it waits for a reset: behind an alarm of the probe it would not.
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

    /// It cannot be unlocked as after an alarm of the probe: it was another one.
    pub(super) fn unlock_failed(&mut self) {
        if std::mem::take(&mut self.probe_alarm) != ProbeAlarm::None {
            self.lose_place();
        }
    }

    /// It begins anew. One that had not even reported since was no alarm of the probe.
    pub(super) fn alarm_is_over(&mut self) {
        if std::mem::take(&mut self.probe_alarm) == ProbeAlarm::Silent {
            self.lose_place();
        }
    }
}

/// Whether a line of ours moves an axis where soft limits are looked at: moves by hand are refused there.
fn moves(line: &str) -> bool {
    !line.starts_with('$') && !line.contains("G10") && line.contains(['X', 'Y', 'Z'])
}

#[cfg(test)]
mod tests {
    use super::moves;

    #[test]
    fn lines_that_move_are_told_from_those_that_do_not() {
        for (line, expected) in [
            ("G91G1X3F100", true),
            ("G90G53G0Z-1", true),
            ("G91G38.2Z-10F60", true),
            ("G21G10L2P1X0Y0", false),
            ("$J=G91G21X1F100", false),
            ("$X", false),
            ("M3S9000", false),
            ("G4P0", false),
        ] {
            assert_eq!(moves(line), expected, "{line}");
        }
    }
}
