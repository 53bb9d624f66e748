//! The wiring of whatever has bytes of outputs and inputs: which byte and bit every signal is (A13).
//!
//! ```text
//! output byte       3        2        1        0          number of a bit = 8 · byte + bit
//! bits          31 … 24  23 … 16  15 …  8   7 …  0
//! ```
//!
//! Comes in: numbers of bits. Goes out: the wiring as data, its rows of the settings table under the section of whatever is wired,
//! and every reason why it cannot be. Does not know registers, nor which hardware has the bytes.

use super::settings::Value;
use super::{Machine, StepDir};
use crate::diagnostic::Diagnostic;
use crate::job::Input;

/// A signal that is not wired.
pub const UNWIRED: i8 = -1;

/// Bits of a motor's phase byte.
const PHASE_BITS: usize = 8;

/// Those of them that drive the windings' halves, 5 V.
const WINDINGS: u8 = 0x0F;

/// How signals are wired to bits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wiring {
    /// Path of the device: `/dev/port`, `/dev/parport0`, or an ordinary file for a rehearsal.
    pub device: String,
    /// X, Y, Z: the output bit of each bit of the motor's phase byte, lowest first; [`UNWIRED`] where there is none.
    pub phases: [Vec<i8>; 3],
    /// The output bit that turns the spindle on.
    pub spindle: i8,
    /// Output bits that a work command may switch.
    pub outputs: Vec<i8>,
    /// Their names in the same order, with a space between two.
    pub output_names: String,
    /// The input bit of each of [`Input::ALL`], in its order.
    pub sensors: Vec<i8>,
    /// 1 for each of them that is on when its bit is 0.
    pub sensors_low: Vec<i8>,
    /// Rate that all motors start and stop at without a ramp, steps per second: up to it uneven pulses do no harm.
    pub start_stop_hz: u32,
    /// Drivers that count steps by themselves.
    pub drivers: StepDir,
}

impl Wiring {
    /// The output bit of each bit of the phase byte of `axis`; none where its driver counts steps by itself.
    pub fn phase_bits(&self, axis: usize) -> &[i8] {
        if self.drivers.counts(axis) { &[] } else { self.phases.get(axis).map_or(&[], Vec::as_slice) }
    }

    /// Every output that is in force: the name of its row, and its bit, wired or not.
    pub fn signals(&self) -> impl Iterator<Item = (&'static str, i8)> {
        let motors = MOTORS.iter().enumerate();
        let phases =
            motors.flat_map(|(axis, name)| self.phase_bits(axis).iter().map(move |bit| (*name, *bit)));
        let named = self.outputs.iter().map(|bit| ("outputs", *bit));
        phases.chain(self.drivers.bits()).chain([("spindle", self.spindle)]).chain(named)
    }

    /// The bits of output byte `byte` that are on when they are 0.
    pub fn low_bits(&self, byte: usize) -> u8 {
        let here = self.drivers.outputs_low.iter().filter_map(|bit| usize::try_from(*bit).ok());
        here.filter(|bit| bit / 8 == byte).fold(0, |low, bit| low | 1 << (bit % 8))
    }

    /// The input bit of `input`.
    pub fn sensor(&self, input: Input) -> i8 {
        self.sensors.get(input as usize).copied().unwrap_or(UNWIRED)
    }

    /// Names of the outputs that a work command may switch, by their place.
    pub fn names(&self) -> Vec<String> {
        self.output_names.split_whitespace().map(str::to_owned).collect()
    }
}

pub(super) fn numbers(bits: &[i8]) -> Value {
    Value::Numbers(bits.iter().map(|bit| f64::from(*bit)).collect())
}

pub(super) fn bits(value: &Value) -> Vec<i8> {
    let Value::Numbers(numbers) = value else { return Vec::new() };
    numbers.iter().map(|number| *number as i8).collect()
}

/// How many inputs there were before those of presser foot and magazine, and before index pulses: lists that are so long were
/// written then.
const FEWER_INPUTS: [usize; 2] = [7, 13];

/// A list with a number for each of [`Input::ALL`]; the further inputs of one that knows the first ones alone get `rest`.
pub(super) fn of_inputs<T: Clone>(mut numbers: Vec<T>, rest: T) -> Vec<T> {
    if FEWER_INPUTS.contains(&numbers.len()) {
        numbers.resize(Input::ALL.len(), rest);
    }
    numbers
}

pub(super) fn whole(value: &Value) -> f64 {
    if let Value::Number(number) = value { *number } else { 0.0 }
}

