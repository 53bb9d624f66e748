//! The dead man's grant: a move by hand goes only while somebody says again and again that it may.
//!
//! ```text
//! Jog      JogOn    JogOn                        no more
//!  ├─ 150 ms ─┼─ 150 ms ─┼─ 150 ms ─┤ rests where it is ─ 1 s ─▶ it is over
//!                                    └─ JogOn: goes on
//! ```
//!
//! Comes in: grants, and the time of any clock that only goes forward. Goes out: whether it may go. Does not know who grants.

use annulus_core::pins::Order;
use annulus_core::wire::JOG_GRANT_MS;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// How long a move rests on its way for the next grant before it is over.
const WAITS: Duration = Duration::from_secs(1);

/// Until when it may go; read between two steps, so nobody waits for it.
#[derive(Debug, Default)]
pub(crate) struct Grant {
    /// Microseconds of that clock; 0 is revoked.
    until_us: AtomicU64,
}

impl Grant {
    /// It may go for [`JOG_GRANT_MS`] from `now` on.
    pub(crate) fn give(&self, now: Duration) {
        let until = now + Duration::from_millis(JOG_GRANT_MS);
        self.until_us.store(micros(until), Ordering::SeqCst);
    }

    /// It is over.
    pub(crate) fn revoke(&self) {
        self.until_us.store(0, Ordering::SeqCst);
    }

    /// What a move that needs it is to do at `now`.
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
    fn it_goes_while_it_is_granted_rests_a_while_and_is_over() {
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
