//! The executor's step: one segment played through pins and clock.
//!
//! ```text
//! pulses ──▶ pace ──▶ wait ──▶ step ──▶ look at the inputs ──▶ next
//!              ▲                              │ gate met, guard hit, deadline passed, Stop
//!              └──────────── brake ◀──────────┘
//! ```
//!
//! Comes in: a segment. Goes out: calls on [`Pins`], and an [`Outcome`]. Every end is at rest and every step is counted.
//! Does not know who computed the segment, nor what it is for.

use super::pace::Pace;
use super::{Clock, Pins};
use crate::job::{Gate, Input, Otherwise};
use crate::machine::Machine;
use crate::steps::{AXES, Effect, Replay, Segment, Steps, TICK_HZ, replay};

/// Longest piece of waiting between two looks at the orders, in ticks: 5 ms.
const SLICE: u64 = TICK_HZ / 200;

/// What the executor is to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Go on.
    Go,
    /// Come to rest on the path and wait there.
    Hold,
    /// Come to rest on the path and end.
    Stop,
}

/// Where orders come from and the latest position goes. Both are called between pulses and must not block.
pub trait Desk {
    /// The order now.
    fn order(&mut self) -> Order;
    /// Where things are.
    fn passed(&mut self, tick: u64, position: &Steps, inputs: u32);
}

/// How hard each axis may brake, in steps per tick².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brakes(pub [f64; AXES]);

impl Brakes {
    /// From the machine's accelerations.
    pub fn of(machine: &Machine) -> Self {
        let per_tick2 = 1.0 / (TICK_HZ as f64 * TICK_HZ as f64);
        Self(std::array::from_fn(|axis| {
            let axis = machine.axis(axis);
            axis.max_acceleration_mm_per_s2 * axis.scale.steps_per_mm() * per_tick2
        }))
    }
}

/// What the executor remembers from segment to segment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Line {
    /// Steps counted, machine coordinates.
    pub position: Steps,
    /// Stream time. It never goes back, and stands still between segments.
    pub tick: u64,
    /// How much later than stream time it is. Late is never caught up.
    pub late: u64,
}

/// How a segment ended. Always at rest, with [`Line::position`] exact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// As planned.
    Completed,
    /// The gate's input turned on when the position was this; braking took it a little further.
    Gated(Steps),
    /// The gate's input did not turn on before the deadline or the end.
    Unmet(Gate),
    /// A sensor that must not be reached turned on.
    Guarded(Input),
    /// As ordered.
    Stopped,
}

impl Line {
    fn wait(&mut self, tick: u64, clock: &mut dyn Clock) {
        let tick = tick.max(self.tick);
        let due = tick + self.late;
        self.late += clock.wait_until(due).saturating_sub(due);
        self.tick = tick;
    }
}

/// What a segment looks like before it is played.
struct Shape {
    /// Bit of the axis with most steps.
    lead: u8,
    braking: f64,
    /// Sensors that must stay off: those in the direction of motion, and the board's contact while X or Y moves.
    guard: u32,
}

fn shape(segment: &Segment, brakes: &Brakes) -> Shape {
    let mut counts = [0_u64; AXES];
    let mut guard = 0;
    for run in &segment.runs {
        if let Some(count) = counts.get_mut(usize::from(run.axis)) {
            *count += u64::from(run.count);
        }
        guard |= match (run.axis, run.forward) {
            (0, false) => Input::XMin.bit() | Input::Contact.bit(),
            (0, true) => Input::XMax.bit() | Input::Contact.bit(),
            (1, false) => Input::YMin.bit() | Input::Contact.bit(),
            (1, true) => Input::YMax.bit() | Input::Contact.bit(),
            (_, false) => Input::ZBottom.bit(),
            (_, true) => Input::ZTop.bit(),
        };
    }
    if let Some(gate) = segment.gate {
        guard &= !gate.input.bit();
    }
    let lead = (0..AXES).max_by_key(|axis| (counts[*axis], AXES - axis)).unwrap_or(0);
    let share = |axis: usize| counts[lead] as f64 / counts[axis] as f64;
    let moving = (0..AXES).filter(|axis| counts[*axis] > 0);
    let braking = moving.map(|axis| brakes.0[axis] * share(axis)).fold(f64::INFINITY, f64::min);
    Shape { lead: 1 << lead, braking: if braking.is_finite() { braking } else { 1.0 }, guard }
}

/// Plays `segment` to its end, or to rest where something ended it early.
pub fn play(
    segment: &Segment,
    brakes: &Brakes,
    line: &mut Line,
    pins: &mut dyn Pins,
    clock: &mut dyn Clock,
    desk: &mut dyn Desk,
) -> Outcome {
    let shape = shape(segment, brakes);
    let pace = Pace::new(line.tick, shape.braking);
    let start = line.tick;
    Play { segment, shape, start, pace, lead_tick: None, end: None, line, pins, clock, desk }.run()
}

