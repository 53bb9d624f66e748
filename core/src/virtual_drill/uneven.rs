//! A board that isn't flat: bowed, tilted, or with a step.
//!
//! ```text
//!  bow    ╭──────╮     step  ────┐        tilt  ╱╱╱
//!       ──╯      ╰──             └────       ──╱
//! ```

use std::f64::consts::PI;

/// Shape of the board's surface; all zeros is a flat board.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UnevenBoard {
    /// Height in the middle of every 100 mm, mm.
    pub bow_mm: f64,
    /// Slope along X and along Y, mm per mm.
    pub tilt_slope: [f64; 2],
    /// Extra height of the right part of the board, mm.
    pub step_mm: f64,
    /// Start of the right part along X, machine mm.
    pub step_at_mm: f64,
}

impl UnevenBoard {
    /// Shape in the exercise: bowed, with the right side so low that holes do not break through.
    pub const BOWED: Self = Self { bow_mm: 0.15, tilt_slope: [-0.018, 0.001], step_mm: 0.0, step_at_mm: 0.0 };

    /// Extra height at a position, mm.
    pub fn raised_mm(&self, x_mm: f64, y_mm: f64) -> f64 {
        let wave = |mm: f64| libm::sin(mm * PI / 100.0);
        let bow = self.bow_mm * wave(x_mm) * wave(y_mm);
        let step = if x_mm > self.step_at_mm { self.step_mm } else { 0.0 };
        bow + self.tilt_slope[0] * x_mm + self.tilt_slope[1] * y_mm + step
    }
}
