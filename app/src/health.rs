//! Health of the connection: when to retry, when values are old, whether STOP was received.
//!
//! ```text
//! age of the last message   0 ───── 1 s ───── 3 s ─────▶
//!                            fresh    stale     lost
//! ```

use crate::said::key;
use annulus_core::control::State;

/// Age class of the last message from the bridge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Freshness {
    #[default]
    Fresh,
    Stale,
    /// Three seconds or older: treated as no connection.
    Lost,
}

pub fn freshness(age_ms: f64) -> Freshness {
    match age_ms {
        age if age < 1000.0 => Freshness::Fresh,
        age if age < 3000.0 => Freshness::Stale,
        _ => Freshness::Lost,
    }
}

/// Delay before try number `attempt` (from 0): 250 ms, doubling up to 8 s.
pub fn retry_ms(attempt: u32) -> u32 {
    250 << attempt.min(5)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ousted {
    Taken,
    /// The bridge got nothing from this page for some seconds and withdrew control.
    Silent,
}

/// Why control was lost, if it was. `before`: this page had it; `yours`: has it now; `taken`: some page has
/// it; `released`: this page gave it back on purpose.
pub fn ousted(before: bool, yours: bool, taken: bool, released: bool) -> Option<Ousted> {
    (before && !yours && !released).then_some(if taken { Ousted::Taken } else { Ousted::Silent })
}

/// The message about who has control, for a page without it. None if the page already shows why it lost
/// control.
pub fn observer(ousted: Option<Ousted>, taken: bool) -> Option<&'static str> {
    let word = if taken { key!("page.control.observer") } else { key!("page.control.free") };
    ousted.is_none().then_some(word)
}

/// Whether this page keeps its claim to control: it had control, and neither released it nor lost it to
/// another page. Then it asks again as soon as control is free: after it was silent, or when its earlier
/// connection has expired.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Claim {
    pub had: bool,
}

impl Claim {
    /// Updates the claim from the bridge's report. Returns true if the page should ask for control. `before`:
    /// it had control until now.
    pub fn told(&mut self, before: bool, yours: bool, taken: bool) -> bool {
        if yours {
            self.had = true;
        } else if before && taken {
            self.had = false;
        }
        self.had && !yours && !taken
    }
}

/// Why the machine rejects a request to move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blocked {
    NoLink,
    /// The last status is too old.
    Old,
    NoControl,
    Alarm,
    Busy,
}

/// The reason why the machine can't be initialised, if any.
pub fn blocked(open: bool, freshness: Freshness, yours: bool, state: Option<State>) -> Option<Blocked> {
    match state {
        _ if !open => Some(Blocked::NoLink),
        _ if freshness != Freshness::Fresh => Some(Blocked::Old),
        _ if !yours => Some(Blocked::NoControl),
        Some(State::Ready | State::NotHomed) => None,
        Some(State::Alarm) => Some(Blocked::Alarm),
        None => Some(Blocked::Old),
        Some(_) => Some(Blocked::Busy),
    }
}

/// Time without an answer to STOP after which the page warns.
pub const STOP_PATIENCE_MS: f64 = 250.0;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum StopWay {
    /// Not pressed, or answered.
    #[default]
    Idle,
    /// No connection: sent first when there is one again.
    Latched,
    /// Sent at this time in ms, not answered yet.
    Sent(f64),
}

impl StopWay {
    /// True if the pong shows that STOP arrived. `stamp_ms` is the stamp of its ping; pings are sent right
    /// after STOP.
    pub fn heard_by_pong(self, stamp_ms: f64) -> bool {
        matches!(self, Self::Sent(at_ms) if stamp_ms >= at_ms)
    }

    pub fn heard_by(self, state: State) -> bool {
        matches!(self, Self::Sent(_))
            && !matches!(
                state,
                State::Running | State::Homing | State::Jogging | State::Parking | State::Pausing
            )
    }

    /// True if the page must warn at `now_ms`.
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
    fn retry_delay_doubles_up_to_eight_seconds() {
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
    fn later_pong_or_stopped_state_confirms_stop() {
        let sent = StopWay::Sent(100.0);
        assert!(sent.heard_by_pong(100.0) && !sent.heard_by_pong(99.0));
        assert!(sent.heard_by(State::Stopping) && sent.heard_by(State::Ready));
        assert!(!sent.heard_by(State::Parking), "it still moves");
        assert!(!sent.heard_by(State::Running) && !StopWay::Latched.heard_by(State::Ready));
        assert!(!sent.overdue(349.0) && sent.overdue(350.0));
        assert!(StopWay::Latched.overdue(0.0) && !StopWay::Idle.overdue(1e9));
    }

    #[test]
    fn loss_of_control_has_a_reason_unless_released() {
        let rows = [
            ((true, false, true, false), Some(Ousted::Taken)),
            ((true, false, false, false), Some(Ousted::Silent)),
            ((true, false, false, true), None),
            ((true, false, true, true), None),
            ((false, false, true, false), None),
            ((true, true, true, false), None),
        ];
        for ((before, yours, taken, released), expected) in rows {
            assert_eq!(ousted(before, yours, taken, released), expected);
        }
    }

    #[test]
    fn observer_message_is_not_repeated_after_loss() {
        let rows = [
            (None, true, Some("page.control.observer")),
            (None, false, Some("page.control.free")),
            (Some(Ousted::Silent), false, None),
            (Some(Ousted::Taken), true, None),
        ];
        for (ousted, taken, said) in rows {
            assert_eq!(observer(ousted, taken), said, "{ousted:?}, taken {taken}");
        }
    }

    #[test]
    fn lapsed_control_is_requested_once_free() {
        // Reports of the bridge in order: (before, yours, taken) and whether to ask.
        type Told = ((bool, bool, bool), bool);
        let rows: [&[Told]; 5] = [
            // Silent for three seconds.
            &[((false, true, true), false), ((true, false, false), true), ((false, true, true), false)],
            // The link broke; the bridge still counts this page's earlier connection.
            &[((false, true, true), false), ((false, false, true), false), ((false, false, false), true)],
            // Another page took it and gave it back.
            &[((false, true, true), false), ((true, false, true), false), ((false, false, false), false)],
            // Never had it.
            &[((false, false, true), false), ((false, false, false), false)],
            // Has it.
            &[((false, true, true), false), ((true, true, true), false)],
        ];
        for row in rows {
            let mut claim = Claim::default();
            for ((before, yours, taken), asks) in row {
                assert_eq!(claim.told(*before, *yours, *taken), *asks, "{row:?}");
            }
        }
    }

    #[test]
    fn nearest_obstacle_is_reported_first() {
        let rows = [
            (true, Freshness::Fresh, true, Some(State::NotHomed), None),
            (true, Freshness::Fresh, true, Some(State::Ready), None),
            (true, Freshness::Fresh, true, Some(State::Alarm), Some(Blocked::Alarm)),
            (true, Freshness::Fresh, true, Some(State::Running), Some(Blocked::Busy)),
            (true, Freshness::Fresh, false, Some(State::Alarm), Some(Blocked::NoControl)),
            (true, Freshness::Stale, false, Some(State::Ready), Some(Blocked::Old)),
            (true, Freshness::Fresh, true, None, Some(Blocked::Old)),
            (false, Freshness::Lost, false, None, Some(Blocked::NoLink)),
        ];
        for (open, fresh, yours, state, expected) in rows {
            assert_eq!(blocked(open, fresh, yours, state), expected, "{open} {fresh:?} {yours} {state:?}");
        }
    }
}
