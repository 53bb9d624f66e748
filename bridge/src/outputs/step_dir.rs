//! One step/direction driver: its STEP and DIR signals, and when each may change.
//!
//! ```text
//! tick    t−setup      t        t+length          t+length+hold
//! STEP ────────────────┌────────┐──────────────────────────────
//! DIR  ─┐               │        │                  ┌─────────── announced by `ahead`, changed when hold is over
//!       └───────────────────────────────────────────┘
//! ```
//!
//! Edges follow stream ticks, so that they can be compared with the stream. A delayed computer could bring
//! two edges too close. Real times are therefore recorded too ([`Spent`]): an edge keeps its distance from
//! the time at which the previous one was really written.

use super::bytes::Bit;
use annulus_core::machine::StepDir;
use annulus_core::steps::TICK_HZ;
use std::time::Duration;

const TICK_NS: u64 = 1_000_000_000 / TICK_HZ;

/// A duration in stream ticks and in real time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Span {
    ticks: u64,
    life: Duration,
}

impl Span {
    fn of(times_ns: &[u32], axis: usize) -> Self {
        let ns = times_ns.get(axis).copied().map_or(0, u64::from);
        // Rounded up: a driver may miss a pulse that is too short.
        Self { ticks: ns.div_ceil(TICK_NS), life: Duration::from_nanos(ns) }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Spent {
    turned: Duration,
    on: Duration,
    off: Duration,
}

#[derive(Clone, Debug)]
pub(super) struct Driver {
    step: Bit,
    direction: Option<Bit>,
    length: Span,
    space: Span,
    setup: Span,
    hold: Span,
    is_on: bool,
    stepped_at: Option<u64>,
    forward: bool,
    /// Direction of the next step, if known.
    next: Option<bool>,
    spent: Spent,
}

impl Driver {
    /// The driver of `axis`, if there is one; counting down, and off.
    pub(super) fn of(drivers: &StepDir, axis: usize) -> Option<Self> {
        Some(Self {
            step: Bit::of(*drivers.steps.get(axis)?)?,
            direction: drivers.directions.get(axis).and_then(|bit| Bit::of(*bit)),
            length: Span::of(&drivers.length_ns, axis),
            space: Span::of(&drivers.space_ns, axis),
            setup: Span::of(&drivers.setup_ns, axis),
            hold: Span::of(&drivers.hold_ns, axis),
            is_on: false,
            stepped_at: None,
            forward: false,
            next: None,
            spent: Spent::default(),
        })
    }

    pub(super) fn levels(&self) -> impl Iterator<Item = Bit> {
        let direction = self.direction.filter(|_| self.forward);
        self.is_on.then_some(self.step).into_iter().chain(direction)
    }

    pub(super) fn announce(&mut self, forward: bool) {
        self.next = Some(forward);
    }

    /// When its next automatic edge is due: the end of STEP, then DIR.
    pub(super) fn due(&self) -> Option<u64> {
        let end = self.stepped_at.map(|tick| tick.saturating_add(self.length.ticks));
        if self.is_on {
            return end;
        }
        self.turns().then(|| end.map_or(0, |end| end.saturating_add(self.hold.ticks)))
    }

    fn turns(&self) -> bool {
        self.next.is_some_and(|next| next != self.forward)
    }

    /// The edge due by `tick`, if any, and the real time before which it must not go out.
    pub(super) fn edge(&self, tick: u64) -> Option<(Edge, Duration)> {
        let due = self.due().filter(|due| *due <= tick);
        due.map(|_| if self.is_on { self.end() } else { self.turn() })
    }

    fn end(&self) -> (Edge, Duration) {
        (Edge::Off, self.spent.on + self.length.life)
    }

    fn turn(&self) -> (Edge, Duration) {
        (Edge::Turn, self.spent.off + self.hold.life)
    }

    /// The next edge towards a step in the direction `forward`; call it until it returns [`Edge::On`].
    pub(super) fn before_step(&mut self, forward: bool) -> (Edge, Duration) {
        self.announce(forward);
        if self.is_on {
            return self.end();
        }
        if self.turns() {
            return self.turn();
        }
        // The driver needs both: DIR stable before the edge, and STEP off long enough since the last one.
        (Edge::On, (self.spent.turned + self.setup.life).max(self.spent.off + self.space.life))
    }

    /// The end of STEP, if it is on.
    pub(super) fn ends(&self) -> Option<(Edge, Duration)> {
        self.is_on.then(|| self.end())
    }

    pub(super) fn make(&mut self, edge: Edge, tick: u64) {
        match edge {
            Edge::On => (self.is_on, self.stepped_at) = (true, Some(tick)),
            Edge::Off => self.is_on = false,
            Edge::Turn => self.forward = !self.forward,
        }
    }

    pub(super) fn is_out(&mut self, edge: Edge, now: Duration) {
        match edge {
            Edge::On => self.spent.on = now,
            Edge::Off => self.spent.off = now,
            Edge::Turn => self.spent.turned = now,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Edge {
    On,
    Off,
    Turn,
}
