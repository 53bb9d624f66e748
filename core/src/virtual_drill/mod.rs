//! The virtual drill: pins with simulated motors that can lose steps, sensors that can fail, and a board that
//! gets holes.
//!
//! ```text
//!      travel of one axis (steps)
//!      hard stop   switch on                                   switch on   hard stop
//!  ────────┤─────────|◀────────── working range ──────────▶|─────────├────────
//! ```
//!
//! The model tracks its own rotors, not the executor's count: the two agree only while no step is lost. Its
//! behaviour depends only on the calls. The start position is unknown to the executor, with all spindles
//! equally high.
//!
//! X or Y with backlash follows its motor: pushed at once upwards, and after the backlash downwards. Every
//! spindle has its own motor, bit and board. All spindles share one switch at each end: the lower is on if
//! any spindle is down, the upper if all are up. They also share one contact sensor, which is on while any
//! tip touches.

mod bit;
mod changer;
pub mod faults;
mod rotor;
mod switches;
mod tally;

pub use bit::{Breakage, MountedBit, Tip};
pub use faults::UnevenBoard;
pub use rotor::{Cause, Push, Rotor};
pub use switches::Switches;
pub use tally::{Again, Tally, made_again, missing_legs, tally};

use self::changer::{Changer, Happened, Head};
use self::switches::Scatter;
use crate::job::{self, Input};
use crate::machine::{Axis, DriveKind, HomeEnd, Machine, StrokeEnd, index_input};
use crate::magazine::{StockedTool, ToolStock};
use crate::pins::{AxisSet, Pins};
use crate::steps::TICK_HZ;
use crate::units::Length;

/// Distance beyond the limit switches to the hard stop of an axis.
const OVERTRAVEL: Length = Length::from_um(8_000);

/// The board ends this far inside the travel.
const RIM: Length = Length::from_um(200);

/// Number of recorded slips. Later losses are added to the last one.
const MOST_SLIPS: usize = 64;

/// Steps between two injected losses.
const THROWS_APART: u64 = 100;

/// Losses of one axis within this time count as one slip, in ticks: 0.5 s.
const ONE_SLIP: u64 = TICK_HZ / 2;

const SWITCHES: [Input; 6] =
    [Input::XMin, Input::XMax, Input::YMin, Input::YMax, Input::ZTop, Input::ZBottom];

/// A hole in the simulated board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VirtualHole {
    pub x_mm: f64,
    /// Y of the tip, machine mm.
    pub y_mm: f64,
    /// Depth below the surface at breakthrough.
    pub depth_mm: f64,
    pub tick: u64,
    /// Spindle index: 0 is Z1.
    pub spindle: u8,
    /// Diameter of the tool, mm, if it came from the magazine.
    pub bit_mm: Option<f64>,
}

/// Receives each hole at the moment of breakthrough.
pub type DrilledBoard = Box<dyn FnMut(&VirtualHole) + Send>;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Slip {
    /// 0 X, 1 Y, 2 … 7 Z1 … Z6.
    pub axis: usize,
    pub tick: u64,
    /// Index of the step since the start of the drill, from 1.
    pub step: u64,
    /// Real position of the axis, machine steps.
    pub place: i64,
    pub lost: u64,
    pub cause: Cause,
    /// Latest loss that belongs to this slip, in ticks.
    pub until: u64,
}

/// Receives the cause when a bit breaks.
pub type BreakWatch = Box<dyn FnMut(Breakage) + Send>;

