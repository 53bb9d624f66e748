//! The session: what the drill is doing, what it may do next, and how well it knows where it is.
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
//! Park goes from Ready to Parking and back, as a move by hand does to Jogging; it needs trust.
//!
//! Stop brakes, then the tip is lifted. Stop again while it rises holds it where it is, spindle off.
//!
//! A bit that the machine fetches itself is changed while it moves: Stop brakes there as it does while it drills.
//!
//! A queue of work commands runs and holds in the states of a job; its rows may home, so it needs no trust to begin.
//!
//! Comes in: asks, and what the executor reports. Goes out: the next session and what to do. One thing moves at a time;
//! the executor answers every moving action with exactly one report, at rest. Does not know how anything is moved.

use super::{Action, Alarm, Ending, Event, State, Trust};
use crate::diagnostic::Diagnostic;

/// Work zeros that can be taken back.
const ZEROS_KEPT: usize = 5;

/// Everything the drill's mind holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Session {
    /// What it is doing.
    pub state: State,
    /// How well the position is known.
    pub trust: Trust,
    /// Work zeros in machine steps, the one in force last.
    pub zeros: Vec<[i64; 2]>,
    /// What went wrong, until acknowledged.
    pub alarm: Option<Alarm>,
    /// The job that is ready to start, and the digest of its stream.
    pub armed: Option<(String, String)>,
    /// An interrupted job and the leg to take it up at.
    pub offer: Option<(String, u32)>,
    /// Whether the executor has something to do.
    pub moving: bool,
    /// What runs, or is held, is a queue of work commands.
    pub queue: bool,
    /// What is to happen at the next rest.
    wish: Wish,
    /// How the job in work is to end, once at rest.
    ending: Option<Ending>,
    /// The tip is being lifted, and the spindle then turned off.
    lifting: bool,
    /// Stop came while it was: it stays where it comes to rest.
    held: bool,
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
            wish: Wish::None,
            ending: None,
            lifting: false,
            held: false,
        }
    }
}

fn refuse(code: &str) -> Vec<Action> {
    vec![Action::Refuse(Diagnostic::error(code))]
}

/// The session after `event`, and what to do.
#[must_use]
pub fn step(session: &Session, event: Event) -> (Session, Vec<Action>) {
    let mut next = session.clone();
    let actions = match event {
        Event::Stop => next.stop(),
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
            // Nothing moves: a person has to know.
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
        Event::Pause | Event::Resume | Event::StopAfterHole | Event::ToolChanged => {
            next.while_running(&event)
        }
        ask => next.at_rest(ask),
    };
    let lifts = actions.iter().any(|action| matches!(action, Action::MakeSafe { .. }));
    next.lifting = lifts || (next.lifting && next.moving);
    next.held &= next.lifting;
    next.moving |= actions.iter().any(Action::moves);
    (next, actions)
}

impl Session {
    /// The work zero in force.
    pub fn zero(&self) -> Option<[i64; 2]> {
        self.zeros.last().copied()
    }

    /// Whether a job is in work.
    pub fn has_job(&self) -> bool {
        matches!(self.state, State::Running | State::Pausing | State::Paused | State::ToolChange)
            || self.ending.is_some()
    }

    fn resting_state(&self) -> State {
        if self.trust == Trust::Trusted { State::Ready } else { State::NotHomed }
    }

    fn lift(&self) -> Action {
        Action::MakeSafe { lift: self.trust != Trust::Lost }
    }

