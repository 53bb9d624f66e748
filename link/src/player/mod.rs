//! Turns chunks into words, one list per axis, all on one timeline.
//!
//! ```text
//! word     wait │ pulse 1 │ direction 1     a state machine shows the direction, waits, and gives a pulse or none
//! slice    at most 1,024 machine ticks; within it stream time passes at one rate
//! X        ──wait──^──wait──^──wait─|       every axis gets words up to the end of the slice: the machines
//! Y        ────────wait─────────^─w─|       started in the same cycle and stay synchronous
//! ```
//!
//! At full rate a step keeps its tick of the stream. Below it, all steps of a slice are stretched by one
//! factor from its start, to the next whole tick: the path cannot bend.

mod windings;

use crate::bytes::{Plain, Reader};
use crate::chunk::{SLICE, stopping};
use crate::frame::PAYLOAD;
use crate::message::Chunk;
use crate::phases::{MOTORS, PhaseMotor};
use crate::run::{Cursor, Run, Stretch};
use crate::store::Store;
use crate::{AXES, CYCLES_PER_TICK, FULL_RATE};

/// Cycles of a word before its pulse, in addition to its wait.
pub const BEFORE_PULSE: u32 = 7;

/// Cycles of a word without a pulse, in addition to its wait.
pub const WITHOUT_PULSE: u32 = 6;

const HEAD: usize = 22;

/// Below this rate stream time stops.
const LEAST_RATE: u32 = 64;

pub trait Words {
    /// Appends a word of an axis. The caller has checked the room.
    fn put(&mut self, axis: usize, word: u32);

    /// The next free words of an axis; at least one.
    fn places(&mut self, axis: usize) -> &mut [u32];

    fn filled(&mut self, axis: usize, count: u32);
}

/// The word of a pulse this many ticks after the last word ended.
#[inline(always)]
pub fn pulse_word(ticks: u32, forward: bool) -> u32 {
    (ticks.wrapping_mul(CYCLES_PER_TICK).wrapping_sub(BEFORE_PULSE)) << 2 | 2 | u32::from(forward)
}

/// The word that waits this many ticks.
#[inline(always)]
pub fn wait_word(ticks: u32, forward: bool) -> u32 {
    (ticks.wrapping_mul(CYCLES_PER_TICK).wrapping_sub(WITHOUT_PULSE)) << 2 | u32::from(forward)
}

