//! Wiring of outputs with bytes of outputs and inputs: the bit of every signal.
//!
//! ```text
//! output byte       3        2        1        0          bit number = 8 · byte + bit
//! bits          31 … 24  23 … 16  15 …  8   7 …  0
//! ```

use super::field::FieldValue;
use super::step_dir::MOTORS;
use super::value::Value;
use super::{Machine, StepDir, UNWIRED};
use crate::code;
use crate::diagnostic::Diagnostic;
use crate::job::Input;

const PHASE_BITS: usize = 8;

/// Bits of the winding halves, 5 V.
const WINDINGS: u8 = 0x0F;

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wiring {
    /// Path of the device: `/dev/port`, `/dev/parport0`, or a regular file for tests.
    pub device: String,
    /// X, Y, Z: output bit of each bit of the motor's phase byte, lowest first; [`UNWIRED`] if none.
    pub phases: [Vec<i8>; 3],
    /// Output bit of the spindle.
    pub spindle: i8,
    /// Output bits that work commands may switch.
    pub outputs: Vec<i8>,
    /// Their names in that order, separated by spaces.
    pub output_names: String,
    /// Input bit of each of [`Input::ALL`].
    pub sensors: Vec<i8>,
    /// 1 for each active-low input.
    pub sensors_low: Vec<i8>,
    /// Start–stop rate of all motors, steps per second: up to it, uneven pulses are harmless.
    pub start_stop_hz: u32,
    pub drivers: StepDir,
}

impl Wiring {
    /// Output bit of each phase bit of `axis`; empty if it has a STEP/DIR driver.
    pub fn phase_bits(&self, axis: usize) -> &[i8] {
        if self.drivers.counts(axis) { &[] } else { self.phases.get(axis).map_or(&[], Vec::as_slice) }
    }

    /// Every active output: the name of its row, and its bit, wired or not.
    pub fn signals(&self) -> impl Iterator<Item = (&'static str, i8)> {
        let motors = MOTORS.iter().enumerate();
        let phases =
            motors.flat_map(|(axis, name)| self.phase_bits(axis).iter().map(move |bit| (*name, *bit)));
        let named = self.outputs.iter().map(|bit| ("outputs", *bit));
        phases.chain(self.drivers.bits()).chain([("spindle", self.spindle)]).chain(named)
    }

    /// Active-low bits of output byte `byte`.
    pub fn low_bits(&self, byte: usize) -> u8 {
        let here = self.drivers.outputs_low.iter().filter_map(|bit| usize::try_from(*bit).ok());
        here.filter(|bit| bit / 8 == byte).fold(0, |low, bit| low | 1 << (bit % 8))
    }

    pub fn sensor(&self, input: Input) -> i8 {
        self.sensors.get(input as usize).copied().unwrap_or(UNWIRED)
    }

    /// Names of the outputs that work commands may switch, by index.
    pub fn names(&self) -> Vec<String> {
        self.output_names.split_whitespace().map(str::to_owned).collect()
    }
}

/// Older versions had fewer inputs: before presser foot and magazine, and before index pulses. Lists of these
/// lengths are from them.
const FEWER_INPUTS: [usize; 2] = [7, 13];

/// Extends a list from an older version to all of [`Input::ALL`], with `rest` for the new inputs.
pub(super) fn of_inputs<T: Clone>(mut numbers: Vec<T>, rest: T) -> Vec<T> {
    if FEWER_INPUTS.contains(&numbers.len()) {
        numbers.resize(Input::ALL.len(), rest);
    }
    numbers
}

/// Sets a list, perhaps from an older version.
pub(super) fn set_inputs(list: &mut Vec<i8>, value: &Value, rest: i8) {
    list.set(value);
    *list = of_inputs(std::mem::take(list), rest);
}

