//! The executor's step: one segment played through pins and clock.
//!
//! ```text
//! pulses ──▶ feed override ──▶ wait ──▶ step ──▶ look at the inputs ──▶ next
//!              ▲                              │ gate met, guard hit, deadline passed, Stop
//!              └──────────── brake ◀──────────┘
//! ```
//!
//! On the way to a sensor the inputs are looked at once more before every step: a motor needs time for a step, so what it brought about
//! shows only when the next one is due. That one is not made where the motors may stand without it.
//!
//! Where plane and spindles move together, the plane leaves when the plan predicts that the bit is clear of the board. Where a
//! contact sensor still reports the board then, the plane waits for its edge while the spindles go on up, and what follows comes as
//! much later; if it reports it with the spindles all the way up, the segment ends there. An edge that comes early changes
//! nothing: it tells that the tip is out of the board, not that it is clear of it.
//!
//! Where the clock waits by itself this is a function that returns at the end ([`play`]). Where it is told the time, it is played
//! by turns ([`play_by_turns`]): it gives way whenever the next step is not due.
//!
//! Comes in: a segment. Goes out: calls on [`Pins`], and an [`Outcome`]. Every end is at rest and every step is counted.
//! Does not know who computed the segment, nor what it is for.

use super::feed_override::{FeedOverride, rates};
use super::{AxisSet, Clock, Pins, SpindleState, SpindleTrouble};
use crate::job::{Gate, Input, Mark, Otherwise, Stage};
use crate::machine::{DriveKind, Machine, Output};
use crate::steps::{AXES, Pulse, Replay, Segment, Steps, Switching, TICK_HZ, replay};
use crate::units::Length;
use std::future::{Future, poll_fn};
use std::pin::pin;
use std::task::{Context, Poll, Waker};

/// Axes of the plane.
const PLANE: AxisSet = 0b11;

/// The least feed override that can be ordered, percent.
const SLOWEST: u8 = 10;

/// Longest piece of waiting between two looks at the orders, in ticks: 5 ms.
const SLICE: u64 = TICK_HZ / 200;

/// What the executor is to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Go on as planned.
    Go,
    /// Go on at this many percent of the planned feed, 10 … 100.
    At {
        /// Of the planned feed, 10 … 100.
        percent: u8,
    },
    /// Come to rest on the path and wait there.
    Hold,
    /// Come to rest on the path and end.
    Stop,
}

/// Where orders come from and the latest position goes. Both are called between pulses and must not block.
pub trait Operator {
    /// The order now.
    fn order(&mut self) -> Order;
    /// Where things are.
    fn passed(&mut self, tick: u64, position: &Steps, inputs: u32);
}

/// What the motors can do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motors {
    /// How hard each axis may brake, in steps per tick².
    pub braking_steps_per_tick2: [f64; AXES],
    /// The step rate up to which a motor follows whenever the next pulse comes, in Hz. Infinite where the pins go by stream
    /// time and not by life.
    pub start_stop_hz: f64,
    /// The output of the presser foot, by its place, where there is one.
    pub foot: Option<u8>,
    /// Inputs that must be on while the bit goes down behind a foot that was put down, one bit each.
    pub pressed: u32,
    /// Machine steps of Z between which a tip that comes down over a hole must touch the board, the lowest first; none where that is
    /// not looked at.
    pub touches_within: Option<[i64; 2]>,
    /// How much longer the bit of each axis is than that of Z1, in steps.
    pub longer: Steps,
}

impl Motors {
    /// From the machine's accelerations; of table-driven axes from the distance in which their table brakes from its top
    /// speed.
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

/// How hard the table of dynamics brakes from its top speed, in steps per second².
fn table_braking(machine: &Machine) -> f64 {
    let (period, leave) = (machine.dynamics.period.last(), machine.dynamics.leave.last());
    let hz = f64::from(machine.interrupt_hz) / f64::from(period.copied().unwrap_or(1).max(1));
    0.5 * hz * hz / f64::from(leave.copied().unwrap_or(1).max(1))
}

/// What the executor remembers from segment to segment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Playhead {
    /// Steps counted, machine coordinates.
    pub position: Steps,
    /// Stream time. It never goes back, and stands still between segments.
    pub tick: u64,
    /// How much later than stream time it is. Late is never caught up.
    pub late: u64,
    /// Axes whose latest step counted down: where such an axis has play, its table stands that much above its count.
    pub down: AxisSet,
    /// The presser foot was put down.
    pub foot_down: bool,
}

