//! The session: state of the drill, allowed next actions, and trust in the position.
//!
//! ```text
//!            Home                Start              Pause            leg done
//! NotHomed ───────▶ Homing ─▶ Ready ───▶ Running ─────────▶ Pausing ─────────▶ Paused
//!     ▲                       ▲  │ Jog     │  ▲  ◀───────────── Resume ─────────┘
//!     │ acknowledged            │  ▼         │  └─ bit changed ── ToolChange ◀── bit wanted
//!     │ or stopped,             │ Jogging    ▼
//!   Alarm ◀── failed ── any     └────────── Stopping ◀── Stop, from anywhere
//! ```
//!
//! Park moves from Ready to Parking and back, as a jog does to Jogging; it needs trust.
//!
//! Stop brakes, then lifts the tip. A second Stop while the tip rises holds it there, with the spindle off.
//! Presses within half a second of the first count as one.
//!
//! A tool change by the magazine counts as motion: Stop brakes it like drilling.
//!
//! A queue of work commands runs and holds in the states of a job. Its rows may home, so it needs no trust to
//! start.
//!
//! Only one action moves at a time. The executor answers every moving action with exactly one report, at
//! rest.

mod changing;

use super::{Action, Alarm, Ending, Event, State, Trust};
use crate::code;
use crate::diagnostic::Diagnostic;

/// Presses of STOP within this time of the first count as one, in ms: a double click.
const SAME_PRESS_MS: u64 = 500;

/// True if STOP at `now_ms` still belongs to the press at `before_ms`.
pub fn is_same_press(before_ms: Option<u64>, now_ms: u64) -> bool {
    before_ms.is_some_and(|before_ms| now_ms.saturating_sub(before_ms) < SAME_PRESS_MS)
}

const ZEROS_KEPT: usize = 5;

#[derive(Clone, Debug, PartialEq)]
pub struct Session {
    pub state: State,
    pub trust: Trust,
    pub zeros: Vec<[i64; 2]>,
    /// Current alarm, until acknowledged.
    pub alarm: Option<Alarm>,
    pub armed: Option<(String, String)>,
    pub offer: Option<(String, u32)>,
    /// True if the executor is busy.
    pub moving: bool,
    /// The running or paused work is a queue of work commands.
    pub queue: bool,
    /// A jog started during a tool change, and returns to it.
    pub in_change: bool,
    /// Action at the next rest.
    wish: Wish,
    ending: Option<Ending>,
    /// The tip is rising, and the spindle turns off after that.
    lifting: bool,
    /// STOP arrived during the lift: the tip stays where it stops.
    held: bool,
    stopped_ms: Option<u64>,
    /// Paused on a toolpath, in the middle of a task.
    pub on_path: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wish {
    None,
    Pause,
    StopAfterHole,
}

impl Default for Session {
    fn default() -> Self {
        Self {
            state: State::NotHomed,
            trust: Trust::Lost,
            zeros: Vec::new(),
            alarm: None,
            armed: None,
            offer: None,
            moving: false,
            queue: false,
            in_change: false,
            wish: Wish::None,
            ending: None,
            lifting: false,
            held: false,
            stopped_ms: None,
            on_path: false,
        }
    }
}

fn refuse(code: &str) -> Vec<Action> {
    vec![Action::Refuse(Diagnostic::error(code))]
}

#[must_use]
pub fn step(session: &Session, event: Event) -> (Session, Vec<Action>) {
    let mut next = session.clone();
    let actions = match event {
        Event::Stop { now_ms } => next.stop(now_ms),
        Event::Homed
        | Event::Arrived
        | Event::LegDone { .. }
        | Event::BitWanted
        | Event::ChangeWanted
        | Event::Changed
        | Event::QueueHeld
        | Event::QueueDone
        | Event::Rested
        | Event::Safe => {
            next.moving = false;
            next.reported(&event)
        }
        Event::Failed { alarm: why, left: trust } => {
            next.moving = false;
            next.failed(why, trust)
        }
        Event::CannotRecord(why) => next.cannot_record(why),
        Event::BoardDiffers { alarm: why, left: trust } => {
            // Nothing moves, but the user must know.
            (next.state, next.trust) = (State::Alarm, worse(next.trust, trust));
            next.alarm.get_or_insert(why);
            Vec::new()
        }
        Event::Counted { all_homed: all } => {
            next.trust = if all { Trust::Trusted } else { Trust::Lost };
            Vec::new()
        }
        Event::Queue if next.queue && next.state == State::Paused => {
            next.state = State::Running;
            vec![Action::Queue]
        }
        Event::Held if next.pauses() && next.moving => {
            (next.state, next.wish, next.on_path) = (State::Paused, Wish::None, true);
            Vec::new()
        }
        // The pause was cancelled meanwhile.
        Event::Held => Vec::new(),
        Event::Pause | Event::Resume | Event::Lift | Event::StopAfterHole | Event::ToolChanged => {
            next.while_running(&event)
        }
        ask => next.at_rest(ask),
    };
    let lifts = actions.iter().any(|action| matches!(action, Action::MakeSafe { .. }));
    next.lifting = lifts || (next.lifting && next.moving);
    next.held &= next.lifting;
    next.on_path &= next.state == State::Paused && next.moving;
    next.moving |= actions.iter().any(Action::moves);
    (next, actions)
}

impl Session {
    pub fn zero(&self) -> Option<[i64; 2]> {
        self.zeros.last().copied()
    }

