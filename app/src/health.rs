//! How well the connection is: when to try again, when values are old, whether STOP was heard.
//!
//! ```text
//! age of the last word   0 ───── 1 s ───── 3 s ─────▶
//!                        fresh    stale     lost
//! ```
//!
//! Comes in: times in ms of one clock. Goes out: verdicts. Knows no socket.

use annulus_core::control::State;

/// How old the last word of the bridge is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Freshness {
    /// Under a second.
    #[default]
    Fresh,
    /// Shown greyed.
    Stale,
    /// Three seconds and more: as good as no link.
    Lost,
}

/// The verdict on values `age_ms` old.
pub fn freshness(age_ms: f64) -> Freshness {
    match age_ms {
        age if age < 1000.0 => Freshness::Fresh,
        age if age < 3000.0 => Freshness::Stale,
        _ => Freshness::Lost,
    }
}

/// How long to wait before try number `attempt` (from 0): quick at first, never longer than eight seconds.
pub fn retry_ms(attempt: u32) -> u32 {
    250 << attempt.min(5)
}

/// How long STOP may go unanswered before the page shouts.
pub const STOP_PATIENCE_MS: f64 = 250.0;

/// Where a pressed STOP is on its way.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum StopWay {
    /// Not pressed, or done.
    #[default]
    Idle,
    /// There is no link: it goes out first when there is one again.
    Latched,
    /// Sent at this time, not answered yet.
    Sent(f64),
}

impl StopWay {
    /// Whether an answer stamped `stamp_ms` (of the ping sent right behind it) means that it was heard.
    pub fn heard_by_pong(self, stamp_ms: f64) -> bool {
        matches!(self, Self::Sent(at_ms) if stamp_ms >= at_ms)
    }

    /// Whether a status in `state` means that it was heard.
    pub fn heard_by(self, state: State) -> bool {
        matches!(self, Self::Sent(_))
            && !matches!(state, State::Running | State::Homing | State::Jogging | State::Pausing)
    }

    /// Whether to shout at `now_ms`.
    pub fn overdue(self, now_ms: f64) -> bool {
        match self {
            Self::Idle => false,
            Self::Latched => true,
            Self::Sent(at_ms) => now_ms - at_ms >= STOP_PATIENCE_MS,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waiting_grows_to_eight_seconds_and_no_further() {
        let waits: Vec<_> = (0..8).map(retry_ms).collect();
        assert_eq!(waits, [250, 500, 1000, 2000, 4000, 8000, 8000, 8000]);
    }

    #[test]
    fn old_values_are_stale_then_lost() {
        let rows = [
            (0.0, Freshness::Fresh),
            (999.0, Freshness::Fresh),
            (1000.0, Freshness::Stale),
            (3000.0, Freshness::Lost),
        ];
        for (age_ms, verdict) in rows {
            assert_eq!(freshness(age_ms), verdict);
        }
    }

    #[test]
    fn stop_is_heard_by_a_later_pong_or_by_standing_still_only() {
        let sent = StopWay::Sent(100.0);
        assert!(sent.heard_by_pong(100.0) && !sent.heard_by_pong(99.0));
        assert!(sent.heard_by(State::Stopping) && sent.heard_by(State::Ready));
        assert!(!sent.heard_by(State::Running) && !StopWay::Latched.heard_by(State::Ready));
        assert!(!sent.overdue(349.0) && sent.overdue(350.0));
        assert!(StopWay::Latched.overdue(0.0) && !StopWay::Idle.overdue(1e9));
    }
}
