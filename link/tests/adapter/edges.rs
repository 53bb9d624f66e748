//! Tests that every edge at the pins is in its exact cycle.

use crate::rig::{Edge, MILLI, Rig};
use crate::support::{PULSE, SETUP, path, seeds};
use annulus_core::chance::Chance;
use annulus_link::cutter::Rule;
use annulus_link::frame::ON_LINE;
use annulus_link::message::{Beat, Place, Rate, State};
use annulus_link::run::{HALF, Run};
use annulus_link::{AXES, CYCLES_PER_TICK, FULL_RATE};

fn even(forward: bool, interval: u32, count: u32) -> Run {
    Run { count, ..Run::one(forward, interval) }
}

/// Half a million pulses per second on four axes: even ones both ways, a ramp, odd intervals, fractions of
/// a tick.
fn fast(count: u32) -> ([Vec<Run>; AXES], u32) {
    let turn = PULSE + SETUP;
    let half = count / 2;
    let ramp = Run { forward: true, count: 800, interval: 100, fraction: 0, change: -6550, phase: HALF };
    let runs = [
        vec![even(true, 100, 1), even(true, 20, half), even(false, turn, 1), even(false, 20, half)],
        vec![ramp, even(true, 20, count)],
        vec![even(false, 777, 1), Run { fraction: 0x5555, ..even(true, 12_345, 1) }, even(true, 21, count)],
        vec![Run { fraction: 0xABCD, count, ..even(false, 20, 1) }],
    ];
    let last = |runs: &Vec<Run>| runs.iter().map(|run| run.extent().unwrap().last).sum::<u32>();
    let ticks = runs.iter().map(last).max().unwrap() + 1000;
    (runs, ticks)
}

#[test]
fn four_axes_at_500_khz_are_exact_to_the_cycle() {
    // One path at a time, so that the comparison fits into memory: a million steps, in the long tests a
    // hundred million.
    let (count, paths) = (250_000, if std::env::var_os("ANNULUS_LONG").is_some() { 100 } else { 1 });
    let mut rig = Rig::ready();
    let (runs, ticks) = fast(count);
    let mut steps = 0;
    for _ in 0..paths {
        rig.say(Place { index: [0; AXES] });
        rig.forget();
        let before = (rig.busy, rig.said);
        rig.play(&runs, ticks, &Rule::resting_within(100_000), 600_000, |_| false);
        assert_eq!(rig.state(), State::Ready, "{:?}", rig.status);
        let cycles = u64::from(ticks) * u64::from(CYCLES_PER_TICK);
        println!(
            "measured processor: {:.0} % at four times half a million steps a second ({} bytes over the cable)",
            (rig.busy - before.0) as f64 / cycles as f64 * 100.0,
            rig.said - before.1
        );
        rig.is_on_path(&runs, ticks);
        steps += rig.is_exact(&runs, ticks);
    }
    println!("measured rate: 500,000 steps a second on each of 4 axes");
    println!("measured edges: 0 cycles of 8.3 ns, compared edge by edge over {steps} steps");
    assert!(steps >= 1_000_000 * paths);
}

fn counted(edges: &[Edge]) -> Vec<(u64, u8, bool)> {
    let own: Vec<_> = edges.iter().filter(|edge| (2..10).contains(&edge.pin)).collect();
    own.iter().map(|edge| (edge.cycle - own[0].cycle, edge.pin, edge.level)).collect()
}

