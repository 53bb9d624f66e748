//! What each moving action means in segments, and what the executor's report of it means in events.
//!
//! ```text
//! leg   [ travel ][ dwell ][ approach ][ drill, gate ]│[ retract ]       a gate that ended a segment early parts the leg:
//!       ───────────── task 17 ───────────────────────▶│ ── task 18 ──▶   what follows is planned anew from where it rests
//! ```
//!
//! Comes in: actions and reports. Goes out: tasks and events. Does not know asks.

use super::Owner;
use crate::executor::{Ended, Report, Task};
use crate::journal::{Record, Ruler};
use annulus_core::control::{Event, State, Trust, lateness};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::{Input, Mark, Otherwise};
use annulus_core::machine::{Machine, ScaleUnit, Steps, ToolChange};
use annulus_core::motion::{Timeline, cycles};
use annulus_core::queue::{Harm, Homing, early, guarded, late, missing};
use annulus_core::steps::{self, Segment, Stage, Switching, TICK_HZ};
use annulus_core::units::{Length, NM_PER_INCH, NM_PER_MM};
use annulus_core::wire::Tell;

/// What the executor has in hand.
#[derive(Debug, PartialEq)]
pub(crate) enum Doing {
    /// Nothing.
    Nothing,
    /// One stage of homing.
    Homing(Homing),
    /// A move by hand.
    Jog,
    /// To where the head is parked.
    Park,
    /// To where the job starts, or the spindle on again.
    Approach,
    /// Some segments of the leg in work.
    Leg,
    /// Some segments of a row of the queue.
    Queue,
    /// A move of what is being touched.
    Touch,
    /// A step of a change of tools.
    Change,
    /// The clamp by hand: nothing moves but that.
    Clamp {
        /// It opens, else it closes.
        opens: bool,
    },
    /// Up from the bottom of a hole, because the next one does not follow at once.
    Lift {
        /// That leg drilled a hole or milled a toolpath.
        cut: bool,
        /// It was the last one.
        last: bool,
    },
    /// Tip up, spindle off, because the tool is worn.
    ToChange,
    /// Tip up, spindle off.
    Safe,
}

/// A pause with an effect.
pub(crate) fn rest(stage: Stage, effect: Switching, duration_ticks: u64, end: Steps) -> Segment {
    Segment { leg: 0, mark: Mark::Prepare, stage, duration_ticks, runs: Vec::new(), effect, gate: None, end }
}

pub(crate) fn segments(timeline: &Timeline, machine: &Machine) -> Vec<Segment> {
    timeline.moves.iter().map(|planned| steps::segment(planned, machine)).collect()
}

/// The first step of `axis` at which its home sensor is on.
fn home_edge(machine: &Machine, axis: usize) -> i64 {
    cycles::home_edge(machine, axis)
}

/// What the steps of X and Y are counted by.
pub(crate) fn ruler(machine: &Machine) -> Ruler {
    let scale = |axis: usize| machine.axis(axis).scale;
    let per_nm = |axis: usize| match scale(axis).per {
        ScaleUnit::Millimetre => NM_PER_MM,
        ScaleUnit::Inch => NM_PER_INCH,
    };
    Ruler {
        scale: [0, 1].map(|axis| {
            let own = scale(axis);
            (own.micro_steps * i64::from(own.gear_up), per_nm(axis) * i64::from(own.gear_down))
        }),
        home_edge: [0, 1].map(|axis| home_edge(machine, axis)),
    }
}

fn alarm(code: &str) -> Diagnostic {
    Diagnostic::error(code)
}

fn name(input: Input) -> String {
    format!("{input:?}")
}

fn letter(axis: usize) -> &'static str {
    ["X", "Y", "Z"].get(axis).copied().unwrap_or("Z")
}

