//! Measures how long a job is held without a terminal to resume it.

use std::time::{Duration, Instant};

/// A hold that ends within this time is ignored.
const PATIENCE: Duration = Duration::from_secs(2);
/// If the job has not ended this long after the hold, it is stuck.
const MOST: Duration = Duration::from_secs(30);

/// A hold that no terminal can end.
#[derive(Debug, Default)]
pub(super) struct HeldAlone {
    since: Option<Instant>,
    has_ended: bool,
}

impl HeldAlone {
    /// Returns `true` if this command requested the end of the job.
    pub(super) const fn has_ended(&self) -> bool {
        self.has_ended
    }

    /// Returns `true` if this command requested the end of the job, but the job did not end in time.
    pub(super) fn is_stuck(&self) -> bool {
        self.has_ended && self.since.is_some_and(|since| since.elapsed() > MOST)
    }

    /// Returns `true`, once, if the hold has lasted too long and the job must end now.
    pub(super) fn is_over(&mut self, is_held: bool) -> bool {
        if self.has_ended {
            return false;
        }
        self.since = self.since.filter(|_| is_held);
        if is_held {
            self.has_ended = self.since.get_or_insert_with(Instant::now).elapsed() >= PATIENCE;
        }
        self.has_ended
    }
}
