//! A board that is not flat: bowed, lying askew, of two pieces.
//!
//! ```text
//!  bow    ╭──────╮     step  ────┐        tilt  ╱╱╱
//!       ──╯      ╰──             └────       ──╱
//! ```
//!
//! Comes in: places of the machine, mm. Goes out: how far the board lies above where it should, mm. Does not know bits.

use std::f64::consts::PI;

/// What a board is like that is not flat; 0 everywhere is one that is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UnevenBoard {
    /// How high it is in the middle of every 100 mm, mm.
    pub bow_mm: f64,
    /// How much it rises in a mm along X and along Y, mm.
    pub tilt_slope: [f64; 2],
    /// How much higher its right piece is, mm, and where that begins, mm.
    pub step_mm: f64,
    /// Where that piece begins along X, machine mm.
    pub step_at_mm: f64,
}

impl UnevenBoard {
    /// The one of the exercise: it bows, and its right side lies so low that holes do not go through.
    pub const BOWED: Self = Self { bow_mm: 0.15, tilt_slope: [-0.018, 0.001], step_mm: 0.0, step_at_mm: 0.0 };

    /// How much higher it lies at a place than it should, mm.
    pub fn raised_mm(&self, x_mm: f64, y_mm: f64) -> f64 {
        let wave = |mm: f64| libm::sin(mm * PI / 100.0);
        let bow = self.bow_mm * wave(x_mm) * wave(y_mm);
        let step = if x_mm > self.step_at_mm { self.step_mm } else { 0.0 };
        bow + self.tilt_slope[0] * x_mm + self.tilt_slope[1] * y_mm + step
    }
}
