//! Inputs with a filter: the watching machine does not see them, the processor times how long they are touched.
//!
//! ```text
//! edge ─ interrupt ─▶ look ─┬─ it is touched: alarm when that is long enough ─▶ look: on; where it stops, pulses stop
//!           ▲               └─ it was let go of before: counted
//!           └── not for 5 µs: noise takes a part of the processor, never all of it
//! ```
//!
//! The main loop looks too when levels are not as they were seen, whatever interrupts do.
//!
//! Comes in: settings, levels and edges of pins, microseconds. Goes out: inputs that are on; a stop; counts. Does not know chunks.

use crate::board::{self, read, write, IO, TIMER};
use crate::machines;
use annulus_link::filter::{Filter, Glance, LOOK_US};
use annulus_link::message::{Configure, Touches};
use annulus_link::INPUTS;
use core::cell::UnsafeCell;
use rp2040_hal::pac::interrupt;

/// What is remembered.
struct Seen {
    filters: [Filter; INPUTS],
    /// Inputs that have one, that are on while their pin is low, that stop the pulses, one bit each.
    filtered: u8,
    low: u8,
    limits: u8,
    /// Those that are touched, and those that are on.
    touched: u8,
    on: u8,
    /// Those that are touched and not yet for long enough; edges of all that have a filter: four bits an input.
    young: u32,
    edges: u32,
    /// Edges do not interrupt now.
    is_quiet: bool,
    /// The pin of the first input.
    first: u8,
}

struct Place(UnsafeCell<Seen>);

// SAFETY: touched by [`with`] alone.
unsafe impl Sync for Place {}

static SEEN: Place = Place(UnsafeCell::new(Seen {
    filters: [Filter::NONE; INPUTS],
    filtered: 0,
    low: 0,
    limits: 0,
    touched: 0,
    on: 0,
    young: 0,
    edges: 0,
    is_quiet: false,
    first: board::MAPS[0].input(),
}));

/// Edges are remembered there until they are cleared, four bits a pin, eight pins a register; enabled as interrupts so much further on.
const EDGES: usize = IO + 0xF0;
const ENABLED: usize = 0x10;
/// In either map the first input is the fourth pin of its register; what has no room there is in the next one.
const OFFSET: u32 = 12;
const _: () = assert!(board::MAPS[0].input() % 8 == 3 && board::MAPS[1].input() % 8 == 3);
const FELL: u32 = 1 << 2;
const ROSE: u32 = 1 << 3;

/// Does something with what is remembered, undisturbed.
#[inline(always)]
fn with<T>(work: impl FnOnce(&mut Seen) -> T) -> T {
    // SAFETY: interrupts are off, and there is one processor.
    cortex_m::interrupt::free(|_| work(unsafe { &mut *SEEN.0.get() }))
}

/// Writes four bits an input into a register of pins and the next.
#[inline(always)]
fn spread(register: usize, bits: u32) {
    write(register, bits << OFFSET);
    write(register + 4, bits >> (32 - OFFSET));
}

/// Takes up settings at rest. The watching machine sees no input that has a filter: [`filtered`] says which.
pub fn settle(settings: &Configure, limits: u8, least_us: &[u16; INPUTS]) {
    with(|seen| {
        seen.filters.iter_mut().zip(least_us).for_each(|(filter, least_us)| filter.set(*least_us));
        seen.filtered = filtered(least_us);
        let all = (0..INPUTS).filter(|input| seen.filtered >> input & 1 == 1);
        seen.edges = all.fold(0, |edges, input| edges | (FELL | ROSE) << (4 * input));
        (seen.touched, seen.on, seen.young) = (0, 0, 0);
        // Pins of the other map interrupt no more.
        spread(seen.register() + ENABLED, 0);
        seen.first = machines::map().input();
        (seen.low, seen.limits) = (settings.low_inputs, limits);
        // Edges of before are none of a touch.
        spread(seen.register(), u32::MAX);
        seen.interrupt_at_edges();
        seen.look(seen.edges);
    });
}

/// Stops the pulses where an input that stops them is on: one that was on before they were made ready stops nobody by itself.
pub fn stop_where_on() {
    with(|seen| {
        let on = seen.on & seen.limits;
        if on != 0 {
            machines::stop_for(on);
        }
    });
}

/// Inputs with a filter, one bit each.
pub fn filtered(least_us: &[u16; INPUTS]) -> u8 {
    least_us.iter().enumerate().fold(0, |all, (input, least_us)| all | u8::from(*least_us > 0) << input)
}

