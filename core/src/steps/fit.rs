//! Fitting runs to step times: as few runs as a greedy search finds, each step within 1 µs of its time.
//!
//! ```text
//! tick ^                      |  |     every step has a window, time ± TOLERANCE
//!      |              |   | --o--      a run is a parabola through whole ticks:
//!      |        | ----o---             tick(i) = last + i·interval + change·i(i−1)/2
//!      |  |--o--                       it goes on for as long as it stays in the windows
//!      +-----------------------> step
//! ```
//!
//! For a change c each window allows a range of intervals, (window − c·i(i−1)/2) / i; the run fits when all ranges
//! have a whole number in common. The change itself is read off the parabola through the middle and the end.
//!
//! Comes in: times of the steps of one axis in one segment, in ticks. Goes out: runs. Knows no profiles.

use super::stream::Run;

/// Greatest distance of a step from its time, in ticks: 1 µs, less a little for rounding.
const TOLERANCE: f64 = 9.99;

/// The longest run that is tried at once, and the length of the look ahead. Runs that continue each other exactly
/// are joined beyond it.
const LONGEST: usize = 512;

/// Times computed at once.
const BLOCK: usize = 4096;

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
}

impl Fitter {
    /// Appends runs for the steps 1 … count of `track`; `time_of` gives the time of a step in ticks. The times rise,
    /// and no two are closer than the least interval. Gives the tick of the last step.
    pub(super) fn fit(&mut self, track: Track, time_of: impl Fn(u64) -> f64, runs: &mut Vec<Run>) -> i64 {
        let first_run = runs.len();
        let (mut next, mut last_tick, mut guess) = (1_u64, track.from, 4_usize);
        let mut begin = 0;
        self.times.clear();
        while next <= track.count {
            if self.times.len() - begin < LONGEST {
                let known = next + (self.times.len() - begin) as u64;
                self.times.drain(..begin);
                begin = 0;
                let upto = track.count.min(known + BLOCK as u64 - 1);
                self.times.extend((known..=upto).map(&time_of));
            }
            let ahead = &self.times[begin..self.times.len().min(begin + LONGEST)];
            let found = longest(ahead, last_tick, track.least_interval, guess);
            let count = i64::from(found.count);
            last_tick += count * found.interval + found.change * (count * (count - 1) / 2);
            append(runs, first_run, &track, found);
            begin += found.count as usize;
            next += u64::from(found.count);
            guess = found.count as usize;
        }
        last_tick
    }
}

/// A run without its axis.
#[derive(Clone, Copy, Debug)]
struct Found {
    interval: i64,
    change: i64,
    count: u32,
}

/// The longest run that a search by doubling and halving finds from `last_tick` on.
fn longest(times: &[f64], last_tick: i64, least: i64, guess: usize) -> Found {
    let base = last_tick as f64;
    let first = libm::round(times[0] - base) as i64;
    let mut best = Found { interval: first.max(least), change: 0, count: 1 };
    let (mut fits, mut fails) = (1, times.len() + 1);
    let mut trial = guess.max(2);
    while fits + 1 < fails {
        trial = trial.clamp(fits + 1, fails - 1);
        if let Some(found) = parabola(&times[..trial], base, least) {
            (best, fits) = (found, trial);
        } else {
            fails = trial;
        }
        trial = if fails > times.len() { 2 * fits } else { fits + (fails - fits) / 2 };
    }
    best
}

/// A run through the windows of all `times`, if one is found.
fn parabola(times: &[f64], base: f64, least: i64) -> Option<Found> {
    let count = times.len();
    let middle = count / 2;
    let (end, mid) = (times[count - 1] - base, times[middle - 1] - base);
    let change = 2.0 * (end / count as f64 - mid / middle as f64) / (count - middle) as f64;
    let below = libm::floor(change);
    [below, below + 1.0].into_iter().find_map(|change| {
        let interval = common_interval(times, base, change)?;
        let (interval, change) = (interval as i64, change as i64);
        let last_interval = interval + change * (count as i64 - 1);
        let sayable = interval <= i64::from(u32::MAX) && i32::try_from(change).is_ok();
        let sound = sayable && interval >= least && last_interval >= least;
        sound.then_some(Found { interval, change, count: count as u32 })
    })
}

/// The whole number in the middle of the intervals with which every step stays in its window, if there is one.
fn common_interval(times: &[f64], base: f64, change: f64) -> Option<f64> {
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    let mut bend = 0.0;
    for (index, time) in times.iter().enumerate() {
        let i = index as f64 + 1.0;
        let middle = (time - base - bend) / i;
        let room = TOLERANCE / i;
        low = low.max(middle - room);
        high = high.min(middle + room);
        bend += change * i;
        if low > high {
            return None;
        }
    }
    let (low, high) = (libm::ceil(low), libm::floor(high));
    (low <= high).then(|| libm::floor(0.5 * (low + high)))
}

/// Adds a run, or lets the run before go on where this one continues it exactly.
fn append(runs: &mut Vec<Run>, first_run: usize, track: &Track, found: Found) {
    if let Some(before) = runs[first_run..].last_mut() {
        let next = i64::from(before.interval) + i64::from(before.change) * i64::from(before.count);
        let same = i64::from(before.change) == found.change || found.count == 1 && before.count > 1;
        if same
            && next == found.interval
            && let Some(sum) = before.count.checked_add(found.count)
        {
            before.count = sum;
            return;
        }
    }
    runs.push(Run {
        axes: track.axes,
        forward: track.forward,
        interval: found.interval as u32,
        count: found.count,
        change: found.change as i32,
    });
}
