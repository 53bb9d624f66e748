//! The virtual drill: a pin board whose motors can slip, whose sensors can fail and whose board can really be drilled.
//!
//! ```text
//!      travel of one axis (steps)
//!      hard stop   sensor on                                   sensor on   hard stop
//!  ────────┤─────────|◀────────── working range ──────────▶|─────────├────────
//! ```
//!
//! It knows its own rotors, not the executor's count: the two agree only as long as no step is lost. What it does depends
//! only on the calls made. It starts at a place nobody told the executor.
//!
//! Comes in: calls of [`Pins`]. Goes out: inputs, and every hole that the spinning tip really made. Does not know programs.

mod rotor;

pub use rotor::Rotor;

use crate::job::Input;
use crate::machine::{Machine, StrokeEnd};
use crate::pins::{AxisSet, Pins};
use crate::units::Length;

/// Way beyond the end sensors before an axis hits its hard stop.
const OVERTRAVEL: Length = Length::from_um(8_000);

/// A hole as the board itself knows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drilled {
    /// Where the tip was, machine mm.
    pub x_mm: f64,
    /// The same away from the person.
    pub y_mm: f64,
    /// How deep below the surface when it came through.
    pub depth_mm: f64,
    /// When, in ticks.
    pub tick: u64,
}

/// Where the holes are written down, one by one, the moment they are made.
pub type DrilledBoard = Box<dyn FnMut(&Drilled) + Send>;

/// What is broken, on demand.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Faults {
    /// Inputs that are always on.
    pub stuck_on: u32,
    /// Inputs that are never on.
    pub stuck_off: u32,
    /// Steps that get lost: axis, and which step of it since the start, from 1; sorted or not.
    pub lost_steps: Vec<(usize, u64)>,
    /// Highest step rate that the motors of X, Y, Z follow, where it is less than it should be.
    pub weak_motors: [Option<f64>; 3],
    /// Fastest the bit gets through the board, steps per second; none for a sharp bit.
    pub dull_bit_hz: Option<f64>,
}

/// The virtual drill.
pub struct Twin {
    rotors: [Rotor; 3],
    /// First step of each axis at which its sensors are on: low end, high end.
    edges: [(i64, i64); 3],
    steps_per_mm: [f64; 3],
    /// Heights of the board's upper and lower side, Z steps.
    board: (i64, i64),
    rpm: u32,
    /// The tip is in or under the board, and the hole was already written down.
    in_board: bool,
    through: bool,
    /// A tip that was pushed without turning, or dragged sideways in the board, is broken: it makes no more holes.
    broken: bool,
    faults: Faults,
    dull_tick: u64,
    drilled: DrilledBoard,
}

