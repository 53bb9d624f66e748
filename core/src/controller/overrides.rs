//! Overrides: feed, rapids and spindle, slower or faster than the program says. Their real-time characters have no answer and go by
//! steps, and two of a kind that come close together are one to the controller. So they go one after the other, and what became of them
//! is read from its reports.
//!
//! ```text
//!  60 % wanted, 100 % reported ─▶ −10 ─ 30 ms ─ −10 ─ … ─▶ a report: 60 % ─▶ done
//!                                                          └─ another one ─▶ the steps that are left, four times at most
//! ```
//!
//! Comes in: wishes, reports, time. Goes out: characters. Percent, ms. Does not know who wishes.

use super::asks::{EnginePhase, Override};
use super::engine::Controller;
use crate::diagnostic::Diagnostic;
use std::collections::VecDeque;

/// Between two characters: the controller has seen to the one before by then.
const STEP_MS: u64 = 30;
/// How often steps are made up for that did not arrive.
const TRIES: u32 = 4;

/// What an override is of, in the order of reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OverrideOf {
    /// Feed, 10 to 200 %.
    Feed,
    /// Moves without cutting: 25, 50 or 100 %.
    Rapid,
    /// Spindle, 10 to 200 %.
    Spindle,
}

impl OverrideOf {
    const ALL: [Self; 3] = [Self::Feed, Self::Rapid, Self::Spindle];

    /// Whether it can be so many percent of the programmed one.
    fn allows(self, percent: u8) -> bool {
        match self {
            Self::Rapid => matches!(percent, 25 | 50 | 100),
            Self::Feed | Self::Spindle => (10..=200).contains(&percent),
        }
    }

    /// The code of why it cannot.
    fn refusal(self) -> &'static str {
        match self {
            Self::Feed => "control.bad_feed_override",
            Self::Rapid => "control.bad_rapid_override",
            Self::Spindle => "control.bad_spindle_override",
        }
    }

    /// The steps from so many percent to so many; from where nobody knows, over the programmed one.
    fn steps(self, from: Option<u16>, to: u16) -> VecDeque<Override> {
        use Override::{FeedDown, FeedDownOne, FeedFull, FeedUp, FeedUpOne};
        use Override::{SpindleDown, SpindleDownOne, SpindleFull, SpindleUp, SpindleUpOne};
        let [full, up, up_one, down, down_one] = match self {
            Self::Rapid => return [Override::rapid(to)].into(),
            Self::Feed => [FeedFull, FeedUp, FeedUpOne, FeedDown, FeedDownOne],
            Self::Spindle => [SpindleFull, SpindleUp, SpindleUpOne, SpindleDown, SpindleDownOne],
        };
        let anew = from.is_none() || to == 100;
        let from = from.filter(|_| !anew).unwrap_or(100);
        let (ten, one) = if to < from { (down, down_one) } else { (up, up_one) };
        let off = usize::from(to.abs_diff(from));
        let tens = std::iter::repeat_n(ten, off / 10);
        let first = anew.then_some(full);
        first.into_iter().chain(tens).chain(std::iter::repeat_n(one, off % 10)).collect()
    }
}

/// One that is on its way.
#[derive(Clone, Debug)]
struct Wish {
    percent: u16,
    /// Where it is once every character that was sent has arrived; none where nobody knows.
    reckoned: Option<u16>,
    left: VecDeque<Override>,
    sent_ms: u64,
    tries: u32,
}

/// Those that are on their way, in the order of reports.
#[derive(Clone, Debug, Default)]
pub(super) struct OverrideWishes([Option<Wish>; 3]);

