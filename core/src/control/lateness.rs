//! Lateness of a computer with its pulses, and the fastest safe step rate that follows from it.
//!
//! ```text
//! planned |         |         |         |          a beat every 0.5 ms
//! actual   |        |          |      → |    |     late by 1, 0, 1, 5 … µs: the histogram
//!
//! fastest safe rate              1 / (4 · p99.99 lateness): late by at most a quarter interval
//! start–stop rate of a motor     below it lateness is harmless
//! ```

use crate::diagnostic::Diagnostic;
use crate::machine::{AXES, DriveKind, Machine, axis_name};
use crate::steps::{PARTS, Segment, TICK_HZ};
use crate::{code, error, note};
use serde::{Deserialize, Serialize};
use std::borrow::Borrow;

/// Upper edges of the histogram's bars, µs. The last bar holds all later beats.
pub const EDGES_US: [u32; 16] =
    [1, 2, 5, 10, 20, 50, 100, 200, 500, 1_000, 2_000, 5_000, 10_000, 20_000, 50_000, 100_000];

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Lateness {
    pub beats: u32,
    /// Number of beats in each bar, by [`EDGES_US`], plus one bar for the rest.
    pub bars: Vec<u32>,
    /// Median, µs.
    pub p50_us: f64,
    /// 99th percentile, µs.
    pub p99_us: f64,
    /// 99.99th percentile, µs; the worst value with fewer than ten thousand beats.
    pub p9999_us: f64,
    pub worst_us: f64,
}

impl Lateness {
    /// The histogram of `late_us`. Sorts the slice. NaN counts as infinitely late.
    pub fn of(late_us: &mut [f64]) -> Self {
        for late in late_us.iter_mut() {
            *late = if late.is_nan() { f64::INFINITY } else { late.max(0.0) };
        }
        late_us.sort_by(f64::total_cmp);
        let count = late_us.len();
        // The smallest value that at least this share of the beats does not exceed.
        let at = |share: f64| {
            let rank = libm::ceil(share * count as f64) as usize;
            late_us.get(rank.max(1) - 1).or(late_us.last()).copied().unwrap_or(0.0)
        };
        let mut bars = vec![0_u32; EDGES_US.len() + 1];
        for late in late_us.iter() {
            bars[EDGES_US.partition_point(|edge| f64::from(*edge) < *late)] += 1;
        }
        Self {
            beats: u32::try_from(count).unwrap_or(u32::MAX),
            bars,
            p50_us: at(0.5),
            p99_us: at(0.99),
            p9999_us: at(0.9999),
            worst_us: at(1.0),
        }
    }
}

/// Measurements of an executor about its computer, at its start.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    pub lateness: Lateness,
    /// Highest safe step rate, steps per second.
    pub safe_hz: f64,
    /// Why the process lacks the real-time scheduling class; none if it has it.
    pub no_realtime: Option<String>,
    /// Why the memory isn't locked; none if it is.
    pub not_locked: Option<String>,
}

impl Timing {
    /// The result as messages, with the rights that the system refused.
    pub fn diagnostics(&self) -> Vec<Diagnostic> {
        let late = &self.lateness;
        let found = note!(
            "output.timing",
            beats = late.beats,
            p50 = libm::round(late.p50_us),
            p9999 = libm::round(late.p9999_us),
            max = libm::round(late.worst_us),
            safe = libm::floor(self.safe_hz)
        );
        let refused = |code: &str, why: &Option<String>| {
            why.as_ref().map(|why| Diagnostic::warning(code).with("reason", why))
        };
        let class = refused(code!("output.no_realtime"), &self.no_realtime);
        [Some(found), class, refused(code!("output.not_locked"), &self.not_locked)]
            .into_iter()
            .flatten()
            .collect()
    }
}

/// Highest safe step rate, in steps per second. Its interval is at least four times the p99.99 lateness. A
/// motor's start–stop rate is always safe, because below it no interval is too uneven. At most one step per
/// tick.
pub fn safe_rate(lateness: &Lateness, start_stop_hz: f64) -> f64 {
    let quarter_s = lateness.p9999_us.max(0.0) * 1e-6;
    let fastest = if quarter_s > 0.0 { 1.0 / (4.0 * quarter_s) } else { TICK_HZ as f64 };
    // Without a measurement, only the start–stop rate is safe.
    let fastest = if lateness.beats == 0 { 0.0 } else { fastest };
    fastest.max(start_stop_hz).min(TICK_HZ as f64)
}

