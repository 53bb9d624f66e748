//! Compact encoding of a stream, for storage and transmission. The digest uses a fixed-width encoding
//! instead.
//!
//! ```text
//! segment   its data (postcard)   number of runs   run run run … padded to a byte
//! run       head   interval − guess     change − guess
//! head      1                                       same axes, same direction, coarse
//!           0  axes follow? axes  direction  grain  anything else
//!           number of steps
//! ```
//!
//! The guessed interval continues the previous run of these axes. The guessed change leads evenly from the
//! last interval of that run to the first of this one. Both are multiples of the grain: the fineness with
//! which runs of that many steps are made (`fineness`), or ticks, or parts of a tick.
//!
//! A difference from a guess is written as its length, relative to the recent mean length, followed by its
//! bits. So similar numbers cost little more than their information.

use super::bits::{Reader, Usual, Writer};
use super::stream::{PARTS, Run, Segment, StepStream, fineness};

/// Longest interval and guess, in parts of a tick, so that no run can cause an overflow.
const LONGEST: i64 = 1 << 48;

/// Unit of the numbers of a run.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Grain {
    /// The grid of [`fineness`] for the run's number of steps.
    Coarse = 0,
    Ticks = 1,
    Parts = 2,
}

impl Grain {
    /// The coarsest unit that represents the run exactly.
    fn of(run: &Run) -> Self {
        let fits = |grain: Self| {
            let (interval_bits, change_bits) = grain.bits(run.count);
            run.first_parts() % (1 << interval_bits) == 0
                && run.change % (1 << change_bits) == 0
                && (run.count > 1 || run.change == 0)
        };
        [Self::Coarse, Self::Ticks].into_iter().find(|grain| fits(*grain)).unwrap_or(Self::Parts)
    }

    /// Powers of two for interval and change of a run of `count` steps.
    fn bits(self, count: u32) -> (u32, u32) {
        match self {
            Self::Coarse => fineness(count),
            Self::Ticks => (PARTS.trailing_zeros(), PARTS.trailing_zeros()),
            Self::Parts => (0, 0),
        }
    }

    /// True if the change of a run of `count` steps is encoded.
    fn tells_change(self, count: u32) -> bool {
        count > 1 || self == Self::Parts
    }
}

/// Prediction from the previous runs.
struct Guess {
    axes: u8,
    forward: bool,
    /// Interval before the last step, and the predicted next one.
    last: i64,
    next: i64,
    /// Usual lengths of differences, by grain.
    interval_bits: [Usual; 3],
    change_bits: [Usual; 3],
}

impl Guess {
    fn new() -> Self {
        let usual = [7, 12, 24].map(Usual::new);
        Self { axes: 0, forward: false, last: 0, next: 0, interval_bits: usual, change_bits: usual }
    }

    /// Updates the prediction from a run.
    fn learn(&mut self, run: &Run) {
        let before = |index: u32| run.parts_before(index).clamp(0, i128::from(LONGEST)) as i64;
        (self.last, self.next) = (before(run.count.saturating_sub(1)), before(run.count));
    }

    /// Sets axes and direction. For different axes the prediction starts at zero.
    fn turn(&mut self, axes: u8, forward: bool) {
        if axes != self.axes {
            (self.last, self.next) = (0, 0);
        }
        (self.axes, self.forward) = (axes, forward);
    }

    /// Predicted change of a run of `count` steps that starts with `interval`.
    fn change(&self, interval: i64, count: u32, grain: Grain) -> i64 {
        // Runs in whole ticks usually have even intervals.
        if grain == Grain::Coarse { 2 * (interval - self.last) / (i64::from(count) + 1) } else { 0 }
    }
}

pub fn compact(stream: &StepStream) -> Vec<u8> {
    let mut bytes = postcard::to_allocvec(&(stream.start, stream.segments.len() as u64)).unwrap_or_default();
    for segment in &stream.segments {
        put_segment(segment, &mut bytes);
    }
    bytes
}

pub(super) fn put_segment(segment: &Segment, bytes: &mut Vec<u8>) {
    bytes.extend(postcard::to_allocvec(&bare(segment)).unwrap_or_default());
    put(segment.runs.len() as u64, bytes);
    let (mut guess, mut bits) = (Guess::new(), Writer::onto(bytes));
    for run in &segment.runs {
        put_run(run, &mut guess, &mut bits);
    }
    bits.end();
}

fn bare(segment: &Segment) -> Segment {
    let Segment { leg, mark, stage, duration_ticks, effect, gate, end, .. } = *segment;
    Segment { leg, mark, stage, duration_ticks, runs: Vec::new(), effect, gate, end }
}

