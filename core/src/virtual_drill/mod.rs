//! The virtual drill: a pin board whose motors can slip, whose sensors can fail and whose board can really be drilled.
//!
//! ```text
//!      travel of one axis (steps)
//!      hard stop   sensor on                                   sensor on   hard stop
//!  ────────┤─────────|◀────────── working range ──────────▶|─────────├────────
//! ```
//!
//! It knows its own rotors, not the executor's count: the two agree only as long as no step is lost. What it does depends
//! only on the calls made. It starts at a place nobody told the executor, all spindles equally high.
//!
//! Where X or Y has play, the axis is pushed up by its motor, and down the play behind it. Every spindle has its own motor, its
//! own bit, as long as it is said to be, and its own board; all are read by one switch at each end, which is on below when the first
//! is down and above when the last is up, and by one contact, which is on while any tip touches.
//!
//! Comes in: calls of [`Pins`]. Goes out: inputs, every hole that the spinning tip really made, and where steps were lost.
//! Does not know programs.

mod bit;
mod changer;
pub mod faults;
mod rotor;
mod scatter;
mod switches;
mod tally;
mod uneven;

pub use bit::{Breakage, MountedBit, Tip};
pub use rotor::{Cause, Push, Rotor};
pub use switches::Switches;
pub use tally::{Again, Tally, made_again, missing_legs, tally};
pub use uneven::UnevenBoard;

use self::changer::{Changer, Happened, Head};
use self::scatter::Scatter;
use crate::job::{self, Input};
use crate::machine::{Axis, DriveKind, HomeEnd, Machine, StrokeEnd, index_input};
use crate::magazine::{StockedTool, ToolStock};
use crate::pins::{AxisSet, Pins};
use crate::steps::TICK_HZ;
use crate::units::Length;

/// Way beyond the end sensors before an axis hits its hard stop.
const OVERTRAVEL: Length = Length::from_um(8_000);

/// So far inside of its travel the board ends that lies on it.
const RIM: Length = Length::from_um(200);

/// Most slips that are remembered; what later ones lost is counted with the last.
const MOST_SLIPS: usize = 64;

/// Turns of the current that are lost one after the other are so many steps apart.
const THROWS_APART: u64 = 100;

/// Losses of one axis this close together are one slip, in ticks: 0.5 s.
const ONE_SLIP: u64 = TICK_HZ / 2;

/// The inputs that are switches.
const SWITCHES: [Input; 6] =
    [Input::XMin, Input::XMax, Input::YMin, Input::YMax, Input::ZTop, Input::ZBottom];

/// A hole as the board itself knows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VirtualHole {
    /// Where the tip was, machine mm.
    pub x_mm: f64,
    /// The same away from the person.
    pub y_mm: f64,
    /// How deep below the surface when it came through.
    pub depth_mm: f64,
    /// When, in ticks.
    pub tick: u64,
    /// By which spindle: 0 is Z1.
    pub spindle: u8,
    /// Diameter of the tool that made it, mm, where that came from a magazine.
    pub bit_mm: Option<f64>,
}

/// Where the holes are written down, one by one, the moment they are made.
pub type DrilledBoard = Box<dyn FnMut(&VirtualHole) + Send>;

/// A place where a motor lost steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Slip {
    /// Which axis: 0 X, 1 Y, 2 … 7 Z1 … Z6.
    pub axis: usize,
    /// When it began, in ticks.
    pub tick: u64,
    /// Which step since the start of the drill, from 1.
    pub step: u64,
    /// Where the axis really was, machine steps.
    pub place: i64,
    /// Steps lost there, until now.
    pub lost: u64,
    /// Why.
    pub cause: Cause,
    /// The latest loss that belongs to it, in ticks.
    pub until: u64,
}

/// Who is told that a bit broke, and why.
pub type BreakWatch = Box<dyn FnMut(Breakage) + Send>;

/// Who is told all slips whenever there is more to tell.
pub type SlipWatch = Box<dyn FnMut(&[Slip]) + Send>;

