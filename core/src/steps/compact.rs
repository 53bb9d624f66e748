//! A stream in few bytes, as it would be sent: what the digest hashes has fixed widths, this has not.
//!
//! ```text
//! segment   its data (postcard)   how many runs   run run run …
//! run       head                  what the interval is off the guess     what the change is off the last one
//!           axes? way exact count
//! ```
//!
//! The guess of an interval is what it would be had the run before of the same axes gone on. Both numbers are counted in the
//! fineness that runs of so many steps are made with (`fineness`), those of other runs in parts of a tick (`exact`).
//!
//! Comes in: a stream. Goes out: bytes, and the same stream from them. Does not know how runs are made.

use super::stream::{Run, Segment, StepStream, fineness};

/// Bits of the head of a run: the axes follow; it counts up; its numbers are exact; the rest is how many steps it has.
const AXES_FOLLOW: u8 = 1;
const FORWARD: u8 = 2;
const EXACT: u8 = 4;
const COUNT_SHIFT: u32 = 3;

/// A count that is not in the head but follows.
const COUNT_FOLLOWS: u8 = 31;

/// What is known of the runs before, for one after the other.
#[derive(Default)]
struct Guess {
    axes: u8,
    interval: i64,
    change: i64,
}

impl Guess {
    /// Learns from a run: how it would go on.
    fn learn(&mut self, run: &Run) {
        let next = run.parts_before(run.count);
        self.axes = run.axes;
        self.interval = i64::try_from(next).unwrap_or(0).clamp(0, 1 << 48);
        if run.count > 1 {
            self.change = i64::from(run.change);
        }
    }

    /// Forgets where the axes of `run` are others than before.
    fn of(&mut self, axes: u8) {
        if axes != self.axes {
            *self = Self { axes, ..Self::default() };
        }
    }
}

/// The bytes of a stream.
pub fn compact(stream: &StepStream) -> Vec<u8> {
    let mut bytes = postcard::to_allocvec(&(stream.start, stream.segments.len() as u64)).unwrap_or_default();
    for segment in &stream.segments {
        put_segment(segment, &mut bytes);
    }
    bytes
}

/// Appends the bytes of a segment.
pub(super) fn put_segment(segment: &Segment, bytes: &mut Vec<u8>) {
    bytes.extend(postcard::to_allocvec(&bare(segment)).unwrap_or_default());
    put(segment.runs.len() as u64, bytes);
    let mut guess = Guess::default();
    for run in &segment.runs {
        put_run(run, &mut guess, bytes);
    }
}

/// A segment without its runs.
fn bare(segment: &Segment) -> Segment {
    let Segment { leg, mark, stage, duration_ticks, effect, gate, end, .. } = *segment;
    Segment { leg, mark, stage, duration_ticks, runs: Vec::new(), effect, gate, end }
}

/// The stream of such bytes; none where they are not all of one.
pub fn expand(bytes: &[u8]) -> Option<StepStream> {
    let ((start, count), mut bytes): ((_, u64), &[u8]) = postcard::take_from_bytes(bytes).ok()?;
    let mut stream = StepStream { start, segments: Vec::new() };
    for _ in 0..count {
        stream.segments.push(take_segment(&mut bytes)?);
    }
    bytes.is_empty().then_some(stream)
}

/// Takes a segment off the front of `bytes`; none where they do not begin with one.
pub(super) fn take_segment(bytes: &mut &[u8]) -> Option<Segment> {
    let (mut segment, rest): (Segment, &[u8]) = postcard::take_from_bytes(bytes).ok()?;
    *bytes = rest;
    let runs = take(bytes)?;
    let mut guess = Guess::default();
    // A run has two bytes at least.
    segment.runs.reserve_exact(usize::try_from(runs).unwrap_or(usize::MAX).min(bytes.len() / 2));
    for _ in 0..runs {
        segment.runs.push(take_run(&mut guess, bytes)?);
    }
    Some(segment)
}

fn put_run(run: &Run, guess: &mut Guess, bytes: &mut Vec<u8>) {
    let (interval_bits, change_bits) = fineness(run.count);
    let (interval, change) = (run.first_parts(), i64::from(run.change));
    let coarse = interval % (1 << interval_bits) == 0
        && change % (1 << change_bits) == 0
        && (run.count > 1 || change == 0);
    let follows = run.axes != guess.axes;
    guess.of(run.axes);
    let count = u8::try_from(run.count).ok().filter(|count| *count < COUNT_FOLLOWS).unwrap_or(COUNT_FOLLOWS);
    let flag = |set: bool, bit: u8| if set { bit } else { 0 };
    bytes.push(
        flag(follows, AXES_FOLLOW) | flag(run.forward, FORWARD) | flag(!coarse, EXACT) | count << COUNT_SHIFT,
    );
    if follows {
        bytes.push(run.axes);
    }
    if count == COUNT_FOLLOWS {
        put(u64::from(run.count), bytes);
    }
    let (interval_bits, change_bits) = if coarse { (interval_bits, change_bits) } else { (0, 0) };
    put_signed((interval >> interval_bits) - (guess.interval >> interval_bits), bytes);
    if !coarse || run.count > 1 {
        put_signed((change >> change_bits) - (guess.change >> change_bits), bytes);
    }
    guess.learn(run);
}

fn take_run(guess: &mut Guess, bytes: &mut &[u8]) -> Option<Run> {
    let (head, rest) = bytes.split_first()?;
    *bytes = rest;
    let mut axes = guess.axes;
    if head & AXES_FOLLOW != 0 {
        let (follows, rest) = bytes.split_first()?;
        (axes, *bytes) = (*follows, rest);
    }
    guess.of(axes);
    let count = match head >> COUNT_SHIFT {
        COUNT_FOLLOWS => u32::try_from(take(bytes)?).ok()?,
        count => u32::from(count),
    };
    let coarse = head & EXACT == 0;
    let (interval_bits, change_bits) = if coarse { fineness(count) } else { (0, 0) };
    let interval = (take_signed(bytes)?.checked_add(guess.interval >> interval_bits)?) << interval_bits;
    let mut change = 0;
    if !coarse || count > 1 {
        change = (take_signed(bytes)?.checked_add(guess.change >> change_bits)?) << change_bits;
    }
    let parts = u64::try_from(interval).ok()?;
    let run = Run {
        axes,
        forward: head & FORWARD != 0,
        interval: u32::try_from(parts >> 16).ok()?,
        fraction: (parts & 0xFFFF) as u16,
        count,
        change: i32::try_from(change).ok()?,
    };
    guess.learn(&run);
    Some(run)
}

/// A number in groups of seven bits, the lowest first; the highest bit says that more follow.
pub(super) fn put(mut number: u64, bytes: &mut Vec<u8>) {
    while number >= 0x80 {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
}

/// The same with the sign as the lowest bit.
fn put_signed(number: i64, bytes: &mut Vec<u8>) {
    put(((number << 1) ^ (number >> 63)) as u64, bytes);
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

fn take_signed(bytes: &mut &[u8]) -> Option<i64> {
    let number = take(bytes)?;
    Some((number >> 1) as i64 ^ -((number & 1) as i64))
}
