//! Tests of user actions at the machine itself, outside of a job's path. They are reported once, end by
//! Resume or STOP, and are never waited for silently.

use super::setter::{NOTHING, ready, start};
use super::survey::found;
use super::{Bench, changer, job};
use annulus_core::control::{Ending, Trust};
use annulus_core::grbl::{EngineAction, EngineAsk, EngineEvent, EnginePhase, SurveyNews};

const PROBE: EngineAsk = EngineAsk::Probe { depth_mm: 40.0, mm_per_min: 120.0, plate_mm: 0.0, up_mm: 2.0 };

const ROWS: [(&str, &str); 3] =
    [("Door:0", "grbl.door"), ("Hold:0", "grbl.held_there"), ("Tool", "grbl.tool_there")];

type Way = (fn(&mut Bench), EnginePhase);

fn probes(bench: &mut Bench) {
    bench.asked(PROBE);
}

fn jogs(bench: &mut Bench) {
    bench.asked(EngineAsk::Jog { axis: 0, um: 20_000, mm_per_min: 300.0, anyway: false });
}

fn surveys(bench: &mut Bench) {
    bench.asked(EngineAsk::Survey(super::survey::start()));
}

fn measures(bench: &mut Bench) {
    bench.start_as(start(0));
    bench.phases(EnginePhase::Measuring);
}

fn changes(bench: &mut Bench) {
    bench.board.rack = Some(|_| 0.0);
    bench.start_as(changer::measured(&changer::FETCHES, 0));
    bench.phases(EnginePhase::Changing);
}

fn asks_for_a_tool(bench: &mut Bench) {
    bench.start_as(job(0));
    bench.phases(EnginePhase::ToolChange);
}

const WAYS: [Way; 6] = [
    (probes, EnginePhase::Probing),
    (jogs, EnginePhase::Jogging),
    (surveys, EnginePhase::Surveying),
    (measures, EnginePhase::Measuring),
    (changes, EnginePhase::Changing),
    (asks_for_a_tool, EnginePhase::ToolChange),
];

impl Bench {
    /// Enters the phase, then holds the machine locally for as long as a user may be away.
    fn held_as(&mut self, (leads, phase): Way, word: &'static str) {
        leads(self);
        self.until(700, |_| false);
        assert_eq!(self.engine().phase, phase, "{:?}", self.words());
        self.board.held = Some(word);
        self.told.clear();
        let at = self.board.at;
        self.until(40_000, |_| false);
        assert_eq!((self.engine().phase, self.board.at), (phase, at), "{:?}", self.words());
    }
}

#[test]
fn door_or_button_hold_is_reported_once_and_can_be_resumed() {
    for way in WAYS {
        for (word, code) in ROWS {
            let mut bench = ready();
            bench.held_as(way, word);
            assert_eq!(
                (found(&bench), bench.engine().stands()),
                (vec![code.to_owned()], true),
                "{way:?} {word}"
            );
            bench.asked(EngineAsk::Resume);
            bench.until(1_000, |_| false);
            assert_eq!((found(&bench), bench.board.held), (NOTHING, None), "{way:?} {word}");
            assert!(!bench.engine().stands(), "{way:?} {word}");
            match way.1 {
                EnginePhase::Measuring | EnginePhase::ToolChange => {
                    bench.phases(EnginePhase::ToolChange);
                    assert_eq!(bench.tool_ready(), NOTHING);
                }
                EnginePhase::Changing => assert_eq!(bench.is_over(), Some(Ending::Done), "{word}"),
                EnginePhase::Surveying => {
                    let is_over = |told: &EngineAction| {
                        matches!(told, EngineAction::Survey(SurveyNews::Over { survey: Some(_) }))
                    };
                    assert!(
                        bench.until(600_000, |bench| bench.told.iter().any(is_over)),
                        "{:?}",
                        bench.words()
                    );
                }
                _ => bench.phases(EnginePhase::Ready),
            }
            assert_eq!(bench.engine().trust, Trust::Trusted, "{way:?} {word}");
        }
    }
}

#[test]
fn stop_ends_a_door_or_button_hold_with_a_known_position() {
    for way in WAYS {
        for (word, _) in ROWS {
            let mut bench = ready();
            bench.held_as(way, word);
            bench.asked(EngineAsk::Stop);
            let before_ms = bench.now_ms;
            assert!(
                bench.until(20_000, |bench| bench.engine().phase == EnginePhase::Ready),
                "{way:?} {word}"
            );
            assert!(bench.now_ms < before_ms + 3_000, "{way:?} {word}: {} ms", bench.now_ms - before_ms);
            assert_eq!(bench.engine().trust, Trust::Trusted, "{way:?} {word}: {:?}", bench.words());
        }
    }
}

