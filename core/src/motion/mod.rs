//! When each axis is where: a program's commands as jerk-limited moves from rest to rest.
//!
//! ```text
//! Program ─ timeline ─▶ Timeline: move, move, dwell, move …   each with a Profile over its path
//! machine ─ cycles ───▶ Timeline: homing, going somewhere, jogging
//! ```
//!
//! Comes in: a program or a wish, and a machine. Goes out: a [`Timeline`]. Does not know how steps are timed.

pub mod bench;
pub mod cycles;
pub mod laws;
mod limits;
pub mod path;
pub mod profile;
mod timeline;

pub use limits::{Limits, hop_time_s};
pub use profile::Profile;
pub use timeline::{Move, Timeline, timeline, timeline_from};