    pub fn has_job(&self) -> bool {
        matches!(self.state, State::Running | State::Pausing | State::Paused | State::ToolChange)
            || self.ending.is_some()
            || self.in_change
    }

    pub fn pauses(&self) -> bool {
        self.state == State::Pausing && self.wish == Wish::Pause
    }

    fn resting_state(&self) -> State {
        if self.trust == Trust::Trusted { State::Ready } else { State::NotHomed }
    }

    fn lift(&self) -> Action {
        Action::MakeSafe { lift: self.trust != Trust::Lost }
    }

    /// Requests at rest.
    fn at_rest(&mut self, ask: Event) -> Vec<Action> {
        if let (Event::Acknowledge, State::Alarm) = (&ask, self.state) {
            if self.moving {
                return refuse(code!("control.busy"));
            }
            self.alarm = None;
            self.state = self.resting_state();
            return Vec::new();
        }
        if self.state == State::Alarm {
            return refuse(code!("control.alarm_unread"));
        }
        if self.state == State::ToolChange && !self.moving {
            return self.while_changing(&ask);
        }
        if self.moving || !matches!(self.state, State::NotHomed | State::Ready) {
            return refuse(code!("control.busy"));
        }
        match ask {
            Event::Home => {
                // Homing counts from zero again, so the position is unknown until it ends.
                (self.state, self.trust) = (State::Homing, Trust::Lost);
                vec![Action::Home]
            }
            Event::Park if self.trust != Trust::Trusted => refuse(code!("control.not_homed")),
            Event::Park => {
                self.state = State::Parking;
                vec![Action::Park]
            }
            Event::Jog { axis, distance_um: um } => {
                self.state = State::Jogging;
                vec![Action::Jog { axis, distance_um: um }]
            }
            Event::SetZero { place_steps: at } => self.set_zero(at),
            Event::UndoZero if self.zeros.is_empty() => refuse(code!("control.no_zero_before")),
            Event::UndoZero => {
                self.zeros.pop();
                self.armed = None;
                vec![Action::KeepZero]
            }
            Event::Armed { job, digest } => {
                self.armed = Some((job, digest));
                Vec::new()
            }
            Event::Disarmed { position_lost: lost } => {
                self.armed = None;
                if lost {
                    (self.trust, self.state) = (Trust::Lost, State::NotHomed);
                }
                Vec::new()
            }
            Event::Start { job, digest, from_leg } => self.start(&job, &digest, from_leg),
            Event::Queue => {
                (self.state, self.wish, self.ending, self.queue) = (State::Running, Wish::None, None, true);
                vec![Action::Queue]
            }
            _ => refuse(code!("control.nothing_to_do")),
        }
    }

    fn set_zero(&mut self, at: [i64; 2]) -> Vec<Action> {
        if self.trust != Trust::Trusted {
            return refuse(code!("control.not_homed"));
        }
        self.zeros.push(at);
        if self.zeros.len() > ZEROS_KEPT + 1 {
            self.zeros.remove(0);
        }
        // The armed job was checked with the old zero.
        self.armed = None;
        vec![Action::KeepZero]
    }

