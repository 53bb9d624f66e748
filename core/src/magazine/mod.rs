//! The automatic tool changer: the stock of tools, the steps of a change with their sensor checks, and how a
//! stopped change resumes.
//!
//! ```text
//!   old tool ─ steps 1 … 10 ─▶ its slot       clamp opens: for a moment the tool's location is unknown
//!   new tool ◀─ 11 … 20 ────── its slot       clamp closes: likewise
//!              21 … 24       back to the job
//! ```
//!
//! After a stop, the spindle's contents decide how to resume. An old tool is put back. An empty spindle
//! fetches the new tool. With the new tool the job continues. If no sensor knows, the user
//! must state it, and nothing moves until then. Every change starts with Z up.

mod change;
mod duration;
mod step;
mod stock;

pub use change::{Change, StepWork};
pub use duration::{change_s, changes_ticks};
pub use step::{ChangeStep, Looks};
pub use stock::{Held, Seen, StockedTool, ToolStock, Unfinished, laid_out};
