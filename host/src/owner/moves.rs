//! Turns the session's motion actions into segments, and executor reports into session events.
//!
//! ```text
//! leg   [ travel ][ dwell ][ approach ][ drill, gate ]│[ retract ]       a gate that ends a segment splits the leg:
//!       ───────────── task 17 ───────────────────────▶│ ── task 18 ──▶   the rest is planned again from there
//! ```

use super::Owner;
use crate::executor::{Ended, Report, Task};
use crate::journal::{Record, Ruler};
use annulus_core::control::{Event, State, Trust, lateness};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::job::{Input, Mark, Otherwise};
use annulus_core::machine::{Machine, ScaleUnit, Steps, ToolChange};
use annulus_core::motion::{Timeline, cycles};
use annulus_core::queue::{Harm, Homing, early, guarded, late, missing};
use annulus_core::steps::{self, Segment, Stage, Switching, TICK_HZ};
use annulus_core::units::{Length, NM_PER_INCH, NM_PER_MM};
use annulus_core::wire::Tell;

#[derive(Debug, PartialEq)]
pub(crate) enum Doing {
    Nothing,
    Homing(Homing),
    Jog,
    Park,
    /// To the start of the job, or starting the spindle again.
    Approach,
    Leg,
    Queue,
    Touch,
    Change,
    /// The clamp, on request of the user; no axis moves.
    Clamp {
        opens: bool,
    },
    /// Lifting the tool from the bottom of a hole, because the next leg does not follow at once.
    Lift {
        /// The completed leg drilled a hole or milled a toolpath.
        cut: bool,
        last: bool,
    },
    /// Tool up and spindle off, because the tool is worn.
    ToChange,
    Safe,
}

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

fn letter(axis: usize) -> &'static str {
    ["X", "Y", "Z"].get(axis).copied().unwrap_or("Z")
}

impl Owner {
    pub(crate) fn give(&mut self, doing: Doing, segments: Vec<Segment>) {
        self.task += 1;
        if self.executor.is_gone() {
            // A dead executor never reports: what it should make safe is out of reach, and no other action
            // can start.
            let dead = Event::Failed { alarm: error!("output.executor_gone"), left: Trust::Lost };
            self.pending.push_back(if doing == Doing::Safe { Event::Safe } else { dead });
            return;
        }
        let segments = self.with_foot_up(&doing, segments);
        self.foot.given(&segments);
        self.doing = doing;
        let needs_durable = self.work.as_ref().map_or(0, |work| work.progress().done);
        // While the clamp moves, the executor must not lift the head on its own.
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
        self.hold_if_pausing();
    }

    /// Height of the board at the current leg's hole above flat, in steps of Z.
    fn board_of_leg(&self) -> i64 {
        self.work.as_ref().map_or(0, |work| work.job.board_steps(&self.machine, work.leg))
    }

    /// Returns `true` if the task ends with the tool in the board and the next task follows at once.
    /// Waiting for the user takes unlimited time, so it does not count.
    fn goes_on_low(&self) -> bool {
        let Some(work) = &self.work else { return false };
        match work.next() {
            Some(behind_gate) => !matches!(behind_gate.effect, Switching::AwaitBit { .. }),
            None => work.job.begins_low(work.leg + 1),
        }
    }

    /// Returns `segments`, if this computer can step them in time.
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

    /// Length of a jog in steps: within the travel if the position is trusted, at most the whole travel if
    /// not.
    pub(crate) fn jog_steps(&self, axis: u8, distance_um: i32) -> Result<i64, Diagnostic> {
        let index = usize::from(axis);
        if index > 2 || distance_um == 0 {
            return Err(error!("control.no_such_jog"));
        }
        let settings = self.machine.axis(index);
        let way = settings.scale.steps(Length::from_um(i64::from(distance_um)));
        let (low, high) = (settings.scale.steps(settings.min), settings.scale.steps(settings.max));
        if self.session.trust != Trust::Trusted {
            return Ok(way.clamp(low - high, high - low));
        }
        // Spindles move together: the least room of all limits the jog.
        let room = |axis: usize| (self.position[axis] + way).clamp(low, high) - self.position[axis];
        match cycles::together(&self.machine, index).map(room).min_by_key(|room| room.abs()) {
            None | Some(0) => Err(error!("control.end_of_travel", axis = letter(index))),
            Some(clamped) => Ok(clamped),
        }
    }

    /// To the start of the job; first to the change position, if the user must insert a tool.
    pub(crate) fn approach(&mut self) -> Result<(), Diagnostic> {
        if let Some((bit, turns)) = self.asked_first() {
            return self.change_first(bit, turns);
        }
        let Some(work) = &self.work else { return Ok(()) };
        let to = work.job.start_of_leg(work.leg);
        let beside = work.job.before_start(&self.machine, work.leg);
        let (bit, asks) = (work.bit.unwrap_or(0), work.confirm_bit);
        if !asks {
            self.put_in(bit, false);
        }
        self.approach_start(beside, to, !asks)
    }

    /// To `to` by way of `beside`; then starts the spindle, if it should turn.
    pub(super) fn approach_start(&mut self, beside: Steps, to: Steps, turns: bool) -> Result<(), Diagnostic> {
        let there = cycles::go_to(&self.machine, self.position, beside)?;
        let on = cycles::go_to(&self.machine, beside, to)?;
        let moves = [there, on].iter().flat_map(|way| segments(way, &self.machine)).collect();
        let mut segments = self.in_time(moves)?;
        if turns {
            segments.extend(self.spindle_up());
        }
        self.give(Doing::Approach, segments);
        Ok(())
    }

