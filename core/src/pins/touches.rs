//! Touches of a sensor that were too short to count as one.
//!
//! Goes out: a count, microseconds. Does not know who counts.

use serde::{Deserialize, Serialize};

/// How often a sensor was touched for less than its filter, since what counts has power.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShortTouches {
    /// How often; 65,535 says that often or more.
    pub count: u16,
    /// The longest of them, µs.
    pub longest_us: u16,
}
