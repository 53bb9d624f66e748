//! Watchers: the connected pages, which one has control, and the reports to them.
//!
//! ```text
//! drill ── Tell ──▶ pump ──┬─ Status ─────▶ latest value ──▶ every page, as fast as it reads
//!                          └─ all others ─▶ one queue per page (bounded; a page with a full queue is dropped)
//! ```
//!
//! Nothing here blocks, so a slow reader cannot delay the drill.

use annulus_core::control::State;
use annulus_core::control::lease::{Lease, LeaseEvent, LeaseOutcome, Viewer};
use annulus_core::wire::{Control, Status, Tell};
use axum::extract::ws::Utf8Bytes;
use std::collections::BTreeMap;
use tokio::sync::{mpsc, watch};

const QUEUE: usize = 256;
const VIEWERS: usize = 64;

pub(crate) struct Watchers {
    lease: Lease,
    next: Viewer,
    viewers: BTreeMap<Viewer, Sitting>,
    status: watch::Sender<Utf8Bytes>,
    state: Option<State>,
}

struct Sitting {
    session: String,
    queue: mpsc::Sender<Utf8Bytes>,
}

/// The connection of a page: its number, its queue, and the latest status.
pub(crate) struct Seat {
    pub(crate) viewer: Viewer,
    /// Reports in order. Ends when the page is dropped.
    pub(crate) tells: mpsc::Receiver<Utf8Bytes>,
    pub(crate) status: watch::Receiver<Utf8Bytes>,
}

impl Watchers {
    pub(crate) fn new() -> Self {
        let (status, _) = watch::channel(Utf8Bytes::default());
        Self { lease: Lease::default(), next: 1, viewers: BTreeMap::new(), status, state: None }
    }

    /// Adds a page of `session`, and reports the new number of pages. If all seats are taken, the session
    /// with the most pages loses its oldest; `None` if every other session has only one. So a reloaded page
    /// replaces its predecessor.
    pub(crate) fn join(&mut self, session: &str) -> Option<Seat> {
        if self.viewers.len() >= VIEWERS {
            let goes = self.who_goes(session)?;
            tracing::warn!(viewer = goes, "too many pages: one gave its seat to another");
            self.viewers.remove(&goes);
        }
        // Numbers are never reused, so a late message cannot act for a newer page.
        let viewer = self.next;
        self.next += 1;
        let (queue, tells) = mpsc::channel(QUEUE);
        self.viewers.insert(viewer, Sitting { session: session.to_owned(), queue });
        let seat = Seat { viewer, tells, status: self.status.subscribe() };
        self.tell(viewer, &Tell::Welcome { viewer });
        self.tell_control();
        Some(seat)
    }

    /// The page that loses its seat to a new page of `session`.
    fn who_goes(&self, session: &str) -> Option<Viewer> {
        let mut sitting = BTreeMap::<&str, usize>::new();
        self.viewers.values().for_each(|page| *sitting.entry(&page.session).or_default() += 1);
        *sitting.entry(session).or_default() += 1;
        let most = *sitting.values().max().filter(|most| **most > 1)?;
        let own = sitting.get(session) == Some(&most);
        // Only a page of the same session may displace the page in control.
        let mut old = self.viewers.iter().filter(|(viewer, page)| {
            let of_this = page.session == session;
            if own { of_this } else { sitting[&*page.session] == most && self.holder() != Some(**viewer) }
        });
        old.next().map(|(viewer, _)| *viewer)
    }

    /// Removes a page. Returns whether control was lost.
    pub(crate) fn leave(&mut self, viewer: Viewer, now_ms: u64) -> LeaseOutcome {
        self.viewers.remove(&viewer);
        let outcome = self.lease.step(LeaseEvent::Left(viewer), now_ms);
        self.tell_control();
        outcome
    }

    pub(crate) fn control(&mut self, event: LeaseEvent, now_ms: u64) -> LeaseOutcome {
        let outcome = self.lease.step(event, now_ms);
        if outcome.changed {
            self.tell_control();
        }
        outcome
    }

    pub(crate) fn holder(&self) -> Option<Viewer> {
        self.lease.holder()
    }

    pub(crate) fn has_control(&self, viewer: Viewer) -> bool {
        self.lease.holder() == Some(viewer)
    }

    pub(crate) fn tell(&mut self, viewer: Viewer, tell: &Tell) {
        if let Some(page) = self.viewers.get(&viewer)
            // Never waits: one slow page must not hold up the others.
            && page.queue.try_send(text(tell)).is_err()
        {
            tracing::warn!(viewer, "page reads too slowly: dropped");
            self.viewers.remove(&viewer);
        }
    }

