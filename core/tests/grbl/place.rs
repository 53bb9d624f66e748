//! Tests of the trusted position with a simulated controller: a damaged zero, an unnoticed restart, and
//! STOP pressed again after the first one was lost.

use super::survey::found;
use super::{Bench, Faults, ZERO, job};
use annulus_core::control::{Ending, Trust};
use annulus_core::grbl::{EngineAction, EngineAsk, EngineEvent, EnginePhase, EngineStart};

fn ready() -> Bench {
    let mut bench = Bench::new(1, Faults::default());
    assert!(bench.ready());
    bench
}

/// A controller without switches, whose zero was set manually, far from its position at power-on.
fn away() -> Bench {
    let mut bench = Bench::without_switches();
    for (axis, um) in [(0, -100_000), (1, -100_000), (2, -20_000)] {
        bench.asked(EngineAsk::Jog { axis, um, mm_per_min: 6_000.0, anyway: false });
        bench.phases(EnginePhase::Ready);
    }
    bench.asked(EngineAsk::SetZero { axes: [true; 3], height_mm: 5.0 });
    assert!(bench.until(2_000, |bench| bench.told.contains(&EngineAction::ZeroSet)));
    bench.until(1_000, |bench| bench.engine().place().is_some());
    bench
}

/// A status report whose work offset lost the first digit of Y.
fn damaged(bench: &Bench) -> EngineEvent {
    let [x, y, z] = bench.engine().status.as_ref().and_then(|status| status.machine_mm).unwrap();
    let text = format!("<Idle|MPos:{x:.3},{y:.3},{z:.3}|FS:0,0|WCO:-150.000,-50.000,-30.000>\r\n");
    EngineEvent::Bytes(text.into_bytes())
}

#[test]
fn job_start_is_refused_if_the_stored_zero_differs() {
    let mut bench = ready();
    let report = damaged(&bench);
    bench.event(report);
    bench.start(0);
    assert_eq!(
        (found(&bench), bench.engine().phase),
        (vec!["grbl.zero_differs".to_owned()], EnginePhase::Ready)
    );
    // The next report is correct.
    bench.until(1_000, |_| false);
    bench.start(0);
    assert_eq!((found(&bench), bench.engine().phase), (vec![], EnginePhase::Running));
}

#[test]
fn damaged_zero_is_read_again_before_a_tool_plunges() {
    let mut bench = ready();
    bench.start_as(EngineStart { same_length: true, ..job(0) });
    let so = |bench: &Bench| bench.ended().is_some() || bench.engine().phase == EnginePhase::ToolChange;
    loop {
        assert!(bench.until(600_000, so), "{:?}", bench.words());
        if bench.ended().is_some() {
            break;
        }
        let report = damaged(&bench);
        bench.event(report);
        bench.event(EngineEvent::Ask(EngineAsk::ToolReady));
        assert_eq!(bench.engine().phase, EnginePhase::ToolChange, "not by that one");
        assert!(bench.until(5_000, |bench| bench.engine().phase == EnginePhase::Running));
    }
    assert_eq!((bench.ended(), bench.missing(), bench.wrong()), (Some(Ending::Done), vec![], vec![]));
}

#[test]
fn zero_of_another_coordinate_system_is_refused() {
    let mut bench = ready();
    let zero = bench.engine().zero_mm.unwrap();
    // Caused, for example, by a startup line of the controller or a button at the machine.
    bench.board.zeros[1] = [-100.0, -100.0, -20.0];
    bench.board.leaves_in_force(2);
    bench.until(1_000, |_| false);
    bench.start(0);
    assert!(found(&bench).contains(&"grbl.zero_differs".to_owned()), "{:?}", found(&bench));
    bench.asked(EngineAsk::ZeroAt { place_mm: zero.map(Some) });
    assert!(bench.until(2_000, |bench| bench.told.contains(&EngineAction::ZeroSet)), "{:?}", bench.words());
    bench.until(1_000, |bench| bench.engine().place().is_some());
    bench.start(0);
    assert_eq!(found(&bench), Vec::<String>::new());
    assert!(bench.run());
    assert_eq!((bench.ended(), bench.missing(), bench.wrong()), (Some(Ending::Done), vec![], vec![]));
}

#[test]
fn unheard_reset_without_switches_loses_the_position() {
    for in_a_change in [false, true] {
        let mut bench = away();
        if in_a_change {
            bench.start(0);
            bench.phases(EnginePhase::ToolChange);
        }
        bench.told.clear();
        bench.board.power_up_unheard();
        assert!(bench.until(2_000, |bench| bench.engine().trust == Trust::Lost), "{in_a_change}");
        assert_eq!(found(&bench), ["grbl.reset_by_itself"], "{in_a_change}");
        assert_eq!(bench.ended(), in_a_change.then_some(Ending::Alarm));
        bench.until(5_000, |_| false);
        bench.start(0);
        assert!(found(&bench).iter().any(|code| code == "grbl.no_zero" || code == "grbl.not_now"));
    }
}

