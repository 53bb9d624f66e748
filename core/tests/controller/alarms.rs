//! Alarms whose line may have been changed on its way: what is believed of the place behind one, and how a board is taken up again that
//! waits for its reset.

use super::survey::found;
use super::{Bench, Faults, job};
use annulus_core::control::Trust;
use annulus_core::controller::{EngineAction, EngineAsk, EngineEvent, EnginePhase};

/// Down into the air.
const PROBE: EngineAsk = EngineAsk::Probe { depth_mm: 40.0, mm_per_min: 60.0, plate_mm: 0.0, up_mm: 1.0 };

fn ready() -> Bench {
    let mut bench = Bench::new(1, Faults::default());
    assert!(bench.ready());
    bench.told.clear();
    bench
}

/// The probe is on its way down.
fn probing() -> Bench {
    let mut bench = ready();
    bench.asked(PROBE);
    bench.until(500, |_| false);
    assert_eq!(bench.engine().phase, EnginePhase::Probing);
    bench
}

impl Bench {
    /// A line comes that the board did not say.
    fn heard(&mut self, line: &str) {
        self.event(EngineEvent::Bytes(format!("{line}\r\n").into_bytes()));
    }
}

#[test]
fn an_alarm_of_the_probe_or_of_a_soft_limit_is_believed_where_one_can_be() {
    let jog = EngineAsk::Jog { axis: 2, um: -5_000, mm_per_min: 60.0 };
    for alarm in [2, 4, 5] {
        let mut rests = ready();
        let mut jogs = ready();
        jogs.asked(jog.clone());
        jogs.until(300, |_| false);
        let mut runs = ready();
        runs.start(0);
        runs.until(500, |_| false);
        let mut changes = ready();
        changes.start_as(job(0));
        changes.phases(EnginePhase::ToolChange);
        // No soft limits are on.
        let mut probes = probing();
        for (bench, believed) in [
            (&mut rests, false),
            (&mut jogs, false),
            (&mut runs, false),
            (&mut changes, false),
            (&mut probes, alarm != 2),
        ] {
            let phase = bench.engine().phase;
            bench.heard(&format!("ALARM:{alarm}"));
            let trust = if believed { Trust::Trusted } else { Trust::Lost };
            assert_eq!(
                (bench.engine().phase, bench.engine().trust),
                (EnginePhase::Locked, trust),
                "{alarm} in {phase:?}"
            );
        }
    }
}

#[test]
fn behind_a_soft_limit_the_place_stays_known() {
    let mut bench = Bench::new(1, Faults::default());
    bench.board.settings.push((20, 1.0));
    assert!(bench.ready());
    // Past the lower end, as the board itself counts.
    bench.asked(EngineAsk::Probe { depth_mm: 400.0, mm_per_min: 60.0, plate_mm: 0.0, up_mm: 1.0 });
    assert!(bench.until(2_000, |bench| bench.engine().phase == EnginePhase::Locked));
    assert_eq!((found(&bench), bench.engine().trust), (vec!["grbl.alarm_2".to_owned()], Trust::Trusted));
    bench.asked(EngineAsk::Unlock);
    bench.phases(EnginePhase::Ready);
    assert_eq!((found(&bench), bench.engine().trust), (Vec::new(), Trust::Trusted));
    // The same number where nothing moves is another one's.
    bench.heard("ALARM:2");
    assert_eq!(bench.engine().trust, Trust::Lost);
}

#[test]
fn a_switch_whose_alarm_was_heard_as_that_of_the_probe_has_lost_the_place() {
    // It says that it waits for a reset.
    let mut bench = probing();
    bench.heard_instead = Some(("ALARM:1", "ALARM:5"));
    bench.board.is_stopped(1);
    bench.until(50, |_| false);
    assert_eq!((found(&bench), bench.engine().trust), (vec!["grbl.alarm_5".to_owned()], Trust::Lost));
    bench.asked(EngineAsk::Unlock);
    bench.phases(EnginePhase::Ready);
    assert_eq!(bench.engine().trust, Trust::Lost);
    // That was lost too, and the board reports or does not: it is unlocked, or begun anew.
    for reports in [true, false] {
        for ask in [EngineAsk::Unlock, EngineAsk::Stop] {
            if reports && ask_is_stop(&ask) {
                continue;
            }
            let mut bench = probing();
            bench.board.reports_waiting = reports;
            bench.heard_instead = Some(("ALARM:1\r\n[MSG:Reset to continue]", "ALARM:5"));
            bench.board.is_stopped(1);
            bench.until(1_000, |_| false);
            assert_eq!(bench.engine().trust, Trust::Trusted, "so far it can be one of the probe");
            bench.asked(ask.clone());
            let lost = bench.until(20_000, |bench| bench.engine().trust == Trust::Lost);
            assert!(lost, "reports {reports}, {ask:?}: {:?}", bench.words());
        }
    }
}

fn ask_is_stop(ask: &EngineAsk) -> bool {
    matches!(ask, EngineAsk::Stop)
}

#[test]
fn after_a_real_alarm_of_the_probe_the_place_is_known_however_it_is_taken_up() {
    for ask in [EngineAsk::Unlock, EngineAsk::Stop] {
        let mut bench = ready();
        bench.asked(EngineAsk::Probe { depth_mm: 2.0, mm_per_min: 600.0, plate_mm: 0.0, up_mm: 1.0 });
        assert!(bench.until(5_000, |bench| bench.engine().phase == EnginePhase::Locked));
        bench.until(1_000, |_| false);
        bench.asked(ask.clone());
        bench.until(5_000, |_| false);
        assert_eq!(bench.engine().trust, Trust::Trusted, "{ask:?}: {:?}", bench.words());
    }
}

#[test]
fn a_board_that_waits_for_its_reset_is_there_and_says_nothing() {
    for heard in ["ALARM:1", "ALARN:1"] {
        let mut bench = ready();
        bench.start(0);
        bench.until(500, |_| false);
        bench.heard_instead = Some(("ALARM:1", heard));
        bench.board.is_stopped(1);
        bench.until(50, |_| false);
        assert_eq!(
            (bench.engine().phase, bench.engine().trust),
            (EnginePhase::Locked, Trust::Lost),
            "{heard}"
        );
        bench.until(60_000, |_| false);
        assert_eq!(bench.engine().phase, EnginePhase::Locked, "{heard}: {:?}", bench.words());
        assert!(!bench.told.contains(&EngineAction::Close), "{heard}");
        bench.asked(EngineAsk::Home);
        let homed = bench.until(20_000, |bench| bench.engine().trust == Trust::Trusted);
        assert!(homed, "{heard}: {:?}", bench.words());
    }
}
