//! Feed override: stretches stream time. The path stays as planned; only its timing changes.
//!
//! ```text
//! rate r    1 ‾‾‾‾‾‾‾\                 /‾‾‾‾‾      r² falls and rises in a straight line over stream
//!                     '.             .'            time, as steeply as the axis with the least room
//!           0           '.____rest__.'             allows
//!                 Hold         Go
//! ```
//!
//! At rate r, an axis with planned speed v and acceleration a has speed r·v and acceleration r²·a + r′·v. To
//! stay within its limit A, r′ must stay between −(A + r²·a)/v and (A − r²·a)/v (bridge protocol, §4). If the
//! plan brakes with all of A, no room is left and none is needed: the plan itself comes to rest.
//!
//! v and a are estimated from the next pulses.

use crate::steps::{AXES, Replay};

/// Share of an axis' acceleration that the feed override uses, because estimates from pulses lag the plan a
/// little.
const SHARE: f64 = 0.9;

/// Steps of each set that the estimate reads ahead: enough that the 1 µm error of fitting does not matter.
const AHEAD: usize = 8;

/// One set of moving axes: planned speed in steps per tick, planned acceleration in steps per tick² (positive
/// if it speeds up), and braking limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rate {
    speed: f64,
    acceleration: f64,
    limit: f64,
}

/// The sets of axes that move after `later`, each with the limit of its weakest axis. Speeds are averages
/// over the next steps in one direction.
pub(super) fn rates(later: &Replay<'_>, limits: &[f64; AXES]) -> Vec<Rate> {
    let mut sets: Vec<(u8, bool, bool, Vec<u64>)> =
        later.sets().map(|(axes, forward, tick)| (axes, forward, true, vec![tick])).collect();
    for pulse in later.clone().take(AHEAD * sets.len()) {
        for (axes, forward, same, ticks) in &mut sets {
            if pulse.axes & *axes != 0 {
                *same &= (pulse.forward & *axes != 0) == *forward;
                if *same && ticks.last().is_none_or(|last| *last < pulse.tick) {
                    ticks.push(pulse.tick);
                }
            }
        }
    }
    let limit = |axes: u8| {
        let own = (0..AXES).filter(|axis| axes >> axis & 1 == 1).map(|axis| limits[axis]);
        SHARE * own.fold(f64::INFINITY, f64::min)
    };
    sets.into_iter().filter_map(|(axes, _, _, ticks)| rate(&ticks, limit(axes))).collect()
}

fn rate(ticks: &[u64], limit: f64) -> Option<Rate> {
    // A single tick gives no speed, so it limits nothing.
    let [first, .., last] = ticks else { return None };
    let middle = ticks.get(ticks.len() / 2)?;
    let mean = |from: u64, to: u64, steps: usize| steps as f64 / (to - from).max(1) as f64;
    let half = ticks.len() / 2;
    let (now, then) = (mean(*first, *middle, half), mean(*middle, *last, ticks.len() - 1 - half));
    let between = 0.5 * (last - first) as f64;
    let acceleration = if ticks.len() > 2 { (then - now) / between } else { 0.0 };
    Some(Rate { speed: now, acceleration, limit })
}

/// Clock of one segment: converts stream ticks to stretched ticks.
#[derive(Clone, Debug)]
pub(super) struct FeedOverride {
    /// Square of the current rate, 0 … 1.
    square: f64,
    wanted: f64,
    /// Stream tick and stretched tick at which `stretch` starts to apply.
    base: (u64, f64),
    stretch: f64,
}

impl FeedOverride {
    /// Full rate from stretched tick `start`, which is stream tick 0.
    pub(super) fn new(start: u64) -> Self {
        Self { square: 1.0, wanted: 1.0, base: (0, start as f64), stretch: 1.0 }
    }

    pub(super) fn rested(stream_tick: u64, now: u64) -> Self {
        Self { square: 0.0, wanted: 0.0, base: (stream_tick, now as f64), stretch: 1.0 }
    }

    pub(super) fn at(&self, stream_tick: u64) -> u64 {
        let since = stream_tick - self.base.0.min(stream_tick);
        if self.stretch == 1.0 {
            self.base.1 as u64 + since
        } else {
            (self.base.1 + since as f64 * self.stretch) as u64
        }
    }

    /// The stream tick at stretched tick `at`; constant while time is stopped.
    pub(super) fn passed(&self, at: u64) -> u64 {
        self.base.0 + ((at as f64 - self.base.1).max(0.0) / self.stretch) as u64
    }

    /// True if time passes as planned and no other rate is requested.
    pub(super) fn is_full(&self) -> bool {
        self.square == 1.0 && self.wanted == 1.0 && self.stretch == 1.0
    }

    pub(super) fn at_rest(&self) -> bool {
        self.square == 0.0
    }

    pub(super) fn want(&mut self, rate_share: f64) {
        // Squares: at constant braking they change linearly over the distance.
        self.wanted = rate_share * rate_share;
    }

    /// Sets the stretch between the pulse at `stream_tick` and the next one, planned `interval` ticks later,
    /// while `rates` move.
    pub(super) fn next(&mut self, stream_tick: u64, interval: Option<u64>, rates: &[Rate]) {
        self.base = (stream_tick, self.at(stream_tick) as f64);
        self.stretch = 1.0;
        // No pulse follows, so no axis moves until the segment ends.
        let Some(interval) = interval else { return };
        if self.is_full() {
            return;
        }
        let falls = self.wanted < self.square;
        let slope = if self.wanted == self.square { 0.0 } else { self.slope(falls, rates) };
        let planned = interval.max(1) as f64;
        let before = self.square;
        let reached = if falls {
            (before - 2.0 * slope * planned).max(self.wanted)
        } else {
            (before + 2.0 * slope * planned).min(self.wanted)
        };
        // At rest and no motion requested.
        if before == 0.0 && reached == 0.0 {
            return;
        }
        if falls && self.wanted == 0.0 && reached <= 0.0 {
            // Time stops before the next pulse, so the braking time is added here.
            self.base.1 += libm::ceil(libm::sqrt(before) / slope.max(1e-12));
            self.square = 0.0;
            return;
        }
        // The mean rate between two steps is the mean of the rates at both.
        self.stretch = (2.0 / (libm::sqrt(before) + libm::sqrt(reached))).max(1.0);
        self.square = reached;
    }

    /// True if braking from here ends within `interval` planned ticks, while `rates` move.
    pub(super) fn rests_within(&self, interval: u64, rates: &[Rate]) -> bool {
        self.square <= 2.0 * self.slope(true, rates) * interval.max(1) as f64
    }

    /// Greatest |r′|, the change of the rate per tick.
    fn slope(&self, falls: bool, rates: &[Rate]) -> f64 {
        let room = |rate: &Rate| {
            let planned = self.square * rate.acceleration;
            let own = if falls { rate.limit + planned } else { rate.limit - planned };
            own.clamp(0.0, 2.0 * rate.limit) / rate.speed
        };
        rates.iter().map(room).fold(1.0, f64::min)
    }

    /// Stops time for `ticks`: everything after is delayed by that much.
    pub(super) fn wait(&mut self, ticks: u64) {
        self.base.1 += ticks as f64;
    }
}
