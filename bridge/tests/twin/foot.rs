//! The presser foot of a card: up after STOP, after an alarm and after the bridge was killed in the middle of a stroke, and never up
//! while the bit is in the board (C7).

use super::{Bench, SURFACE_MM, number, text};
use crate::server::client::in_peace;
use crate::server::drill;
use annulus_core::control::State;
use annulus_core::geometry::Point;
use annulus_core::job::Input;
use annulus_core::machine::Value;
use annulus_core::virtual_drill::Faults;
use annulus_core::wire::Ask;
use std::thread;
use std::time::Duration;

/// Slow strokes, so that one is met in its middle.
fn with_foot() -> [(&'static str, Value); 3] {
    [("foot.on", text("yes")), ("foot.time", number(80.0)), ("stroke.feed", number(1.0))]
}

/// In the middle of the second stroke, the bit half a millimetre in the board.
fn in_the_board() -> Bench {
    let mut bench = Bench::new(&with_foot(), Faults::default());
    bench.ready([1_000, 1_000]);
    let at = (0..3).map(|hole| Point::from_mm(f64::from(hole) * 2.0, 0.0));
    let program = drill::holes(&bench.machine, vec![drill::spin_up(50_000)], (at, 1_000), drill::back());
    bench.start(&program);
    bench.until(|status| status.holes_done == 1 && status.work_mm[2] < -0.5);
    assert!(bench.seen().foot.last().is_some_and(|(is_down, _)| *is_down), "the foot is down");
    bench
}

/// The foot is up, and was never while the tip was below the surface.
fn judge(bench: &Bench, what: &str) {
    // The wires are looked at a moment later.
    thread::sleep(Duration::from_millis(20));
    let seen = bench.seen();
    let surface = (SURFACE_MM * 10.0).round() as i64;
    let [.., (is_down, _)] = seen.foot[..] else { panic!("{what}: it was never switched") };
    assert!(!is_down, "{what}: the foot is up");
    assert_eq!(seen.foot.len(), 4, "{what}: down and up with each stroke {:?}", seen.foot);
    let above = |(_, z): &(bool, i64)| *z >= surface;
    assert!(seen.foot.iter().all(above), "{what}: switched with the bit in the board {:?}", seen.foot);
    assert!(seen.drill.real()[2] >= surface && seen.bytes[3] == 0, "{what}: up, everything off");
    assert_eq!(seen.drill.broken(), None, "{what}");
}

#[test]
fn the_foot_is_up_after_a_stop_an_alarm_and_a_killed_bridge_and_never_in_mid_cut() {
    in_peace(|| {
        let mut bench = in_the_board();
        bench.page.ask(&Ask::Stop);
        bench.until(|status| status.state == State::Stopping);
        assert_eq!(bench.rests(), None);
        judge(&bench, "STOP");
    });
    in_peace(|| {
        let mut bench = in_the_board().expecting(Some("control.cover_open"));
        bench.seen().forced = Input::CoverOpen.bit();
        assert_eq!(bench.until(|status| status.alarm.is_some()).state, State::Alarm);
        assert_eq!(bench.rests().as_deref(), Some("control.cover_open"));
        judge(&bench, "an alarm");
    });
    in_peace(|| {
        let mut bench = in_the_board();
        bench.bridge.child.kill().unwrap();
        bench.bridge.child.wait().unwrap();
        bench.until_let_go();
        judge(&bench, "a killed bridge");
    });
}
