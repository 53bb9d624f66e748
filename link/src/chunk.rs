//! A chunk: head and runs as bytes, and whether it may be played.
//!
//! ```text
//!            places                                  rest, if nothing newer comes
//!  path   ───┼────── chunk ──────┼── chunk ──┼── chunk ──┼
//!            |<────── ticks ────>|<──── its tail ───>|         the tail is the path that follows, in which time comes to rest
//!  rate   1  ‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾'-.                           when its rate falls as steeply as it may: a chunk is begun at
//!         0                         '-.__________            full rate only where all of its tail is here
//! ```
//!
//! Steps at the first tick of a chunk belong to the one before it, steps at its last tick to itself.
//!
//! Comes in: runs of every axis. Goes out: a payload; or a payload, and a verdict. Does not know when it is played.

use crate::bytes::{Plain, Reader, Writer};
use crate::crc::Crc;
use crate::frame::PAYLOAD;
use crate::message::{Chunk, Configure, Refusal};
use crate::run::Run;
use crate::{AXES, FULL_RATE};

/// Ticks of a slice: the rate of time changes from slice to slice.
pub const SLICE: u32 = 1024;

/// Longest chunk, in ticks: 250 ms.
pub const LONGEST: u32 = 2_500_000;

/// Longest tail, in ticks: 1 s, in which slow machines come to rest too.
pub const LONGEST_TAIL: u32 = 10_000_000;

/// Ticks of path in which time comes to rest when its rate falls by `fall` in every slice: the tail of a chunk.
pub fn stopping(fall: u16) -> u32 {
    (FULL_RATE / u32::from(fall.max(1)) + 3) * (SLICE / 2)
}

/// Writes a chunk and its runs into `out`; how long it is, none where there is no room. The counts of runs are set here.
pub fn write(head: &Chunk, runs: [&[Run]; AXES], out: &mut [u8; PAYLOAD]) -> Option<usize> {
    let mut head = *head;
    for (count, own) in head.runs.iter_mut().zip(runs) {
        *count = u8::try_from(own.len()).ok()?;
    }
    let mut writer = Writer::new(out);
    head.put(&mut writer);
    for own in runs {
        let mut before = None;
        for run in own {
            run.put(before, &mut writer);
            before = Some(run);
        }
    }
    writer.end()
}

/// The check over the index of every axis before a chunk and after it.
pub fn places(first: [i32; AXES], last: [i32; AXES]) -> u32 {
    let bytes = first.into_iter().chain(last).flat_map(i32::to_le_bytes);
    bytes.fold(Crc::new(), Crc::with).value()
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
    let (mut stepped, mut latest) = (false, None);
    for _ in 0..count {
        let run = Run::take(latest.as_ref(), from).ok_or(Refusal::Form)?;
        latest = Some(run);
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

/// Whether the chunk of a payload may follow what was before it, its axes at the index `first`; if so, what is before the next,
/// and the index there.
pub fn check(
    head: &Chunk,
    runs: &[u8],
    (before, first): (&[Before; AXES], [i32; AXES]),
    settings: &Configure,
) -> Result<([Before; AXES], [i32; AXES]), Refusal> {
    if head.ticks == 0 || head.ticks > LONGEST {
        return Err(Refusal::Counts);
    }
    if head.fall == 0 || stopping(head.fall) > LONGEST_TAIL {
        return Err(Refusal::Tail);
    }
    let (mut from, mut after, mut last) = (Reader::new(runs), *before, first);
    for (index, place) in after.iter_mut().enumerate() {
        let sum = axis(&mut from, head.runs[index], head.ticks, *place, settings)?;
        last[index] = last[index].wrapping_add(sum.counted);
        *place = Before { shown: head.ahead >> index & 1 == 1, ..sum.before };
    }
    if !from.rest().is_empty() {
        return Err(Refusal::Form);
    }
    if head.places == places(first, last) { Ok((after, last)) } else { Err(Refusal::Index) }
}
