//! Tests of the laws of motion and steps on many random moves and programs. A failure prints its seed.

use annulus_core::check::{corner_zero, verify};
use annulus_core::geometry::Point;
use annulus_core::job::Command;
use annulus_core::machine::{AXES, Axis, Law, Machine, Overlap, Scale, lab, virtual_drill};
use annulus_core::motion::{AxisMove, Motion, Move, Timeline, laws, rapid_time_s, timeline};
use annulus_core::steps::{self, Segment, TICK_HZ};
use annulus_core::units::Length;

mod check;
mod coordination;
mod cycles;
mod golden;
mod milling;
mod paths;
mod paths_measured;
mod play;
mod profiles;
mod released;
mod spindles;
mod streams;
mod vectors;

use crate::programs::{Chance, machines, random_program, rounds};

/// Replays a segment against its plan. Before and after every step the motor must be within half a step of
/// the plan, plus the plan's motion in 1 µs.
fn replay_keeps_to_the_plan(plan: &Timeline, index: usize, segment: &Segment, seed: u64) {
    let planned = &plan.moves[index];
    let mut at = planned.from;
    let mut last = [None::<u64>; AXES];
    for pulse in steps::replay(segment) {
        let t_s = pulse.tick as f64 / TICK_HZ as f64;
        let ideal = planned.at(t_s);
        for axis in (0..AXES).filter(|axis| pulse.axes >> axis & 1 == 1) {
            let room = 0.5 + passed_in_a_microsecond(planned, axis, t_s);
            for counted in [false, true] {
                let off = (ideal[axis] - at[axis] as f64).abs();
                assert!(
                    off <= room,
                    "seed {seed}: {off} of {room} at {pulse:?}, after it: {counted}, {segment:?}"
                );
                if !counted {
                    at[axis] += if pulse.forward >> axis & 1 == 1 { 1 } else { -1 };
                }
            }
            assert!(last[axis].is_none_or(|tick| tick < pulse.tick), "seed {seed}: axis {axis} steps twice");
            last[axis] = Some(pulse.tick);
        }
        assert!(pulse.tick <= segment.duration_ticks, "seed {seed}: a step after the end");
    }
    assert_eq!(at, planned.to, "seed {seed}: ends elsewhere");
    assert_eq!(at, segment.end, "seed {seed}: ends elsewhere than it says");
}

/// Distance in steps that the plan of `axis` covers in a microsecond around `t_s`; half a step for moves by
/// state table.
fn passed_in_a_microsecond(planned: &Move, axis: usize, t_s: f64) -> f64 {
    let near =
        |part: &AxisMove| part.moves(axis) && part.start_s() <= t_s + 1e-6 && t_s - 1e-6 <= part.end_s();
    let room = planned.parts.iter().filter(|part| near(part)).map(|part| match &part.motion {
        Motion::Line(stroke) => {
            let own_s = t_s - part.start_s();
            let way = (part.to[axis] - part.from[axis]).abs() as f64;
            let speed = stroke.speed(own_s + 1e-6).max(stroke.speed(own_s - 1e-6));
            speed * way / stroke.length_mm() * 1e-6 + 1e-9 * way
        }
        Motion::TableSteps(_) => 0.5 + 1e-9,
        Motion::Path(_) => 0.0,
    });
    room.fold(0.0, f64::max)
}

#[test]
fn replay_is_within_half_a_step_of_the_plan_and_ends_exactly() {
    let (mut moves, mut seed) = (0, 0);
    while moves < rounds(100_000) {
        seed += 1;
        for machine in machines() {
            let mut chance = Chance::new(seed);
            let program = random_program(&mut chance, &machine, 12);
            let plan = timeline(&program, &machine).unwrap();
            laws::laws(&plan, &machine).unwrap();
            let stream = steps::stream(&plan, &machine).unwrap();
            for (index, segment) in stream.segments.iter().enumerate() {
                replay_keeps_to_the_plan(&plan, index, segment, seed);
            }
            moves += plan.moves.len() as u64;
        }
    }
}

/// A random machine within the permitted settings, with speeds up to the limit of its drives.
fn random_machine(chance: &mut Chance) -> Machine {
    let mut machine = virtual_drill();
    machine.max_step_hz = chance.scale(200.0, 1e6) as u32;
    machine.direction_setup_us = chance.scale(1.0, 1e4) as u32;
    let fastest_hz = f64::from(machine.max_step_hz);
    for axis in [&mut machine.x, &mut machine.y, &mut machine.z] {
        axis.scale = Scale::per_mm(chance.scale(2.0, 5e3));
        let drive = fastest_hz / axis.scale.steps_per_mm();
        axis.max_speed_mm_per_s = chance.scale(2.0, 2e3).min(drive);
        axis.max_acceleration_mm_per_s2 = chance.scale(10.0, 2e5);
        axis.max_jerk_mm_per_s3 = chance.scale(100.0, 1e8);
    }
    let drive = fastest_hz / machine.z.scale.steps_per_mm();
    machine.down.max_speed_mm_per_s = chance.scale(2.0, 2e3).min(drive);
    machine.down.max_acceleration_mm_per_s2 = chance.scale(10.0, 2e5);
    machine.down.max_jerk_mm_per_s3 = chance.scale(100.0, 1e8);
    let slowest = machine.z.max_speed_mm_per_s.min(machine.down.max_speed_mm_per_s);
    machine.process.feed_mm_per_s = chance.scale(0.5, 100.0).min(slowest);
    machine.process.spin_up_ms = 0.0;
    let laws = [Law::Linear, Law::SCurve, Law::Automatic, Law::Power];
    let motion = &mut machine.motion;
    for law in [&mut motion.plane, &mut motion.down, &mut motion.up] {
        *law = laws[(chance.bits() % 4) as usize];
    }
    motion.order = chance.between(0.05, 2.0);
    machine.overlap.on = !chance.bits().is_multiple_of(4);
    machine.overlap.clear_mm = chance.between(0.0, 1.5);
    machine.overlap.latency_ms = chance.between(0.0, 2.0);
    machine.overlap.margin_ms = chance.between(0.0, 10.0);
    machine.overlap.dwell_top_ms = chance.between(0.0, 3.0);
    machine.spindles = 1 + (chance.bits() % 6) as u32;
    for axis in [&mut machine.x, &mut machine.y] {
        axis.backlash = Length::from_um((chance.bits() % 300) as i64 * (chance.bits() % 2) as i64);
    }
    machine
}

