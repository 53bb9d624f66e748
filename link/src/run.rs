//! Steps of one axis at evenly growing or shrinking intervals: the runs of the step stream, with 32-bit
//! arithmetic for each step.
//!
//! ```text
//! tick of step i = tick before the run + ⌊(phase + i·interval + i(i−1)/2·change) in parts / 65,536⌋,  i = 1 … count
//! ```
//!
//! The tick before a run is that of the axis' last step, or the start of the chunk for its first run.
//! `phase` is half a tick. Only in the second part of a run that was cut, it is the fraction left by the
//! first part.
//!
//! As bytes, a run is its difference from a prediction by the axis' previous run. Ramp intervals continue
//! from the previous end; their change shrinks by a quarter or grows by half from run to run.
//!
//! ```text
//! forward 1 │ phase follows 1 │ even 1 │ zeros 5      number of zero bits common to the parts and their change
//! count │ parts − expected │ change − expected        seven bits per byte; no change if even
//! phase u16
//! ```

use crate::bytes::{Reader, Writer};

pub const HALF: u16 = 1 << 15;

/// Bits of a run's first byte; the others are the number of common zero bits.
const FORWARD: u8 = 1 << 7;
const PHASE: u8 = 1 << 6;
const EVEN: u8 = 1 << 5;
const ZEROS: u32 = 31;

const MOST: u32 = 1 << 20;

/// Longest interval, in ticks: more than any tail.
const LONGEST: u32 = 1 << 24;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    /// Counts up.
    pub forward: bool,
    /// Number of steps, at least 1.
    pub count: u32,
    /// Whole ticks of the interval before the first step.
    pub interval: u32,
    /// Fraction of that interval, 65,536 to the tick.
    pub fraction: u16,
    /// Change of the interval after every step, in 1/65,536 of a tick.
    pub change: i32,
    /// Fraction of a tick to start from.
    pub phase: u16,
}

impl Run {
    /// One step after this many ticks.
    pub fn one(forward: bool, interval: u32) -> Self {
        Self { forward, count: 1, interval, fraction: 0, change: 0, phase: HALF }
    }

    /// The interval before the first step, in 1/65,536 of a tick.
    fn parts(&self) -> i64 {
        i64::from(self.interval) << 16 | i64::from(self.fraction)
    }

    /// Predicted interval and change of the next run of a ramp.
    #[inline(always)]
    fn expected(&self) -> (i64, i32) {
        if self.change == 0 {
            return (self.parts().clamp(0, i64::from(LONGEST) << 16), 0);
        }
        let parts = self.parts() + i64::from(self.count) * i64::from(self.change);
        let more = if self.change < 0 { -(self.change / 4) } else { self.change / 2 };
        (parts.clamp(0, i64::from(LONGEST) << 16), self.change.wrapping_add(more))
    }

    /// Writes it; `before` is the axis' previous run, if any.
    pub fn put(&self, before: Option<&Self>, out: &mut Writer<'_>) {
        let (parts, change) = before.map_or((0, 0), Self::expected);
        let zeros = self.parts().trailing_zeros().min(self.change.trailing_zeros()).min(ZEROS);
        let (is_even, has_phase) = (self.change == 0, self.phase != HALF);
        let flag = |is: bool, bit: u8| if is { bit } else { 0 };
        out.bytes(&[flag(self.forward, FORWARD)
            | flag(has_phase, PHASE)
            | flag(is_even, EVEN)
            | zeros as u8]);
        out.short(self.count);
        out.long_signed((self.parts() >> zeros) - (parts >> zeros));
        if !is_even {
            out.long_signed(i64::from(self.change >> zeros) - i64::from(change >> zeros));
        }
        if has_phase {
            out.bytes(&self.phase.to_le_bytes());
        }
    }