/// Receives all slips after each change.
pub type SlipWatch = Box<dyn FnMut(&[Slip]) + Send>;

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Faults {
    /// Inputs that are always on.
    pub stuck_on: u32,
    /// Inputs that are never on.
    pub stuck_off: u32,
    /// Share of wrong readings of each input, 0 … 1.
    pub glitches: f64,
    /// Greatest distance between a limit switch's edge and the point where it closes, in steps. Drawn again
    /// each time.
    pub scatter_steps: u32,
    /// Injected losses of one electrical cycle each: axis, and index of its step since the start, from 1. In
    /// any order.
    pub lost_steps: Vec<(usize, u64)>,
    /// Highest step rate that the motors of X, Y, Z follow, if reduced.
    pub weak_motors_hz: [Option<f64>; 3],
    /// Bits of the phase bytes that do not reach the motors of X, Y, Z: broken wires.
    pub dead_wires: [u8; 3],
    /// Highest step rate of the bit through the board; none for a sharp bit.
    pub dull_bit_hz: Option<f64>,
    /// Holes until a bit starts to cut slower; none for bits that stay sharp.
    pub bit_life: Option<u32>,
    /// Delay of the computer at every step, in ticks, judged as on a real machine. If none, the drill's own
    /// clock is never late.
    pub late_host: Option<u64>,
    pub uneven: Option<UnevenBoard>,
    /// Number of losses still to inject into Y, `THROWS_APART` steps apart. Each loses one electrical
    /// cycle.
    pub throws: u32,
    pub bit_breaks: bool,
    /// The bit slips out of its collet by this much, mm.
    pub bit_slips_mm: f64,
    /// The spindle does not turn, even if switched on.
    pub spindle_stands: bool,
    /// No pulse reaches the machine, and all inputs read as off.
    pub unplugged: bool,
    /// The clamp of the spindle does not move.
    pub clamp_stuck: bool,
    /// The next tool fetched from the magazine falls out of the clamp.
    pub tool_drops: bool,
    /// Something occupies the slot of the next fetched tool, after the spindle has left it.
    pub place_occupied: bool,
    /// The clamp and the foot have no compressed air.
    pub no_air: bool,
    pub cover_open: bool,
    /// Later faults, each with the number of holes after which it starts.
    pub later: Vec<(u32, Faults)>,
    /// Source words ([`faults::read`]), each `NAME@HOLES`.
    pub named: Vec<String>,
}

pub struct VirtualDrill {
    /// X, Y and the spindles.
    rotors: Vec<Rotor>,
    /// Tables moved by the motors of X and Y.
    tables: [Table; 2],
    /// Steps at which the limit switches of X, Y and the spindles turn on: low end, high end.
    edges: [(i64, i64); 3],
    /// For X, Y and Z1: a step with an index pulse of the motor, and the steps between pulses. None if homing
    /// does not use the index pulse.
    pulses: [Option<(i64, i64)>; 3],
    scatter: Scatter,
    steps_per_mm: [f64; 3],
    /// First and last step of X and Y over the board.
    board: [(i64, i64); 2],
    switches: Switches,
    bits: Vec<MountedBit>,
    changer: Changer,
    faults: Faults,
    slips: Vec<Slip>,
    made: u32,
    drilled: DrilledBoard,
    watch: Option<SlipWatch>,
    breaks: Option<BreakWatch>,
}

/// An axis with backlash: its position follows the motor only after the backlash.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Table {
    at: i64,
    play: i64,
}

impl Table {
    fn pushed(&mut self, motor: i64) {
        self.at = self.at.clamp(motor, motor + self.play);
    }
}

/// For each motor, a step with an index pulse and the steps between pulses. The first pulse is half a turn
/// away from the limit switch, so that a scattered switch can't reach it.
fn pulses(axes: [&Axis; 3], edges: [(i64, i64); 3]) -> [Option<(i64, i64)>; 3] {
    std::array::from_fn(|index| {
        let (axis, (low, high)) = (axes[index], edges[index]);
        let turn = axis.scale.steps(axis.index_within).max(1);
        let first = if axis.home == HomeEnd::Min { low + turn / 2 } else { high - turn / 2 };
        axis.index.then_some((first, turn))
    })
}

