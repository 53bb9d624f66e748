//! Tests of the release of XY: by the plan, or by the edge of the contact sensor if that still reports the
//! board. A late edge delays all that follows by the same time, an early one changes nothing, and without
//! an edge XY does not move.

use crate::operator::{OnTime, Orders};
use crate::programs::{Chance, random_program, rounds};
use annulus_core::job::Input;
use annulus_core::machine::{self, AXES, Machine, Value, presets, six_spindles};
use annulus_core::motion::timeline;
use annulus_core::pins::{Motors, Order, Outcome, Playhead, Recorder, Written, play};
use annulus_core::steps::{self, Segment, Stage, Steps};
use annulus_core::units::Length;

type AxisSteps = Vec<(u64, bool)>;

struct Hop {
    machine: Machine,
    from: Steps,
    hop: Segment,
}

impl Hop {
    /// Plays the rapid with a contact that opens at `edge`, with `orders`. Returns the outcome, the
    /// playhead and the written steps.
    fn played(&self, edge: u64, orders: [(u64, Order); 2]) -> (Outcome, Playhead, Recorder) {
        let mut line = Playhead { position: self.from, ..Playhead::default() };
        let script = vec![(0, Input::Contact.bit()), (edge, 0)];
        let mut pins = Recorder { position: self.from, script, ..Recorder::default() };
        let motors = Motors::of(&self.machine);
        let outcome = play(&self.hop, &motors, &mut line, &mut pins, &mut OnTime(0), &mut Orders(orders, 0));
        assert_eq!(line.position, pins.position, "every step is counted");
        (outcome, line, pins)
    }

    /// Tick of the first step of XY, or `None` if it did not move. Panics if XY moves over a low tool or
    /// before `edge`.
    fn left(&self, pins: &Recorder, edge: u64) -> Option<u64> {
        let clear = self.machine.z.scale.steps(Length::from_mm(self.machine.overlap.clear_mm));
        let (mut at, mut left) = (self.from, None);
        for call in &pins.written {
            let Written::Step { tick, axes, forward } = *call else { continue };
            for axis in (0..AXES).filter(|axis| axes >> axis & 1 == 1) {
                at[axis] += if forward >> axis & 1 == 1 { 1 } else { -1 };
            }
            if axes & 0b11 != 0 {
                assert!(tick >= edge, "left at {tick}, before the edge at {edge}");
                assert!(self.machine.spindle_axes().all(|axis| at[axis] >= clear), "over a low tip: {at:?}");
                left.get_or_insert(tick);
            }
        }
        left
    }
}

fn by_axis(pins: &Recorder) -> [AxisSteps; AXES] {
    let steps = |axis: usize| {
        let own = pins.written.iter().filter_map(|call| match *call {
            Written::Step { tick, axes, forward } if axes >> axis & 1 == 1 => {
                Some((tick, forward >> axis & 1 == 1))
            }
            _ => None,
        });
        own.collect()
    };
    std::array::from_fn(steps)
}

/// Rapids of every preset whose XY and spindles overlap, and of one machine whose spindles differ.
fn hops(seed: u64) -> Vec<Hop> {
    let own = [
        ("spindle.deeper".to_owned(), Value::Numbers(vec![0.0, 0.6, -0.4])),
        ("spindle.margin".to_owned(), Value::Numbers(vec![0.0, 0.0, 0.0, 12.0])),
    ];
    let all = presets().into_iter().map(|(_, machine)| machine).filter(|machine| machine.overlap.on);
    let all = all.chain([machine::apply(&six_spindles(), &own).unwrap()]);
    all.map(|machine| {
        let program = random_program(&mut Chance::new(seed), &machine, 3);
        let stream = steps::stream(&timeline(&program, &machine).unwrap(), &machine).unwrap();
        let mut hops = stream.segments.into_iter().filter(|segment| segment.stage == Stage::NextHole);
        let (first, hop) = (hops.next().unwrap(), hops.next().unwrap());
        Hop { machine, from: first.end, hop }
    })
    .collect()
}

const GO: [(u64, Order); 2] = [(u64::MAX, Order::Go); 2];

#[test]
fn late_contact_edge_delays_xy_and_an_early_one_does_not() {
    let (mut early, mut late, mut never) = (0, 0, 0);
    for seed in 0..rounds(1_000) {
        let mut chance = Chance::new(seed);
        for hop in hops(seed) {
            let (outcome, there, planned) = hop.played(0, GO);
            assert_eq!((outcome, there.position), (Outcome::Completed, hop.hop.end), "seed {seed}");
            let leaves = hop.left(&planned, 0).unwrap();
            let as_planned = by_axis(&planned);
            let ups = as_planned[2..].iter().flatten().filter(|(_, up)| *up).map(|(tick, _)| *tick);
            let top = ups.max().unwrap();
            let edge = chance.bits() % (top + top / 4);
            let (outcome, line, pins) = hop.played(edge, GO);
            let (left, name) = (hop.left(&pins, edge), format!("seed {seed}, {}", hop.machine.name));
            if edge <= leaves {
                assert_eq!((outcome, &pins.written), (Outcome::Completed, &planned.written), "{name}");
                early += 1;
                continue;
            }
            if edge > top + 1 {
                assert_eq!((outcome, left), (Outcome::Guarded(Input::Contact), None), "{name}");
                let safe = hop.machine.z.scale.steps(hop.machine.process.safe_height);
                assert!(hop.machine.spindle_axes().all(|axis| line.position[axis] == safe), "{name}");
                never += 1;
                continue;
            }
            assert_eq!((outcome, line.position), (Outcome::Completed, hop.hop.end), "{name}");
            let put_off = left.unwrap() - leaves;
            assert_eq!(line.tick, hop.hop.duration_ticks + put_off, "{name}");
            for (axis, (planned, found)) in as_planned.iter().zip(by_axis(&pins)).enumerate() {
                let later = |step: &(u64, bool)| {
                    let stays = axis >= 2 && step.1;
                    (step.0 + if stays { 0 } else { put_off }, step.1)
                };
                assert_eq!(planned.iter().map(later).collect::<AxisSteps>(), found, "{name}, axis {axis}");
            }
            late += 1;
        }
    }
    println!("{early} edges early, {late} late, {never} never");
    assert!(early > 50 && late > 50 && never > 20);
}

#[test]
fn xy_never_moves_over_a_low_tool_while_waiting_for_the_edge() {
    let mut moved = 0;
    for seed in 0..rounds(1_000) {
        let mut chance = Chance::new(seed);
        for hop in hops(seed) {
            let edge = chance.bits() % hop.hop.duration_ticks;
            let orders = [Order::Stop, Order::Hold, Order::At { percent: 10 + (chance.bits() % 90) as u8 }];
            let at = chance.bits() % hop.hop.duration_ticks;
            let order = orders[(chance.bits() % 3) as usize];
            let then = if order == Order::Stop { Order::Stop } else { Order::Go };
            let orders = [(at, order), (at + 300_000, then)];
            let (outcome, line, pins) = hop.played(edge, orders);
            let left = hop.left(&pins, edge);
            moved += u64::from(left.is_some());
            let ended = match outcome {
                Outcome::Completed => line.position == hop.hop.end,
                Outcome::Guarded(Input::Contact) => left.is_none(),
                Outcome::Stopped => order == Order::Stop,
                _ => false,
            };
            assert!(ended, "seed {seed}, {}: {outcome:?}, {order:?} at {at}, edge {edge}", hop.machine.name);
        }
    }
    assert!(moved > 50, "{moved}");
}
