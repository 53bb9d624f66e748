//! The numbered settings of a controller: name, unit, and those that a job depends on.

use crate::diagnostic::Diagnostic;
use crate::{code, warning};
use std::collections::BTreeMap;

pub type Values = BTreeMap<u16, f64>;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SettingRow {
    pub number: u16,
    /// `mm`, `mm/min`, `mm/s²`, `steps/mm`, `µs`, `ms`, `rpm`, `on/off`, `bits`, or empty.
    pub unit: &'static str,
}

impl SettingRow {
    /// Key of its name in the locale tables.
    pub fn key(self) -> String {
        format!("grbl.setting.{}", self.number)
    }
}

const fn row(number: u16, unit: &'static str) -> SettingRow {
    SettingRow { number, unit }
}

/// Settings common to the whole family, in order.
pub const SETTINGS: &[SettingRow] = &[
    row(0, "µs"),
    row(1, "ms"),
    row(2, "bits"),
    row(3, "bits"),
    row(4, "on/off"),
    row(5, "on/off"),
    row(6, "on/off"),
    row(10, "bits"),
    row(11, "mm"),
    row(12, "mm"),
    row(13, "on/off"),
    row(20, "on/off"),
    row(21, "on/off"),
    row(22, "on/off"),
    row(23, "bits"),
    row(24, "mm/min"),
    row(25, "mm/min"),
    row(26, "ms"),
    row(27, "mm"),
    row(30, "rpm"),
    row(31, "rpm"),
    row(32, "on/off"),
    row(100, "steps/mm"),
    row(101, "steps/mm"),
    row(102, "steps/mm"),
    row(110, "mm/min"),
    row(111, "mm/min"),
    row(112, "mm/min"),
    row(120, "mm/s²"),
    row(121, "mm/s²"),
    row(122, "mm/s²"),
    row(130, "mm"),
    row(131, "mm"),
    row(132, "mm"),
];

/// The row of a setting number, if all of the family have this setting.
pub fn of(number: u16) -> Option<SettingRow> {
    SETTINGS.iter().copied().find(|row| row.number == number)
}

/// Three values from `first` on, if all are known and above 0.
pub fn axes(values: &Values, first: u16) -> Option<[f64; 3]> {
    let value = |axis: u16| values.get(&(first + axis)).copied().filter(|value| *value > 0.0);
    Some([value(0)?, value(1)?, value(2)?])
}

/// True if the value is not 0.
pub fn on(values: &Values, number: u16) -> bool {
    values.get(&number).is_some_and(|value| *value != 0.0)
}

/// Error numbers that the family shares.
pub const ERRORS: &[u16] = &[
    1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30,
    31, 32, 33, 34, 35, 36, 37, 38,
];
pub const ALARMS: &[u16] = &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10];

/// Message code of an error.
pub fn error_code(number: u16) -> String {
    if ERRORS.contains(&number) {
        format!("grbl.error_{number}")
    } else {
        code!("grbl.error_other").to_owned()
    }
}

pub(super) fn refused(number: u16, line: &str) -> Diagnostic {
    Diagnostic::error(&error_code(number)).with("number", number).with("line", line)
}

pub fn alarm_code(number: u16) -> String {
    if ALARMS.contains(&number) {
        format!("grbl.alarm_{number}")
    } else {
        code!("grbl.alarm_other").to_owned()
    }
}

/// `$1`: milliseconds after a move until the motors are switched off; 255 keeps them on.
const LETS_GO: u16 = 1;
const NEVER_MS: f64 = 255.0;

/// Warning that the motors don't hold during a tool change.
pub fn motors_let_go(values: &Values) -> Option<Diagnostic> {
    let ms = *values.get(&LETS_GO)?;
    let lets_go = libm::fabs(ms - NEVER_MS) >= 0.5;
    lets_go.then(|| warning!("grbl.motors_let_go", ms = libm::round(ms)))
}

/// `$13`: reports in inches.
const INCHES: u16 = 13;
pub const MM_PER_INCH: f64 = 25.4;

pub fn in_inches(values: &Values) -> bool {
    on(values, INCHES)
}

/// Last digit of a reported position, mm.
pub fn place_digit_mm(values: &Values) -> f64 {
    if in_inches(values) { 1e-4 * MM_PER_INCH } else { 1e-3 }
}

/// Last digit of a reported feed, mm/min.
pub fn feed_digit_mm_per_min(values: &Values) -> f64 {
    if in_inches(values) { 0.1 * MM_PER_INCH } else { 1.0 }
}

/// The setting that a line writes: `$13=1`.
pub(super) fn written(line: &str) -> Option<(u16, f64)> {
    let (number, value) = line.strip_prefix('$')?.split_once('=')?;
    Some((number.parse().ok()?, value.parse().ok().filter(|value: &f64| value.is_finite())?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn written_setting_is_recognised() {
        for (line, expected) in [
            ("$13=1", Some((13, 1.0))),
            ("$110=1200.5", Some((110, 1200.5))),
            ("$J=G91G21X1F100", None),
            ("$$", None),
            ("G21G10L2P1Z-1", None),
        ] {
            assert_eq!(written(line), expected, "{line}");
        }
    }
}
