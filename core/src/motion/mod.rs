//! Motion planning: converts a program's commands into jerk-limited moves from rest to rest.
//!
//! ```text
//! Program ─ writer ─▶ Timeline: move, move, dwell, move …   moves of parts, each with a profile or steps
//! machine ─ cycles ─▶ Timeline: homing, go to, jog
//! ```

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

pub use limits::rapid_time_s;
pub use profile::{Limits, Profile};
pub use timeline::{AxisMove, Motion, MotorPath, Move, TableSteps, Timeline};
pub use writer::{each_leg, leg_alone, timeline, timeline_from, timeline_telling};