/// Decodes a stream; none if the bytes are invalid.
pub fn expand(bytes: &[u8]) -> Option<StepStream> {
    let ((start, count), mut bytes): ((_, u64), &[u8]) = postcard::take_from_bytes(bytes).ok()?;
    let mut stream = StepStream { start, segments: Vec::new() };
    for _ in 0..count {
        stream.segments.push(take_segment(&mut bytes)?);
    }
    bytes.is_empty().then_some(stream)
}

/// Decodes a segment from the front of `bytes`; none if that fails.
pub(super) fn take_segment(bytes: &mut &[u8]) -> Option<Segment> {
    let (mut segment, rest): (Segment, &[u8]) = postcard::take_from_bytes(bytes).ok()?;
    *bytes = rest;
    let runs = take(bytes)?;
    let (mut guess, mut bits) = (Guess::new(), Reader::of(bytes));
    // Most runs need two bytes or more, so a much higher count may come from damaged data.
    segment.runs.reserve_exact(usize::try_from(runs).unwrap_or(usize::MAX).min(bytes.len()));
    for _ in 0..runs {
        segment.runs.push(take_run(&mut guess, &mut bits)?);
    }
    *bytes = bits.rest();
    Some(segment)
}

fn put_run(run: &Run, guess: &mut Guess, bits: &mut Writer) {
    let grain = Grain::of(run);
    let goes_on = (run.axes, run.forward, grain) == (guess.axes, guess.forward, Grain::Coarse);
    bits.put(u64::from(goes_on), 1);
    if !goes_on {
        bits.put(u64::from(run.axes != guess.axes), 1);
        if run.axes != guess.axes {
            bits.put(u64::from(run.axes), 8);
        }
        bits.put(u64::from(run.forward), 1);
        bits.put(grain as u64, 2);
    }
    guess.turn(run.axes, run.forward);
    // Two is the most frequent count; XOR gives it the shortest code.
    bits.put_small(u64::from(run.count ^ 2));
    let (interval_bits, change_bits) = grain.bits(run.count);
    let interval = run.first_parts();
    let off = (interval >> interval_bits) - (guess.next >> interval_bits);
    bits.put_usual(off, &mut guess.interval_bits[grain as usize]);
    if grain.tells_change(run.count) {
        let off = (i64::from(run.change) >> change_bits)
            - (guess.change(interval, run.count, grain) >> change_bits);
        bits.put_usual(off, &mut guess.change_bits[grain as usize]);
    }
    guess.learn(run);
}

fn take_run(guess: &mut Guess, bits: &mut Reader<'_>) -> Option<Run> {
    let (mut axes, mut forward, mut grain) = (guess.axes, guess.forward, Grain::Coarse);
    if bits.take(1)? == 0 {
        if bits.take(1)? == 1 {
            axes = bits.take(8)? as u8;
        }
        forward = bits.take(1)? == 1;
        grain = match bits.take(2)? {
            0 => Grain::Coarse,
            1 => Grain::Ticks,
            2 => Grain::Parts,
            _ => return None,
        };
    }
    guess.turn(axes, forward);
    let count = u32::try_from(bits.take_small()?).ok()? ^ 2;
    let (interval_bits, change_bits) = grain.bits(count);
    let off = bits.take_usual(&mut guess.interval_bits[grain as usize])?;
    let interval = within(off.checked_add(guess.next >> interval_bits)?, interval_bits)?;
    let mut change = 0;
    if grain.tells_change(count) {
        let off = bits.take_usual(&mut guess.change_bits[grain as usize])?;
        let guessed = guess.change(interval, count, grain) >> change_bits;
        change = within(off.checked_add(guessed)?, change_bits)?;
    }
    let parts = u64::try_from(interval).ok()?;
    let run = Run {
        axes,
        forward,
        interval: u32::try_from(parts >> 16).ok()?,
        fraction: (parts & 0xFFFF) as u16,
        count,
        change: i32::try_from(change).ok()?,
    };
    guess.learn(&run);
    Some(run)
}

/// `number` · 2^`bits`; none if it exceeds any interval.
fn within(number: i64, bits: u32) -> Option<i64> {
    number.checked_mul(1 << bits).filter(|parts| (-LONGEST..=LONGEST).contains(parts))
}

/// Appends a number in groups of seven bits, lowest first; the highest bit of a byte means that more follow.
pub(super) fn put(mut number: u64, bytes: &mut Vec<u8>) {
    while number >= 0x80 {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
}

pub(super) fn take(bytes: &mut &[u8]) -> Option<u64> {
    let mut number = 0_u64;
    for shift in (0..64).step_by(7) {
        let (byte, rest) = bytes.split_first()?;
        *bytes = rest;
        number |= u64::from(byte & 0x7F) << shift;
        if byte & 0x80 == 0 {
            return Some(number);
        }
    }
    None
}
