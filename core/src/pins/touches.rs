//! Touches of a sensor that were shorter than its filter.

use serde::{Deserialize, Serialize};

/// Touches shorter than the filter, since the counting device was powered up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShortTouches {
    /// Number of touches; 65,535 means that many or more.
    pub count: u16,
    /// Longest of them, µs.
    pub longest_us: u16,
}
