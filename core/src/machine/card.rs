//! A digital I/O card: its registers and its wiring.
//!
//! ```text
//! bits          31 … 24  23 … 16  15 …  8   7 …  0
//! default       ·······S ·ba·2211 ·ba·2211 ·ba·2211       S spindle; a phase byte is one output
//!                           Z        Y        X           byte: b, a 24 V, 1, 2 winding halves
//! input byte                                 0
//! default                           ··DU YyXx             limits of X, Y, Z; contact unwired
//! ```

use super::field::{ADVANCED, FILE, FieldValue, Setting, fields};
use super::value::ValueKind::{Text, Whole, Wholes};
use super::wiring::{Pinout, of_inputs, set_inputs, wiring_rows};
use super::{Machine, Output, StepDir, UNWIRED, Wiring};
use crate::diagnostic::Diagnostic;
use crate::job::Input;

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Card {
    /// Registers from the base address to the first output byte.
    pub outputs_at: u32,
    /// Registers from the base address to the first input byte.
    pub inputs_at: u32,
    pub wiring: Wiring,
}

impl Default for Card {
    fn default() -> Self {
        let motor =
            |byte: i8| (0..8).map(move |bit| if bit == 4 || bit == 7 { UNWIRED } else { byte * 8 + bit });
        let wiring = Wiring {
            device: "/dev/port".to_owned(),
            phases: [0, 1, 2].map(|byte| motor(byte).collect()),
            spindle: 24,
            outputs: Vec::new(),
            output_names: String::new(),
            sensors: of_inputs(vec![0, 1, 2, 3, 4, 5, UNWIRED], UNWIRED),
            sensors_low: vec![0; Input::ALL.len()],
            start_stop_hz: 70,
            drivers: StepDir::default(),
        };
        Self { outputs_at: 0, inputs_at: 0, wiring }
    }
}

/// The section "card" of the settings table.
pub(super) const ROWS: &[Setting] = wiring_rows! { card;
    ("card.outputs_at", "", Whole(0.0, 255.0), FILE.and(ADVANCED), card.outputs_at)
    ("card.inputs_at", "", Whole(0.0, 255.0), FILE.and(ADVANCED), card.inputs_at)
};

const PINOUT: Pinout = Pinout { section: "card", outputs: 32, inputs: 32 };

/// Problems of the wiring. If the machine uses another output, only the list lengths are checked.
pub(super) fn validate(machine: &Machine) -> Vec<Diagnostic> {
    PINOUT.validate(&machine.card.wiring, machine, machine.output == Output::Card)
}

#[cfg(test)]
mod tests {
    use super::super::{Value, apply, lab};
    use super::*;

    fn list(numbers: &[i32]) -> Value {
        Value::Numbers(numbers.iter().map(|number| f64::from(*number)).collect())
    }

    #[test]
    fn default_card_wiring_fits_the_lab_drill() {
        let card = apply(&lab(), &[("machine.output".to_owned(), Value::Text("card".to_owned()))]).unwrap();
        assert_eq!(card.output, Output::Card);
        let wired = card.card.wiring.phases.iter().flatten().filter(|bit| **bit != UNWIRED).count();
        let sensed = card.card.wiring.sensors.iter().filter(|bit| **bit != UNWIRED).count();
        assert_eq!((wired, sensed), (18, 6), "as in Arendt's paper");
    }

    #[test]
    fn wrong_wirings_name_their_field() {
        let text = |text: &str| Value::Text(text.to_owned());
        let rows: [(&str, &str, Value, &str); 19] = [
            ("card", "card.outputs", list(&[25]), "machine.card_length"),
            ("virtual", "card.output_names", text("pump light"), "machine.card_length"),
            ("card", "card.x", list(&[0, 1, 2, 3, -1, 5, 6]), "machine.card_length"),
            ("virtual", "card.sensors", list(&[1, 2]), "machine.card_length"),
            ("card", "card.sensors_low", list(&[0; 8]), "machine.card_length"),
            ("card", "card.x", list(&[0, 1, 2, 32, -1, 5, 6, -1]), "machine.setting_range"),
            ("card", "card.spindle", Value::Number(-2.0), "machine.setting_range"),
            ("card", "card.x", list(&[8, 1, 2, 3, -1, 5, 6, -1]), "machine.card_bit_twice"),
            ("card", "card.x", list(&[0, 0, 2, 3, -1, 5, 6, -1]), "machine.card_bit_twice"),
            ("card", "card.spindle", Value::Number(3.0), "machine.card_bit_twice"),
            ("card", "card.sensors", list(&[0, 1, 2, 3, 4, 4, -1]), "machine.card_bit_twice"),
            ("card", "card.x", list(&[0, 1, 2, 3, -1, 25, 26, -1]), "machine.card_two_bytes"),
            ("card", "card.z", list(&[16, 17, 18, -1, -1, 21, 22, -1]), "machine.card_phase_unwired"),
            ("card", "card.sensors", list(&[-1, 1, 2, 3, 4, 5, -1]), "machine.card_sensor_unwired"),
            ("card", "card.device", text(""), "machine.card_no_device"),
            ("parallel", "parallel.z", list(&[8, 9, 10, 12, -1, -1, -1, -1]), "machine.card_bit_outside"),
            ("parallel", "parallel.sensors", list(&[0, -1, 1, -1, 2, 5, 4]), "machine.card_bit_outside"),
            ("parallel", "parallel.spindle", Value::Number(3.0), "machine.card_bit_twice"),
            ("virtual", "parallel.x", list(&[1]), "machine.card_length"),
        ];
        for (output, key, value, code) in rows {
            let changes = [("machine.output".to_owned(), text(output)), (key.to_owned(), value.clone())];
            let refusals = apply(&lab(), &changes).unwrap_err();
            let found = refusals.iter().find(|why| why.code == code);
            let found = found.unwrap_or_else(|| panic!("{key} {value}: {refusals:?}"));
            assert!(!found.advice("en").is_empty());
            // A name without a bit is reported at the bits.
            let field = if key == "card.output_names" { "card.outputs" } else { key };
            let named = refusals.iter().any(|why| why.args.contains(&("key".to_owned(), field.to_owned())));
            assert!(named, "{key} {value}: {refusals:?}");
        }
    }
}
