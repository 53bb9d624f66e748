//! One two-phase stepper motor: its rotor follows the field of its windings while it can.
//!
//! ```text
//! rate │        ______ 10 % above its limit it only shakes, until the steps are slow enough for a start
//!      │      /‾‾‾‾‾‾‾ a little above its limit it loses an electrical cycle now and then, and keeps turning
//!      │    /  change of rate between two steps: limited by torque in that time, plus elasticity
//!      └──────────▶ time      the faster it turns, the less torque is left
//!
//! field   1 ──▶ 3 ──▶ 5 ──▶ 7 ──▶ 1      eighths of an electrical cycle, four full steps a cycle
//! rotor   1     3     3     3     3      missed two: the field is straight across, then nearer from behind …
//! pulled        +2    +2    ±4    −2     … so losses are always whole electrical cycles
//!
//! field   1 ──▶ 3 ──▶ 1 ──▶ 7            a step back returns the field: between the two steps the motor is
//!               ╰─────╯                  at rest, however fast they follow; the next step shows its rate
//! ```
//!
//! The field follows the actual phase bytes, so a wrong table or a broken wire has its real effect.

use crate::machine::PhaseTable;
use crate::machine::phases::{Commutator, angle, turn, turns};
use crate::steps::TICK_HZ;

/// Torque reserve of the motor over the machine's settings.
const RESERVE_FACTOR: f64 = 3.0;

/// Share of its rate by which a turning rotor may change at once.
const ELASTICITY_SHARE: f64 = 0.15;

/// Step rate that any stepper motor reaches at once from rest.
const PULL_IN_HZ: f64 = 300.0;

/// Steps lost per step above the limit rate, for each part of excess rate. At 1 step lost per step the motor
/// stalls.
const BEHIND_PER_SHARE: f64 = 10.0;

/// Real pull-out rate, relative to the limit. The margin covers pulses with jitter.
const PULL_OUT_FACTOR: f64 = 1.03;

/// Real pull-out rate, relative to the limit, if steps come by interrupts and are exact to the tick.
const PULL_OUT_BY_INTERRUPTS_FACTOR: f64 = 1.001;

/// Cause of lost steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The step rate is above the limit.
    TooFast,
    /// The step rate changed faster than the torque allows.
    TooSteep,
    Blocked,
    Held,
    /// The windings did not pull the rotor: wrong table or broken wire.
    NoPull,
    Fault,
}

impl Cause {
    /// Key in `page.slip`.
    pub fn name(self) -> &'static str {
        match self {
            Self::TooFast => "too_fast",
            Self::TooSteep => "too_steep",
            Self::Blocked => "blocked",
            Self::Held => "held",
            Self::NoPull => "no_pull",
            Self::Fault => "fault",
        }
    }
}

/// One step, as the motor meets it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Push {
    pub tick: u64,
    /// Direction in the phase table.
    pub forward: bool,
    /// The load blocks the rotor.
    pub held: bool,
    /// The load throws the rotor back by an electrical cycle.
    pub thrown: bool,
}

