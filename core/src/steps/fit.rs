//! Fitting runs to step times: few runs, each step within 1 µs of its time.
//!
//! ```text
//! tick ^                      |  |     every step has a window, time ± TOLERANCE
//!      |              |   | --o--      a run is a parabola:
//!      |        | ----o---             tick(i) = last + i·interval + change·i(i−1)/2, in parts of a tick
//!      |  |--o--                       it goes on for as long as it stays in the windows
//!      +-----------------------> step
//! ```
//!
//! The parabola goes through the last tick, the middle and the end of the stretch it is tried on. What is furthest off its
//! time grows about as the cube of the length, which says how long the next trial should be: two or three find the
//! longest run. Where the times are known to lie evenly, one run takes them all and only its ends are looked at.
//!
//! Comes in: times of the steps of one axis in one segment, in ticks. Goes out: runs. Knows no profiles.

use super::stream::{PARTS, Run, fineness, to_fineness};

/// Greatest distance of a run from the time of a step, in ticks: 1 µs, less half a tick for the whole tick that the step
/// comes in, and a little for rounding.
const TOLERANCE: f64 = 9.49;

/// The longest run through times that are not known to lie evenly, and the length of the look ahead.
const LONGEST: usize = 1024;

/// The longest run through times that lie evenly: its interval is exact to half a part, its end to half a tick.
const LONGEST_EVEN: u64 = 1 << 16;

/// Times computed at once.
const BLOCK: u64 = 4096;

/// A trial is not repeated for less than this share more steps.
const WORTH: f64 = 1.125;

/// Times compared side by side.
const LANES: usize = 4;

/// Buffers that are used again for every axis and move.
#[derive(Debug, Default)]
pub(super) struct Fitter {
    times: Vec<f64>,
}

/// What is the same for all steps of one axis in one segment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Track {
    /// Which axes, one bit each.
    pub axes: u8,
    /// Whether it counts up.
    pub forward: bool,
    /// How many steps.
    pub count: u64,
    /// Fewest ticks between two steps.
    pub least_interval: i64,
    /// Tick of the step before the first one, or 0.
    pub from: i64,
    /// Whether the first step is a run by itself.
    pub first_alone: bool,
    /// The first and the last step between which the times lie evenly; nothing where the last comes before the first.
    pub even: Option<(u64, u64)>,
}

/// A run without its axis. In parts of a tick, whole numbers.
#[derive(Clone, Copy, Debug)]
struct Found {
    interval: f64,
    change: f64,
    count: u32,
}

/// Where the runs have got to.
struct Pen<'a> {
    track: Track,
    last_tick: i64,
    runs: &'a mut Vec<Run>,
}

impl Fitter {
    /// Appends runs for the steps 1 … count of `track`; `time_of` gives the time of a step in ticks. The times rise,
    /// and no two are closer than the least interval. Gives the tick of the last step.
    pub(super) fn fit(&mut self, track: Track, time_of: impl Fn(u64) -> f64, runs: &mut Vec<Run>) -> i64 {
        let mut pen = Pen { track, last_tick: track.from, runs };
        let mut next = 1;
        if track.first_alone && track.count > 0 {
            pen.one(time_of(1));
            next = 2;
        }
        let (first, last) = track.even.unwrap_or((1, 0));
        let (first, last) = (first.max(next), last.min(track.count));
        if first < last {
            self.curved(next, first - 1, &time_of, &mut pen);
            even(first, last, &time_of, &mut pen);
            next = last + 1;
        }
        self.curved(next, track.count, &time_of, &mut pen);
        pen.last_tick
    }

    /// The steps `next` to `last`, whatever way their times lie.
    fn curved(&mut self, mut next: u64, last: u64, time_of: &impl Fn(u64) -> f64, pen: &mut Pen<'_>) {
        let mut guess = 16_usize;
        let mut begin = 0;
        self.times.clear();
        while next <= last {
            if self.times.len() - begin < LONGEST {
                let known = next + (self.times.len() - begin) as u64;
                self.times.drain(..begin);
                begin = 0;
                let upto = last.min(known + BLOCK - 1);
                self.times.extend((known..=upto).map(time_of));
            }
            let ahead = &self.times[begin..self.times.len().min(begin + LONGEST)];
            let found = longest(ahead, pen.last_tick as f64, pen.least(), guess);
            pen.write(found);
            begin += found.count as usize;
            next += u64::from(found.count);
            guess = found.count as usize;
        }
    }
}

