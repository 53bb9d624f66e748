//! Where things are: pins, registers that the library has no words for, and settings of pads.
//!
//! Comes in: addresses. Goes out: values. Does not know what they are for.

use core::ptr::{read_volatile, write_volatile};

/// First step pin; those of the other axes follow.
pub const STEP: u8 = 2;
/// First direction pin.
pub const DIRECTION: u8 = 6;
/// Pins of a motor that is driven by its phases: four halves of windings, two of forcing. Those of the first motor begin at GP0.
pub const MOTOR: u8 = 6;
/// The first of them that forces.
pub const FORCING: u8 = 4;
/// Pins that lead to something.
pub const ALL: [u8; 26] =
    [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 26, 27, 28];

/// Which pin is what, beside steps and phases. No pin is driven before it is said which map it is.
pub struct Map {
    /// Emergency stop: high says that it may run; low, or a broken wire, stops.
    pub stop: u8,
    /// Inputs there are; they follow the emergency stop.
    pub inputs: u8,
    /// High while pulses are allowed; made by the watching state machine, read by those of the axes.
    pub run: u8,
    /// The spindle.
    pub output: u8,
    /// Goes up and down as long as the program is well: for a safety relay that wants a moving signal.
    pub alive: u8,
    /// Second output, as a bit; 0 where there is none.
    pub second_output: u32,
}

impl Map {
    /// First input.
    pub const fn input(&self) -> u8 {
        self.stop + 1
    }

    /// Outputs of the program, one bit a pin.
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

/// State machines of the axes.
pub const PIO0: usize = 0x5020_0000;
/// The one that watches the inputs.
pub const PIO1: usize = 0x5030_0000;
/// Copies words from memory to the machines.
pub const DMA: usize = 0x5000_0000;
/// Functions of pins, and their edges.
pub const IO: usize = 0x4001_4000;
const PADS: usize = 0x4001_C000;
const SIO: usize = 0xD000_0000;
/// Counts microseconds, and says when.
pub const TIMER: usize = 0x4005_4000;

/// Added to an address: a write sets the bits that are 1.
pub const SET: usize = 0x2000;
/// Added to an address: a write clears the bits that are 1.
pub const CLEAR: usize = 0x3000;

/// Output function of a pin: by state machines of block 0, of block 1, by the processor.
pub const BY_PIO0: u32 = 6;
/// See [`BY_PIO0`].
pub const BY_PIO1: u32 = 7;
/// See [`BY_PIO0`].
pub const BY_PROGRAM: u32 = 5;
/// See [`BY_PIO0`]: by nobody.
pub const BY_NOBODY: u32 = 31;

/// What a pin does with a value on its way: leave it, turn it over, always low, always high.
pub const AS_IS: u32 = 0;
/// See [`AS_IS`].
pub const INVERTED: u32 = 1;
/// See [`AS_IS`].
pub const LOW: u32 = 2;
/// See [`AS_IS`].
pub const HIGH: u32 = 3;

/// Writes a register.
#[inline(always)]
pub fn write(address: usize, value: u32) {
    // SAFETY: every address in this program is that of a register of the RP2040.
    unsafe { write_volatile(address as *mut u32, value) }
}

/// Reads a register.
#[inline(always)]
pub fn read(address: usize) -> u32 {
    // SAFETY: as above.
    unsafe { read_volatile(address as *const u32) }
}

/// Takes pins, pads, channels and timer out of reset.
pub fn bring_up() {
    const RESETS: usize = 0x4000_C000;
    const WANTED: u32 = 1 << 2 | 1 << 5 | 1 << 8 | 1 << 21;
    write(RESETS + CLEAR, WANTED);
    while read(RESETS + 0x8) & WANTED != WANTED {}
}

/// Microseconds since the reset; they begin again after 71 minutes.
#[inline(always)]
pub fn micros() -> u32 {
    read(TIMER + 0x28)
}

/// Sets who drives a pin, and what it does with what is driven and with what is read.
#[inline(always)]
pub fn route(pin: u8, function: u32, output: u32, input: u32) {
    write(IO + 8 * pin as usize + 4, function | output << 8 | input << 16);
}

/// Makes the pad of a pin ready to be read: with a resistor up or down, its own driver on.
pub fn pad(pin: u8, up: bool) {
    const READ: u32 = 1 << 6;
    const STRENGTH: u32 = 1 << 4;
    const UP: u32 = 1 << 3;
    const DOWN: u32 = 1 << 2;
    const SCHMITT: u32 = 1 << 1;
    write(PADS + 4 + 4 * pin as usize, READ | STRENGTH | SCHMITT | if up { UP } else { DOWN });
}

/// The level at a pad, whatever the program does with it.
#[inline(always)]
pub fn level(pin: u8) -> bool {
    read(IO + 8 * pin as usize) >> 17 & 1 == 1
}

/// Switches outputs of the program, one bit a pin.
#[inline(always)]
pub fn switch(on: u32, off: u32) {
    write(SIO + 0x14, on);
    write(SIO + 0x18, off);
}

/// Lets the program drive these pins and no others.
pub fn drive(pins: u32) {
    write(SIO + 0x20, pins);
}

/// Turns a pin over.
pub fn toggle(pin: u8) {
    write(SIO + 0x1C, 1 << pin);
}
