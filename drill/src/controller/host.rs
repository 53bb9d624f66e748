//! Whether the computer itself stood still: a page whose dialog was open carries no bytes, a computer that slept has no time, nor has a
//! command that was suspended. What is not heard then is no silence of the board.
//!
//! ```text
//! turn ── 10 ms ── turn ─────────── 6 s ─────────── turn        the clock of the engine has a second of it
//! written ─ carried │ written ───── 6 s ───── carried           and so it has here
//! ```
//!
//! Comes in: the time at every turn, what was written and carried. Goes out: time that stood still, and when it is too much of it. Does
//! not know what a board does meanwhile.

use std::time::Duration;

/// Between two turns, and between writing and carrying: what takes longer is a computer that stands still.
const STANDS: Duration = Duration::from_secs(1);
/// Whoever stands at the machine takes it for held after so long: it does not go on unasked.
pub const HELD_AFTER: Duration = Duration::from_secs(4);

/// What a look brought to light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HostNews {
    /// It stands still, or stood: how long anything takes says nothing.
    Late,
    /// It did so for too long.
    TooLate,
}

/// What is known of the computer.
#[derive(Debug)]
pub struct Host {
    /// What takes longer than this is late.
    late: Duration,
    looked: Duration,
    /// Since when something waits to be carried; how often something was written, and carried.
    waits: Option<Duration>,
    written: u64,
    carried: u64,
    /// All that it stood still since the port was opened, but the first second of each time.
    stood: Duration,
    /// What was said of this time.
    told: Option<HostNews>,
}

impl Host {
    /// A computer at whose port a board runs `speed` times faster than life.
    pub fn new(now: Duration, speed: f64) -> Self {
        let late = STANDS.div_f64(speed.max(1.0));
        Self { late, looked: now, waits: None, written: 0, carried: 0, stood: Duration::ZERO, told: None }
    }

    /// Time in which nobody could be heard.
    pub fn stood(&self) -> Duration {
        self.stood
    }

    /// Bytes are on their way to the port.
    pub fn is_written(&mut self, now: Duration) {
        self.written += 1;
        self.waits.get_or_insert(now);
    }

    /// The oldest of them are there.
    pub fn is_carried(&mut self, now: Duration) {
        self.carried = self.written.min(self.carried + 1);
        self.waits = (self.carried < self.written).then_some(now);
    }

    /// Looks at the time. Gives what is to be said, each once of every time that it stood still.
    pub fn look(&mut self, now: Duration) -> Option<HostNews> {
        let passed = now.saturating_sub(self.looked);
        self.looked = now;
        let waits = self.waits.map_or(Duration::ZERO, |since| now.saturating_sub(since));
        if passed > self.late {
            self.stood += passed - self.late;
        } else if waits > self.late {
            self.stood += passed;
        } else {
            self.told = None;
            return None;
        }
        let long = passed.max(waits) >= HELD_AFTER;
        let news = if long { HostNews::TooLate } else { HostNews::Late };
        let is_known = self.told == Some(HostNews::TooLate) || self.told == Some(news);
        (!is_known).then(|| {
            self.told = Some(news);
            news
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    #[test]
    fn turns_that_were_late_and_bytes_that_were_not_carried_are_time_that_stood_still() {
        let mut host = Host::new(at(0), 1.0);
        assert_eq!((host.look(at(1_000)), host.stood()), (None, at(0)));
        assert_eq!((host.look(at(3_000)), host.stood()), (Some(HostNews::Late), at(1_000)));
        assert_eq!((host.look(at(8_000)), host.stood()), (Some(HostNews::TooLate), at(5_000)));
        assert_eq!(host.look(at(8_010)), None);
        // A page that carries nothing: by turns that are not late.
        host.is_written(at(8_010));
        let news = (802..1_400).map(|turn| turn * 10).filter_map(|ms| Some((ms, host.look(at(ms))?)));
        let news: Vec<(u64, HostNews)> = news.collect();
        assert_eq!(news, [(9_020, HostNews::Late), (12_010, HostNews::TooLate)]);
        assert!(host.stood() > at(9_900) && host.stood() < at(10_000), "{:?}", host.stood());
        host.is_carried(at(13_990));
        assert!(host.look(at(14_000)).is_none() && host.stood() < at(10_000));
        // One that is slow, and has more to do, carries.
        (0..3).for_each(|_| host.is_written(at(14_000)));
        for ms in [14_900, 15_800, 16_700] {
            host.is_carried(at(ms));
            assert_eq!(host.look(at(ms)), None);
        }
        assert!(host.stood() < at(10_000) && host.waits.is_none());
    }
}
