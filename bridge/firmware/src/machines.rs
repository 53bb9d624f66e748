//! The state machines: four that give pulses, one that watches the inputs.
//!
//! ```text
//! word          direction ─ wait ─ pulse or none        7 cycles from the start of a word to its pulse, beside the wait
//! RUN (GP19)    asked before every pulse: low, and the machine goes into a dead end
//! watcher       emergency stop and the inputs that stop, twice within a microsecond: RUN low, interrupt
//! interrupt     outputs off; when the pulses that had begun are over, machines off and step pins held
//! ```
//!
//! Comes in: settings. Goes out: pulses; how far they came. Does not know chunks.

use crate::board::{self, read, route, write, CLEAR, PIO0, PIO1, SET};
use crate::rings;
use annulus_link::message::Configure;
use annulus_link::player::without;
use annulus_link::AXES;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering::*};
use rp2040_hal::pac::{self, interrupt};
use rp2040_hal::pio::{PIOBuilder, PIOExt, PinDir, ShiftDirection};

const MACHINES: u32 = (1 << AXES) - 1;
/// Offsets of the program: where a word is waited for, the last place before its pulse, where the pulse's length is.
const PULL: u32 = 0;
const GO: u32 = 8;
/// Longest time for a pulse to end, in looks at the pins.
const LOOKS: u32 = 60;

/// Where the program of the axes begins.
static ORIGIN: AtomicU32 = AtomicU32::new(0);
/// Whether the pulses were stopped by force.
static IS_STOPPED: AtomicBool = AtomicBool::new(false);
/// What the watcher saw; nothing amiss where it saw nothing.
static SEEN: AtomicU32 = AtomicU32::new(1);
/// What each step pin is held at.
static HELD: [AtomicU32; AXES] = [const { AtomicU32::new(board::LOW) }; AXES];

/// Outputs off, machines off when begun pulses are over, step pins held.
#[link_section = ".data.ram"]
#[inline(never)]
pub fn stop_by_force() {
    board::switch(0, 1 << board::OUTPUT | 1 << board::SECOND_OUTPUT);
    write(PIO1 + CLEAR, 1);
    // RUN by hand: the watcher may not be what found the reason.
    route(board::RUN, board::BY_PIO1, board::LOW, board::AS_IS);
    let steps = MACHINES << board::STEP;
    let mut looks = LOOKS;
    while read(PIO0 + 0x3C) & steps != 0 && looks > 0 {
        looks -= 1;
    }
    write(PIO0 + CLEAR, MACHINES);
    for (pin, held) in (board::STEP..).zip(&HELD) {
        route(pin, board::BY_PIO0, held.load(Relaxed), board::AS_IS);
    }
    IS_STOPPED.store(true, Release);
}

#[interrupt]
#[link_section = ".data.ram"]
fn PIO1_IRQ_0() {
    stop_by_force();
    SEEN.store(read(PIO1 + 0x20), Release);
    write(PIO1 + 0x30, 1);
}

/// The same for inputs that are on, one bit each, which the watcher does not see.
#[inline(always)]
pub fn stop_for(inputs: u8) {
    stop_by_force();
    SEEN.store(1 | u32::from(inputs) << 1, Release);
}

/// What the watcher saw when it stopped the pulses: bit 0 the emergency stop, low; above it the inputs, high. Nothing
/// where the pulses were stopped for another reason.
pub fn seen() -> (bool, u8) {
    let seen = SEEN.load(Acquire);
    (seen & 1 == 0, (seen >> 1) as u8)
}

/// Whether the pulses were stopped by force and not made ready again.
pub fn is_stopped() -> bool {
    IS_STOPPED.load(Acquire)
}

/// Loads the programs. No pulse comes before [`arm`].
pub fn prepare(pio0: pac::PIO0, pio1: pac::PIO1, resets: &mut pac::RESETS) {
    let pulses = pio::pio_file!("src/pulses.pio");
    let (mut block, m0, m1, m2, m3) = pio0.split(resets);
    let installed = block.install(&pulses.program).expect("room for the program");
    ORIGIN.store(u32::from(installed.offset()), Relaxed);
    macro_rules! axis {
        ($machine:expr, $axis:literal) => {{
            // SAFETY: nothing is ever uninstalled.
            let program = unsafe { installed.share() };
            let (mut machine, _, _) = PIOBuilder::from_installed_program(program)
                .out_pins(board::DIRECTION + $axis, 1)
                .side_set_pin_base(board::STEP + $axis)
                .jmp_pin(board::RUN)
                .out_shift_direction(ShiftDirection::Right)
                .autopull(false)
                .buffers(rp2040_hal::pio::Buffers::OnlyTx)
                .clock_divisor_fixed_point(1, 0)
                .build($machine);
            machine.set_pindirs([
                (board::STEP + $axis, PinDir::Output),
                (board::DIRECTION + $axis, PinDir::Output),
            ]);
        }};
    }
    axis!(m0, 0);
    axis!(m1, 1);
    axis!(m2, 2);
    axis!(m3, 3);
    watch(pio1, resets);
}

