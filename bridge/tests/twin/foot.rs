//! Tests of the presser foot on a card. STOP, an alarm and a killed bridge within a drill cycle lift the
//! foot, but never while the tool is in the board.

use super::{Bench, SURFACE_MM, number, text};
use crate::server::drill;
use annulus_core::control::State;
use annulus_core::geometry::Point;
use annulus_core::job::Input;
use annulus_core::machine::Value;
use annulus_core::virtual_drill::Faults;
use annulus_core::wire::Ask;
use std::thread;
use std::time::Duration;

fn with_foot() -> [(&'static str, Value); 3] {
    [("foot.on", text("yes")), ("foot.time", number(80.0)), ("stroke.feed", number(1.0))]
}

/// In the middle of the second drill cycle, the tool half a millimetre in the board.
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

/// Checks that the foot is up, and was never up while the tool was below the surface.
fn judge(bench: &Bench, what: &str) {
    // The wires are read a moment later.
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
fn foot_rises_only_out_of_the_board_after_stop_alarm_and_kill() {
    let mut bench = in_the_board();
    bench.page.ask(&Ask::Stop);
    bench.until(|status| status.state == State::Stopping);
    assert_eq!(bench.rests(), None);
    judge(&bench, "STOP");

    let mut bench = in_the_board();
    bench.seen().forced = Input::CoverOpen.bit();
    assert_eq!(bench.until(|status| status.alarm.is_some()).state, State::Alarm);
    assert_eq!(bench.rests().as_deref(), Some("control.cover_open"));
    judge(&bench, "an alarm");

    let mut bench = in_the_board();
    bench.bridge.child.kill().unwrap();
    bench.bridge.child.wait().unwrap();
    bench.until_let_go();
    judge(&bench, "a killed bridge");
}