/// The rows of one wiring: those of its own hardware come behind its device.
macro_rules! wiring_rows {
    (@row $key:expr, $unit:literal, $kind:expr, $get:expr, $set:expr) => {
        Setting { key: $key, unit: $unit, kind: $kind, shapes_stream: false, get: $get, set: $set }
    };
    (@text $section:ident, $name:literal, $field:ident) => {
        wiring_rows!(@row concat!(stringify!($section), $name), "", ValueKind::Text(200),
            |m| Value::Text(m.$section.wiring.$field.clone()),
            |m, v| if let Value::Text(text) = v { m.$section.wiring.$field.clone_from(text); })
    };
    (@list $section:ident, $name:literal, $low:literal, $high:literal, $($field:tt)+) => {
        wiring_rows!(@row concat!(stringify!($section), $name), "", ValueKind::Wholes($low, $high),
            |m| numbers(&m.$section.wiring.$($field)+), |m, v| m.$section.wiring.$($field)+ = bits(v))
    };
    (@inputs $section:ident, $name:literal, $low:literal, $high:literal, $rest:expr, $field:ident) => {
        wiring_rows!(@row concat!(stringify!($section), $name), "", ValueKind::Wholes($low, $high),
            |m| numbers(&m.$section.wiring.$field), |m, v| m.$section.wiring.$field = of_inputs(bits(v), $rest))
    };
    (@whole $section:ident, $name:literal, $unit:literal, $low:literal, $high:literal, $($field:tt)+) => {
        wiring_rows!(@row concat!(stringify!($section), $name), $unit, ValueKind::Whole($low, $high),
            |m| Value::Number(f64::from(m.$section.wiring.$($field)+)),
            |m, v| m.$section.wiring.$($field)+ = whole(v) as u32)
    };
    (@times $section:ident, $name:literal, $field:ident) => {
        wiring_rows!(@row concat!(stringify!($section), $name), "ns", ValueKind::Wholes(0.0, 1_000_000.0),
            |m| times(&m.$section.wiring.drivers.$field),
            |m, v| m.$section.wiring.drivers.$field = read_times(v))
    };
    ($section:ident, $($own:expr),+) => {
        &[
            wiring_rows!(@text $section, ".device", device),
            $($own,)+
            wiring_rows!(@list $section, ".x", -1.0, 31.0, phases[0]),
            wiring_rows!(@list $section, ".y", -1.0, 31.0, phases[1]),
            wiring_rows!(@list $section, ".z", -1.0, 31.0, phases[2]),
            wiring_rows!(@row concat!(stringify!($section), ".spindle"), "", ValueKind::Whole(-1.0, 31.0),
                |m| Value::Number(f64::from(m.$section.wiring.spindle)),
                |m, v| m.$section.wiring.spindle = whole(v) as i8),
            wiring_rows!(@list $section, ".outputs", 0.0, 31.0, outputs),
            wiring_rows!(@text $section, ".output_names", output_names),
            wiring_rows!(@inputs $section, ".sensors", -1.0, 31.0, UNWIRED, sensors),
            wiring_rows!(@inputs $section, ".sensors_low", 0.0, 1.0, 0, sensors_low),
            wiring_rows!(@whole $section, ".start_stop_rate", "Hz", 0.0, 20_000.0, start_stop_hz),
            wiring_rows!(@list $section, ".step", -1.0, 31.0, drivers.steps),
            wiring_rows!(@list $section, ".direction", -1.0, 31.0, drivers.directions),
            wiring_rows!(@list $section, ".enable", -1.0, 31.0, drivers.enables),
            wiring_rows!(@whole $section, ".enable_delay", "ms", 0.0, 2_000.0, drivers.enable_delay_ms),
            wiring_rows!(@list $section, ".outputs_low", 0.0, 31.0, drivers.outputs_low),
            wiring_rows!(@times $section, ".step_length", length_ns),
            wiring_rows!(@times $section, ".step_space", space_ns),
            wiring_rows!(@times $section, ".direction_setup", setup_ns),
            wiring_rows!(@times $section, ".direction_hold", hold_ns),
            wiring_rows!(@row concat!(stringify!($section), ".charge_pump"), "", ValueKind::Whole(-1.0, 31.0),
                |m| Value::Number(f64::from(m.$section.wiring.drivers.charge_pump)),
                |m, v| m.$section.wiring.drivers.charge_pump = whole(v) as i8),
            wiring_rows!(@whole $section, ".charge_pump_rate", "Hz", 100.0, 20_000.0, drivers.charge_pump_hz),
        ]
    };
}
pub(super) use wiring_rows;

/// The names of a motor's phase bits in their section.
pub(super) const MOTORS: [&str; 3] = ["x", "y", "z"];

/// What a kind of hardware has, and the section of the table that its wiring stands in.
pub(super) struct Pinout {
    pub(super) section: &'static str,
    pub(super) outputs: i8,
    pub(super) inputs: i8,
}