impl Controller {
    /// So many percent of the programmed one are wanted.
    pub(super) fn ask_override(&mut self, of: OverrideOf, percent: u8) {
        if matches!(self.phase, EnginePhase::Closed | EnginePhase::Greeting) || self.reset_at.is_some() {
            return self.found(Diagnostic::error("grbl.not_now"));
        }
        if !of.allows(percent) {
            return self.found(Diagnostic::error(of.refusal()).with("percent", percent));
        }
        let (row, percent) = (of as usize, u16::from(percent));
        let reported = self.status.as_ref().and_then(|status| status.overrides).map(|all| all[row]);
        // Of one before, characters may be on their way that no report shows.
        let (from, sent_ms) =
            self.overrides.0[row].as_ref().map_or((reported, 0), |wish| (wish.reckoned, wish.sent_ms));
        let left = of.steps(from, percent);
        self.overrides.0[row] = Some(Wish { percent, reckoned: from, left, sent_ms, tries: 0 });
    }

    /// What is not as programmed before a job begins: no program takes it back.
    pub(super) fn overrides_that_stand(&self) -> Option<Diagnostic> {
        let [feed, rapid, spindle] = self.status.as_ref()?.overrides.filter(|all| *all != [100; 3])?;
        let why = Diagnostic::warning("grbl.overrides_stand").with("feed", feed);
        Some(why.with("rapid", rapid).with("spindle", spindle))
    }

    /// Sends the characters that are due.
    pub(super) fn send_overrides(&mut self) {
        if matches!(self.phase, EnginePhase::Closed | EnginePhase::Greeting) || self.reset_at.is_some() {
            return;
        }
        let now_ms = self.now_ms;
        let mut signs = Vec::new();
        for wish in self.overrides.0.iter_mut().flatten() {
            let due = wish.sent_ms == 0 || now_ms >= wish.sent_ms + STEP_MS;
            if let Some(step) = wish.left.front().copied().filter(|_| due) {
                wish.left.pop_front();
                (wish.reckoned, wish.sent_ms) = (step.leads_to(wish.reckoned), now_ms);
                signs.push(step.sign());
            }
        }
        signs.into_iter().for_each(|sign| self.write(sign));
    }

    /// A report tells where they are; it answers a question of `asked_ms`.
    pub(super) fn overrides_reported(&mut self, told: [u16; 3], asked_ms: u64) {
        for of in OverrideOf::ALL {
            let row = of as usize;
            let seen = |wish: &&mut Wish| wish.left.is_empty() && asked_ms >= wish.sent_ms + STEP_MS;
            let Some(wish) = self.overrides.0[row].as_mut().filter(seen) else { continue };
            if told[row] != wish.percent && wish.tries < TRIES {
                wish.tries += 1;
                (wish.reckoned, wish.left) = (Some(told[row]), of.steps(Some(told[row]), wish.percent));
                continue;
            }
            let wanted = wish.percent;
            self.overrides.0[row] = None;
            if told[row] != wanted {
                let why = Diagnostic::warning("grbl.override_not_taken").with("wanted", wanted);
                self.found(why.with("found", told[row]));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_override_is_reached_by_the_steps_that_controllers_have_and_by_no_way_about() {
        let rows = [
            (OverrideOf::Feed, None, 100, "90"),
            (OverrideOf::Feed, None, 97, "90 94 94 94"),
            (OverrideOf::Feed, Some(100), 75, "92 92 94 94 94 94 94"),
            (OverrideOf::Feed, Some(100), 122, "91 91 93 93"),
            (OverrideOf::Feed, Some(50), 40, "92"),
            (OverrideOf::Feed, Some(30), 100, "90"),
            (OverrideOf::Rapid, Some(100), 25, "97"),
            (OverrideOf::Rapid, None, 50, "96"),
            (OverrideOf::Rapid, Some(25), 100, "95"),
            (OverrideOf::Spindle, Some(100), 111, "9a 9c"),
            (OverrideOf::Spindle, Some(111), 100, "99"),
            (OverrideOf::Spindle, Some(100), 89, "9b 9d"),
        ];
        for (of, from, to, expected) in rows {
            let steps = of.steps(from, to);
            let signs: Vec<_> = steps.iter().map(|step| format!("{:x}", step.sign())).collect();
            assert_eq!(signs.join(" "), expected, "{of:?} {from:?} {to}");
            let end = steps.iter().fold(from, |at, step| step.leads_to(at));
            assert_eq!(end, Some(to), "{of:?} {from:?} {to}");
        }
    }
}
