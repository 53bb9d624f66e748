//! Runs played back as pulses in order of time.
//!
//! ```text
//! X  .   .  . . . .  .   .        each axis walks through its own runs;
//! Y    .     .   .     .          the earliest next step is played, steps of several
//!    ──────────────────────▶      axes in the same tick together
//! ```
//!
//! Comes in: a segment or a stream. Goes out: [`Pulse`]s, as [`crate::pins::Pins::step`] takes them. Knows nothing else.

use super::stream::{Run, Segment, StepStream};
use crate::machine::AXES;

/// Steps that come in the same tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pulse {
    /// When, in ticks from the start of the segment or stream.
    pub tick: u64,
    /// The axes that step, one bit each.
    pub axes: u8,
    /// Those of them that count up.
    pub forward: u8,
}

/// The pulses of one segment.
#[derive(Clone, Debug)]
pub struct Replay<'a> {
    cursors: [Cursor<'a>; AXES],
    /// Axes with steps left.
    active: usize,
}

/// The place of one axis in its runs.
#[derive(Clone, Copy, Debug)]
struct Cursor<'a> {
    bit: u8,
    forward: bool,
    /// Tick of the next step.
    tick: i64,
    interval: i64,
    change: i64,
    /// Steps left in this run, the next one included.
    left: u32,
    later: &'a [Run],
}

/// The pulses of `segment` in order of time, ticks counted from its start.
pub fn replay(segment: &Segment) -> Replay<'_> {
    let idle = Cursor { bit: 0, forward: false, tick: 0, interval: 0, change: 0, left: 0, later: &[] };
    let mut replay = Replay { cursors: [idle; AXES], active: 0 };
    for runs in segment.runs.chunk_by(|a, b| a.axis == b.axis) {
        let Some(first) = runs.first() else { continue };
        let mut cursor =
            Cursor { bit: 1_u8.checked_shl(u32::from(first.axis)).unwrap_or(0), later: runs, ..idle };
        if replay.active < AXES && cursor.next_run() {
            replay.cursors[replay.active] = cursor;
            replay.active += 1;
        }
    }
    replay
}

/// The pulses of a whole stream, ticks counted from its start.
pub fn replay_stream(stream: &StepStream) -> impl Iterator<Item = Pulse> {
    let starts = stream.segments.iter().scan(0_u64, |now, segment| {
        let start = *now;
        *now = now.saturating_add(segment.duration_ticks);
        Some((start, segment))
    });
    starts.flat_map(|(start, segment)| {
        replay(segment).map(move |pulse| Pulse { tick: start.saturating_add(pulse.tick), ..pulse })
    })
}

impl Cursor<'_> {
    /// Goes to the first step of the next run that has any; false when there is none.
    fn next_run(&mut self) -> bool {
        while let Some((run, later)) = self.later.split_first() {
            self.later = later;
            if run.count > 0 {
                self.forward = run.forward;
                self.interval = i64::from(run.interval);
                self.change = i64::from(run.change);
                self.left = run.count;
                self.tick = self.tick.saturating_add(self.interval);
                return true;
            }
        }
        false
    }

    /// Goes to the next step; false when there is none.
    #[inline]
    fn advance(&mut self) -> bool {
        self.left -= 1;
        if self.left == 0 {
            return self.next_run();
        }
        self.interval += self.change;
        self.tick = self.tick.saturating_add(self.interval);
        true
    }
}

impl Iterator for Replay<'_> {
    type Item = Pulse;

    #[inline]
    fn next(&mut self) -> Option<Pulse> {
        let tick = self.cursors[..self.active].iter().map(|cursor| cursor.tick).min()?;
        let (mut axes, mut forward) = (0, 0);
        let mut index = 0;
        while index < self.active {
            let cursor = &mut self.cursors[index];
            if cursor.tick == tick {
                axes |= cursor.bit;
                forward |= if cursor.forward { cursor.bit } else { 0 };
                if !cursor.advance() {
                    self.active -= 1;
                    self.cursors.swap(index, self.active);
                    continue;
                }
            }
            index += 1;
        }
        Some(Pulse { tick: u64::try_from(tick).unwrap_or(0), axes, forward })
    }
}
