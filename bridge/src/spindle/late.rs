//! Late answers: decides which request the next bytes belong to.
//!
//! ```text
//! ask 1 ──── 60 ms, nothing ──▶ ask 1 again ── its first answer ──▶ quiet until the second one is over ──▶ ask 2
//! ```
//!
//! Frames have no number, so a late answer looks like one to the current request: a speed would be read as
//! a trip code.

use super::frames::Ask;
use std::time::Duration;

/// How long after the last of three requests an answer may still arrive. Worst case: the converter answers
/// them one by one and takes 180 ms for each. Then the third answer arrives 3 × 180 ms after the first
/// request, which was sent 120 ms before the last.
const LATEST: Duration = Duration::from_millis(3 * 180 - 120);

/// The request whose answers may still arrive.
#[derive(Debug)]
struct Open {
    ask: Ask,
    sent: Duration,
    missed: u32,
    answered: bool,
}

/// Answers to earlier requests that the line may still deliver.
#[derive(Debug, Default)]
pub(super) struct Late {
    open: Option<Open>,
}

impl Late {
    /// Until when to discard received bytes before `ask` is sent; `None` if it may be sent at once. Writes
    /// are sent at once: a stop must not wait, and its answer cannot be taken for a reading.
    pub(super) fn quiet_until(&self, ask: Ask) -> Option<Duration> {
        let open = self.open.as_ref().filter(|open| open.missed > 0)?;
        let repeats = open.ask == ask && !open.answered;
        let reads = matches!(ask, Ask::Actual | Ask::Fault);
        (reads && !repeats).then_some(open.sent + LATEST)
    }

    pub(super) fn asked(&mut self, ask: Ask, now: Duration) {
        match &mut self.open {
            Some(open) if open.ask == ask && !open.answered => open.sent = now,
            open => *open = Some(Open { ask, sent: now, missed: 0, answered: false }),
        }
    }

    /// The last request was answered, or its time is over.
    pub(super) fn over(&mut self, answered: bool) {
        let Some(open) = &mut self.open else { return };
        open.answered = answered;
        open.missed += u32::from(!answered);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ANSWER: Duration = Duration::from_millis(60);
    const POLL: Duration = Duration::from_millis(50);

    /// A line to a converter that answers everything after `late`; if `one_by_one`, several requests one
    /// after the other.
    struct Line {
        late: Duration,
        one_by_one: bool,
        coming: Vec<(Duration, Ask)>,
    }

    impl Line {
        fn send(&mut self, ask: Ask, now: Duration) {
            let free = self.coming.last().map_or(now, |(at, _)| *at).max(now);
            let begins = if self.one_by_one { free } else { now };
            self.coming.push((begins + self.late, ask));
        }

        fn hear(&mut self, until: Duration) -> Option<(Duration, Ask)> {
            let first = *self.coming.first().filter(|(at, _)| *at < until)?;
            self.coming.remove(0);
            Some(first)
        }
    }

    /// Pairs of request and received answer for this many readings; every fourth asks for a trip.
    fn read(line: &mut Line, readings: u32) -> Vec<(Ask, Ask)> {
        let (mut late, mut now, mut pairs) = (Late::default(), Duration::ZERO, Vec::new());
        for reading in 1..=readings {
            let ask = if reading.is_multiple_of(4) { Ask::Fault } else { Ask::Actual };
            for _ in 0..super::super::watch::TRIES {
                if let Some(until) = late.quiet_until(ask) {
                    now = now.max(until);
                    while line.hear(now).is_some() {}
                }
                line.send(ask, now);
                late.asked(ask, now);
                let heard = line.hear(now + ANSWER);
                late.over(heard.is_some());
                now = heard.map_or(now + ANSWER, |(at, _)| at.max(now));
                if let Some((_, of)) = heard {
                    pairs.push((ask, of));
                    break;
                }
            }
            now += POLL;
        }
        pairs
    }

    #[test]
    fn late_answer_is_never_matched_to_another_request() {
        for one_by_one in [false, true] {
            for late_ms in (5..=175).step_by(5) {
                let late = Duration::from_millis(late_ms);
                let pairs = read(&mut Line { late, one_by_one, coming: Vec::new() }, 40);
                assert_eq!(pairs.len(), 40, "{late_ms} ms: every ask is answered");
                assert!(pairs.iter().all(|(ask, of)| ask == of), "{late_ms} ms: {pairs:?}");
            }
        }
    }

    #[test]
    fn stop_and_speed_requests_do_not_wait_for_late_answers() {
        let mut late = Late::default();
        late.asked(Ask::Actual, Duration::ZERO);
        late.over(false);
        assert!(late.quiet_until(Ask::Fault).is_some());
        assert_eq!(late.quiet_until(Ask::Actual), None, "the same again at once");
        for ask in [Ask::Stop { place: 0 }, Ask::Speed { rpm: 1 }, Ask::Run { place: 0 }] {
            assert_eq!(late.quiet_until(ask), None);
        }
    }
}