/// A segment in play.
struct Play<'a> {
    segment: &'a Segment,
    shape: Shape,
    start: u64,
    pace: Pace,
    /// Stream tick of the last step of the lead axis; none while it rests at the start.
    lead_tick: Option<u64>,
    /// Why it comes to rest early.
    end: Option<Outcome>,
    line: &'a mut Line,
    pins: &'a mut dyn Pins,
    clock: &'a mut dyn Clock,
    desk: &'a mut dyn Desk,
}

impl Play<'_> {
    fn run(mut self) -> Outcome {
        if let Effect::Spindle(rpm) = self.segment.effect {
            self.line.wait(self.line.tick, self.clock);
            self.pins.spindle(self.line.tick, rpm);
        }
        self.look();
        let mut pulses = replay(self.segment);
        while let Some(pulse) = pulses.next() {
            self.idle_until(pulse.tick);
            if let (Some(end), None) = (self.end, self.lead_tick) {
                return end;
            }
            self.pins.step(self.line.tick, pulse.axes, pulse.forward);
            count(&mut self.line.position, pulse.axes, pulse.forward);
            self.look();
            if pulse.axes & self.shape.lead != 0 && self.lead_step(pulse.tick, &pulses) {
                return self.end.unwrap_or(Outcome::Stopped);
            }
        }
        self.lead_tick = None;
        self.idle_until(self.segment.duration_ticks);
        match (self.end, self.segment.gate) {
            (Some(Outcome::Stopped) | None, Some(gate)) if gate.otherwise == Otherwise::Alarm => {
                Outcome::Unmet(gate)
            }
            (Some(Outcome::Stopped), _) if !self.segment.runs.is_empty() => Outcome::Completed,
            (end, _) => end.unwrap_or(Outcome::Completed),
        }
    }

    /// Waits for a stream tick. While nothing moves, orders are obeyed at once.
    fn idle_until(&mut self, stream_tick: u64) {
        loop {
            let at = self.pace.at(stream_tick);
            if self.lead_tick.is_some() || at <= self.line.tick {
                return self.line.wait(at, self.clock);
            }
            match self.desk.order() {
                Order::Stop => self.end = self.end.or(Some(Outcome::Stopped)),
                Order::Hold => self.pace.wait(SLICE),
                Order::Go => {}
            }
            if self.end.is_some() {
                return;
            }
            self.line.wait(at.min(self.line.tick + SLICE), self.clock);
            self.look();
        }
    }

    /// Looks at the inputs: is this where it ends?
    fn look(&mut self) {
        let inputs = self.pins.inputs(self.line.tick);
        self.desk.passed(self.line.tick, &self.line.position, inputs);
        if self.end.is_some() {
            return;
        }
        if inputs & self.shape.guard != 0 {
            let hit = Input::ALL.into_iter().find(|input| inputs & self.shape.guard & input.bit() != 0);
            self.end = hit.map(Outcome::Guarded);
        } else if let Some(gate) = self.segment.gate {
            let deadline = u64::from(gate.deadline_us) * (TICK_HZ / 1_000_000);
            if inputs & gate.input.bit() != 0 {
                self.end = Some(Outcome::Gated(self.line.position));
            } else if self.line.tick - self.start > deadline {
                self.end = Some(Outcome::Unmet(gate));
            }
        }
    }

    /// After a step of the lead axis: sets the pace to its next one. True when it came to rest for good.
    fn lead_step(&mut self, tick: u64, later: &Replay<'_>) -> bool {
        let last = self.lead_tick.map(|before| tick - before);
        self.lead_tick = Some(tick);
        let wanted = if self.end.is_some() { Order::Stop } else { self.desk.order() };
        if wanted == Order::Go && self.pace.is_full() {
            return false;
        }
        let next =
            later.clone().find(|pulse| pulse.axes & self.shape.lead != 0).map(|pulse| pulse.tick - tick);
        match wanted {
            Order::Go => self.pace.go_on(),
            Order::Hold | Order::Stop => self.pace.brake(last, next),
        }
        self.pace.next_step(tick, next);
        while self.pace.at_rest() {
            self.line.wait(self.pace.at(tick), self.clock);
            self.look();
            match (self.end, self.desk.order()) {
                (Some(_), _) => return true,
                (None, Order::Stop) => self.end = Some(Outcome::Stopped),
                (None, Order::Hold) => self.pace.wait(SLICE),
                (None, Order::Go) => {
                    self.pace.go_on();
                    self.pace.next_step(tick, next);
                }
            }
        }
        false
    }
}

fn count(position: &mut Steps, axes: u8, forward: u8) {
    for (axis, place) in position.iter_mut().enumerate() {
        if axes >> axis & 1 == 1 {
            *place += if forward >> axis & 1 == 1 { 1 } else { -1 };
        }
    }
}