/// Rows of one wiring: device, then the rows of that hardware.
macro_rules! wiring_rows {
    ($section:ident; $($own:tt)+) => {
        fields! { Machine;
            (concat!(stringify!($section), ".device"), "", Text(200), FILE, $section.wiring.device)
            $($own)+
            (concat!(stringify!($section), ".x"), "", Wholes(-1.0, 31.0), FILE, $section.wiring.phases[0])
            (concat!(stringify!($section), ".y"), "", Wholes(-1.0, 31.0), FILE, $section.wiring.phases[1])
            (concat!(stringify!($section), ".z"), "", Wholes(-1.0, 31.0), FILE, $section.wiring.phases[2])
            (concat!(stringify!($section), ".spindle"), "", Whole(-1.0, 31.0), FILE, $section.wiring.spindle)
            (concat!(stringify!($section), ".outputs"), "", Wholes(0.0, 31.0), FILE, $section.wiring.outputs)
            (concat!(stringify!($section), ".output_names"), "", Text(200), FILE,
                $section.wiring.output_names)
            (concat!(stringify!($section), ".sensors"), "", Wholes(-1.0, 31.0), FILE;
                |m| Some(m.$section.wiring.sensors.value()),
                |m, v| set_inputs(&mut m.$section.wiring.sensors, v, UNWIRED))
            (concat!(stringify!($section), ".sensors_low"), "", Wholes(0.0, 1.0), FILE;
                |m| Some(m.$section.wiring.sensors_low.value()),
                |m, v| set_inputs(&mut m.$section.wiring.sensors_low, v, 0))
            (concat!(stringify!($section), ".start_stop_rate"), "Hz", Whole(0.0, 20_000.0), FILE.and(ADVANCED),
                $section.wiring.start_stop_hz)
            (concat!(stringify!($section), ".step"), "", Wholes(-1.0, 31.0), FILE,
                $section.wiring.drivers.steps)
            (concat!(stringify!($section), ".direction"), "", Wholes(-1.0, 31.0), FILE,
                $section.wiring.drivers.directions)
            (concat!(stringify!($section), ".enable"), "", Wholes(-1.0, 31.0), FILE,
                $section.wiring.drivers.enables)
            (concat!(stringify!($section), ".enable_delay"), "ms", Whole(0.0, 2_000.0), FILE.and(ADVANCED),
                $section.wiring.drivers.enable_delay_ms)
            (concat!(stringify!($section), ".outputs_low"), "", Wholes(0.0, 31.0), FILE,
                $section.wiring.drivers.outputs_low)
            (concat!(stringify!($section), ".step_length"), "ns", Wholes(0.0, 1_000_000.0), FILE.and(ADVANCED),
                $section.wiring.drivers.length_ns)
            (concat!(stringify!($section), ".step_space"), "ns", Wholes(0.0, 1_000_000.0), FILE.and(ADVANCED),
                $section.wiring.drivers.space_ns)
            (concat!(stringify!($section), ".direction_setup"), "ns", Wholes(0.0, 1_000_000.0), FILE.and(ADVANCED),
                $section.wiring.drivers.setup_ns)
            (concat!(stringify!($section), ".direction_hold"), "ns", Wholes(0.0, 1_000_000.0), FILE.and(ADVANCED),
                $section.wiring.drivers.hold_ns)
            (concat!(stringify!($section), ".charge_pump"), "", Whole(-1.0, 31.0), FILE.and(ADVANCED),
                $section.wiring.drivers.charge_pump)
            (concat!(stringify!($section), ".charge_pump_rate"), "Hz", Whole(100.0, 20_000.0), FILE.and(ADVANCED),
                $section.wiring.drivers.charge_pump_hz)
        }
    };
}
pub(super) use wiring_rows;

/// Pins of a kind of hardware, and its section of the settings table.
pub(super) struct Pinout {
    pub(super) section: &'static str,
    pub(super) outputs: i8,
    pub(super) inputs: i8,
}

impl Pinout {
    fn refuse(&self, code: &str, name: &str) -> Diagnostic {
        Diagnostic::error(code).with("key", format!("{}.{name}", self.section))
    }

    /// Problems of the wiring; if it isn't `in_use`, only the list lengths are checked.
    pub(super) fn validate(&self, wiring: &Wiring, machine: &Machine, in_use: bool) -> Vec<Diagnostic> {
        let mut diagnostics = self.lengths(wiring);
        if in_use {
            diagnostics.extend(self.clashes(wiring));
            diagnostics.extend(self.missing(wiring, machine));
            diagnostics.extend(wiring.drivers.validate(self.section, machine));
        }
        diagnostics
    }

    /// Lists with a wrong length.
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
                self.refuse(code!("machine.card_length"), name).with("found", found).with("wanted", wanted)
            })
            .collect()
    }

    /// Missing bits, signals that share a bit, and motors across two bytes, because a phase byte must be
    /// written at once.
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
                        let why = self.refuse(code!("machine.card_bit_outside"), name).with("bit", bit);
                        diagnostics.push(why.with("last", count - 1));
                    }
                    Some(Some(other)) => {
                        let why = self.refuse(code!("machine.card_bit_twice"), name).with("bit", bit);
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
                diagnostics.push(self.refuse(code!("machine.card_two_bytes"), name));
            }
        }
        diagnostics
    }

    /// Signals that `machine` needs.
    fn missing(&self, wiring: &Wiring, machine: &Machine) -> Vec<Diagnostic> {
        let mut diagnostics = Vec::new();
        if wiring.device.is_empty() {
            diagnostics.push(self.refuse(code!("machine.card_no_device"), "device"));
        }
        if machine.spindles > 1 {
            diagnostics
                .push(self.refuse(code!("machine.card_one_spindle"), "z").with("spindles", machine.spindles));
        }
        for (index, name) in MOTORS.iter().enumerate().filter(|(axis, _)| !wiring.drivers.counts(*axis)) {
            let columns = &machine.axis(index).phases.columns;
            let used = columns.iter().fold(0, |used, column| used | column) & WINDINGS;
            for bit in (0..PHASE_BITS).filter(|bit| used >> bit & 1 == 1) {
                if wiring.phases[index].get(bit).is_none_or(|at| *at == UNWIRED) {
                    diagnostics
                        .push(self.refuse(code!("machine.card_phase_unwired"), name).with("phase", bit));
                }
            }
        }
        for input in machine.needed_inputs().filter(|input| wiring.sensor(*input) == UNWIRED) {
            let why = self.refuse(code!("machine.card_sensor_unwired"), "sensors");
            diagnostics.push(why.with("sensor", input.name()));
        }
        diagnostics
    }
}
