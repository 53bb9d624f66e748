//! How well the connection is: when to try again, when values are old, whether STOP was heard.
//!
//! ```text
//! age of the last word   0 ───── 1 s ───── 3 s ─────▶
//!                        fresh    stale     lost
//! ```
//!
//! Comes in: times in ms of one clock. Goes out: verdicts. Knows no socket.

use crate::said::key;
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

/// Why this page has no control any more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ousted {
    /// Another page took it.
    Taken,
    /// The bridge did not hear of this page for some seconds and took it away.
    Silent,
}

/// Why control was lost, if it was: this page had it (`before`), has it or not (`yours`), somebody has it (`taken`); it had
/// been given back on purpose (`released`).
pub fn ousted(before: bool, yours: bool, taken: bool, released: bool) -> Option<Ousted> {
    (before && !yours && !released).then_some(if taken { Ousted::Taken } else { Ousted::Silent })
}

/// What a page without control says of who has it: another page (`taken`), or none. Nothing where the page says already why it
/// lost control.
pub fn observer(ousted: Option<Ousted>, taken: bool) -> Option<&'static str> {
    let word = if taken { key!("page.control.observer") } else { key!("page.control.free") };
    ousted.is_none().then_some(word)
}

/// Whether this page holds on to control: it had it, and neither gave it back nor lost it to another page. Then it asks for
/// it again as soon as nobody has it: after a silence of its own, or when its own earlier connection has lapsed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Claim {
    /// It had control.
    pub had: bool,
}

impl Claim {
    /// The bridge says who has control, this page had it until now or not (`before`). Whether to ask for it.
    pub fn told(&mut self, before: bool, yours: bool, taken: bool) -> bool {
        if yours {
            self.had = true;
        } else if before && taken {
            self.had = false;
        }
        self.had && !yours && !taken
    }
}

/// Why the machine does not take a wish for motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blocked {
    /// No bridge.
    NoLink,
    /// What is known of the machine is old.
    Old,
    /// Another page has control, or nobody.
    NoControl,
    /// An alarm was not acknowledged.
    Alarm,
    /// It is doing something.
    Busy,
}

/// What keeps the machine from being initialised, if anything does.
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
            && !matches!(
                state,
                State::Running | State::Homing | State::Jogging | State::Parking | State::Pausing
            )
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
        assert!(!sent.heard_by(State::Parking), "it still moves");
        assert!(!sent.heard_by(State::Running) && !StopWay::Latched.heard_by(State::Ready));
        assert!(!sent.overdue(349.0) && sent.overdue(350.0));
        assert!(StopWay::Latched.overdue(0.0) && !StopWay::Idle.overdue(1e9));
    }

    #[test]
    fn whoever_loses_control_is_told_why() {
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
    fn who_has_control_is_said_once_and_as_it_is() {
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
    fn control_that_was_not_given_away_is_asked_for_again_once_nobody_has_it() {
        // what the bridge says, one after the other: (before, yours, taken) and whether to ask
        type Told = ((bool, bool, bool), bool);
        let rows: [&[Told]; 5] = [
            // silent for three seconds
            &[((false, true, true), false), ((true, false, false), true), ((false, true, true), false)],
            // the link broke; the bridge still holds the earlier connection for this page's
            &[((false, true, true), false), ((false, false, true), false), ((false, false, false), true)],
            // another page took it, and gave it back
            &[((false, true, true), false), ((true, false, true), false), ((false, false, false), false)],
            // never had it
            &[((false, false, true), false), ((false, false, false), false)],
            // has it
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
    fn what_blocks_is_told_the_nearest_first() {
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
