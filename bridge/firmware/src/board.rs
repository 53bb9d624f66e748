//! Pin maps, pad settings, and registers of the RP2040 that the HAL does not cover.

use core::ptr::{read_volatile, write_volatile};

/// First step pin; the other axes follow.
pub const STEP: u8 = 2;
pub const DIRECTION: u8 = 6;
/// Pins of a motor driven by its phases: four winding halves, two for forcing. The first motor begins at
/// GP0.
pub const MOTOR: u8 = 6;
/// The first forcing pin of a motor.
pub const FORCING: u8 = 4;
/// Pins with a function.
pub const ALL: [u8; 26] =
    [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 26, 27, 28];

/// Functions of the pins other than steps and phases. No pin is driven before the host selects a map.
pub struct Map {
    /// Emergency stop: high allows motion; low, or a broken wire, stops.
    pub stop: u8,
    /// Number of inputs; their pins follow the emergency stop.
    pub inputs: u8,
    /// High while pulses are allowed; set by the watcher's state machine, read by those of the axes.
    pub run: u8,
    pub output: u8,
    /// Toggles while the program is healthy: for a safety relay that needs a moving signal.
    pub alive: u8,
    /// Second output, as a bit; 0 if there is none.
    pub second_output: u32,
}

impl Map {
    pub const fn input(&self) -> u8 {
        self.stop + 1
    }

    /// Outputs of the program, one bit per pin.
    #[inline(always)]
    pub const fn outputs(&self) -> u32 {
        1 << self.output | self.second_output
    }
}

/// The maps: steps and directions of four axes; phases of three motors.
#[link_section = ".data.ram"]
pub static MAPS: [Map; 2] = [
    Map { stop: 10, inputs: 8, run: 19, output: 20, alive: 21, second_output: 1 << 22 },
    Map { stop: 18, inputs: 4, run: 28, output: 26, alive: 27, second_output: 0 },
];

pub const PIO0: usize = 0x5020_0000;
pub const PIO1: usize = 0x5030_0000;
pub const DMA: usize = 0x5000_0000;
/// Functions of pins, and their edges.
pub const IO: usize = 0x4001_4000;
const PADS: usize = 0x4001_C000;
const SIO: usize = 0xD000_0000;
/// Microsecond counter and alarms.
pub const TIMER: usize = 0x4005_4000;

/// Address offset: a write sets the bits that are 1.
pub const SET: usize = 0x2000;
/// Address offset: a write clears the bits that are 1.
pub const CLEAR: usize = 0x3000;

/// Output function of a pin: PIO block 0, PIO block 1, or the processor.
pub const BY_PIO0: u32 = 6;
/// See [`BY_PIO0`].
pub const BY_PIO1: u32 = 7;
/// See [`BY_PIO0`].
pub const BY_PROGRAM: u32 = 5;
/// See [`BY_PIO0`]: not driven.
pub const BY_NOBODY: u32 = 31;

/// How a pin passes a value on: as it is, inverted, always low, always high.
pub const AS_IS: u32 = 0;
pub const INVERTED: u32 = 1;
pub const LOW: u32 = 2;
pub const HIGH: u32 = 3;

#[inline(always)]
pub fn write(address: usize, value: u32) {
    // SAFETY: every address in this program is that of an RP2040 register.
    unsafe { write_volatile(address as *mut u32, value) }
}

#[inline(always)]
pub fn read(address: usize) -> u32 {
    // SAFETY: as above.
    unsafe { read_volatile(address as *const u32) }
}

/// Takes pins, pads, DMA channels and timer out of reset.
pub fn bring_up() {
    const RESETS: usize = 0x4000_C000;
    const WANTED: u32 = 1 << 2 | 1 << 5 | 1 << 8 | 1 << 21;
    write(RESETS + CLEAR, WANTED);
    while read(RESETS + 0x8) & WANTED != WANTED {}
}

/// Microseconds since the reset; wraps after 71 minutes.
#[inline(always)]
pub fn micros() -> u32 {
    read(TIMER + 0x28)
}

/// Selects the driver of a pin, and how its output and input are passed on.
#[inline(always)]
pub fn route(pin: u8, function: u32, output: u32, input: u32) {
    write(IO + 8 * pin as usize + 4, function | output << 8 | input << 16);
}

/// Configures a pad for reading: pull-up or pull-down, with its driver enabled.
pub fn pad(pin: u8, up: bool) {
    const READ: u32 = 1 << 6;
    const STRENGTH: u32 = 1 << 4;
    const UP: u32 = 1 << 3;
    const DOWN: u32 = 1 << 2;
    const SCHMITT: u32 = 1 << 1;
    write(PADS + 4 + 4 * pin as usize, READ | STRENGTH | SCHMITT | if up { UP } else { DOWN });
}

#[inline(always)]
pub fn level(pin: u8) -> bool {
    read(IO + 8 * pin as usize) >> 17 & 1 == 1
}

/// Switches outputs of the program, one bit per pin.
#[inline(always)]
pub fn switch(on: u32, off: u32) {
    write(SIO + 0x14, on);
    write(SIO + 0x18, off);
}

pub fn drive(pins: u32) {
    write(SIO + 0x20, pins);
}

pub fn toggle(pin: u8) {
    write(SIO + 0x1C, 1 << pin);
}
