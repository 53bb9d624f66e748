//! The wiring of a digital I/O card or a parallel port: which byte and bit every signal is (A13).
//!
//! ```text
//! output byte       3        2        1        0          number of a bit = 8 · byte + bit
//! bits          31 … 24  23 … 16  15 …  8   7 …  0
//! as shipped    ·······S ·ba·2211 ·ba·2211 ·ba·2211       S spindle; a motor's phase byte lies bit for bit in one
//!                           Z        Y        X           output byte: b, a 24 V forcing, 1 and 2 the windings' halves
//! input byte                                 0
//! as shipped                        ··DU YyXx             end sensors of X and Y, up and down of Z; the contact unwired
//! ```
//!
//! Comes in: numbers of bits. Goes out: the wiring as data, its rows of the settings table, and every reason why it cannot
//! be. Does not know registers: what a byte is at is the business of whoever drives the card.

use super::settings::{Setting, Value, ValueKind};
use super::{Machine, Output, StrokeEnd};
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
pub struct Card {
    /// Path of the device: `/dev/port`, `/dev/parport0`, or an ordinary file for a rehearsal.
    pub device: String,
    /// Registers from the base address to the first output byte.
    pub outputs_at: u32,
    /// Registers from the base address to the first input byte.
    pub inputs_at: u32,
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
}

impl Default for Card {
    fn default() -> Self {
        let motor =
            |byte: i8| (0..8).map(move |bit| if bit == 4 || bit == 7 { UNWIRED } else { byte * 8 + bit });
        Self {
            device: "/dev/port".to_owned(),
            outputs_at: 0,
            inputs_at: 0,
            phases: [0, 1, 2].map(|byte| motor(byte).collect()),
            spindle: 24,
            outputs: Vec::new(),
            output_names: String::new(),
            sensors: vec![0, 1, 2, 3, 4, 5, UNWIRED],
            sensors_low: vec![0; Input::ALL.len()],
            start_stop_hz: 70,
        }
    }
}

impl Card {
    /// The input bit of `input`.
    pub fn sensor(&self, input: Input) -> i8 {
        self.sensors.get(input as usize).copied().unwrap_or(UNWIRED)
    }

    /// Names of the outputs that a work command may switch, by their place.
    pub fn names(&self) -> Vec<String> {
        self.output_names.split_whitespace().map(str::to_owned).collect()
    }
}

fn numbers(bits: &[i8]) -> Value {
    Value::Numbers(bits.iter().map(|bit| f64::from(*bit)).collect())
}

fn bits(value: &Value) -> Vec<i8> {
    let Value::Numbers(numbers) = value else { return Vec::new() };
    numbers.iter().map(|number| *number as i8).collect()
}

fn whole(value: &Value) -> f64 {
    if let Value::Number(number) = value { *number } else { 0.0 }
}

macro_rules! row {
    ($key:literal, $unit:literal, $kind:expr, $get:expr, $set:expr) => {
        Setting { key: $key, unit: $unit, kind: $kind, shapes_stream: false, get: $get, set: $set }
    };
}
macro_rules! list {
    ($key:literal, $low:literal, $high:literal, $($field:tt)+) => {
        row!($key, "", ValueKind::Wholes($low, $high), |m| numbers(&m.card.$($field)+), |m, v| m.card.$($field)+ = bits(v))
    };
}
macro_rules! count {
    ($key:literal, $unit:literal, $high:literal, $field:ident) => {
        row!(
            $key,
            $unit,
            ValueKind::Whole(0.0, $high),
            |m| Value::Number(f64::from(m.card.$field)),
            |m, v| m.card.$field = whole(v) as u32
        )
    };
}

