//! The executor's step: one segment played through pins and clock.
//!
//! ```text
//! pulses ──▶ feed override ──▶ wait ──▶ step ──▶ look at the inputs ──▶ next
//!              ▲                              │ gate met, guard hit, deadline passed, Stop
//!              └──────────── brake ◀──────────┘
//! ```
//!
//! On the way to a sensor, the inputs are read again just before every step. A motor needs time for a step,
//! so the effect of one step shows only when the next is due. That step is skipped if the motors can stop
//! without it.
//!
//! If XY and spindles move together, XY starts when the plan predicts that the bit is clear of the board. If
//! a contact sensor still reports the board then, XY waits for its edge while the spindles continue up, and
//! later motion is delayed accordingly. If the sensor still reports it with the spindles all the way up, the
//! segment ends there. An early edge changes nothing: the tip has left the board, but may not be clear of it.
//!
//! With a clock that can wait, [`play`] returns at the end. With a clock that the caller advances,
//! [`play_by_turns`] yields whenever the next step is not due.
//!
//! Every ending is at rest, with every step counted.

use super::feed_override::{FeedOverride, rates};
use super::{AxisSet, Clock, Pins, SpindleState, SpindleTrouble};
use crate::job::{Gate, Input, Mark, Otherwise, Stage};
use crate::machine::{DriveKind, Machine, Output};
use crate::steps::{AXES, Pulse, Replay, Segment, Steps, Switching, TICK_HZ, replay};
use crate::units::Length;
use std::future::{Future, poll_fn};
use std::pin::pin;
use std::task::{Context, Poll, Waker};

const PLANE: AxisSet = 0b11;

/// Lowest feed override that can be ordered, percent.
const SLOWEST: u8 = 10;

/// Longest wait between two checks of the orders, in ticks: 5 ms.
const SLICE: u64 = TICK_HZ / 200;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    Go,
    /// Continue at this feed override.
    At {
        /// Percent of the planned feed, 10 … 100.
        percent: u8,
    },
    /// Come to rest on the path and wait there.
    Hold,
    /// Come to rest on the path and end there, so that [`play_on_by_turns`] can resume from that exact step.
    Leave,
    /// Come to rest on the path and end.
    Stop,
}

/// Source of orders, and receiver of positions. Methods are called between pulses and must not block.
pub trait Operator {
    fn order(&mut self) -> Order;
    fn passed(&mut self, tick: u64, position: &Steps, inputs: u32);
    /// Motion stopped on the path because of [`Order::Hold`].
    fn holds(&mut self) {}
}

/// Limits of the motors, and geometry that the sensor checks need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motors {
    /// Greatest braking of each axis, in steps per tick².
    pub braking_steps_per_tick2: [f64; AXES],
    /// The step rate up to which a motor follows irregular pulses, in Hz. Infinite for the virtual drill,
    /// because its pins follow stream time and are never late.
    pub start_stop_hz: f64,
    /// Output of the presser foot, by index; none without a foot.
    pub foot: Option<u8>,
    /// Inputs that must be on while the bit plunges with the foot down, one bit each.
    pub pressed: u32,
    /// Machine steps of Z, lowest first, between which a tip must touch the board on its way down to a hole.
    /// None if no contact sensor checks it.
    pub touches_within: Option<[i64; 2]>,
    /// Excess length of the bit of each axis over the bit of Z1, in steps.
    pub longer: Steps,
}