/// What is broken, on demand.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Faults {
    /// Inputs that are always on.
    pub stuck_on: u32,
    /// Inputs that are never on.
    pub stuck_off: u32,
    /// Share of single readings of every input that say the opposite, 0 … 1.
    pub glitches: f64,
    /// How far from their edges end switches close, anew each time, in steps at most.
    pub scatter_steps: u32,
    /// Steps that are lost, with the turn of the current they belong to: axis, and which step of it since the start, from 1;
    /// sorted or not.
    pub lost_steps: Vec<(usize, u64)>,
    /// Highest step rate that the motors of X, Y, Z follow, where it is less than it should be.
    pub weak_motors_hz: [Option<f64>; 3],
    /// Bits of the phase bytes that do not reach the motors of X, Y, Z: broken wires.
    pub dead_wires: [u8; 3],
    /// Fastest the bit gets through the board, steps per second; none for a sharp bit.
    pub dull_bit_hz: Option<f64>,
    /// Holes until a bit begins to cut slower; none for bits that stay sharp.
    pub bit_life: Option<u32>,
    /// How late the computer is with every step, in ticks: judged as on a real machine. Otherwise the drill keeps its own time.
    pub late_host: Option<u64>,
    /// The board is not flat.
    pub uneven: Option<UnevenBoard>,
    /// So many turns of the current are lost by Y from now on, a hundred steps apart.
    pub throws: u32,
    /// The bit breaks.
    pub bit_breaks: bool,
    /// The bit slips so far out of its collet, mm.
    pub bit_slips_mm: f64,
    /// The spindle stands still, whatever it is told.
    pub spindle_stands: bool,
    /// No pulse reaches the machine, and no sensor is heard.
    pub unplugged: bool,
    /// The clamp of the spindle does not move.
    pub clamp_stuck: bool,
    /// The next tool that is fetched from the magazine falls.
    pub tool_drops: bool,
    /// Something lies in the place of the next tool that is fetched.
    pub place_occupied: bool,
    /// There is no air for clamp and foot.
    pub no_air: bool,
    /// The cover is open.
    pub cover_open: bool,
    /// What comes later: after so many holes.
    pub later: Vec<(u32, Faults)>,
    /// The words that all of it was read from ([`faults::read`]), each `NAME@HOLES`.
    pub named: Vec<String>,
}

/// The virtual drill.
pub struct VirtualDrill {
    /// X, Y and the spindles.
    rotors: Vec<Rotor>,
    /// What the motors of X and Y push.
    tables: [Table; 2],
    /// First step of X, Y and the spindles at which their sensors are on: low end, high end.
    edges: [(i64, i64); 3],
    /// A step of X, Y and Z1 at which the index pulse of the motor comes, and how many steps there are to the next; where homing
    /// ends at it.
    pulses: [Option<(i64, i64)>; 3],
    scatter: Scatter,
    steps_per_mm: [f64; 3],
    /// The first and the last step of X and Y over the board.
    board: [(i64, i64); 2],
    switches: Switches,
    /// One for each spindle.
    bits: Vec<MountedBit>,
    /// Clamp, foot and magazine.
    changer: Changer,
    faults: Faults,
    slips: Vec<Slip>,
    /// Holes that all bits made.
    made: u32,
    drilled: DrilledBoard,
    watch: Option<SlipWatch>,
    breaks: Option<BreakWatch>,
}

/// An axis with play: it stands where its motor last pushed it.
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

/// A step at which the index pulse of each motor comes, and how many steps there are to the next: in the middle between the edge of the
/// end switch and a turn from it.
fn pulses(axes: [&Axis; 3], edges: [(i64, i64); 3]) -> [Option<(i64, i64)>; 3] {
    std::array::from_fn(|index| {
        let (axis, (low, high)) = (axes[index], edges[index]);
        let turn = axis.scale.steps(axis.index_within).max(1);
        let first = if axis.home == HomeEnd::Min { low + turn / 2 } else { high - turn / 2 };
        axis.index.then_some((first, turn))
    })
}

