//! Tests of XY and the spindles together: the reference's timelines, and the cycle formula on a million
//! random cycles. XY must never move over a low tool: tested on the streams of 200,000 random cycles, half
//! of them stopped at random.

use super::vectors::{limits, near, number};
use crate::operator::{OnTime, Orders};
use crate::programs::{Chance, random_program, rounds};
use crate::reference::vectors;
use annulus_core::check::{corner_zero, verify};
use annulus_core::geometry::Point;
use annulus_core::job::Command;
use annulus_core::machine::{AXES, Machine, Scale, presets};
use annulus_core::motion::coordination::{Cycle, SpindleRules, SpindleTimes, cycle_s, cycles, sequential_s};
use annulus_core::motion::profile::{MotionLaw, Stroke, plan};
use annulus_core::motion::timeline;
use annulus_core::pins::{Motors, Order, Outcome, Playhead, Recorder, Written, play};
use annulus_core::steps::{self, Stage, Steps};
use annulus_core::units::Length;
use serde_json::Value;

fn spindle(row: &Value) -> SpindleTimes {
    let (height, depth) = (number(row, "H"), number(row, "D"));
    let shape = MotionLaw::Power(number(&row["down"], "alpha"));
    let down = plan(shape, height + depth, limits(&row["down"], ["Vm", "Am", "Jm"])).unwrap();
    let up = plan(MotionLaw::SCurve, height + depth, limits(&row["up"], ["Vm", "Am", "J"])).unwrap();
    SpindleTimes {
        dwell_bottom_s: number(row, "dwell_bottom"),
        dwell_top_s: number(row, "dwell_top"),
        margin_s: number(row, "margin"),
        ..SpindleTimes::of(&Stroke::One(down), &Stroke::One(up), height, number(row, "c"))
    }
}

/// The longer duration of two axes that move independently.
fn hop_s(case: &Value, way: &Value) -> f64 {
    let axis = |index: usize, name: &str| {
        let limits = limits(&case["xy"][name], ["V", "A", "J"]);
        plan(MotionLaw::SCurve, way[index].as_f64().unwrap().abs(), limits).unwrap().duration_s()
    };
    axis(0, "x").max(axis(1, "y"))
}

#[test]
fn timelines_match_the_reference() {
    let file = vectors("xyz_timeline.json");
    let room = number(&file["tolerance"], "time_abs");
    let mut instants = 0;
    for case in file["cases"].as_array().unwrap() {
        let id = case["id"].as_str().unwrap();
        let rules = SpindleRules { settle_s: number(case, "settle"), latency_s: number(case, "latency") };
        let spindles: Vec<_> = case["z"].as_array().unwrap().iter().map(spindle).collect();
        for (times, row) in spindles.iter().zip(case["z"].as_array().unwrap()) {
            let derived = &row["derived"];
            near(times.air_s(), number(derived, "t_air"), room, &format!("{id} in the air"));
            near(times.board_s(), number(derived, "t_board"), room, &format!("{id} in the board"));
        }
        let hops: Vec<f64> = case["moves"].as_array().unwrap().iter().map(|way| hop_s(case, way)).collect();
        let found = cycles(&hops, rules, &spindles).unwrap();
        let expected = case["events"].as_array().unwrap();
        assert_eq!(found.len(), expected.len());
        for (index, (found, expected)) in found.iter().zip(expected).enumerate() {
            let mut agree = |value: f64, row: &Value, key: &str| {
                near(value, number(row, key), room, &format!("{id} hole {index} {key}"));
                instants += 1;
            };
            agree(found.release_s, expected, "xy_start");
            agree(found.arrive_s, expected, "xy_end");
            agree(found.ready_s, expected, "ready");
            agree(found.clear_s, expected, "all_clear");
            for (stroked, row) in found.spindles.iter().zip(expected["z"].as_array().unwrap()) {
                agree(stroked.trigger_s, row, "trigger");
                agree(stroked.start_s, row, "start");
                agree(stroked.contact_s, row, "contact");
                agree(stroked.bottom_s, row, "bottom");
                agree(stroked.up_start_s, row, "up_start");
                agree(stroked.clear_s, row, "clear");
                agree(stroked.top_s, row, "top");
            }
            match expected["cycle"].as_f64() {
                Some(cycle) => near(found.cycle_s.unwrap(), cycle, room, &format!("{id} cycle {index}")),
                None => assert_eq!(found.cycle_s, None),
            }
        }
        let alone_s = sequential_s(&hops, rules, &spindles);
        near(alone_s, number(case, "sequential_time"), room, &format!("{id} one after the other"));
    }
    assert!(instants > 200, "{instants} instants");
}

fn random_spindle(chance: &mut Chance) -> SpindleTimes {
    let (down_s, up_s) = (chance.scale(1e-3, 1.0), chance.scale(1e-3, 1.0));
    SpindleTimes {
        down_s,
        up_s,
        contact_s: down_s * chance.unit(),
        leave_s: up_s * chance.unit(),
        dwell_bottom_s: chance.between(0.0, 0.01),
        dwell_top_s: chance.between(0.0, 0.01),
        margin_s: chance.between(0.0, 0.02),
    }
}

