//! Words in memory, one ring per axis, and the DMA channels that carry them to the state machines.
//!
//! ```text
//! main loop ─ put ─▶ ring ─ channel, at the pace of the machine ─▶ FIFO of 8 ─▶ state machine
//!                    head ▲            ▲ tail: the channel has taken everything before it
//! ```
//!
//! A channel gets exactly the words that exist. If the main loop hangs, the machines run dry and the pins
//! stay low; an old word is never played again.

use crate::board::{self, read, write, DMA, PIO0};
use annulus_link::player::Words;
use annulus_link::AXES;
use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicU32, Ordering::*};
use rp2040_hal::pac::interrupt;

/// Words of a ring: more than 2 ms of the fastest pulses.
pub const WORDS: u32 = 2048;
const BYTES_POWER: u32 = 13;

/// Bits of the axes' channels in [`DMA`]'s registers.
const CHANNELS: u32 = (1 << AXES) - 1;

#[repr(C, align(8192))]
struct Ring(UnsafeCell<[u32; WORDS as usize]>);

// SAFETY: the main loop writes words beyond the tail, channels read words before the head.
unsafe impl Sync for Ring {}

static RINGS: [Ring; AXES] = [const { Ring(UnsafeCell::new([0; WORDS as usize])) }; AXES];
/// Words put; words that channels have taken; words that channels hold now.
static HEAD: [AtomicU32; AXES] = [const { AtomicU32::new(0) }; AXES];
static TAIL: [AtomicU32; AXES] = [const { AtomicU32::new(0) }; AXES];
static GIVEN: [AtomicU32; AXES] = [const { AtomicU32::new(0) }; AXES];

const fn channel(axis: usize) -> usize {
    DMA + 0x40 * axis
}

/// Configures the channels.
pub fn prepare() {
    const ENABLE: u32 = 1;
    const WORD: u32 = 2 << 2;
    const READ_ON: u32 = 1 << 4;
    for (axis, ring) in RINGS.iter().enumerate() {
        let control = (axis as u32) << 15 | (axis as u32) << 11 | BYTES_POWER << 6 | READ_ON | WORD | ENABLE;
        write(channel(axis), ring.0.get() as u32);
        write(channel(axis) + 0x4, (PIO0 + 0x10 + 4 * axis) as u32);
        write(channel(axis) + 0x10, control);
    }
    write(DMA + 0x404, CHANNELS);
}

/// Drops all words. The machines must be stopped.
pub fn clear() {
    write(DMA + 0x404, 0);
    write(DMA + 0x444, CHANNELS);
    while read(DMA + 0x444) & CHANNELS != 0 {}
    write(DMA + 0x40C, CHANNELS);
    for axis in 0..AXES {
        HEAD[axis].store(0, Relaxed);
        TAIL[axis].store(0, Relaxed);
        GIVEN[axis].store(0, Relaxed);
    }
    prepare();
}

#[inline(always)]
fn give(axis: usize) {
    let there = HEAD[axis].load(Acquire).wrapping_sub(TAIL[axis].load(Relaxed));
    GIVEN[axis].store(there, Relaxed);
    if there > 0 {
        write(channel(axis) + 0x1C, there);
    }
}

#[interrupt]
#[link_section = ".data.ram"]
fn DMA_IRQ_0() {
    let done = read(DMA + 0x40C);
    write(DMA + 0x40C, done);
    for axis in 0..AXES {
        if done >> axis & 1 == 1 {
            let tail = TAIL[axis].load(Relaxed).wrapping_add(GIVEN[axis].load(Relaxed));
            TAIL[axis].store(tail, Release);
            give(axis);
        }
    }
}

/// Writes words into the rings.
pub struct Rings {
    heads: [u32; AXES],
}

impl Rings {
    /// Starts after the existing words.
    #[inline(always)]
    pub fn open() -> Self {
        Self { heads: core::array::from_fn(|axis| HEAD[axis].load(Relaxed)) }
    }

    /// Returns `true` if every axis has room for this many words.
    #[inline(always)]
    pub fn have_room(&self, words: u32) -> bool {
        (0..AXES).all(|axis| self.heads[axis].wrapping_sub(TAIL[axis].load(Acquire)) + words <= WORDS)
    }

    #[inline(always)]
    pub fn close(self) {
        for axis in 0..AXES {
            HEAD[axis].store(self.heads[axis], Release);
            // The interrupt must not give the same words at the same time.
            cortex_m::interrupt::free(|_| {
                if GIVEN[axis].load(Relaxed) == 0 {
                    give(axis);
                }
            });
        }
    }
}

impl Words for Rings {
    #[inline(always)]
    fn put(&mut self, axis: usize, word: u32) {
        let head = self.heads[axis];
        let place = RINGS[axis].0.get().cast::<u32>().wrapping_add((head % WORDS) as usize);
        // SAFETY: within the ring, and beyond the tail, as `have_room` has checked.
        unsafe { place.write_volatile(word) };
        self.heads[axis] = head.wrapping_add(1);
    }

    #[inline(always)]
    fn places(&mut self, axis: usize) -> &mut [u32] {
        let at = self.heads[axis] % WORDS;
        let place = RINGS[axis].0.get().cast::<u32>().wrapping_add(at as usize);
        // SAFETY: from the head to the end of the ring; the filled part is beyond the tail, as `have_room`
        // has checked.
        unsafe { core::slice::from_raw_parts_mut(place, (WORDS - at) as usize) }
    }

    #[inline(always)]
    fn filled(&mut self, axis: usize, count: u32) {
        self.heads[axis] = self.heads[axis].wrapping_add(count);
    }
}

pub fn are_dry() -> bool {
    let taken = |axis: usize| HEAD[axis].load(Relaxed) == TAIL[axis].load(Acquire);
    const EMPTY: u32 = CHANNELS << 24;
    (0..AXES).all(taken) && read(PIO0 + 0x4) & EMPTY == EMPTY
}

/// Calls `unplayed` with every word of an axis that its stopped machine has not played, the latest first.
/// `begun` if the machine took a word and did not give its pulse.
pub fn unplayed(axis: usize, begun: bool, mut unplayed: impl FnMut(u32)) {
    let left = read(channel(axis) + 0x8);
    let given = GIVEN[axis].load(Relaxed);
    let taken = TAIL[axis].load(Relaxed).wrapping_add(given.wrapping_sub(if given > 0 { left } else { 0 }));
    let queued = read(PIO0 + 0xC) >> (8 * axis) & 0xF;
    let played = taken.wrapping_sub(queued).wrapping_sub(u32::from(begun));
    let mut word = HEAD[axis].load(Relaxed);
    while word != played {
        word = word.wrapping_sub(1);
        let place = RINGS[axis].0.get().cast::<u32>().wrapping_add((word % WORDS) as usize);
        // SAFETY: within the ring, and nothing writes it now.
        unplayed(unsafe { place.read_volatile() });
    }
}

/// Returns `true` if any machine found nothing to play since the last call.
pub fn ran_dry() -> bool {
    const STALLED: u32 = CHANNELS << 24;
    let stalled = board::read(PIO0 + 0x8) & STALLED;
    board::write(PIO0 + 0x8, stalled);
    stalled != 0
}
