//! The driven axis: a servo in velocity mode, second order, with an exact discrete step.
//!
//! ```text
//!  dy/dt = w        dw/dt = (K·(u + d) − w)/τ          φ = exp(−Ts/τ), g = τ·(1 − φ), q = K·(u + d)
//!  y := y + g·w + (Ts − g)·q                           exact for a control constant over the sample
//!  w := φ·w + (1 − φ)·q
//! ```

use super::within;
use crate::diagnostic::Diagnostic;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plant {
    /// K: steady speed per volt, (mm/s)/V.
    pub gain_mm_per_s_per_v: f64,
    /// τ: time constant, s.
    pub tau_s: f64,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlantState {
    /// Position, mm.
    pub y_mm: f64,
    pub w_mm_per_s: f64,
}

/// The exact step over one sample, with precomputed coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Zoh {
    phi: f64,
    g_s: f64,
    sample_s: f64,
    gain: f64,
}

/// The plant of the source: 60 (mm/s)/V, 6 ms.
pub const fn default_plant() -> Plant {
    Plant { gain_mm_per_s_per_v: 60.0, tau_s: 0.006 }
}

impl Plant {
    pub fn check(&self) -> Result<(), Diagnostic> {
        within("plant-gain", self.gain_mm_per_s_per_v, 1e-6, 1e9)?;
        within("plant-tau", self.tau_s, 1e-6, 1e3)
    }

    /// Its step over `sample_s`.
    pub fn every(&self, sample_s: f64) -> Zoh {
        let phi = libm::exp(-sample_s / self.tau_s);
        Zoh { phi, g_s: self.tau_s * (1.0 - phi), sample_s, gain: self.gain_mm_per_s_per_v }
    }

    /// Control for a speed and an acceleration without error: (v + τ·a)/K, V.
    pub fn ahead_v(&self, speed_mm_per_s: f64, acceleration_mm_per_s2: f64) -> f64 {
        (speed_mm_per_s + self.tau_s * acceleration_mm_per_s2) / self.gain_mm_per_s_per_v
    }
}

impl Zoh {
    /// The state after one sample, with the sum of control and load `u_v`.
    pub fn step(&self, from: PlantState, u_v: f64) -> PlantState {
        let q = self.gain * u_v;
        PlantState {
            y_mm: from.y_mm + self.g_s * from.w_mm_per_s + (self.sample_s - self.g_s) * q,
            w_mm_per_s: self.phi * from.w_mm_per_s + (1.0 - self.phi) * q,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_half_steps_are_one_step() {
        let plant = default_plant();
        let (whole, half) = (plant.every(0.002), plant.every(0.001));
        let start = PlantState { y_mm: 0.3, w_mm_per_s: -7.0 };
        let (one, two) = (whole.step(start, 1.5), half.step(half.step(start, 1.5), 1.5));
        assert!((one.y_mm - two.y_mm).abs() < 1e-15 && (one.w_mm_per_s - two.w_mm_per_s).abs() < 1e-13);
    }

    #[test]
    fn constant_voltage_reaches_its_final_speed() {
        let step = default_plant().every(0.01);
        let end = (0..100).fold(PlantState::default(), |state, _| step.step(state, 0.5));
        assert!((end.w_mm_per_s - 30.0).abs() < 1e-12, "{end:?}");
        // The distance is the speed times time, less the lag τ.
        assert!((end.y_mm - 30.0 * (1.0 - 0.006)).abs() < 1e-12, "{end:?}");
    }
}