    fn start(&mut self, job: &str, digest: &str, leg: u32) -> Vec<Action> {
        if self.trust != Trust::Trusted {
            return refuse(code!("control.not_homed"));
        }
        match &self.armed {
            Some((armed, _)) if armed != job => return refuse(code!("control.not_armed")),
            // The page simulated other steps than the bridge would play.
            Some((_, known)) if known != digest => return refuse(code!("control.other_stream")),
            Some(_) => {}
            None => return refuse(code!("control.not_armed")),
        }
        // Only an interrupted job may start in the middle, at the leg that this session offered.
        let offered = self.offer.as_ref().is_some_and(|(offered, at)| offered == job && *at == leg);
        if leg != 0 && !offered {
            return refuse(code!("control.leg_not_offered"));
        }
        (self.state, self.wish, self.ending) = (State::Running, Wish::None, None);
        vec![Action::Approach { leg }]
    }

    fn while_running(&mut self, ask: &Event) -> Vec<Action> {
        match (ask, self.state) {
            (Event::Pause, State::Running | State::Pausing) => {
                (self.state, self.wish) = (State::Pausing, Wish::Pause);
                vec![Action::Hold]
            }
            (Event::Resume, State::Pausing) => {
                (self.state, self.wish) = (State::Running, Wish::None);
                vec![Action::Go]
            }
            (Event::Lift, State::Paused) if self.on_path => vec![Action::LiftOffPath],
            (Event::Resume, State::Paused) if self.on_path => {
                (self.state, self.wish) = (State::Running, Wish::None);
                vec![Action::Go]
            }
            // In the middle of a toolpath there is no later end to wait for, so stop here.
            (Event::StopAfterHole, State::Paused) if self.on_path => self.brakes(),
            (Event::Resume, State::Paused) if !self.queue => {
                (self.state, self.wish) = (State::Running, Wish::None);
                vec![Action::SpindleOn]
            }
            (Event::StopAfterHole, State::Running | State::Pausing) => {
                (self.state, self.wish) = (State::Pausing, Wish::StopAfterHole);
                vec![Action::Go]
            }
            // A change by the machine is completed first.
            (Event::StopAfterHole, State::ToolChange) if self.moving => {
                self.wish = Wish::StopAfterHole;
                Vec::new()
            }
            (Event::StopAfterHole, State::Paused | State::ToolChange) => {
                self.finish(Ending::StoppedAfterHole)
            }
            (Event::ToolChanged, State::ToolChange) if !self.moving => {
                self.state = if self.wish == Wish::None { State::Running } else { State::Pausing };
                vec![Action::RestOfLeg]
            }
            _ => refuse(code!("control.nothing_to_do")),
        }
    }

    fn brakes(&mut self) -> Vec<Action> {
        (self.state, self.ending) = (State::Stopping, Some(Ending::Stopped));
        vec![Action::Brake]
    }

    /// Ends the job from rest: tip up, spindle off.
    fn finish(&mut self, ending: Ending) -> Vec<Action> {
        (self.state, self.ending) = (State::Stopping, Some(ending));
        vec![self.lift()]
    }

    /// Handles STOP, which is never refused. The second half of a double click changes nothing.
    fn stop(&mut self, now_ms: u64) -> Vec<Action> {
        if self.state == State::Stopping && is_same_press(self.stopped_ms, now_ms) {
            // A brake would stop the lift. Brake only if a later press already holds the lift.
            return if self.lifting && !self.held { Vec::new() } else { vec![Action::Brake] };
        }
        self.stopped_ms = Some(now_ms);
        match self.state {
            // Only controllers have a check mode, so treat it as at rest.
            State::NotHomed | State::Ready | State::Checking => vec![Action::SpindleOff],
            State::Alarm => vec![Action::Brake, Action::SpindleOff],
            State::Paused if self.on_path => self.brakes(),
            State::Paused => self.finish(Ending::Stopped),
            State::ToolChange if !self.moving => self.finish(Ending::Stopped),
            State::Stopping => {
                self.held = self.lifting;
                vec![Action::Brake]
            }
            State::Running | State::Pausing | State::ToolChange => self.brakes(),
            State::Homing | State::Jogging | State::Parking => {
                self.stop_in_change();
                self.state = State::Stopping;
                vec![Action::Brake]
            }
        }
    }