/// How a segment ended. Always at rest, with [`Playhead::position`] exact.
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
    /// A sensor that must be on is off.
    Missing(Input),
    /// The tip touched something on its way down to a hole, higher than the board can be; braking took it a little further.
    Early {
        /// Where it touched.
        at: Steps,
    },
    /// A step came later than its motor could wait for, by so many ticks: steps may be lost.
    Late {
        /// How late.
        ticks: u64,
    },
    /// The spindle was to turn, and does not any more, or nobody knows.
    Spindle {
        /// Why.
        trouble: SpindleTrouble,
    },
    /// As ordered.
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

/// Sensors that must stay off all through a segment: those in the direction of motion; the presser foot where X or Y moves; and
/// the cover, wherever it is not a move by hand, homing, or the way up.
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
    guard & !segment.gate.map_or(0, |gate| gate.input.bit())
}

/// Lets whoever polls go on with something else; the next time it is polled, it goes on.
pub fn give_way() -> impl Future<Output = ()> {
    let mut gave = false;
    poll_fn(move |_| if std::mem::replace(&mut gave, true) { Poll::Ready(()) } else { Poll::Pending })
}

/// What comes of `work`, polled until it is done: for what waits by itself and gives way to nobody.
pub fn through<T>(work: impl Future<Output = T>) -> T {
    let (mut work, mut context) = (pin!(work), Context::from_waker(Waker::noop()));
    loop {
        if let Poll::Ready(done) = work.as_mut().poll(&mut context) {
            return done;
        }
    }
}

/// Plays `segment` to its end, or to rest where something ended it early, with a clock that waits by itself.
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

/// The same by turns: gives way as long as `clock` does not grant the next tick. Polled again, it goes on where it was.
pub async fn play_by_turns(
    segment: &Segment,
    motors: &Motors,
    line: &mut Playhead,
    pins: &mut dyn Pins,
    clock: &mut dyn Clock,
    operator: &mut dyn Operator,
) -> Outcome {
    let start = line.tick;
    let (guard, feed_override) = (guard(segment), FeedOverride::new(start));
    let play = Play {
        segment,
        motors,
        guard,
        feed_override,
        moving: false,
        stepped: [(start, 0); AXES],
        stepped_at: 0,
        // Milling is meant to move in the board, and an edge is touched and left again.
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

/// Where the plane is in its part of the segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Plane {
    Before,
    Moving,
    Done,
}

/// A segment in play.
struct Play<'a> {
    segment: &'a Segment,
    motors: &'a Motors,
    guard: u32,
    feed_override: FeedOverride,
    /// Whether a step was made since it last was at rest.
    moving: bool,
    /// Of every axis: when it stepped last, and how late it was by then.
    stepped: [(u64, u64); AXES],
    /// Tick of the segment at which anything did.
    stepped_at: u64,
    plane: Plane,
    /// So many ticks later than planned it left, because a tip was still in the board.
    put_off: u64,
    /// The tip touched the board since it was above the place by which it must.
    touched: bool,
    /// Why it comes to rest early.
    end: Option<Outcome>,
    line: &'a mut Playhead,
    pins: &'a mut dyn Pins,
    clock: &'a mut dyn Clock,
    operator: &'a mut dyn Operator,
}

