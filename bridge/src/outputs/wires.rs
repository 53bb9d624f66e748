//! `Pins` on wires: steps become phase bytes, or STEP and DIR; these become bits, and only changed bytes
//! are written.
//!
//! ```text
//! step X +   column 3 → 4   byte 0x49 ──▶ bits of `card.x` in the image ──▶ byte 0 differs from its shadow: written
//! no step for one interrupt byte 0x09     forcing off, windings hold; the same when stopped
//! safe                      0x09, spindle bit off
//! step Y +   STEP on ──▶ its length later STEP off ──▶ DIR, if the next step goes back (`step_dir`)
//! ```
//!
//! A changed input is read twice, so that one glitch does not count as a sensor.

use super::Port;
use super::bytes::{BYTES, Bit, Bytes, Image, Pump, SharedBytes, Trouble, turn_on};
use super::step_dir::{Driver, Edge};
use annulus_core::job::Input;
use annulus_core::machine::phases::{Commutator, FORCING};
use annulus_core::machine::{Machine, WIRED_AXES};
use annulus_core::pins::{AxisSet, Pins};
use annulus_core::steps::TICK_HZ;
use std::io;
use std::thread;
use std::time::{Duration, Instant};

/// Longest time between signs of life during motion, in ticks: 25 ms.
const BEAT: u64 = TICK_HZ / 40;

/// Longer waits sleep, except for their last part.
const WATCHED: Duration = Duration::from_micros(200);

enum Motor {
    Phases(Phases),
    /// A step/direction driver, which counts steps.
    Counts(Driver),
}

struct Phases {
    commutator: Commutator,
    /// Before the first step nothing is on.
    is_on: bool,
    /// Output bit of each bit of the phase byte.
    bits: Vec<Option<Bit>>,
    forced_at: u64,
}

struct Sensor {
    input: Input,
    at: Bit,
    low: bool,
}

/// A monotonic clock.
pub(super) type Now = Box<dyn Fn() -> Duration + Send>;

pub(crate) struct Wires {
    /// Declared before the bytes, so that it is dropped first.
    pump: Pump,
    bytes: SharedBytes,
    now: Now,
    motors: [Motor; WIRED_AXES],
    /// One interrupt, in ticks: longest forcing without another step.
    interrupt: u64,
    spindle: Option<Bit>,
    spins: bool,
    /// Switched outputs: bit, and whether it is on.
    switched: Vec<(Bit, bool)>,
    enables: Vec<Bit>,
    is_enabled: bool,
    enable_delay: Duration,
    /// Last sign of life during motion, in ticks; only with a charge pump.
    moves_since: Option<u64>,
    has_pump: bool,
    sensors: Vec<Sensor>,
    /// Input bytes after the glitch filter.
    believed: [Option<u8>; BYTES],
    trouble: Trouble,
}

impl Wires {
    /// The wires of `machine` at `port`. Turns every wired output off.
    pub(super) fn new(machine: &Machine, port: Box<dyn Port>) -> io::Result<Self> {
        let began = Instant::now();
        Self::timed(machine, port, Box::new(move || began.elapsed()))
    }