impl Owner {
    /// Gives the executor something to do.
    pub(crate) fn give(&mut self, doing: Doing, segments: Vec<Segment>) {
        self.task += 1;
        if self.executor.is_gone() {
            // Nobody will report: what was to be made safe is out of reach, and nothing else can begin.
            let dead = Event::Failed { alarm: alarm("output.executor_gone"), left: Trust::Lost };
            self.pending.push_back(if doing == Doing::Safe { Event::Safe } else { dead });
            return;
        }
        let segments = self.with_foot_up(&doing, segments);
        self.foot.given(&segments);
        self.doing = doing;
        let needs_durable = self.work.as_ref().map_or(0, |work| work.progress().done);
        // While the clamp moves nobody but the owner lifts the head.
        let may_lift = self.session.trust == Trust::Trusted && self.clamp_wait_ticks() == 0;
        let lift_to = may_lift.then(|| self.top());
        let follows = self.doing == Doing::Leg && self.goes_on_low();
        let granted = self.doing == Doing::Jog;
        if granted {
            self.executor.shared.grant();
        }
        let surface_steps = self.machine.z.scale.steps(self.machine.process.surface);
        let board_steps = if self.doing == Doing::Leg { self.board_of_leg() } else { 0 };
        let id = self.task;
        self.executor.give(Task {
            id,
            segments,
            follows,
            surface_steps,
            board_steps,
            needs_durable,
            lift_to,
            granted,
        });
    }

    /// How many steps of Z the board lies higher than flat at the hole of the leg in work.
    fn board_of_leg(&self) -> i64 {
        self.work.as_ref().map_or(0, |work| work.job.board_steps(&self.machine, work.leg))
    }

    /// Whether what is given ends with the tip in the board, and more is given as soon as it is reported. What waits for a
    /// person has no clock.
    fn goes_on_low(&self) -> bool {
        let Some(work) = &self.work else { return false };
        match work.next() {
            Some(behind_gate) => !matches!(behind_gate.effect, Switching::AwaitBit { .. }),
            None => work.job.begins_low(work.leg + 1),
        }
    }

    /// `segments`, where this computer can step them in time.
    pub(crate) fn in_time(&self, segments: Vec<Segment>) -> Result<Vec<Segment>, Diagnostic> {
        let safe_hz = self.timing.as_ref().map(|timing| timing.safe_hz);
        match safe_hz.and_then(|safe_hz| lateness::too_fast(&segments, safe_hz)) {
            Some(why) => Err(why),
            None => Ok(segments),
        }
    }

    pub(crate) fn jog(&mut self, axis: usize, steps: i64) -> Result<(), Diagnostic> {
        let speed = self.machine.axis(axis).home_speed_mm_per_s;
        let timeline = cycles::jog(&self.machine, self.position, axis, steps, speed)?;
        let segments = self.in_time(segments(&timeline, &self.machine))?;
        self.give(Doing::Jog, segments);
        Ok(())
    }

    /// The way of a jog in steps: inside the travel where the position is known, with the tip up where XY moves, else no
    /// longer than the travel.
    pub(crate) fn jog_steps(&self, axis: u8, distance_um: i32) -> Result<i64, Diagnostic> {
        let index = usize::from(axis);
        if index > 2 || distance_um == 0 {
            return Err(alarm("control.no_such_jog"));
        }
        let settings = self.machine.axis(index);
        let way = settings.scale.steps(Length::from_um(i64::from(distance_um)));
        let (low, high) = (settings.scale.steps(settings.min), settings.scale.steps(settings.max));
        if self.session.trust != Trust::Trusted {
            return Ok(way.clamp(low - high, high - low));
        }
        let process = &self.machine.process;
        if index < 2
            && self.machine.lowest(&self.position)
                < self.machine.z.scale.steps(process.surface + process.safe_height)
        {
            return Err(alarm("control.tip_low"));
        }
        // Spindles go together, wherever each of them stands.
        let room = |axis: usize| (self.position[axis] + way).clamp(low, high) - self.position[axis];
        match cycles::together(&self.machine, index).map(room).min_by_key(|room| room.abs()) {
            None | Some(0) => Err(alarm("control.end_of_travel").with("axis", letter(index))),
            Some(clamped) => Ok(clamped),
        }
    }

