//! Compares the edges of STEP, DIR and ENABLE at the wires with their stream, to the tick in stream time.
//! Includes a computer that is delayed between any two writes.
//!
//! Tests only, on the shipped boards; the port records the real time of every change.

use super::Port;
use super::wires::Wires;
use annulus_core::chance::Chance;
use annulus_core::geometry::Point;
use annulus_core::machine::{Machine, StepDir, Steps, Value, apply, preset};
use annulus_core::motion::bench::holes_at;
use annulus_core::pins::{Clock, Motors, Operator, Order, Outcome, Pins, Playhead, play};
use annulus_core::steps::{StepStream, replay_stream, stream_of};
use std::io;
use std::sync::{Arc, Mutex};
use std::time::Duration;

const TICK_NS: u64 = 100;

/// A simulated computer: its time, its writes, and its delays.
struct Computer {
    now_ns: u64,
    look_ns: u64,
    held_up: Option<Chance>,
    written: Vec<(u64, usize, u8)>,
}

impl Computer {
    fn new(look_ns: u64, held_up: Option<Chance>) -> Arc<Mutex<Self>> {
        Arc::new(Mutex::new(Self { now_ns: 0, look_ns, held_up, written: Vec::new() }))
    }

    /// Once in eight times, delays for up to a millisecond.
    fn hold_up(&mut self) {
        if let Some(chance) = &mut self.held_up
            && chance.below(8) == 0
        {
            self.now_ns += chance.below(1_000_000) as u64;
        }
    }
}

#[derive(Clone)]
struct Bench(Arc<Mutex<Computer>>);

impl Port for Bench {
    fn write(&mut self, byte: usize, value: u8) -> io::Result<()> {
        let mut computer = self.0.lock().unwrap();
        computer.hold_up();
        let now_ns = computer.now_ns;
        computer.written.push((now_ns, byte, value));
        computer.hold_up();
        Ok(())
    }
    fn read(&mut self, _: usize) -> io::Result<u8> {
        Ok(0xFF)
    }
}

impl Clock for Bench {
    fn now(&mut self) -> u64 {
        self.0.lock().unwrap().now_ns / TICK_NS
    }
    fn wait_until(&mut self, tick: u64) -> u64 {
        let mut computer = self.0.lock().unwrap();
        computer.now_ns = computer.now_ns.max(tick * TICK_NS);
        computer.hold_up();
        (computer.now_ns / TICK_NS).max(tick)
    }
}

struct Idle;

impl Operator for Idle {
    fn order(&mut self) -> Order {
        Order::Go
    }
    fn passed(&mut self, _: u64, _: &Steps, _: u32) {}
}

/// The board `name`, without delays in real time.
fn board(name: &str) -> Machine {
    let changes =
        [("parallel.enable_delay", 0.0), ("parallel.charge_pump", -1.0), ("spindle.spin_up", 100.0)];
    let changes = changes.map(|(key, number)| (key.to_owned(), Value::Number(number)));
    apply(&preset(name).unwrap(), &changes).unwrap()
}

fn holes(machine: &Machine) -> StepStream {
    let places = [(3.1, 2.0), (9.7, 2.0), (9.7, 7.3), (1.0, 8.8), (0.0, 0.0)];
    stream_of(&holes_at(machine, places.map(|(x, y)| Point::from_mm(x, y)).into_iter()), machine).unwrap()
}

fn run(machine: &Machine, stream: &StepStream, computer: &Arc<Mutex<Computer>>) {
    let bench = Bench(Arc::clone(computer));
    let looked = Arc::clone(computer);
    let now = move || {
        let mut computer = looked.lock().unwrap();
        computer.now_ns += computer.look_ns;
        Duration::from_nanos(computer.now_ns)
    };
    let mut wires = Wires::timed(machine, Box::new(bench.clone()), Box::new(now)).unwrap();
    let motors = Motors { start_stop_hz: f64::INFINITY, ..Motors::of(machine) };
    let (mut line, mut clock) = (Playhead { position: stream.start, ..Playhead::default() }, bench);
    for segment in &stream.segments {
        let outcome = play(segment, &motors, &mut line, &mut wires, &mut clock, &mut Idle);
        assert_eq!(outcome, Outcome::Completed);
        wires.rest(line.tick);
    }
}