#[test]
fn sleeping_controller_loses_the_position_and_is_reported() {
    let mut ways = WAYS.to_vec();
    ways.push((|_| {}, EnginePhase::Ready));
    ways.push((
        |bench| {
            bench.start_as(job(0));
            bench.phases(EnginePhase::ToolChange);
            bench.tool_ready();
            bench.phases(EnginePhase::Running);
        },
        EnginePhase::Running,
    ));
    for (leads, phase) in ways {
        let mut bench = ready();
        leads(&mut bench);
        bench.until(200, |_| false);
        assert_eq!(bench.engine().phase, phase);
        let runs = bench.engine().routine().is_some();
        bench.told.clear();
        bench.board.held = Some("Sleep");
        assert!(bench.until(5_000, |bench| bench.engine().phase == EnginePhase::Locked), "{phase:?}");
        assert_eq!(
            (found(&bench), bench.engine().trust),
            (vec!["grbl.asleep".to_owned()], Trust::Lost),
            "{phase:?}"
        );
        assert_eq!(bench.ended(), runs.then_some(Ending::Alarm), "{phase:?}");
        // Homing wakes the controller.
        bench.asked(EngineAsk::Home);
        assert!(
            bench.until(20_000, |bench| bench.engine().phase == EnginePhase::Ready),
            "{phase:?}: {:?}",
            bench.words()
        );
        assert_eq!(bench.engine().trust, Trust::Trusted, "{phase:?}: {:?}", bench.words());
    }
    // STOP at the moment when the job stops.
    let mut bench = ready();
    bench.start_as(job(0));
    bench.phases(EnginePhase::ToolChange);
    bench.event(EngineEvent::Ask(EngineAsk::Stop));
    bench.board.held = Some("Sleep");
    bench.until(3_000, |_| false);
    assert_eq!(bench.engine().trust, Trust::Lost, "{:?}", bench.words());
}

/// A job that is held this long after its first tool was fitted.
fn held_in_job(after_ms: u64) -> Bench {
    let mut bench = ready();
    bench.start_as(job(0));
    bench.phases(EnginePhase::ToolChange);
    bench.tool_ready();
    bench.phases(EnginePhase::Running);
    bench.until(after_ms, |_| false);
    bench.event(EngineEvent::Ask(EngineAsk::Hold));
    bench.phases(EnginePhase::Held);
    bench
}

/// A hold was sent twice, and the second one travels together with the cycle start, as from a page that
/// froze. The controller processes both at once and ignores the cycle start.
#[test]
fn unheard_resume_is_reported_and_can_be_repeated() {
    let mut bench = held_in_job(300);
    for _ in 0..3 {
        bench.told.clear();
        bench.board.hear(b"!");
        bench.event(EngineEvent::Ask(EngineAsk::Resume));
        let at = bench.board.at;
        bench.until(30_000, |_| false);
        let is = (found(&bench), bench.engine().phase, bench.board.at);
        assert_eq!(is, (vec!["grbl.still_held".to_owned()], EnginePhase::Held, at), "{:?}", bench.words());
    }
    bench.told.clear();
    bench.event(EngineEvent::Ask(EngineAsk::Resume));
    // While the machine moves again, a hold that this program did not request is reported.
    bench.until(400, |_| false);
    assert_eq!((found(&bench), bench.engine().phase), (NOTHING.to_vec(), EnginePhase::Running));
    bench.board.hear(b"!");
    bench.until(5_000, |_| false);
    assert_eq!((found(&bench), bench.ended()), (vec!["grbl.held_by_itself".to_owned()], Some(Ending::Alarm)));
}

#[test]
fn resume_during_a_stalled_link_is_not_taken_for_a_hold() {
    for late_ms in (200..3_000).step_by(140) {
        let mut bench = held_in_job(1_500);
        bench.event(EngineEvent::Ask(EngineAsk::Resume));
        // Writes wait on the way, and so do the answers.
        bench.asleep_until_ms = bench.now_ms + late_ms;
        bench.until(late_ms + 2_000, |_| false);
        assert_eq!(found(&bench), NOTHING, "{late_ms} ms");
        assert!(bench.ended().is_none() || bench.ended() == Some(Ending::Done), "{late_ms} ms");
    }
}
