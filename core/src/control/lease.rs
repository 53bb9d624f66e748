//! Who may move the machine: one controller, many viewers.
//!
//! ```text
//!          take                        heard, heard, heard …        3 s of silence, release or leave
//! nobody ───────▶ viewer 1 in control ──────────────────────▶ … ──────────────────────────────────▶ nobody
//!                     │ take by viewer 2, forced
//!                     └──────────────────────────▶ viewer 2 in control
//! ```
//!
//! Comes in: what viewers do, with the time in ms of any clock that only goes forward. Goes out: who has control and
//! what changed. A job that runs goes on whoever has control; this floor does not know jobs, sockets or clocks.

use crate::diagnostic::Diagnostic;

/// Silence after which control lapses, in ms.
pub const LAPSE_MS: u64 = 3_000;

/// Number of a page among the viewers, never given twice.
pub type Viewer = u32;

/// Who has control and when that page was last heard.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lease {
    holder: Option<(Viewer, u64)>,
}

/// What happens to a lease.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeaseEvent {
    /// Any frame from this page.
    Heard(Viewer),
    /// This page asks for control, from whoever has it if `force`.
    Take {
        /// Who asks.
        viewer: Viewer,
        /// Take it even though another page has it.
        force: bool,
    },
    /// This page gives control back; from a page without control, nothing.
    Release(Viewer),
    /// This page is gone.
    Left(Viewer),
    /// Time passed.
    Tick,
}

/// What came of an event.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LeaseOutcome {
    /// Everybody should be told who has control now.
    pub changed: bool,
    /// The page that lost control without asking for it: silent, gone, or overruled. What it moved by hand must stop.
    pub lost: Option<Viewer>,
    /// Why control was not given.
    pub refused: Option<Diagnostic>,
}

impl Lease {
    /// Who has control.
    pub fn holder(&self) -> Option<Viewer> {
        self.holder.map(|(viewer, _)| viewer)
    }

    /// The lease after `event` at `now_ms`. Silence is judged first: whoever was silent too long has lost control
    /// before anything else happens.
    pub fn step(&mut self, event: LeaseEvent, now_ms: u64) -> LeaseOutcome {
        let before = self.holder();
        let mut lost = None;
        if let Some((viewer, heard_ms)) = self.holder
            && now_ms.saturating_sub(heard_ms) >= LAPSE_MS
        {
            self.holder = None;
            lost = Some(viewer);
        }
        let mut refused = None;
        match (event, self.holder()) {
            (LeaseEvent::Heard(viewer), Some(holder)) if viewer == holder => {
                self.holder = Some((viewer, now_ms));
            }
            (LeaseEvent::Take { viewer, force }, Some(holder)) if viewer != holder => {
                if force {
                    self.holder = Some((viewer, now_ms));
                    lost = Some(holder);
                } else {
                    refused = Some(Diagnostic::error("control.taken"));
                }
            }
            (LeaseEvent::Take { viewer, .. }, _) => self.holder = Some((viewer, now_ms)),
            (LeaseEvent::Release(viewer), Some(holder)) if viewer == holder => self.holder = None,
            (LeaseEvent::Left(viewer), Some(holder)) if viewer == holder => {
                self.holder = None;
                lost = Some(viewer);
            }
            _ => {}
        }
        LeaseOutcome { changed: before != self.holder(), lost, refused }
    }
}

#[cfg(test)]
mod tests {
    use super::LeaseEvent::{Heard, Left, Release, Take, Tick};
    use super::*;

    const fn take(viewer: Viewer) -> LeaseEvent {
        Take { viewer, force: false }
    }
    const fn force(viewer: Viewer) -> LeaseEvent {
        Take { viewer, force: true }
    }

    /// Rows of (time, event, who has control afterwards, who lost it, whether it was refused).
    type Row = (u64, LeaseEvent, Option<Viewer>, Option<Viewer>, bool);

    fn check(rows: &[Row]) {
        let mut lease = Lease::default();
        for (number, (now_ms, event, holder, lost, refused)) in rows.iter().enumerate() {
            let before = lease.holder();
            let outcome = lease.step(*event, *now_ms);
            assert_eq!(lease.holder(), *holder, "row {number}");
            assert_eq!(outcome.lost, *lost, "row {number}");
            assert_eq!(outcome.refused.is_some(), *refused, "row {number}");
            assert_eq!(outcome.changed, before != lease.holder(), "row {number}");
        }
    }

    #[test]
    fn one_controller_until_silence() {
        check(&[
            (0, Heard(1), None, None, false),
            (0, take(1), Some(1), None, false),
            (1_000, take(2), Some(1), None, true),
            (2_999, Tick, Some(1), None, false),
            (2_999, Heard(2), Some(1), None, false),
            (2_999, Heard(1), Some(1), None, false),
            (5_998, Tick, Some(1), None, false),
            (5_999, Tick, None, Some(1), false),
            (5_999, Heard(1), None, None, false),
            (6_000, take(2), Some(2), None, false),
            (9_100, take(3), Some(3), Some(2), false),
        ]);
    }

    #[test]
    fn force_release_and_leaving() {
        check(&[
            (0, take(1), Some(1), None, false),
            (1, force(2), Some(2), Some(1), false),
            (2, Release(1), Some(2), None, false),
            (2, Left(1), Some(2), None, false),
            (3, force(2), Some(2), None, false),
            (4, Release(2), None, None, false),
            (5, force(3), Some(3), None, false),
            (6, Left(3), None, Some(3), false),
            (7, Release(3), None, None, false),
        ]);
    }

    #[test]
    fn a_late_frame_does_not_bring_control_back() {
        check(&[(0, take(1), Some(1), None, false), (3_000, Heard(1), None, Some(1), false)]);
    }

    #[test]
    fn a_clock_that_goes_back_takes_control_from_nobody() {
        check(&[(9_000, take(1), Some(1), None, false), (10, Tick, Some(1), None, false)]);
    }
}
