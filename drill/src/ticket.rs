//! What an ask from a page is good for: the control it was asked under, and the last STOP before it.
//!
//! ```text
//! page ── jog ──▶ ticket 7 ── queue ──▶ owner: still 7? ── yes ──▶ moves
//!   └── gone ──▶ control changed: 8 ───────┘ no: refused, nothing moves
//! ```
//!
//! The owner compares, and hears of every change of control and of every STOP in the same queue. So an ask is either refused,
//! or what it set in motion is stopped by what comes behind it: there is no moment in between. Comes in: changes. Goes out:
//! tickets, refusals. Does not know pages.

use annulus_core::diagnostic::Diagnostic;
use std::sync::atomic::{AtomicU64, Ordering};

/// How often control changed hands and how often somebody pressed STOP.
#[derive(Debug, Default)]
pub struct Tickets {
    control: AtomicU64,
    stops: AtomicU64,
}

/// What was so when something was asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ticket {
    control: u64,
    stops: u64,
}

impl Tickets {
    /// For what is asked now.
    pub fn now(&self) -> Ticket {
        Ticket { control: self.control.load(Ordering::SeqCst), stops: self.stops.load(Ordering::SeqCst) }
    }

    /// Control changed hands.
    pub fn control_changed(&self) {
        self.control.fetch_add(1, Ordering::SeqCst);
    }

    /// Somebody pressed STOP.
    pub fn stopped(&self) {
        self.stops.fetch_add(1, Ordering::SeqCst);
    }

    /// Whether what was asked with `ticket` may still be done.
    pub fn check(&self, ticket: Ticket) -> Result<(), Diagnostic> {
        let now = self.now();
        let code = match ticket {
            _ if ticket.control != now.control => "control.needed",
            _ if ticket.stops != now.stops => "socket.stopped_meanwhile",
            _ => return Ok(()),
        };
        Err(Diagnostic::error(code))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ticket_is_good_until_control_changes_or_somebody_stops() {
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
}