impl Motors {
    /// From the machine's accelerations. For table-driven axes, from the distance in which their table brakes
    /// from its top speed.
    pub fn of(machine: &Machine) -> Self {
        let is_virtual = machine.output == Output::Virtual;
        let start_stop_hz =
            if is_virtual { f64::INFINITY } else { f64::from(machine.wiring().start_stop_hz) };
        let per_tick2 = 1.0 / (TICK_HZ as f64 * TICK_HZ as f64);
        let braking = std::array::from_fn(|index| {
            if machine.drive == DriveKind::Table {
                return table_braking(machine) * per_tick2;
            }
            machine.braking_mm_per_s2(index) * machine.axis(index).scale.steps_per_mm() * per_tick2
        });
        let foot = machine.foot.on.then(|| machine.output_place(&machine.foot.output)).flatten();
        let told = foot.is_some() && machine.tells(Input::FootDown);
        let pressed = if told { Input::FootDown.bit() } else { 0 };
        let process = &machine.process;
        let looks = process.contact_tolerance > Length::ZERO && machine.tells(Input::Contact);
        let off = |by: Length| machine.z.scale.steps(process.surface + by);
        let touches_within = looks.then(|| [-process.contact_tolerance, process.contact_tolerance].map(off));
        let surface = machine.on_surface();
        let mut longer = Steps::default();
        machine.spindle_axes().for_each(|axis| longer[axis] = surface[axis] - surface[2]);
        Self { braking_steps_per_tick2: braking, start_stop_hz, foot, pressed, touches_within, longer }
    }
}

/// Braking of the table of dynamics from its top speed, in steps per second².
fn table_braking(machine: &Machine) -> f64 {
    let (period, leave) = (machine.dynamics.period.last(), machine.dynamics.leave.last());
    let hz = f64::from(machine.interrupt_hz) / f64::from(period.copied().unwrap_or(1).max(1));
    0.5 * hz * hz / f64::from(leave.copied().unwrap_or(1).max(1))
}

/// State of the executor between segments.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Playhead {
    /// Counted steps, machine coordinates.
    pub position: Steps,
    /// Stream time. Never decreases, and stops between segments.
    pub tick: u64,
    /// Delay of real time after stream time. Lost time is never caught up.
    pub late: u64,
    /// Axes with their latest step down. With backlash, the table of these axes is that much above the count.
    pub down: AxisSet,
    pub foot_down: bool,
}

/// How a segment ended. Motion is always at rest, with [`Playhead::position`] exact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    Completed,
    /// The gate's input turned on at this position; braking took the axes a little further.
    Gated(Steps),
    /// The gate's input did not turn on before the deadline or the end.
    Unmet(Gate),
    /// A sensor that must not be reached turned on.
    Guarded(Input),
    /// A sensor that must be on is off.
    Missing(Input),
    /// The tip touched something above the board on its way down to a hole; braking took it a little further.
    Early {
        at: Steps,
    },
    /// A step came too late for its motor, by this many ticks: steps may be lost.
    Late {
        ticks: u64,
    },
    /// The spindle should turn, but lost its speed or no longer answers.
    Spindle {
        trouble: SpindleTrouble,
    },
    /// At rest on the path, as [`Order::Leave`] asked.
    Left {
        pulses: u64,
    },
    Stopped,
}

impl Playhead {
    async fn wait(&mut self, tick: u64, clock: &mut dyn Clock) {
        let tick = tick.max(self.tick);
        let due = tick + self.late;
        while !clock.grants(due) {
            give_way().await;
        }
        self.late += clock.wait_until(due).saturating_sub(due);
        self.tick = tick;
    }
}

/// Sensors that must stay off during a segment. Those are the limit switches in the direction of motion, the
/// presser foot if X or Y moves, and the cover. The cover may be open while jogging, homing or retracting.
fn guard(segment: &Segment) -> u32 {
    let by_itself = !matches!(
        segment.stage,
        Stage::Jog
            | Stage::Seek
            | Stage::BackOff
            | Stage::Locate
            | Stage::Index
            | Stage::Offset
            | Stage::Retract
    );
    let moves = !segment.runs.is_empty();
    let mut guard = if moves && by_itself { Input::CoverOpen.bit() } else { 0 };
    for run in &segment.runs {
        // A pressed foot would drag the board along.
        if run.axes & PLANE != 0 {
            guard |= Input::FootDown.bit();
        }
        for axis in (0..AXES).filter(|axis| run.axes >> axis & 1 == 1) {
            guard |= match (axis, run.forward) {
                (0, false) => Input::XMin.bit(),
                (0, true) => Input::XMax.bit(),
                (1, false) => Input::YMin.bit(),
                (1, true) => Input::YMax.bit(),
                (_, false) => Input::ZBottom.bit(),
                (_, true) => Input::ZTop.bit(),
            };
        }
    }
    // The input of the gate is what the move waits for, not a fault.
    guard & !segment.gate.map_or(0, |gate| gate.input.bit())
}