/// Changes of the signal at `bit`: time in ns, and level, corrected for active-low signals.
fn edges(written: &[(u64, usize, u8)], bit: i8, drivers: &StepDir) -> Vec<(u64, bool)> {
    let (byte, mask) = (bit as usize / 8, 1 << (bit % 8));
    let low = drivers.outputs_low.contains(&bit);
    let mut edges = Vec::new();
    let mut level = false;
    for (at_ns, _, value) in written.iter().filter(|(_, at, _)| *at == byte) {
        let now = (value & mask != 0) != low;
        if now != level {
            level = now;
            edges.push((*at_ns, now));
        }
    }
    edges
}

/// The signals of `axis`: on and off times of STEP with the level of DIR, and the changes of DIR.
struct Seen {
    pulses: Vec<(u64, u64, bool)>,
    turns: Vec<u64>,
}

fn seen(written: &[(u64, usize, u8)], drivers: &StepDir, axis: usize) -> Seen {
    let steps = edges(written, drivers.steps[axis], drivers);
    let directions = edges(written, drivers.directions[axis], drivers);
    let up = |at_ns: u64| directions.iter().rev().find(|(at, _)| *at <= at_ns).is_some_and(|(_, up)| *up);
    let pulses = steps.chunks(2).map(|edges| {
        assert!(matches!(edges, [(_, true), (_, false)]), "every pulse ends: {edges:?}");
        (edges[0].0, edges[1].0, up(edges[0].0))
    });
    Seen { pulses: pulses.collect(), turns: directions.iter().map(|(at, _)| *at).collect() }
}

/// The shortest times of `axis` in ns: pulse length, space, setup and hold.
fn least(seen: &Seen) -> [u64; 4] {
    let shortest = |times: &mut dyn Iterator<Item = u64>| times.min().unwrap_or(u64::MAX);
    let pulses = &seen.pulses;
    let setups = seen
        .turns
        .iter()
        .filter_map(|turn| pulses.iter().find(|(on, ..)| on >= turn).map(|(on, ..)| on - turn));
    let holds = seen.turns.iter().filter_map(|turn| {
        pulses.iter().rev().find(|(on, ..)| on <= turn).map(|(_, off, _)| turn.saturating_sub(*off))
    });
    [
        shortest(&mut pulses.iter().map(|(on, off, _)| off - on)),
        shortest(&mut pulses.windows(2).map(|pair| pair[1].0 - pair[0].1)),
        shortest(&mut { setups }),
        shortest(&mut { holds }),
    ]
}

fn asked(drivers: &StepDir, axis: usize) -> [u64; 4] {
    [&drivers.length_ns, &drivers.space_ns, &drivers.setup_ns, &drivers.hold_ns]
        .map(|list| u64::from(list[axis]))
}

