//! The seam to the hardware: two small traits with laws, and what the executor does with them.
//!
//! Laws of [`Pins`]
//! 1. `step` with an axis in `axes` moves that axis by exactly one step, in the direction given; nothing else moves.
//! 2. `at_tick` never decreases from call to call. It is stream time: an implementation that models motion uses it as
//!    its clock; one that drives wires has already waited for it.
//! 3. `inputs` reports the inputs as they are at `at_tick`, one bit each ([`crate::job::Input::bit`]).
//! 4. `safe` turns the spindle off and takes forcing voltage away. It may be called at any time, twice, and never
//!    fails. Outputs switched by `output` are turned off with it.
//! 5. `rest` says that all axes are at rest and may stay so: what only a turning motor needs may be taken away.
//! 6. `due` is the tick by which `attend` wants to be called although nothing steps; none while nothing is pending. After
//!    `attend` at a tick that was due, nothing is due at that tick or before it.
//! 7. `bit` says that from now on a new, sharp bit of this kind is in every spindle. Nothing turns then. What only drives
//!    wires does nothing.
//! 8. `ahead` says which axes step next and which way, as soon as that is known: after every step, and before the first. What has
//!    to set a direction up, or to be switched on first, does it then. A step may come that was not announced.
//! 9. `spindle_state` reports `Lost` only of a spindle that is to turn, and goes on to report it until it is switched off. It
//!    never waits for an answer.
//!
//! Laws of [`Clock`]
//! 1. `wait_until` returns no earlier than the given tick, and returns the tick it really was.
//! 2. Late is never caught up: after a late return the caller shifts all later ticks.
//! 3. `wait_until` is called only for ticks that `grants` said yes to. A clock that waits by itself always does; one that is
//!    told the time does once the tick is reached, and its `wait_until` then waits for nothing.
//!
//! Comes in: runs. Goes out: calls on the traits. Does not know who computed the stream.

mod feed_override;
mod pass_on;
mod play;
mod recorder;
mod spindle;
mod steady;
mod touches;

pub use play::{Motors, Operator, Order, Outcome, Playhead, give_way, play, play_by_turns, through};
pub use recorder::{Recorder, Written};
pub use spindle::{SpindleState, SpindleTrouble};
pub use steady::Steady;
pub use touches::ShortTouches;

use crate::job::Bit;
use crate::magazine::ToolStock;
use crate::steps::AXES;

/// A set of axes, one bit each: bit 0 is X, bit 1 is Y, bits 2 … 7 are Z1 … Z6.
pub type AxisSet = u8;

const _: () = assert!(AXES <= 8, "an AxisSet has eight bits");

/// Somewhere to put pulses, and to read sensors from.
pub trait Pins {
    /// One step on every axis of `axes`; those also in `forward` count up, the others down.
    fn step(&mut self, at_tick: u64, axes: AxisSet, forward: AxisSet);

    /// Set the spindle's speed in rpm; 0 is off.
    fn spindle(&mut self, at_tick: u64, rpm: u32);

    /// How the spindle stands. What cannot ask it does not know.
    fn spindle_state(&mut self) -> SpindleState {
        SpindleState::Untold
    }

    /// The inputs, one bit each.
    fn inputs(&mut self, at_tick: u64) -> u32;

    /// Switch an output: its place among the machine's outputs. What has no outputs does nothing.
    fn output(&mut self, _at_tick: u64, _place: u8, _on: bool) {}

    /// All axes are at rest.
    fn rest(&mut self, _at_tick: u64) {}

    /// When it has something to switch by itself next. What has nothing of the kind says so.
    fn due(&self) -> Option<u64> {
        None
    }

    /// A new bit of this kind is in every spindle.
    fn bit(&mut self, _at_tick: u64, _bit: &Bit) {}

    /// From now on the tools of the magazine and the spindle lie like this, because a person says so. What only drives wires does
    /// nothing.
    fn stock(&mut self, _at_tick: u64, _stock: &ToolStock) {}

    /// The next step of every axis in `axes`: of those also in `forward` up, of the others down. Nothing moves yet.
    fn ahead(&mut self, _at_tick: u64, _axes: AxisSet, _forward: AxisSet) {}

    /// It is `at_tick`: what is due may be switched.
    fn attend(&mut self, _at_tick: u64) {}

    /// Spindle off, forcing voltage off, outputs off.
    fn safe(&mut self);
}

/// Somewhere to take time from, in ticks of [`crate::steps::TICK_HZ`].
pub trait Clock {
    /// The tick it is now.
    fn now(&mut self) -> u64;

    /// Whether it may be waited for `tick` now.
    fn grants(&mut self, _tick: u64) -> bool {
        true
    }

    /// Wait until `tick`; returns the tick it is then, never less than `tick`.
    fn wait_until(&mut self, tick: u64) -> u64;
}
