//! Wiring of a USB step adapter: sensors of its inputs, and active-low pins.
//!
//! ```text
//! outputs               steps               phases
//! axis of the adapter   0  1  2  3          0  1  2           X, Y, Z, and the second spindle's Z if present
//! inputs                0 … 7               0 … 3             one sensor each, or none
//! output 0, output 1    both                output 0          spindle; output for work commands, if named
//! ```

use super::field::{ADAPTER, FILE, Setting, fields, words};
use super::value::ValueKind::{Text, Wholes};
use super::{Machine, Output, UNWIRED};
use crate::code;
use crate::diagnostic::Diagnostic;
use crate::job::Input;

const AXES: usize = 4;

const INPUTS: usize = 8;

const LONGEST_FILTER_US: f64 = 10_000.0;

const MOST_SPINDLES: u32 = 2;

/// Its last input if it drives windings.
const LAST_INPUT_OF_PHASES: u8 = 3;

/// Highest step rate if it drives windings, steps per second.
const FASTEST_PHASES_HZ: u32 = 10_000;

/// Shortest and longest pulse, in µs.
const PULSE_US: (f64, f64) = (0.2, 3.3);

/// Highest step rate on all axes at once, steps per second.
const FASTEST_HZ: u32 = 500_000;

/// Longest time from a change of direction to the next step, in µs.
const LONGEST_SETUP_US: u32 = 6_500;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AdapterOutputs {
    Steps,
    /// Phases of three motors, from their tables.
    Phases,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterWiring {
    /// Serial port; empty to find it by its USB id.
    pub port: String,
    pub outputs: AdapterOutputs,
    /// Input of each of [`Input::OF_AXES`]; [`UNWIRED`] if none.
    pub sensors: Vec<i8>,
    /// 1 for each active-low sensor.
    pub sensors_low: Vec<i8>,
    /// Filter time of each sensor, in µs; 0 for no filter.
    pub filters_us: Vec<u16>,
    /// 1 for each axis with active-low STEP.
    pub steps_low: Vec<i8>,
    /// 1 for each axis with DIR high while it counts down.
    pub directions_low: Vec<i8>,
    /// Name of output 1 in work commands; empty if nothing is wired to it.
    pub output_name: String,
}

impl Default for AdapterWiring {
    fn default() -> Self {
        Self {
            port: String::new(),
            outputs: AdapterOutputs::Steps,
            sensors: vec![0, 1, 2, 3, 4, 5, UNWIRED],
            sensors_low: vec![0; Input::OF_AXES.len()],
            filters_us: vec![0; Input::OF_AXES.len()],
            steps_low: vec![0; AXES],
            directions_low: vec![0; AXES],
            output_name: String::new(),
        }
    }
}

impl AdapterWiring {
    pub fn sensor(&self, input: Input) -> Option<u8> {
        self.sensors.get(input as usize).and_then(|number| u8::try_from(*number).ok())
    }

    /// Converts the adapter's inputs to machine inputs ([`Input::bit`]); both are bit sets.
    pub fn inputs(&self, on: u16) -> u32 {
        let is_on = |input: &Input| self.sensor(*input).is_some_and(|number| on >> number & 1 == 1);
        Input::OF_AXES.into_iter().filter(is_on).fold(0, |inputs, input| inputs | input.bit())
    }

    /// Converts machine inputs ([`Input::bit`]) to the adapter's inputs; both are bit sets.
    pub fn wired(&self, inputs: u32) -> u8 {
        let wired = Input::OF_AXES.into_iter().filter(|input| inputs & input.bit() != 0);
        wired.filter_map(|input| self.sensor(input)).fold(0, |wired, number| wired | 1 << number)
    }

    /// Filter of each of the adapter's inputs, in µs.
    pub fn filters_us(&self) -> [u16; INPUTS] {
        let mut filters_us = [0; INPUTS];
        for input in Input::OF_AXES {
            let own = self.sensor(input).and_then(|number| filters_us.get_mut(usize::from(number)));
            if let (Some(own), Some(filter_us)) = (own, self.filters_us.get(input as usize)) {
                *own = *filter_us;
            }
        }
        filters_us
    }

    /// Bit set of the adapter's active-low inputs.
    pub fn low_inputs(&self) -> u8 {
        let low =
            Input::OF_AXES.into_iter().filter(|input| self.sensors_low.get(*input as usize) == Some(&1));
        low.filter_map(|input| self.sensor(input)).fold(0, |low, number| low | 1 << number)
    }
}

words!(AdapterOutputs: "steps" => AdapterOutputs::Steps, "phases" => AdapterOutputs::Phases);

/// The section "adapter" of the settings table.
pub(super) const ROWS: &[Setting] = fields! { Machine;
    ("adapter.port", "", Text(200), FILE, adapter.port)
    ("adapter.outputs", "", AdapterOutputs::KIND, ADAPTER, adapter.outputs)
    ("adapter.sensors", "", Wholes(-1.0, 7.0), ADAPTER, adapter.sensors)
    ("adapter.sensors_low", "", Wholes(0.0, 1.0), ADAPTER, adapter.sensors_low)
    ("adapter.filters", "µs", Wholes(0.0, LONGEST_FILTER_US), ADAPTER, adapter.filters_us)
    ("adapter.steps_low", "", Wholes(0.0, 1.0), ADAPTER, adapter.steps_low)
    ("adapter.directions_low", "", Wholes(0.0, 1.0), ADAPTER, adapter.directions_low)
    ("adapter.output_name", "", Text(32), ADAPTER, adapter.output_name)
};

fn refuse(code: &str, key: &str) -> Diagnostic {
    Diagnostic::error(code).with("key", key)
}

/// Problems of the wiring. If the machine uses another output, only the list lengths are checked.
pub(super) fn validate(machine: &Machine) -> Vec<Diagnostic> {
    let adapter = &machine.adapter;
    let mut diagnostics = Vec::new();
    let lengths = [
        ("adapter.sensors", adapter.sensors.len(), Input::OF_AXES.len()),
        ("adapter.sensors_low", adapter.sensors_low.len(), Input::OF_AXES.len()),
        ("adapter.filters", adapter.filters_us.len(), Input::OF_AXES.len()),
        ("adapter.steps_low", adapter.steps_low.len(), AXES),
        ("adapter.directions_low", adapter.directions_low.len(), AXES),
    ];
    for (key, found, wanted) in lengths {
        if found != wanted {
            diagnostics
                .push(refuse(code!("machine.card_length"), key).with("found", found).with("wanted", wanted));
        }
    }
    if machine.output == Output::Adapter {
        diagnostics.extend(sensors(machine));
        diagnostics.extend(beyond(machine));
        if adapter.outputs == AdapterOutputs::Phases {
            diagnostics.extend(without_pins(machine));
        }
    }
    diagnostics
}

/// Sensors that share an input, missing sensors that the machine needs, and a contact sensor with `overlap`,
/// which an adapter can't serve.
fn sensors(machine: &Machine) -> Vec<Diagnostic> {
    const KEY: &str = "adapter.sensors";
    let mut diagnostics = Vec::new();
    let wired: Vec<u8> =
        Input::OF_AXES.into_iter().filter_map(|input| machine.adapter.sensor(input)).collect();
    let twice = wired.iter().enumerate().find(|(at, number)| wired[..*at].contains(number));
    if let Some((_, number)) = twice {
        diagnostics.push(refuse(code!("machine.card_bit_twice"), KEY).with("bit", number).with("other", KEY));
    }
    for input in machine.needed_inputs().filter(|input| machine.adapter.sensor(*input).is_none()) {
        let why = refuse(code!("machine.card_sensor_unwired"), KEY);
        diagnostics.push(why.with("sensor", input.name()));
    }
    if machine.overlap.on && machine.adapter.sensor(Input::Contact).is_some() {
        diagnostics.push(refuse(code!("machine.adapter_contact"), KEY));
    }
    diagnostics
}

/// Wires without a pin if windings are driven.
fn without_pins(machine: &Machine) -> Vec<Diagnostic> {
    let adapter = &machine.adapter;
    let mut diagnostics = Vec::new();
    let wired = Input::OF_AXES.into_iter().filter_map(|input| adapter.sensor(input));
    if let Some(input) = wired.filter(|number| *number > LAST_INPUT_OF_PHASES).min() {
        let why = refuse(code!("machine.adapter_no_input"), "adapter.sensors").with("input", input);
        diagnostics.push(why.with("last", LAST_INPUT_OF_PHASES));
    }
    if !adapter.output_name.is_empty() {
        diagnostics.push(refuse(code!("machine.adapter_no_output"), "adapter.output_name"));
    }
    diagnostics
}

/// Demands beyond the adapter. Windings have no pulses.
fn beyond(machine: &Machine) -> Vec<Diagnostic> {
    let is_phases = machine.adapter.outputs == AdapterOutputs::Phases;
    let (spindles, fastest_hz) = if is_phases { (1, FASTEST_PHASES_HZ) } else { (MOST_SPINDLES, FASTEST_HZ) };
    let (shortest, longest) = PULSE_US;
    let rows = [
        ("machine.spindles", f64::from(machine.spindles), 1.0, f64::from(spindles)),
        ("drive.max_step_rate", f64::from(machine.max_step_hz), 1.0, f64::from(fastest_hz)),
        ("drive.pulse_width", machine.pulse_width_us, shortest, longest),
        ("drive.direction_setup", f64::from(machine.direction_setup_us), 0.0, f64::from(LONGEST_SETUP_US)),
    ];
    let count = if is_phases { 2 } else { rows.len() };
    let outside =
        rows.into_iter().take(count).filter(|(_, value, low, high)| !(*low..=*high).contains(value));
    outside
        .map(|(key, value, low, high)| {
            let why = refuse(code!("machine.adapter_beyond"), key).with("value", value);
            why.with("low", low).with("high", high)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::{Value, apply, lab, virtual_drill};
    use super::*;

    fn text(text: &str) -> Value {
        Value::Text(text.to_owned())
    }

    fn list(numbers: &[i32]) -> Value {
        Value::Numbers(numbers.iter().map(|number| f64::from(*number)).collect())
    }

    fn refused(changes: &[(&str, Value)]) -> Vec<(String, String)> {
        let changes: Vec<_> = changes.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
        let refusals = apply(&virtual_drill(), &changes).err().unwrap_or_default();
        let key = |why: &Diagnostic| {
            why.args.iter().find(|(name, _)| name == "key").map(|(_, key)| key.clone()).unwrap_or_default()
        };
        refusals.iter().map(|why| (why.code.clone(), key(why))).collect()
    }

    #[test]
    fn default_adapter_wiring_fits_the_virtual_drill() {
        assert_eq!(refused(&[("machine.output", text("adapter"))]), []);
    }

    #[test]
    fn impossible_adapter_settings_name_their_field() {
        let number = Value::Number;
        let rows: [(&str, Value, &str); 13] = [
            ("adapter.sensors", list(&[0, 1]), "machine.card_length"),
            ("adapter.steps_low", list(&[0, 0, 0]), "machine.card_length"),
            ("adapter.filters", list(&[0; 8]), "machine.card_length"),
            ("adapter.filters", list(&[0, 0, 0, 0, 0, 10_001, 0]), "machine.setting_range"),
            ("adapter.sensors", list(&[0, 1, 2, 3, 4, 8, -1]), "machine.setting_range"),
            ("adapter.sensors", list(&[0, 0, 2, 3, 4, 5, -1]), "machine.card_bit_twice"),
            ("adapter.sensors", list(&[-1, 1, 2, 3, 4, 5, -1]), "machine.card_sensor_unwired"),
            ("adapter.sensors", list(&[0, 1, 2, 3, 4, 5, 6]), "machine.adapter_contact"),
            ("machine.spindles", number(3.0), "machine.adapter_beyond"),
            ("drive.max_step_rate", number(500_001.0), "machine.adapter_beyond"),
            ("drive.pulse_width", number(3.4), "machine.adapter_beyond"),
            ("drive.pulse_width", number(0.1), "machine.adapter_beyond"),
            ("drive.direction_setup", number(6_501.0), "machine.adapter_beyond"),
        ];
        for (key, value, code) in rows {
            let found = refused(&[("machine.output", text("adapter")), (key, value.clone())]);
            assert!(found.contains(&(code.to_owned(), key.to_owned())), "{key} {value}: {found:?}");
        }
        // On the virtual drill this doesn't matter.
        assert_eq!(refused(&[("drive.pulse_width", number(3.4))]), []);
    }

    #[test]
    fn phase_adapter_fits_the_lab_drill_or_names_the_field() {
        let phases = |changes: &[(&str, Value)]| {
            let wired = [
                ("machine.output", text("adapter")),
                ("adapter.outputs", text("phases")),
                ("adapter.sensors", list(&[0, -1, 1, -1, 2, 3, -1])),
            ];
            let all = wired.iter().chain(changes).map(|(key, value)| ((*key).to_owned(), value.clone()));
            apply(&lab(), &all.collect::<Vec<_>>())
        };
        let machine = phases(&[]).unwrap();
        assert_eq!(machine.adapter.outputs, AdapterOutputs::Phases);
        assert!(machine.pulse_width_us > PULSE_US.1, "windings have no pulses");
        let rows: [(&str, Value, &str); 6] = [
            ("adapter.sensors", list(&[0, 1, 2, 3, 4, 5, -1]), "machine.adapter_no_input"),
            ("adapter.sensors", list(&[0, -1, 1, -1, 2, -1, -1]), "machine.card_sensor_unwired"),
            ("adapter.output_name", text("pump"), "machine.adapter_no_output"),
            ("machine.spindles", Value::Number(2.0), "machine.adapter_beyond"),
            ("drive.max_step_rate", Value::Number(10_001.0), "machine.adapter_beyond"),
            ("x.phases", list(&[5, 10, 9, 6]), "phases.jump"),
        ];
        for (key, value, code) in rows {
            let refusals = phases(&[(key, value)]).unwrap_err();
            let found =
                refusals.iter().find(|why| why.code == code).unwrap_or_else(|| panic!("{refusals:?}"));
            let message = found.message("en");
            assert!(message.contains(key) && !message.contains('{'), "{message}");
        }
    }

    #[test]
    fn inputs_are_mapped_in_both_directions() {
        let adapter = AdapterWiring {
            sensors: vec![7, -1, 2, -1, 0, 1, -1],
            sensors_low: vec![1, 1, 0, 0, 0, 1, 0],
            filters_us: vec![5, 6, 7, 8, 9, 10, 11],
            ..AdapterWiring::default()
        };
        assert_eq!(adapter.inputs(0b1000_0001), Input::XMin.bit() | Input::ZTop.bit());
        assert_eq!(adapter.wired(Input::XMin.bit() | Input::XMax.bit() | Input::YMin.bit()), 0b1000_0100);
        assert_eq!(adapter.low_inputs(), 0b1000_0010, "what is not wired is not low");
        assert_eq!(adapter.filters_us(), [9, 10, 7, 0, 0, 0, 0, 5]);
    }
}