/// Yields once to the task that polls this; ready at the next poll.
pub fn give_way() -> impl Future<Output = ()> {
    let mut gave = false;
    poll_fn(move |_| if std::mem::replace(&mut gave, true) { Poll::Ready(()) } else { Poll::Pending })
}

/// Polls `work` to its end, for a clock that waits by itself and never yields.
pub fn through<T>(work: impl Future<Output = T>) -> T {
    let (mut work, mut context) = (pin!(work), Context::from_waker(Waker::noop()));
    loop {
        if let Poll::Ready(done) = work.as_mut().poll(&mut context) {
            return done;
        }
    }
}

/// Plays `segment` to its end, or until something ends it early. For a clock that waits by itself.
pub fn play(
    segment: &Segment,
    motors: &Motors,
    line: &mut Playhead,
    pins: &mut dyn Pins,
    clock: &mut dyn Clock,
    operator: &mut dyn Operator,
) -> Outcome {
    through(play_by_turns(segment, motors, line, pins, clock, operator))
}

/// Like [`play`], but yields while `clock` doesn't grant the next tick. The next poll continues from there.
pub async fn play_by_turns(
    segment: &Segment,
    motors: &Motors,
    line: &mut Playhead,
    pins: &mut dyn Pins,
    clock: &mut dyn Clock,
    operator: &mut dyn Operator,
) -> Outcome {
    play_on_by_turns(segment, 0, motors, line, pins, clock, operator).await
}

/// Like [`play_by_turns`], from rest after [`Outcome::Left`]. The pulses after the first `made` must be those
/// of the segment that was left, in number and order.
pub async fn play_on_by_turns(
    segment: &Segment,
    made: u64,
    motors: &Motors,
    line: &mut Playhead,
    pins: &mut dyn Pins,
    clock: &mut dyn Clock,
    operator: &mut dyn Operator,
) -> Outcome {
    let start = line.tick;
    let (guard, feed_override) = (guard(segment), FeedOverride::new(start));
    let play = Play {
        made,
        segment,
        motors,
        guard,
        feed_override,
        moving: false,
        stepped: [(start, 0); AXES],
        stepped_at: 0,
        // Milling moves in the board by design, and an edge is touched and left again, so contact must not
        // hold XY.
        plane: if matches!(segment.stage, Stage::Mill | Stage::Touch) { Plane::Done } else { Plane::Before },
        put_off: 0,
        touched: false,
        end: None,
        line,
        pins,
        clock,
        operator,
    };
    play.run().await
}

/// Progress of XY within its part of the segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Plane {
    Before,
    Moving,
    Done,
}

struct Play<'a> {
    segment: &'a Segment,
    made: u64,
    motors: &'a Motors,
    guard: u32,
    feed_override: FeedOverride,
    /// A step was made since motion last was at rest.
    moving: bool,
    /// Tick and lateness at the latest step of each axis.
    stepped: [(u64, u64); AXES],
    /// Stream tick of the latest step of any axis.
    stepped_at: u64,
    plane: Plane,
    /// Delay of XY in ticks, because a tip was still in the board.
    put_off: u64,
    touched: bool,
    /// Reason for coming to rest early.
    end: Option<Outcome>,
    line: &'a mut Playhead,
    pins: &'a mut dyn Pins,
    clock: &'a mut dyn Clock,
    operator: &'a mut dyn Operator,
}

