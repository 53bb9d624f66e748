//! The format of a drill file: units, digits and omitted zeros, checked against the copper.
//!
//! ```text
//! text ─▶ candidates (every plausible reading) ─▶ resolve (the file's own statements, else the evidence)
//!              ▲                                     │
//!   plausible ─┤ evidence: copper and outline        └─▶ offset: holes off their pads  
//!                                                         tool_units, siblings: checks of the result
//! ```

mod candidates;
mod evidence;
mod offset;
mod plausible;
mod resolve;
mod siblings;
mod tool_units;

pub(super) use evidence::{Neighbours, witnesses};
pub(super) use plausible::faults;
pub(super) use resolve::program;
pub(super) use siblings::settle;