impl Push {
    /// A step without load.
    pub fn free(tick: u64, forward: bool) -> Self {
        Self { tick, forward, held: false, thrown: false }
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct Rotor {
    /// Real position, in steps.
    pub at: i64,
    pub sent: u64,
    pub lost: u64,
    driver: Commutator,
    /// Mask of the 5 V and 24 V bits that reach the motor.
    wires: u8,
    start: i64,
    /// Steps in a cycle of the table, and electrical cycles in it.
    cycle: (i64, i64),
    /// Rotor angle in eighths of an electrical cycle, and its start angle.
    angle: i64,
    zero: i64,
    /// Electrical cycles between rotor and steps.
    off: i64,
    stops: (i64, i64),
    fastest_hz: f64,
    /// Pull-out rate: above it the motor stalls or loses steps.
    pull_out_hz: f64,
    hz_per_s: f64,
    start_hz: f64,
    /// Current rate, signed.
    rate_hz: f64,
    last_tick: Option<u64>,
    last_forward: bool,
    behind: f64,
    /// Why the rotor doesn't follow the field, if so.
    stalled: Option<Cause>,
    /// Why rotor and field differ, since they last agreed.
    cause: Option<Cause>,
}

impl Rotor {
    /// At rest at `at`, between two hard stops. The motor follows up to `fastest_hz`, and the given
    /// acceleration with a reserve. Its rate may change at once by `corner_hz`, the greatest change that the
    /// machine allows in a corner.
    pub fn new(
        table: &PhaseTable,
        at: i64,
        stops: (i64, i64),
        fastest_hz: f64,
        (acceleration_hz_per_s, corner_hz): (f64, f64),
    ) -> Self {
        // Rate reached from rest within one step.
        let within_a_step = 2.0 * libm::sqrt(2.0 * acceleration_hz_per_s);
        let start_hz = within_a_step.max(corner_hz).max(PULL_IN_HZ).min(fastest_hz);
        let driver = Commutator::new(table.clone(), 0);
        let zero = angle(driver.byte()).map_or(0, i64::from);
        Self {
            at,
            sent: 0,
            lost: 0,
            wires: u8::MAX,
            start: at,
            cycle: (table.columns.len().max(1) as i64, turns(table)),
            driver,
            angle: zero,
            zero,
            off: 0,
            stops,
            fastest_hz,
            pull_out_hz: fastest_hz * PULL_OUT_FACTOR,
            hz_per_s: RESERVE_FACTOR * acceleration_hz_per_s,
            start_hz,
            rate_hz: 0.0,
            last_tick: None,
            last_forward: true,
            behind: 0.0,
            stalled: None,
            cause: None,
        }
    }

    /// Limits the phase bits that reach the motor: broken wires.
    #[must_use]
    pub fn wired(mut self, wires: u8) -> Self {
        self.wires = wires;
        self
    }

    /// For a motor driven by a table, interrupt by interrupt.
    #[must_use]
    pub fn by_interrupts(mut self) -> Self {
        self.pull_out_hz = self.fastest_hz * PULL_OUT_BY_INTERRUPTS_FACTOR;
        self
    }

    pub fn byte(&self) -> u8 {
        self.driver.byte()
    }

    /// Makes one step. Returns the steps lost by it and the cause, if any.
    pub fn step(&mut self, push: Push) -> Option<(u64, Cause)> {
        self.sent += 1;
        let field = angle(self.driver.step(push.forward) & self.wires);
        let follows = self.follows(push);
        let pull = field.map(|field| turn(self.angle, i64::from(field))).filter(|turn| turn.abs() < 4);
        let missed = match (follows, pull) {
            (Err(why), _) => Some(why),
            (Ok(()), None) => Some(Cause::NoPull),
            (Ok(()), Some(_)) if push.held => Some(Cause::Held),
            (Ok(()), Some(pull)) => self.turn_by(pull),
        };
        self.cause = self.cause.or(missed);
        let slips = self.slips();
        if push.thrown || slips {
            self.cause = Some(if push.thrown { Cause::Fault } else { Cause::TooFast });
            self.angle -= if push.forward { 8 } else { -8 };
        }
        let lost = self.settle();
        if missed.is_none() {
            self.cause = None;
        }
        lost
    }

    fn follows(&mut self, push: Push) -> Result<(), Cause> {
        let since = self.last_tick.replace(push.tick).map_or(TICK_HZ, |last| push.tick.saturating_sub(last));
        let time_s = since.max(1) as f64 / TICK_HZ as f64;
        let back = std::mem::replace(&mut self.last_forward, push.forward) != push.forward;
        let way = if push.forward { 1.0 } else { -1.0 };
        let asked = if back { 0.0 } else { way / time_s };
        let jump = (asked - self.rate_hz).abs();
        let rate = asked.abs() / self.pull_out_hz;
        // Back EMF grows with the rate: less current, less torque.
        let torque = (1.0 - rate * rate).max(0.0);
        let most = self.start_hz + self.hz_per_s * torque * time_s + ELASTICITY_SHARE * asked.abs();
        let missing = BEHIND_PER_SHARE * (rate - 1.0);
        self.behind = if missing > 0.0 { self.behind + missing } else { 0.0 };
        self.stalled = match self.stalled {
            Some(_) if asked.abs() <= self.start_hz => None,
            None if missing >= 1.0 => Some(Cause::TooFast),
            None if jump > most => Some(Cause::TooSteep),
            other => other,
        };
        self.rate_hz = if self.stalled.is_none() { asked } else { 0.0 };
        self.stalled.map_or(Ok(()), Err)
    }

    /// True if the rotor lags enough that the field pulls it on only from the next electrical cycle.
    fn slips(&mut self) -> bool {
        let (length, turns) = self.cycle;
        let turn = length as f64 / turns.max(1) as f64;
        let slips = self.stalled.is_none() && self.behind >= turn;
        if slips {
            self.behind -= turn;
        }
        slips
    }

    /// Turns the rotor, or returns the obstacle.
    fn turn_by(&mut self, eighths: i64) -> Option<Cause> {
        let turned = self.angle + eighths;
        let at = self.place(self.turns_off(turned));
        if (self.stops.0..=self.stops.1).contains(&at) {
            self.angle = turned;
            None
        } else {
            Some(Cause::Blocked)
        }
    }

    /// Electrical cycles between a rotor at `angle` and its steps, rounded.
    fn turns_off(&self, angle: i64) -> i64 {
        let (length, turns) = self.cycle;
        let eighths = (angle - self.zero) * length - 8 * turns * self.driver.steps();
        (2 * eighths + 8 * length).div_euclid(16 * length)
    }

    fn place(&self, off: i64) -> i64 {
        let (length, turns) = self.cycle;
        self.start + self.driver.steps() + off * length / turns
    }

    /// Updates the position and returns the losses of this step.
    fn settle(&mut self) -> Option<(u64, Cause)> {
        let (length, turns) = self.cycle;
        let off = self.turns_off(self.angle);
        let lost = (off - self.off).unsigned_abs() * length as u64 / turns as u64;
        self.off = off;
        self.at = self.place(off).clamp(self.stops.0, self.stops.1);
        self.lost += lost;
        (lost > 0).then_some((lost, self.cause.unwrap_or(Cause::NoPull)))
    }
}
