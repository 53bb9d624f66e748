//! Inputs with a filter: the watcher does not see them; the processor times their touches.
//!
//! ```text
//! edge ─ interrupt ─▶ look ─┬─ touched: alarm when that is long enough ─▶ look: on; a guarded input stops the pulses
//!           ▲               └─ released earlier: counted
//!           └── not for 5 µs: noise takes only part of the processor's time
//! ```
//!
//! The main loop also looks if levels differ from the last ones, in case an interrupt was missed.

use crate::board::{self, read, write, IO, TIMER};
use crate::machines;
use annulus_link::filter::{Filter, Glance, LOOK_US};
use annulus_link::message::{Configure, Touches};
use annulus_link::INPUTS;
use core::cell::UnsafeCell;
use rp2040_hal::pac::interrupt;

struct Seen {
    filters: [Filter; INPUTS],
    /// Inputs with a filter, inputs that are on while their pin is low, inputs that stop the pulses; one
    /// bit each.
    filtered: u8,
    low: u8,
    limits: u8,
    /// Inputs that are touched, and inputs that are on.
    touched: u8,
    on: u8,
    /// Touched inputs whose time has not passed, and edges of all filtered inputs; four bits per input.
    young: u32,
    edges: u32,
    /// Edges do not interrupt at present.
    is_quiet: bool,
    /// The pin of the first input.
    first: u8,
}

struct Place(UnsafeCell<Seen>);

// SAFETY: accessed only by [`with`].
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

/// Registers of latched edges, four bits per pin, eight pins per register; their interrupt enables are
/// `ENABLED` bytes further.
const EDGES: usize = IO + 0xF0;
const ENABLED: usize = 0x10;
/// In both maps the first input is the fourth pin of its register; the remaining inputs are in the next
/// one.
const OFFSET: u32 = 12;
const _: () = assert!(board::MAPS[0].input() % 8 == 3 && board::MAPS[1].input() % 8 == 3);
const FELL: u32 = 1 << 2;
const ROSE: u32 = 1 << 3;

#[inline(always)]
fn with<T>(work: impl FnOnce(&mut Seen) -> T) -> T {
    // SAFETY: interrupts are off, and only one core runs.
    cortex_m::interrupt::free(|_| work(unsafe { &mut *SEEN.0.get() }))
}

/// Writes four bits per input into two neighbouring pin registers.
#[inline(always)]
fn spread(register: usize, bits: u32) {
    write(register, bits << OFFSET);
    write(register + 4, bits >> (32 - OFFSET));
}

/// Applies settings while stopped. The watcher sees no filtered input: [`filtered`] lists them.
pub fn settle(settings: &Configure, limits: u8, least_us: &[u16; INPUTS]) {
    with(|seen| {
        seen.filters.iter_mut().zip(least_us).for_each(|(filter, least_us)| filter.set(*least_us));
        seen.filtered = filtered(least_us);
        let all = (0..INPUTS).filter(|input| seen.filtered >> input & 1 == 1);
        seen.edges = all.fold(0, |edges, input| edges | (FELL | ROSE) << (4 * input));
        (seen.touched, seen.on, seen.young) = (0, 0, 0);
        // Disable the edge interrupts of the previous map.
        spread(seen.register() + ENABLED, 0);
        seen.first = machines::map().input();
        (seen.low, seen.limits) = (settings.low_inputs, limits);
        // Old edges belong to no touch.
        spread(seen.register(), u32::MAX);
        seen.interrupt_at_edges();
        seen.look(seen.edges);
    });
}

/// Stops the pulses if a guarded input is on: one that turned on before `arm` gives no new edge.
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

/// Filtered inputs, and those of them that are on, if the inputs in `touched` are touched; one bit each.
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

/// Counts of touches shorter than their filter.
pub fn counted() -> Touches {
    with(|seen| Touches {
        short: core::array::from_fn(|input| seen.filters[input].short()),
        longest_us: core::array::from_fn(|input| seen.filters[input].longest_us()),
    })
}

impl Seen {
    #[inline(always)]
    fn register(&self) -> usize {
        EDGES + 4 * (self.first as usize / 8)
    }

    #[inline(always)]
    fn interrupt_at_edges(&mut self) {
        self.is_quiet = false;
        spread(self.register() + ENABLED, self.edges);
    }

    /// Checks inputs with edges, those with a young touch, and `others`, four bits per input. Stops the
    /// pulses if a guarded one is on, and sets the alarm for the next check.
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
            // An alarm set for a past time would fire after more than an hour.
            let passed_us = board::micros().wrapping_sub(now_us);
            write(TIMER + 0x10, now_us.wrapping_add(wait_us.max(passed_us + 2)));
        }
    }

    /// Checks one input, with its edges in the lowest four bits, and stops the pulses if needed. Returns
    /// the remaining time of a young touch, in µs; `u32::MAX` if there is none.
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
            // So soon that waiting here is quicker.
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

pub fn prepare() {
    write(TIMER + 0x38, 1);
}
