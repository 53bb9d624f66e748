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

use super::asks::OverrideOf;
use crate::diagnostic::Diagnostic;
use crate::{code, warning};
use std::collections::VecDeque;

/// Interval between two characters, so that the controller has handled the first.
const STEP_MS: u64 = 30;
const TRIES: u32 = 4;

impl OverrideOf {
    const ALL: [Self; 3] = [Self::Feed, Self::Rapid, Self::Spindle];

    fn allows(self, percent: u8) -> bool {
        match self {
            Self::Rapid => matches!(percent, 25 | 50 | 100),
            Self::Feed | Self::Spindle => (10..=200).contains(&percent),
        }
    }

    fn refusal(self) -> &'static str {
        match self {
            Self::Feed => code!("control.bad_feed_override"),
            Self::Rapid => code!("control.bad_rapid_override"),
            Self::Spindle => code!("control.bad_spindle_override"),
        }
    }

    /// The steps between two values; if `from` is unknown, via 100 %.
    fn steps(self, from: Option<u16>, to: u16) -> VecDeque<Step> {
        // GRBL 1.1: this character sets 100 %, the next four are +10, −10, +1 and −1 %.
        let full = match self {
            Self::Feed => 0x90,
            Self::Spindle => 0x99,
            Self::Rapid => {
                let sign = match to {
                    25 => 0x97,
                    50 => 0x96,
                    _ => 0x95,
                };
                return [Step { sign, change: Change::To(to) }].into();
            }
        };
        // 100 % has a character of its own, which works from any value.
        let anew = from.is_none() || to == 100;
        let from = from.filter(|_| !anew).unwrap_or(100);
        let (ten, one) = if to < from { (2, 4) } else { (1, 3) };
        let sense = if to < from { -1 } else { 1 };
        let by = |sign: u8, percent: i16| Step { sign: full + sign, change: Change::By(sense * percent) };
        let off = usize::from(to.abs_diff(from));
        let first = anew.then_some(Step { sign: full, change: Change::To(100) });
        let tens = std::iter::repeat_n(by(ten, 10), off / 10);
        first.into_iter().chain(tens).chain(std::iter::repeat_n(by(one, 1), off % 10)).collect()
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Step {
    sign: u8,
    change: Change,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Change {
    To(u16),
    By(i16),
}

impl Step {
    /// The percentage after this step; `None` if the percentage before is unknown.
    fn leads_to(self, percent: Option<u16>) -> Option<u16> {
        match self.change {
            Change::To(percent) => Some(percent),
            // GRBL limits overrides to 10 … 200 %.
            Change::By(step) => Some(percent?.saturating_add_signed(step).clamp(10, 200)),
        }
    }
}

#[derive(Clone, Debug)]
struct Wish {
    percent: u16,
    /// Value after all sent characters have arrived; `None` if unknown.
    reckoned: Option<u16>,
    left: VecDeque<Step>,
    sent_ms: u64,
    tries: u32,
}

/// Overrides in progress, in the order of reports.
#[derive(Clone, Debug, Default)]
pub(super) struct OverrideWishes([Option<Wish>; 3]);

impl OverrideWishes {
    /// Requests an override, in percent of the programmed value; `reported` is in force.
    pub(super) fn ask(
        &mut self,
        of: OverrideOf,
        percent: u8,
        reported: Option<u16>,
    ) -> Result<(), Diagnostic> {
        if !of.allows(percent) {
            return Err(Diagnostic::error(of.refusal()).with("percent", percent));
        }
        let wish = &mut self.0[of as usize];
        let percent = u16::from(percent);
        // Characters of an earlier request may be in flight that no report shows yet.
        let (from, sent_ms) = wish.as_ref().map_or((reported, 0), |wish| (wish.reckoned, wish.sent_ms));
        *wish = Some(Wish { percent, reckoned: from, left: of.steps(from, percent), sent_ms, tries: 0 });
        Ok(())
    }

    pub(super) fn due(&mut self, now_ms: u64) -> Vec<u8> {
        let mut signs = Vec::new();
        for wish in self.0.iter_mut().flatten() {
            let due = wish.sent_ms == 0 || now_ms >= wish.sent_ms + STEP_MS;
            if let Some(step) = wish.left.front().copied().filter(|_| due) {
                wish.left.pop_front();
                (wish.reckoned, wish.sent_ms) = (step.leads_to(wish.reckoned), now_ms);
                signs.push(step.sign);
            }
        }
        signs
    }

    /// Evaluates the reported overrides; the report answers the query sent at `asked_ms`. Returns a warning
    /// for each that was not taken.
    pub(super) fn on_report(&mut self, told: [u16; 3], asked_ms: u64) -> Vec<Diagnostic> {
        let mut found = Vec::new();
        for of in OverrideOf::ALL {
            let (wish, told) = (&mut self.0[of as usize], told[of as usize]);
            let seen = |wish: &&mut Wish| wish.left.is_empty() && asked_ms >= wish.sent_ms + STEP_MS;
            let Some(sent) = wish.as_mut().filter(seen) else { continue };
            if told != sent.percent && sent.tries < TRIES {
                sent.tries += 1;
                // Characters were lost: step again from the reported value.
                (sent.reckoned, sent.left) = (Some(told), of.steps(Some(told), sent.percent));
                continue;
            }
            let wanted = sent.percent;
            *wish = None;
            if told != wanted {
                let why = warning!("grbl.override_not_taken", wanted = wanted, ..);
                found.push(why.with("found", told));
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overrides_are_reached_by_the_shortest_steps() {
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
            let signs: Vec<_> = steps.iter().map(|step| format!("{:x}", step.sign)).collect();
            assert_eq!(signs.join(" "), expected, "{of:?} {from:?} {to}");
            let end = steps.iter().fold(from, |at, step| step.leads_to(at));
            assert_eq!(end, Some(to), "{of:?} {from:?} {to}");
        }
    }
}
