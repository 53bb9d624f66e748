//! Permissions: a ticket for each request of a page, and a grant for a jog that is held.
//!
//! ```text
//! page ── jog ──▶ ticket 7 ── queue ──▶ owner: still 7? ── yes ──▶ moves
//!   └── gone ──▶ control changed: 8 ───────┘ no: refused, nothing moves
//!
//! Jog      JogOn    JogOn                        no more
//!  ├─ 150 ms ─┼─ 150 ms ─┼─ 150 ms ─┤ holds ─ 1 s ─▶ ends
//!                                    └─ JogOn: continues
//! ```
//!
//! A ticket carries the state of control and the number of STOPs when the request was sent. Changes of
//! control and STOPs go through the owner's own queue. So a request is either refused, or the message after
//! it stops what it started: there is no gap.

use annulus_core::code;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::pins::Order;
use annulus_core::wire::JOG_GRANT_MS;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Number of changes of control, and of STOPs.
#[derive(Debug, Default)]
pub struct Tickets {
    control: AtomicU64,
    stops: AtomicU64,
}

/// Those numbers when a request was sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ticket {
    control: u64,
    stops: u64,
}

impl Tickets {
    pub fn now(&self) -> Ticket {
        Ticket { control: self.control.load(Ordering::SeqCst), stops: self.stops.load(Ordering::SeqCst) }
    }

    pub fn control_changed(&self) {
        self.control.fetch_add(1, Ordering::SeqCst);
    }

    pub fn stopped(&self) {
        self.stops.fetch_add(1, Ordering::SeqCst);
    }

    pub fn check(&self, ticket: Ticket) -> Result<(), Diagnostic> {
        let now = self.now();
        let code = match ticket {
            _ if ticket.control != now.control => code!("control.needed"),
            _ if ticket.stops != now.stops => code!("socket.stopped_meanwhile"),
            _ => return Ok(()),
        };
        Err(Diagnostic::error(code))
    }
}

/// How long a jog holds for the next renewal before it ends.
const WAITS: Duration = Duration::from_secs(1);

/// The dead man's switch of a jog: it moves only while the page keeps renewing its permission.
///
/// Holds the end of the permission; an atomic, because the executor reads it between two steps and must not
/// block.
#[derive(Debug, Default)]
pub(crate) struct Grant {
    /// Microseconds of the caller's clock; 0 is withdrawn.
    until_us: AtomicU64,
}

impl Grant {
    pub(crate) fn give(&self, now: Duration) {
        let until = now + Duration::from_millis(JOG_GRANT_MS);
        self.until_us.store(micros(until), Ordering::SeqCst);
    }

    pub(crate) fn revoke(&self) {
        self.until_us.store(0, Ordering::SeqCst);
    }

    /// The order for a move that needs permission, at `now`.
    pub(crate) fn order(&self, now: Duration) -> Order {
        let until = self.until_us.load(Ordering::SeqCst);
        let now = micros(now);
        match now {
            _ if until == 0 => Order::Stop,
            now if now < until => Order::Go,
            now if now < until + micros(WAITS) => Order::Hold,
            _ => Order::Stop,
        }
    }
}

fn micros(time: Duration) -> u64 {
    u64::try_from(time.as_micros()).unwrap_or(u64::MAX / 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticket_is_valid_until_control_changes_or_stop() {
        let tickets = Tickets::default();
        let code = |ticket| tickets.check(ticket).err().map(|why| why.code);
        let first = tickets.now();
        assert_eq!(code(first), None);
        tickets.stopped();
        assert_eq!(code(first).as_deref(), Some("socket.stopped_meanwhile"));
        let second = tickets.now();
        assert_eq!(code(second), None);
        tickets.control_changed();
        assert_eq!(code(second).as_deref(), Some("control.needed"));
    }

    #[test]
    fn grant_lasts_150_ms_then_holds_then_stops() {
        let grant = Grant::default();
        let at = Duration::from_millis;
        assert_eq!(grant.order(at(0)), Order::Stop, "nobody granted anything");
        grant.give(at(10));
        assert_eq!((grant.order(at(10)), grant.order(at(159))), (Order::Go, Order::Go));
        assert_eq!((grant.order(at(160)), grant.order(at(1_159))), (Order::Hold, Order::Hold));
        grant.give(at(1_100));
        assert_eq!((grant.order(at(1_249)), grant.order(at(1_250))), (Order::Go, Order::Hold));
        assert_eq!(grant.order(at(2_250)), Order::Stop, "never more than 150 ms for one of them");
        grant.give(at(3_000));
        grant.revoke();
        assert_eq!(grant.order(at(3_001)), Order::Stop);
    }
}