/// The section "card" of the settings table.
pub(super) const ROWS: &[Setting] = &[
    row!("card.device", "", ValueKind::Text(200), |m| Value::Text(m.card.device.clone()), |m, v| {
        if let Value::Text(path) = v {
            m.card.device.clone_from(path);
        }
    }),
    count!("card.outputs_at", "", 255.0, outputs_at),
    count!("card.inputs_at", "", 255.0, inputs_at),
    list!("card.x", -1.0, 31.0, phases[0]),
    list!("card.y", -1.0, 31.0, phases[1]),
    list!("card.z", -1.0, 31.0, phases[2]),
    row!(
        "card.spindle",
        "",
        ValueKind::Whole(-1.0, 31.0),
        |m| Value::Number(f64::from(m.card.spindle)),
        |m, v| m.card.spindle = whole(v) as i8
    ),
    list!("card.outputs", 0.0, 31.0, outputs),
    row!(
        "card.output_names",
        "",
        ValueKind::Text(200),
        |m| Value::Text(m.card.output_names.clone()),
        |m, v| {
            if let Value::Text(names) = v {
                m.card.output_names.clone_from(names);
            }
        }
    ),
    list!("card.sensors", -1.0, 31.0, sensors),
    list!("card.sensors_low", 0.0, 1.0, sensors_low),
    count!("card.start_stop_rate", "Hz", 20_000.0, start_stop_hz),
];

/// The keys of a motor's phase bits.
const MOTORS: [&str; 3] = ["card.x", "card.y", "card.z"];

/// What a kind of hardware has.
struct Pinout {
    outputs: i8,
    inputs: i8,
}

fn pinout(output: Output) -> Pinout {
    match output {
        Output::Virtual | Output::Card | Output::Adapter => Pinout { outputs: 32, inputs: 32 },
        Output::Parallel => Pinout { outputs: 12, inputs: 5 },
    }
}

fn refuse(code: &str, key: &str) -> Diagnostic {
    Diagnostic::error(code).with("key", key)
}

/// Every reason why the wiring cannot be. A machine that is on no card may have any wiring of the right shape.
pub(super) fn validate(machine: &Machine) -> Vec<Diagnostic> {
    let card = &machine.card;
    let mut diagnostics = Vec::new();
    let lengths: [(&str, usize, usize); 6] = [
        (MOTORS[0], card.phases[0].len(), PHASE_BITS),
        (MOTORS[1], card.phases[1].len(), PHASE_BITS),
        (MOTORS[2], card.phases[2].len(), PHASE_BITS),
        ("card.sensors", card.sensors.len(), Input::ALL.len()),
        ("card.sensors_low", card.sensors_low.len(), Input::ALL.len()),
        ("card.outputs", card.outputs.len(), card.names().len()),
    ];
    for (key, found, wanted) in lengths {
        if found != wanted {
            diagnostics.push(refuse("machine.card_length", key).with("found", found).with("wanted", wanted));
        }
    }
    if matches!(machine.output, Output::Virtual | Output::Adapter) {
        return diagnostics;
    }
    diagnostics.extend(clashes(card, &pinout(machine.output)));
    diagnostics.extend(missing(machine));
    diagnostics
}

/// Bits that are not there, two signals on one bit, and motors that lie over two bytes: a byte is what is written at once.
fn clashes(card: &Card, pinout: &Pinout) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    let motors = MOTORS.iter().zip(&card.phases);
    let outputs = motors.flat_map(|(key, bits)| bits.iter().map(move |bit| (*key, *bit)));
    let named = card.outputs.iter().map(|bit| ("card.outputs", *bit));
    let outputs: Vec<_> = outputs.chain([("card.spindle", card.spindle)]).chain(named).collect();
    let inputs: Vec<_> = card.sensors.iter().map(|bit| ("card.sensors", *bit)).collect();
    for (signals, count) in [(outputs, pinout.outputs), (inputs, pinout.inputs)] {
        let mut owners: Vec<Option<&str>> = vec![None; usize::from(count.unsigned_abs())];
        for (key, bit) in signals.into_iter().filter(|(_, bit)| *bit != UNWIRED) {
            match usize::try_from(bit).ok().and_then(|bit| owners.get_mut(bit)) {
                None => {
                    let why = refuse("machine.card_bit_outside", key).with("bit", bit);
                    diagnostics.push(why.with("last", count - 1));
                }
                Some(Some(other)) => {
                    diagnostics
                        .push(refuse("machine.card_bit_twice", key).with("bit", bit).with("other", *other));
                }
                Some(free) => *free = Some(key),
            }
        }
    }
    for (key, bits) in MOTORS.iter().zip(&card.phases) {
        let mut bytes = bits.iter().filter(|bit| **bit >= 0).map(|bit| bit / 8);
        let first = bytes.next();
        if bytes.any(|byte| Some(byte) != first) {
            diagnostics.push(refuse("machine.card_two_bytes", key));
        }
    }
    diagnostics
}