impl VirtualDrill {
    /// The simulated twin of `machine`, at a start position that depends on `seed`. `drilled` receives the
    /// holes.
    pub fn new(machine: &Machine, seed: u64, faults: Faults, drilled: DrilledBoard) -> Self {
        let axes = [&machine.x, &machine.y, &machine.z];
        let mut edges: [(i64, i64); 3] = std::array::from_fn(|index| {
            let axis = axes[index];
            (axis.scale.steps(axis.min) - 1, axis.scale.steps(axis.max) + 1)
        });
        let (process, surface, z) = (&machine.process, machine.process.surface, &machine.z);
        if machine.stroke_end == StrokeEnd::Sensor {
            let through = process.board_thickness + Length::from_nm(process.breakthrough.nm() / 2);
            edges[2].0 = z.scale.steps(surface - through);
        }
        let rotor = |number: usize| {
            let index = number.min(2);
            let (axis, (low, high)) = (axes[index], edges[index]);
            let beyond = axis.scale.steps(OVERTRAVEL).abs();
            let acceleration = axis.max_acceleration_mm_per_s2 * axis.scale.steps_per_mm();
            // √(8·A·d) is the largest change of speed of an axis with acceleration A in a corner of deviation
            // d.
            let jump_mm_per_s = libm::sqrt(8.0 * axis.max_acceleration_mm_per_s2 * machine.motion.corner_mm);
            let pull = (acceleration, jump_mm_per_s * axis.scale.steps_per_mm());
            // Faults affect only the first spindle.
            let weak = faults.weak_motors_hz[index].filter(|_| number < 3);
            let fastest = weak.unwrap_or(f64::from(machine.max_step_hz));
            let mixed = seed.wrapping_add(index as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40;
            // Start in the middle half of the XY travel, and with Z high over the board.
            let span = (high - low).max(4);
            let start = match index {
                2 => high - 1 - span / 10 - (mixed as i64) % (span / 8).max(1),
                _ => low + span / 4 + (mixed as i64) % (span / 2),
            };
            let rotor = Rotor::new(&axis.phases, start, (low - beyond, high + beyond), fastest, pull);
            let rotor = if machine.drive == DriveKind::Table { rotor.by_interrupts() } else { rotor };
            rotor.wired(if number < 3 { !faults.dead_wires[index] } else { u8::MAX })
        };
        let rotors: Vec<Rotor> = (0..machine.spindle_axes().end).map(rotor).collect();
        let tables = [0, 1].map(|axis: usize| {
            let play = axes[axis].scale.steps(axes[axis].backlash).abs();
            Table { at: rotors[axis].at, play }
        });
        let feed_hz = process.feed_mm_per_s * z.scale.steps_per_mm();
        let mm_per_step = 1.0 / z.scale.steps_per_mm();
        let bit = |axis: usize| {
            let surface = surface + machine.own(axis).longer;
            let board = (z.scale.steps(surface), z.scale.steps(surface - process.board_thickness));
            MountedBit::new((board, mm_per_step), feed_hz, faults.bit_life, faults.dull_bit_hz)
        };
        let bits = machine.spindle_axes().map(bit).collect();
        let bouncing = SWITCHES.iter().fold(0, |bits, input| bits | input.bit());
        let mut drill = Self {
            rotors,
            tables,
            edges,
            pulses: pulses(axes, edges),
            scatter: Scatter::new(seed),
            steps_per_mm: axes.map(|axis| axis.scale.steps_per_mm()),
            board: [&machine.x, &machine.y]
                .map(|axis| (axis.scale.steps(axis.min + RIM), axis.scale.steps(axis.max - RIM))),
            switches: Switches::new(seed, bouncing, faults.glitches),
            bits,
            changer: Changer::new(machine),
            faults,
            slips: Vec::new(),
            made: 0,
            drilled,
            watch: None,
            breaks: None,
        };
        drill.faults_came();
        drill
    }

    /// True if two machines have identical motors, tables and sensors. The feed of a sharp bit does not
    /// count.
    pub fn is_the_same_for(one: &Machine, other: &Machine) -> bool {
        let [one, other] =
            [one, other].map(|machine| Self::new(machine, 0, Faults::default(), Box::new(|_| {})));
        one.rotors == other.rotors
            && one.tables == other.tables
            && one.edges == other.edges
            && one.steps_per_mm == other.steps_per_mm
            && one.switches == other.switches
            && one.changer == other.changer
    }

    /// Sets the receiver of slips.
    #[must_use]
    pub fn watched(mut self, watch: SlipWatch) -> Self {
        self.watch = Some(watch);
        self
    }

    /// Sets the receiver of bit breakages.
    #[must_use]
    pub fn watched_for_breaks(mut self, watch: BreakWatch) -> Self {
        self.breaks = Some(watch);
        self
    }

    /// Real position of X, Y and the first spindle, in steps.
    pub fn real(&self) -> [i64; 3] {
        [self.tables[0].at, self.tables[1].at, self.rotors[2].at]
    }

    pub fn heights(&self) -> Vec<i64> {
        self.rotors.iter().skip(2).map(|rotor| rotor.at).collect()
    }

    /// Greatest depth of each tip below the surface at the current XY position, mm; 0 if it didn't reach the
    /// board.
    pub fn depths_mm(&self) -> Vec<f64> {
        self.bits.iter().map(MountedBit::deepest_mm).collect()
    }

    /// Steps sent but not made: X, Y, and the sum of all spindles.
    pub fn lost(&self) -> [u64; 3] {
        let spindles = self.rotors.iter().skip(2).map(|rotor| rotor.lost).sum();
        [self.rotors[0].lost, self.rotors[1].lost, spindles]
    }

    /// The first 64 slips.
    pub fn slips(&self) -> &[Slip] {
        &self.slips
    }

    /// Phase bytes at the drivers of X, Y, Z.
    pub fn phases(&self) -> [u8; 3] {
        [0, 1, 2].map(|axis| self.rotors[axis].byte())
    }

    /// Cause of the first broken bit, if any.
    pub fn broken(&self) -> Option<Breakage> {
        self.bits.iter().find_map(|bit| bit.broken)
    }

    /// Tool in the spindle, if it came from a magazine.
    pub fn held(&self) -> Option<&StockedTool> {
        self.changer.held()
    }

    /// Tools in the slots of the magazine.
    pub fn lie(&self) -> &[Option<StockedTool>] {
        self.changer.lie()
    }

    fn step_axis(&mut self, tick: u64, axis: usize, forward: bool) {
        let (step, place) = (self.rotors[axis].sent + 1, self.rotors[axis].at);
        let throws = axis == 1 && self.faults.throws > 0 && step.is_multiple_of(THROWS_APART);
        self.faults.throws -= u32::from(throws);
        let thrown = throws || self.faults.lost_steps.contains(&(axis, step));
        let bit = axis.checked_sub(2).and_then(|spindle| self.bits.get_mut(spindle));
        let held = bit.is_some_and(|bit| !forward && bit.holds(tick, place));
        if let Some((lost, cause)) = self.rotors[axis].step(Push { tick, forward, held, thrown }) {
            self.slipped(Slip { axis, tick, step, place, lost, cause, until: tick });
        }
        if axis > 1 {
            self.head_moved(axis, !forward);
            return self.stroked(tick, axis - 2);
        }
        let before = self.tables[axis].at;
        self.tables[axis].pushed(self.rotors[axis].at);
        if self.tables[axis].at != before {
            self.head_moved(axis, false);
            self.lie_under();
            for spindle in 0..self.bits.len() {
                let (tip, whole) = (self.tip(tick, spindle), self.bits[spindle].broken.is_none());
                self.bits[spindle].slid(tip);
                self.broke(spindle, whole);
            }
        }
    }

    fn head(&self) -> Head {
        Head { at: self.real(), turns: self.bits.first().is_some_and(|bit| bit.rpm > 0) }
    }

    fn head_moved(&mut self, axis: usize, down: bool) {
        let head = self.head();
        let happened = self.changer.moved(head, axis, down);
        self.happened(happened);
    }

    fn cylinders(&mut self, tick: u64) {
        let head = self.head();
        let happened = self.changer.attend(tick, head);
        self.happened(happened);
    }

    fn happened(&mut self, happened: Happened) {
        if happened == Happened::Nothing {
            return;
        }
        match self.changer.held() {
            Some(tool) => self.bits[0].change(&tool.bit),
            None => self.bits[0].take_out(),
        }
        if happened == Happened::Crashed {
            let whole = self.bits[0].broken.is_none();
            self.bits[0].broken.get_or_insert(Breakage::Crashed);
            self.broke(0, whole);
        }
    }

    fn faults_came(&mut self) {
        self.changer.stuck = self.faults.clamp_stuck;
        self.changer.drops |= std::mem::take(&mut self.faults.tool_drops);
        self.changer.occupied |= std::mem::take(&mut self.faults.place_occupied);
        (self.changer.no_air, self.changer.open) = (self.faults.no_air, self.faults.cover_open);
        self.switches.flip(self.faults.glitches);
        self.lie_under();
        let (life, dull_hz) = (self.faults.bit_life, self.faults.dull_bit_hz);
        self.bits.iter_mut().for_each(|bit| bit.blunt(life, dull_hz));
        if self.faults.spindle_stands {
            self.bits.iter_mut().for_each(|bit| bit.rpm = 0);
        }
        let slips_mm = std::mem::take(&mut self.faults.bit_slips_mm);
        self.bits[0].slip(libm::round(slips_mm * self.steps_per_mm[2]) as i64);
        if std::mem::take(&mut self.faults.bit_breaks) {
            let whole = self.bits[0].broken.is_none();
            self.bits[0].broken.get_or_insert(Breakage::TooFast);
            self.broke(0, whole);
        }
    }

    /// Updates the board's height under the bits, and whether there is any board.
    fn lie_under(&mut self) {
        let over = |axis: usize| (self.board[axis].0..=self.board[axis].1).contains(&self.tables[axis].at);
        let beside = !(over(0) && over(1));
        self.bits.iter_mut().for_each(|bit| bit.beside(beside));
        let Some(uneven) = self.faults.uneven else { return };
        let [x, y, _] = self.tip(0, 0).mm;
        let steps = libm::round(uneven.raised_mm(x, y) * self.steps_per_mm[2]) as i64;
        self.bits.iter_mut().for_each(|bit| bit.raise(steps));
    }

    /// Updates the bit after a Z step, and records breakthrough and breakage.
    fn stroked(&mut self, tick: u64, spindle: usize) {
        let (tip, whole) = (self.tip(tick, spindle), self.bits[spindle].broken.is_none());
        let came_through = self.bits[spindle].moved(tip);
        self.broke(spindle, whole);
        if let Some(depth) = came_through {
            let depth_mm = depth as f64 / self.steps_per_mm[2];
            let [x_mm, y_mm, _] = tip.mm;
            let bit_mm = self.changer.held().map(|tool| tool.bit.diameter.mm());
            (self.drilled)(&VirtualHole { x_mm, y_mm, depth_mm, tick, spindle: spindle as u8, bit_mm });
            self.made += 1;
            if self.faults.come(self.made) {
                self.faults_came();
            }
        }
    }

    fn broke(&mut self, spindle: usize, was_whole: bool) {
        let why = self.bits[spindle].broken.filter(|_| was_whole);
        if let (Some(why), Some(watch)) = (why, &mut self.breaks) {
            watch(why);
        }
    }

    fn tip(&self, tick: u64, spindle: usize) -> Tip {
        let z = self.rotors[2 + spindle].at;
        let [x, y, _] = self.real();
        let mm = |axis: usize, steps: i64| steps as f64 / self.steps_per_mm[axis];
        Tip { tick, z, mm: [mm(0, x), mm(1, y), mm(2, z)] }
    }

    /// Records a loss: as part of the current slip, or as a new one.
    fn slipped(&mut self, slip: Slip) {
        let latest = self.slips.iter().rposition(|known| known.axis == slip.axis);
        let same = |known: &Slip| known.cause == slip.cause && slip.tick <= known.until + ONE_SLIP;
        let latest = latest.filter(|index| self.slips.get(*index).is_some_and(same));
        if let Some(known) = latest.and_then(|index| self.slips.get_mut(index)) {
            (known.lost, known.until) = (known.lost + slip.lost, slip.tick);
        } else if self.slips.len() < MOST_SLIPS {
            self.slips.push(slip);
        } else if let Some(last) = self.slips.last_mut() {
            // The list is full; the count must still be complete.
            last.lost += slip.lost;
        }
        if let Some(watch) = &mut self.watch {
            watch(&self.slips);
        }
    }

    fn pulse_inputs(&self) -> u32 {
        let is_at = |(axis, pulse): (usize, &Option<(i64, i64)>)| {
            let (first, turn) = (*pulse)?;
            let at = self.rotors.get(axis)?.at;
            ((at - first).rem_euclid(turn) == 0).then(|| index_input(axis).bit())
        };
        self.pulses.iter().enumerate().filter_map(is_at).fold(0, |inputs, input| inputs | input)
    }

    /// Ideal sensor states, without chatter and faults.
    fn sensed(&self) -> u32 {
        let on = |axis: usize, lowest: i64, (low, high): (Input, Input)| {
            let (first, last) = self.scatter.edges(axis, self.edges[axis]);
            (if lowest <= first { low.bit() } else { 0 }) | (if lowest >= last { high.bit() } else { 0 })
        };
        let [x, y, _] = self.real();
        // The lowest spindle reaches the lower switch first and leaves the upper one last.
        let lowest = self.rotors.iter().skip(2).map(|rotor| rotor.at).min().unwrap_or(0);
        let heights = self.rotors.iter().skip(2).map(|rotor| rotor.at);
        let touches = self.bits.iter().zip(heights).any(|(bit, height)| bit.contacts(height));
        let contact = if touches { Input::Contact.bit() } else { 0 };
        on(0, x, (Input::XMin, Input::XMax))
            | on(1, y, (Input::YMin, Input::YMax))
            | on(2, lowest, (Input::ZBottom, Input::ZTop))
            | contact
            | self.pulse_inputs()
            | self.changer.inputs([x, y, lowest])
    }
}

impl Pins for VirtualDrill {
    fn step(&mut self, at_tick: u64, axes: AxisSet, forward: AxisSet) {
        if self.faults.unplugged {
            return;
        }
        for axis in 0..self.rotors.len() {
            if axes >> axis & 1 == 1 {
                self.step_axis(at_tick, axis, forward >> axis & 1 == 1);
            }
        }
        let sensed = self.sensed();
        self.scatter.sensed(sensed, self.faults.scatter_steps);
        self.switches.stand(at_tick, sensed);
    }

