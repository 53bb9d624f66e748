//! Tests that the checker accepts planned streams and refuses each fault with its own code.

use crate::programs::{Chance, machines, one_by_one, random_program, rounds};
use annulus_core::check::{corner_zero, verify};
use annulus_core::job::{Gate, Input, Otherwise, Stage, Switching};
use annulus_core::locale;
use annulus_core::machine::{DriveKind, Machine, virtual_drill};
use annulus_core::motion::timeline;
use annulus_core::steps::{self, Run, Segment, StepStream, TICK_HZ};
use annulus_core::units::Length;

fn planned(machine: &Machine, seed: u64, holes: u32) -> StepStream {
    let program = random_program(&mut Chance::new(seed), machine, holes);
    steps::stream(&timeline(&program, machine).unwrap(), machine).unwrap()
}

#[test]
fn every_planned_stream_passes_the_check() {
    for seed in 0..rounds(2_000) {
        for machine in machines() {
            let stream = planned(&machine, seed, 6);
            let report = verify(&stream, &machine, corner_zero(&machine)).unwrap_or_else(|diagnostics| {
                panic!("seed {seed} on {}: {:?}", machine.name, diagnostics[0].message("en"))
            });
            assert_eq!(report.holes, 6);
            let pulses = steps::replay_stream(&stream).map(|pulse| u64::from(pulse.axes.count_ones()));
            assert_eq!(report.steps.iter().sum::<u64>(), pulses.sum::<u64>());
        }
    }
}

fn first(stream: &mut StepStream, stage: Stage) -> &mut Segment {
    stream.segments.iter_mut().find(|segment| segment.stage == stage && !segment.runs.is_empty()).unwrap()
}

/// Evenly spaced steps over the same distance, `ticks` apart.
fn evenly(segment: &mut Segment, axes: u8, interval: u32) {
    let count = segment.runs.iter().filter(|run| run.axes == axes).map(|run| run.count).sum();
    let forward = segment.runs.iter().any(|run| run.axes == axes && run.forward);
    segment.runs.retain(|run| run.axes != axes);
    segment.runs.push(Run::even(axes, forward, interval, count));
    segment.runs.sort_by_key(|run| run.axes);
    segment.duration_ticks = segment.duration_ticks.max(u64::from(interval) * u64::from(count));
}

type Fault = fn(&mut StepStream);

const X: u8 = 1;
const Z: u8 = 4;

const FAULTS: [(&str, Fault); 16] = [
    ("check.two_sets", |s| {
        let travel = first(s, Stage::Travel);
        let x = *travel.runs.iter().find(|run| run.axes == X).unwrap();
        travel.runs.push(x);
    }),
    ("check.axis_missing", |s| {
        first(s, Stage::Travel).runs.push(Run::even(1 << 7, true, 9_000, 1));
    }),
    ("check.empty_run", |s| {
        let run = Run::even(X, true, 9_000, 0);
        first(s, Stage::Travel).runs.insert(0, run);
    }),
    ("check.too_large", |s| s.segments[0].duration_ticks = u64::MAX),
    ("check.count", |s| first(s, Stage::Travel).end[0] += 1),
    ("check.late_step", |s| {
        let last = first(s, Stage::Retract).runs.last_mut().unwrap();
        (last.interval, last.change) = (last.interval + 300_000, last.change.max(0));
    }),
    ("check.range", |s| {
        let run = Run::even(X, false, 900_000, 400);
        let travel = first(s, Stage::Travel);
        travel.runs.retain(|run| run.axes != X);
        travel.runs.insert(0, run);
    }),
    ("check.interval", |s| evenly(first(s, Stage::Travel), X, 199)),
    ("check.direction_setup", |s| {
        let retract = first(s, Stage::Retract);
        let there = Run::even(Z, true, 100_000, 1);
        retract.runs.extend([there, Run { forward: false, interval: 15_000, ..there }]);
        retract.duration_ticks += 200_000;
    }),
    ("check.acceleration", |s| evenly(first(s, Stage::Approach), Z, 520)),
    ("check.xy_in_board", |s| {
        let travel = first(s, Stage::Travel).clone();
        let drill = first(s, Stage::Drill);
        drill.runs = travel.runs.into_iter().chain(drill.runs.clone()).collect();
        drill.duration_ticks = drill.duration_ticks.max(travel.duration_ticks);
        drill.end[..2].copy_from_slice(&[travel.end[0] * 2, travel.end[1] * 2]);
    }),
    ("check.spindle_off", |s| s.segments[0].effect = Switching::None),
    ("check.spin_up", |s| s.segments[1].duration_ticks = 0),
    ("check.gate_not_alone", |s| {
        let gate = Gate { input: Input::XMax, deadline_us: 1_000_000, otherwise: Otherwise::GoOn };
        first(s, Stage::Travel).gate = Some(gate);
    }),
    ("check.await_bit", |s| {
        let at = s.segments.iter().position(|segment| segment.stage == Stage::Drill).unwrap();
        s.segments[at].effect = Switching::AwaitBit { bit: 0 };
    }),
    ("check.spindle_left_on", |s| {
        let off =
            s.segments.iter().rposition(|segment| segment.effect == Switching::Spindle { rpm: 0 }).unwrap();
        s.segments[off].effect = Switching::None;
    }),
];

