//! Tests of the streams of every preset, and of runs that no planner writes.

use crate::programs::{Chance, machines, random_program, rounds};
use annulus_core::job::{Bit, Cutter, Handling, Mark, Stage, Switching};
use annulus_core::machine::{Steps, presets};
use annulus_core::motion::{bench::board, timeline};
use annulus_core::steps::{self, Run, Segment, bench::measure};
use annulus_core::units::Length;

/// Maximum number of bytes per second of a moving axis, on any preset.
const MOST_BYTES_PER_S: f64 = 16_000.0;

#[test]
fn preset_streams_are_small_exact_and_complete() {
    for (name, machine) in presets() {
        let plan = timeline(&board(&machine, 24), &machine).unwrap();
        let stream = steps::stream(&plan, &machine).unwrap();
        let made = measure(&plan, &stream);
        let parts = plan.moves.iter().flat_map(|planned| &planned.parts);
        let toolpaths = parts.flat_map(|part| part.from.iter().zip(&part.to));
        assert_eq!(made.steps, toolpaths.map(|(from, to)| to.abs_diff(*from)).sum::<u64>(), "{name}: steps");
        assert!(made.worst_us <= 1.0, "{name}: {} µs off", made.worst_us);
        let rate = made.busiest_bytes_per_s;
        assert!(rate <= MOST_BYTES_PER_S, "{name}: {rate} bytes/s");
        let each = made.bytes as f64 / made.steps as f64;
        println!("{name}: {each:.3} bytes a step, {} runs, {} steps", made.runs, made.steps);
        assert!(each <= if name == "six" { 0.5 } else { 1.0 }, "{name}: {each} bytes a step");
    }
}

/// The transmitted stream must equal the planned one to the last run: for planned streams, and for runs
/// that no planner writes.
#[test]
fn compact_stream_expands_to_the_same_stream() {
    for seed in 0..rounds(600) {
        let mut chance = Chance::new(seed);
        for machine in machines() {
            let mut stream = steps::stream(
                &timeline(&random_program(&mut chance, &machine, 4), &machine).unwrap(),
                &machine,
            )
            .unwrap();
            if !seed.is_multiple_of(3) {
                let runs = stream.segments.iter_mut().flat_map(|segment| &mut segment.runs);
                for run in runs.filter(|_| seed.is_multiple_of(2)) {
                    let wild = chance.bits();
                    match wild % 5 {
                        0 => run.change = chance.bits() as i32,
                        1 => run.interval = chance.bits() as u32,
                        2 => run.count = (chance.bits() as u32) >> (wild % 32),
                        3 => run.fraction = chance.bits() as u16,
                        _ => run.axes = chance.bits() as u8,
                    }
                }
            }
            let bytes = steps::compact(&stream);
            assert_eq!(steps::expand(&bytes).as_ref(), Some(&stream), "seed {seed} on {}", machine.name);
            let cut = chance.bits() as usize % bytes.len();
            assert_eq!(steps::expand(&bytes[..cut]), None, "seed {seed}: cut off after {cut}");
            let mut damaged = bytes.clone();
            damaged[cut] ^= 1 << (chance.bits() % 8);
            let _ = steps::expand(&damaged);
        }
    }
}

fn segment(runs: Vec<Run>) -> Segment {
    let (mark, stage, effect) = (Mark::Prepare, Stage::Jog, Switching::None);
    Segment { leg: 0, mark, stage, duration_ticks: 1 << 40, runs, effect, gate: None, end: Steps::default() }
}

#[test]
fn tick_fractions_add_up_within_a_run_only() {
    let third = Run { fraction: 21_845, ..Run::even(1, true, 10, 4) };
    let fast = Run { fraction: 0, change: -32_768, ..Run::even(1, true, 20, 3) };
    let ticks: Vec<u64> = steps::replay(&segment(vec![third, fast])).map(|pulse| pulse.tick).collect();
    // 10.33, 20.67, 31.0, 41.33; then 20, 39.5, 58.5 after 41, with halves rounded up.
    assert_eq!(ticks, [10, 21, 31, 41, 61, 81, 100]);
    assert_eq!((third.ticks(), fast.ticks()), (41, 59));
}

#[test]
fn extreme_runs_are_replayed_without_a_panic() {
    let wild = Run {
        axes: 1,
        forward: true,
        interval: u32::MAX,
        fraction: u16::MAX,
        count: u32::MAX,
        change: i32::MAX,
    };
    let back = Run { change: i32::MIN, ..wild };
    for run in [wild, back] {
        assert_eq!(steps::replay(&segment(vec![run, run])).take(300_000).count(), 300_000);
        assert!(run.ticks() > 0 || run.change < 0);
    }
}

/// A tool with a slow lift must be lifted slowly on every machine, with overlap or without, measured by the
/// pulses.
#[test]
fn tool_lift_speed_is_limited() {
    const UP_MM_PER_S: f64 = 3.0;
    for (name, machine) in presets() {
        let usual = board(&machine, 12);
        let mut slow = usual.clone();
        let handling = Handling { up_um_per_s: (UP_MM_PER_S * 1e3) as u32, ..Handling::default() };
        let (name_of_bit, diameter) = (String::new(), Length::from_um(800));
        slow.bits = vec![Bit { diameter, name: name_of_bit, cutter: Cutter::Drill, handling }];
        let fastest_up = |program| {
            let stream = steps::stream(&timeline(program, &machine).unwrap(), &machine).unwrap();
            let (mut last, mut fastest, mut clock) = (None::<u64>, 0.0_f64, 0);
            for segment in &stream.segments {
                for pulse in steps::replay(segment).filter(|pulse| pulse.axes >> 2 & 1 == 1) {
                    let tick = clock + pulse.tick;
                    let up = pulse.forward >> 2 & 1 == 1;
                    if let Some(before) = last.filter(|_| up) {
                        let hz = steps::TICK_HZ as f64 / (tick - before).max(1) as f64;
                        fastest = fastest.max(hz / machine.z.scale.steps_per_mm());
                    }
                    last = up.then_some(tick);
                }
                clock += segment.duration_ticks;
            }
            (fastest, clock)
        };
        let ((usual, short), (slow, long)) = (fastest_up(&usual), fastest_up(&slow));
        assert!(usual > 1.5 * UP_MM_PER_S, "{name}: {usual} mm/s");
        assert!(slow <= 1.01 * UP_MM_PER_S && long > short, "{name}: {slow} mm/s");
    }
}