/// Signals that the machine cannot do without.
fn missing(machine: &Machine) -> Vec<Diagnostic> {
    let card = &machine.card;
    let mut diagnostics = Vec::new();
    if card.device.is_empty() {
        diagnostics.push(refuse("machine.card_no_device", "card.device"));
    }
    if machine.spindles > 1 {
        diagnostics.push(refuse("machine.card_one_spindle", "card.z").with("spindles", machine.spindles));
    }
    for (index, key) in MOTORS.iter().enumerate() {
        let used = machine.axis(index).phases.columns.iter().fold(0, |used, column| used | column) & WINDINGS;
        for bit in (0..PHASE_BITS).filter(|bit| used >> bit & 1 == 1) {
            if card.phases[index].get(bit).is_none_or(|at| *at == UNWIRED) {
                diagnostics.push(refuse("machine.card_phase_unwired", key).with("phase", bit));
            }
        }
    }
    let mut needed: Vec<Input> = (0..3).map(|axis| machine.home_input(axis)).collect();
    if machine.stroke_end == StrokeEnd::Sensor {
        needed.push(Input::ZBottom);
    }
    for input in needed.into_iter().filter(|input| card.sensor(*input) == UNWIRED) {
        let why = refuse("machine.card_sensor_unwired", "card.sensors");
        diagnostics.push(why.with("sensor", format!("{input:?}")));
    }
    diagnostics
}

#[cfg(test)]
mod tests {
    use super::super::{apply, lab};
    use super::*;

    fn list(numbers: &[i32]) -> Value {
        Value::Numbers(numbers.iter().map(|number| f64::from(*number)).collect())
    }

    #[test]
    fn the_wiring_as_shipped_is_right_for_the_laboratory_drill() {
        let card = apply(&lab(), &[("machine.output".to_owned(), Value::Text("card".to_owned()))]).unwrap();
        assert_eq!(card.output, Output::Card);
        let wired = card.card.phases.iter().flatten().filter(|bit| **bit != UNWIRED).count();
        let sensed = card.card.sensors.iter().filter(|bit| **bit != UNWIRED).count();
        assert_eq!((wired, sensed), (18, 6), "as in Arendt's paper");
    }

    #[test]
    fn wrong_wirings_name_their_field() {
        let text = |text: &str| Value::Text(text.to_owned());
        let rows: [(&str, &str, Value, &str); 16] = [
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
            ("parallel", "card.z", list(&[8, 9, 10, 11, -1, -1, -1, -1]), "machine.card_bit_outside"),
        ];
        for (output, key, value, code) in rows {
            let changes = [("machine.output".to_owned(), text(output)), (key.to_owned(), value.clone())];
            let refusals = apply(&lab(), &changes).unwrap_err();
            let found = refusals.iter().find(|why| why.code == code);
            let found = found.unwrap_or_else(|| panic!("{key} {value}: {refusals:?}"));
            assert!(!found.advice("en").is_empty());
            // A name without a bit is told at the bits.
            let field = if key == "card.output_names" { "card.outputs" } else { key };
            let named = refusals.iter().any(|why| why.args.contains(&("key".to_owned(), field.to_owned())));
            assert!(named, "{key} {value}: {refusals:?}");
        }
    }

    #[test]
    fn a_parallel_port_has_room_for_three_motors_and_five_sensors() {
        let changes = [
            ("machine.output", Value::Text("parallel".to_owned())),
            ("card.device", Value::Text("/dev/parport0".to_owned())),
            ("card.x", list(&[0, 1, 2, 3, -1, -1, -1, -1])),
            ("card.y", list(&[4, 5, 6, 7, -1, -1, -1, -1])),
            ("card.z", list(&[8, 9, 10, 11, -1, -1, -1, -1])),
            ("card.spindle", Value::Number(-1.0)),
            ("card.sensors", list(&[0, -1, 1, -1, 2, 3, 4])),
        ];
        let machine = apply(&lab(), &changes.map(|(key, value)| (key.to_owned(), value))).unwrap();
        assert_eq!((machine.output, machine.card.sensor(Input::Contact)), (Output::Parallel, 4));
    }
}