#[test]
fn every_fault_is_refused_with_its_own_code() {
    let machine = Machine { direction_setup_us: 2_000, ..one_by_one() };
    let mut wrong = Vec::new();
    for (code, spoil) in FAULTS {
        let mut stream = planned(&machine, 2, 3);
        spoil(&mut stream);
        let diagnostics = verify(&stream, &machine, corner_zero(&machine)).expect_err(code);
        if diagnostics[0].code != code {
            wrong.push(format!("{code}: {diagnostics:?}"));
            continue;
        }
        for text in [diagnostics[0].message("en"), diagnostics[0].advice("en")] {
            assert!(!text.contains('{') && !text.starts_with("check."), "{text}");
        }
        for part in ["message", "advice"] {
            assert!(locale::lookup("en", &format!("{code}.{part}")).is_some());
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn excessive_axis_speed_is_refused() {
    let mut machine = one_by_one();
    let stream = planned(&machine, 2, 3);
    machine.z.max_speed_mm_per_s *= 0.5;
    machine.down.max_speed_mm_per_s *= 0.5;
    let diagnostics = verify(&stream, &machine, corner_zero(&machine)).unwrap_err();
    assert_eq!(diagnostics[0].code, "check.speed");
}

#[test]
fn leg_that_ends_low_is_refused() {
    let machine = one_by_one();
    let mut stream = planned(&machine, 2, 1);
    let up = stream.segments.iter().position(|segment| segment.stage == Stage::Retract).unwrap();
    stream.segments.truncate(up);
    let diagnostics = verify(&stream, &machine, corner_zero(&machine)).unwrap_err();
    assert_eq!(diagnostics[0].code, "check.leg_ends_low");
}

#[test]
fn backlash_reduces_the_range_of_xy_only() {
    let mut machine = virtual_drill();
    let stream = planned(&machine, 2, 1);
    // The bottom of the hole is the lowest position of Z.
    let process = &machine.process;
    machine.z.min = process.surface - process.board_thickness - process.breakthrough;
    assert!(verify(&stream, &machine, corner_zero(&machine)).is_ok());
    machine.z.backlash = Length::from_um(500);
    machine.z.min += Length::from_um(100);
    let diagnostics = verify(&stream, &machine, corner_zero(&machine)).unwrap_err();
    assert_eq!(diagnostics[0].code, "check.range");
}

#[test]
fn start_outside_the_machine_is_refused_without_overflow() {
    let machine = virtual_drill();
    for start in [i64::MIN, -1, 24_001, i64::MAX] {
        let mut stream = planned(&machine, 2, 1);
        stream.start[0] = start;
        let diagnostics = verify(&stream, &machine, corner_zero(&machine)).unwrap_err();
        assert_eq!(diagnostics[0].code, "check.range");
    }
}

#[test]
fn damaged_streams_never_panic_the_check() {
    let machine = virtual_drill();
    let sound = planned(&machine, 2, 1);
    for seed in 0..rounds(5_000) {
        let mut chance = Chance::new(seed);
        let mut stream = sound.clone();
        let at = chance.bits() as usize % stream.segments.len();
        let segment = &mut stream.segments[at];
        let wild = chance.bits();
        match (chance.bits() % 5, segment.runs.first_mut()) {
            (0, Some(run)) => run.change = wild as i32,
            (1, Some(run)) => run.interval = wild as u32,
            (2, Some(run)) => run.count = wild as u32 % 100_000,
            (3, _) => segment.duration_ticks = wild,
            _ => segment.end[(wild % 8) as usize] = wild as i64,
        }
        let _ = verify(&stream, &machine, corner_zero(&machine));
        let _ = steps::digest(&stream);
        assert!(steps::replay_stream(&stream).count() < 1_000_000);
    }
}

fn hop(stream: &mut StepStream) -> &mut Segment {
    stream.segments.iter_mut().filter(|segment| segment.stage == Stage::NextHole).nth(1).unwrap()
}

#[test]
fn early_xy_motion_and_low_chain_are_refused() {
    let machine = virtual_drill();
    let early: Fault = |s| {
        let x = hop(s).runs.iter_mut().find(|run| run.axes == X).unwrap();
        x.interval /= 2;
    };
    let low: Fault = |s| {
        let last = s.segments.iter().rposition(|segment| segment.stage == Stage::Retract).unwrap();
        let (lifted, before) = (s.segments[last].end, s.segments[last - 1].end);
        s.segments.remove(last);
        for segment in &mut s.segments[last..] {
            segment.end[2] += before[2] - lifted[2];
        }
    };
    for (code, spoil) in [("check.xy_in_board", early), ("check.leg_ends_low", low)] {
        let mut stream = planned(&machine, 7, 4);
        assert!(verify(&stream, &machine, corner_zero(&machine)).is_ok());
        spoil(&mut stream);
        let refused = verify(&stream, &machine, corner_zero(&machine)).unwrap_err();
        assert!(refused.iter().any(|diagnostic| diagnostic.code == code), "{code}: {refused:?}");
    }
}

/// Factor by which the steps of `axis` exceed its acceleration, relative to what the limit and timing
/// errors of 1 µs per step allow. Compares mean speeds over equally many steps before and after each step.
fn broken(segment: &Segment, axis: usize, machine: &Machine) -> f64 {
    let settings = machine.axis(axis);
    let down = if axis < 2 { 0.0 } else { machine.down.max_acceleration_mm_per_s2 };
    let acceleration = settings.max_acceleration_mm_per_s2.max(down) * settings.scale.steps_per_mm();
    let of_axis = steps::replay(segment).filter(|pulse| pulse.axes >> axis & 1 == 1);
    let steps: Vec<(f64, bool)> =
        of_axis.map(|pulse| (pulse.tick as f64 / TICK_HZ as f64, pulse.forward >> axis & 1 == 1)).collect();
    let mut worst = 0.0_f64;
    for sweep in steps.chunk_by(|a, b| a.1 == b.1) {
        for half in [1, 2, 3, 5, 8, 13, 21, 34] {
            for window in sweep.windows(2 * half + 1) {
                let (before_s, after_s) = (window[half].0 - window[0].0, window[2 * half].0 - window[half].0);
                let (before, after) = (half as f64 / before_s, half as f64 / after_s);
                let blurred = 2.1e-6 * (before / before_s + after / after_s);
                let allowed = 0.5 * acceleration * (before_s + after_s) + blurred;
                worst = worst.max((after - before).abs() / allowed);
            }
        }
    }
    worst
}

/// A run with its speed multiplied by `faster`, and with an additional change of the interval in ticks per
/// step.
fn altered(run: Run, faster: f64, bent: i32) -> Run {
    let parts = (run.first_parts() as f64 / faster) as u64;
    let change = (f64::from(run.change) / faster) as i32 + bent * 65_536;
    Run { interval: (parts >> 16) as u32, fraction: (parts & 0xFFFF) as u16, change, ..run }
}

#[test]
fn check_finds_runs_that_break_a_limit() {
    let kinds = [("40 % faster", 1.4, 0), ("bent up", 1.0, 3), ("bent down", 1.0, -3)];
    let mut counted = [(0_u64, 0_u64, 0_u64); 3];
    for seed in 0..rounds(2_000) {
        let mut chance = Chance::new(seed);
        for machine in machines().iter().filter(|machine| machine.drive == DriveKind::Planned) {
            let sound = planned(machine, seed, 3);
            let at = chance.bits() as usize % sound.segments.len();
            let Some(which) = (chance.bits() as usize).checked_rem(sound.segments[at].runs.len()) else {
                continue;
            };
            for ((_, faster, bent), (tried, broke, found)) in kinds.iter().zip(&mut counted) {
                let mut stream = sound.clone();
                let run = altered(stream.segments[at].runs[which], *faster, *bent);
                let axis = run.axes.trailing_zeros() as usize;
                stream.segments[at].runs[which] = run;
                let refused = verify(&stream, machine, corner_zero(machine)).is_err();
                let breaks = broken(&stream.segments[at], axis, machine);
                *tried += 1;
                *broke += u64::from(breaks > 2.0);
                *found += u64::from(refused && breaks > 2.0);
                assert!(refused || breaks <= 2.0, "seed {seed} on {}: {breaks} times, {run:?}", machine.name);
            }
        }
    }
    for ((what, ..), (tried, broke, found)) in kinds.iter().zip(counted) {
        println!("{what}: {broke} of {tried} break the law, {found} found");
        assert!(broke > tried / 10, "{what}: {broke} of {tried}");
    }
}

/// A move at the maximum speed must be refused when accelerated by the smallest amount that step times can
/// show.
#[test]
fn check_finds_faster_runs_at_maximum_speed() {
    let mut tried = 0;
    for seed in 0..rounds(400) {
        for machine in machines().iter().filter(|machine| machine.drive == DriveKind::Planned) {
            let sound = planned(machine, seed, 3);
            let runs = sound.segments.iter().enumerate().flat_map(|(at, segment)| {
                segment.runs.iter().enumerate().map(move |(which, run)| (at, which, *run))
            });
            let fast = |run: &Run| {
                let axis = machine.axis(run.axes.trailing_zeros() as usize);
                let greatest = axis.max_speed_mm_per_s * axis.scale.steps_per_mm();
                let speed = TICK_HZ as f64 * 65_536.0 / run.first_parts() as f64;
                run.axes.count_ones() == 1 && run.count > 50 && run.change == 0 && speed > 0.98 * greatest
            };
            for (at, which, run) in runs.filter(|(.., run)| fast(run)) {
                for faster in [1.4, 1.2, 1.1] {
                    let mut stream = sound.clone();
                    stream.segments[at].runs[which] = altered(run, faster, 0);
                    let refused = verify(&stream, machine, corner_zero(machine)).is_err();
                    assert!(refused, "seed {seed} on {}: {faster} times {run:?}", machine.name);
                    tried += 1;
                }
            }
        }
    }
    assert!(tried > 20, "{tried} runs at the greatest speed");
}