impl Pinout {
    fn refuse(&self, code: &str, name: &str) -> Diagnostic {
        Diagnostic::error(code).with("key", format!("{}.{name}", self.section))
    }

    /// Every reason why `machine` cannot be wired so; what is not in use may have any wiring of the right shape.
    pub(super) fn validate(&self, wiring: &Wiring, machine: &Machine, in_use: bool) -> Vec<Diagnostic> {
        let mut diagnostics = self.lengths(wiring);
        if in_use {
            diagnostics.extend(self.clashes(wiring));
            diagnostics.extend(self.missing(wiring, machine));
            diagnostics.extend(wiring.drivers.validate(self.section, machine));
        }
        diagnostics
    }

    /// Every list that has the wrong length.
    fn lengths(&self, wiring: &Wiring) -> Vec<Diagnostic> {
        let lengths: [(&str, usize, usize); 6] = [
            (MOTORS[0], wiring.phases[0].len(), PHASE_BITS),
            (MOTORS[1], wiring.phases[1].len(), PHASE_BITS),
            (MOTORS[2], wiring.phases[2].len(), PHASE_BITS),
            ("sensors", wiring.sensors.len(), Input::ALL.len()),
            ("sensors_low", wiring.sensors_low.len(), Input::ALL.len()),
            ("outputs", wiring.outputs.len(), wiring.names().len()),
        ];
        let lengths = lengths.into_iter().chain(wiring.drivers.lengths());
        let wrong = lengths.filter(|(_, found, wanted)| found != wanted);
        wrong
            .map(|(name, found, wanted)| {
                self.refuse("machine.card_length", name).with("found", found).with("wanted", wanted)
            })
            .collect()
    }

    /// Bits that are not there, two signals on one bit, and motors that lie over two bytes: a byte is what is written at once.
    fn clashes(&self, wiring: &Wiring) -> Vec<Diagnostic> {
        let mut diagnostics = Vec::new();
        let outputs: Vec<_> = wiring.signals().collect();
        let inputs: Vec<_> = wiring.sensors.iter().map(|bit| ("sensors", *bit)).collect();
        let low: Vec<_> = wiring.drivers.outputs_low.iter().map(|bit| ("outputs_low", *bit)).collect();
        for (signals, count) in [(outputs, self.outputs), (inputs, self.inputs), (low, self.outputs)] {
            let mut owners: Vec<Option<&str>> = vec![None; usize::from(count.unsigned_abs())];
            for (name, bit) in signals.into_iter().filter(|(_, bit)| *bit != UNWIRED) {
                match usize::try_from(bit).ok().and_then(|bit| owners.get_mut(bit)) {
                    None => {
                        let why = self.refuse("machine.card_bit_outside", name).with("bit", bit);
                        diagnostics.push(why.with("last", count - 1));
                    }
                    Some(Some(other)) => {
                        let why = self.refuse("machine.card_bit_twice", name).with("bit", bit);
                        diagnostics.push(why.with("other", format!("{}.{other}", self.section)));
                    }
                    Some(free) => *free = Some(name),
                }
            }
        }
        for (axis, name) in MOTORS.iter().enumerate() {
            let mut bytes = wiring.phase_bits(axis).iter().filter(|bit| **bit >= 0).map(|bit| bit / 8);
            let first = bytes.next();
            if bytes.any(|byte| Some(byte) != first) {
                diagnostics.push(self.refuse("machine.card_two_bytes", name));
            }
        }
        diagnostics
    }

    /// Signals that `machine` cannot do without.
    fn missing(&self, wiring: &Wiring, machine: &Machine) -> Vec<Diagnostic> {
        let mut diagnostics = Vec::new();
        if wiring.device.is_empty() {
            diagnostics.push(self.refuse("machine.card_no_device", "device"));
        }
        if machine.spindles > 1 {
            diagnostics.push(self.refuse("machine.card_one_spindle", "z").with("spindles", machine.spindles));
        }
        for (index, name) in MOTORS.iter().enumerate().filter(|(axis, _)| !wiring.drivers.counts(*axis)) {
            let columns = &machine.axis(index).phases.columns;
            let used = columns.iter().fold(0, |used, column| used | column) & WINDINGS;
            for bit in (0..PHASE_BITS).filter(|bit| used >> bit & 1 == 1) {
                if wiring.phases[index].get(bit).is_none_or(|at| *at == UNWIRED) {
                    diagnostics.push(self.refuse("machine.card_phase_unwired", name).with("phase", bit));
                }
            }
        }
        for input in machine.needed_inputs().filter(|input| wiring.sensor(*input) == UNWIRED) {
            let why = self.refuse("machine.card_sensor_unwired", "sensors");
            diagnostics.push(why.with("sensor", format!("{input:?}")));
        }
        diagnostics
    }
}