/// Rate at which `machine` needs punctual service, per second: its interrupts with a table drive, else its
/// fastest steps.
pub fn needed_rate(machine: &Machine) -> f64 {
    if machine.drive == DriveKind::Table {
        return f64::from(machine.interrupt_hz);
    }
    let axes = [&machine.x, &machine.y, &machine.z];
    let own = axes.map(|axis| axis.max_speed_mm_per_s * axis.scale.steps_per_mm());
    let down = machine.down.max_speed_mm_per_s * machine.z.scale.steps_per_mm();
    own.into_iter().fold(down, f64::max).min(f64::from(machine.max_step_hz))
}

/// Rate of the shortest interval between two steps of one axis in `segments`, in steps per second, and that
/// axis. The interval is rounded down to ticks. None if no axis makes two steps.
pub fn fastest_rate(segments: impl IntoIterator<Item: Borrow<Segment>>) -> Option<(f64, usize)> {
    let mut shortest: Option<(i128, usize)> = None;
    for segment in segments {
        let mut seen = [false; AXES];
        for run in &segment.borrow().runs {
            // Axes that step together have equal intervals.
            let Some(axis) = (0..AXES).find(|axis| run.axes >> axis & 1 == 1) else { continue };
            let seen = &mut seen[axis];
            let last = run.parts_before(run.count.saturating_sub(1));
            // The first step of a segment follows a rest.
            let first = run.parts_before(u32::from(!*seen));
            let single = !*seen && run.count < 2;
            *seen |= run.count > 0;
            if run.count == 0 || single {
                continue;
            }
            let least = (first.min(last) / i128::from(PARTS)).max(1);
            if shortest.is_none_or(|(ticks, _)| least < ticks) {
                shortest = Some((least, axis));
            }
        }
    }
    shortest.map(|(ticks, axis)| (TICK_HZ as f64 / ticks as f64, axis))
}

pub fn too_fast(segments: impl IntoIterator<Item: Borrow<Segment>>, safe_hz: f64) -> Option<Diagnostic> {
    beyond(fastest_rate(segments), safe_hz)
}

