//! Excellon drill and rout programs, with or without a header, in every known dialect.
//!
//! ```text
//! text ─ survey ─▶ statements, look of the numbers ─ sense ─▶ Reading ─ reader ─▶ DrillFile
//!         └ words, hints                                       ├ block   words sorted
//!                                                              ├ moves   slots, routes, repeats
//!                                                              └ setup   tools, codes
//! ```

mod block;
pub(super) mod hints;
mod moves;
mod reader;
mod sense;
mod setup;
mod survey;
mod words;

pub use reader::MOST_HITS;
pub(super) use reader::{Task, ToolTable, read};
pub(super) use sense::{Sensed, Stated, customary, sense, units_by_sizes};
pub(super) use survey::{Survey, survey};
