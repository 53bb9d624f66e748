//! One two-phase stepping motor: its rotor follows the field of its windings while it can.
//!
//! ```text
//! rate │        ______ a tenth above its limit it only shakes, until the steps come slowly enough to start from rest
//!      │      /‾‾‾‾‾‾‾ a little above its limit it loses a turn of the current now and then, and runs on
//!      │    /  jump between two steps: at most what the motor's torque gives in that time, and its elasticity
//!      └──────────▶ time      the faster it turns, the less torque is left
//!
//! field   1 ──▶ 3 ──▶ 5 ──▶ 7 ──▶ 1      eighths of a turn of the current, four full steps a turn
//! rotor   1     3     3     3     3      it missed two: the field is straight across, then nearer from behind …
//! pulled        +2    +2    ±4    −2     … so what is lost is lost by whole turns of the current
//!
//! field   1 ──▶ 3 ──▶ 1 ──▶ 7            a step back brings the field to where it was: between the two the motor stands, however
//!               ╰─────╯                  soon the one follows the other; how fast it turns shows with the next
//! ```
//!
//! Comes in: steps with their ticks. Goes out: where the rotor really is, in steps, and what it lost. The field is that of the
//! bytes really put out, so a wrong table or a broken wire shows. Does not know what it drives.

use crate::machine::PhaseTable;
use crate::machine::phases::{Commutator, angle, turn, turns};
use crate::steps::TICK_HZ;

/// How much more torque a motor has than the machine's owner asks of it.
const RESERVE_FACTOR: f64 = 3.0;

/// Share of its rate that a turning rotor takes as a jump.
const ELASTICITY_SHARE: f64 = 0.15;

/// Steps a second that any stepping motor makes at once from rest.
const PULL_IN_HZ: f64 = 300.0;

/// What a motor falls behind by above its limit, in steps a step for each part of its rate that is too much: it stalls where
/// it would fall behind by all of them.
const BEHIND_PER_SHARE: f64 = 10.0;

/// How far above its limit a motor is really pulled out, where pulses may come some time beside their time.
const PULL_OUT_FACTOR: f64 = 1.03;

/// The same where steps come by interrupts, which are exact but for a whole number of ticks.
const PULL_OUT_BY_INTERRUPTS_FACTOR: f64 = 1.001;

/// Why a rotor fell behind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The steps came faster than it can turn.
    TooFast,
    /// The steps' rate changed more than its torque allows.
    TooSteep,
    /// It stood at a hard stop.
    Blocked,
    /// Something held it: a dull bit in the board.
    Held,
    /// The windings did not pull it on: a wrong table, a broken wire.
    NoPull,
    /// A fault that was asked for.
    Fault,
}

impl Cause {
    /// Its word in tables: a key of `page.slip`.
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

/// One step as the motor meets it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Push {
    /// When.
    pub tick: u64,
    /// Whether the table goes forward.
    pub forward: bool,
    /// Something keeps the rotor where it is.
    pub held: bool,
    /// The load throws it back by a turn of the current.
    pub thrown: bool,
}

impl Push {
    /// Nothing in the way.
    pub fn free(tick: u64, forward: bool) -> Self {
        Self { tick, forward, held: false, thrown: false }
    }
}

/// A stepping motor.
#[derive(Clone, Debug, PartialEq)]
pub struct Rotor {
    /// Where it really is, in steps.
    pub at: i64,
    /// Steps that it was sent.
    pub sent: u64,
    /// Steps that it fell behind, all together.
    pub lost: u64,
    driver: Commutator,
    /// 5 V and 24 V bits that reach the motor.
    wires: u8,
    start: i64,
    /// Steps in a cycle of the table, and turns of the current in it.
    cycle: (i64, i64),
    /// Its angle in eighths of a turn of the current, and the angle it began at.
    angle: i64,
    zero: i64,
    /// Turns of the current that it is off its steps.
    off: i64,
    stops: (i64, i64),
    fastest_hz: f64,
    /// Beyond this rate it is pulled out.
    pull_out_hz: f64,
    hz_per_s: f64,
    start_hz: f64,
    /// Rate it turns at, signed.
    rate_hz: f64,
    last_tick: Option<u64>,
    /// Whether the last step went forward.
    last_forward: bool,
    /// What it is behind by above its limit, in steps.
    behind: f64,
    /// Why it does not follow the field, if it does not.
    stalled: Option<Cause>,
    /// Why it does not point where the field does, since it last did.
    cause: Option<Cause>,
}

impl Rotor {
    /// At rest at `at`, between two hard stops. It follows up to `fastest_hz`, and the acceleration that is asked for with
    /// a reserve; and a jump by `corner_hz`, which is what its machine gives way to in a corner.
    pub fn new(
        table: &PhaseTable,
        at: i64,
        stops: (i64, i64),
        fastest_hz: f64,
        (acceleration_hz_per_s, corner_hz): (f64, f64),
    ) -> Self {
        // From rest, the rate reached within the width of one step.
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

    /// The same motor with broken wires: only these bits reach it.
    #[must_use]
    pub fn wired(mut self, wires: u8) -> Self {
        self.wires = wires;
        self
    }

    /// The same motor where a table makes its steps, interrupt by interrupt.
    #[must_use]
    pub fn by_interrupts(mut self) -> Self {
        self.pull_out_hz = self.fastest_hz * PULL_OUT_BY_INTERRUPTS_FACTOR;
        self
    }

    /// What its driver puts out.
    pub fn byte(&self) -> u8 {
        self.driver.byte()
    }

    /// One step. Gives what was lost by it, if anything, and why.
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

    /// Whether the rotor keeps up with a step at this moment.
    fn follows(&mut self, push: Push) -> Result<(), Cause> {
        let since = self.last_tick.replace(push.tick).map_or(TICK_HZ, |last| push.tick.saturating_sub(last));
        let time_s = since.max(1) as f64 / TICK_HZ as f64;
        let back = std::mem::replace(&mut self.last_forward, push.forward) != push.forward;
        let way = if push.forward { 1.0 } else { -1.0 };
        let asked = if back { 0.0 } else { way / time_s };
        let jump = (asked - self.rate_hz).abs();
        let rate = asked.abs() / self.pull_out_hz;
        // The back voltage grows with the rate: less current, less torque.
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

    /// Whether it is so far behind that the field pulls it on only from the next turn of the current.
    fn slips(&mut self) -> bool {
        let (length, turns) = self.cycle;
        let turn = length as f64 / turns.max(1) as f64;
        let slips = self.stalled.is_none() && self.behind >= turn;
        if slips {
            self.behind -= turn;
        }
        slips
    }

    /// Turns, or says what is in the way.
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

    /// How many turns of the current a rotor at `angle` is off its steps, to the nearest.
    fn turns_off(&self, angle: i64) -> i64 {
        let (length, turns) = self.cycle;
        let eighths = (angle - self.zero) * length - 8 * turns * self.driver.steps();
        (2 * eighths + 8 * length).div_euclid(16 * length)
    }

    fn place(&self, off: i64) -> i64 {
        let (length, turns) = self.cycle;
        self.start + self.driver.steps() + off * length / turns
    }

    /// Works out where it is, and what the step cost.
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
