//! A clock and an operator for segments that are played in tests.

use annulus_core::machine::Steps;
use annulus_core::pins::{Clock, Operator, Order};

/// A clock that is never late.
pub(crate) struct OnTime(pub(crate) u64);

impl Clock for OnTime {
    fn now(&mut self) -> u64 {
        self.0
    }
    fn wait_until(&mut self, tick: u64) -> u64 {
        self.0 = self.0.max(tick);
        self.0
    }
}

/// One order from a tick on, another from a later tick on; then the current tick.
pub(crate) struct Orders(pub(crate) [(u64, Order); 2], pub(crate) u64);

impl Operator for Orders {
    fn order(&mut self) -> Order {
        self.0.iter().rev().find(|(from, _)| *from <= self.1).map_or(Order::Go, |(_, order)| *order)
    }
    fn passed(&mut self, tick: u64, _: &Steps, _: u32) {
        self.1 = tick;
    }
}