/// Checks the invariants of C2.3 for a cycle and its predecessor.
fn keeps_the_rules(
    cycle: &Cycle,
    before: Option<&Cycle>,
    rules: SpindleRules,
    spindles: &[SpindleTimes],
) -> bool {
    const ROUNDING: f64 = 1e-9;
    let released = before.is_none_or(|before| {
        before.spindles.iter().all(|stroked| cycle.release_s + ROUNDING >= stroked.clear_s + rules.latency_s)
    });
    let reached = cycle.spindles.iter().zip(spindles).all(|(stroked, times)| {
        stroked.contact_s + ROUNDING >= cycle.ready_s + times.margin_s && stroked.start_s >= cycle.release_s
    });
    let rested = before.is_none_or(|before| {
        let both = before.spindles.iter().zip(&cycle.spindles).zip(spindles);
        both.clone().all(|((a, b), times)| b.start_s + ROUNDING >= a.top_s + times.dwell_top_s)
    });
    released && reached && rested
}

#[test]
fn random_cycles_follow_the_rules_and_the_formula() {
    let mut done = 0;
    for seed in 0..rounds(20_000) {
        let mut chance = Chance::new(seed);
        let rules =
            SpindleRules { settle_s: chance.between(0.0, 0.02), latency_s: chance.between(0.0, 2e-3) };
        let count = 1 + (chance.bits() % 6) as usize;
        let spindles: Vec<_> = (0..count).map(|_| random_spindle(&mut chance)).collect();
        let hops: Vec<f64> = (0..50).map(|_| chance.scale(1e-3, 0.5)).collect();
        let found = cycles(&hops, rules, &spindles).unwrap();
        for (index, cycle) in found.iter().enumerate() {
            let before = index.checked_sub(1).map(|before| &found[before]);
            assert!(keeps_the_rules(cycle, before, rules, &spindles), "seed {seed} hole {index}: {cycle:?}");
            if let (Some(cycle), [only]) = (cycle.cycle_s, spindles.as_slice()) {
                near(cycle, cycle_s(hops[index], rules, only), 1e-9, &format!("seed {seed} hole {index}"));
            }
            done += 1;
        }
    }
    assert_eq!(done, rounds(1_000_000));
}

#[test]
fn invalid_spindle_times_are_refused_by_name() {
    let good =
        SpindleTimes { down_s: 0.1, up_s: 0.1, contact_s: 0.05, leave_s: 0.05, ..SpindleTimes::default() };
    let rows = [
        (SpindleTimes { contact_s: 0.2, ..good }, "contact"),
        (SpindleTimes { leave_s: 0.2, ..good }, "leave"),
        (SpindleTimes { down_s: f64::NAN, ..good }, "down"),
        (SpindleTimes { margin_s: -1.0, ..good }, "margin"),
    ];
    for (times, field) in rows {
        let why = cycles(&[0.1], SpindleRules::default(), &[times]).unwrap_err();
        assert!(why.message("en").starts_with(field), "{}", why.message("en"));
    }
    assert!(cycles(&[f64::INFINITY], SpindleRules::default(), &[good]).is_err());
    assert!(cycles(&[0.1], SpindleRules::default(), &[]).is_err());
}

/// Returns `true` if XY stepped while a spindle was lower than `clear` above `surface`.
fn dragged(pins: &Recorder, start: Steps, spindles: usize, clear: i64) -> bool {
    let mut at = start;
    pins.written.iter().any(|call| {
        let Written::Step { axes, forward, .. } = call else { return false };
        for axis in (0..AXES).filter(|axis| axes >> axis & 1 == 1) {
            at[axis] += if forward >> axis & 1 == 1 { 1 } else { -1 };
        }
        axes & 0b11 != 0 && (2..2 + spindles).any(|axis| at[axis] < clear)
    })
}

fn overlapped() -> Vec<Machine> {
    presets().into_iter().map(|(_, machine)| machine).filter(|machine| machine.overlap.on).collect()
}

