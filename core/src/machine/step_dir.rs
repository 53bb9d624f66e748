//! Drivers with STEP, DIR and ENABLE inputs: wiring, timing, and the charge pump.
//!
//! ```text
//! DIR   ───┐                      ┌──────────     set-up: from DIR to STEP
//!          └──────────────────────┘               hold: from the end of STEP to DIR
//! STEP  ──────┐    ┌─────┐    ┌──────────┐        length: STEP is on
//!        setup└────┘space└────┘hold  setup└──     space: until the next STEP
//! ```
//!
//! The planner leaves room for these times. Two steps are at least length and space apart. A step in the
//! other direction follows at least length, hold and set-up later. This module checks that. Times are in ns,
//! one each for X, Y and Z.

use super::{Machine, UNWIRED};
use crate::code;
use crate::diagnostic::Diagnostic;

/// Wired axes: X, Y, Z.
pub const WIRED_AXES: usize = 3;

/// Row names of the motors' phase bits.
pub(super) const MOTORS: [&str; 3] = ["x", "y", "z"];

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StepDir {
    /// X, Y, Z: output bit of STEP; [`UNWIRED`] if the motor's phases are driven directly.
    pub steps: Vec<i8>,
    /// Output bit of DIR, on while the axis counts up.
    pub directions: Vec<i8>,
    /// Output bit that enables the driver; axes may share one.
    pub enables: Vec<i8>,
    /// Output bit that toggles while the program is alive.
    pub charge_pump: i8,
    /// Toggle frequency, Hz.
    pub charge_pump_hz: u32,
    /// Active-low output bits, of any signal.
    pub outputs_low: Vec<i8>,
    /// Least time of STEP on, ns.
    pub length_ns: Vec<u32>,
    pub space_ns: Vec<u32>,
    /// From a change of DIR to STEP, ns.
    pub setup_ns: Vec<u32>,
    /// From the end of STEP to a change of DIR, ns.
    pub hold_ns: Vec<u32>,
    /// From ENABLE to the first STEP, ms.
    pub enable_delay_ms: u32,
}

impl Default for StepDir {
    /// Unwired, with times that suit nearly every driver.
    fn default() -> Self {
        let unwired = || vec![UNWIRED; WIRED_AXES];
        let all = |ns: u32| vec![ns; WIRED_AXES];
        Self {
            steps: unwired(),
            directions: unwired(),
            enables: unwired(),
            charge_pump: UNWIRED,
            charge_pump_hz: 10_000,
            outputs_low: Vec::new(),
            length_ns: all(5_000),
            space_ns: all(5_000),
            setup_ns: all(20_000),
            hold_ns: all(20_000),
            enable_delay_ms: 0,
        }
    }
}

impl StepDir {
    pub fn counts(&self, axis: usize) -> bool {
        self.steps.get(axis).is_some_and(|bit| *bit != UNWIRED)
    }

    /// Every used bit with the name of its row.
    pub(super) fn bits(&self) -> impl Iterator<Item = (&'static str, i8)> {
        let named = |name: &'static str, bits: &[i8]| bits.iter().map(|bit| (name, *bit)).collect::<Vec<_>>();
        // Axes with a common ENABLE bit count as one signal.
        let mut enables = self.enables.clone();
        enables.sort_unstable();
        enables.dedup();
        let rows =
            [named("step", &self.steps), named("direction", &self.directions), named("enable", &enables)];
        rows.into_iter().flatten().chain([("charge_pump", self.charge_pump)])
    }