/// The steps `next` to `last`, whose times lie evenly.
fn even(mut next: u64, last: u64, time_of: &impl Fn(u64) -> f64, pen: &mut Pen<'_>) {
    while next <= last {
        let count = (last - next + 1).min(LONGEST_EVEN);
        let (begin, end) = (time_of(next), time_of(next + count - 1));
        let base = pen.last_tick as f64;
        let (interval_bits, _) = fineness(count as u32);
        let each = to_fineness((end - base) / count as f64 * PARTS as f64, interval_bits);
        let interval = each.max(pen.least());
        let off = |steps: f64, time: f64| (base + steps * interval / PARTS as f64 - time).abs();
        // Both lie on lines: what lies between is no further off.
        if off(1.0, begin).max(off(count as f64, end)) <= TOLERANCE {
            pen.write(Found { interval, change: 0.0, count: count as u32 });
            next += count;
        } else {
            pen.one(begin);
            next += 1;
        }
    }
}

impl Pen<'_> {
    /// Fewest parts of a tick between two steps.
    fn least(&self) -> f64 {
        (self.track.least_interval * PARTS) as f64
    }

    /// A single step, as near to `time` as may be.
    fn one(&mut self, time: f64) {
        self.write(single(time, self.last_tick as f64, self.least()));
    }

    fn write(&mut self, found: Found) {
        let parts = (found.interval as u64).min(u64::from(u32::MAX) << 16);
        let run = Run {
            axes: self.track.axes,
            forward: self.track.forward,
            interval: (parts >> 16) as u32,
            fraction: (parts & 0xFFFF) as u16,
            count: found.count,
            change: found.change as i32,
        };
        self.last_tick += run.ticks() as i64;
        self.runs.push(run);
    }
}

/// A run of one step after the tick `base`, in the whole tick nearest to `time` that is not too close.
fn single(time: f64, base: f64, least: f64) -> Found {
    let interval = (libm::round(time - base) * PARTS as f64).max(least);
    Found { interval, change: 0.0, count: 1 }
}

/// The longest run that a few trials find after the tick `base`; the first trial is `guess` steps long.
fn longest(times: &[f64], base: f64, least: f64, guess: usize) -> Found {
    let mut best = single(times[0], base, least);
    let (mut fits, mut fails) = (1, times.len() + 1);
    let mut trial = guess;
    while fits + 1 < fails {
        trial = trial.clamp(fits + 1, fails - 1);
        let (found, worst) = parabola(&times[..trial], base, least);
        let room = libm::cbrt((TOLERANCE / worst).min(8.0));
        let next = if worst <= TOLERANCE {
            (best, fits) = (found, trial);
            0.98 * room
        } else {
            fails = trial;
            (0.96 * room).clamp(0.25, 0.95)
        };
        trial = (trial as f64 * next) as usize;
        let most = trial.max(fits + 1).min(fails - 1);
        if fits > 1 && (most as f64) < WORTH * fits as f64 {
            break;
        }
    }
    best
}

/// The run through `base`, the middle and the end of `times`, as far as steps keep their distance, and how far off its
/// time the worst step is, in ticks; infinite where no run can be written down so.
fn parabola(times: &[f64], base: f64, least: f64) -> (Found, f64) {
    let (parts, count, middle) = (PARTS as f64, times.len(), times.len() / 2);
    let (steps, half) = (count as f64, middle as f64);
    let (end, mid) = ((times[count - 1] - base) * parts, (times[middle - 1] - base) * parts);
    let (interval_bits, change_bits) = fineness(count as u32);
    let mut change = to_fineness(2.0 * (end / steps - mid / half) / (steps - half), change_bits);
    let mut interval = to_fineness(end / steps - 0.5 * change * (steps - 1.0), interval_bits);
    let last = interval + change * (steps - 1.0);
    if interval < least || last < least {
        interval = interval.max(least);
        let each = f64::from(1_u32 << change_bits);
        change = libm::trunc((last.max(least) - interval) / (steps - 1.0) / each) * each;
    }
    let found = Found { interval, change, count: count as u32 };
    let sayable = interval < parts * f64::from(u32::MAX) && change.abs() < f64::from(i32::MAX);
    let worst = if sayable { furthest(times, base, found) } else { f64::INFINITY };
    (found, worst)
}

/// How far off its time the worst step of a run is, in ticks.
fn furthest(times: &[f64], base: f64, found: Found) -> f64 {
    let bend = 0.5 * found.change / PARTS as f64;
    let slope = found.interval / PARTS as f64 - bend;
    let mut worst = [0.0_f64; LANES];
    let mut step = 1.0;
    for some in times.chunks(LANES) {
        for (lane, time) in some.iter().enumerate() {
            let i = step + lane as f64;
            let off = (base + i * (slope + bend * i) - time).abs();
            if off > worst[lane] {
                worst[lane] = off;
            }
        }
        step += LANES as f64;
    }
    worst.into_iter().fold(0.0, f64::max)
}
