//! Runs played back as pulses in order of time.
//!
//! ```text
//! X  .   .  . . . .  .   .        each set of axes walks through its own runs;
//! Y    .     .   .     .          the earliest next step is played, steps of several
//!    ──────────────────────▶      axes in the same tick together
//! ```
//!
//! Where the plane may not leave yet although it was planned to, it is put off, and with it the strokes down that follow it: what goes
//! up goes on meanwhile.
//!
//! Comes in: a segment or a stream. Goes out: [`Pulse`]s, as [`crate::pins::Pins::step`] takes them. Knows nothing else.

use super::stream::{PARTS, Run, Segment, StepStream};
use crate::machine::AXES;

/// Axes of the plane.
const PLANE: u8 = 0b11;

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

/// The place of a set of axes in their runs.
#[derive(Clone, Copy, Debug)]
struct Cursor<'a> {
    axes: u8,
    forward: bool,
    /// Tick of the next step, and of the one before it.
    tick: i64,
    before: i64,
    /// Tick before the run.
    base: i64,
    /// From there to the next step, and half a tick, in parts of a tick; and the interval before it.
    parts: i64,
    interval: i64,
    change: i64,
    /// So many ticks later than planned come its steps down.
    put_off: i64,
    /// Steps left in this run, the next one included.
    left: u32,
    later: &'a [Run],
}

impl Replay<'_> {
    /// The axes that have steps left.
    pub fn pending(&self) -> u8 {
        self.cursors[..self.active].iter().fold(0, |axes, cursor| axes | cursor.axes)
    }

    /// Those of them whose next step counts up.
    pub fn forward(&self) -> u8 {
        let up = self.cursors[..self.active].iter().filter(|cursor| cursor.forward);
        up.fold(0, |axes, cursor| axes | cursor.axes)
    }

    /// The tick of the next step, where it is one of the plane.
    pub fn leaves(&self) -> Option<u64> {
        let cursors = &self.cursors[..self.active];
        let first = |plane: bool| {
            let some = cursors.iter().filter(|cursor| (cursor.axes & PLANE != 0) == plane);
            some.map(|cursor| cursor.tick).min()
        };
        let tick = first(true)?;
        first(false).is_none_or(|other| tick <= other).then(|| u64::try_from(tick).unwrap_or(0))
    }

    /// Puts the plane off to just after the next step up, and all strokes down as much. Gives by how many ticks; none where nothing
    /// goes up any more.
    pub fn put_off(&mut self) -> Option<u64> {
        let cursors = &mut self.cursors[..self.active];
        let is_plane = |cursor: &Cursor<'_>| cursor.axes & PLANE != 0;
        let rises = cursors.iter().filter(|cursor| !is_plane(cursor) && cursor.forward);
        let rise = rises.map(|cursor| cursor.tick).min()?;
        let leaves = cursors.iter().filter(|cursor| is_plane(cursor)).map(|cursor| cursor.tick).min()?;
        let ticks = (rise + 1 - leaves).max(1);
        for cursor in cursors {
            if is_plane(cursor) || !cursor.forward {
                cursor.base += ticks;
                cursor.tick += ticks;
            } else {
                cursor.put_off += ticks;
            }
        }
        u64::try_from(ticks).ok()
    }

    /// For every set of axes with steps left: the axes, whether they count up, and the tick of their last step.
    pub fn sets(&self) -> impl Iterator<Item = (u8, bool, u64)> {
        self.cursors[..self.active]
            .iter()
            .map(|cursor| (cursor.axes, cursor.forward, u64::try_from(cursor.before).unwrap_or(0)))
    }
}

/// The pulses of `segment` in order of time, ticks counted from its start.
pub fn replay(segment: &Segment) -> Replay<'_> {
    let idle = Cursor {
        axes: 0,
        forward: false,
        tick: 0,
        before: 0,
        base: 0,
        parts: 0,
        interval: 0,
        change: 0,
        put_off: 0,
        left: 0,
        later: &[],
    };
    let mut replay = Replay { cursors: [idle; AXES], active: 0 };
    for runs in segment.runs.chunk_by(|a, b| a.axes == b.axes) {
        let Some(first) = runs.first() else { continue };
        let mut cursor = Cursor { axes: first.axes, later: runs, ..idle };
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
                self.interval = run.first_parts();
                self.change = i64::from(run.change);
                self.left = run.count;
                self.base = self.tick + if run.forward { 0 } else { std::mem::take(&mut self.put_off) };
                self.parts = PARTS / 2 + self.interval;
                self.find_tick();
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
        self.interval = self.interval.saturating_add(self.change);
        self.parts = self.parts.saturating_add(self.interval);
        self.find_tick();
        true
    }

    /// The whole tick of the next step.
    #[inline]
    fn find_tick(&mut self) {
        self.before = self.tick;
        self.tick = self.base.saturating_add(self.parts >> PARTS.trailing_zeros());
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
                axes |= cursor.axes;
                forward |= if cursor.forward { cursor.axes } else { 0 };
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