    /// Reads it; `before` is the axis' previous run, if any.
    pub fn take(before: Option<&Self>, from: &mut Reader<'_>) -> Option<Self> {
        let (parts, change) = before.map_or((0, 0), Self::expected);
        let &[flags] = from.bytes(1)? else { return None };
        let zeros = u32::from(flags) & ZEROS;
        let count = from.short()?;
        let parts = ((parts >> zeros) + from.long_signed()?) << zeros;
        let change = if flags & EVEN == 0 {
            i32::try_from((i64::from(change >> zeros) + from.long_signed()?) << zeros).ok()?
        } else {
            0
        };
        let phase =
            if flags & PHASE == 0 { HALF } else { u16::from_le_bytes(from.bytes(2)?.try_into().ok()?) };
        let interval = u32::try_from(parts >> 16).ok()?;
        Some(Self { forward: flags & FORWARD != 0, count, interval, fraction: parts as u16, change, phase })
    }

    pub fn skip(from: &mut Reader<'_>) -> Option<()> {
        let &[flags] = from.bytes(1)? else { return None };
        let numbers = if flags & EVEN == 0 { 3 } else { 2 };
        (0..numbers).try_for_each(|_| from.skip())?;
        if flags & PHASE == 0 { Some(()) } else { from.bytes(2).map(|_| ()) }
    }

