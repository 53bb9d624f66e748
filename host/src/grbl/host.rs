//! Detects that the host itself stalled: a modal dialog blocks a page, a computer sleeps, a command is
//! suspended. The controller's silence in that time means nothing.
//!
//! ```text
//! turn ── 10 ms ── turn ─────────── 6 s ─────────── turn        the engine's clock counts one second of it
//! written ─ carried │ written ───── 6 s ───── carried           the same here
//! ```

use std::time::Duration;

/// Longest normal time between two turns, or between writing and carrying. Anything longer is a stall.
const STANDS: Duration = Duration::from_secs(1);
/// After a stall this long, a user at the machine believes that it stopped: it must not continue unasked.
pub(super) const HELD_AFTER: Duration = Duration::from_secs(4);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum HostNews {
    /// The host stalls or stalled: timeouts mean nothing.
    Late,
    /// The stall lasted longer than [`HELD_AFTER`].
    TooLate,
}

/// The stall detector.
#[derive(Debug)]
pub(super) struct Host {
    /// Time above which a turn is late.
    late: Duration,
    looked: Duration,
    /// Since when bytes wait to be carried; number of writes; number carried.
    waits: Option<Duration>,
    written: u64,
    carried: u64,
    /// Total stalled time since the port was opened, less the first second of each stall.
    stood: Duration,
    /// The news already reported of the current stall.
    told: Option<HostNews>,
}

impl Host {
    /// A host at whose port the controller runs at the time scale `speed`.
    pub(super) fn new(now: Duration, speed: f64) -> Self {
        let late = STANDS.div_f64(speed.max(1.0));
        Self { late, looked: now, waits: None, written: 0, carried: 0, stood: Duration::ZERO, told: None }
    }

    /// Total time in which the controller could not be heard.
    pub(super) fn stood(&self) -> Duration {
        self.stood
    }

    /// Bytes are on their way to the port.
    pub(super) fn is_written(&mut self, now: Duration) {
        self.written += 1;
        self.waits.get_or_insert(now);
    }

    /// The oldest written bytes reached the port.
    pub(super) fn is_carried(&mut self, now: Duration) {
        self.carried = self.written.min(self.carried + 1);
        self.waits = (self.carried < self.written).then_some(now);
    }

    /// Checks the time. Returns each kind of news once per stall.
    pub(super) fn look(&mut self, now: Duration) -> Option<HostNews> {
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
    fn late_turns_and_unsent_bytes_count_as_stalled_time() {
        let mut host = Host::new(at(0), 1.0);
        assert_eq!((host.look(at(1_000)), host.stood()), (None, at(0)));
        assert_eq!((host.look(at(3_000)), host.stood()), (Some(HostNews::Late), at(1_000)));
        assert_eq!((host.look(at(8_000)), host.stood()), (Some(HostNews::TooLate), at(5_000)));
        assert_eq!(host.look(at(8_010)), None);
        // A page that carries nothing, while its turns are on time.
        host.is_written(at(8_010));
        let news = (802..1_400).map(|turn| turn * 10).filter_map(|ms| Some((ms, host.look(at(ms))?)));
        let news: Vec<(u64, HostNews)> = news.collect();
        assert_eq!(news, [(9_020, HostNews::Late), (12_010, HostNews::TooLate)]);
        assert!(host.stood() > at(9_900) && host.stood() < at(10_000), "{:?}", host.stood());
        host.is_carried(at(13_990));
        assert!(host.look(at(14_000)).is_none() && host.stood() < at(10_000));
        // A slow page with several writes pending still carries.
        (0..3).for_each(|_| host.is_written(at(14_000)));
        for ms in [14_900, 15_800, 16_700] {
            host.is_carried(at(ms));
            assert_eq!(host.look(at(ms)), None);
        }
        assert!(host.stood() < at(10_000) && host.waits.is_none());
    }
}
