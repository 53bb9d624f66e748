//! Cuts the path of a segment into chunks; the bridge sends those.
//!
//! ```text
//! run      ──────────────────────────────         may be longer than any chunk: it is cut between two steps, and the
//! chunks   |<─ 1 ─>|<─ 2 ─>|<─ 3 ─>|               fraction of a tick left by the first piece moves to the second
//! ```

use crate::AXES;
use crate::chunk::{LONGEST, SLICE, places, write};
use crate::frame::PAYLOAD;
use crate::message::Chunk;
use crate::run::{Cursor, Run};

const MOST: usize = 240;

/// Most runs of all axes in a chunk: the adapter checks a chunk without a pause, and must still make words
/// in time.
const ALL: usize = 128;

#[derive(Clone, Copy, Debug)]
pub struct Rule {
    pub ticks: u32,
    /// Largest fall or rise of the rate in a slice of [`SLICE`] ticks, in 1/65,536 of full rate.
    pub fall: u16,
    pub rise: u16,
}

impl Rule {
    /// The rule for stopping, and starting, within this many ticks, in chunks of 20 ms.
    pub fn resting_within(ticks: u32) -> Self {
        let slope = crate::FULL_RATE * SLICE / ticks.max(SLICE);
        let slope = u16::try_from(slope).unwrap_or(u16::MAX).max(1);
        Self { ticks: 200_000, fall: slope, rise: slope }
    }
}

#[derive(Clone, Copy, Debug)]
pub struct Runs {
    list: [Run; MOST],
    count: usize,
}

impl Runs {
    const NONE: Self = Self {
        list: [Run { forward: false, count: 0, interval: 0, fraction: 0, change: 0, phase: 0 }; MOST],
        count: 0,
    };

    fn push(&mut self, run: Run) -> Option<()> {
        *self.list.get_mut(self.count)? = run;
        self.count += 1;
        Some(())
    }

    pub fn all(&self) -> &[Run] {
        self.list.get(..self.count).unwrap_or_default()
    }
}

#[derive(Clone, Debug)]
pub struct Piece {
    /// Its head; [`write()`] sets the run counts.
    pub head: Chunk,
    pub runs: [Runs; AXES],
}

impl Piece {
    /// Its runs in the form that [`write()`] takes.
    pub fn slices(&self) -> [&[Run]; AXES] {
        self.runs.each_ref().map(Runs::all)
    }
}

#[derive(Clone, Copy, Debug)]
struct Place<'a> {
    run: Option<Run>,
    cursor: Cursor,
    later: &'a [Run],
}

impl Place<'_> {
    fn next_run(&mut self, before: u32) {
        self.run = None;
        if let Some((run, later)) = self.later.split_first() {
            self.cursor = Cursor::at(run, before);
            (self.run, self.later) = (Some(*run), later);
        }
    }

    /// Takes the steps of the `ticks` ticks after `at`. Returns the distance in steps; `None` if there are
    /// too many runs.
    fn take(&mut self, at: u32, ticks: u32, out: &mut Runs) -> Option<i32> {
        let is_in = |cursor: &Cursor| cursor.left > 0 && cursor.tick.wrapping_sub(at) <= ticks;
        let mut led = 0_i32;
        while let Some(run) = self.run.filter(|_| is_in(&self.cursor)) {
            let begin = self.cursor;
            let (mut count, mut before) = (0, at);
            while is_in(&self.cursor) {
                before = self.cursor.tick;
                self.cursor.advance();
                count += 1;
            }
            if out.count == 0 {
                let [one, behind] = begin.rest(&run, at);
                out.push(one?)?;
                if let Some(behind) = behind.filter(|_| count > 1) {
                    out.push(Run { count: count - 1, ..behind })?;
                }
            } else {
                out.push(Run { count, ..run })?;
            }
            led += if run.forward { count as i32 } else { -(count as i32) };
            if self.cursor.left == 0 {
                self.next_run(before);
            }
        }
        Some(led)
    }
}

#[derive(Clone, Debug)]
pub struct ChunkCutter<'a> {
    axes: [Place<'a>; AXES],
    at: u32,
    left: u64,
    number: u32,
    index: [i32; AXES],
}

impl<'a> ChunkCutter<'a> {
    /// The path of `runs`, `ticks` long, starting at `index`; its first chunk has this `number`.
    pub fn new(runs: [&'a [Run]; AXES], ticks: u64, number: u32, index: [i32; AXES]) -> Self {
        let axes = runs.map(|later| {
            let mut place = Place { run: None, cursor: Cursor::NONE, later };
            place.next_run(0);
            place
        });
        Self { axes, at: 0, left: ticks, number, index }
    }

    pub fn is_done(&self) -> bool {
        self.left == 0
    }

    pub fn number(&self) -> u32 {
        self.number
    }

    /// Index of every axis after the last chunk.
    pub fn index(&self) -> [i32; AXES] {
        self.index
    }

    /// Ticks left, limited to 32 bits.
    fn left(&self) -> u32 {
        u32::try_from(self.left).unwrap_or(u32::MAX)
    }

    /// Cuts the next chunk; `None` at the end. A chunk too long for a frame, or with too many runs, is cut
    /// shorter.
    pub fn cut(&mut self, rule: &Rule) -> Option<Piece> {
        let mut ticks = rule.ticks.min(LONGEST).min(self.left()).max(1);
        while self.left > 0 && ticks > 0 {
            let mut after = self.clone();
            if let Some(piece) = after.piece(ticks, rule) {
                *self = after;
                return Some(piece);
            }
            ticks /= 2;
        }
        None
    }

    fn piece(&mut self, ticks: u32, rule: &Rule) -> Option<Piece> {
        let mut piece = Piece { head: Chunk::default(), runs: [Runs::NONE; AXES] };
        let first = self.index;
        for (axis, place) in self.axes.iter_mut().enumerate() {
            let led = place.take(self.at, ticks, &mut piece.runs[axis])?;
            self.index[axis] = self.index[axis].wrapping_add(led);
        }
        (self.at, self.left) = (self.at.wrapping_add(ticks), self.left.saturating_sub(u64::from(ticks)));
        let mut ahead = 0;
        for (axis, place) in self.axes.iter().enumerate() {
            ahead |= u8::from(place.run.map_or(place.cursor.forward, |run| run.forward)) << axis;
        }
        piece.head = Chunk {
            number: self.number,
            places: places(first, self.index),
            ticks,
            fall: rule.fall,
            rise: rule.rise,
            ahead,
            rests: u8::from(self.left == 0),
            ..Chunk::default()
        };
        self.number = self.number.wrapping_add(1);
        if piece.runs.iter().map(|runs| runs.count).sum::<usize>() > ALL {
            return None;
        }
        write(&piece.head, piece.slices(), &mut [0; PAYLOAD])?;
        Some(piece)
    }
}
