//! The PIO state machines: four give pulses, one watches the inputs.
//!
//! ```text
//! word          direction ─ wait ─ pulse or none        from its start to its pulse: 7 cycles plus the wait
//!               wait ─ pattern of a motor's windings    if three motors are driven by their phases
//! RUN           checked before every pulse and every pattern: when low, the machine enters a dead end
//! watcher       emergency stop and the stopping inputs, twice within a microsecond: RUN low, interrupt
//! interrupt     outputs off; after started pulses end, machines off and step pins held; no winding forced
//! ```

use crate::board::{self, read, route, write, Map, CLEAR, PIO0, PIO1, SET};
use crate::rings;
use annulus_link::message::Configure;
use annulus_link::phases::MOTORS;
use annulus_link::player::without;
use annulus_link::AXES;
use core::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering::*};
use rp2040_hal::pac::{self, interrupt};
use rp2040_hal::pio::{PIOBuilder, PIOExt, PinDir, ShiftDirection};

const MACHINES: u32 = (1 << AXES) - 1;
/// Offsets in the programs of pulses and phases: the wait for a word, and the last instruction before its
/// pulse or pattern. In the pulse program that instruction holds the pulse length.
const PULL: u32 = 0;
const GO: [u32; 2] = [8, 7];
/// Longest wait for a pulse to end, in reads of the pins.
const LOOKS: u32 = 60;
/// Instructions injected into a machine: its set pins low; all pins of a motor low.
const SET_PINS_LOW: u32 = 0xE000;
const ALL_PINS_LOW: u32 = 0xA003;

const UNWIRED: usize = usize::MAX;
/// Index in [`board::MAPS`] of the current wiring.
static WIRED: AtomicUsize = AtomicUsize::new(UNWIRED);
/// Start and length of the programs of pulses and phases.
static ORIGIN: [AtomicU32; 2] = [const { AtomicU32::new(0) }; 2];
static LENGTH: [AtomicU32; 2] = [const { AtomicU32::new(0) }; 2];
/// The pulses were stopped by force.
static IS_STOPPED: AtomicBool = AtomicBool::new(false);
/// Inputs seen by the watcher when it stopped; 1 (emergency stop released, no input) if it did not.
static SEEN: AtomicU32 = AtomicU32::new(1);
/// Level at which each step pin is held.
static HELD: [AtomicU32; AXES] = [const { AtomicU32::new(board::LOW) }; AXES];

const fn own(axis: usize) -> usize {
    PIO0 + 0xC8 + 0x18 * axis
}
const WRAPS: usize = 0x4;
const SHIFTS: usize = 0x8;
const EXECUTE: usize = 0x10;
const PINS: usize = 0x14;

/// Returns `true` after the host selected a wiring.
#[inline(always)]
pub fn is_wired() -> bool {
    WIRED.load(Relaxed) != UNWIRED
}

/// Index of the current map; before the host selects one, that of steps.
#[inline(always)]
fn place() -> usize {
    usize::from(WIRED.load(Relaxed) == 1)
}

#[inline(always)]
pub fn map() -> &'static Map {
    &board::MAPS[place()]
}

fn origin() -> u32 {
    ORIGIN[place()].load(Relaxed)
}

/// Outputs off. When started pulses have ended, machines off, and step pins held or windings held without
/// forcing.
#[link_section = ".data.ram"]
#[inline(never)]
pub fn stop_by_force() {
    let map = map();
    board::switch(0, map.outputs());
    write(PIO1 + CLEAR, 1);
    // Force RUN low: the watcher may not be the cause.
    if is_wired() {
        route(map.run, board::BY_PIO1, board::LOW, board::AS_IS);
    }
    if place() == 1 {
        write(PIO0 + CLEAR, MACHINES);
        (0..MOTORS).for_each(|axis| write(own(axis) + EXECUTE, SET_PINS_LOW));
    } else {
        hold_steps();
    }
    IS_STOPPED.store(true, Release);
}

/// Waits until started pulses end, then switches the machines off.
#[inline(always)]
fn end_pulses() {
    let steps = MACHINES << board::STEP;
    let mut looks = LOOKS;
    while read(PIO0 + 0x3C) & steps != 0 && looks > 0 {
        looks -= 1;
    }
    write(PIO0 + CLEAR, MACHINES);
}

/// Ends pulses, then holds the step pins at their resting level.
#[inline(always)]
fn hold_steps() {
    end_pulses();
    if is_wired() {
        for (pin, held) in (board::STEP..).zip(&HELD) {
            route(pin, board::BY_PIO0, held.load(Relaxed), board::AS_IS);
        }
    }
}

#[interrupt]
#[link_section = ".data.ram"]
fn PIO1_IRQ_0() {
    stop_by_force();
    SEEN.store(read(PIO1 + 0x20), Release);
    write(PIO1 + 0x30, 1);
}

