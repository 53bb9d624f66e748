//! Tests of spindles with individual depth, length and margin. Each moves independently, XY never moves
//! over a low tool, and equal values give the same stream as none.

use crate::programs::{Chance, random_program, rounds};
use annulus_core::check::{corner_zero, verify};
use annulus_core::geometry::Point;
use annulus_core::job::{Command, Mark, Program};
use annulus_core::machine::{self, AXES, Machine, Value, six_spindles};
use annulus_core::motion::{drill_cycles, laws, timeline};
use annulus_core::steps::{self, Packed, Stage, StepStream, TICK_HZ};
use annulus_core::units::Length;

fn list(key: &str, numbers: Vec<f64>) -> (String, Value) {
    (format!("spindle.{key}"), Value::Numbers(numbers))
}

fn random_own(chance: &mut Chance) -> Machine {
    let spindles = 2 + chance.bits() % 5;
    let mut some = |low: f64, high: f64| {
        let known: [f64; 3] = std::array::from_fn(|_| chance.between(low, high));
        (0..spindles).map(|_| known[(chance.bits() % 3) as usize]).collect::<Vec<f64>>()
    };
    let (deeper, mut longer, margin) = (some(-1.5, 1.5), some(-4.0, 4.0), some(0.0, 30.0));
    longer[0] = 0.0;
    let number = |key: &str, value: f64| (key.to_owned(), Value::Number(value));
    let on = if chance.bits().is_multiple_of(4) { "no" } else { "yes" };
    let changes = [
        number("machine.spindles", spindles as f64),
        number("overlap.clear", chance.between(0.05, 1.5)),
        number("overlap.latency", chance.between(0.0, 2.0)),
        number("stroke.settle", chance.between(0.0, 8.0)),
        ("overlap.on".to_owned(), Value::Text(on.to_owned())),
        list("deeper", deeper),
        list("longer", longer),
        list("margin", margin),
    ];
    machine::apply(&six_spindles(), &changes).unwrap()
}

fn stream_of(program: &Program, machine: &Machine) -> StepStream {
    steps::stream(&timeline(program, machine).unwrap(), machine).unwrap()
}

/// Number of steps of X and Y during a spindle's motion, and of bottoms that differ from that of the first
/// spindle.
#[derive(Default)]
struct Seen {
    together: u64,
    apart: u64,
}

/// Every tool must reach its own bottom in every hole, and X and Y may step only over tools that are clear.
fn keeps_its_own(program: &Program, machine: &Machine, seed: u64, seen: &mut Seen) {
    let stream = stream_of(program, machine);
    let z = machine.z.scale;
    let clear = if machine.overlap.on { Length::from_mm(machine.overlap.clear_mm) } else { Length::ZERO };
    let bottom = Length::ZERO - machine.process.board_thickness - machine.process.breakthrough;
    let (mut at, mut lowest, mut leg) = (stream.start, stream.start, 0);
    for segment in &stream.segments {
        if segment.leg != leg {
            (leg, lowest) = (segment.leg, at);
        }
        let goes_down = matches!(segment.stage, Stage::Drill | Stage::NextHole);
        let tops = at;
        for pulse in steps::replay(segment) {
            for axis in (0..AXES).filter(|axis| pulse.axes >> axis & 1 == 1) {
                at[axis] += if pulse.forward >> axis & 1 == 1 { 1 } else { -1 };
                lowest[axis] = lowest[axis].min(at[axis]);
            }
            if pulse.axes & 0b11 != 0 {
                let low = machine.spindle_axes().find(|axis| at[*axis] < z.steps(clear));
                assert_eq!(low, None, "seed {seed}: the plane moves over a low tip, {at:?} on {machine:?}");
                seen.together += u64::from(at[2..] != tops[2..]);
            }
        }
        if goes_down && matches!(segment.mark, Mark::Hole(_)) {
            for axis in machine.spindle_axes() {
                let used = program.spindles >> (axis - 2) & 1 == 1;
                let own = machine.own(axis).height(bottom, bottom);
                let wanted = z.steps(if used { own } else { machine.process.safe_height });
                assert_eq!(segment.end[axis], wanted, "seed {seed}: axis {axis}");
                assert!(lowest[axis] >= wanted.min(stream.start[axis]), "seed {seed}: axis {axis} too deep");
                seen.apart += u64::from(segment.end[axis] != segment.end[2]);
            }
        }
    }
}

