//! The queue of work commands: a procedure of elementary actions, written as text. The whole text is checked
//! before anything moves, then executed row by row.
//!
//! ```text
//! text ─ read ─▶ Queue ─ check ─▶ may it run?      dry run of all repeats and calls
//!                  └──── Run ───▶ segments, outputs ──▶ executor ──▶ report ──▶ next row   (bridge)
//!                                                └────▶ Pins of the virtual drill   (`rehearse`, page)
//! ```
//!
//! The commands are Arendt's (part 3 of the paper: `KMD_GOTOdXdY`, `KMD_GOTO_X_Y`, `KMD_WIERTLO_DOL`) and
//! additions, in one table ([`WORDS`]). Work zero, ranges and heights are the machine's. Lengths are in mm,
//! relative moves in motor steps, times in ms.

mod blocks;
mod change;
mod homing;
mod rehearse;
mod rules;
mod run;
mod text;
mod words;
mod work;

pub use blocks::{Queue, QueueCursor, QueueRow};
pub use change::{at_change, change_place, from_change, to_change};
pub use homing::{Homing, HomingNext};
pub use rehearse::{Rehearsal, Rig};
pub use rules::{CheckedQueue, Standing, after, check};
pub use run::{Mode, QueueAction, QueueRun, Rest, RowResult, RowState};
pub use text::{print, read, read_row};
pub use words::{Argument, ArgumentKind, ArgumentValue, Axes, WORDS, Word, WorkCommand};
pub use work::{Harm, QueueReport, early, guarded, late, missing, park, travel};

/// Longest text of a queue, in bytes: it must fit into one wire frame.
pub const LONGEST_TEXT: usize = 24_000;

pub const MOST_ROWS: usize = 500;

pub const MOST_STEPS: u32 = 100_000;

/// Deepest nesting of repeats.
pub const DEEPEST: usize = 8;
