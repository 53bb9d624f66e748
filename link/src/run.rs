//! Steps of one axis at intervals that grow or shrink evenly: the runs of the step stream, and their arithmetic in steps of
//! 32 bits.
//!
//! ```text
//! tick of step i = tick before the run + ⌊(phase + i·interval + i(i−1)/2·change) in parts / 65,536⌋,  i = 1 … count
//! ```
//!
//! The tick before a run is that of the axis' last step, or the start of the chunk for its first run in it. `phase` is half a
//! tick but in a run that goes on with one that was cut in two: there it is what the first part left over.
//!
//! As bytes a run is what it is otherwise than its axis' run before it lets expect: the intervals of ramps go on where those before
//! ended, and change a third less, or half as much more, from run to run.
//!
//! ```text
//! forward 1 │ phase follows 1 │ even 1 │ zeros 5      the parts and their change are so many times halved without a rest
//! count │ parts − expected │ change − expected        of seven bits a byte; no change where it is even
//! phase u16
//! ```
//!
//! Comes in: runs. Goes out: bytes, or ticks. Does not know axes or chunks.

use crate::bytes::{Reader, Writer};

/// Half a tick.
pub const HALF: u16 = 1 << 15;

/// Bits of the first byte of a run; the others are how often it can be halved.
const FORWARD: u8 = 1 << 7;
const PHASE: u8 = 1 << 6;
const EVEN: u8 = 1 << 5;
const ZEROS: u32 = 31;

/// Longest run, in steps.
const MOST: u32 = 1 << 20;

/// Longest interval, in ticks: more than any tail.
const LONGEST: u32 = 1 << 24;

/// Steps of one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    /// Whether they count up.
    pub forward: bool,
    /// How many, at least 1.
    pub count: u32,
    /// Whole ticks of the interval before the first.
    pub interval: u32,
    /// What it is longer than that, in parts of a tick, 65,536 to the tick.
    pub fraction: u16,
    /// Change of the interval after every step, in parts of a tick.
    pub change: i32,
    /// Parts of a tick that are counted from.
    pub phase: u16,
}

impl Run {
    /// One step, so many ticks later.
    pub fn one(forward: bool, interval: u32) -> Self {
        Self { forward, count: 1, interval, fraction: 0, change: 0, phase: HALF }
    }

    /// The interval before the first step, in parts of a tick.
    fn parts(&self) -> i64 {
        i64::from(self.interval) << 16 | i64::from(self.fraction)
    }

    /// Parts and change of the run behind this one, as a ramp would go on.
    #[inline(always)]
    fn expected(&self) -> (i64, i32) {
        if self.change == 0 {
            return (self.parts().clamp(0, i64::from(LONGEST) << 16), 0);
        }
        let parts = self.parts() + i64::from(self.count) * i64::from(self.change);
        let more = if self.change < 0 { -(self.change / 4) } else { self.change / 2 };
        (parts.clamp(0, i64::from(LONGEST) << 16), self.change.wrapping_add(more))
    }

    /// Writes it; `before` is the run of its axis before it, where there is one.
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

    /// Reads it; `before` is the run of its axis before it, where there is one.
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

    /// Goes over one without reading it.
    pub fn skip(from: &mut Reader<'_>) -> Option<()> {
        let &[flags] = from.bytes(1)? else { return None };
        let numbers = if flags & EVEN == 0 { 3 } else { 2 };
        (0..numbers).try_for_each(|_| from.skip())?;
        if flags & PHASE == 0 { Some(()) } else { from.bytes(2).map(|_| ()) }
    }

    /// The shortest interval in it, in whole ticks, and the ticks from before it to its first and its last step. None where
    /// it has no steps, or goes back, or takes longer than any tail.
    pub fn extent(&self) -> Option<Extent> {
        if self.count == 0 || self.count > MOST || self.interval > LONGEST {
            return None;
        }
        let first = i64::from(self.interval) << 16 | i64::from(self.fraction);
        // A small processor takes its time to multiply such numbers.
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

/// What a run takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extent {
    /// No two steps of it are closer, in ticks.
    pub shortest: u32,
    /// Ticks to its first step.
    pub first: u32,
    /// Ticks to its last step.
    pub last: u32,
}

/// Where ticks of a chunk lie in the machine's time, and what words are made of them.
#[derive(Clone, Copy, Debug)]
pub struct Stretch {
    /// Ticks of the chunk from … until.
    pub from: u32,
    /// See `from`: the last one of the slice.
    pub until: u32,
    /// The machine's tick at `from`.
    pub machine: u32,
    /// Ticks of the machine to a tick of the chunk, in 1/65,536.
    pub inverse: u32,
    /// Added before the parts are cut off.
    pub offset: u32,
    /// Least ticks from pulse to pulse.
    pub least: u32,
    /// A word is the ticks since the last pulse, times this,
    pub scale: u32,
    /// and this.
    pub base: u32,
}

impl Stretch {
    /// The machine's tick at a tick of the chunk within the slice.
    #[inline(always)]
    pub fn machine_tick(&self, tick: u32) -> u32 {
        let parts = tick.wrapping_sub(self.from).wrapping_mul(self.inverse).wrapping_add(self.offset);
        self.machine.wrapping_add(parts >> 16)
    }
}

/// A place in a run: the next step of it.
#[derive(Clone, Copy, Debug)]
pub struct Cursor {
    /// Tick of the next step, counted as the tick before the run was.
    pub tick: u32,
    /// Steps left, the next one included.
    pub left: u32,
    /// Whether they count up.
    pub forward: bool,
    part: u32,
    interval: u32,
    fraction: u32,
    change: u32,
    change_fraction: u32,
}

impl Cursor {
    /// In no run.
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

    /// Goes to the next step. With none left the tick means nothing.
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

    /// Whether [`Self::burst`] can go on from here: no interval of a slice is then too long for its arithmetic.
    #[inline(always)]
    pub fn is_quick(&self) -> bool {
        self.left > 0 && self.interval < 1 << 15
    }

    /// The steps up to `span.until` as words behind each other, as many as `out` has places for: how many, the machine's tick and
    /// the chunk's tick of the last. `before` is the machine's tick of the pulse before them; the next step is not behind
    /// `span.until`. Made to be fast on a small processor: ticks and parts are one number, counted from the slice.
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

    /// What is left of `run` from the next step on, as a run of its own that follows `before`: the next step by itself, and
    /// those behind it.
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