    /// Asks that need rest.
    fn at_rest(&mut self, ask: Event) -> Vec<Action> {
        if let (Event::Acknowledge, State::Alarm) = (&ask, self.state) {
            if self.moving {
                return refuse("control.busy");
            }
            self.alarm = None;
            self.state = self.resting_state();
            return Vec::new();
        }
        if self.state == State::Alarm {
            return refuse("control.alarm_unread");
        }
        if self.moving || !matches!(self.state, State::NotHomed | State::Ready) {
            return refuse("control.busy");
        }
        match ask {
            Event::Home => {
                (self.state, self.trust) = (State::Homing, Trust::Lost);
                vec![Action::Home]
            }
            Event::Park if self.trust != Trust::Trusted => refuse("control.not_homed"),
            Event::Park => {
                self.state = State::Parking;
                vec![Action::Park]
            }
            Event::Jog { axis, distance_um: um } => {
                self.state = State::Jogging;
                vec![Action::Jog { axis, distance_um: um }]
            }
            Event::SetZero { place_steps: at } => self.set_zero(at),
            Event::UndoZero if self.zeros.is_empty() => refuse("control.no_zero_before"),
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
            _ => refuse("control.nothing_to_do"),
        }
    }

    fn set_zero(&mut self, at: [i64; 2]) -> Vec<Action> {
        if self.trust != Trust::Trusted {
            return refuse("control.not_homed");
        }
        self.zeros.push(at);
        if self.zeros.len() > ZEROS_KEPT + 1 {
            self.zeros.remove(0);
        }
        self.armed = None;
        vec![Action::KeepZero]
    }

    fn start(&mut self, job: &str, digest: &str, leg: u32) -> Vec<Action> {
        if self.trust != Trust::Trusted {
            return refuse("control.not_homed");
        }
        match &self.armed {
            Some((armed, _)) if armed != job => return refuse("control.not_armed"),
            Some((_, known)) if known != digest => return refuse("control.other_stream"),
            Some(_) => {}
            None => return refuse("control.not_armed"),
        }
        let offered = self.offer.as_ref().is_some_and(|(offered, at)| offered == job && *at == leg);
        if leg != 0 && !offered {
            return refuse("control.leg_not_offered");
        }
        (self.state, self.wish, self.ending) = (State::Running, Wish::None, None);
        vec![Action::Approach { leg }]
    }

    /// Asks that a job in work understands.
    fn while_running(&mut self, ask: &Event) -> Vec<Action> {
        match (ask, self.state) {
            (Event::Pause, State::Running | State::Pausing) => {
                (self.state, self.wish) = (State::Pausing, Wish::Pause);
                Vec::new()
            }
            (Event::Resume, State::Pausing) => {
                (self.state, self.wish) = (State::Running, Wish::None);
                Vec::new()
            }
            (Event::Resume, State::Paused) if !self.queue => {
                (self.state, self.wish) = (State::Running, Wish::None);
                vec![Action::SpindleOn]
            }
            (Event::StopAfterHole, State::Running | State::Pausing) => {
                (self.state, self.wish) = (State::Pausing, Wish::StopAfterHole);
                Vec::new()
            }
            // What the machine changes by itself it brings to its end first.
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
            _ => refuse("control.nothing_to_do"),
        }
    }

    /// Ends the job from rest: tip up, spindle off.
    fn finish(&mut self, ending: Ending) -> Vec<Action> {
        (self.state, self.ending) = (State::Stopping, Some(ending));
        vec![self.lift()]
    }

    /// Stop is never refused.
    fn stop(&mut self) -> Vec<Action> {
        match self.state {
            // A drill of our own never reads a job in check mode: that is at rest.
            State::NotHomed | State::Ready | State::Checking => vec![Action::SpindleOff],
            State::Alarm => vec![Action::Brake, Action::SpindleOff],
            State::Paused => self.finish(Ending::Stopped),
            State::ToolChange if !self.moving => self.finish(Ending::Stopped),
            State::Stopping => {
                self.held = self.lifting;
                vec![Action::Brake]
            }
            State::Running | State::Pausing | State::ToolChange => {
                (self.state, self.ending) = (State::Stopping, Some(Ending::Stopped));
                vec![Action::Brake]
            }
            State::Homing | State::Jogging | State::Parking => {
                self.state = State::Stopping;
                vec![Action::Brake]
            }
        }
    }