#[test]
fn constant_queries_disturb_no_pulse() {
    let (runs, ticks) = fast(10_000);
    let mut seen = Vec::new();
    for asks in [false, true] {
        let mut rig = Rig::ready();
        let before = rig.edges.len();
        rig.play(&runs, ticks, &Rule::resting_within(100_000), 600_000, |rig| {
            let mut line = [0; ON_LINE];
            for _ in 0..if asks { 8 } else { 0 } {
                let length = rig.sender.unnumbered(&Beat {}.into(), &mut line).unwrap();
                rig.put(&line[..length]);
            }
            false
        });
        assert_eq!(rig.state(), State::Ready, "{:?}", rig.status);
        // Every edge is in the cycle of the stream, counted from its first edge.
        rig.is_exact(&runs, ticks);
        seen.push((counted(&rig.edges[before..]), rig.said));
    }
    assert!(seen[0].0.len() > 80_000 && seen[1].1 > 2 * seen[0].1, "{} {}", seen[0].1, seen[1].1);
    assert!(seen[0].0 == seen[1].0, "every edge of every pin is in the same cycle");
    println!(
        "measured polling: the same {} edges, cycle by cycle, with eight questions a quarter of a millisecond",
        seen[0].0.len()
    );
}

#[test]
fn random_paths_are_exact_to_the_cycle_in_any_chunks() {
    let (mut all, mut share, mut paths, mut stack) = (0, 0.0, 0, 0);
    for seed in seeds(4) {
        let mut chance = Chance::new(seed);
        let (runs, ticks) = path(&mut chance, 400_000);
        let rule = Rule { ticks: chance.scale(2e4, 2e5) as u32, ..Rule::resting_within(50_000) };
        let mut rig = Rig::ready();
        let before = rig.busy;
        rig.play(&runs, ticks, &rule, 800_000, |_| false);
        assert_eq!(rig.state(), State::Ready, "{:?}", rig.status);
        all += rig.is_exact(&runs, ticks);
        share += (rig.busy - before) as f64 / (f64::from(ticks) * f64::from(CYCLES_PER_TICK));
        paths += 1;
        rig.look_at_stack();
        stack = stack.max(rig.stack);
    }
    let (percent, per_s) = (100.0 * share / f64::from(paths), all as f64 / f64::from(paths) / 0.04);
    println!("measured path of chance: {percent:.0} % at {per_s:.0} steps a second on all axes together");
    println!("measured stack: {stack} bytes");
    assert!((1..32 * 1024).contains(&stack), "{stack} bytes of stack");
}

#[test]
fn hold_and_slower_feed_stretch_time_without_distortion() {
    let mut rig = Rig::ready();
    let (runs, ticks) = fast(8000);
    let (mut turns, mut held) = (0, (0, 0));
    rig.play(&runs, ticks, &Rule::resting_within(30_000), 600_000, |rig| {
        turns += u32::from(rig.state() == State::Running);
        let wanted = match turns {
            8 => 0,
            60 => FULL_RATE / 3,
            100 => FULL_RATE,
            _ => return false,
        };
        match turns {
            8 => held.0 = rig.cycle,
            60 => held.1 = rig.cycle,
            _ => {}
        }
        rig.sender.offer(&Rate { wanted }.into());
        false
    });
    assert_eq!(rig.state(), State::Ready, "{:?}", rig.status);
    let wanted: usize = runs.iter().flatten().map(|run| run.count as usize).sum();
    assert_eq!(rig.is_on_path(&runs, ticks), wanted);
    // The first pulse that is later than the ramp requests: 2 ms of words were made, and the order waits on
    // the cable after path.
    let begins = rig.pulses(1).windows(3).find_map(|three| {
        let [before, gap] = [1, 2].map(|at| three[at].cycle - three[at - 1].cycle);
        let tick = u64::from(CYCLES_PER_TICK);
        (three[0].cycle > held.0 && gap > before + 2 * tick).then(|| three[2].cycle - held.0)
    });
    let begins = begins.expect("time passes more slowly");
    println!("the hold begins {:.2} ms after it was said", begins as f64 / MILLI as f64);
    assert!(begins < 7 * MILLI / 2, "{begins}");
    // 2 ms of words already made, 3 ms to stop, 1 ms for the order itself.
    let still = |axis| {
        let quiet = held.0 + 6 * MILLI..held.1;
        rig.pulses(axis).iter().filter(|pulse| quiet.contains(&pulse.cycle)).count()
    };
    assert_eq!([still(0), still(1), still(2), still(3)], [0; AXES]);
}
