//! The automatic tool change (C5): which tool lies where, the paper's steps of a change, what each looks at, and the way on from
//! where one stopped.
//!
//! ```text
//!   old tool ─ steps 1 … 10 ─▶ its place      clamp opens: for a moment nobody knows whether the tool is in the spindle
//!   new tool ◀─ 11 … 20 ───── its place       clamp closes: the same
//!              21 … 24       on with the job
//! ```
//!
//! Where a change stopped, what is in the spindle decides how it goes on: the old tool, and it is put back; nothing, and the new one is
//! fetched; the new one, and the job goes on. Where no sensor tells, a person does, and until then nothing moves. Every change begins
//! with Z up.
//!
//! Comes in: a machine, what lies where, the bit that is wanted, inputs. Goes out: moves of the machine's own, and diagnostics. Does not know
//! jobs, nor who plays the moves.

mod change;
mod duration;
mod step;
mod stock;

pub use change::{Change, StepWork};
pub use duration::{change_s, changes_ticks};
pub use step::{ChangeStep, Looks};
pub use stock::{Held, Seen, StockedTool, ToolStock, Unfinished, laid_out};
