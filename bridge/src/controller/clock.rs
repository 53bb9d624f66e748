//! Time that goes by for whoever stands at the machine: also while this process is stopped, and while the computer sleeps.
//!
//! Comes in: nothing. Goes out: durations. Does not know what waits for them.

use std::time::Duration;

/// Time since it was made.
pub(super) struct Stopwatch {
    began: Duration,
}

impl Stopwatch {
    /// From now on.
    pub(super) fn start() -> Self {
        Self { began: now() }
    }

    /// So much has gone by.
    pub(super) fn elapsed(&self) -> Duration {
        now().saturating_sub(self.began)
    }
}

/// Time of the one clock that goes on while the computer sleeps, which `Instant` does not on Linux and macOS.
#[cfg(unix)]
fn now() -> Duration {
    use rustix::time::{ClockId, clock_gettime};
    #[cfg(target_os = "linux")]
    let clock = ClockId::Boottime;
    #[cfg(not(target_os = "linux"))]
    let clock = ClockId::Monotonic;
    let now = clock_gettime(clock);
    let seconds = u64::try_from(now.tv_sec).unwrap_or_default();
    Duration::new(seconds, u32::try_from(now.tv_nsec).unwrap_or_default())
}

#[cfg(not(unix))]
fn now() -> Duration {
    use std::sync::OnceLock;
    use std::time::Instant;
    static BEGAN: OnceLock<Instant> = OnceLock::new();
    BEGAN.get_or_init(Instant::now).elapsed()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_goes_by() {
        let watch = Stopwatch::start();
        std::thread::sleep(Duration::from_millis(30));
        let passed = watch.elapsed();
        assert!(passed >= Duration::from_millis(30) && passed < Duration::from_secs(20), "{passed:?}");
    }
}
