//! Fitting runs to step times: few runs, each step within 1 µs of its time.
//!
//! ```text
//! tick ^                      |  |     every step has a window, time ± TOLERANCE_TICKS
//!      |              |   | --o--      a run is a parabola:
//!      |        | ----o---             tick(i) = last + i·interval + change·i(i−1)/2, in parts of a tick
//!      |  |--o--                       a run continues while it stays in the windows
//!      +-----------------------> step
//! ```
//!
//! The bend of the parabola is estimated from the last tick, the middle and the end of the tried stretch.
//! Every window then limits the first interval of the run. The run uses the coarsest grid for that number of
//! steps (`fineness`), if the grid has a value within the limits. If not, the step that failed gives the
//! length of the next trial; two or three trials find the longest run. If the times are known to be even, one
//! run covers them all, and only its ends are checked.

use super::stream::{PARTS, Run, fineness};

/// Greatest deviation of a run from the time of a step, in ticks: 1 µs, less half a tick of rounding to whole
/// ticks, and a margin for rounding.
const TOLERANCE_TICKS: f64 = 9.49;

/// [`TOLERANCE_TICKS`] in parts of a tick.
const ROOM_PARTS: f64 = TOLERANCE_TICKS * PARTS as f64;

/// Longest run through uneven times, and the look-ahead.
const LONGEST: usize = 1024;

/// Longest run through even times: its interval is exact to half a part, its end to half a tick.
const LONGEST_EVEN: u64 = 1 << 16;

/// Times computed in one batch.
const BLOCK: u64 = 4096;

/// A trial is repeated only for at least this factor more steps.
const WORTH_FACTOR: f64 = 1.06;

/// Buffers, reused for every axis and move.
#[derive(Debug, Default)]
pub(super) struct Fitter {
    times: Vec<f64>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Track {
    /// Set of axes, one bit each.
    pub axes: u8,
    pub forward: bool,
    pub count: u64,
    /// Fewest ticks between two steps.
    pub least_interval: i64,
    /// Tick of the step before the first one, or 0.
    pub from: i64,
    /// The first step is a run by itself.
    pub first_alone: bool,
    /// First and last step between which the times are even. Empty if the last is before the first.
    pub even: Option<(u64, u64)>,
}

/// A run without its axes, in whole parts of a tick.
#[derive(Clone, Copy, Debug)]
struct Found {
    interval: f64,
    change: f64,
    count: u32,
}

struct Pen<'a> {
    track: Track,
    last_tick: i64,
    runs: &'a mut Vec<Run>,
}

impl Fitter {
    /// Appends runs for the steps 1 … count of `track`; `time_of` gives the time of a step in ticks. Times
    /// must increase by at least the least interval. Returns the tick of the last step.
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