/// Which inputs have a filter, and which of these are on, where those in `touched` are touched; one bit each.
pub fn now(touched: u8) -> (u8, u8) {
    with(|seen| {
        let others = (touched ^ seen.touched) & seen.filtered;
        if others != 0 {
            let others = (0..INPUTS).filter(|input| others >> input & 1 == 1);
            seen.look(others.fold(0, |all, input| all | 1 << (4 * input)));
        }
        (seen.filtered, seen.on)
    })
}

/// How often inputs were touched for less than their filter.
pub fn counted() -> Touches {
    with(|seen| Touches {
        short: core::array::from_fn(|input| seen.filters[input].short()),
        longest_us: core::array::from_fn(|input| seen.filters[input].longest_us()),
    })
}

impl Seen {
    /// The register of the first input's edges.
    #[inline(always)]
    fn register(&self) -> usize {
        EDGES + 4 * (self.first as usize / 8)
    }

    /// From now on edges of inputs with a filter interrupt.
    #[inline(always)]
    fn interrupt_at_edges(&mut self) {
        self.is_quiet = false;
        spread(self.register() + ENABLED, self.edges);
    }

    /// Looks at the inputs that changed, those whose touch is young, and `others`, four bits an input; stops the pulses where one that stops them is on, and
    /// sees to it that it is looked in time.
    #[link_section = ".data.ram"]
    #[inline(never)]
    fn look(&mut self, others: u32) {
        let now_us = board::micros();
        let register = self.register();
        let edges = (read(register) >> OFFSET | read(register + 4) << (32 - OFFSET)) & self.edges;
        spread(register, edges);
        let (mut candidates, mut input) = (edges | self.young | others, 0);
        let mut wait_us = if edges != 0 { LOOK_US } else { u32::MAX };
        while candidates != 0 {
            if candidates & 0xF != 0 && input < INPUTS {
                wait_us = wait_us.min(self.look_at(input, edges >> (4 * input), now_us));
            }
            candidates >>= 4;
            input += 1;
        }
        if edges != 0 {
            self.is_quiet = true;
            spread(register + ENABLED, 0);
        } else if self.is_quiet {
            self.interrupt_at_edges();
        }
        if wait_us != u32::MAX {
            // An alarm that is past when it is set comes after an hour.
            let passed_us = board::micros().wrapping_sub(now_us);
            write(TIMER + 0x10, now_us.wrapping_add(wait_us.max(passed_us + 2)));
        }
    }

    /// Looks at one input, with its edges in the lowest four bits, and stops the pulses where it is to. How long it has to be touched
    /// still, where it is and does not yet count.
    #[inline(always)]
    fn look_at(&mut self, input: usize, edges: u32, now_us: u32) -> u32 {
        let bit = 1 << input;
        let is_low = self.low & bit != 0;
        let (rose, fell) = (edges & ROSE != 0, edges & FELL != 0);
        let (came, left) = if is_low { (fell, rose) } else { (rose, fell) };
        let touched = board::level(self.first + input as u8) != is_low;
        let filter = &mut self.filters[input];
        filter.look(Glance { touched, came, left }, now_us);
        let mut left_us = filter.left_us(now_us);
        if left_us == Some(1) {
            // Soon enough to wait for it here.
            while board::micros() == now_us {}
            let touched = board::level(self.first + input as u8) != is_low;
            filter.look(Glance { touched, came: false, left: false }, now_us.wrapping_add(1));
            left_us = None;
        }
        let set = |all: &mut u8, is: bool| *all = if is { *all | bit } else { *all & !bit };
        set(&mut self.touched, touched);
        set(&mut self.on, filter.is_on());
        let four = 0xF << (4 * input);
        self.young = if left_us.is_some() { self.young | four } else { self.young & !four };
        if self.on & self.limits & bit != 0 && !machines::is_stopped() {
            machines::stop_for(bit);
        }
        left_us.unwrap_or(u32::MAX)
    }
}

#[interrupt]
#[link_section = ".data.ram"]
fn IO_IRQ_BANK0() {
    with(|seen| seen.look(0));
}

#[interrupt]
#[link_section = ".data.ram"]
fn TIMER_IRQ_0() {
    write(TIMER + 0x34, 1);
    with(|seen| seen.look(0));
}

/// Lets the alarm interrupt.
pub fn prepare() {
    write(TIMER + 0x38, 1);
}
