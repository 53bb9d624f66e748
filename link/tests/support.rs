//! Shared by the tests: random paths, their steps in the stream, seeds.

use annulus_core::chance::Chance;
use annulus_core::job::{Stage, Switching};
use annulus_core::steps;
use annulus_link::AXES;
use annulus_link::run::Run;

pub(crate) const PULSE: u32 = 10;

pub(crate) const SETUP: u32 = 50;

/// Seeds of a property test, more of them with `ANNULUS_LONG`. Each is printed when used.
pub(crate) fn seeds(few: u64) -> impl Iterator<Item = u64> {
    let count = if std::env::var_os("ANNULUS_LONG").is_some() { 50 * few } else { few };
    (1..=count).inspect(|seed| println!("seed {seed}"))
}

/// A random path: runs of every axis from stop to stop, and its duration in ticks.
pub(crate) fn path(chance: &mut Chance, ticks: u32) -> ([Vec<Run>; AXES], u32) {
    let mut runs: [Vec<Run>; AXES] = Default::default();
    for own in &mut runs {
        let (mut at, mut forward) = (0, chance.below(2) == 1);
        // Not at the start: the pin may have to turn.
        let mut room = SETUP + PULSE;
        while at < ticks {
            if chance.below(4) == 0 {
                forward = !forward;
                room = SETUP + PULSE;
            }
            let interval = room.max(PULSE + 1) + chance.scale(1.0, 4000.0) as u32;
            let count = 1 + chance.scale(1.0, 400.0) as u32;
            let change =
                if count > 1 { (chance.below(1 << 20) as i32 - (1 << 19)) / count as i32 } else { 0 };
            let fraction = if chance.below(2) == 0 { 0 } else { chance.below(1 << 16) as u16 };
            let run = Run { forward, count, interval, fraction, change, phase: annulus_link::run::HALF };
            let fits = run.extent().filter(|extent| extent.shortest > PULSE && at + extent.last <= ticks);
            match fits {
                Some(extent) => at += extent.last,
                None if chance.below(8) == 0 => break,
                None => continue,
            }
            own.push(run);
            room = 0;
        }
    }
    (runs, ticks + 100)
}

/// A random path of the first three axes, from stop to stop, with steps at least this many ticks apart.
pub(crate) fn slow_path(
    chance: &mut Chance,
    ticks: u32,
    (least, most): (f64, f64),
) -> ([Vec<Run>; AXES], u32) {
    let mut runs: [Vec<Run>; AXES] = Default::default();
    for own in runs.iter_mut().take(AXES - 1) {
        let mut at = 0;
        loop {
            let (interval, count) = (chance.scale(least, most) as u32, 1 + chance.scale(1.0, 40.0) as u32);
            let change =
                if count > 1 { (chance.below(1 << 20) as i32 - (1 << 19)) / count as i32 } else { 0 };
            let (forward, fraction) = (chance.below(3) > 0, chance.below(1 << 16) as u16);
            let phase = annulus_link::run::HALF;
            let run = Run { forward, count, interval, fraction, change, phase };
            match run.extent() {
                Some(extent) if extent.shortest < 12 => continue,
                Some(extent) if at + extent.last <= ticks => at += extent.last,
                _ => break,
            }
            own.push(run);
        }
    }
    // Sometimes the path ends in the tick of its last step.
    let last =
        |runs: &Vec<Run>| runs.iter().map(|run| run.extent().map_or(0, |extent| extent.last)).sum::<u32>();
    let end = runs.iter().map(last).max().unwrap_or(0).max(1);
    let rest = if chance.below(4) == 0 { 0 } else { chance.scale(1.0, 20_000.0) as u32 };
    (runs, end + rest)
}

pub(crate) fn segment(runs: &[Vec<Run>; AXES], ticks: u32) -> steps::Segment {
    let of = |(axis, own): (usize, &Vec<Run>)| {
        own.iter()
            .map(|run| steps::Run {
                axes: 1 << axis,
                forward: run.forward,
                interval: run.interval,
                fraction: run.fraction,
                count: run.count,
                change: run.change,
            })
            .collect::<Vec<_>>()
    };
    steps::Segment {
        leg: 0,
        mark: annulus_core::job::Mark::Prepare,
        stage: Stage::Travel,
        duration_ticks: u64::from(ticks),
        runs: runs.iter().enumerate().flat_map(of).collect(),
        effect: Switching::None,
        gate: None,
        end: [0; steps::AXES],
    }
}

/// The steps of every axis in the stream, by core's `replay`.
pub(crate) fn meant(runs: &[Vec<Run>; AXES], ticks: u32) -> [Vec<(u64, bool)>; AXES] {
    let mut all: [Vec<(u64, bool)>; AXES] = Default::default();
    for pulse in steps::replay(&segment(runs, ticks)) {
        for (axis, own) in all.iter_mut().enumerate().filter(|(axis, _)| pulse.axes >> axis & 1 == 1) {
            own.push((pulse.tick, pulse.forward >> axis & 1 == 1));
        }
    }
    all
}
