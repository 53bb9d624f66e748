//! One driver that counts steps by itself: its STEP and its DIR, and when each may change.
//!
//! ```text
//! tick    t−setup      t        t+length          t+length+hold
//! STEP ────────────────┌────────┐──────────────────────────────
//! DIR  ─┐               │        │                  ┌─────────── announced by `ahead`, changed as soon as hold is over
//!       └───────────────────────────────────────────┘
//! ```
//!
//! Edges go by stream ticks, so that they can be compared with the stream. A computer may be held up between two of them: so the
//! times are kept by life as well ([`Spent`]), counted from when the edge before was really out; what comes too soon then waits.
//!
//! Comes in: steps and what comes next. Goes out: levels, when the next edge is due. Does not know bytes.

use super::bytes::Bit;
use annulus_core::machine::StepDir;
use annulus_core::steps::TICK_HZ;
use std::time::Duration;

/// Nanoseconds in a tick.
const TICK_NS: u64 = 1_000_000_000 / TICK_HZ;

/// A time that an edge takes, as ticks of the stream and as time of life.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Span {
    ticks: u64,
    life: Duration,
}

impl Span {
    fn of(times_ns: &[u32], axis: usize) -> Self {
        let ns = times_ns.get(axis).copied().map_or(0, u64::from);
        Self { ticks: ns.div_ceil(TICK_NS), life: Duration::from_nanos(ns) }
    }
}

/// What has to be over, by life, before the next edge may go out; the moments are those when the edges before were out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Spent {
    turned: Duration,
    on: Duration,
    off: Duration,
}

/// A driver.
#[derive(Clone, Debug)]
pub(super) struct Driver {
    step: Bit,
    direction: Option<Bit>,
    length: Span,
    space: Span,
    setup: Span,
    hold: Span,
    /// STEP is on, since this tick.
    is_on: bool,
    stepped_at: Option<u64>,
    forward: bool,
    /// The way of the next step, as far as it is known.
    next: Option<bool>,
    spent: Spent,
}

impl Driver {
    /// That of `axis`, where there is one; counting down, and off.
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

    /// The bits that are on.
    pub(super) fn levels(&self) -> impl Iterator<Item = Bit> {
        let direction = self.direction.filter(|_| self.forward);
        self.is_on.then_some(self.step).into_iter().chain(direction)
    }

    /// Its next step goes this way.
    pub(super) fn announce(&mut self, forward: bool) {
        self.next = Some(forward);
    }

    /// When its next edge may come by itself: the end of STEP, then DIR.
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

    /// The edge that is due at `tick` at the latest, if any: what it is, and until when, by life, it has to wait.
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

    /// What has to come before a step `forward`, one after the other, until it is [`Edge::On`].
    pub(super) fn before_step(&mut self, forward: bool) -> (Edge, Duration) {
        self.announce(forward);
        if self.is_on {
            return self.end();
        }
        if self.turns() {
            return self.turn();
        }
        (Edge::On, (self.spent.turned + self.setup.life).max(self.spent.off + self.space.life))
    }

    /// The end of STEP, where it is on.
    pub(super) fn ends(&self) -> Option<(Edge, Duration)> {
        self.is_on.then(|| self.end())
    }

    /// Makes `edge` at stream tick `tick`.
    pub(super) fn make(&mut self, edge: Edge, tick: u64) {
        match edge {
            Edge::On => (self.is_on, self.stepped_at) = (true, Some(tick)),
            Edge::Off => self.is_on = false,
            Edge::Turn => self.forward = !self.forward,
        }
    }

    /// `edge` was out at `now`, by life.
    pub(super) fn is_out(&mut self, edge: Edge, now: Duration) {
        match edge {
            Edge::On => self.spent.on = now,
            Edge::Off => self.spent.off = now,
            Edge::Turn => self.spent.turned = now,
        }
    }
}

/// A change of one signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Edge {
    /// STEP on: the motor steps.
    On,
    /// STEP off.
    Off,
    /// DIR the other way.
    Turn,
}
