//! A chunk: head and runs as bytes, and whether it may be played.
//!
//! ```text
//!            first                    last            rest, if nothing newer comes
//!  index  ───┼────────────────────────┼──────────────────┼
//!            |<──────── ticks ───────>|<── tail_ticks ──>|      the tail is the path that follows: the next chunk begins with
//!  rate   1  ‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾'-.                         the same steps and takes its place
//!         0                              '-.__________
//! ```
//!
//! Steps at the first tick of a chunk belong to the one before it, steps at its last tick to itself.
//!
//! Comes in: runs of every axis. Goes out: a payload; or a payload, and a verdict. Does not know when it is played.

use crate::bytes::{Plain, Reader, Writer};
use crate::frame::PAYLOAD;
use crate::message::{Chunk, Configure, Refusal};
use crate::run::Run;
use crate::{AXES, FULL_RATE};

/// Ticks of a slice: the rate of time changes from slice to slice.
pub const SLICE: u32 = 1024;

/// Longest chunk, in ticks: 100 ms.
pub const LONGEST: u32 = 1_000_000;

/// Longest tail, in ticks: 1 s, in which slow machines come to rest too.
pub const LONGEST_TAIL: u32 = 10_000_000;

/// Ticks of path in which time comes to rest when its rate falls by `fall` in every slice.
pub fn stopping(fall: u16) -> u32 {
    (FULL_RATE / u32::from(fall.max(1)) + 3) * (SLICE / 2)
}

/// Writes a chunk and its runs into `out`; how long it is, none where there is no room. The counts of runs are set here.
pub fn write(
    head: &Chunk,
    runs: [&[Run]; AXES],
    tail: [&[Run]; AXES],
    out: &mut [u8; PAYLOAD],
) -> Option<usize> {
    let mut head = *head;
    for axis in 0..AXES {
        head.runs[axis] = u8::try_from(runs[axis].len()).ok()?;
        head.tail_runs[axis] = u8::try_from(tail[axis].len()).ok()?;
    }
    let mut writer = Writer::new(out);
    head.put(&mut writer);
    runs.into_iter().chain(tail).flatten().for_each(|run| run.put(&mut writer));
    writer.end()
}

/// Where an axis is when a chunk begins, as far as its pulses are concerned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Before {
    /// Ticks since its last step.
    pub since: u32,
    /// Direction of that step.
    pub forward: bool,
    /// Direction that its pin says now: that of the step to come, as the last chunk told.
    pub shown: bool,
}

impl Before {
    /// At rest for long, its pin saying `forward`.
    pub fn at_rest(forward: bool) -> Self {
        Self { since: u32::MAX >> 1, forward, shown: forward }
    }
}

/// What the runs of one axis come to.
struct Sum {
    counted: i32,
    before: Before,
}

fn axis(
    from: &mut Reader<'_>,
    count: u8,
    ticks: u32,
    before: Before,
    settings: &Configure,
) -> Result<Sum, Refusal> {
    let (pulse, setup) = (u32::from(settings.pulse), u32::from(settings.setup));
    let (mut at, mut now, mut counted) = (0_u32, before, 0_i32);
    let mut stepped = false;
    for _ in 0..count {
        let run = Run::take(from).ok_or(Refusal::Form)?;
        let extent = run.extent().ok_or(Refusal::Form)?;
        let since = if stepped { extent.first } else { before.since.saturating_add(extent.first) };
        if since <= pulse || run.count > 1 && extent.shortest <= pulse {
            return Err(Refusal::Rate);
        }
        // The pin turns when the last pulse is over, or where the chunk begins if nobody said before that it would.
        let untold = !stepped && run.forward != now.shown;
        let seen = if untold { extent.first.min(since - pulse) } else { since - pulse };
        if (untold || run.forward != now.forward) && seen < setup {
            return Err(Refusal::Turn);
        }
        at = at.saturating_add(extent.last);
        let steps = i32::try_from(run.count).map_err(|_| Refusal::Form)?;
        counted = counted.wrapping_add(if run.forward { steps } else { -steps });
        now = Before { since: 0, forward: run.forward, shown: run.forward };
        stepped = true;
    }
    if at > ticks {
        return Err(Refusal::Counts);
    }
    let since = if stepped { ticks - at } else { before.since.saturating_add(ticks).min(u32::MAX >> 1) };
    Ok(Sum { counted, before: Before { since, ..now } })
}

/// Whether the chunk of a payload may follow what was before it; if so, what is before the next.
pub fn check(
    head: &Chunk,
    runs: &[u8],
    before: &[Before; AXES],
    settings: &Configure,
) -> Result<[Before; AXES], Refusal> {
    if head.ticks == 0 || head.ticks > LONGEST || head.tail_ticks > LONGEST_TAIL {
        return Err(Refusal::Counts);
    }
    let short = head.tail_fall > 0 && head.tail_ticks < stopping(head.tail_fall);
    if short || head.rests == 0 && head.tail_ticks == 0 {
        return Err(Refusal::Tail);
    }
    let (mut from, mut after) = (Reader::new(runs), *before);
    for (index, place) in after.iter_mut().enumerate() {
        let sum = axis(&mut from, head.runs[index], head.ticks, *place, settings)?;
        if head.last[index] != head.first[index].wrapping_add(sum.counted) {
            return Err(Refusal::Counts);
        }
        *place = Before { shown: head.ahead >> index & 1 == 1, ..sum.before };
    }
    for (index, place) in after.iter().enumerate() {
        axis(&mut from, head.tail_runs[index], head.tail_ticks, *place, settings)?;
    }
    if from.rest().is_empty() { Ok(after) } else { Err(Refusal::Form) }
}