#[test]
fn second_stop_during_parking_resets_at_once() {
    let mut bench = ready();
    bench.asked(EngineAsk::Jog { axis: 2, um: 25_000, mm_per_min: 6_000.0, anyway: false });
    bench.phases(EnginePhase::Ready);
    // The line loses every jog cancel.
    bench.instead = Some((b"\x85", b""));
    bench.asked(EngineAsk::Park { from_low_mm: Some([10.0, 10.0]) });
    assert!(bench.until(5_000, |bench| bench.board.at[0] < -20.0), "{:?}", bench.words());
    bench.asked(EngineAsk::Stop);
    bench.until(460, |_| false);
    let from = bench.board.at;
    bench.until(50, |_| false);
    assert_ne!(bench.board.at, from, "it was not heard");
    bench.asked(EngineAsk::Stop);
    bench.until(20, |_| false);
    let rests = bench.board.at;
    bench.until(5_000, |_| false);
    assert_eq!((bench.board.at[..2] == rests[..2], bench.engine().trust), (true, Trust::Lost));
}

#[test]
fn stop_after_a_cancelled_jog_counts_as_the_first() {
    let mut bench = ready();
    bench.asked(EngineAsk::Jog { axis: 0, um: -100_000, mm_per_min: 1_000.0, anyway: false });
    bench.until(500, |_| false);
    bench.event(EngineEvent::Ask(EngineAsk::JogCancel));
    bench.event(EngineEvent::Ask(EngineAsk::Stop));
    bench.phases(EnginePhase::Ready);
    assert_eq!(bench.engine().trust, Trust::Trusted);
}

#[test]
fn zero_ignores_leftover_offsets() {
    fn board(_: f64, _: f64) -> f64 {
        ZERO[2]
    }
    let touch = EngineAsk::Probe { depth_mm: 40.0, mm_per_min: 300.0, plate_mm: 0.0, up_mm: 2.0 };
    let edge = ZERO.map(|mm| Some(mm + 0.5));
    for (ask, wanted) in [(touch, ZERO), (EngineAsk::ZeroAt { place_mm: edge }, ZERO.map(|mm| mm + 0.5))] {
        let mut bench = ready();
        bench.board.surface = Some(board);
        (bench.board.length, bench.board.shift) = (3.25, [0.0, 1.5, 0.0]);
        // The engine reads the offsets when a zero is set.
        bench.asked(EngineAsk::ZeroAt { place_mm: [Some(ZERO[0]), None, None] });
        bench.until(3_000, |_| false);
        bench.asked(ask.clone());
        assert!(
            bench.until(20_000, |bench| bench.told.contains(&EngineAction::ZeroSet)),
            "{:?}",
            bench.words()
        );
        bench.phases(EnginePhase::Ready);
        bench.until(1_000, |_| false);
        let zero = bench.board.zero();
        let off = zero.iter().zip(wanted).map(|(zero, wanted)| (zero - wanted).abs()).fold(0.0, f64::max);
        assert!(off < 0.011, "{ask:?}: {zero:?}, not {wanted:?}");
    }
}

#[test]
fn unheard_reset_in_a_job_loses_the_position() {
    for held in [false, true] {
        let mut bench = away();
        bench.start(0);
        bench.phases(EnginePhase::ToolChange);
        bench.event(EngineEvent::Ask(EngineAsk::ToolReady));
        assert!(bench.until(60_000, |bench| bench.done == 3), "{:?}", bench.words());
        if held {
            bench.event(EngineEvent::Ask(EngineAsk::Hold));
            bench.phases(EnginePhase::Held);
        }
        bench.board.power_up_unheard();
        assert!(bench.until(20_000, |bench| bench.ended().is_some()), "{:?}", bench.words());
        bench.until(5_000, |_| false);
        assert_eq!((bench.ended(), bench.engine().trust), (Some(Ending::Alarm), Trust::Lost), "{held}");
    }
}

#[test]
fn stop_cancels_a_requested_homing() {
    let mut bench = ready();
    bench.board.lock_unheard();
    bench.phases(EnginePhase::Locked);
    bench.asked(EngineAsk::Home);
    assert_eq!(bench.engine().phase, EnginePhase::Locked, "it begins anew first");
    bench.event(EngineEvent::Ask(EngineAsk::Stop));
    bench.until(10_000, |_| false);
    let homes = bench.told.iter().any(|told| *told == EngineAction::Write(b"$H\n".to_vec()));
    assert!(!homes, "{:?}", bench.words());
}