impl Play<'_> {
    async fn run(mut self) -> Outcome {
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
        self.look();
        let mut pulses = replay(self.segment);
        self.announce(&pulses);
        loop {
            if !self.released(&mut pulses).await {
                return Outcome::Guarded(Input::Contact);
            }
            let Some(pulse) = pulses.next() else { break };
            self.idle_until(pulse.tick).await;
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
        match (self.end, self.segment.gate) {
            (Some(Outcome::Stopped) | None, Some(gate)) if gate.otherwise == Otherwise::Alarm => {
                Outcome::Unmet(gate)
            }
            (Some(Outcome::Stopped), _) if !self.segment.runs.is_empty() => Outcome::Completed,
            (end, _) => end.unwrap_or(Outcome::Completed),
        }
    }

    fn step(&mut self, pulse: Pulse) {
        self.pins.step(self.line.tick, pulse.axes, pulse.forward);
        count(&mut self.line.position, pulse.axes, pulse.forward);
        self.line.down = self.line.down & !pulse.axes | pulse.axes & !pulse.forward;
        self.judge_lateness(pulse.axes);
        self.moving = true;
        self.look();
    }

    /// On the way to a sensor, when a step is due at tick `due` of the segment: what ends it without that step. None where nothing does, or
    /// where the motors are too fast to stand: then the step is made, as the first of those in which they brake.
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

    /// Tells the pins which steps come next.
    fn announce(&mut self, later: &Replay<'_>) {
        self.pins.ahead(self.line.tick, later.pending(), later.forward());
    }

    /// A motor that turns faster than it could start must not wait for a step twice as long as planned.
    ///
    /// ```text
    ///  planned  |   |   |   |   |        interval i
    ///  life     |   |   |           |    late by more than i: the rotor came to rest between two steps, or swung back
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

    /// Whether the next step may come: always, but for the first of the plane while the contact still reports the board. That one is
    /// put off from step to step of what goes up, as long as anything does.
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

    /// Waits for a stream tick. While nothing moves, orders are obeyed at once.
    async fn idle_until(&mut self, stream_tick: u64) {
        loop {
            let at = self.feed_override.at(stream_tick);
            if self.moving || at <= self.line.tick {
                return self.wait(at).await;
            }
            match self.operator.order() {
                Order::Stop => self.end = self.end.or(Some(Outcome::Stopped)),
                Order::Hold => self.feed_override.wait(SLICE),
                Order::Go | Order::At { .. } => {}
            }
            if self.end.is_some() {
                return;
            }
            self.wait(at.min(self.line.tick + SLICE)).await;
            self.look();
        }
    }

    /// Waits until `at`. What the pins have to switch meanwhile is switched in time.
    async fn wait(&mut self, at: u64) {
        while let Some(due) = self.pins.due().filter(|due| *due < at) {
            self.line.wait(due, self.clock).await;
            self.pins.attend(self.line.tick.max(due));
            if self.pins.due() == Some(due) {
                break;
            }
        }
        self.line.wait(at, self.clock).await;
    }

    /// Looks at the inputs: is this where it ends?
    fn look(&mut self) {
        let inputs = self.pins.inputs(self.line.tick);
        self.operator.passed(self.line.tick, &self.line.position, inputs);
        if self.end.is_some() {
            return;
        }
        if self.segment.stage != Stage::Retract
            && let SpindleState::Lost { trouble } = self.pins.spindle_state()
        {
            // What lifts the bit goes on: there it is safe.
            self.end = Some(Outcome::Spindle { trouble });
            return;
        }
        let contact = if self.plane == Plane::Moving { Input::Contact.bit() } else { 0 };
        let guard = inputs & (self.guard | contact);
        let goes_down = matches!(self.segment.stage, Stage::Approach | Stage::Drill);
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
            // Planned time: a lower feed override leaves a stroke as many steps as it had.
            let deadline = u64::from(gate.deadline_us) * (TICK_HZ / 1_000_000);
            if inputs & gate.input.bit() != 0 {
                self.end = Some(Outcome::Gated(self.line.position));
            } else if self.feed_override.passed(self.line.tick) > deadline {
                self.end = Some(Outcome::Unmet(gate));
            }
        }
    }

    /// Whether the tip is so far down over a hole that it must have touched the board, and did not: it is broken, or not there. What is
    /// in the hole already may lose the contact.
    fn is_untouched(&mut self, inputs: u32) -> bool {
        let Some([by, _]) = self.touches_within(&[Stage::Drill, Stage::NextHole]) else { return false };
        let (low, was) = (self.lowest() < by, self.touched);
        self.touched = inputs & Input::Contact.bit() != 0 || low && (was || !self.moving);
        low && !self.touched
    }

    /// Whether the tip goes down to a hole and touches something where the board cannot be yet. On its way up it may carry a chip.
    fn is_early(&self, inputs: u32) -> bool {
        let ways = [Stage::Approach, Stage::Drill, Stage::NextHole];
        let Some([_, from]) = self.touches_within(&ways) else { return false };
        let falls = self.line.down & !PLANE != 0;
        falls && inputs & Input::Contact.bit() != 0 && self.lowest() > from
    }

    /// Where the lowest tip is, in steps of Z1; axes that are not there stand at 0, on top.
    fn lowest(&self) -> i64 {
        let tips = self.line.position.iter().zip(&self.motors.longer).skip(2);
        tips.map(|(axis, longer)| axis - longer).min().unwrap_or_default()
    }

    /// Between which heights the tip touches the board, where this is one of the `ways` to a hole and somebody looks.
    fn touches_within(&self, ways: &[Stage]) -> Option<[i64; 2]> {
        let to_hole = ways.contains(&self.segment.stage) && matches!(self.segment.mark, Mark::Hole(_));
        self.motors.touches_within.filter(|_| to_hole)
    }

    /// After a step: sets the rate to the next one. True when it came to rest for good.
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
                (None, Order::Hold) => self.feed_override.wait(SLICE),
                (None, Order::Go | Order::At { .. }) => {
                    self.want();
                    self.feed_override.next(tick, next, &rates(later, &self.motors.braking_steps_per_tick2));
                }
            }
        }
        false
    }

    /// Tells the feed override what is ordered.
    fn want(&mut self) {
        let order = if self.end.is_some() { Order::Stop } else { self.operator.order() };
        self.feed_override.want(match order {
            Order::Go => 1.0,
            Order::At { percent } => f64::from(percent.clamp(SLOWEST, 100)) / 100.0,
            Order::Hold | Order::Stop => 0.0,
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