#[test]
fn every_spindle_reaches_its_own_bottom_with_xy_at_rest() {
    let mut seen = Seen::default();
    for seed in 0..rounds(3_000) {
        let mut chance = Chance::new(seed);
        let machine = random_own(&mut chance);
        let mut program = random_program(&mut chance, &machine, 5);
        if chance.bits().is_multiple_of(3) {
            program.spindles = ((chance.bits() % 63) as u8 & machine.installed()).max(1);
        }
        let plan = timeline(&program, &machine).unwrap();
        laws::laws(&plan, &machine).unwrap_or_else(|why| panic!("seed {seed}: {why:?}"));
        let stream = steps::stream(&plan, &machine).unwrap();
        for (index, segment) in stream.segments.iter().enumerate() {
            super::replay_keeps_to_the_plan(&plan, index, segment, seed);
        }
        let verdict = verify(&stream, &machine, corner_zero(&machine));
        assert!(verdict.is_ok(), "seed {seed}: {:?} on {machine:?}", verdict.unwrap_err()[0]);
        let packed = Packed::of(&program, &machine).unwrap();
        let legs: Vec<_> = (0..packed.legs()).flat_map(|leg| packed.leg(leg)).collect();
        assert_eq!(legs, stream.segments, "seed {seed}: kept otherwise than made");
        keeps_its_own(&program, &machine, seed, &mut seen);
    }
    println!("{} steps of the plane beside strokes, {} bottoms of their own", seen.together, seen.apart);
    assert!(seen.together > 1_000 && seen.apart > 100);
}

#[test]
fn equal_extra_depth_equals_a_deeper_program() {
    let machine = six_spindles();
    let program = random_program(&mut Chance::new(11), &machine, 6);
    let own = machine::apply(&machine, &[list("deeper", vec![0.4; 6])]).unwrap();
    let mut deeper = program.clone();
    for command in deeper.legs.iter_mut().flat_map(|leg| &mut leg.commands) {
        if let Command::Plunge { to, .. } = command {
            *to -= Length::from_um(400);
        }
    }
    assert_eq!(stream_of(&program, &own), stream_of(&deeper, &machine));
    let alike = machine::apply(&machine, &[list("deeper", vec![0.0; 6]), list("margin", vec![])]).unwrap();
    assert_eq!(stream_of(&program, &alike), stream_of(&program, &machine));
}

#[test]
fn spindle_margin_delays_only_its_own_tool() {
    let machine = six_spindles();
    let late = machine::apply(&machine, &[list("margin", vec![0.0, 0.0, 25.0])]).unwrap();
    let mut program = random_program(&mut Chance::new(2), &machine, 2);
    let to = Point::from_mm(90.0, 120.0);
    let hole = program.legs.iter_mut().rfind(|leg| matches!(leg.mark, Mark::Hole(_))).unwrap();
    hole.commands[0] = Command::Rapid { to };
    // Ticks from the last step of XY to the first step below the surface, for Z1 and Z3.
    let waits = |machine: &Machine| {
        let stream = stream_of(&program, machine);
        let hop = stream.segments.iter().rfind(|segment| segment.stage == Stage::NextHole).unwrap();
        let mut at = stream.segments.iter().find(|segment| segment.stage == Stage::NextHole).unwrap().end;
        let (mut arrived, mut touched) = (0, [None; AXES]);
        for pulse in steps::replay(hop) {
            for axis in (0..AXES).filter(|axis| pulse.axes >> axis & 1 == 1) {
                let up = pulse.forward >> axis & 1 == 1;
                at[axis] += if up { 1 } else { -1 };
                if !up && axis >= 2 && at[axis] < 0 {
                    touched[axis].get_or_insert(pulse.tick);
                }
            }
            arrived = if pulse.axes & 0b11 != 0 { pulse.tick } else { arrived };
        }
        [2, 4].map(|axis| (touched[axis].unwrap() - arrived) as f64 / TICK_HZ as f64)
    };
    let (before, after) = (waits(&machine), waits(&late));
    assert_eq!(before[0], before[1]);
    assert_eq!(after[0], before[0]);
    assert!(after[1] >= 0.028 && after[1] > before[1] + 0.015, "{before:?} {after:?}");
}

#[test]
fn every_spindle_has_its_own_contact_time() {
    let changes = [list("deeper", vec![0.0, 3.0]), list("margin", vec![0.0, 0.0, 9.0])];
    // The feed in the board equals that above it, so a drill cycle is a single move that the depth
    // stretches from its beginning.
    let fast = machine::apply(&six_spindles(), &[("stroke.feed".to_owned(), Value::Number(400.0))]).unwrap();
    let own = machine::apply(&fast, &changes).unwrap();
    let times = drill_cycles::own_times(&own).unwrap();
    assert_eq!(times.len(), 6);
    assert_eq!(times[0], times[3]);
    assert!(times[1].contact_s != times[0].contact_s && times[1].down_s > times[0].down_s);
    assert!(times[2].margin_s > times[0].margin_s && times[2].contact_s == times[0].contact_s);
}