    pub(crate) fn approach(&mut self) -> Result<(), Diagnostic> {
        let Some(work) = &self.work else { return Ok(()) };
        let to = work.job.start_of_leg(work.leg);
        let (bit, asks) = (work.bit.unwrap_or(0), work.confirm_bit);
        if !asks {
            self.put_in(bit, false);
        }
        let Some(work) = &self.work else { return Ok(()) };
        let beside = work.job.before_start(&self.machine, work.leg);
        let there = cycles::go_to(&self.machine, self.position, beside)?;
        let on = cycles::go_to(&self.machine, beside, to)?;
        let moves = [there, on].iter().flat_map(|way| segments(way, &self.machine)).collect();
        let mut segments = self.in_time(moves)?;
        if !work.confirm_bit {
            segments.extend(self.spindle_up());
        }
        self.give(Doing::Approach, segments);
        Ok(())
    }

    /// The spindle as it has to turn before the next segment, with time to get there.
    pub(crate) fn spindle_up(&self) -> Vec<Segment> {
        let Some(work) = &self.work else { return Vec::new() };
        let rpm = work.rpm();
        let ticks = (self.machine.process.spin_up_ms * 1e-3 * TICK_HZ as f64) as u64;
        let on = rest(Stage::Dwell, Switching::Spindle { rpm }, ticks, self.position);
        if rpm == 0 { Vec::new() } else { vec![on] }
    }

    pub(crate) fn spindle_on(&mut self) {
        // Who is asked for a tool next is not shown one that turns.
        let segments = if self.wants_new_tool() { Vec::new() } else { self.spindle_up() };
        self.give(Doing::Approach, segments);
    }

    /// Runs the leg in work up to its end, or up to where a bit is wanted.
    pub(crate) fn leg(&mut self, mut segments: Vec<Segment>) {
        let unattended = self.machine.tool_change == ToolChange::Unattended;
        if self.asks_for_new_tool() {
            return;
        }
        let Some(work) = &mut self.work else { return };
        let mut put_in = None;
        let starts = work.given == 0;
        if starts && work.take_over() {
            self.executor.shared.set_feed_override(work.slower());
        }
        let up = self.machine.lowest(&self.position) >= work.job.zero[2];
        if starts && up && work.job.begins_low(work.leg) {
            match work.job.entry(&self.machine, work.leg) {
                Ok(leg) => segments.extend(leg),
                Err(why) => {
                    return self.fails(why, self.session.trust);
                }
            }
            work.given = work.segments.len();
        }
        while let Some(segment) = work.segments.get(work.given) {
            if let Switching::AwaitBit { bit } = segment.effect {
                if !unattended {
                    break;
                }
                work.bit = Some(bit);
                work.given += 1;
                put_in = Some(bit);
                continue;
            }
            let gated = segment.gate.is_some();
            segments.push(segment.clone());
            work.given += 1;
            if gated {
                break;
            }
        }
        if let Some(bit) = put_in {
            self.put_in(bit, true);
        }
        if segments.is_empty() { self.leg_ended() } else { self.give(Doing::Leg, segments) }
    }

    /// All segments given are played: the leg is done, waits for a bit, or goes on behind a gate.
    fn leg_ended(&mut self) {
        self.doing = Doing::Nothing;
        let Some(work) = &mut self.work else { return };
        if work.next().is_some() {
            let waits = work.awaited().is_some();
            let wanted = self.bit_wanted();
            return if waits { self.pending.push_back(wanted) } else { self.leg(Vec::new()) };
        }
        let leg = work.leg;
        let wear = self.count_wear(leg);
        let Some(work) = &mut self.work else { return };
        let mark = work.job.program.legs.get(work.leg).map(|leg| leg.mark);
        let (hole, way) = (matches!(mark, Some(Mark::Hole(_))), matches!(mark, Some(Mark::Toolpath(_))));
        let stop = work.stop.take().map(|at| (u32::try_from(work.leg).unwrap_or(u32::MAX), at));
        work.holes += u32::from(hole);
        work.toolpaths += u32::from(way);
        work.leg += 1;
        work.unpack();
        if let Some((leg, at)) = stop {
            let height_um = self.machine.z.scale.length(at[2] - work.job.zero[2]).nm() as f64 / 1e3;
            self.outside.tell(Tell::Touched { leg, height_um });
        }
        let last = work.leg >= work.job.stream.legs();
        self.outside.record(Record::Advance { progress: work.progress(), wear, stop });
        // A hole of a chain ends at its bottom. When the next one is not to follow at once, the bit comes out first.
        if self.session.state == State::Pausing && work.job.begins_low(work.leg) {
            match work.job.lift(&self.machine, work.leg - 1) {
                Ok(lift) => return self.give(Doing::Lift { cut: hole || way, last }, lift),
                Err(why) => {
                    return self.fails(why, self.session.trust);
                }
            }
        }
        self.pending.push_back(Event::LegDone { cut: hole || way, last });
    }