#[test]
fn every_step_edge_is_at_its_tick_in_the_stream() {
    for name in ["breakout", "tb6560", "g540"] {
        let machine = board(name);
        let drivers = &machine.wiring().drivers;
        let stream = holes(&machine);
        let computer = Computer::new(1, None);
        run(&machine, &stream, &computer);
        let written = std::mem::take(&mut computer.lock().unwrap().written);
        for axis in 0..3 {
            let pulses = replay_stream(&stream).filter(|pulse| pulse.axes >> axis & 1 == 1);
            let wanted: Vec<_> = pulses.map(|pulse| (pulse.tick, pulse.forward >> axis & 1 == 1)).collect();
            let seen = seen(&written, drivers, axis);
            let found: Vec<_> = seen.pulses.iter().map(|(on, _, up)| (on / TICK_NS, *up)).collect();
            assert_eq!(found, wanted, "{name}, axis {axis}: {} steps", wanted.len());
            assert!(wanted.len() > 500 && seen.turns.len() >= 2, "{name}, axis {axis}");
            let length = u64::from(drivers.length_ns[axis]);
            let longest = seen.pulses.iter().map(|(on, off, _)| off - on).max().unwrap();
            assert!((length..length + TICK_NS).contains(&longest), "{name}: {longest} ns");
            let net = seen.pulses.iter().map(|(.., up)| if *up { 1 } else { -1 }).sum::<i64>();
            let end = stream.segments.last().unwrap().end[axis] - stream.start[axis];
            assert_eq!(net, end, "{name}, axis {axis}");
            for (least, asked) in least(&seen).into_iter().zip(asked(drivers, axis)) {
                assert!(least >= asked, "{name}, axis {axis}: {least} ns of {asked}");
            }
        }
    }
}

#[test]
fn delayed_computer_keeps_the_drivers_minimum_times() {
    let seed = 71;
    for name in ["breakout", "tb6560", "g540"] {
        let machine = board(name);
        let drivers = &machine.wiring().drivers;
        let stream = holes(&machine);
        let computer = Computer::new(400, Some(Chance::new(seed)));
        run(&machine, &stream, &computer);
        let written = std::mem::take(&mut computer.lock().unwrap().written);
        for axis in 0..3 {
            let seen = seen(&written, drivers, axis);
            let wanted = replay_stream(&stream).filter(|pulse| pulse.axes >> axis & 1 == 1).count();
            assert_eq!(seen.pulses.len(), wanted, "{name}, axis {axis}, seed {seed}");
            for (least, asked) in least(&seen).into_iter().zip(asked(drivers, axis)) {
                assert!(least >= asked, "{name}, axis {axis}, seed {seed}: {least} ns of {asked}");
            }
        }
    }
}

#[test]
fn drivers_are_enabled_once_and_before_the_first_step() {
    let mut machine = board("breakout");
    machine.parallel.wiring.drivers.enable_delay_ms = 3;
    let computer = Computer::new(10_000, None);
    run(&machine, &holes(&machine), &computer);
    let written = std::mem::take(&mut computer.lock().unwrap().written);
    let drivers = &machine.wiring().drivers;
    assert_eq!(written[..2], [(0, 0, 0), (0, 1, 0b10)], "off is high where ENABLE is on when low");
    let enabled = edges(&written, 9, drivers);
    assert_eq!(enabled.len(), 1, "it stays on: {enabled:?}");
    let first = [0, 2, 4].iter().filter_map(|bit| edges(&written, *bit, drivers).first().copied()).min();
    assert!(first.unwrap().0 - enabled[0].0 >= 3_000_000, "{first:?} {enabled:?}");
}

#[test]
fn unannounced_step_waits_for_its_direction() {
    let machine = board("tb6560");
    let computer = Computer::new(1_000, None);
    let looked = Arc::clone(&computer);
    let now = move || {
        let mut computer = looked.lock().unwrap();
        computer.now_ns += computer.look_ns;
        Duration::from_nanos(computer.now_ns)
    };
    let bench = Bench(Arc::clone(&computer));
    let mut wires = Wires::timed(&machine, Box::new(bench), Box::new(now)).unwrap();
    for (tick, forward) in [(10, 1), (20, 0), (20, 1)] {
        wires.step(tick, 1, forward);
    }
    wires.safe();
    let written = std::mem::take(&mut computer.lock().unwrap().written);
    let seen = seen(&written, &machine.wiring().drivers, 0);
    assert_eq!(seen.pulses.iter().map(|(.., up)| *up).collect::<Vec<_>>(), [true, false, true]);
    assert!(least(&seen).into_iter().all(|least| least >= 150_000), "{:?}", least(&seen));
}