    pub(crate) fn tell_all(&mut self, tell: &Tell) {
        if let Tell::Status(status) = tell {
            self.note(status);
            // Only the newest status matters, so it does not go through the queue.
            self.status.send_replace(text(tell));
            return;
        }
        let frame = text(tell);
        self.viewers.retain(|viewer, page| {
            let kept = page.queue.try_send(frame.clone()).is_ok();
            if !kept {
                tracing::warn!(viewer, "page reads too slowly: dropped");
            }
            kept
        });
    }

    /// Drops a page; it still receives what is in its queue.
    pub(crate) fn dismiss(&mut self, viewer: Viewer) {
        self.viewers.remove(&viewer);
    }

    pub(crate) fn close(&mut self) {
        self.viewers.clear();
    }

    fn note(&mut self, status: &Status) {
        if self.state != Some(status.state) {
            let alarm = status.alarm.as_ref().map_or("-", |why| &why.code);
            tracing::info!(state = ?status.state, job = status.job.as_deref().unwrap_or("-"), alarm, "state");
            self.state = Some(status.state);
        }
    }

    fn tell_control(&mut self) {
        let holder = self.lease.holder();
        let viewers = u32::try_from(self.viewers.len()).unwrap_or(u32::MAX);
        let pages: Vec<Viewer> = self.viewers.keys().copied().collect();
        for viewer in pages {
            let yours = holder == Some(viewer);
            self.tell(viewer, &Tell::Control(Control { yours, taken: holder.is_some(), viewers }));
        }
    }
}

fn text(tell: &Tell) -> Utf8Bytes {
    serde_json::to_string(tell).unwrap_or_default().into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drain(seat: &mut Seat) -> Vec<String> {
        std::iter::from_fn(|| seat.tells.try_recv().ok()).map(|frame| frame.to_string()).collect()
    }

    #[test]
    fn control_changes_are_sent_to_every_page() {
        let mut watchers = Watchers::new();
        let mut one = watchers.join("a").unwrap();
        assert_eq!(drain(&mut one).len(), 2, "welcome and control");
        let mut two = watchers.join("b").unwrap();
        assert_eq!(drain(&mut two).len(), 2);
        assert_eq!(drain(&mut one), [r#"{"t":"control","yours":false,"taken":false,"viewers":2}"#]);
        watchers.control(LeaseEvent::Take { viewer: two.viewer, force: false }, 0);
        assert!(watchers.has_control(two.viewer) && !watchers.has_control(one.viewer));
        assert_eq!(drain(&mut one), [r#"{"t":"control","yours":false,"taken":true,"viewers":2}"#]);
        assert_eq!(drain(&mut two), [r#"{"t":"control","yours":true,"taken":true,"viewers":2}"#]);
        assert_eq!(watchers.leave(two.viewer, 1).lost, Some(two.viewer));
        assert_eq!(drain(&mut one), [r#"{"t":"control","yours":false,"taken":false,"viewers":1}"#]);
    }

    #[test]
    fn reloaded_page_replaces_a_seat_of_the_busiest_page() {
        let mut watchers = Watchers::new();
        let mut seats: Vec<Seat> = (0..VIEWERS - 1).map(|_| watchers.join("many").unwrap()).collect();
        let own = watchers.join("own").unwrap();
        watchers.control(LeaseEvent::Take { viewer: seats[0].viewer, force: false }, 0);
        // Reloaded before the bridge noticed that the old page is gone.
        let again = watchers.join("own").unwrap();
        assert_eq!(watchers.viewers.len(), VIEWERS);
        assert!(watchers.has_control(seats[0].viewer) && watchers.viewers.contains_key(&seats[0].viewer));
        assert!(
            !watchers.viewers.contains_key(&seats[1].viewer),
            "the oldest without control of those who have most"
        );
        assert!(watchers.viewers.contains_key(&own.viewer) && watchers.viewers.contains_key(&again.viewer));
        let seat = watchers.join("many").unwrap();
        assert!(
            !watchers.viewers.contains_key(&seats[0].viewer) && watchers.viewers.contains_key(&seat.viewer)
        );
        seats.clear();
        let mut all = Watchers::new();
        let full: Vec<Seat> = (0..VIEWERS).map(|page| all.join(&page.to_string()).unwrap()).collect();
        assert!(all.join("another").is_none(), "everybody has one");
        assert!(all.join("7").is_some(), "but a page that has one gets it anew");
        drop(full);
    }

    #[test]
    fn only_the_page_that_does_not_read_is_dropped() {
        let mut watchers = Watchers::new();
        let mut slow = watchers.join("a").unwrap();
        let mut good = watchers.join("a").unwrap();
        for _ in 0..2 * QUEUE {
            watchers.tell_all(&Tell::Pong { stamp: 0.0 });
            drain(&mut good);
        }
        assert_eq!(watchers.viewers.keys().copied().collect::<Vec<_>>(), [good.viewer]);
        assert_eq!(drain(&mut slow).len(), QUEUE);
        assert_eq!(slow.tells.try_recv(), Err(mpsc::error::TryRecvError::Disconnected));
    }
}
