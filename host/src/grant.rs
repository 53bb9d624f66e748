//! The dead man's switch of a jog: it moves only while the page keeps renewing its permission.
//!
//! ```text
//! Jog      JogOn    JogOn                        no more
//!  ├─ 150 ms ─┼─ 150 ms ─┼─ 150 ms ─┤ holds ─ 1 s ─▶ ends
//!                                    └─ JogOn: continues
//! ```

use annulus_core::pins::Order;
use annulus_core::wire::JOG_GRANT_MS;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// How long a jog holds for the next renewal before it ends.
const WAITS: Duration = Duration::from_secs(1);

/// End of the permission; an atomic, because the executor reads it between two steps and must not block.
#[derive(Debug, Default)]
pub(crate) struct Grant {
    /// Microseconds of the caller's clock; 0 is withdrawn.
    until_us: AtomicU64,
}

impl Grant {
    /// Permits moves for [`JOG_GRANT_MS`] from `now`.
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
