//! The spindle's frequency converter on a serial port: profile, connection and motor.
//!
//! ```text
//! rpm ──▶ Hz = rpm · pole pairs / 60 ──▶ number in the converter's unit, from its profile
//! ```

use super::field::{ADVANCED, FILE, Setting, fields};
use super::value::ValueKind::{Number, Text, Whole};
use super::{Machine, Output};
use crate::code;
use crate::diagnostic::Diagnostic;

/// On a slower line, an answer takes longer than a spindle may be silent.
const SLOWEST_BAUD: u32 = 9_600;

#[derive(Clone, Debug, PartialEq)]
pub struct Converter {
    /// Profile name; empty if there is no converter, or if it isn't controlled.
    pub profile: String,
    pub port: String,
    /// Baud rate; 0 for the profile's.
    pub baud: u32,
    /// Address on the line, 1 … 247.
    pub address: u8,
    /// Pole pairs of the motor; with one, it makes one turn per period.
    pub pole_pairs: u32,
    pub max_hz: u32,
    pub tolerance_percent: f64,
}

impl Default for Converter {
    /// No converter; other values suit common 24,000 rpm spindles.
    fn default() -> Self {
        Self {
            profile: String::new(),
            port: String::new(),
            baud: 0,
            address: 1,
            pole_pairs: 1,
            max_hz: 400,
            tolerance_percent: 5.0,
        }
    }
}

impl Converter {
    pub fn is_there(&self) -> bool {
        !self.profile.is_empty()
    }

    /// Frequency for a spindle speed, in hundredths of a Hz.
    pub fn centi_hz(&self, rpm: u32) -> u32 {
        let hz100 = u64::from(rpm) * u64::from(self.pole_pairs.max(1)) * 100;
        u32::try_from((hz100 + 30) / 60).unwrap_or(u32::MAX)
    }

    /// Spindle speed for a frequency in hundredths of a Hz, rpm.
    pub fn rpm(&self, centi_hz: u32) -> u32 {
        let turns = u64::from(centi_hz) * 60;
        let per = 100 * u64::from(self.pole_pairs.max(1));
        u32::try_from((turns + per / 2) / per).unwrap_or(u32::MAX)
    }
}

/// The section "converter" of the settings table.
pub(super) const ROWS: &[Setting] = fields! { Machine;
    ("converter.profile", "", Text(60), FILE, converter.profile)
    ("converter.port", "", Text(200), FILE, converter.port)
    ("converter.baud", "", Whole(0.0, 115_200.0), FILE.and(ADVANCED), converter.baud)
    ("converter.address", "", Whole(1.0, 247.0), FILE.and(ADVANCED), converter.address)
    ("converter.pole_pairs", "", Whole(1.0, 8.0), FILE, converter.pole_pairs)
    ("converter.max_frequency", "Hz", Whole(1.0, 3_000.0), FILE, converter.max_hz)
    ("converter.tolerance", "%", Number(0.5, 50.0), FILE.and(ADVANCED), converter.tolerance_percent)
};

pub(super) fn validate(machine: &Machine) -> Vec<Diagnostic> {
    let converter = &machine.converter;
    let mut diagnostics = Vec::new();
    if !converter.is_there() {
        return diagnostics;
    }
    let refuse = |code: &str, key: &str| Diagnostic::error(code).with("key", key);
    if converter.port.is_empty() {
        diagnostics.push(refuse(code!("machine.converter_no_port"), "converter.port"));
    }
    if (1..SLOWEST_BAUD).contains(&converter.baud) {
        let why = refuse(code!("machine.converter_slow_line"), "converter.baud");
        diagnostics.push(why.with("baud", converter.baud).with("least", SLOWEST_BAUD));
    }
    let fastest_rpm = converter.rpm(converter.max_hz * 100);
    if machine.process.spindle_rpm > fastest_rpm {
        let why = refuse(code!("machine.converter_too_slow"), "spindle.speed");
        diagnostics.push(why.with("rpm", machine.process.spindle_rpm).with("most", fastest_rpm));
    }
    if machine.output == Output::Adapter {
        diagnostics.push(refuse(code!("machine.converter_beside_adapter"), "converter.profile"));
    }
    diagnostics
}

#[cfg(test)]
mod tests {
    use super::super::{Value, apply, virtual_drill};
    use super::*;

    #[test]
    fn speeds_convert_to_frequencies_and_back() {
        for (pole_pairs, rpm, centi_hz) in
            [(1, 24_000, 40_000), (2, 24_000, 80_000), (1, 12_345, 20_575), (1, 0, 0)]
        {
            let converter = Converter { pole_pairs, ..Converter::default() };
            assert_eq!((converter.centi_hz(rpm), converter.rpm(centi_hz)), (centi_hz, rpm));
        }
        assert_eq!(Converter::default().centi_hz(u32::MAX), u32::MAX, "no overflow");
    }

    #[test]
    fn impossible_converter_names_its_field() {
        let text = |text: &str| Value::Text(text.to_owned());
        let there = [
            ("converter.profile", text("huanyang")),
            ("converter.port", text("/dev/ttyUSB0")),
            ("spindle.speed", Value::Number(24_000.0)),
        ];
        let codes = |more: &[(&str, Value)]| {
            let changes = there.iter().chain(more).map(|(key, value)| ((*key).to_owned(), value.clone()));
            let refusals = apply(&virtual_drill(), &changes.collect::<Vec<_>>()).err().unwrap_or_default();
            refusals.into_iter().map(|why| why.code).collect::<Vec<_>>()
        };
        assert_eq!(codes(&[]), Vec::<String>::new());
        assert_eq!(codes(&[("converter.port", text(""))]), ["machine.converter_no_port"]);
        for (baud, refused) in [(0.0, false), (4_800.0, true), (9_600.0, false)] {
            let found = codes(&[("converter.baud", Value::Number(baud))]);
            let expected = if refused { vec!["machine.converter_slow_line"] } else { Vec::new() };
            assert_eq!(found, expected, "{baud}");
        }
        assert_eq!(codes(&[("converter.pole_pairs", Value::Number(2.0))]), ["machine.converter_too_slow"]);
        assert_eq!(codes(&[("machine.output", text("adapter"))]), ["machine.converter_beside_adapter"]);
        assert_eq!(
            codes(&[("converter.port", text("")), ("converter.profile", text(""))]),
            Vec::<String>::new()
        );
    }
}