#[test]
fn xy_never_moves_over_a_low_tool_when_stopped_or_held() {
    let (mut stopped, mut held) = (0, 0);
    for seed in 0..rounds(700) {
        for machine in overlapped() {
            let mut chance = Chance::new(seed);
            let program = random_program(&mut chance, &machine, 3);
            let plan = timeline(&program, &machine).unwrap();
            let stream = steps::stream(&plan, &machine).unwrap();
            let mut before = stream.start;
            for segment in &stream.segments {
                if segment.stage == Stage::NextHole {
                    let at = chance.bits() % segment.duration_ticks;
                    let stop = chance.bits().is_multiple_of(2);
                    let order = if stop { Order::Stop } else { Order::Hold };
                    let then = if stop {
                        Order::Stop
                    } else {
                        Order::At { percent: 10 + (chance.bits() % 91) as u8 }
                    };
                    let mut line = Playhead { position: before, ..Playhead::default() };
                    let mut pins = Recorder { position: before, ..Recorder::default() };
                    let mut operator = Orders([(at, order), (at + 700_000, then)], 0);
                    let motors = Motors::of(&machine);
                    let outcome = play(segment, &motors, &mut line, &mut pins, &mut OnTime(0), &mut operator);
                    let clear = machine.z.scale.steps(Length::from_mm(machine.overlap.clear_mm));
                    let low = dragged(&pins, before, machine.spindles as usize, clear);
                    assert!(!low, "seed {seed} on {} at {at}: {outcome:?}", machine.name);
                    assert_eq!(line.position, pins.position, "every step is counted");
                    match outcome {
                        Outcome::Completed => assert_eq!(line.position, segment.end),
                        Outcome::Stopped => assert!(stop),
                        other => panic!("seed {seed}: {other:?}"),
                    }
                    stopped += u64::from(outcome == Outcome::Stopped);
                    held += u64::from(!stop);
                }
                before = segment.end;
            }
        }
    }
    let least = rounds(1_000);
    assert!(stopped > least && held > least, "{stopped} stopped, {held} held");
}

/// A random machine whose XY and spindles overlap, with coarse steps so that few have to be replayed.
fn coarse(chance: &mut Chance) -> Machine {
    let mut machine = super::random_machine(chance);
    machine.overlap.on = true;
    for axis in [&mut machine.x, &mut machine.y, &mut machine.z] {
        axis.scale = Scale::per_mm(chance.scale(5.0, 60.0));
    }
    machine
}

#[test]
fn random_cycles_pass_the_check_and_stop_safely() {
    let (wanted, mut cycles, mut stopped, mut early) = (rounds(200_000), 0, 0, 0);
    for seed in 0.. {
        let mut chance = Chance::new(seed);
        let machine = coarse(&mut chance);
        let mut program = random_program(&mut chance, &machine, 12);
        for command in program.legs.iter_mut().flat_map(|leg| &mut leg.commands) {
            if let Command::Rapid { to } = command {
                *to = Point::from_mm(to.x.mm() * 0.2, to.y.mm() * 0.2);
            }
        }
        let stream = steps::stream(&timeline(&program, &machine).unwrap(), &machine).unwrap();
        let verdict = verify(&stream, &machine, corner_zero(&machine));
        assert!(verdict.is_ok(), "seed {seed}: {:?} on {machine:?}", verdict.unwrap_err()[0]);
        let clear = machine.z.scale.steps(Length::from_mm(machine.overlap.clear_mm));
        let mut before = stream.start;
        for segment in &stream.segments {
            if segment.stage == Stage::NextHole && chance.bits().is_multiple_of(2) {
                let at = chance.bits() % segment.duration_ticks;
                let mut line = Playhead { position: before, ..Playhead::default() };
                let mut pins = Recorder { position: before, ..Recorder::default() };
                let mut operator = Orders([(at, Order::Stop), (u64::MAX, Order::Stop)], 0);
                let outcome =
                    play(segment, &Motors::of(&machine), &mut line, &mut pins, &mut OnTime(0), &mut operator);
                let low = dragged(&pins, before, machine.spindles as usize, clear);
                assert!(!low, "seed {seed} stopped at {at}: {outcome:?} on {machine:?}");
                assert_eq!(line.position, pins.position, "every step is counted");
                assert!(matches!(outcome, Outcome::Stopped | Outcome::Completed), "seed {seed}: {outcome:?}");
                stopped += 1;
                early += u64::from(line.position != segment.end);
            }
            cycles += u64::from(segment.stage == Stage::NextHole);
            before = segment.end;
        }
        if cycles >= wanted {
            break;
        }
    }
    println!("{cycles} cycles checked, {stopped} of them told to stop, {early} ended early");
    assert!(stopped > wanted * 2 / 5 && early > stopped / 2, "{stopped} stopped, {early} early");
}

#[test]
fn guarded_spindle_in_the_board_blocks_xy() {
    use annulus_core::job::Input;
    for machine in overlapped() {
        let program = random_program(&mut Chance::new(5), &machine, 3);
        let stream = steps::stream(&timeline(&program, &machine).unwrap(), &machine).unwrap();
        let hops: Vec<_> =
            stream.segments.iter().filter(|segment| segment.stage == Stage::NextHole).collect();
        let (from, hop) = (hops[0].end, hops[1]);
        let mut line = Playhead { position: from, ..Playhead::default() };
        let stuck = vec![(0, Input::Contact.bit())];
        let mut pins = Recorder { position: from, script: stuck, ..Recorder::default() };
        let mut operator = Orders([(u64::MAX, Order::Go); 2], 0);
        let outcome = play(hop, &Motors::of(&machine), &mut line, &mut pins, &mut OnTime(0), &mut operator);
        assert_eq!(outcome, Outcome::Guarded(Input::Contact), "{}", machine.name);
        assert_eq!(line.position[..2], from[..2], "the plane did not move");
        assert_eq!(line.position[2], machine.z.scale.steps(machine.process.safe_height), "the bit is up");
        assert_eq!(line.position, pins.position);
    }
}
