//! Laws of the session, checked after every event of long random histories.

use super::*;
use crate::chance::Chance;

fn alarm(code: &str) -> Diagnostic {
    Diagnostic::error(code)
}

fn next(chance: &mut Chance, below: u64) -> u64 {
    chance.bits() % below
}

/// A random request, or a random report of the current motion.
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
            (2, Action::Queue) if session.in_change => Event::Arrived,
            (_, Action::Queue) if session.in_change => Event::QueueDone,
            (_, Action::Touched) => Event::Arrived,
            (2, Action::Queue) => Event::QueueDone,
            (_, Action::Queue) => Event::QueueHeld,
            (4 | 5, Action::NextLeg) if session.pauses() => Event::Held,
            (_, Action::MakeSafe { .. }) => Event::Safe,
            _ => Event::LegDone { cut: next(seed, 2) == 0, last: next(seed, 5) == 0 },
        };
    }
    if session.queue && session.moving && next(seed, 9) == 0 {
        return Event::Counted { all_homed: next(seed, 2) == 0 };
    }
    match next(seed, 19) {
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
        11 => Event::Stop { now_ms: next(seed, 1_000_000) },
        12 => Event::ToolChanged,
        13 => Event::Acknowledge,
        14 => Event::Queue,
        15 => Event::Park,
        16 => Event::Touch,
        17 => Event::Lift,
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
            Action::Queue => matches!(event, Event::Queue | Event::Touch),
            Action::NextLeg => before.state == State::Running || before.state == State::Pausing,
            _ => is_report(event) || matches!(event, Event::Stop { .. } | Event::StopAfterHole),
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
    if let Event::Stop { now_ms } = event {
        let is_lift = before.state == State::Stopping && before.lifting && !before.held;
        let lifts_on = is_lift && is_same_press(before.stopped_ms, *now_ms);
        assert!(!refused, "Stop is never refused: {trace}");
        assert!(!before.moving || lifts_on || actions.contains(&Action::Brake), "Stop brakes: {trace}");
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
    assert_eq!(after.state == State::Alarm, after.alarm.is_some() && after.state == State::Alarm, "{trace}");
    let with_queue = matches!(after.state, State::Running | State::Pausing | State::Paused | State::Stopping);
    assert!(!after.queue || with_queue, "a queue in a state that knows none: {trace}");
    assert!(!after.on_path || after.state == State::Paused && after.moving, "{trace}");
    if matches!(after.state, State::Ready | State::NotHomed | State::Paused) && !after.on_path {
        assert!(!after.moving, "a state of rest while something moves: {trace}");
    }
}

#[test]
fn random_events_keep_the_session_invariants() {
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
fn stop_leads_to_standstill_from_every_state() {
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
        let (mut after, mut actions) = step(&session, Event::Stop { now_ms: 2_000_000 });
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

/// A session that was stopped while drilling, and is lifting its tip.
fn lifting() -> Session {
    let running =
        Session { state: State::Running, trust: Trust::Trusted, moving: true, ..Session::default() };
    let (braking, actions) = step(&running, Event::Stop { now_ms: 1_000 });
    assert_eq!(actions, [Action::Brake]);
    // More presses are harmless before there is a lift to hold.
    let (braking, actions) = step(&braking, Event::Stop { now_ms: 1_010 });
    assert_eq!(actions, [Action::Brake]);
    let (lifting, actions) = step(&braking, Event::Rested);
    assert_eq!(actions, [Action::MakeSafe { lift: true }]);
    lifting
}

#[test]
fn second_stop_holds_the_lift_and_ends_the_job() {
    for stops in 1..7 {
        let mut session = lifting();
        for _ in 0..stops {
            let (held, actions) = step(&session, Event::Stop { now_ms: 1_500 });
            assert_eq!(actions, [Action::Brake]);
            session = held;
        }
        let (held, actions) = step(&session, Event::Rested);
        assert_eq!(actions, [Action::SpindleOff, Action::End(Ending::Stopped)]);
        assert_eq!((held.state, held.moving, held.trust), (State::Ready, false, Trust::Trusted));
    }
    // The lift had just ended when Stop came; and a lift that no press held.
    for event in [Some(Event::Stop { now_ms: 1_500 }), None] {
        let session = event.map_or_else(lifting, |stop| step(&lifting(), stop).0);
        let (safe, actions) = step(&session, Event::Safe);
        assert_eq!((safe.state, actions), (State::Ready, vec![Action::End(Ending::Stopped)]));
    }
    // A failure during a held lift doesn't continue the lift.
    let (held, _) = step(&lifting(), Event::Stop { now_ms: 1_500 });
    let (alarm, actions) = step(&held, Event::Failed { alarm: self::alarm("x"), left: Trust::Suspect });
    assert_eq!(actions, [Action::SpindleOff, Action::End(Ending::Alarm)]);
    assert_eq!((alarm.state, alarm.moving), (State::Alarm, false));
}

/// Effect of STOP at each of `presses_ms` on a drilling job, which rests 50 ms after the brake.
fn pressed(presses_ms: &[u64]) -> &'static str {
    let mut session =
        Session { state: State::Running, trust: Trust::Trusted, moving: true, ..Session::default() };
    let mut rests = Some(presses_ms[0] + 50);
    for now_ms in presses_ms {
        if rests.is_some_and(|rests_ms| rests_ms <= *now_ms) {
            (session, _) = step(&session, Event::Rested);
            rests = None;
        }
        (session, _) = step(&session, Event::Stop { now_ms: *now_ms });
    }
    let (after, actions) = step(&session, Event::Rested);
    match actions.as_slice() {
        [Action::MakeSafe { lift: true }] => "lifts",
        [Action::SpindleOff, Action::End(Ending::Stopped)] if after.state == State::Ready => "held",
        _ => "else",
    }
}

#[test]
fn double_click_on_stop_is_one_press() {
    // At rest during an unheld lift, the lift continues.
    for (presses_ms, becomes) in [
        (&[0][..], "lifts"),
        (&[0, 20], "lifts"),
        (&[0, 120], "lifts"),
        (&[0, 120, 240, 360, 499], "lifts"),
        (&[0, 500], "held"),
        (&[0, 120, 700], "held"),
        (&[0, 120, 700, 720], "held"),
    ] {
        assert_eq!(pressed(presses_ms), becomes, "{presses_ms:?}");
    }
    // The first press counts, even after an earlier press at rest.
    let ready = Session { state: State::Ready, trust: Trust::Trusted, ..Session::default() };
    let (ready, _) = step(&ready, Event::Stop { now_ms: 0 });
    let (jogs, _) = step(&ready, Event::Jog { axis: 0, distance_um: 100 });
    let (_, actions) = step(&jogs, Event::Stop { now_ms: 100 });
    assert_eq!(actions, [Action::Brake]);
}