    pub(super) fn lengths(&self) -> [(&'static str, usize, usize); 7] {
        let of = |name, list: usize| (name, list, WIRED_AXES);
        [
            of("step", self.steps.len()),
            of("direction", self.directions.len()),
            of("enable", self.enables.len()),
            of("step_length", self.length_ns.len()),
            of("step_space", self.space_ns.len()),
            of("direction_setup", self.setup_ns.len()),
            of("direction_hold", self.hold_ns.len()),
        ]
    }

    /// Problems of the wiring: missing direction, or too little time left by the planner. `section` is its
    /// section of the table.
    pub(super) fn validate(&self, section: &str, machine: &Machine) -> Vec<Diagnostic> {
        let refuse =
            |code: &str, name: &str| Diagnostic::error(code).with("key", format!("{section}.{name}"));
        let of = |list: &[u32], axis: usize| list.get(axis).copied().map_or(0, u64::from);
        let period_ns = 1_000_000_000 / u64::from(machine.max_step_hz.max(1));
        let turn_ns = 1_000 * u64::from(machine.direction_setup_us);
        let mut diagnostics = Vec::new();
        for (axis, name) in MOTORS.iter().enumerate().filter(|(axis, _)| self.counts(*axis)) {
            if self.directions.get(axis).is_none_or(|bit| *bit == UNWIRED) {
                diagnostics.push(
                    refuse(code!("machine.direction_unwired"), "direction").with("axis", name.to_uppercase()),
                );
            }
            let pulse_ns = of(&self.length_ns, axis) + of(&self.space_ns, axis);
            if pulse_ns > period_ns {
                let why =
                    refuse(code!("machine.steps_too_close"), "step_length").with("axis", name.to_uppercase());
                diagnostics.push(why.with("needed", pulse_ns).with("there", period_ns));
            }
            let needed_ns = of(&self.length_ns, axis) + of(&self.hold_ns, axis) + of(&self.setup_ns, axis);
            if needed_ns > turn_ns {
                let why = refuse(code!("machine.turns_too_soon"), "direction_setup")
                    .with("axis", name.to_uppercase());
                diagnostics.push(why.with("needed", needed_ns).with("there", turn_ns));
            }
        }
        diagnostics
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Value, apply, hobby_3018, preset};
    use crate::machine::UNWIRED;

    fn list(numbers: &[i32]) -> Value {
        Value::Numbers(numbers.iter().map(|number| f64::from(*number)).collect())
    }

    #[test]
    fn step_boards_have_no_phase_wiring() {
        for (name, spare) in [("breakout", 4), ("tb6560", 2), ("g540", 4)] {
            let machine = preset(name).unwrap();
            let wiring = machine.wiring();
            let used = wiring.signals().filter(|(_, bit)| *bit != UNWIRED).count();
            assert_eq!(12 - used, spare, "{name}");
            assert!((0..3).all(|axis| wiring.phase_bits(axis).is_empty()), "{name}");
        }
    }

    #[test]
    fn invalid_step_wiring_names_its_field() {
        let word = |word: &str| Value::Text(word.to_owned());
        let rows: [(&str, Value, &str); 9] = [
            ("parallel.direction", list(&[-1, 3, 5]), "machine.direction_unwired"),
            ("parallel.direction", list(&[1, 3]), "machine.card_length"),
            ("parallel.step", list(&[0, 0, 4]), "machine.card_bit_twice"),
            ("parallel.enable", list(&[9, 9, 4]), "machine.card_bit_twice"),
            ("parallel.charge_pump", Value::Number(4.0), "machine.card_bit_twice"),
            ("parallel.outputs_low", list(&[12]), "machine.card_bit_outside"),
            ("parallel.step_length", list(&[5_000, 5_000, 200_000]), "machine.steps_too_close"),
            ("parallel.direction_hold", list(&[5_000, 900_000, 0]), "machine.turns_too_soon"),
            ("parallel.step", list(&[0, 2, 12]), "machine.card_bit_outside"),
        ];
        let breakout = preset("breakout").unwrap();
        for (key, value, code) in rows {
            let refusals = apply(&breakout, &[(key.to_owned(), value.clone())]).unwrap_err();
            let why = refusals.iter().find(|why| why.code == code);
            let why = why.unwrap_or_else(|| panic!("{key} {value}: {refusals:?}"));
            assert!(!why.message("en").is_empty() && !why.advice("en").is_empty());
        }
        // Axes may share ENABLE, and unused wiring may be invalid.
        apply(&breakout, &[("parallel.enable".to_owned(), list(&[9, 9, 9]))]).unwrap();
        let changes = [("machine.output", word("virtual")), ("parallel.step", list(&[0, 0, 0]))];
        apply(&hobby_3018(), &changes.map(|(key, value)| (key.to_owned(), value))).unwrap();
    }

    #[test]
    fn phase_axis_may_be_mixed_with_step_axes() {
        let lists = [
            ("card.step", list(&[0, -1, 2])),
            ("card.direction", list(&[1, -1, 3])),
            ("machine.output", Value::Text("card".to_owned())),
            ("drive.direction_setup", Value::Number(45.0)),
        ];
        let changes = lists.map(|(key, value)| (key.to_owned(), value));
        let machine = apply(&hobby_3018(), &changes).unwrap();
        let driven = [0, 1, 2].map(|axis| machine.wiring().phase_bits(axis).len());
        assert_eq!(driven, [0, 8, 0]);
    }
}
