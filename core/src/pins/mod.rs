//! The interface to the hardware: two small traits with laws, and the executor that uses them.
//!
//! Laws of [`Pins`]
//! 1. `step` moves each axis in `axes` by exactly one step, in the given direction; nothing else moves.
//! 2. `at_tick` never decreases from call to call. At that stream time the call happens: an implementation
//!    that models motion uses it as its clock; one that drives wires has already waited for it.
//! 3. `inputs` reports the inputs as they are at `at_tick`, one bit each ([`crate::job::Input::bit`]).
//! 4. `safe` turns the spindle off, removes the forcing voltage, and switches off the outputs that `output`
//!    switched. It may be called at any time, repeatedly, and never fails.
//! 5. `rest` reports that all axes are at rest and may stay so. Supplies that only a moving motor needs may
//!    be switched off.
//! 6. `due` is the tick at which `attend` must be called even if nothing steps; none if nothing is pending.
//!    After `attend` at a due tick, nothing is due at that tick or before it.
//! 7. `bit` reports that from now on every spindle holds a new, sharp bit of this kind. Nothing turns at that
//!    time. Implementations that only drive wires ignore it.
//! 8. `ahead` announces the next steps and their directions as soon as they are known: before the first step
//!    and after each one. Drivers set up a direction or switch power on then. A step may also come
//!    unannounced.
//! 9. `spindle_state` reports `Lost` only of a spindle that should turn, and until it is switched off. The
//!    call never waits for an answer.
//!
//! Laws of [`Clock`]
//! 1. `wait_until` returns no earlier than the given tick, and returns the tick it really was.
//! 2. Lost time is never caught up: after a late return the caller shifts all later ticks.
//! 3. `wait_until` is called only for ticks that `grants` accepted. A clock that can wait accepts every tick.
//!    A clock that the caller advances accepts a tick once reached; `wait_until` then returns at once.

mod feed_override;
mod pass_on;
mod play;
mod recorder;
mod steady;

use crate::code;
pub use play::{
    Motors, Operator, Order, Outcome, Playhead, give_way, play, play_by_turns, play_on_by_turns, through,
};
pub use recorder::{Recorder, Written};
pub use steady::Steady;

use crate::diagnostic::Diagnostic;
use crate::job::Bit;
use crate::magazine::ToolStock;
use crate::steps::AXES;
use serde::{Deserialize, Serialize};

/// A set of axes, one bit each: bit 0 is X, bit 1 is Y, bits 2 … 7 are Z1 … Z6.
pub type AxisSet = u8;

const _: () = assert!(AXES <= 8, "an AxisSet has eight bits");

pub trait Pins {
    /// Steps every axis of `axes` once; those also in `forward` count up, the others down.
    fn step(&mut self, at_tick: u64, axes: AxisSet, forward: AxisSet);

    /// Sets the spindle speed in rpm; 0 is off.
    fn spindle(&mut self, at_tick: u64, rpm: u32);

    /// State of the spindle; `Untold` if the hardware can't report it.
    fn spindle_state(&mut self) -> SpindleState {
        SpindleState::Untold
    }

    /// The inputs, one bit each ([`crate::job::Input::bit`]).
    fn inputs(&mut self, at_tick: u64) -> u32;

    /// Switches an output, by its index among the machine's outputs. Implementations without outputs ignore
    /// it.
    fn output(&mut self, _at_tick: u64, _place: u8, _on: bool) {}

    /// All axes are at rest, until the next step.
    fn rest(&mut self, _at_tick: u64) {}

    /// Tick of the next pending switch; none if nothing is pending.
    fn due(&self) -> Option<u64> {
        None
    }

    /// Every spindle holds a new bit of this kind.
    fn bit(&mut self, _at_tick: u64, _bit: &Bit) {}

    /// The user stated where the tools are, in the magazine and the spindle. Implementations that only drive
    /// wires ignore it.
    fn stock(&mut self, _at_tick: u64, _stock: &ToolStock) {}

    /// Announces the next step of every axis in `axes`: up for those also in `forward`, else down. Nothing
    /// moves yet.
    fn ahead(&mut self, _at_tick: u64, _axes: AxisSet, _forward: AxisSet) {}

    /// Switches everything that is due at `at_tick`.
    fn attend(&mut self, _at_tick: u64) {}

    /// Spindle off, forcing voltage off, outputs off.
    fn safe(&mut self);
}

/// A time source, in ticks of [`crate::steps::TICK_HZ`].
pub trait Clock {
    fn now(&mut self) -> u64;

    /// True if the caller may wait for `tick` now.
    fn grants(&mut self, _tick: u64) -> bool {
        true
    }

    /// Waits until `tick`; returns the actual tick, never less than `tick`.
    fn wait_until(&mut self, tick: u64) -> u64;
}

/// Touches shorter than the filter, since the counting device was powered up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShortTouches {
    /// Number of touches; 65,535 means that many or more.
    pub count: u16,
    /// Longest of them, µs.
    pub longest_us: u16,
}

/// State that a spindle reports, if it can report. Speeds in rpm.
///
/// ```text
/// untold                             a relay: its speed is unknown
/// unreachable ⇄ off ─▶ reaching ─▶ at speed ─▶ lost ─▶ off
///                          └──────── too long ──▲          only when it is switched off again
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum SpindleState {
    #[default]
    Untold,
    /// Should be off, and does not answer.
    Unreachable,
    /// Should be off.
    Off {
        /// Actual speed; more than 0 while it runs down.
        rpm: u32,
    },
    /// Accelerating to its speed.
    Reaching {
        rpm: u32,
    },
    AtSpeed {
        rpm: u32,
    },
    /// Should turn, but lost its speed or no longer answers.
    Lost {
        trouble: SpindleTrouble,
    },
}

/// Problem of a spindle that should turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SpindleTrouble {
    Silent,
    /// The converter's answer can't be understood.
    Garbled,
    Refused {
        /// Reason, by the protocol's number.
        code: u8,
    },
    Slow {
        rpm: u32,
        wanted_rpm: u32,
    },
    Tripped {
        /// Reason, by the converter's number.
        code: u16,
    },
}

impl SpindleTrouble {
    pub fn diagnostic(self) -> Diagnostic {
        let error = |code: &str| Diagnostic::error(code);
        match self {
            Self::Silent => error(code!("spindle.silent")),
            Self::Garbled => error(code!("spindle.garbled")),
            Self::Refused { code } => error(code!("spindle.refused")).with("code", code),
            Self::Slow { rpm, wanted_rpm } => {
                error(code!("spindle.slow")).with("rpm", rpm).with("wanted", wanted_rpm)
            }
            Self::Tripped { code } => error(code!("spindle.tripped")).with("code", code),
        }
    }
}
