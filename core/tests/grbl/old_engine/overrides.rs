//! Feed, rapid and spindle overrides. Their real-time characters are relative steps without an answer, and a
//! controller merges two equal ones that arrive close together. So the engine sends them one at a time and
//! checks the result in the reports.
//!
//! ```text
//!  60 % wanted, 100 % reported ─▶ −10 ─ 30 ms ─ −10 ─ … ─▶ report: 60 % ─▶ done
//!                                                        └─ another ─▶ remaining steps, at most four times
//! ```
//!
//! Percent, ms.

use super::asks::{EnginePhase, Override};
use super::engine::Controller;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::grbl::OverrideOf;
use std::collections::VecDeque;

/// Interval between two characters, so that the controller has handled the first.
const STEP_MS: u64 = 30;
const TRIES: u32 = 4;

const ALL: [OverrideOf; 3] = [OverrideOf::Feed, OverrideOf::Rapid, OverrideOf::Spindle];

trait Steps {
    fn allows(self, percent: u8) -> bool;
    fn refusal(self) -> &'static str;
    fn steps(self, from: Option<u16>, to: u16) -> VecDeque<Override>;
}

impl Steps for OverrideOf {
    fn allows(self, percent: u8) -> bool {
        match self {
            Self::Rapid => matches!(percent, 25 | 50 | 100),
            Self::Feed | Self::Spindle => (10..=200).contains(&percent),
        }
    }

    fn refusal(self) -> &'static str {
        match self {
            Self::Feed => "control.bad_feed_override",
            Self::Rapid => "control.bad_rapid_override",
            Self::Spindle => "control.bad_spindle_override",
        }
    }

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

#[derive(Clone, Debug)]
struct Wish {
    percent: u16,
    reckoned: Option<u16>,
    left: VecDeque<Override>,
    sent_ms: u64,
    tries: u32,
}

#[derive(Clone, Debug, Default)]
pub(super) struct OverrideWishes([Option<Wish>; 3]);

impl Controller {
    pub(super) fn ask_override(&mut self, of: OverrideOf, percent: u8) {
        if matches!(self.phase, EnginePhase::Closed | EnginePhase::Greeting) || self.reset_at.is_some() {
            return self.found(Diagnostic::error("grbl.not_now"));
        }
        if !of.allows(percent) {
            return self.found(Diagnostic::error(of.refusal()).with("percent", percent));
        }
        let (row, percent) = (of as usize, u16::from(percent));
        let reported = self.status.as_ref().and_then(|status| status.overrides).map(|all| all[row]);
        // Characters of an earlier request may be in flight that no report shows yet.
        let (from, sent_ms) =
            self.overrides.0[row].as_ref().map_or((reported, 0), |wish| (wish.reckoned, wish.sent_ms));
        let left = of.steps(from, percent);
        self.overrides.0[row] = Some(Wish { percent, reckoned: from, left, sent_ms, tries: 0 });
    }

    pub(super) fn overrides_that_stand(&self) -> Option<Diagnostic> {
        let [feed, rapid, spindle] = self.status.as_ref()?.overrides.filter(|all| *all != [100; 3])?;
        let why = Diagnostic::warning("grbl.overrides_stand").with("feed", feed);
        Some(why.with("rapid", rapid).with("spindle", spindle))
    }

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

    pub(super) fn overrides_reported(&mut self, told: [u16; 3], asked_ms: u64) {
        for of in ALL {
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