    pub(super) fn timed(machine: &Machine, port: Box<dyn Port>, now: Now) -> io::Result<Self> {
        let wiring = machine.wiring();
        let motor = |axis: usize| match Driver::of(&wiring.drivers, axis) {
            Some(driver) => Motor::Counts(driver),
            None => Motor::Phases(Phases {
                commutator: Commutator::new(machine.axis(axis).phases.clone(), 0),
                is_on: false,
                bits: wiring.phase_bits(axis).iter().map(|bit| Bit::of(*bit)).collect(),
                forced_at: 0,
            }),
        };
        let wired = |input: &Input| {
            let low = wiring.sensors_low.get(*input as usize) == Some(&1);
            Some(Sensor { input: *input, at: Bit::of(wiring.sensor(*input))?, low })
        };
        let sensors: Vec<_> = Input::ALL.iter().filter_map(wired).collect();
        let mut bytes = Bytes::new(wiring, port)?;
        let mut believed = [None; BYTES];
        for sensor in &sensors {
            // The glitch filter compares with the previous reading; this is its first.
            believed[sensor.at.byte] = Some(bytes.read(sensor.at.byte)?);
        }
        let trouble = bytes.trouble().clone();
        let bytes = SharedBytes::new(bytes);
        Ok(Self {
            pump: Pump::new(wiring, &bytes),
            bytes,
            now,
            motors: std::array::from_fn(motor),
            interrupt: TICK_HZ.div_ceil(u64::from(machine.interrupt_hz.max(1))),
            spindle: Bit::of(wiring.spindle),
            spins: false,
            switched: wiring.outputs.iter().filter_map(|bit| Some((Bit::of(*bit)?, false))).collect(),
            enables: wiring.drivers.enables.iter().filter_map(|bit| Bit::of(*bit)).collect(),
            is_enabled: false,
            enable_delay: Duration::from_millis(u64::from(wiring.drivers.enable_delay_ms)),
            moves_since: None,
            has_pump: Bit::of(wiring.drivers.charge_pump).is_some(),
            sensors,
            believed,
            trouble,
        })
    }

    pub(crate) fn trouble(&self) -> Trouble {
        self.trouble.clone()
    }

    fn image(&self) -> Image {
        let mut image = Image::default();
        for motor in &self.motors {
            match motor {
                Motor::Phases(motor) => motor.levels().for_each(|bit| turn_on(&mut image, bit)),
                Motor::Counts(driver) => driver.levels().for_each(|bit| turn_on(&mut image, bit)),
            }
        }
        let switched = self.switched.iter().filter(|(_, on)| *on).map(|(bit, _)| *bit);
        let enables = self.enables.iter().copied().filter(|_| self.is_enabled);
        let others = self.spindle.filter(|_| self.spins).into_iter().chain(switched).chain(enables);
        others.for_each(|bit| turn_on(&mut image, bit));
        image
    }

    fn put(&mut self) {
        let image = self.image();
        self.bytes.lock().put(image);
    }

    fn relax(&mut self, at_tick: u64) {
        for motor in &mut self.motors {
            if let Motor::Phases(motor) = motor
                && motor.forced_until(self.interrupt).is_some_and(|until| until <= at_tick)
            {
                motor.commutator.hold();
            }
        }
    }

    fn edges(&mut self, at_tick: u64) {
        for axis in 0..WIRED_AXES {
            while let Some((edge, after)) = self.driver(axis).and_then(|driver| driver.edge(at_tick)) {
                self.edge(axis, (edge, after), at_tick);
            }
        }
    }

    fn driver(&mut self, axis: usize) -> Option<&mut Driver> {
        match self.motors.get_mut(axis) {
            Some(Motor::Counts(driver)) => Some(driver),
            _ => None,
        }
    }

    /// Makes one edge of the driver of `axis`, once enough time has passed.
    fn edge(&mut self, axis: usize, (edge, after): (Edge, Duration), at_tick: u64) {
        self.wait_until(after);
        if let Some(driver) = self.driver(axis) {
            driver.make(edge, at_tick);
        }
        self.put();
        let now = (self.now)();
        if let Some(driver) = self.driver(axis) {
            driver.is_out(edge, now);
        }
    }

    fn wait_until(&self, moment: Duration) {
        loop {
            let left = moment.saturating_sub((self.now)());
            if left.is_zero() {
                return;
            }
            if left > WATCHED {
                thread::sleep(left - WATCHED);
            } else {
                std::hint::spin_loop();
            }
        }
    }

    /// Enables the drivers before their first step, and waits until they hold.
    fn enable(&mut self, axes: AxisSet) {
        let counts =
            |(axis, motor): (usize, &Motor)| axes >> axis & 1 == 1 && matches!(motor, Motor::Counts(_));
        if !self.is_enabled && self.motors.iter().enumerate().any(counts) {
            self.is_enabled = true;
            self.put();
            // A driver ignores steps until it has woken up.
            self.wait_until((self.now)() + self.enable_delay);
        }
    }

