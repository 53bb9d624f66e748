//! The queue of work commands (A7, A8): a procedure put together from elementary activities, written as text, looked
//! through before anything moves, and run row by row.
//!
//! ```text
//! text ─ read ─▶ Queue ─ check ─▶ may it run?          dry: ranges, tip, spindle, trust, through every repeat and call
//!                  └──── Run ───▶ segments, outputs ──▶ executor ──▶ report ──▶ next row     (the bridge)
//!                                                └────▶ Pins of the virtual drill            (`rehearse`, in the page)
//! ```
//!
//! The commands are Arendt's (part 3 of the paper: `KMD_GOTOdXdY`, `KMD_GOTO_X_Y`, `KMD_WIERTLO_DOL`) and their kin, as one
//! table ([`WORDS`]). Work zero, ranges and heights are the machine's; lengths in mm, moves by hand in motor steps, times
//! in ms.
//!
//! Comes in: text, a machine, and how the drill stands. Goes out: what to do next, and what came of every row. Does not
//! know sockets, threads or who asks.

mod blocks;
mod check;
mod homing;
mod rehearse;
mod rules;
mod run;
mod text;
mod words;
mod work;

pub use blocks::{Queue, QueueCursor};
pub use check::{CheckedQueue, check};
pub use homing::{Homing, HomingNext};
pub use rehearse::{Rehearsal, Rig};
pub use rules::{Standing, after};
pub use run::{
    Harm, Mode, QueueAction, QueueReport, QueueRun, Rest, RowResult, RowState, early, guarded, late, missing,
};
pub use text::{QueueRow, print, read, read_row};
pub use words::{Argument, ArgumentKind, ArgumentValue, Axes, WORDS, Word, WorkCommand};
pub use work::{park, travel};

/// The longest text of a queue, in bytes: one frame of the wire has room for it.
pub const LONGEST_TEXT: usize = 24_000;

/// The most rows of a queue.
pub const MOST_ROWS: usize = 500;

/// The most rows a queue may come through when its repeats and calls are written out.
pub const MOST_STEPS: u32 = 100_000;

/// How deep repeats may stand in each other.
pub const DEEPEST: usize = 8;
