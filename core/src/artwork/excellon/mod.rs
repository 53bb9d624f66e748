//! Excellon drill and rout programs, with or without a header, in every dialect met.
//!
//! Comes in: text. Goes out: a drill file as data. Does not know the board, and not the files beside it except through
//! what is handed in.
//!
//! ```text
//! text ─ survey ─▶ what is said, how numbers look ─ sense ─▶ Reading ─ reader ─▶ DrillFile
//!         └ words, hints                                       ├ block   words sorted
//!                                                              ├ moves   slots, routes, repeats
//!                                                              └ setup   tools, codes
//! ```

mod arcs;
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