    /// Handles a report of the executor. A report that crosses Stop on its way counts as rest.
    fn reported(&mut self, report: &Event) -> Vec<Action> {
        match (self.state, report) {
            (State::Alarm, _) => Vec::new(),
            (State::Stopping, Event::Safe) => self.made_safe().into_iter().collect(),
            (State::Stopping, Event::Rested) if self.held => {
                std::iter::once(Action::SpindleOff).chain(self.made_safe()).collect()
            }
            // Homing that was complete when Stop arrived still counts.
            (State::Stopping, Event::Homed) => {
                self.trust = Trust::Trusted;
                vec![self.lift()]
            }
            // The last leg was complete: nothing was interrupted.
            (State::Stopping, Event::LegDone { last: true, .. }) if self.ending == Some(Ending::Stopped) => {
                self.ending = Some(Ending::Done);
                vec![self.lift()]
            }
            (State::Stopping, _) => vec![self.lift()],
            (State::Homing, Event::Homed) => {
                (self.state, self.trust) = (State::Ready, Trust::Trusted);
                Vec::new()
            }
            (State::Jogging | State::Parking, report) if self.in_change => self.reported_in_change(report),
            (State::Jogging | State::Parking, Event::Arrived) => {
                self.state = self.resting_state();
                Vec::new()
            }
            // The spindle stays as the previous row left it.
            (State::Running | State::Pausing, Event::QueueHeld) => {
                (self.state, self.wish) = (State::Paused, Wish::None);
                Vec::new()
            }
            (State::Running | State::Pausing, Event::QueueDone) => self.finish(Ending::Done),
            (State::Running | State::Pausing, Event::ChangeWanted) => {
                self.state = State::ToolChange;
                vec![Action::ChangeTool]
            }
            (State::ToolChange, Event::Changed) if self.wish == Wish::StopAfterHole => {
                self.finish(Ending::StoppedAfterHole)
            }
            (State::ToolChange, Event::Changed) => {
                self.state = if self.wish == Wish::None { State::Running } else { State::Pausing };
                vec![Action::RestOfLeg]
            }
            (State::Running | State::Pausing, Event::BitWanted) => {
                self.state = State::ToolChange;
                vec![Action::SpindleOff]
            }
            (State::Running | State::Pausing, Event::LegDone { last: true, .. }) => {
                (self.state, self.wish) = (State::Stopping, Wish::None);
                self.ending = Some(Ending::Done);
                vec![self.lift()]
            }
            (State::Pausing, Event::LegDone { cut, last: false }) => match self.wish {
                Wish::StopAfterHole if *cut => self.finish(Ending::StoppedAfterHole),
                Wish::Pause => {
                    self.state = State::Paused;
                    vec![Action::SpindleOff]
                }
                _ => vec![Action::NextLeg],
            },
            (State::Running | State::Pausing, Event::LegDone { last: false, .. } | Event::Arrived) => {
                vec![Action::NextLeg]
            }
            _ => Vec::new(),
        }
    }

    /// Ends the job, if there was one: the machine is safe.
    fn made_safe(&mut self) -> Option<Action> {
        self.queue = false;
        self.state = if self.alarm.is_some() { State::Alarm } else { self.resting_state() };
        self.ending.take().map(Action::End)
    }

    fn failed(&mut self, why: Alarm, trust: Trust) -> Vec<Action> {
        // After a failed or held lift, don't lift again.
        let again = self.state == State::Alarm || self.held;
        let had_job = self.has_job();
        (self.queue, self.in_change) = (false, false);
        self.trust = worse(self.trust, trust);
        self.state = State::Alarm;
        self.alarm.get_or_insert(why);
        (self.wish, self.ending) = (Wish::None, None);
        let mut actions = vec![if again { Action::SpindleOff } else { self.lift() }];
        if had_job {
            actions.push(Action::End(Ending::Alarm));
        }
        actions
    }

    /// Blocks new work. Current motion stops first and then reports.
    fn cannot_record(&mut self, why: Alarm) -> Vec<Action> {
        if self.state == State::Alarm {
            return Vec::new();
        }
        if self.moving {
            self.alarm.get_or_insert(why);
            (self.state, self.ending, self.in_change) = (State::Stopping, Some(Ending::Alarm), false);
            return vec![Action::Brake];
        }
        self.failed(why, self.trust)
    }
}

fn worse(a: Trust, b: Trust) -> Trust {
    let rank = |trust| match trust {
        Trust::Trusted => 0,
        Trust::Suspect => 1,
        Trust::Lost => 2,
    };
    if rank(a) >= rank(b) { a } else { b }
}

#[cfg(test)]
mod tests;
