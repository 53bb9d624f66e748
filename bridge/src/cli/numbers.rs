//! Parses numbers in option values.

use annulus_core::locale;
use std::time::Duration;

/// Parses a time scale. The drill checks its range.
pub(crate) fn speed(text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| locale::text("en", "control.speed_words", &[]))
}

/// Parses a time of at most one day.
pub(crate) fn seconds(text: &str) -> Result<Duration, String> {
    const DAY_S: f64 = 86_400.0;
    let found = text.parse::<f64>().ok().filter(|seconds| (0.0..=DAY_S).contains(seconds));
    found.map(Duration::from_secs_f64).ok_or_else(|| format!("give seconds from 0 to {DAY_S}"))
}
