//! Tests of stops and override changes at any moment of a move: the motors must follow, for any combined
//! demand of X and Y.

use super::twin;
use crate::operator::{OnTime, Orders};
use annulus_core::geometry::Point;
use annulus_core::job::{Bit, Command, Cutter, Leg, Mark, Program, Stage};
use annulus_core::machine::{Machine, Steps, six_spindles, virtual_drill};
use annulus_core::motion::{cycles, timeline};
use annulus_core::pins::{Motors, Order, Outcome, Playhead, play};
use annulus_core::steps::{Segment, segment, stream};
use annulus_core::units::Length;
use annulus_core::virtual_drill::{Faults, VirtualDrill};

/// The orders at a random moment, and half a second of stream time later.
const ORDERS: [[Order; 2]; 4] = [
    [Order::Stop; 2],
    [Order::Hold, Order::Go],
    [Order::At { percent: 30 }, Order::Go],
    [Order::At { percent: 70 }; 2],
];

fn drill(machine: &Machine) -> (VirtualDrill, Playhead) {
    let (drill, _) = twin(machine, Faults::default());
    let mut line = Playhead::default();
    line.position[..3].copy_from_slice(&drill.real());
    (drill, line)
}

fn ordered(
    machine: &Machine,
    segment: &Segment,
    (drill, line): (&mut VirtualDrill, &mut Playhead),
    share: f64,
    orders: [Order; 2],
) -> Outcome {
    let at = line.tick + (share * segment.duration_ticks as f64) as u64;
    let mut operator = Orders([(at, orders[0]), (at + 500_000, orders[1])], line.tick);
    play(segment, &Motors::of(machine), line, drill, &mut OnTime(0), &mut operator)
}

#[test]
fn orders_during_a_travel_never_lose_a_step() {
    for machine in [virtual_drill(), six_spindles()] {
        for way_mm in [[23.5, 3.5], [23.5, 23.4], [60.0, 0.3], [0.4, 0.9]] {
            let (_, at) = drill(&machine);
            let mut to: Steps = at.position;
            for axis in [0, 1] {
                to[axis] += (way_mm[axis] * machine.axis(axis).scale.steps_per_mm()) as i64;
            }
            let travel = segment(&cycles::go_to(&machine, at.position, to).unwrap().moves[0], &machine);
            for (orders, moment) in ORDERS.into_iter().flat_map(|orders| (0..50).map(move |at| (orders, at)))
            {
                let (mut drill, mut line) = drill(&machine);
                ordered(&machine, &travel, (&mut drill, &mut line), f64::from(moment) / 50.0, orders);
                assert!(drill.slips().is_empty(), "{way_mm:?} {orders:?} {moment}: {:?}", drill.slips());
            }
        }
    }
}

fn two_holes(machine: &Machine, way_mm: [f64; 2]) -> Program {
    let bit = Bit {
        diameter: Length::from_um(800),
        name: String::new(),
        cutter: Cutter::Drill,
        handling: Default::default(),
    };
    let hole = |hole: u32, to: Point| Leg {
        mark: Mark::Hole(hole),
        commands: vec![
            Command::Rapid { to },
            Command::Plunge { to: Length::from_um(-1_800), feed_um_per_s: 5_000, gate: None },
            Command::Retract { to: machine.process.safe_height },
        ],
    };
    let change = Leg { mark: Mark::ToolChange(0), commands: vec![Command::AwaitBit { bit: 0 }] };
    Program {
        name: "two".to_owned(),
        machine: machine.fingerprint(),
        origin: Point::default(),
        bits: vec![bit],
        spindles: 1,
        safe_height: machine.process.safe_height,
        legs: vec![change, hole(0, Point::default()), hole(1, Point::from_mm(way_mm[0], way_mm[1]))],
        accepted: Vec::new(),
    }
}

#[test]
fn orders_during_a_rapid_never_lose_a_step() {
    let mut machine = virtual_drill();
    (machine.x.backlash, machine.y.backlash) = (Length::from_um(150), Length::from_um(90));
    assert!(machine.overlap.on, "plane and spindle move together");
    for way_mm in [[23.5, 3.5], [60.0, 0.3], [5.0, 7.0]] {
        let plan = timeline(&two_holes(&machine, way_mm), &machine).unwrap();
        let segments = stream(&plan, &machine).unwrap().segments;
        let hops = segments.iter().filter(|segment| segment.stage == Stage::NextHole).count();
        for (orders, moment) in ORDERS.into_iter().flat_map(|orders| (0..100).map(move |at| (orders, at))) {
            let (mut drill, mut line) = drill(&machine);
            let mut hopped = 0;
            for segment in &segments {
                let hop = segment.stage == Stage::NextHole;
                hopped += usize::from(hop);
                let (share, orders) = if hop && hopped == hops {
                    (f64::from(moment) / 100.0, orders)
                } else {
                    (0.0, [Order::Go; 2])
                };
                ordered(&machine, segment, (&mut drill, &mut line), share, orders);
                if hop && hopped == hops {
                    break;
                }
            }
            assert!(drill.slips().is_empty(), "{way_mm:?} {orders:?} {moment}: {:?}", drill.slips());
        }
        assert!(hops > 0);
    }
}

#[test]
fn motor_position_matches_the_table_after_a_jog() {
    let mut machine = virtual_drill();
    (machine.x.backlash, machine.y.backlash) = (Length::from_um(150), Length::from_um(90));
    let (mut drill, mut line) = drill(&machine);
    // First move up, so that the counts agree with the position of the table.
    for (axis, steps) in [(0, 4_000), (1, 4_000), (0, -300), (1, -1), (0, 7), (1, -500), (0, -1_000), (0, -5)]
    {
        let timeline = cycles::jog(&machine, line.position, axis, steps, 20.0).unwrap();
        for planned in &timeline.moves {
            let outcome =
                ordered(&machine, &segment(planned, &machine), (&mut drill, &mut line), 0.0, [Order::Go; 2]);
            assert_eq!(outcome, Outcome::Completed);
        }
        assert_eq!(drill.real()[..2], line.position[..2], "jogged {axis} by {steps}");
    }
}