impl VirtualDrill {
    /// The twin of `machine`, at a place that depends on `seed`. Holes are told to `drilled`.
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
            // No axis of acceleration A changes its speed in a corner of deviation d by more than √(8·A·d).
            let jump_mm_per_s = libm::sqrt(8.0 * axis.max_acceleration_mm_per_s2 * machine.motion.corner_mm);
            let pull = (acceleration, jump_mm_per_s * axis.scale.steps_per_mm());
            // Faults are those of the first spindle.
            let weak = faults.weak_motors_hz[index].filter(|_| number < 3);
            let fastest = weak.unwrap_or(f64::from(machine.max_step_hz));
            let mixed = seed.wrapping_add(index as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40;
            // Somewhere in the middle half in the plane; high over the board in Z.
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

    /// Whether the drills of two machines have the same motors, tables and sensors at the same places; the feed that a sharp bit
    /// is made for is no part of that.
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

    /// The same, with somebody who is told where steps are lost, the moment they are.
    #[must_use]
    pub fn watched(mut self, watch: SlipWatch) -> Self {
        self.watch = Some(watch);
        self
    }

    /// The same, with somebody who is told when a bit breaks.
    #[must_use]
    pub fn watched_for_breaks(mut self, watch: BreakWatch) -> Self {
        self.breaks = Some(watch);
        self
    }

    /// Where X, Y and the first spindle really are, in steps.
    pub fn real(&self) -> [i64; 3] {
        [self.tables[0].at, self.tables[1].at, self.rotors[2].at]
    }

    /// Where every spindle really is, in steps.
    pub fn heights(&self) -> Vec<i64> {
        self.rotors.iter().skip(2).map(|rotor| rotor.at).collect()
    }

    /// How deep every tip went below the board's surface at this place, mm; 0 where it did not.
    pub fn depths_mm(&self) -> Vec<f64> {
        self.bits.iter().map(MountedBit::deepest_mm).collect()
    }

    /// Steps that were sent to X, Y and all spindles together, and not made.
    pub fn lost(&self) -> [u64; 3] {
        let spindles = self.rotors.iter().skip(2).map(|rotor| rotor.lost).sum();
        [self.rotors[0].lost, self.rotors[1].lost, spindles]
    }

    /// Where steps were lost, the first 64 times.
    pub fn slips(&self) -> &[Slip] {
        &self.slips
    }

    /// What the drivers put out to X, Y, Z.
    pub fn phases(&self) -> [u8; 3] {
        [0, 1, 2].map(|axis| self.rotors[axis].byte())
    }

    /// Why the first bit that broke did, if one did.
    pub fn broken(&self) -> Option<Breakage> {
        self.bits.iter().find_map(|bit| bit.broken)
    }

    /// The tool in the spindle, where it comes from a magazine.
    pub fn held(&self) -> Option<&StockedTool> {
        self.changer.held()
    }

    /// The tools in the places of the magazine.
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

    /// Cylinders go on.
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

    /// What is broken from now on shows.
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

    /// The board under the bits is as high as it lies there, where there is any.
    fn lie_under(&mut self) {
        let over = |axis: usize| (self.board[axis].0..=self.board[axis].1).contains(&self.tables[axis].at);
        let beside = !(over(0) && over(1));
        self.bits.iter_mut().for_each(|bit| bit.beside(beside));
        let Some(uneven) = self.faults.uneven else { return };
        let [x, y, _] = self.tip(0, 0).mm;
        let steps = libm::round(uneven.raised_mm(x, y) * self.steps_per_mm[2]) as i64;
        self.bits.iter_mut().for_each(|bit| bit.raise(steps));
    }

    /// A spindle went up or down.
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

    /// Says so if a bit that was whole broke.
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

    /// Writes a loss down: as part of the slip going on, or as a new one.
    fn slipped(&mut self, slip: Slip) {
        let latest = self.slips.iter().rposition(|known| known.axis == slip.axis);
        let same = |known: &Slip| known.cause == slip.cause && slip.tick <= known.until + ONE_SLIP;
        let latest = latest.filter(|index| self.slips.get(*index).is_some_and(same));
        if let Some(known) = latest.and_then(|index| self.slips.get_mut(index)) {
            (known.lost, known.until) = (known.lost + slip.lost, slip.tick);
        } else if self.slips.len() < MOST_SLIPS {
            self.slips.push(slip);
        } else if let Some(last) = self.slips.last_mut() {
            // No step is lost out of the count.
            last.lost += slip.lost;
        }
        if let Some(watch) = &mut self.watch {
            watch(&self.slips);
        }
    }

    /// The index pulses at which motors are.
    fn pulse_inputs(&self) -> u32 {
        let is_at = |(axis, pulse): (usize, &Option<(i64, i64)>)| {
            let (first, turn) = (*pulse)?;
            let at = self.rotors.get(axis)?.at;
            ((at - first).rem_euclid(turn) == 0).then(|| index_input(axis).bit())
        };
        self.pulses.iter().enumerate().filter_map(is_at).fold(0, |inputs, input| inputs | input)
    }

    /// What the sensors ought to say.
    fn sensed(&self) -> u32 {
        let on = |axis: usize, lowest: i64, (low, high): (Input, Input)| {
            let (first, last) = self.scatter.edges(axis, self.edges[axis]);
            (if lowest <= first { low.bit() } else { 0 }) | (if lowest >= last { high.bit() } else { 0 })
        };
        let [x, y, _] = self.real();
        // The lowest spindle is the first that is down, and the last that is up.
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