/// The index before a word that was not played, from the index after it.
pub fn without(word: u32, index: i32) -> i32 {
    match word & 3 {
        3 => index.wrapping_sub(1),
        2 => index.wrapping_add(1),
        _ => index,
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    Rested,
    Starved,
    /// By request, before its end.
    Stopped,
}

#[derive(Clone, Copy, Debug)]
struct Axis {
    cursor: Cursor,
    /// Direction of the step after its last run.
    ahead: bool,
    /// The last run started in this chunk; position in the payload and number of the runs not started.
    run: Option<Run>,
    later: (u16, u8),
    /// Machine tick at which its next word starts.
    word: u32,
    index: i32,
}

#[derive(Debug)]
pub struct Player {
    axes: [Axis; AXES],
    payload: [u8; PAYLOAD],
    head: Chunk,
    in_tail: bool,
    /// Ticks of the waiting chunks, and how many of them end stopped.
    waiting: u32,
    resting: u32,
    /// Ticks of the chunk, ticks passed, and the fraction of the next one.
    ticks: u32,
    passed: u32,
    part: u32,
    /// Machine tick up to which words exist.
    machine: u32,
    rate: u32,
    wanted: u32,
    /// Change of rate carried over from the last slice, and that slice's length.
    owed: u32,
    length: u32,
    is_stopping: bool,
    pulse: u32,
    /// Whether the pins drive windings, and the motors of the first axes.
    is_phases: bool,
    motors: [PhaseMotor; MOTORS],
}

impl Player {
    pub const fn new() -> Self {
        const AXIS: Axis =
            Axis { cursor: Cursor::NONE, ahead: false, run: None, later: (0, 0), word: 0, index: 0 };
        Self {
            axes: [AXIS; AXES],
            payload: [0; PAYLOAD],
            head: Chunk::NONE,
            in_tail: false,
            waiting: 0,
            resting: 0,
            ticks: 0,
            passed: 0,
            part: 0,
            machine: 0,
            rate: FULL_RATE,
            wanted: FULL_RATE,
            owed: 0,
            length: 0,
            is_stopping: false,
            pulse: 10,
            is_phases: false,
            motors: [PhaseMotor::NONE; MOTORS],
        }
    }

    /// Most words that a slice makes for one axis. With windings, forcing may end between any two steps.
    pub fn most_words(&self, pulse: u32) -> u32 {
        if self.is_phases { 2 * most_words(pulse) } else { most_words(pulse) }
    }

    /// The pins were stopped by force at this index.
    pub fn cut_short(&mut self, index: [i32; AXES]) {
        let left = self.axes.iter().zip(index).map(|(axis, index)| axis.index.wrapping_sub(index));
        self.motors.iter_mut().zip(left).for_each(|(motor, left)| motor.undo(left));
        self.place(index);
    }

    /// Index of every axis after the last word.
    pub fn index(&self) -> [i32; AXES] {
        self.axes.map(|axis| axis.index)
    }

    pub fn place(&mut self, index: [i32; AXES]) {
        self.axes.iter_mut().zip(index).for_each(|(axis, index)| axis.index = index);
    }

    /// Direction of every axis's pin.
    pub fn forward(&self) -> [bool; AXES] {
        self.axes.map(|axis| axis.cursor.forward)
    }

    /// Machine tick up to which words exist, counted from the last [`Self::begin`].
    pub fn machine(&self) -> u32 {
        self.machine
    }

    pub fn rate(&self) -> u32 {
        self.rate
    }

    /// Ticks left in the current chunk.
    pub fn left(&self) -> u32 {
        self.ticks.saturating_sub(self.passed)
    }

    /// Ticks of the waiting chunks.
    pub fn waiting(&self) -> u32 {
        self.waiting
    }

    /// Stores a checked chunk until it is played. Returns `false` if there is no room.
    pub fn keep(&mut self, store: &mut Store, head: &Chunk, payload: &[u8]) -> bool {
        let is_kept = store.push(payload);
        if is_kept {
            self.waiting = self.waiting.wrapping_add(head.ticks);
            self.resting += u32::from(head.rests);
        }
        is_kept
    }

    pub fn forget(&mut self, store: &mut Store) {
        store.clear();
        (self.waiting, self.resting) = (0, 0);
    }

    /// Returns `true` if a chunk and its whole tail are waiting: enough path to stop from full rate, or one
    /// that ends stopped.
    pub fn is_covered(&self, store: &Store) -> bool {
        let mut head = [0; HEAD];
        let Some(head) = store.look(&mut head).and_then(|()| Chunk::take(&mut Reader::new(&head))) else {
            return false;
        };
        self.resting > 0 || self.waiting.wrapping_sub(head.ticks) >= stopping(head.fall)
    }

    /// Returns `true` if no newer path is accepted: it plays its tail, or stops by request.
    pub fn is_ending(&self) -> bool {
        self.in_tail || self.is_stopping
    }

    /// Sets the requested rate, at most full.
    pub fn want(&mut self, rate: u32) {
        self.wanted = rate.min(FULL_RATE);
    }

    /// Stops on the path.
    pub fn stop(&mut self) {
        self.is_stopping = true;
    }

    pub fn ready(&mut self) {
        (self.is_stopping, self.in_tail) = (false, false);
    }

    /// Starts with the first chunk of `store`, with pulses of this many ticks. Returns `false` if there is
    /// none.
    pub fn begin(&mut self, store: &mut Store, pulse: u32) -> bool {
        (self.machine, self.owed, self.length, self.part) = (0, 0, 0, 0);
        (self.pulse, self.rate) = (pulse, self.wanted);
        self.axes.iter_mut().for_each(|axis| axis.word = 0);
        self.in_tail = !self.is_covered(store);
        self.next(store)
    }

    /// Loads the next chunk, every axis before its first run.
    fn next(&mut self, store: &mut Store) -> bool {
        let Some(length) = store.pop(&mut self.payload) else { return false };
        let mut from = Reader::new(self.payload.get(..length).unwrap_or_default());
        let Some(head) = Chunk::take(&mut from) else { return false };
        (self.head, self.ticks, self.passed) = (head, head.ticks, 0);
        self.waiting = self.waiting.wrapping_sub(head.ticks);
        self.resting = self.resting.saturating_sub(u32::from(head.rests));
        for (index, axis) in self.axes.iter_mut().enumerate() {
            let count = head.runs[index];
            axis.later = ((length - from.rest().len()) as u16, count);
            axis.run = None;
            axis.ahead = head.ahead >> index & 1 == 1;
            axis.cursor.left = 0;
            for _ in 0..count {
                Run::skip(&mut from);
            }
            axis.next_run(&self.payload, 0);
        }
        true
    }

    /// Continues at the end of a chunk. A path that ends stopped continues only if the whole next tail has
    /// arrived. Any other path without its next tail stops within its own tail, from here on.
    fn turn(&mut self, store: &mut Store) -> Option<End> {
        let is_covered = self.is_covered(store);
        if self.head.rests == 1 && (self.is_ending() || !is_covered) {
            return Some(self.end(End::Rested));
        }
        self.in_tail |= !is_covered;
        if self.next(store) { None } else { Some(self.end(End::Starved)) }
    }

    /// How a path ends when its time stops or its chunks run out.
    fn end(&self, end: End) -> End {
        match end {
            _ if self.is_stopping => End::Stopped,
            _ if self.in_tail => End::Starved,
            end => end,
        }
    }

    fn steer(&mut self) {
        let wanted = if self.is_stopping { 0 } else { self.wanted };
        let (wanted, slope) = match (self.in_tail, self.head.fall) {
            (true, fall) => (0, fall),
            _ if wanted < self.rate => (wanted, self.head.fall),
            _ => (wanted, self.head.rise),
        };
        if wanted == self.rate {
            self.owed = 0;
            return;
        }
        // From a stop, count a whole slice at once.
        self.owed += u32::from(slope) * if self.rate == 0 { SLICE } else { self.length };
        let change = self.owed / SLICE;
        self.owed %= SLICE;
        self.rate = if wanted < self.rate {
            self.rate.saturating_sub(change).max(wanted)
        } else {
            self.rate.saturating_add(change).min(wanted)
        };
        if wanted < LEAST_RATE && self.rate < LEAST_RATE {
            self.rate = 0;
        }
    }

    /// Makes the words of the next slice, at most [`Self::most_words`] per axis. Returns how the path
    /// ended, if it did: then all words are made.
    #[inline(always)]
    pub fn slice(&mut self, store: &mut Store, words: &mut impl Words) -> Option<End> {
        let end = self.go_on(store, words);
        if end.is_some() && self.is_phases {
            self.relax(words);
        }
        end
    }

    #[inline(always)]
    fn go_on(&mut self, store: &mut Store, words: &mut impl Words) -> Option<End> {
        if self.passed == self.ticks {
            let end = self.turn(store);
            if end.is_some() {
                return end;
            }
        }
        self.steer();
        if self.rate == 0 {
            if self.is_ending() {
                return Some(self.end(End::Starved));
            }
            self.rest(words);
            return None;
        }
        let span = self.span();
        if self.is_phases {
            self.commute(&span, words);
        } else {
            for (index, axis) in self.axes.iter_mut().enumerate() {
                axis.play(index, &span, self.pulse, &self.payload, words);
            }
        }
        self.passed = span.stretch.until;
        self.part = span.part;
        self.machine = span.machine_until;
        self.length = span.length;
        None
    }

    /// A slice without steps.
    fn rest(&mut self, words: &mut impl Words) {
        self.length = SLICE;
        self.machine = self.machine.wrapping_add(SLICE);
        if self.is_phases {
            self.hold(words);
            return;
        }
        for (index, axis) in self.axes.iter_mut().enumerate() {
            axis.wait(index, self.machine, words);
        }
    }

    fn span(&self) -> Span {
        let rate = self.rate;
        let inverse = if rate == FULL_RATE { FULL_RATE } else { u32::MAX / rate };
        let parts = self.part + SLICE * rate;
        let room = self.ticks - self.passed;
        let (length, until, part) = if parts >> 16 < room {
            (SLICE, self.passed + (parts >> 16), parts & 0xFFFF)
        } else {
            let wanted = (room << 16) - self.part;
            let length = wanted.div_ceil(rate);
            (length, self.ticks, length * rate - wanted)
        };
        let behind = ((u64::from(self.part) * u64::from(inverse)) >> 16) as u32;
        let stretch = Stretch {
            from: self.passed,
            until,
            machine: self.machine,
            inverse,
            offset: 0xFFFF_u32.wrapping_sub(behind),
            least: self.pulse + 1,
            scale: CYCLES_PER_TICK << 2,
            base: pulse_word(0, false).wrapping_sub((self.pulse * CYCLES_PER_TICK) << 2),
        };
        Span { stretch, part, machine_until: self.machine.wrapping_add(length), length }
    }
}

impl Default for Player {
    fn default() -> Self {
        Self::new()
    }
}

/// Most words that a slice makes for one axis with pulses of this many ticks.
pub const fn most_words(pulse: u32) -> u32 {
    SLICE / (pulse + 1) + 2
}

struct Span {
    stretch: Stretch,
    /// Fraction of the chunk's next tick that has passed.
    part: u32,
    machine_until: u32,
    length: u32,
}

impl Axis {
    fn next_run(&mut self, payload: &[u8; PAYLOAD], before: u32) {
        let (at, count) = self.later;
        let Some(count) = count.checked_sub(1) else {
            self.cursor.forward = self.ahead;
            return;
        };
        let mut from = Reader::new(payload.get(usize::from(at)..).unwrap_or_default());
        let Some(run) = Run::take(self.run.as_ref(), &mut from) else { return };
        (self.cursor, self.run) = (Cursor::at(&run, before), Some(run));
        self.later = ((PAYLOAD - from.rest().len()) as u16, count);
    }

    #[inline(always)]
    fn wait(&mut self, index: usize, until: u32, words: &mut impl Words) {
        let ticks = until.wrapping_sub(self.word);
        if ticks as i32 > 0 {
            words.put(index, wait_word(ticks, self.cursor.forward));
            self.word = until;
        }
    }

    #[inline(always)]
    fn play(
        &mut self,
        index: usize,
        span: &Span,
        pulse: u32,
        payload: &[u8; PAYLOAD],
        words: &mut impl Words,
    ) {
        let stretch = &span.stretch;
        while self.cursor.left > 0 && self.cursor.tick <= stretch.until {
            let forward = self.cursor.forward;
            let wait = stretch.machine_tick(self.cursor.tick).wrapping_sub(self.word);
            let wait = if wait as i32 > 0 { wait } else { 1 };
            words.put(index, pulse_word(wait, forward));
            let mut at = self.word.wrapping_add(wait);
            let (mut before, mut steps) = (self.cursor.tick, 1);
            self.cursor.advance();
            let own = Stretch { base: stretch.base | u32::from(forward), ..*stretch };
            while self.cursor.is_quick() && self.cursor.tick <= stretch.until {
                let is_full = stretch.inverse == FULL_RATE;
                let burst = if is_full { Cursor::burst::<false> } else { Cursor::burst::<true> };
                let (count, last, tick) = burst(&mut self.cursor, at, &own, words.places(index));
                words.filled(index, count);
                (at, before, steps) = (last, tick, steps + count as i32);
            }
            self.word = at.wrapping_add(pulse);
            self.index = self.index.wrapping_add(if forward { steps } else { -steps });
            if self.cursor.left == 0 {
                self.next_run(payload, before);
            }
        }
        self.wait(index, span.machine_until, words);
    }
}
