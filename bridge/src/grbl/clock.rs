//! A clock that also counts while this process is suspended and while the computer sleeps.

use std::time::Duration;

/// Time since an arbitrary start. `Instant` stops during sleep on Linux and macOS; this clock does not.
#[cfg(unix)]
pub(super) fn now() -> Duration {
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
pub(super) fn now() -> Duration {
    use std::sync::OnceLock;
    use std::time::Instant;
    static BEGAN: OnceLock<Instant> = OnceLock::new();
    BEGAN.get_or_init(Instant::now).elapsed()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clock_measures_a_sleep() {
        let began = now();
        std::thread::sleep(Duration::from_millis(30));
        let passed = now().saturating_sub(began);
        assert!(passed >= Duration::from_millis(30) && passed < Duration::from_secs(20), "{passed:?}");
    }
}
