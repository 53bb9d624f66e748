//! When each axis is where: a program's commands as jerk-limited moves from rest to rest.
//!
//! ```text
//! Program ─ writer ─▶ Timeline: move, move, dwell, move …   each of parts, each part with its profile or its steps
//! machine ─ cycles ─▶ Timeline: homing, going somewhere, jogging
//! ```
//!
//! Comes in: a program or a wish, and a machine. Goes out: a [`Timeline`]. Does not know how steps are timed.

pub mod automaton;
pub mod bench;
pub mod coordination;
pub mod cycles;
pub mod drill_cycles;
pub mod laws;
mod limits;
mod milling;
pub mod one_by_one;
pub mod path;
pub mod profile;
mod timeline;
mod writer;

pub use limits::{Limits, rapid_time_s};
pub use profile::Profile;
pub use timeline::{AxisMove, Motion, MotorPath, Move, TableSteps, Timeline};
pub use writer::{each_leg, leg_alone, timeline, timeline_from, timeline_telling};