/// Stops by force for filtered inputs that are on, one bit each: the watcher does not see those.
#[inline(always)]
pub fn stop_for(inputs: u8) {
    stop_by_force();
    SEEN.store(1 | u32::from(inputs) << 1, Release);
}

/// Why the watcher stopped the pulses: `true` for the emergency stop, and the inputs that were on. `false`
/// and 0 for any other cause.
pub fn seen() -> (bool, u8) {
    let seen = SEEN.load(Acquire);
    (seen & 1 == 0, (seen >> 1) as u8)
}

/// Returns `true` from a forced stop until [`arm`].
pub fn is_stopped() -> bool {
    IS_STOPPED.load(Acquire)
}

/// Loads the programs. No pin is driven before [`settle`], and no pulse is given before [`arm`].
pub fn prepare(pio0: pac::PIO0, pio1: pac::PIO1, resets: &mut pac::RESETS) {
    let pulses = pio::pio_file!("src/pulses.pio");
    let phases = pio::pio_file!("src/phases.pio");
    let (mut block, m0, m1, m2, m3) = pio0.split(resets);
    let installed = block.install(&pulses.program).expect("room for the program");
    let others = block.install(&phases.program).expect("room for the other program");
    let lengths = [pulses.program.code.len(), phases.program.code.len()];
    for (place, offset) in [installed.offset(), others.offset()].into_iter().enumerate() {
        ORIGIN[place].store(u32::from(offset), Relaxed);
        LENGTH[place].store(lengths[place] as u32, Relaxed);
    }
    macro_rules! axis {
        ($machine:expr, $axis:literal) => {{
            // SAFETY: programs are never uninstalled.
            let program = unsafe { installed.share() };
            let (mut machine, _, _) = PIOBuilder::from_installed_program(program)
                .out_shift_direction(ShiftDirection::Right)
                .autopull(false)
                .buffers(rp2040_hal::pio::Buffers::OnlyTx)
                .clock_divisor_fixed_point(1, 0)
                .build($machine);
            // All pins that any program drives; the wiring decides later which of them reach a pad.
            machine.set_pindirs((0..18).map(|pin| (pin, PinDir::Output)));
        }};
    }
    axis!(m0, 0);
    axis!(m1, 1);
    axis!(m2, 2);
    axis!(m3, 3);
    watch(pio1, resets);
}

/// Loads the watcher. For it, a quiet input reads 0, and a released emergency stop reads 1.
fn watch(pio1: pac::PIO1, resets: &mut pac::RESETS) {
    let watcher = pio::pio_file!("src/watcher.pio");
    let (mut block, machine, _, _, _) = pio1.split(resets);
    let installed = block.install(&watcher.program).expect("room for the program");
    let (mut machine, _, _) = PIOBuilder::from_installed_program(installed)
        .in_shift_direction(ShiftDirection::Left)
        .clock_divisor_fixed_point(1, 0)
        .build(machine);
    machine.set_pindirs(board::MAPS.iter().map(|map| (map.run, PinDir::Output)));
    WATCHER.store(read(PIO1 + 0xD4), Relaxed);
    write(PIO1 + 0x12C, 1 << 8);
}

static WATCHER: AtomicU32 = AtomicU32::new(0);

/// A motor's pin assignment: all pins for patterns, the forcing pins for `set`.
fn pins_of_motor(axis: usize) -> u32 {
    let first = u32::from(board::MOTOR) * axis as u32;
    first | (first + u32::from(board::FORCING)) << 5 | u32::from(board::MOTOR) << 20 | 2 << 26
}

/// Rewires pins and machines while stopped: releases everything, then drives the pins of the map low.
fn wire(place: usize) {
    write(PIO0 + CLEAR, MACHINES);
    write(PIO1 + CLEAR, 1);
    let map = &board::MAPS[place];
    board::ALL.into_iter().for_each(|pin| board::pad(pin, false));
    // Unused pins too: the watcher reads across them, and one reports USB power.
    (0..30).for_each(|pin| route(pin, board::BY_NOBODY, board::AS_IS, board::LOW));
    // Clear the last steps or phases, so that the other map does not show them.
    for axis in 0..MOTORS {
        write(own(axis) + PINS, pins_of_motor(axis));
        write(own(axis) + EXECUTE, ALL_PINS_LOW);
    }
    let (from, length) = (ORIGIN[place].load(Relaxed), LENGTH[place].load(Relaxed));
    for axis in 0..AXES {
        let (step, direction) = (board::STEP as usize + axis, board::DIRECTION as usize + axis);
        let pins = match (place, axis < MOTORS) {
            (0, _) => (direction | step << 10 | 1 << 20 | 1 << 29) as u32,
            (_, true) => pins_of_motor(axis),
            // An injected jump's side-set would drive the pins of the old assignment.
            (_, false) => 0,
        };
        write(own(axis) + PINS, pins);
        write(own(axis) + WRAPS, u32::from(map.run) << 24 | (from + length - 1) << 12 | from << 7);
    }
    // The watcher: its first input pin, and the pin that it sets.
    write(PIO1 + 0xDC, u32::from(map.stop) << 15 | u32::from(map.run) << 5 | 1 << 26);
    let driven = map.outputs() | 1 << map.alive;
    board::switch(0, driven);
    board::drive(driven);
    for pin in board::ALL.into_iter().filter(|pin| driven >> pin & 1 == 1) {
        route(pin, board::BY_PROGRAM, board::AS_IS, board::LOW);
    }
    route(map.stop, board::BY_PROGRAM, board::AS_IS, board::AS_IS);
    if place == 1 {
        (0..board::MOTOR * MOTORS as u8).for_each(|pin| route(pin, board::BY_PIO0, board::AS_IS, board::LOW));
    }
    // Keep RUN low until `arm`.
    route(map.run, board::BY_PIO1, board::LOW, board::AS_IS);
    WIRED.store(place, Relaxed);
}

