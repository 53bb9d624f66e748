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

use super::activity::{Activity, Work};
use super::context::{Context, Report};
use super::heard::ReportedState;
use super::line::{AfterReset, Meaning};
use super::settings;
use crate::control::Ending;
use crate::diagnostic::Diagnostic;
use crate::error;

/// Message of a controller that accepts nothing before a reset: after a limit switch or a soft limit.
pub(super) const RESET_WANTED: &str = "Reset to continue";
/// Alarm numbers: soft limit; probe closed before the move; probe met nothing.
const SOFT_LIMIT: u16 = 2;
const PROBE_CLOSED: u16 = 4;
const PROBE_MISSED: u16 = 5;
/// `$20`: soft limits.
const SOFT_LIMITS: u16 = 20;

/// Whether a probe alarm that we believed may have been a limit switch alarm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum ProbeAlarm {
    /// No doubt.
    #[default]
    None,
    /// In doubt; the controller has sent nothing since.
    Silent,
    /// In doubt; the controller still sends reports, which most don't after a limit switch.
    Reports,
}

/// Locked after an alarm, or never homed.
#[derive(Debug, Default)]
pub(super) struct Locked {
    probe_alarm: ProbeAlarm,
}

impl Locked {
    pub(super) fn on_report(mut self, cx: &Context, report: Report) -> Activity {
        if report.fresh && report.doing == ReportedState::Alarm && self.probe_alarm == ProbeAlarm::Silent {
            self.probe_alarm = ProbeAlarm::Reports;
        }
        let is_unlocked = report.doing == ReportedState::Idle && cx.line.buffer.is_empty();
        if is_unlocked && !cx.line.needs_reset { Activity::Ready } else { Activity::Locked(self) }
    }

    pub(super) fn unlock(&self, cx: &mut Context) {
        if cx.line.needs_reset {
            cx.line.after_reset = Some(AfterReset::Unlock);
            return cx.reset();
        }
        cx.send("$X", Meaning::Unlock);
    }

    /// `$X` failed, so this was not a probe alarm: the position is lost.
    pub(super) fn on_unlock_failed(&mut self, cx: &mut Context) {
        if std::mem::take(&mut self.probe_alarm) != ProbeAlarm::None {
            cx.known.lose_place();
        }
    }

    /// The controller restarts. If it has not even sent a report since the alarm, this was not a probe alarm.
    pub(super) fn on_restart(&self, cx: &mut Context) {
        if self.probe_alarm == ProbeAlarm::Silent {
            cx.known.lose_place();
        }
    }
}

impl Context {
    /// True if the alarm leaves the position valid: the line in work can end with this alarm. After a reset
    /// no line is in work.
    fn keeps_place(&self, number: u16) -> bool {
        let Some(sent) = self.line.buffer.waiting().next() else { return false };
        match number {
            // GRBL brakes to standstill before it raises a soft limit alarm: no step is lost.
            SOFT_LIMIT => settings::on(&self.known.info.values, SOFT_LIMITS) && moves(&sent.text),
            PROBE_CLOSED => sent.text.contains("G38."),
            // G38.3 that meets nothing raises no alarm.
            PROBE_MISSED => sent.text.contains("G38.2"),
            _ => false,
        }
    }
}

impl Activity {
    /// The controller locked itself and sent the reason.
    pub(super) fn on_alarm(self, cx: &mut Context, number: u16) -> Self {
        let why = Diagnostic::error(&settings::alarm_code(number)).with("number", number);
        let why = match &self {
            Self::Measuring(measuring) => measuring.alarm(number).unwrap_or(why),
            _ => why,
        };
        let work = self.into_work();
        if let Work::Check(check) = &work {
            let read = check.line_in_work(cx);
            let why = why.clone();
            cx.out.push(check.over(Some(match read {
                Some((name, line)) => why.at(&name, line, 1),
                None => why,
            })));
        }
        cx.found(why);
        let keeps = cx.keeps_place(number);
        if !keeps {
            cx.known.lose_place();
        }
        // After limit switch and soft limit alarms (1 to 3) GRBL waits for a reset.
        cx.line.needs_reset |= number <= 3;
        cx.line.drop_lines();
        (cx.line.reset_at, cx.line.after_reset) = (None, None);
        work.end(cx, None, Ending::Alarm);
        let probe_alarm = if keeps && number != SOFT_LIMIT { ProbeAlarm::Silent } else { ProbeAlarm::None };
        Self::Locked(Locked { probe_alarm })
    }

    /// The controller is locked and the line with the reason was lost, or it sleeps with its motors off until
    /// it restarts.
    pub(super) fn on_silent_alarm(self, cx: &mut Context, doing: ReportedState) -> Self {
        let why = match doing {
            ReportedState::Sleep => error!("grbl.asleep"),
            _ => error!("grbl.alarm_other", number = "?"),
        };
        cx.known.lose_place();
        cx.found(why.clone());
        (cx.line.needs_reset, cx.line.after_reset) = (true, None);
        let work = self.into_work();
        if let Work::Check(check) = &work {
            cx.out.push(check.over(Some(why)));
        }
        cx.line.drop_lines();
        work.end(cx, None, Ending::Alarm);
        Self::Locked(Locked::default())
    }

    /// The controller waits for a reset. After a probe alarm it would not.
    pub(super) fn on_reset_wanted(self, cx: &mut Context) -> Self {
        match self {
            Self::Closed | Self::Identify(_) => self,
            Self::Locked(mut locked) => {
                locked.on_unlock_failed(cx);
                cx.line.needs_reset = true;
                Self::Locked(locked)
            }
            _ => self.on_silent_alarm(cx, ReportedState::Alarm),
        }
    }
}

/// True if one of our lines moves an axis and is subject to soft limit alarms. Jogs are refused there
/// instead.
fn moves(line: &str) -> bool {
    // G10 has axis words, but only stores a zero.
    !line.starts_with('$') && !line.contains("G10") && line.contains(['X', 'Y', 'Z'])
}

#[cfg(test)]
mod tests {
    use super::moves;

    #[test]
    fn moving_lines_are_distinct_from_others() {
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
