//! Decides whether a page's request is still valid: it carries the state of control and the number of STOPs
//! when it was sent.
//!
//! ```text
//! page ── jog ──▶ ticket 7 ── queue ──▶ owner: still 7? ── yes ──▶ moves
//!   └── gone ──▶ control changed: 8 ───────┘ no: refused, nothing moves
//! ```
//!
//! Changes of control and STOPs go through the owner's own queue. So a request is either refused, or the
//! message after it stops what it started: there is no gap.

use annulus_core::diagnostic::Diagnostic;
use std::sync::atomic::{AtomicU64, Ordering};

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
    /// A ticket for a request sent now.
    pub fn now(&self) -> Ticket {
        Ticket { control: self.control.load(Ordering::SeqCst), stops: self.stops.load(Ordering::SeqCst) }
    }

    pub fn control_changed(&self) {
        self.control.fetch_add(1, Ordering::SeqCst);
    }

    pub fn stopped(&self) {
        self.stops.fetch_add(1, Ordering::SeqCst);
    }

    /// Checks that a request with `ticket` is still valid.
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
}