impl Play<'_> {
    async fn run(mut self) -> Outcome {
        let mut pulses = replay(self.segment);
        if self.made > 0 {
            if !self.goes_on(&mut pulses).await {
                return self.end.unwrap_or(Outcome::Stopped);
            }
            return self.pulses(pulses).await;
        }
        match self.segment.effect {
            Switching::Spindle { rpm } => {
                self.line.wait(self.line.tick, self.clock).await;
                self.pins.spindle(self.line.tick, rpm);
            }
            Switching::Foot { down } => {
                self.line.wait(self.line.tick, self.clock).await;
                if let Some(place) = self.motors.foot {
                    self.pins.output(self.line.tick, place, down);
                }
                self.line.foot_down = down;
            }
            Switching::None | Switching::AwaitBit { .. } => {}
        }
        // The inputs count before the first pulse, too.
        self.look();
        self.pulses(pulses).await
    }

    /// Continues from rest after the pulses already played. False if something forbids it.
    async fn goes_on(&mut self, pulses: &mut Replay<'_>) -> bool {
        let made = usize::try_from(self.made).unwrap_or(usize::MAX);
        let last = pulses.by_ref().take(made).last().map_or(0, |pulse| pulse.tick);
        let now = self.line.tick;
        self.feed_override = FeedOverride::rested(last, now);
        (self.stepped, self.stepped_at) = ([(now, self.line.late); AXES], last);
        self.look();
        let is_over = pulses.clone().next().is_none();
        self.end.is_none() && (is_over || !self.paced(last, pulses).await)
    }

    /// Plays `pulses` to the end of the segment.
    async fn pulses(mut self, mut pulses: Replay<'_>) -> Outcome {
        self.announce(&pulses);
        loop {
            if !self.released(&mut pulses).await {
                // All spindles are up, and a tip still touches something.
                return Outcome::Guarded(Input::Contact);
            }
            let Some(pulse) = pulses.next() else { break };
            self.idle_until(pulse.tick).await;
            // Nothing moves, so there is nothing to brake.
            if let (Some(end), false) = (self.end, self.moving) {
                return end;
            }
            if let Some(end) = self.ends_before(pulse.tick, &pulses) {
                return end;
            }
            self.stepped_at = pulse.tick;
            self.step(pulse);
            self.announce(&pulses);
            if pulse.axes & PLANE != 0 && pulses.pending() & PLANE == 0 {
                self.plane = Plane::Done;
            }
            if self.paced(pulse.tick, &pulses).await {
                return self.end.unwrap_or(Outcome::Stopped);
            }
        }
        self.moving = false;
        self.idle_until(self.segment.duration_ticks + self.put_off).await;
        // All pulses are played. A gate that must be met is unmet now, and a STOP in the final rest doesn't
        // interrupt the segment.
        match (self.end, self.segment.gate) {
            (Some(Outcome::Stopped | Outcome::Left { .. }) | None, Some(gate))
                if gate.otherwise == Otherwise::Alarm =>
            {
                Outcome::Unmet(gate)
            }
            (Some(Outcome::Stopped | Outcome::Left { .. }), _) if !self.segment.runs.is_empty() => {
                Outcome::Completed
            }
            (end, _) => end.unwrap_or(Outcome::Completed),
        }
    }

    fn step(&mut self, pulse: Pulse) {
        self.pins.step(self.line.tick, pulse.axes, pulse.forward);
        count(&mut self.line.position, pulse.axes, pulse.forward);
        self.made += 1;
        self.line.down = self.line.down & !pulse.axes | pulse.axes & !pulse.forward;
        self.judge_lateness(pulse.axes);
        self.moving = true;
        self.look();
    }

    /// On the way to a sensor, with a step due at stream tick `due`: the reason to end without that step.
    /// None if nothing ends it, or if the motors are too fast to stop at once. Then this step is the first of
    /// those in which they brake.
    fn ends_before(&mut self, due: u64, later: &Replay<'_>) -> Option<Outcome> {
        if self.segment.gate.is_none() || !self.moving || self.end.is_some() {
            return None;
        }
        self.look();
        let end = self.end?;
        let interval = due.saturating_sub(self.stepped_at);
        let rates = rates(later, &self.motors.braking_steps_per_tick2);
        self.feed_override.rests_within(interval, &rates).then_some(end)
    }

    fn announce(&mut self, later: &Replay<'_>) {
        self.pins.ahead(self.line.tick, later.pending(), later.forward());
    }

    /// Ends the segment if a motor above its start-stop rate waited for a step twice as long as planned.
    ///
    /// ```text
    ///  planned  |   |   |   |   |        interval i
    ///  real     |   |   |           |    late by more than i: the rotor stopped or swung back
    /// ```
    fn judge_lateness(&mut self, axes: AxisSet) {
        let now = (self.line.tick, self.line.late);
        for (_, last) in self.stepped.iter_mut().enumerate().filter(|(axis, _)| axes >> axis & 1 == 1) {
            let (interval, late) = (now.0 - last.0, now.1 - last.1);
            let turns = self.moving && TICK_HZ as f64 > self.motors.start_stop_hz * interval as f64;
            if turns && late > interval && self.end.is_none() {
                self.end = Some(Outcome::Late { ticks: late });
            }
            *last = now;
        }
    }

    /// True if the next step may come: always, except the first XY step while the contact sensor still
    /// reports the board. That one is delayed from step to step of the axes that rise, as long as any rises.
    async fn released(&mut self, later: &mut Replay<'_>) -> bool {
        while self.plane == Plane::Before {
            let Some(tick) = later.leaves() else { return true };
            self.idle_until(tick).await;
            if self.end.is_some() && !self.moving {
                return true;
            }
            if self.pins.inputs(self.line.tick) & Input::Contact.bit() == 0 {
                self.plane = Plane::Moving;
            } else if let Some(ticks) = later.put_off() {
                self.put_off += ticks;
            } else {
                return false;
            }
        }
        true
    }

    /// Waits for a stream tick. While nothing moves, orders take effect at once.
    async fn idle_until(&mut self, stream_tick: u64) {
        loop {
            let at = self.feed_override.at(stream_tick);
            if self.moving || at <= self.line.tick {
                return self.wait(at).await;
            }
            match self.operator.order() {
                Order::Stop => self.end = self.end.or(Some(Outcome::Stopped)),
                Order::Leave => self.end = self.end.or(Some(Outcome::Left { pulses: self.made })),
                Order::Hold => {
                    self.operator.holds();
                    self.feed_override.wait(SLICE);
                }
                Order::Go | Order::At { .. } => {}
            }
            if self.end.is_some() {
                return;
            }
            // In slices, so that STOP and the inputs are noticed during a long rest.
            self.wait(at.min(self.line.tick + SLICE)).await;
            self.look();
        }
    }

    /// Waits until `at`, and lets the pins switch what is due before.
    async fn wait(&mut self, at: u64) {
        while let Some(due) = self.pins.due().filter(|due| *due < at) {
            self.line.wait(due, self.clock).await;
            self.pins.attend(self.line.tick.max(due));
            // Pins that break law 6 must not cause an endless loop.
            if self.pins.due() == Some(due) {
                break;
            }
        }
        self.line.wait(at, self.clock).await;
    }

    /// Reads the inputs and ends the segment if they require it.
    fn look(&mut self) {
        let inputs = self.pins.inputs(self.line.tick);
        self.operator.passed(self.line.tick, &self.line.position, inputs);
        if self.end.is_some() {
            return;
        }
        if self.segment.stage != Stage::Retract
            && let SpindleState::Lost { trouble } = self.pins.spindle_state()
        {
            // Retracting continues without a spindle: up is the safe direction.
            self.end = Some(Outcome::Spindle { trouble });
            return;
        }
        // While XY moves, any contact means that a tip is in the board.
        let contact = if self.plane == Plane::Moving { Input::Contact.bit() } else { 0 };
        let guard = inputs & (self.guard | contact);
        let goes_down = matches!(self.segment.stage, Stage::Approach | Stage::Drill);
        // With the foot down, the tool goes down only while the sensor confirms it.
        let needed = if goes_down && self.line.foot_down { self.motors.pressed } else { 0 };
        let missing = if self.is_untouched(inputs) { Input::Contact.bit() } else { needed & !inputs };
        let first = |inputs: u32| Input::ALL.into_iter().find(|input| inputs & input.bit() != 0);
        if let Some(hit) = first(guard) {
            self.end = Some(Outcome::Guarded(hit));
        } else if let Some(gone) = first(missing) {
            self.end = Some(Outcome::Missing(gone));
        } else if self.is_early(inputs) {
            self.end = Some(Outcome::Early { at: self.line.position });
        } else if let Some(gate) = self.segment.gate {
            // Compared with planned time, so that a lower feed override doesn't shorten the allowed distance.
            let deadline = u64::from(gate.deadline_us) * (TICK_HZ / 1_000_000);
            if inputs & gate.input.bit() != 0 {
                self.end = Some(Outcome::Gated(self.line.position));
            } else if self.feed_override.passed(self.line.tick) > deadline {
                self.end = Some(Outcome::Unmet(gate));
            }
        }
    }

    /// True if the tip is so low over a hole that it must have touched the board but didn't: it is broken or
    /// missing. The contact may open again inside the hole, so an earlier touch counts.
    fn is_untouched(&mut self, inputs: u32) -> bool {
        let Some([by, _]) = self.touches_within(&[Stage::Drill, Stage::NextHole]) else { return false };
        let (low, was) = (self.lowest() < by, self.touched);
        // A plunge that starts below the surface follows an earlier one, so the touch already happened.
        self.touched = inputs & Input::Contact.bit() != 0 || low && (was || !self.moving);
        low && !self.touched
    }

    /// True if the tip touches something on its way down to a hole, above the board. On the way up a chip may
    /// close the contact.
    fn is_early(&self, inputs: u32) -> bool {
        let ways = [Stage::Approach, Stage::Drill, Stage::NextHole];
        let Some([_, from]) = self.touches_within(&ways) else { return false };
        // Only on the way down: on its way up the tip may still touch.
        let falls = self.line.down & !PLANE != 0;
        falls && inputs & Input::Contact.bit() != 0 && self.lowest() > from
    }

    /// Position of the lowest tip, in steps of Z1. Axes that the machine lacks stay at 0, the top.
    fn lowest(&self) -> i64 {
        let tips = self.line.position.iter().zip(&self.motors.longer).skip(2);
        tips.map(|(axis, longer)| axis - longer).min().unwrap_or_default()
    }

    /// Heights between which the tip must touch the board. None if the stage isn't one of `ways`, the target
    /// isn't a hole, or no sensor checks it.
    fn touches_within(&self, ways: &[Stage]) -> Option<[i64; 2]> {
        let to_hole = ways.contains(&self.segment.stage) && matches!(self.segment.mark, Mark::Hole(_));
        self.motors.touches_within.filter(|_| to_hole)
    }

    /// After a step: sets the rate until the next one. True if motion ended for good.
    async fn paced(&mut self, tick: u64, later: &Replay<'_>) -> bool {
        self.want();
        if self.feed_override.is_full() {
            return false;
        }
        let next = later.clone().next().map(|pulse| pulse.tick - tick);
        self.feed_override.next(tick, next, &rates(later, &self.motors.braking_steps_per_tick2));
        while self.feed_override.at_rest() {
            self.wait(self.feed_override.at(tick)).await;
            self.look();
            match (self.end, self.operator.order()) {
                (Some(_), _) => return true,
                (None, Order::Stop) => self.end = Some(Outcome::Stopped),
                (None, Order::Leave) => self.end = Some(Outcome::Left { pulses: self.made }),
                (None, Order::Hold) => {
                    self.operator.holds();
                    self.feed_override.wait(SLICE);
                }
                (None, Order::Go | Order::At { .. }) => {
                    self.want();
                    self.feed_override.next(tick, next, &rates(later, &self.motors.braking_steps_per_tick2));
                }
            }
        }
        false
    }

    /// Passes the current order to the feed override.
    fn want(&mut self) {
        // Every reason to end brakes first.
        let order = if self.end.is_some() { Order::Stop } else { self.operator.order() };
        self.feed_override.want(match order {
            Order::Go => 1.0,
            Order::At { percent } => f64::from(percent.clamp(SLOWEST, 100)) / 100.0,
            Order::Hold | Order::Leave | Order::Stop => 0.0,
        });
    }
}

fn count(position: &mut Steps, axes: u8, forward: u8) {
    for (axis, place) in position.iter_mut().enumerate() {
        if axes >> axis & 1 == 1 {
            *place += if forward >> axis & 1 == 1 { 1 } else { -1 };
        }
    }
}