impl Twin {
    /// The twin of `machine`, at a place that depends on `seed`. Holes are told to `drilled`.
    pub fn new(machine: &Machine, seed: u64, faults: Faults, drilled: DrilledBoard) -> Self {
        let axes = [&machine.x, &machine.y, &machine.z];
        let mut edges: [(i64, i64); 3] = std::array::from_fn(|index| {
            let axis = axes[index];
            (axis.scale.steps(axis.min) - 1, axis.scale.steps(axis.max) + 1)
        });
        let process = &machine.process;
        let (surface, z) = (process.surface, &machine.z);
        if machine.stroke_end == StrokeEnd::Sensor {
            let through = process.board_thickness + Length::from_nm(process.breakthrough.nm() / 2);
            edges[2].0 = z.scale.steps(surface - through);
        }
        let rotors = std::array::from_fn(|index| {
            let (axis, (low, high)) = (axes[index], edges[index]);
            let beyond = axis.scale.steps(OVERTRAVEL).abs();
            let acceleration = axis.max_acceleration_mm_per_s2 * axis.scale.steps_per_mm();
            let fastest = faults.weak_motors[index].unwrap_or(f64::from(machine.max_step_hz));
            let mixed = seed.wrapping_add(index as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40;
            // Somewhere in the middle half in the plane; high over the board in Z.
            let span = (high - low).max(4);
            let start = match index {
                2 => high - 1 - span / 10 - (mixed as i64) % (span / 8).max(1),
                _ => low + span / 4 + (mixed as i64) % (span / 2),
            };
            Rotor::new(start, (low - beyond, high + beyond), fastest, acceleration)
        });
        Self {
            rotors,
            edges,
            steps_per_mm: axes.map(|axis| axis.scale.steps_per_mm()),
            board: (z.scale.steps(surface), z.scale.steps(surface - process.board_thickness)),
            rpm: 0,
            in_board: false,
            through: false,
            broken: false,
            faults,
            dull_tick: 0,
            drilled,
        }
    }

    /// Where the rotors really are, in steps.
    pub fn real(&self) -> [i64; 3] {
        [0, 1, 2].map(|axis| self.rotors[axis].at)
    }

    /// Steps that were sent and not made.
    pub fn lost(&self) -> [u64; 3] {
        [0, 1, 2].map(|axis| self.rotors[axis].lost)
    }

    /// Whether the bit broke: pushed in without turning, or dragged sideways.
    pub fn broken(&self) -> bool {
        self.broken
    }

    fn step_axis(&mut self, at_tick: u64, axis: usize, forward: bool) {
        let sent = self.rotors[axis].sent + 1;
        let robbed = self.faults.lost_steps.contains(&(axis, sent));
        let held = axis == 2 && !forward && self.is_dull_for(at_tick);
        self.rotors[axis].step(at_tick, forward, robbed || held);
        if axis == 2 {
            self.tip_moved(at_tick);
        } else if self.in_board {
            self.broken = true;
        }
    }

    /// A dull bit holds the spindle back while it is inside the board.
    fn is_dull_for(&mut self, at_tick: u64) -> bool {
        let Some(hz) = self.faults.dull_bit_hz else { return false };
        let z = self.rotors[2].at;
        if z > self.board.0 || z <= self.board.1 {
            return false;
        }
        let needed = (crate::steps::TICK_HZ as f64 / hz) as u64;
        let held = at_tick < self.dull_tick + needed;
        if !held {
            self.dull_tick = at_tick;
        }
        held
    }

    fn tip_moved(&mut self, at_tick: u64) {
        let z = self.rotors[2].at;
        let inside = z < self.board.0;
        if inside && !self.in_board && self.rpm == 0 {
            self.broken = true;
        }
        self.in_board = inside;
        if !inside {
            self.through = false;
        } else if z <= self.board.1 && !self.through {
            self.through = true;
            if !self.broken && self.rpm > 0 {
                let mm = |axis: usize| self.rotors[axis].at as f64 / self.steps_per_mm[axis];
                let depth_mm = (self.board.0 - z) as f64 / self.steps_per_mm[2];
                (self.drilled)(&Drilled { x_mm: mm(0), y_mm: mm(1), depth_mm, tick: at_tick });
            }
        }
    }
}

impl Pins for Twin {
    fn step(&mut self, at_tick: u64, axes: AxisSet, forward: AxisSet) {
        for axis in 0..3 {
            if axes >> axis & 1 == 1 {
                self.step_axis(at_tick, axis, forward >> axis & 1 == 1);
            }
        }
    }

    fn spindle(&mut self, _at_tick: u64, rpm: u32) {
        self.rpm = rpm;
    }

    fn inputs(&mut self, _at_tick: u64) -> u32 {
        let on = |axis: usize, low: Input, high: Input| {
            let at = self.rotors[axis].at;
            let (first, last) = self.edges[axis];
            (if at <= first { low.bit() } else { 0 }) | (if at >= last { high.bit() } else { 0 })
        };
        let contact = if self.rotors[2].at < self.board.0 { Input::Contact.bit() } else { 0 };
        let sensed = on(0, Input::XMin, Input::XMax)
            | on(1, Input::YMin, Input::YMax)
            | on(2, Input::ZBottom, Input::ZTop)
            | contact;
        (sensed | self.faults.stuck_on) & !self.faults.stuck_off
    }

    fn safe(&mut self) {
        self.rpm = 0;
    }
}
