//! A stream in few bytes, as it would be sent: what the digest hashes has fixed widths, this has not.
//!
//! ```text
//! segment   its data (postcard)   how many runs   run run run … to the end of a byte
//! run       head   what the interval is off the guess     what the change is off the guess
//! head      1                                       the same axes the same way, coarse
//!           0  axes follow? axes  way  grain        whatever differs
//!           how many steps
//! ```
//!
//! The guess of an interval is what it would be had the run before of the same axes gone on; that of a change, what leads
//! from the last interval of that run to the first of this one as steadily. Both are counted in the fineness that runs of so
//! many steps are made with (`fineness`), those of other runs in ticks or in parts of one: the grain.
//!
//! A number off a guess is written as how many bits it has, against how many such numbers had of late, and then those bits:
//! numbers that are alike cost little more than what is in them.
//!
//! Comes in: a stream. Goes out: bytes, and the same stream from them. Does not know how runs are made.

use super::bits::{Reader, Usual, Writer};
use super::stream::{PARTS, Run, Segment, StepStream, fineness};

/// No interval is longer, in parts of a tick, and no guess: whatever a run says, nothing overflows.
const LONGEST: i64 = 1 << 48;

/// What the numbers of a run are multiples of.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Grain {
    /// What runs of so many steps are made with.
    Coarse = 0,
    Ticks = 1,
    Parts = 2,
}

impl Grain {
    /// The coarsest that a run can be told in.
    fn of(run: &Run) -> Self {
        let fits = |grain: Self| {
            let (interval_bits, change_bits) = grain.bits(run.count);
            run.first_parts() % (1 << interval_bits) == 0
                && run.change % (1 << change_bits) == 0
                && (run.count > 1 || run.change == 0)
        };
        [Self::Coarse, Self::Ticks].into_iter().find(|grain| fits(*grain)).unwrap_or(Self::Parts)
    }

    /// Of a run of `count` steps the powers of two for interval and change.
    fn bits(self, count: u32) -> (u32, u32) {
        match self {
            Self::Coarse => fineness(count),
            Self::Ticks => (PARTS.trailing_zeros(), PARTS.trailing_zeros()),
            Self::Parts => (0, 0),
        }
    }

    /// Whether the change of a run of `count` steps is told.
    fn tells_change(self, count: u32) -> bool {
        count > 1 || self == Self::Parts
    }
}

/// What is known of the runs before, for one after the other.
struct Guess {
    axes: u8,
    forward: bool,
    /// Interval before the last step, and what the next one would be.
    last: i64,
    next: i64,
    /// How long such numbers were, grain by grain.
    interval_bits: [Usual; 3],
    change_bits: [Usual; 3],
}

impl Guess {
    /// At the start of a segment.
    fn new() -> Self {
        let usual = [7, 12, 24].map(Usual::new);
        Self { axes: 0, forward: false, last: 0, next: 0, interval_bits: usual, change_bits: usual }
    }

    /// Learns from a run: how it would go on.
    fn learn(&mut self, run: &Run) {
        let before = |index: u32| run.parts_before(index).clamp(0, i128::from(LONGEST)) as i64;
        (self.last, self.next) = (before(run.count.saturating_sub(1)), before(run.count));
    }

    /// Which axes go which way. Of others than before nothing is known.
    fn turn(&mut self, axes: u8, forward: bool) {
        if axes != self.axes {
            (self.last, self.next) = (0, 0);
        }
        (self.axes, self.forward) = (axes, forward);
    }

    /// The change of a run of `count` steps that begins with `interval`.
    fn change(&self, interval: i64, count: u32, grain: Grain) -> i64 {
        // Whole ticks are those of steps, which come evenly.
        if grain == Grain::Coarse { 2 * (interval - self.last) / (i64::from(count) + 1) } else { 0 }
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
    let (mut guess, mut bits) = (Guess::new(), Writer::onto(bytes));
    for run in &segment.runs {
        put_run(run, &mut guess, &mut bits);
    }
    bits.end();
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
    let (mut guess, mut bits) = (Guess::new(), Reader::of(bytes));
    // Most runs have two bytes or more; what says that it has many more runs than bytes may be damaged.
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
    // Two is the most usual.
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

/// A number times a power of two; none where it is greater than any interval.
fn within(number: i64, bits: u32) -> Option<i64> {
    number.checked_mul(1 << bits).filter(|parts| (-LONGEST..=LONGEST).contains(parts))
}

/// A number in groups of seven bits, the lowest first; the highest bit says that more follow.
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