#[test]
fn random_machines_get_streams_that_pass_the_check() {
    for seed in 0..rounds(3_000) {
        let mut chance = Chance::new(seed);
        let machine = random_machine(&mut chance);
        let mut program = random_program(&mut chance, &machine, 2);
        for command in program.legs.iter_mut().flat_map(|leg| &mut leg.commands) {
            if let Command::Rapid { to } = command {
                *to = Point::from_mm(to.x.mm() * 0.1, to.y.mm() * 0.1);
            }
        }
        let plan = timeline(&program, &machine).unwrap();
        laws::laws(&plan, &machine).unwrap();
        let stream = steps::stream(&plan, &machine).unwrap();
        for (index, segment) in stream.segments.iter().enumerate() {
            replay_keeps_to_the_plan(&plan, index, segment, seed);
        }
        let verdict = verify(&stream, &machine, corner_zero(&machine));
        assert!(verdict.is_ok(), "seed {seed}: {:?} on {machine:?}", verdict.unwrap_err()[0]);
    }
}

#[test]
fn overlong_move_is_refused_with_its_length() {
    let base = virtual_drill();
    // A drill cycle of 4.1 mm overlapping a rapid, one without overlap at its feed, and 200 mm by state
    // table.
    let slow = |on: bool| Machine { overlap: Overlap { on, ..base.overlap }, ..base.clone() };
    let table = Machine { interrupt_hz: 10, x: Axis { max_speed_mm_per_s: 0.01, ..lab().x }, ..lab() };
    for (machine, to_mm, feed_um_per_s, length) in
        [(slow(true), 1.0, 4, "4.1"), (slow(false), 1.0, 4, "2.4"), (table, 200.0, 2_000, "200")]
    {
        let mut program = random_program(&mut Chance::new(1), &machine, 1);
        for command in program.legs.iter_mut().flat_map(|leg| &mut leg.commands) {
            match command {
                Command::Rapid { to } => *to = Point::from_mm(to_mm, 0.0),
                Command::Plunge { feed_um_per_s: feed, .. } => *feed = feed_um_per_s,
                _ => {}
            }
        }
        let why = timeline(&program, &machine).unwrap_err();
        assert_eq!(why.code, "motion.move_too_slow");
        let said = why.message("en");
        assert!(said.contains(&format!("a move of {length}")), "{said}");
    }
}

#[test]
fn any_program_gives_a_timeline_or_a_diagnostic() {
    for seed in 0..rounds(100_000) {
        let mut chance = Chance::new(seed);
        let machines = machines();
        let machine = &machines[seed as usize % machines.len()];
        let mut program = random_program(&mut chance, machine, 2);
        let wild = Length::from_nm(chance.bits() as i64 >> (chance.bits() % 64));
        let commands = [
            Command::Rapid { to: Point::new(wild, Length::ZERO) },
            Command::Plunge { to: wild, feed_um_per_s: chance.bits() as u32, gate: None },
            Command::Plunge {
                to: Length::from_um(-10),
                feed_um_per_s: (chance.bits() % 3) as u32,
                gate: None,
            },
            Command::Retract { to: wild },
            Command::Dwell { us: chance.bits() as u32 },
        ];
        let leg = chance.bits() as usize % program.legs.len();
        program.legs[leg].commands.insert(0, commands[chance.bits() as usize % commands.len()]);
        match timeline(&program, machine) {
            Ok(plan) => {
                let verdict = laws::laws(&plan, machine);
                assert!(verdict.is_ok(), "seed {seed} on {}: {:?}", machine.name, verdict);
            }
            Err(diagnostic) => {
                assert!(!diagnostic.message("en").contains('{'), "seed {seed}: {}", diagnostic.message("en"));
            }
        }
    }
}

#[test]
fn rapid_takes_the_time_of_its_slower_axis() {
    let machine = virtual_drill();
    let hop = |x, y| rapid_time_s(&machine, Point::default(), Point::from_mm(x, y));
    assert_eq!(hop(0.0, 0.0), 0.0);
    assert_eq!(hop(10.0, 0.0), hop(0.0, -10.0));
    assert!((hop(10.0, 10.0) - hop(10.0, 0.0)).abs() < 1e-9, "both axes do the same at once");
    assert!((hop(10.0, 3.0) - hop(10.0, 0.0)).abs() < 1e-9, "the longer axis decides");
}