    /// A sensor ended a stroke early: what follows in the leg starts from there.
    fn rejoin(&mut self) -> Result<(), Diagnostic> {
        let Some(work) = &mut self.work else { return Ok(()) };
        let zero = work.job.zero;
        let mut before = Vec::new();
        while let Some(segment) = work.segments.get(work.given) {
            work.given += 1;
            if segment.runs.is_empty() {
                before.push(segment.clone());
                continue;
            }
            let from = std::array::from_fn(|axis| self.position[axis] - zero[axis]);
            let timeline = cycles::rejoin(&self.machine, segment.stage, from, segment.end)?;
            let (leg, mark) = (segment.leg, segment.mark);
            let fresh = segments(&timeline, &self.machine).into_iter();
            before.extend(fresh.map(|planned| Segment { leg, mark, ..planned }));
            break;
        }
        self.leg(before);
        Ok(())
    }

    /// Machine steps of Z with the tip all the way up.
    fn top(&self) -> i64 {
        cycles::top(&self.machine)
    }

    pub(crate) fn make_safe(&mut self, lift: bool) {
        let segments = self.up_and_off(lift);
        self.give(Doing::Safe, segments);
    }

    /// All the way up, where it may be lifted, and the spindle off.
    pub(super) fn up_and_off(&mut self, lift: bool) -> Vec<Segment> {
        let top = self.top();
        let mut segments_up = Vec::new();
        let clamp_ticks = self.clamp_wait_ticks();
        if clamp_ticks > 0 {
            segments_up.push(rest(Stage::Dwell, Switching::None, clamp_ticks, self.position));
        }
        if lift && self.machine.lowest(&self.position) < top {
            match cycles::retract(&self.machine, self.position, top) {
                Ok(timeline) => segments_up.extend(segments(&timeline, &self.machine)),
                Err(why) => self.fails(why, self.session.trust),
            }
        }
        if self.machine.foot.on {
            segments_up.push(self.foot_up(self.position));
        }
        segments_up.push(rest(Stage::Dwell, Switching::Spindle { rpm: 0 }, 0, self.position));
        segments_up
    }

    /// Where it rests, and how the inputs and the foot are there.
    fn rests_at(&mut self, report: &Report) {
        (self.position, self.down, self.tools.inputs) = (report.position, report.down, report.inputs);
        self.foot.played(report.ended);
    }

    /// The tip touched something at this place, higher than the board can lie there.
    fn touched_early(&mut self, doing: &Doing, at: &Steps) {
        let board_steps = if *doing == Doing::Leg { self.board_of_leg() } else { 0 };
        self.fails(early(&self.machine, at, board_steps), self.session.trust);
    }