    /// Starts the spindle at the next segment's speed, and waits for its spin-up.
    pub(crate) fn spindle_up(&self) -> Vec<Segment> {
        let Some(work) = &self.work else { return Vec::new() };
        let rpm = work.rpm();
        let ticks = (self.machine.process.spin_up_ms * 1e-3 * TICK_HZ as f64) as u64;
        let on = rest(Stage::Dwell, Switching::Spindle { rpm }, ticks, self.position);
        if rpm == 0 { Vec::new() } else { vec![on] }
    }

    pub(crate) fn spindle_on(&mut self) {
        // Before a tool request the spindle stays off: the user's hands come next.
        let segments = if self.wants_new_tool() { Vec::new() } else { self.spindle_up() };
        self.give(Doing::Approach, segments);
    }

    /// Plays the current leg up to its end, or up to a tool change.
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
                if work.is_in.take() == Some(bit) {
                    work.given += 1;
                    continue;
                }
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

    /// All given segments were played: the leg is completed, waits for a tool, or continues after a gate.
    fn leg_ended(&mut self) {
        self.doing = Doing::Nothing;
        let Some(work) = &mut self.work else { return };
        if work.next().is_some() {
            return match work.awaited() {
                Some(bit) => self.bit_is_awaited(bit),
                None => self.leg(Vec::new()),
            };
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
        // In a chain, a hole ends at its bottom. If the next one does not follow at once, lift the tool
        // first.
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

    /// The leg waits for a tool: ask the user at the change position, or let the machine fetch it.
    fn bit_is_awaited(&mut self, bit: u32) {
        if !self.machine.is_changed_by_hand() {
            return self.pending.push_back(self.bit_wanted());
        }
        if let Err(why) = self.change_here(bit) {
            self.fails(why, self.session.trust);
        }
    }

    /// A sensor ended a drill cycle early: plans the rest of the leg from the current position.
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

    fn top(&self) -> i64 {
        cycles::top(&self.machine)
    }

    pub(crate) fn make_safe(&mut self, lift: bool) {
        let segments = self.up_and_off(lift);
        self.give(Doing::Safe, segments);
    }

    /// Lifts to the top, if allowed, and switches the spindle off.
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

    fn rests_at(&mut self, report: &Report) {
        let before = std::mem::replace(&mut self.position, report.position);
        (self.down, self.tools.inputs) = (report.down, report.inputs);
        self.has_risen(&before);
        self.foot.played(report.ended);
    }

    /// The tool touched something higher than the board can be at this position.
    fn touched_early(&mut self, doing: &Doing, at: &Steps) {
        let board_steps = if *doing == Doing::Leg { self.board_of_leg() } else { 0 };
        self.fails(early(&self.machine, at, board_steps), self.session.trust);
    }

    pub(crate) fn reported(&mut self, report: &Report) {
        if report.id != self.task {
            return;
        }
        self.rests_at(report);
        let doing = std::mem::replace(&mut self.doing, Doing::Nothing);
        let stopping = self.session.state == State::Stopping;
        match (doing, report.ended) {
            // After a requested stop this is no alarm.
            (doing, Ended::RanDry) if !stopping => {
                let why = error!("adapter.ran_dry");
                if doing == Doing::Queue {
                    return self.queue_ran_dry(why);
                }
                self.fails(why, self.session.trust);
            }
            (Doing::Queue, _) => self.queue_reported(report),
            (Doing::Clamp { opens }, _) => self.clamp_moved(opens),
            (Doing::ToChange, Ended::Completed) => self.at_change_position(),
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
            // After a requested stop, a late task is no alarm.
            (_, Ended::Starved) if stopping => self.pending.push_back(Event::Rested),
            // The page released the jog or disappeared: the jog ends here.
            (Doing::Jog, Ended::Stopped) if !stopping => self.pending.push_back(Event::Arrived),
            (_, Ended::Stopped | Ended::RanDry) => self.pending.push_back(Event::Rested),
            (_, Ended::Starved) => self.fails(error!("control.starved"), self.session.trust),
            (Doing::Touch, ended) if ended.is_of_touch() => self.touched(ended, report.inputs),
            (Doing::Homing(homing), _) => self.homed(homing, report),
            // Every step is counted: only the spindle failed.
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
                let why = error!("control.drilling_too_long", sensor = gate.input.name(), ..);
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

    /// A drill cycle ended on its sensor, or without it: continues with the rest of the leg.
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

    /// The tool reached its lowest point without touching the board.
    fn nothing_touched(&mut self) {
        let Some(work) = &self.work else { return };
        let mm = |axis: usize| {
            let steps = self.position[axis] - work.job.zero[axis];
            format!("{:.3}", self.machine.axis(axis).scale.length(steps).mm())
        };
        let why = error!("level.no_board", x = mm(0), y = mm(1), mm = mm(2));
        self.fails(why, self.session.trust);
    }

    /// Queues a failure: its alarm, and the remaining trust in the position.
    pub(super) fn fails(&mut self, alarm: Diagnostic, left: Trust) {
        self.pending.push_back(Event::Failed { alarm, left });
    }
}