/// Like [`too_fast`], for a result of [`fastest_rate`].
pub fn beyond(fastest: Option<(f64, usize)>, safe_hz: f64) -> Option<Diagnostic> {
    let (hz, axis) = fastest.filter(|(hz, _)| *hz > safe_hz)?;
    let why = error!("control.faster_than_clock", axis = axis_name(axis), ..);
    Some(why.with("hz", libm::ceil(hz)).with("safe", libm::floor(safe_hz)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::Chance;
    use crate::job::{Mark, Stage, Switching};
    use crate::machine::{Steps, preset};
    use crate::steps::{Run, replay};

    #[test]
    fn histogram_counts_every_beat_and_quantiles_are_beats() {
        let mut chance = Chance::new(11);
        for count in [1, 2, 3, 100, 9_999, 10_000, 10_001, 40_000] {
            let mut late: Vec<f64> = (0..count).map(|_| chance.below(1 << 20) as f64 / 7.0).collect();
            let found = Lateness::of(&mut late);
            assert_eq!((found.beats, found.bars.iter().sum::<u32>()), (count, count), "seed 11");
            let within = |bound: f64| late.iter().filter(|late| **late <= bound).count() as f64;
            for (share, bound) in [(0.5, found.p50_us), (0.99, found.p99_us), (0.9999, found.p9999_us)] {
                assert!(within(bound) >= share * f64::from(count), "{count} {share}");
                assert!(late.iter().filter(|late| **late < bound).count() as f64 <= share * f64::from(count));
            }
            assert_eq!(found.worst_us, *late.last().unwrap());
        }
        let on_edge = Lateness::of(&mut [1.0, 1.5, 100_000.0, 100_001.0, f64::NAN, -3.0]);
        assert_eq!((on_edge.bars[0], on_edge.bars[1], on_edge.bars[15], on_edge.bars[16]), (2, 1, 1, 2));
        assert_eq!(on_edge.worst_us, f64::INFINITY);
    }

    #[test]
    fn safe_rate_limits_lateness_to_a_quarter_tick() {
        let late = |us: f64| Lateness::of(&mut vec![us; 20_000]);
        let rows = [
            (50.0, 0.0, 5_000.0),
            (50.0, 500.0, 5_000.0),
            (10_000.0, 0.0, 25.0),
            (10_000.0, 70.0, 70.0),
            (f64::INFINITY, 70.0, 70.0),
            (0.0, 70.0, TICK_HZ as f64),
        ];
        for (us, start_stop, safe) in rows {
            assert!((safe_rate(&late(us), start_stop) - safe).abs() < 1e-6, "{us} {start_stop}");
        }
        assert_eq!(safe_rate(&Lateness::default(), 70.0), 70.0, "nothing measured");
        // One beat in ten thousand may be later, two not.
        let mut beats = vec![25.0; 10_000];
        beats[7] = 9_000.0;
        assert_eq!(safe_rate(&Lateness::of(&mut beats.clone()), 0.0), 10_000.0);
        beats[8] = 9_000.0;
        assert!(safe_rate(&Lateness::of(&mut beats), 0.0) < 28.0);
    }

    #[test]
    fn needed_rate_is_interrupts_or_fastest_steps() {
        let needs = |name: &str| needed_rate(&preset(name).unwrap());
        // 500 interrupts; 20 mm/s at 160, 80 and 400 steps/mm.
        let found = [needs("lab"), needs("breakout"), needs("tb6560"), needs("g540")];
        assert_eq!(found, [500.0, 3_200.0, 1_600.0, 8_000.0]);
        let capped = Machine { max_step_hz: 700, ..preset("g540").unwrap() };
        assert_eq!(needed_rate(&capped), 700.0);
    }

    fn segment(runs: Vec<Run>) -> Segment {
        let (mark, stage, effect) = (Mark::Prepare, Stage::Jog, Switching::None);
        let end = Steps::default();
        Segment { leg: 0, mark, stage, duration_ticks: 1 << 40, runs, effect, gate: None, end }
    }

    #[test]
    fn fastest_rate_equals_that_of_the_pulses() {
        let mut chance = Chance::new(5);
        let mut draw = |below: u64| chance.bits() % below;
        for _ in 0..500 {
            let mut runs = Vec::new();
            for axis in 0..3_u8 {
                for _ in 0..draw(4) {
                    let (interval, count) = (2_000 + draw(5_000) as u32, draw(20) as u32);
                    let change = draw(100 * PARTS as u64) as i32 - 50 * PARTS as i32;
                    let fraction = draw(PARTS as u64) as u16;
                    runs.push(Run { axes: 1 << axis, forward: true, interval, fraction, count, change });
                }
            }
            let segment = segment(runs);
            let mut last = [None; AXES];
            let mut shortest = u64::MAX;
            for pulse in replay(&segment) {
                for (axis, last) in
                    last.iter_mut().enumerate().filter(|(axis, _)| pulse.axes >> axis & 1 == 1)
                {
                    shortest = last.map_or(shortest, |last: u64| shortest.min(pulse.tick - last));
                    assert!(axis < 3);
                    *last = Some(pulse.tick);
                }
            }
            let found = fastest_rate(&[segment]).map(|(hz, _)| libm::round(TICK_HZ as f64 / hz) as u64);
            assert_eq!(found.is_some(), shortest != u64::MAX, "seed 5");
            if let Some(ticks) = found {
                assert!((shortest - 1..=shortest).contains(&ticks), "seed 5: {ticks} for {shortest}");
            }
        }
    }

    #[test]
    fn stream_above_the_safe_rate_is_refused_with_both_rates() {
        let run = Run::even(2, true, 20_000, 9);
        let segments = [segment(vec![run])];
        assert_eq!(too_fast(&segments, 500.0), None);
        let why = too_fast(&segments, 499.5).unwrap();
        let sentence = why.message("en");
        assert!(sentence.contains("Y") && sentence.contains("500") && sentence.contains("499"), "{sentence}");
        assert!(!why.advice("en").is_empty());
    }
}
