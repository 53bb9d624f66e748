//! One stepping motor: it follows while the pulses change evenly enough, and stalls when they do not.
//!
//! ```text
//! rate │        ______ fastest: beyond it the rotor stands still …
//!      │      /        … and stays so until the pulses come slowly enough to start from rest
//!      │    /  jump between two pulses: at most what the motor's torque gives in that time, and its elasticity
//!      └──────────▶ time
//! ```
//!
//! Comes in: pulses with their ticks. Goes out: where the rotor really is. Does not know what it drives.

use crate::steps::TICK_HZ;

/// How much more torque a motor has than the machine's owner asks of it.
const RESERVE: f64 = 3.0;

/// Share of its rate that a turning rotor takes as a jump.
const ELASTICITY: f64 = 0.15;

/// A stepping motor.
#[derive(Clone, Debug)]
pub struct Rotor {
    /// Where it really is, in steps.
    pub at: i64,
    /// Pulses that it was sent.
    pub sent: u64,
    /// Pulses that it did not follow.
    pub lost: u64,
    stops: (i64, i64),
    fastest_hz: f64,
    hz_per_s: f64,
    start_hz: f64,
    /// Rate it turns at, signed.
    rate_hz: f64,
    last_tick: Option<u64>,
    stalled: bool,
}

impl Rotor {
    /// At rest at `at`, between two hard stops. It follows up to `fastest_hz`, and the acceleration that is asked for with
    /// a reserve.
    pub fn new(at: i64, stops: (i64, i64), fastest_hz: f64, acceleration_hz_per_s: f64) -> Self {
        // From rest, the rate reached within the width of one step.
        let start_hz = (2.0 * libm::sqrt(2.0 * acceleration_hz_per_s)).min(fastest_hz);
        let hz_per_s = RESERVE * acceleration_hz_per_s;
        Self {
            at,
            sent: 0,
            lost: 0,
            stops,
            fastest_hz,
            hz_per_s,
            start_hz,
            rate_hz: 0.0,
            last_tick: None,
            stalled: false,
        }
    }

    /// One pulse. `held` is a pulse that something outside keeps it from following.
    pub fn step(&mut self, tick: u64, forward: bool, held: bool) {
        self.sent += 1;
        let since = self.last_tick.replace(tick).map_or(TICK_HZ, |last| (tick - last.min(tick)).max(1));
        let time_s = since as f64 / TICK_HZ as f64;
        let sign = if forward { 1.0 } else { -1.0 };
        let asked = sign / time_s;
        let jump = (asked - self.rate_hz).abs();
        let follows = if self.stalled {
            asked.abs() <= self.start_hz
        } else {
            asked.abs() <= self.fastest_hz * 1.03
                && jump <= self.start_hz + self.hz_per_s * time_s + ELASTICITY * asked.abs()
        };
        self.stalled = !follows;
        let next = self.at + if forward { 1 } else { -1 };
        let free = (self.stops.0..=self.stops.1).contains(&next);
        if follows && free && !held {
            self.at = next;
            self.rate_hz = asked;
        } else {
            self.lost += 1;
            self.rate_hz = if follows && free { asked } else { 0.0 };
        }
    }
}
