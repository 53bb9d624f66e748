//! Tests of Pause: on a toolpath it slows at once and holds on the path; a drill cycle ends and lifts.
//! Resume continues exactly on the path.

use super::port::milled;
use super::*;
use annulus_core::machine::Value;
use annulus_core::steps::Stage;

/// A machine at 10 mm/s stops within this time of the test's clock.
const AT_ONCE: Duration = Duration::from_millis(600);

/// Milling in the middle of a toolpath, in real time.
fn milling(lifts: bool) -> Bench {
    let mut bench = Bench::open_at(&Memory::default(), 1.0);
    if lifts {
        let yes = ("stroke.lift_at_pause".to_owned(), Value::Text("yes".to_owned()));
        bench.ask(&Ask::Configure { changes: vec![yes] });
        assert_eq!(bench.refused(), None);
    }
    bench.home();
    bench.ask(&Ask::SetZero);
    bench.turn(Duration::from_millis(200));
    bench.start(&milled(), 0);
    bench.until(|status| status.state == State::ToolChange);
    bench.ask(&Ask::ToolChanged);
    bench.until(|status| status.stage == Some(Stage::Mill));
    // Well into the first circle.
    (0..100).for_each(|_| bench.turn(TURN));
    bench.ask(&Ask::Ping { stamp: 0.0 });
    bench
}

fn paused(bench: &mut Bench) -> (Status, Duration) {
    let since = now();
    bench.ask(&Ask::Pause);
    let status = bench.until(|status| status.state == State::Paused);
    (status, now() - since)
}

/// Checks that nothing moves for two seconds.
fn stands_still(bench: &mut Bench) {
    let at = bench.status().steps;
    (0..20).for_each(|_| bench.ping_later(Duration::from_millis(100)));
    assert_eq!((bench.status().steps, bench.status().state), (at, State::Paused));
}

#[test]
fn pause_holds_on_the_path_at_once_and_resume_continues() {
    let mut whole = milling(false);
    assert_eq!(whole.finish().0, Ending::Done);
    let whole = whole.until(|status| status.state == State::Ready);
    let mut bench = milling(false);
    for pause in 0..3 {
        let (status, took) = paused(&mut bench);
        assert!(took <= AT_ONCE, "pause {pause} took {took:?}");
        assert_eq!((status.paused_on_path, status.trust), (Some(false), Trust::Trusted));
        assert!(status.work_mm[2] < 0.0 && status.spindle_rpm > 0, "{status:?}");
        stands_still(&mut bench);
        bench.ask(&Ask::Resume);
        assert_eq!(bench.status().state, State::Running);
        (0..60).for_each(|_| bench.turn(TURN));
        bench.ask(&Ask::Ping { stamp: 0.0 });
        assert_ne!(bench.status().steps, status.steps, "it continues");
    }
    assert_eq!(bench.finish().0, Ending::Done);
    let status = bench.until(|status| status.state == State::Ready);
    assert_eq!((status.steps, status.toolpaths_done), (whole.steps, whole.toolpaths_done));
    assert!(status.slips.is_empty() && status.alarm.is_none(), "{status:?}");
}

#[test]
fn lifted_tool_returns_to_the_same_point() {
    for set in [false, true] {
        let mut bench = milling(set);
        let (held, _) = paused(&mut bench);
        if !set {
            bench.ask(&Ask::LiftTool);
        }
        let lifted = bench.until(|status| status.paused_on_path == Some(true));
        assert_eq!((lifted.spindle_rpm, lifted.state), (0, State::Paused), "set {set}");
        assert!(lifted.machine_mm[2] > -1.01, "the tip is up: {lifted:?}");
        assert_eq!(lifted.steps[..2], held.steps[..2], "straight up");
        stands_still(&mut bench);
        bench.ask(&Ask::Resume);
        let back = bench.until(|status| status.stage == Some(Stage::Mill) && status.work_mm[2] < 0.0);
        assert!(back.spindle_rpm > 0);
        assert_eq!(bench.finish().0, Ending::Done);
        let status = bench.until(|status| status.state == State::Ready);
        assert!(status.slips.is_empty() && status.alarm.is_none(), "{status:?}");
    }
}

#[test]
fn stop_ends_a_job_paused_on_its_path() {
    for (ask, lift) in [(Ask::Stop, false), (Ask::Stop, true), (Ask::StopAfterHole, false)] {
        let mut bench = milling(false);
        paused(&mut bench);
        if lift {
            bench.ask(&Ask::LiftTool);
            bench.until(|status| status.paused_on_path == Some(true));
        }
        bench.ask(&ask);
        let status = bench.until(|status| status.state == State::Ready);
        assert_eq!((status.trust, status.spindle_rpm), (Trust::Trusted, 0), "{ask:?}, lifted {lift}");
        assert!(status.machine_mm[2] > -1.01 && status.paused_on_path.is_none(), "{status:?}");
        assert!(bench.offer().is_some(), "it can be resumed");
    }
}

#[test]
fn cancelled_pause_holds_nothing() {
    let mut bench = milling(false);
    bench.ask(&Ask::Pause);
    bench.ask(&Ask::Resume);
    assert_eq!(bench.status().state, State::Running);
    bench.ask(&Ask::Pause);
    bench.ask(&Ask::StopAfterHole);
    assert_eq!(bench.finish().0, Ending::StoppedAfterHole);
}

#[test]
fn drill_cycle_ends_and_lifts_before_a_pause() {
    let mut bench = Bench::open_at(&Memory::default(), 1.0);
    bench.home();
    bench.ask(&Ask::SetZero);
    bench.turn(Duration::from_millis(200));
    bench.start(&holes(20), 0);
    bench.until(|status| status.state == State::ToolChange);
    bench.ask(&Ask::ToolChanged);
    bench.until(|status| status.holes_done == 3 && status.stage == Some(Stage::Drill));
    let done = bench.status().holes_done;
    let (status, _) = paused(&mut bench);
    assert!(status.holes_done > done, "the hole is drilled to its end");
    assert_eq!((status.paused_on_path, status.spindle_rpm), (None, 0));
    assert!(status.work_mm[2] > 0.0, "{status:?}");
    bench.ask(&Ask::LiftTool);
    assert_eq!(bench.refused(), Some("control.nothing_to_do"));
    bench.ask(&Ask::Resume);
    assert_eq!(bench.finish(), (Ending::Done, 20));
}

#[test]
fn adapter_pauses_on_the_path_and_cannot_lift_there() {
    let mut bench = port::ready(&Memory::default());
    bench.start(&milled(), 0);
    bench.until(|status| status.state == State::ToolChange);
    bench.ask(&Ask::ToolChanged);
    bench.until(|status| status.work_mm[2] < -0.09);
    (0..100).for_each(|_| bench.turn(TURN));
    bench.ask(&Ask::Ping { stamp: 0.0 });
    let (status, took) = paused(&mut bench);
    assert!(took <= AT_ONCE, "{took:?}");
    assert_eq!(status.paused_on_path, Some(false));
    stands_still(&mut bench);
    bench.ask(&Ask::LiftTool);
    assert_eq!(bench.refused(), Some("control.no_lift_on_path"));
    bench.ask(&Ask::Resume);
    assert_eq!(bench.finish().0, Ending::Done);
    let status = bench.until(|status| status.state == State::Ready);
    let real = bench.world().real();
    assert_eq!(real[..], status.steps[..3], "every step is counted");
}