    /// Prepares the drivers of `axes` for a step: no pulse on and DIR right, both for long enough.
    fn prepare(&mut self, at_tick: u64, axes: AxisSet, forward: AxisSet) {
        self.enable(axes);
        let mut ready = Duration::ZERO;
        for axis in (0..WIRED_AXES).filter(|axis| axes >> axis & 1 == 1) {
            let up = forward >> axis & 1 == 1;
            while let Some((edge, after)) = self.driver(axis).map(|driver| driver.before_step(up)) {
                if edge == Edge::On {
                    ready = ready.max(after);
                    break;
                }
                self.edge(axis, (edge, after), at_tick);
            }
        }
        if ready > Duration::ZERO {
            self.wait_until(ready);
        }
    }

    fn end_pulses(&mut self, at_tick: u64) {
        for axis in 0..WIRED_AXES {
            if let Some(end) = self.driver(axis).and_then(|driver| driver.ends()) {
                self.edge(axis, end, at_tick);
            }
        }
    }

    /// Byte `byte` of the inputs: a bit changes only if it differs in two readings.
    fn read(&mut self, byte: usize) -> io::Result<u8> {
        let mut bytes = self.bytes.lock();
        let first = bytes.read(byte)?;
        let known = self.believed[byte].unwrap_or(first);
        if first == known {
            return Ok(known);
        }
        let second = bytes.read(byte)?;
        // A single differing reading may be noise from the motors or the spindle.
        let changed = (first ^ known) & (second ^ known);
        Ok(known ^ changed)
    }

    fn beat(&mut self, at_tick: u64) {
        if self.has_pump {
            self.pump.hear(self.moves_since.is_some());
            self.moves_since = self.moves_since.map(|_| at_tick);
        }
    }
}

impl Phases {
    fn byte(&self) -> u8 {
        if self.is_on { self.commutator.byte() } else { 0 }
    }

    fn levels(&self) -> impl Iterator<Item = Bit> {
        let byte = self.byte();
        let on = move |(index, bit): (usize, &Option<Bit>)| bit.filter(|_| byte >> index & 1 == 1);
        self.bits.iter().enumerate().filter_map(on)
    }

    fn step(&mut self, at_tick: u64, forward: bool) {
        self.commutator.step(forward);
        (self.is_on, self.forced_at) = (true, at_tick);
    }

    fn forced_until(&self, interrupt: u64) -> Option<u64> {
        (self.byte() & FORCING != 0).then(|| self.forced_at.saturating_add(interrupt))
    }
}

impl Pins for Wires {
    fn step(&mut self, at_tick: u64, axes: AxisSet, forward: AxisSet) {
        self.edges(at_tick);
        self.prepare(at_tick, axes, forward);
        for (axis, motor) in self.motors.iter_mut().enumerate() {
            match motor {
                _ if axes >> axis & 1 == 0 => {}
                Motor::Phases(motor) => motor.step(at_tick, forward >> axis & 1 == 1),
                Motor::Counts(driver) => driver.make(Edge::On, at_tick),
            }
        }
        self.relax(at_tick);
        self.put();
        for axis in (0..WIRED_AXES).filter(|axis| axes >> axis & 1 == 1) {
            // Taken after the write, so a pulse can only be longer than asked, never shorter.
            let now = (self.now)();
            if let Some(driver) = self.driver(axis) {
                driver.is_out(Edge::On, now);
            }
        }
        self.moves_since = Some(at_tick);
        self.beat(at_tick);
    }

    fn spindle(&mut self, _at_tick: u64, rpm: u32) {
        self.spins = rpm > 0;
        self.put();
    }

    fn inputs(&mut self, at_tick: u64) -> u32 {
        if self.due().is_some_and(|due| due <= at_tick) {
            self.attend(at_tick);
        }
        self.beat(at_tick);
        for byte in 0..BYTES {
            if self.believed[byte].is_none() || self.trouble.get().is_some() {
                continue;
            }
            match self.read(byte) {
                Ok(value) => self.believed[byte] = Some(value),
                Err(error) => drop(self.trouble.set(error.to_string())),
            }
        }
        let on = |sensor: &&Sensor| {
            let level = self.believed[sensor.at.byte].unwrap_or(0) & sensor.at.mask != 0;
            level != sensor.low
        };
        self.sensors.iter().filter(on).fold(0, |inputs, sensor| inputs | sensor.input.bit())
    }

