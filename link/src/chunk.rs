//! A chunk of path: writes its head and runs as bytes, and checks whether it may be played.
//!
//! ```text
//!          places                                  end, if nothing newer arrives
//! path   ───┼────── chunk ──────┼── chunk ──┼── chunk ──┼
//!           |<────── ticks ────>|<──── its tail ───>|   tail: the following path in which stream time
//! rate   1  ‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾'-.                     stops if its rate falls as steeply as allowed. A chunk
//!        0                         '-.__________      starts at full rate only if its whole tail arrived
//! ```
//!
//! A step at the first tick of a chunk belongs to the chunk before; a step at its last tick belongs to it.

use crate::bytes::{Plain, Reader, Writer};
use crate::crc::Crc;
use crate::frame::PAYLOAD;
use crate::message::{Chunk, Configure, Refusal};
use crate::run::Run;
use crate::{AXES, FULL_RATE};

/// Ticks of a slice: the rate of stream time changes only between slices.
pub const SLICE: u32 = 1024;

/// Longest chunk, in ticks: 250 ms.
pub const LONGEST: u32 = 2_500_000;

/// Longest tail, in ticks: 1 s, enough for slow machines to stop.
pub const LONGEST_TAIL: u32 = 10_000_000;

/// Length of a chunk's tail: ticks of path until stream time stops, if its rate falls by `fall` in every
/// slice.
pub fn stopping(fall: u16) -> u32 {
    (FULL_RATE / u32::from(fall.max(1)) + 3) * (SLICE / 2)
}

/// Writes a chunk and its runs into `out`, and sets the run counts. Returns the length, `None` if there is
/// no room.
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

/// The checksum over the index of every axis before and after a chunk.
pub fn places(first: [i32; AXES], last: [i32; AXES]) -> u32 {
    let bytes = first.into_iter().chain(last).flat_map(i32::to_le_bytes);
    bytes.fold(Crc::new(), Crc::with).value()
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Before {
    /// Ticks since its last step.
    pub since: u32,
    pub forward: bool,
    /// Direction that its pin shows now: the next step's, as announced by the last chunk.
    pub shown: bool,
}

impl Before {
    /// Stopped for a long time, with the pin showing `forward`.
    pub fn at_rest(forward: bool) -> Self {
        Self { since: u32::MAX >> 1, forward, shown: forward }
    }
}

/// Total of an axis's runs.
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
        // The pin turns when the last pulse ends; if the turn was not announced, at the start of this
        // chunk.
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

/// Checks that a chunk may follow the state `before`, with its axes at the index `first`. Returns the state
/// and index after it.
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