/// Loads the program that watches the inputs. Every input that is well reads 0 there, the emergency stop 1.
fn watch(pio1: pac::PIO1, resets: &mut pac::RESETS) {
    let watcher = pio::pio_file!("src/watcher.pio");
    let (mut block, machine, _, _, _) = pio1.split(resets);
    let installed = block.install(&watcher.program).expect("room for the program");
    let (mut machine, _, _) = PIOBuilder::from_installed_program(installed)
        .in_pin_base(board::STOP)
        .set_pins(board::RUN, 1)
        .in_shift_direction(ShiftDirection::Left)
        .clock_divisor_fixed_point(1, 0)
        .build(machine);
    machine.set_pindirs([(board::RUN, PinDir::Output)]);
    WATCHER.store(read(PIO1 + 0xD4), Relaxed);
    write(PIO1 + 0x12C, 1 << 8);
}

/// Where the watcher's program begins.
static WATCHER: AtomicU32 = AtomicU32::new(0);

/// Takes up settings at rest: length of pulses, which way pins and inputs are, which inputs stop the pulses by the watcher.
pub fn settle(settings: &Configure, limits: u8) {
    let length = u32::from(settings.pulse) - 2;
    const SET_Y: u32 = 0xE040;
    const SIDE: u32 = 1 << 12;
    let place = PIO0 + 0x48 + 4 * (ORIGIN.load(Relaxed) + GO) as usize;
    write(place, SET_Y | SIDE | 11 << 8 | length);
    for axis in 0..AXES as u8 {
        let is_low = settings.low_steps >> axis & 1 == 1;
        HELD[usize::from(axis)].store(if is_low { board::HIGH } else { board::LOW }, Relaxed);
        let forward = settings.low_forward >> axis & 1;
        route(board::DIRECTION + axis, board::BY_PIO0, u32::from(forward), board::AS_IS);
        board::pad(board::STEP + axis, is_low);
        board::pad(board::DIRECTION + axis, false);
        route(board::STEP + axis, board::BY_PIO0, HELD[usize::from(axis)].load(Relaxed), board::AS_IS);
    }
    for input in 0..board::INPUTS {
        let is_low = settings.low_inputs >> input & 1;
        let seen = match (limits >> input & 1, is_low) {
            (0, _) => board::LOW,
            (_, 1) => board::INVERTED,
            _ => board::AS_IS,
        };
        board::pad(board::INPUT + input, is_low == 1);
        route(board::INPUT + input, board::BY_PROGRAM, board::AS_IS, seen);
    }
    arm(settings);
}

/// Makes the machines ready, at rest: words gone, step pins theirs again, the watcher looking anew.
pub fn arm(settings: &Configure) {
    const RESTART: u32 = MACHINES << 4;
    const ENABLE_WATCHER: u32 = 1;
    write(PIO0 + CLEAR, MACHINES);
    rings::clear();
    for axis in 0..AXES {
        let own = PIO0 + 0xC8 + 0x18 * axis;
        // Joining and parting the queues empties them.
        const JOIN: u32 = 1 << 30;
        write(own + 0x8 + CLEAR, JOIN);
        write(own + 0x8 + SET, JOIN);
        let jump_to_begin = ORIGIN.load(Relaxed) + PULL;
        write(own + 0x10, jump_to_begin);
    }
    write(PIO0 + SET, RESTART);
    write(PIO1 + CLEAR, ENABLE_WATCHER);
    write(PIO1 + 0x30, 1);
    SEEN.store(1, Release);
    while read(PIO1 + 0x4) & 1 << 8 == 0 {
        read(PIO1 + 0x20);
    }
    write(PIO1 + 0xD8, WATCHER.load(Relaxed));
    IS_STOPPED.store(false, Release);
    route(board::RUN, board::BY_PIO1, board::AS_IS, board::AS_IS);
    for axis in 0..AXES {
        let is_low = settings.low_steps >> axis & 1 == 1;
        let output = if is_low { board::INVERTED } else { board::AS_IS };
        route(board::STEP + axis as u8, board::BY_PIO0, output, board::AS_IS);
    }
    write(PIO1 + SET, ENABLE_WATCHER);
}

/// Starts all machines in the same cycle.
pub fn start() {
    rings::ran_dry();
    write(PIO0 + SET, MACHINES | MACHINES << 8);
}

/// Whether all machines wait for a word.
pub fn are_idle() -> bool {
    let begin = ORIGIN.load(Relaxed) + PULL;
    rings::are_dry() && (0..AXES).all(|axis| place_of(axis) == begin)
}

/// Stops all machines, which wait for a word.
pub fn rest() {
    write(PIO0 + CLEAR, MACHINES);
}

fn place_of(axis: usize) -> u32 {
    read(PIO0 + 0xD4 + 0x18 * axis)
}

/// The index of every axis when the machines were stopped, from the index behind the last word.
pub fn index_of(behind: [i32; AXES]) -> [i32; AXES] {
    let mut index = behind;
    for (axis, index) in index.iter_mut().enumerate() {
        let place = place_of(axis).wrapping_sub(ORIGIN.load(Relaxed));
        let is_begun = place > PULL && place <= GO;
        rings::unplayed(axis, is_begun, |word| *index = without(word, *index));
    }
    index
}