    fn spindle(&mut self, _at_tick: u64, rpm: u32) {
        let rpm = if self.faults.spindle_stands || self.faults.unplugged { 0 } else { rpm };
        self.bits.iter_mut().for_each(|bit| bit.rpm = rpm);
    }

    fn inputs(&mut self, at_tick: u64) -> u32 {
        if self.faults.unplugged {
            return 0;
        }
        self.cylinders(at_tick);
        let sensed = self.sensed();
        (self.switches.read(at_tick, sensed) | self.faults.stuck_on) & !self.faults.stuck_off
    }

    fn bit(&mut self, _at_tick: u64, bit: &job::Bit) {
        self.bits.iter_mut().for_each(|own| own.change(bit));
    }

    fn output(&mut self, at_tick: u64, place: u8, on: bool) {
        if self.faults.unplugged {
            return;
        }
        self.cylinders(at_tick);
        self.changer.output(at_tick, place, on);
    }

    fn stock(&mut self, at_tick: u64, stock: &ToolStock) {
        if self.changer.changes() {
            self.cylinders(at_tick);
            self.changer.lay(stock);
            self.happened(Happened::Held);
        }
    }

    fn safe(&mut self) {
        self.bits.iter_mut().for_each(|bit| bit.rpm = 0);
        self.changer.safe();
    }
}