/// Applies settings while stopped: wiring, pulse length, polarity of pins and inputs, and the inputs that
/// stop pulses through the watcher. They take effect with [`arm`].
pub fn settle(settings: &Configure, limits: u8) {
    let place = usize::from(settings.phases != 0);
    if WIRED.load(Relaxed) != place {
        wire(place);
    }
    if place == 0 {
        settle_steps(settings);
    }
    let map = map();
    for input in 0..map.inputs {
        let is_low = settings.low_inputs >> input & 1;
        let seen = match (limits >> input & 1, is_low) {
            (0, _) => board::LOW,
            (_, 1) => board::INVERTED,
            _ => board::AS_IS,
        };
        board::pad(map.input() + input, is_low == 1);
        route(map.input() + input, board::BY_PROGRAM, board::AS_IS, seen);
    }
}

fn settle_steps(settings: &Configure) {
    let length = u32::from(settings.pulse) - 2;
    const SET_Y: u32 = 0xE040;
    const SIDE: u32 = 1 << 12;
    let place = PIO0 + 0x48 + 4 * (origin() + GO[0]) as usize;
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
}

/// Arms the machines while stopped: drops old words, gives the step pins back, restarts the watcher.
pub fn arm(settings: &Configure) {
    const RESTART: u32 = MACHINES << 4;
    const ENABLE_WATCHER: u32 = 1;
    write(PIO0 + CLEAR, MACHINES);
    rings::clear();
    for axis in 0..AXES {
        // Changing the FIFO join empties the FIFOs.
        const JOIN: u32 = 1 << 30;
        write(own(axis) + SHIFTS + CLEAR, JOIN);
        write(own(axis) + SHIFTS + SET, JOIN);
        let jump_to_begin = origin() + PULL;
        write(own(axis) + EXECUTE, jump_to_begin);
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
    route(map().run, board::BY_PIO1, board::AS_IS, board::AS_IS);
    for axis in 0..if place() == 0 { AXES } else { 0 } {
        let is_low = settings.low_steps >> axis & 1 == 1;
        let output = if is_low { board::INVERTED } else { board::AS_IS };
        route(board::STEP + axis as u8, board::BY_PIO0, output, board::AS_IS);
    }
    write(PIO1 + SET, ENABLE_WATCHER);
}

/// Starts all machines in the same cycle, unless a stop came since [`arm`].
pub fn start() {
    rings::ran_dry();
    let machines = if place() == 0 { MACHINES } else { (1 << MOTORS) - 1 };
    cortex_m::interrupt::free(|_| {
        if !is_stopped() {
            write(PIO0 + SET, machines | machines << 8);
        }
    });
}

/// Returns `true` if all machines wait for a word.
pub fn are_idle() -> bool {
    let begin = origin() + PULL;
    rings::are_dry() && (0..AXES).all(|axis| place_of(axis) == begin)
}

/// Stops all machines, which wait for words. The last pulse of the path may still be in its final cycles.
pub fn rest() {
    if place() == 0 {
        end_pulses();
    } else {
        write(PIO0 + CLEAR, MACHINES);
    }
}

fn place_of(axis: usize) -> u32 {
    read(PIO0 + 0xD4 + 0x18 * axis)
}

/// The index of every axis at the moment of the stop, derived from the index after the last word.
pub fn index_of(behind: [i32; AXES]) -> [i32; AXES] {
    let mut index = behind;
    for (axis, index) in index.iter_mut().enumerate() {
        let place = place_of(axis).wrapping_sub(origin());
        let is_begun = place > PULL && place <= GO[self::place()];
        rings::unplayed(axis, is_begun, |word| *index = without(word, *index));
    }
    index
}
