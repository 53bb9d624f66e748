//! Tests of alarms whose line may have been damaged on the way: whether the position stays trusted, and how
//! a waiting controller is used again.

use super::survey::found;
use super::{Bench, Faults, job};
use annulus_core::control::Trust;
use annulus_core::grbl::{EngineAction, EngineAsk, EngineEvent, EnginePhase};

/// A probe in the air: nothing is touched for a long time.
const PROBE: EngineAsk = EngineAsk::Probe { depth_mm: 40.0, mm_per_min: 60.0, plate_mm: 0.0, up_mm: 1.0 };

fn ready() -> Bench {
    let mut bench = Bench::new(1, Faults::default());
    assert!(bench.ready());
    bench.told.clear();
    bench
}

fn probing() -> Bench {
    let mut bench = ready();
    bench.asked(PROBE);
    bench.until(500, |_| false);
    assert_eq!(bench.engine().phase, EnginePhase::Probing);
    bench
}

impl Bench {
    /// Feeds a line to the engine that the controller did not send.
    fn heard(&mut self, line: &str) {
        self.event(EngineEvent::Bytes(format!("{line}\r\n").into_bytes()));
    }
}

#[test]
fn probe_and_soft_limit_alarms_count_only_when_possible() {
    let jog = EngineAsk::Jog { axis: 2, um: -5_000, mm_per_min: 60.0, anyway: false };
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
        // Soft limits are off.
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
fn soft_limit_alarm_preserves_the_position() {
    let mut bench = Bench::new(1, Faults::default());
    bench.board.settings.push((20, 1.0));
    assert!(bench.ready());
    // Deeper than the lower end of the travel in the controller's own coordinates.
    bench.asked(EngineAsk::Probe { depth_mm: 400.0, mm_per_min: 60.0, plate_mm: 0.0, up_mm: 1.0 });
    assert!(bench.until(2_000, |bench| bench.engine().phase == EnginePhase::Locked));
    assert_eq!((found(&bench), bench.engine().trust), (vec!["grbl.alarm_2".to_owned()], Trust::Trusted));
    bench.asked(EngineAsk::Unlock);
    bench.phases(EnginePhase::Ready);
    assert_eq!((found(&bench), bench.engine().trust), (Vec::new(), Trust::Trusted));
    // Without a move the same number can't be a soft limit: the line was damaged.
    bench.heard("ALARM:2");
    assert_eq!(bench.engine().trust, Trust::Lost);
}

#[test]
fn misheard_limit_switch_alarm_loses_the_position() {
    // The controller reports that it waits for a reset.
    let mut bench = probing();
    bench.heard_instead = Some(("ALARM:1", "ALARM:5"));
    bench.board.is_stopped(1);
    bench.until(50, |_| false);
    assert_eq!((found(&bench), bench.engine().trust), (vec!["grbl.alarm_5".to_owned()], Trust::Lost));
    bench.asked(EngineAsk::Unlock);
    bench.phases(EnginePhase::Ready);
    assert_eq!(bench.engine().trust, Trust::Lost);
    // If that message is lost too, the user unlocks or stops. The controller reports its state meanwhile,
    // or does not.
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
fn probe_alarm_preserves_the_position() {
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
fn silent_controller_that_awaits_reset_is_not_closed() {
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