    fn curved(&mut self, mut next: u64, last: u64, time_of: &impl Fn(u64) -> f64, pen: &mut Pen<'_>) {
        let mut guess = 4_usize;
        let mut begin = 0;
        self.times.clear();
        while next <= last {
            // Refill if less than a full look-ahead is left.
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

fn even(mut next: u64, last: u64, time_of: &impl Fn(u64) -> f64, pen: &mut Pen<'_>) {
    while next <= last {
        let count = (last - next + 1).min(LONGEST_EVEN);
        let (begin, end) = (time_of(next), time_of(next + count - 1));
        let base = pen.last_tick as f64;
        // Run and times are both linear, so deviations between the ends are no larger.
        let [(low, high), (least, most)] =
            [(1.0, begin), (count as f64, end)].map(|(steps, time)| window(time - base, steps));
        let (interval_bits, _) = fineness(count as u32);
        let between = (low.max(least).max(pen.least()), high.min(most));
        if let Some(interval) = on_grid(between, interval_bits) {
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

    /// Appends a single step, as near to `time` as possible.
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

/// Range of even intervals, in parts of a tick, with which a run reaches a time after this many steps.
fn window(ticks: f64, steps: f64) -> (f64, f64) {
    let (mean, room) = (ticks * PARTS as f64 / steps, ROOM_PARTS / steps);
    (mean - room, mean + room)
}

/// The multiple of 2^`bits` between two numbers that is nearest to their middle; none if there is none.
fn on_grid((low, high): (f64, f64), bits: u32) -> Option<f64> {
    let each = f64::from(1_u32 << bits);
    let (first, last) = (libm::ceil(low / each), libm::floor(high / each));
    (first <= last).then(|| libm::round(0.5 * (low + high) / each).clamp(first, last) * each)
}

/// A run of one step after the tick `base`. Uses the coarse grid if possible, else the nearest whole tick
/// that is not too close.
fn single(time: f64, base: f64, least: f64) -> Found {
    let (low, high) = window(time - base, 1.0);
    let coarse = on_grid((low.max(least), high), fineness(1).0);
    let interval = coarse.unwrap_or_else(|| (libm::round(time - base) * PARTS as f64).max(least));
    Found { interval, change: 0.0, count: 1 }
}

/// The longest run that a few trials find after the tick `base`; the first trial has `guess` steps.
fn longest(times: &[f64], base: f64, least: f64, guess: usize) -> Found {
    let mut best = single(times[0], base, least);
    let (mut fits, mut fails) = (1, times.len() + 1);
    let mut trial = guess;
    while fits + 1 < fails {
        // Grow by half while trials succeed; between a success and a failure, bisect.
        trial = trial.clamp(fits + 1, fails - 1);
        match parabola(&times[..trial], base, least) {
            Ok(found) => {
                (best, fits) = (found, trial);
                trial += (trial / 2).max(1);
                if fails <= times.len() {
                    trial = trial.min(fits.midpoint(fails));
                }
            }
            Err(good) => {
                fails = trial;
                trial = good.max(fits.midpoint(fails));
            }
        }
        if fits > 1 && ((fails - 1) as f64) < WORTH_FACTOR * fits as f64 {
            break;
        }
    }
    best
}

/// A run through the windows of all `times` after the tick `base`; else the likely number of times for which
/// a run exists.
fn parabola(times: &[f64], base: f64, least: f64) -> Result<Found, usize> {
    if let [first, second] = *times {
        return pair(first - base, second - base, least).ok_or(1);
    }
    let (count, middle) = (times.len(), times.len() / 2);
    let (steps, half) = (count as f64, middle as f64);
    let (end, mid) = (times[count - 1] - base, times[middle - 1] - base);
    let (interval_bits, change_bits) = fineness(count as u32);
    let each = f64::from(1_u32 << change_bits);
    // The curvature through start, middle and end.
    let bend = 2.0 * (end / steps - mid / half) / (steps - half) * PARTS as f64 / each;
    let near = libm::round(bend);
    let mut good = 1;
    // Try both neighbours on the grid, the nearer one first.
    for change in [near, if bend > near { near + 1.0 } else { near - 1.0 }].map(|change| change * each) {
        match intervals(times, base, change, least) {
            Ok(between) => match on_grid(between, interval_bits).map(|interval| (interval, change)) {
                Some((interval, change)) if sayable(interval, change) => {
                    return Ok(Found { interval, change, count: count as u32 });
                }
                _ => good = count - 1,
            },
            Err(fitting) => good = good.max(fitting),
        }
    }
    Err(good)
}

/// A run of two steps, at these ticks after the previous one. The first interval is free; the change then
/// sets the second.
fn pair(first: f64, second: f64, least: f64) -> Option<Found> {
    let (interval_bits, change_bits) = fineness(2);
    let (low, high) = window(first, 1.0);
    let interval = on_grid((low.max(least), high), interval_bits)?;
    let (low, high) = window(second, 1.0);
    let change = on_grid(((low - 2.0 * interval).max(least - interval), high - 2.0 * interval), change_bits)?;
    sayable(interval, change).then_some(Found { interval, change, count: 2 })
}

/// True if the encoding of a run can hold these numbers.
fn sayable(interval: f64, change: f64) -> bool {
    interval < PARTS as f64 * f64::from(u32::MAX) && change.abs() < f64::from(i32::MAX)
}

/// Range of first intervals for a run with `change` through the windows of all `times`, with no step closer
/// than `least`. Else the number of times that a run can reach.
fn intervals(times: &[f64], base: f64, change: f64, least: f64) -> Result<(f64, f64), usize> {
    let (bend, last) = (0.5 * change, times.len() as f64 - 1.0);
    let (mut low, mut high) = (least.max(least - change * last), f64::INFINITY);
    let mut steps = 1.0;
    for (index, time) in times.iter().enumerate() {
        let (from, to) = window(time - base, steps);
        let bent = bend * (steps - 1.0);
        (low, high) = (low.max(from - bent), high.min(to - bent));
        if low > high {
            return Err(index);
        }
        steps += 1.0;
    }
    Ok((low, high))
}
