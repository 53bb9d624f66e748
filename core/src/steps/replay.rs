//! Plays runs as pulses in order of time.
//!
//! ```text
//! X  .   .  . . . .  .   .        each set of axes advances through its own runs;
//! Y    .     .   .     .          the earliest next step is played; steps of several
//!    ──────────────────────▶      axes in one tick are played together
//! ```
//!
//! If XY may not start as planned, it is delayed, and so are the downward strokes after it. Upward strokes
//! continue meanwhile.

use super::stream::{PARTS, Run, Segment, StepStream};
use crate::machine::AXES;

const PLANE: u8 = 0b11;

/// Steps in one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pulse {
    /// Time in ticks from the start of the segment or stream.
    pub tick: u64,
    /// Axes that step, one bit each.
    pub axes: u8,
    /// Axes that count up; all others in `axes` count down.
    pub forward: u8,
}

#[derive(Clone, Debug)]
pub struct Replay<'a> {
    cursors: [Cursor<'a>; AXES],
    active: usize,
}

#[derive(Clone, Copy, Debug)]
struct Cursor<'a> {
    axes: u8,
    forward: bool,
    /// Tick of the next step, and of the previous one.
    tick: i64,
    before: i64,
    base: i64,
    /// Time from there to the next step plus half a tick, in parts of a tick; and the interval before it.
    parts: i64,
    interval: i64,
    change: i64,
    /// Delay of downward steps, in ticks.
    put_off: i64,
    /// Steps left in this run, including the next one.
    left: u32,
    later: &'a [Run],
}

impl Replay<'_> {
    /// Axes with steps left.
    pub fn pending(&self) -> u8 {
        self.cursors[..self.active].iter().fold(0, |axes, cursor| axes | cursor.axes)
    }

    pub fn forward(&self) -> u8 {
        let up = self.cursors[..self.active].iter().filter(|cursor| cursor.forward);
        up.fold(0, |axes, cursor| axes | cursor.axes)
    }

    /// Tick of the next step, if that is the first step of XY.
    pub fn leaves(&self) -> Option<u64> {
        let cursors = &self.cursors[..self.active];
        let first = |plane: bool| {
            let some = cursors.iter().filter(|cursor| (cursor.axes & PLANE != 0) == plane);
            some.map(|cursor| cursor.tick).min()
        };
        let tick = first(true)?;
        first(false).is_none_or(|other| tick <= other).then(|| u64::try_from(tick).unwrap_or(0))
    }

    /// Delays XY to just after the next upward step, and all downward strokes by equal time. Returns the
    /// ticks; none if nothing rises.
    pub fn put_off(&mut self) -> Option<u64> {
        let cursors = &mut self.cursors[..self.active];
        let is_plane = |cursor: &Cursor<'_>| cursor.axes & PLANE != 0;
        let rises = cursors.iter().filter(|cursor| !is_plane(cursor) && cursor.forward);
        let rise = rises.map(|cursor| cursor.tick).min()?;
        let leaves = cursors.iter().filter(|cursor| is_plane(cursor)).map(|cursor| cursor.tick).min()?;
        // Just after the next rising step, so that the contact is checked again with higher tips.
        let ticks = (rise + 1 - leaves).max(1);
        for cursor in cursors {
            if is_plane(cursor) || !cursor.forward {
                cursor.base += ticks;
                cursor.tick += ticks;
            } else {
                // A rising set is delayed only when it turns downwards.
                cursor.put_off += ticks;
            }
        }
        u64::try_from(ticks).ok()
    }

    /// For every set of axes with steps left: the axes, the direction, and the tick of the previous step.
    pub fn sets(&self) -> impl Iterator<Item = (u8, bool, u64)> {
        self.cursors[..self.active]
            .iter()
            .map(|cursor| (cursor.axes, cursor.forward, u64::try_from(cursor.before).unwrap_or(0)))
    }
}

/// The pulses of `segment` in order of time, in ticks from its start.
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

/// The pulses of a whole stream, in ticks from its start.
pub fn replay_stream(stream: &StepStream) -> impl Iterator<Item = Pulse> {
    let starts = stream.segments.iter().scan(0_u64, |now, segment| {
        let start = *now;
        // Saturating, because the checker also replays invalid streams.
        *now = now.saturating_add(segment.duration_ticks);
        Some((start, segment))
    });
    starts.flat_map(|(start, segment)| {
        replay(segment).map(move |pulse| Pulse { tick: start.saturating_add(pulse.tick), ..pulse })
    })
}

impl Cursor<'_> {
    /// Advances to the first step of the next run with steps; false if there is none.
    fn next_run(&mut self) -> bool {
        while let Some((run, later)) = self.later.split_first() {
            self.later = later;
            if run.count > 0 {
                self.forward = run.forward;
                self.interval = run.first_parts();
                self.change = i64::from(run.change);
                self.left = run.count;
                self.base = self.tick + if run.forward { 0 } else { std::mem::take(&mut self.put_off) };
                // Half a tick more, so that cutting off the fraction rounds.
                self.parts = PARTS / 2 + self.interval;
                self.find_tick();
                return true;
            }
        }
        false
    }

    /// Advances to the next step; false if there is none.
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