    fn output(&mut self, _at_tick: u64, place: u8, on: bool) {
        if let Some((_, state)) = self.switched.get_mut(usize::from(place)) {
            *state = on;
        }
        self.put();
    }

    fn rest(&mut self, at_tick: u64) {
        self.end_pulses(at_tick);
        for motor in &mut self.motors {
            if let Motor::Phases(motor) = motor {
                motor.commutator.hold();
            }
        }
        self.put();
        self.beat(at_tick);
        // At rest the pump must go on without signs of life.
        if self.moves_since.take().is_some() {
            self.pump.hear(false);
        }
    }

    fn due(&self) -> Option<u64> {
        let motors = self.motors.iter().filter_map(|motor| match motor {
            Motor::Phases(motor) => motor.forced_until(self.interrupt),
            Motor::Counts(driver) => driver.due(),
        });
        let beat = self.moves_since.filter(|_| self.has_pump).map(|since| since.saturating_add(BEAT));
        motors.chain(beat).min()
    }

    fn ahead(&mut self, at_tick: u64, axes: AxisSet, forward: AxisSet) {
        self.enable(axes);
        for axis in (0..WIRED_AXES).filter(|axis| axes >> axis & 1 == 1) {
            if let Some(driver) = self.driver(axis) {
                driver.announce(forward >> axis & 1 == 1);
            }
        }
        self.edges(at_tick);
    }

    fn attend(&mut self, at_tick: u64) {
        self.relax(at_tick);
        self.put();
        self.edges(at_tick);
        self.beat(at_tick);
    }

