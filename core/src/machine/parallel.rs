//! A PC parallel port: its registers and its wiring.
//!
//! ```text
//! output bits 11 … 8 │ 7 … 0      input bits 4 … 0        default: Z │ Y X     contact, Z, Y, X
//! ```

use super::field::{ADVANCED, FILE, FieldValue, Setting, fields};
use super::value::ValueKind::{Text, Whole, Wholes};
use super::wiring::{Pinout, of_inputs, set_inputs, wiring_rows};
use super::{Machine, Output, StepDir, UNWIRED, Wiring};
use crate::diagnostic::Diagnostic;
use crate::job::Input;

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Parallel {
    /// Address of the first register, for access without the system's driver.
    pub address: u32,
    pub wiring: Wiring,
}

impl Default for Parallel {
    /// The first port of a PC: three motors without forcing, because there are too few bits, and no spindle.
    fn default() -> Self {
        let motor = |first: i8| (0..8).map(move |bit| if bit < 4 { first + bit } else { UNWIRED });
        let wiring = Wiring {
            device: "/dev/parport0".to_owned(),
            phases: [0, 4, 8].map(|first| motor(first).collect()),
            spindle: UNWIRED,
            outputs: Vec::new(),
            output_names: String::new(),
            sensors: of_inputs(vec![0, UNWIRED, 1, UNWIRED, 2, 3, 4], UNWIRED),
            sensors_low: vec![0; Input::ALL.len()],
            start_stop_hz: 70,
            drivers: StepDir::default(),
        };
        Self { address: 0x378, wiring }
    }
}

/// The section "parallel" of the settings table.
pub(super) const ROWS: &[Setting] = wiring_rows! { parallel;
    ("parallel.address", "", Whole(0.0, 65_535.0), FILE.and(ADVANCED), parallel.address)
};

const PINOUT: Pinout = Pinout { section: "parallel", outputs: 12, inputs: 5 };

/// Problems of the wiring. If the machine uses another output, only the list lengths are checked.
pub(super) fn validate(machine: &Machine) -> Vec<Diagnostic> {
    PINOUT.validate(&machine.parallel.wiring, machine, machine.output == Output::Parallel)
}

#[cfg(test)]
mod tests {
    use super::super::{Value, apply, lab};
    use super::*;

    #[test]
    fn default_port_has_three_motors_and_five_sensors() {
        let change = ("machine.output".to_owned(), Value::Text("parallel".to_owned()));
        let machine = apply(&lab(), &[change]).unwrap();
        assert_eq!(machine.output, Output::Parallel);
        let wiring = machine.wiring();
        assert_eq!((wiring.device.as_str(), wiring.sensor(Input::Contact)), ("/dev/parport0", 4));
        assert_eq!(wiring.phases.iter().flatten().filter(|bit| **bit != UNWIRED).count(), 12);
        assert_eq!(machine.card, lab().card, "what is said of a card stays as it is");
    }
}