    /// What the executor reports. A report that crosses Stop on its way is as good as rest.
    fn reported(&mut self, report: &Event) -> Vec<Action> {
        match (self.state, report) {
            (State::Alarm, _) => Vec::new(),
            (State::Stopping, Event::Safe) => self.made_safe().into_iter().collect(),
            (State::Stopping, Event::Rested) if self.held => {
                std::iter::once(Action::SpindleOff).chain(self.made_safe()).collect()
            }
            // Homing that was just finished when Stop came still counts.
            (State::Stopping, Event::Homed) => {
                self.trust = Trust::Trusted;
                vec![self.lift()]
            }
            // The last leg was done already: nothing was stopped.
            (State::Stopping, Event::LegDone { last: true, .. }) if self.ending == Some(Ending::Stopped) => {
                self.ending = Some(Ending::Done);
                vec![self.lift()]
            }
            (State::Stopping, _) => vec![self.lift()],
            (State::Homing, Event::Homed) => {
                (self.state, self.trust) = (State::Ready, Trust::Trusted);
                Vec::new()
            }
            (State::Jogging | State::Parking, Event::Arrived) => {
                self.state = self.resting_state();
                Vec::new()
            }
            // The spindle stays as the row before left it.
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

    /// Nothing more is to be done for safety: the job, if there was one, is over.
    fn made_safe(&mut self) -> Option<Action> {
        self.queue = false;
        self.state = if self.alarm.is_some() { State::Alarm } else { self.resting_state() };
        self.ending.take().map(Action::End)
    }

    fn failed(&mut self, why: Alarm, trust: Trust) -> Vec<Action> {
        let again = self.state == State::Alarm || self.held;
        let had_job = self.has_job();
        self.queue = false;
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

    /// Nothing more may be begun; what moves comes to rest first and then reports.
    fn cannot_record(&mut self, why: Alarm) -> Vec<Action> {
        if self.state == State::Alarm {
            return Vec::new();
        }
        if self.moving {
            self.alarm.get_or_insert(why);
            (self.state, self.ending) = (State::Stopping, Some(Ending::Alarm));
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
mod tests {
    use super::*;
    use crate::chance::Chance;

    fn alarm(code: &str) -> Diagnostic {
        Diagnostic::error(code)
    }

    fn next(chance: &mut Chance, below: u64) -> u64 {
        chance.bits() % below
    }

    /// A random ask, or, where something moves, a random report of it.
    fn event(seed: &mut Chance, session: &Session, busy_with: Option<&Action>) -> Event {
        let job = || "job".to_owned();
        if let (Some(action), 0..2) = (busy_with, next(seed, 4)) {
            return match (next(seed, 8), action) {
                (0, _) => Event::Failed {
                    alarm: alarm("x"),
                    left: [Trust::Trusted, Trust::Suspect, Trust::Lost][next(seed, 3) as usize],
                },
                (1, _) if session.state == State::Stopping => Event::Rested,
                (_, Action::Home) => Event::Homed,
                (_, Action::Jog { .. } | Action::Park | Action::Approach { .. } | Action::SpindleOn) => {
                    Event::Arrived
                }
                (2, Action::NextLeg) => Event::BitWanted,
                (3, Action::NextLeg) => Event::ChangeWanted,
                (_, Action::ChangeTool) => Event::Changed,
                (2, Action::Queue) => Event::QueueDone,
                (_, Action::Queue) => Event::QueueHeld,
                (_, Action::MakeSafe { .. }) => Event::Safe,
                _ => Event::LegDone { cut: next(seed, 2) == 0, last: next(seed, 5) == 0 },
            };
        }
        if session.queue && session.moving && next(seed, 9) == 0 {
            return Event::Counted { all_homed: next(seed, 2) == 0 };
        }
        match next(seed, 17) {
            0 => Event::Home,
            1 => Event::SetZero { place_steps: [next(seed, 99) as i64, 3] },
            2 => Event::UndoZero,
            3 => Event::Jog { axis: next(seed, 3) as u8, distance_um: 100 },
            4 => Event::Armed { job: job(), digest: "d".into() },
            5 => Event::Disarmed { position_lost: next(seed, 4) == 0 },
            6 | 7 => {
                let digest = if next(seed, 4) == 0 { "e" } else { "d" };
                Event::Start { job: job(), digest: digest.into(), from_leg: next(seed, 2) as u32 }
            }
            8 => Event::Pause,
            9 => Event::Resume,
            10 => Event::StopAfterHole,
            11 => Event::Stop,
            12 => Event::ToolChanged,
            13 => Event::Acknowledge,
            14 => Event::Queue,
            15 => Event::Park,
            _ => Event::CannotRecord(alarm("y")),
        }
    }

    fn is_report(event: &Event) -> bool {
        matches!(
            event,
            Event::Homed
                | Event::Arrived
                | Event::LegDone { .. }
                | Event::BitWanted
                | Event::ChangeWanted
                | Event::Changed
                | Event::QueueHeld
                | Event::QueueDone
                | Event::Rested
                | Event::Safe
                | Event::Failed { .. }
                | Event::CannotRecord(_)
        )
    }

    /// The laws that hold after every event.
    fn check(before: &Session, event: &Event, after: &Session, actions: &[Action], trace: &str) {
        let moving: Vec<_> = actions.iter().filter(|action| action.moves()).collect();
        assert!(moving.len() <= 1, "two moves at once: {trace}");
        let refused = actions.iter().any(|action| matches!(action, Action::Refuse(_)));
        if refused {
            assert_eq!((before, actions.len()), (after, 1), "a refusal changes nothing: {trace}");
        }
        if let Some(action) = moving.first() {
            assert!(!before.moving || is_report(event), "a move on top of a move: {trace}");
            let asked = match action {
                Action::Home => *event == Event::Home,
                Action::Jog { .. } => matches!(event, Event::Jog { .. }),
                Action::Park => *event == Event::Park && before.trust == Trust::Trusted,
                Action::Approach { .. } => matches!(event, Event::Start { .. }),
                Action::RestOfLeg => matches!(event, Event::ToolChanged | Event::Changed),
                Action::ChangeTool => *event == Event::ChangeWanted,
                Action::SpindleOn => *event == Event::Resume,
                Action::Queue => *event == Event::Queue,
                Action::NextLeg => before.state == State::Running || before.state == State::Pausing,
                _ => is_report(event) || matches!(event, Event::Stop | Event::StopAfterHole),
            };
            assert!(asked, "nothing moves unasked: {trace}");
            let job = matches!(
                action,
                Action::Approach { .. }
                    | Action::NextLeg
                    | Action::RestOfLeg
                    | Action::ChangeTool
                    | Action::SpindleOn
            );
            assert!(!job || after.trust == Trust::Trusted, "no job without trust: {trace}");
            assert!(!job || after.alarm.is_none(), "no job with an alarm: {trace}");
        }
        if *event == Event::Stop {
            assert!(!refused, "Stop is never refused: {trace}");
            assert!(!before.moving || actions.contains(&Action::Brake), "Stop brakes: {trace}");
            assert!(
                !matches!(
                    after.state,
                    State::Running | State::Pausing | State::Homing | State::Jogging | State::Parking
                ),
                "{trace}"
            );
        }
        if before.state == State::Alarm && after.state != State::Alarm {
            assert_eq!(*event, Event::Acknowledge, "an alarm stays until it is read: {trace}");
        }
        if before.trust != Trust::Trusted && after.trust == Trust::Trusted {
            let homed = matches!(event, Event::Homed | Event::Counted { all_homed: true });
            assert!(homed, "only homing gives trust: {trace}");
        }
        assert!(after.zeros.len() <= ZEROS_KEPT + 1, "{trace}");
        assert_eq!(
            after.state == State::Alarm,
            after.alarm.is_some() && after.state == State::Alarm,
            "{trace}"
        );
        let with_queue =
            matches!(after.state, State::Running | State::Pausing | State::Paused | State::Stopping);
        assert!(!after.queue || with_queue, "a queue in a state that knows none: {trace}");
        if matches!(after.state, State::Ready | State::NotHomed | State::Paused) {
            assert!(!after.moving, "a state of rest while something moves: {trace}");
        }
    }

    #[test]
    fn a_hundred_thousand_random_events_keep_the_laws() {
        let mut seed = Chance::new(20_261_120);
        let (mut session, mut busy_with) = (Session::default(), None);
        let mut seen = std::collections::BTreeSet::new();
        for number in 0..200_000 {
            let event = event(&mut seed, &session, busy_with.as_ref());
            let (after, actions) = step(&session, event.clone());
            let trace = format!("event {number}: {event:?} in {session:?} gives {actions:?}");
            check(&session, &event, &after, &actions, &trace);
            if !after.moving {
                busy_with = None;
            }
            if let Some(action) = actions.iter().find(|action| action.moves()) {
                busy_with = Some(action.clone());
            }
            seen.insert(format!("{:?}", after.state));
            session = after;
        }
        assert_eq!(seen.len(), 11, "every state was visited: {seen:?}");
    }

    #[test]
    fn stop_leads_to_rest_from_every_state() {
        let mut seed = Chance::new(7);
        for round in 0..2_000 {
            let (mut session, mut busy_with) = (Session::default(), None);
            for _ in 0..next(&mut seed, 40) {
                let event = event(&mut seed, &session, busy_with.as_ref());
                let (after, actions) = step(&session, event);
                if !after.moving {
                    busy_with = None;
                }
                busy_with = actions.iter().find(|action| action.moves()).cloned().or(busy_with);
                session = after;
            }
            let (mut after, mut actions) = step(&session, Event::Stop);
            let mut reports = 0;
            while after.moving {
                let made_safe = actions.iter().any(|action| matches!(action, Action::MakeSafe { .. }));
                (after, actions) = step(
                    &after,
                    if made_safe || after.state == State::Alarm { Event::Safe } else { Event::Rested },
                );
                reports += 1;
                assert!(reports <= 3, "round {round}: {after:?}");
            }
            assert!(
                matches!(after.state, State::Ready | State::NotHomed | State::Alarm),
                "round {round}: {after:?}"
            );
        }
    }

    /// A session that was stopped while it drilled, and is lifting its tip.
    fn lifting() -> Session {
        let running =
            Session { state: State::Running, trust: Trust::Trusted, moving: true, ..Session::default() };
        let (braking, actions) = step(&running, Event::Stop);
        assert_eq!(actions, [Action::Brake]);
        // Hammering does no harm before there is anything to hold.
        let (braking, actions) = step(&braking, Event::Stop);
        assert_eq!(actions, [Action::Brake]);
        let (lifting, actions) = step(&braking, Event::Rested);
        assert_eq!(actions, [Action::MakeSafe { lift: true }]);
        lifting
    }

    #[test]
    fn stop_again_holds_the_lift_and_ends_the_job_where_it_stands() {
        for stops in 1..7 {
            let mut session = lifting();
            for _ in 0..stops {
                let (held, actions) = step(&session, Event::Stop);
                assert_eq!(actions, [Action::Brake]);
                session = held;
            }
            let (held, actions) = step(&session, Event::Rested);
            assert_eq!(actions, [Action::SpindleOff, Action::End(Ending::Stopped)]);
            assert_eq!((held.state, held.moving, held.trust), (State::Ready, false, Trust::Trusted));
        }
        // The lift had just ended when Stop came, and one that nobody stopped.
        for event in [Some(Event::Stop), None] {
            let session = event.map_or_else(lifting, |stop| step(&lifting(), stop).0);
            let (safe, actions) = step(&session, Event::Safe);
            assert_eq!((safe.state, actions), (State::Ready, vec![Action::End(Ending::Stopped)]));
        }
        // What goes wrong while it is held lifts nothing either.
        let (held, _) = step(&lifting(), Event::Stop);
        let (alarm, actions) = step(&held, Event::Failed { alarm: self::alarm("x"), left: Trust::Suspect });
        assert_eq!(actions, [Action::SpindleOff, Action::End(Ending::Alarm)]);
        assert_eq!((alarm.state, alarm.moving), (State::Alarm, false));
    }
}