    fn safe(&mut self) {
        self.spins = false;
        self.switched.iter_mut().for_each(|(_, on)| *on = false);
        self.rest(0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::job::{Mark, Stage, Switching};
    use annulus_core::machine::{Output, lab};
    use annulus_core::pins::{Clock, Motors, Operator, Order, Outcome, Playhead, play};
    use annulus_core::steps::{Run, Segment, Steps};
    use std::collections::VecDeque;
    use std::sync::{Arc, Mutex};

    /// A port that records its writes, and reads preset values.
    #[derive(Clone, Default)]
    struct Noted(Arc<Mutex<Notes>>);

    #[derive(Default)]
    struct Notes {
        written: Vec<(usize, u8)>,
        told: VecDeque<u8>,
        refuses: bool,
    }

    impl Noted {
        fn take(&self) -> Vec<(usize, u8)> {
            std::mem::take(&mut self.0.lock().unwrap().written)
        }
        fn say(&self, bytes: &[u8]) {
            self.0.lock().unwrap().told = bytes.iter().copied().collect();
        }
        fn fail(&self) {
            self.0.lock().unwrap().refuses = true;
        }
    }

    impl Port for Noted {
        fn write(&mut self, byte: usize, value: u8) -> io::Result<()> {
            let mut noted = self.0.lock().unwrap();
            if noted.refuses {
                return Err(io::ErrorKind::BrokenPipe.into());
            }
            noted.written.push((byte, value));
            Ok(())
        }
        fn read(&mut self, _: usize) -> io::Result<u8> {
            let mut noted = self.0.lock().unwrap();
            let next = noted.told.pop_front().unwrap_or(0);
            if noted.told.is_empty() {
                noted.told.push_back(next);
            }
            Ok(next)
        }
    }

    fn machine() -> Machine {
        Machine { output: Output::Card, ..lab() }
    }

    fn wires(machine: &Machine) -> (Wires, Noted) {
        let noted = Noted::default();
        (Wires::new(machine, Box::new(noted.clone())).unwrap(), noted)
    }

    #[test]
    fn outputs_start_off_and_a_step_writes_one_byte() {
        let (mut wires, noted) = wires(&machine());
        assert_eq!(noted.take(), [(0, 0), (1, 0), (2, 0), (3, 0)]);
        wires.step(10, 0b001, 0b001);
        assert_eq!(noted.take(), [(0, 0x25)]);
        wires.step(20, 0b001, 0b001);
        assert_eq!(noted.take(), [(0, 0x05)], "nothing is switched, nothing forced");
        wires.step(30, 0b001, 0b001);
        assert_eq!(noted.take(), [], "column 3 is the same byte");
        wires.step(35, 0b001, 0b001);
        assert_eq!(noted.take(), [(0, 0x49)], "2a to 2b, forced");
        wires.step(40, 0b011, 0b011);
        assert_eq!(noted.take(), [(0, 0x09), (1, 0x25)]);
        wires.spindle(50, 20_000);
        assert_eq!(noted.take(), [(3, 0x01)]);
        wires.spindle(60, 10_000);
        wires.rest(70);
        assert_eq!(noted.take(), [(1, 0x05)]);
        wires.safe();
        assert_eq!(noted.take(), [(3, 0x00)]);
        wires.safe();
        assert_eq!(noted.take(), [], "twice is as good as once");
    }

    #[test]
    fn phases_match_the_printed_table_and_mirror_it_backward() {
        let (mut wires, noted) = wires(&machine());
        let printed = [0x25, 0x05, 0x05, 0x49, 0x09, 0x09, 0x2A, 0x0A, 0x0A, 0x46, 0x06, 0x06];
        noted.take();
        let mut seen = Vec::new();
        for tick in 0..24 {
            wires.step(tick, 0b100, 0b100);
            seen.push(wires.image()[2]);
        }
        assert_eq!(seen[..12], printed);
        assert_eq!(seen[12..], printed);
        let mut seen = Vec::new();
        for tick in 24..36 {
            wires.step(tick, 0b100, 0);
            seen.push(wires.image()[2]);
        }
        // From column 12 back: 2b replaces 2a.
        assert_eq!(
            seen,
            [0x06, 0x06, 0x4A, 0x0A, 0x0A, 0x29, 0x09, 0x09, 0x45, 0x05, 0x05, 0x26],
            "each half is forced where it comes on"
        );
        assert_eq!(wires.image()[0..2], [0, 0], "nothing else moved");
    }

    #[test]
    fn named_outputs_are_switched_and_safe_turns_them_off() {
        let mut named = machine();
        named.card.wiring.outputs = vec![31, 25];
        let (mut wires, noted) = wires(&named);
        noted.take();
        wires.output(1, 0, true);
        wires.output(2, 1, true);
        wires.output(3, 7, true);
        wires.spindle(4, 9);
        wires.output(5, 0, false);
        wires.safe();
        assert_eq!(noted.take(), [(3, 0x80), (3, 0x82), (3, 0x83), (3, 0x03), (3, 0x00)]);
    }

    #[test]
    fn forcing_ends_after_one_interrupt_or_at_rest() {
        let (mut wires, noted) = wires(&machine());
        let interrupt = wires.interrupt;
        assert_eq!((interrupt, wires.due()), (20_000, None), "500 Hz");
        wires.step(1_000, 0b111, 0b111);
        noted.take();
        assert_eq!(wires.image()[..3], [0x25, 0x25, 0x25]);
        assert_eq!(wires.due(), Some(1_000 + interrupt));
        assert_eq!(wires.inputs(999 + interrupt), 0);
        assert_eq!(noted.take(), [], "not yet");
        wires.step(1_000 + interrupt, 0b010, 0b010);
        assert_eq!(noted.take(), [(0, 0x05), (1, 0x05), (2, 0x05)], "X and Z had no step meanwhile");
        assert_eq!(wires.due(), None);
        wires.step(2_000 + interrupt, 0b001, 0b000);
        assert_eq!(wires.image()[0], 0x26);
        wires.rest(2_001 + interrupt);
        assert_eq!(wires.image(), [0x06, 0x05, 0x05, 0]);
        wires.step(3 * interrupt, 0b001, 0b000);
        wires.step(4 * interrupt, 0b001, 0b000);
        wires.step(5 * interrupt, 0b001, 0b000);
        noted.take();
        assert_eq!(wires.image()[0], 0x4A, "column 9, forced where it comes from column 10");
        wires.attend(6 * interrupt);
        assert_eq!(noted.take(), [(0, 0x0A)]);
    }

    /// A clock that never waits.
    struct Free(u64);

    impl Clock for Free {
        fn now(&mut self) -> u64 {
            self.0
        }
        fn wait_until(&mut self, tick: u64) -> u64 {
            self.0 = self.0.max(tick);
            self.0
        }
    }

    /// An operator that never interferes.
    struct Idle;

    impl Operator for Idle {
        fn order(&mut self) -> Order {
            Order::Go
        }
        fn passed(&mut self, _: u64, _: &Steps, _: u32) {}
    }

    struct Watched(Wires, Vec<(u64, u8)>);

    impl Watched {
        fn note(&mut self, tick: u64) {
            let byte = self.0.image()[0];
            if self.1.last().is_none_or(|(_, last)| *last != byte) {
                self.1.push((tick, byte));
            }
        }
    }

    impl Pins for Watched {
        fn step(&mut self, at_tick: u64, axes: AxisSet, forward: AxisSet) {
            self.0.step(at_tick, axes, forward);
            self.note(at_tick);
        }
        fn spindle(&mut self, _: u64, _: u32) {}
        fn inputs(&mut self, at_tick: u64) -> u32 {
            let inputs = self.0.inputs(at_tick);
            self.note(at_tick);
            inputs
        }
        fn due(&self) -> Option<u64> {
            self.0.due()
        }
        fn attend(&mut self, at_tick: u64) {
            self.0.attend(at_tick);
            self.note(at_tick);
        }
        fn safe(&mut self) {}
    }

    #[test]
    fn fast_steps_are_forced_until_the_next_step() {
        // Steps every 14 ms, as at the start of the laboratory drill, and every 1.5 ms.
        let run = |interval, count| Run::even(1, true, interval, count);
        let segment = Segment {
            leg: 0,
            mark: Mark::Prepare,
            stage: Stage::Travel,
            duration_ticks: 1_000_000,
            runs: vec![run(140_000, 4), run(15_000, 4)],
            effect: Switching::None,
            gate: None,
            end: [8, 0, 0, 0, 0, 0, 0, 0],
        };
        let (wires, _) = wires(&machine());
        let mut pins = Watched(wires, Vec::new());
        let motors = Motors::of(&machine());
        let mut line = Playhead::default();
        let outcome = play(&segment, &motors, &mut line, &mut pins, &mut Free(0), &mut Idle);
        assert_eq!(outcome, Outcome::Completed);
        let expected = [
            (0, 0x00),
            (140_000, 0x25),
            (160_000, 0x05),
            (560_000, 0x49),
            (575_000, 0x09),
            (605_000, 0x2A),
            (620_000, 0x0A),
        ];
        assert_eq!(pins.1, expected);
    }

    #[test]
    fn sensors_follow_the_wiring_and_single_samples_are_ignored() {
        let mut turned = machine();
        turned.card.wiring.sensors = vec![7, 1, 2, 3, 4, 5, -1];
        turned.card.wiring.sensors_low = vec![0, 0, 0, 0, 1, 0, 0];
        let (mut wires, noted) = wires(&turned);
        let top = Input::ZTop.bit();
        assert_eq!(wires.inputs(0), top, "a low sensor is on at 0");
        noted.say(&[0x92, 0x92]);
        assert_eq!(wires.inputs(1), Input::XMin.bit() | Input::XMax.bit());
        noted.say(&[0x92, 0x96, 0x92]);
        for _ in 0..3 {
            assert_eq!(wires.inputs(2), Input::XMin.bit() | Input::XMax.bit(), "one sample is a glitch");
        }
        noted.say(&[0x96, 0x97]);
        assert_eq!(wires.inputs(3), Input::XMin.bit() | Input::XMax.bit() | Input::YMin.bit());
    }

    #[test]
    fn failed_port_is_reported_and_not_written_again() {
        let (mut wires, noted) = wires(&machine());
        let trouble = wires.trouble();
        noted.take();
        noted.fail();
        wires.step(1, 0b001, 0b001);
        wires.step(2, 0b001, 0b001);
        assert!(trouble.get().is_some_and(|why| why.contains("pipe")), "{trouble:?}");
        assert_eq!(noted.take(), []);
    }
}
