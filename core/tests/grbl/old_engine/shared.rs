//! Copies of private functions that the old engine calls.

pub(super) mod lines {
    pub(in super::super) use annulus_core::grbl::{LinePath, WireLine, WordsInForce};

    const DECIMALS: usize = 4;

    pub(in super::super) fn distance(a_mm: [f64; 3], b_mm: [f64; 3]) -> f64 {
        libm::sqrt((0..3).map(|axis| (a_mm[axis] - b_mm[axis]) * (a_mm[axis] - b_mm[axis])).sum())
    }

    pub(in super::super) fn number(value: f64) -> String {
        let mut text = format!("{value:.DECIMALS$}");
        if text.contains('.') {
            text.truncate(text.trim_end_matches('0').trim_end_matches('.').len());
        }
        if text == "-0" { "0".to_owned() } else { text }
    }
}

pub(super) mod settings {
    pub(in super::super) use annulus_core::grbl::settings::*;

    pub(in super::super) fn written(line: &str) -> Option<(u16, f64)> {
        let (number, value) = line.strip_prefix('$')?.split_once('=')?;
        Some((number.parse().ok()?, value.parse().ok().filter(|value: &f64| value.is_finite())?))
    }
}