    /// What a report means.
    pub(crate) fn reported(&mut self, report: &Report) {
        if report.id != self.task {
            return;
        }
        self.rests_at(report);
        let doing = std::mem::replace(&mut self.doing, Doing::Nothing);
        let stopping = self.session.state == State::Stopping;
        match (doing, report.ended) {
            // Whoever stopped it is told so.
            (doing, Ended::RanDry) if !stopping => {
                let why = alarm("adapter.ran_dry");
                if doing == Doing::Queue {
                    return self.queue_ran_dry(why);
                }
                self.fails(why, self.session.trust);
            }
            (Doing::Queue, _) => self.queue_reported(report),
            (Doing::Clamp { opens }, _) => self.clamp_moved(opens),
            (Doing::ToChange, Ended::Completed) => self.pending.push_back(Event::BitWanted),
            (Doing::Safe, Ended::Completed) => {
                self.settle_stock();
                self.pending.push_back(Event::Safe);
            }
            (Doing::Change, Ended::Completed) => {
                if let Err(why) = self.change_reported(report) {
                    self.fails(why, self.session.trust);
                }
            }
            (Doing::Lift { cut, last }, Ended::Completed) => {
                self.pending.push_back(Event::LegDone { cut, last });
            }
            // Whoever stopped it is told so, whatever was late besides.
            (_, Ended::Starved) if stopping => self.pending.push_back(Event::Rested),
            // The hand that moved it let go, or is gone: it rests on its way.
            (Doing::Jog, Ended::Stopped) if !stopping => self.pending.push_back(Event::Arrived),
            (_, Ended::Stopped | Ended::RanDry) => self.pending.push_back(Event::Rested),
            (_, Ended::Starved) => self.fails(alarm("control.starved"), self.session.trust),
            (Doing::Touch, ended) if ended.is_of_touch() => self.touched(ended, report.inputs),
            (Doing::Homing(homing), _) => self.homed(homing, report),
            // Every step is counted: what is wrong is the spindle alone.
            (_, Ended::Spindle { trouble }) => self.fails(trouble.diagnostic(), self.session.trust),
            (_, Ended::Late { ticks }) => self.fails(late(ticks), Trust::Suspect),
            (_, Ended::Guarded(input)) => {
                let (why, harm) = guarded(input);
                self.fails(why, if harm == Harm::None { self.session.trust } else { Trust::Suspect });
            }
            (_, Ended::Missing(input)) => self.fails(missing(input), self.session.trust),
            (doing, Ended::Early { at }) => self.touched_early(&doing, &at),
            (Doing::Leg, Ended::Unmet(gate)) if gate.input == Input::Contact => self.nothing_touched(),
            (Doing::Leg, Ended::Unmet(gate)) if gate.otherwise == Otherwise::Alarm => {
                let us = f64::from(gate.deadline_us);
                let why = alarm("control.drilling_too_long").with("sensor", name(gate.input));
                self.fails(why.with("seconds", us / 1e6), self.session.trust);
            }
            (Doing::Leg, Ended::Gated(_) | Ended::Unmet(_)) => self.gated(report.ended, stopping),
            (Doing::Leg, Ended::Completed) => {
                let more = self.work.as_ref().is_some_and(|work| work.next().is_some());
                if stopping && more { self.pending.push_back(Event::Rested) } else { self.leg_ended() }
            }
            (Doing::Approach, Ended::Completed) => {
                let asks = self.work.as_ref().is_some_and(|work| work.confirm_bit);
                let unattended = self.machine.tool_change == ToolChange::Unattended;
                if asks && unattended && !stopping {
                    return self.rest_of_leg();
                }
                self.pending.push_back(if asks { self.bit_wanted() } else { Event::Arrived });
            }
            (_, _) => self.pending.push_back(Event::Arrived),
        }
    }

    /// A stroke ended on its sensor, or without it: what is left of the leg follows.
    fn gated(&mut self, ended: Ended, is_stopping: bool) {
        if let (Ended::Gated(at), Some(work)) = (ended, &mut self.work) {
            work.stop = Some(at);
        }
        if is_stopping {
            return self.pending.push_back(Event::Rested);
        }
        if let Err(why) = self.rejoin() {
            self.fails(why, self.session.trust);
        }
    }

    /// The tip went down to the board, and there was none.
    fn nothing_touched(&mut self) {
        let Some(work) = &self.work else { return };
        let mm = |axis: usize| {
            let steps = self.position[axis] - work.job.zero[axis];
            format!("{:.3}", self.machine.axis(axis).scale.length(steps).mm())
        };
        let below = format!("{:.3}", -self.machine.z.scale.length(self.position[2] - work.job.zero[2]).mm());
        let why = alarm("level.no_board").with("x", mm(0)).with("y", mm(1)).with("mm", below);
        self.fails(why, self.session.trust);
    }

    /// What is done fails: the alarm that tells of it, and what the position is worth afterwards.
    pub(super) fn fails(&mut self, alarm: Diagnostic, left: Trust) {
        self.pending.push_back(Event::Failed { alarm, left });
    }
}