    /// Its extent in ticks; `None` if it has no steps, goes back in time, or takes longer than any tail.
    pub fn extent(&self) -> Option<Extent> {
        if self.count == 0 || self.count > MOST || self.interval > LONGEST {
            return None;
        }
        let first = i64::from(self.interval) << 16 | i64::from(self.fraction);
        // These multiplications are slow on a small processor.
        let is_even = self.count == 1 || self.change == 0;
        let last = if is_even { first } else { first + i64::from(self.count - 1) * i64::from(self.change) };
        if !(0..i64::from(LONGEST) << 16).contains(&last) {
            return None;
        }
        let all = if self.count == 1 { first } else { i64::from(self.count) * (first + last) / 2 };
        let ticks = |parts: i64| u32::try_from((parts + i64::from(self.phase)) >> 16).ok();
        Some(Extent {
            shortest: u32::try_from(first.min(last) >> 16).ok()?,
            first: ticks(first)?,
            last: ticks(all)?,
        })
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extent {
    /// Shortest interval between its steps, in whole ticks.
    pub shortest: u32,
    /// Ticks to its first step.
    pub first: u32,
    /// Ticks to its last step.
    pub last: u32,
}

/// Maps ticks of a chunk to machine time, and to words.
#[derive(Clone, Copy, Debug)]
pub struct Stretch {
    /// First tick of the slice.
    pub from: u32,
    /// Last tick of the slice.
    pub until: u32,
    /// The machine tick at `from`.
    pub machine: u32,
    /// Machine ticks per chunk tick, in 1/65,536.
    pub inverse: u32,
    /// Added before the fraction is cut off.
    pub offset: u32,
    /// Least ticks from pulse to pulse.
    pub least: u32,
    /// A word is the ticks since the last pulse, times `scale`, plus `base`.
    pub scale: u32,
    pub base: u32,
}

impl Stretch {
    #[inline(always)]
    pub fn machine_tick(&self, tick: u32) -> u32 {
        let parts = tick.wrapping_sub(self.from).wrapping_mul(self.inverse).wrapping_add(self.offset);
        self.machine.wrapping_add(parts >> 16)
    }
}

/// Position in a run: its next step.
#[derive(Clone, Copy, Debug)]
pub struct Cursor {
    /// Tick of the next step, on the same scale as the tick before the run.
    pub tick: u32,
    /// Steps left, including the next one.
    pub left: u32,
    /// Counts up.
    pub forward: bool,
    part: u32,
    interval: u32,
    fraction: u32,
    change: u32,
    change_fraction: u32,
}

impl Cursor {
    pub const NONE: Self = Self {
        tick: 0,
        left: 0,
        forward: false,
        part: 0,
        interval: 0,
        fraction: 0,
        change: 0,
        change_fraction: 0,
    };

    /// At the first step of `run`, which follows `before`.
    pub fn at(run: &Run, before: u32) -> Self {
        let part = u32::from(run.phase) + u32::from(run.fraction);
        Self {
            tick: before.wrapping_add(run.interval).wrapping_add(part >> 16),
            left: run.count,
            forward: run.forward,
            part: part & 0xFFFF,
            interval: run.interval,
            fraction: u32::from(run.fraction),
            change: (run.change >> 16) as u32,
            change_fraction: run.change as u32 & 0xFFFF,
        }
    }

    /// Advances to the next step. After the last one, the tick is meaningless.
    #[inline(always)]
    pub fn advance(&mut self) {
        self.left = self.left.wrapping_sub(1);
        let fraction = self.fraction + self.change_fraction;
        self.interval = self.interval.wrapping_add(self.change).wrapping_add(fraction >> 16);
        self.fraction = fraction & 0xFFFF;
        let part = self.part + self.fraction;
        self.tick = self.tick.wrapping_add(self.interval).wrapping_add(part >> 16);
        self.part = part & 0xFFFF;
    }

    /// Returns `true` if [`Self::burst`] can continue from here: no interval overflows its arithmetic.
    #[inline(always)]
    pub fn is_quick(&self) -> bool {
        self.left > 0 && self.interval < 1 << 15
    }

    /// Writes the steps up to `span.until` as consecutive words, as many as `out` holds. Returns their
    /// number, and machine tick and chunk tick of the last. `before` is the machine tick of the previous
    /// pulse; the next step must not be after `span.until`. Fast on a small processor: ticks and fractions
    /// share one number, counted from the slice.
    #[inline(never)]
    pub fn burst<const STRETCHED: bool>(
        &mut self,
        before: u32,
        span: &Stretch,
        out: &mut [u32],
    ) -> (u32, u32, u32) {
        let mut place = self.tick.wrapping_sub(span.from) << 16 | self.part;
        let mut parts = self.interval << 16 | self.fraction;
        let change = self.change << 16 | self.change_fraction;
        let until = span.until.wrapping_sub(span.from) << 16 | 0xFFFF;
        let (scale, base) = (span.scale, span.base);
        let room = out.len().min(self.left as usize);
        let mut words = out[..room].iter_mut();
        let (mut last, mut tick) = (before.wrapping_sub(span.machine), 0);
        while place <= until {
            let Some(word) = words.next() else { break };
            tick = place >> 16;
            let mut at = tick;
            if STRETCHED {
                at = tick.wrapping_mul(span.inverse).wrapping_add(span.offset) >> 16;
                if (at.wrapping_sub(last) as i32) < span.least as i32 {
                    at = last.wrapping_add(span.least);
                }
            }
            *word = at.wrapping_sub(last).wrapping_mul(scale).wrapping_add(base);
            last = at;
            parts = parts.wrapping_add(change);
            place = place.wrapping_add(parts);
        }
        let count = (room - words.len()) as u32;
        (self.interval, self.fraction) = (parts >> 16, parts & 0xFFFF);
        (self.tick, self.part) = ((place >> 16).wrapping_add(span.from), place & 0xFFFF);
        self.left -= count;
        (count, last.wrapping_add(span.machine), tick.wrapping_add(span.from))
    }

    /// The rest of `run` from the next step on, as runs that follow `before`: the next step alone, and the
    /// steps after it.
    pub fn rest(&self, run: &Run, before: u32) -> [Option<Run>; 2] {
        if self.left == 0 {
            return [None, None];
        }
        let one = Run::one(run.forward, self.tick.wrapping_sub(before));
        let mut later = *self;
        later.advance();
        let behind = (later.left > 0).then_some(Run {
            count: later.left,
            interval: later.interval,
            fraction: later.fraction as u16,
            phase: self.part as u16,
            ..*run
        });
        [Some(one), behind]
    }
}
