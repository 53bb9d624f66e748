//! Control of the machine: one page at a time; all others watch.
//!
//! ```text
//!          take                        heard, heard, heard …        3 s of silence, release or leave
//! no page ──────▶ viewer 1 in control ──────────────────────▶ … ─────────────────────────────────▶ no page
//!                     │ take by viewer 2, forced
//!                     └──────────────────────────▶ viewer 2 in control
//! ```
//!
//! A running job continues regardless of control.

use crate::diagnostic::Diagnostic;
use crate::error;

/// Silence after which control lapses, in ms.
pub const LAPSE_MS: u64 = 3_000;

/// Number of a page; never reused.
pub type Viewer = u32;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lease {
    holder: Option<(Viewer, u64)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeaseEvent {
    Heard(Viewer),
    /// This page requests control; with `force`, even if another page has it.
    Take {
        viewer: Viewer,
        force: bool,
    },
    /// This page releases control. No-op for a page without control.
    Release(Viewer),
    Left(Viewer),
    Tick,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LeaseOutcome {
    /// Notify all pages that control changed.
    pub changed: bool,
    /// Page that lost control involuntarily: silent, gone, or overruled. Its jog must stop.
    pub lost: Option<Viewer>,
    pub refused: Option<Diagnostic>,
}

impl Lease {
    pub fn holder(&self) -> Option<Viewer> {
        self.holder.map(|(viewer, _)| viewer)
    }

    /// Applies `event` at `now_ms`. Silence is handled first: a page that was silent too long has lost
    /// control before `event` applies.
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
                    refused = Some(error!("control.taken"));
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

    /// (time, event, page in control afterwards, page that lost it, whether it was refused)
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
    fn silence_ends_control() {
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
    fn control_ends_by_force_release_or_disconnect() {
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
    fn late_frame_does_not_restore_control() {
        check(&[(0, take(1), Some(1), None, false), (3_000, Heard(1), None, Some(1), false)]);
    }

    #[test]
    fn clock_set_back_ends_no_control() {
        check(&[(9_000, take(1), Some(1), None, false), (10, Tick, Some(1), None, false)]);
    }
}
