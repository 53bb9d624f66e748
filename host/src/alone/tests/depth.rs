//! Tests that X and Y do not jog while the tool is, or may be, in the board.

use super::*;

fn jog(bench: &mut Bench, axis: u8, distance_um: i32, anyway: bool) -> Option<String> {
    bench.heard.retain(|tell| !matches!(tell, Tell::Refused { .. }));
    let before = bench.status().steps;
    bench.ask(&Ask::Jog { axis, distance_um, anyway });
    for turn in 0..5_000 {
        bench.ask(&Ask::JogOn);
        bench.turn(TURN);
        if turn > 30 && bench.status().state != State::Jogging {
            break;
        }
    }
    let moved = bench.status().steps != before;
    let refused = bench.refused().map(str::to_owned);
    assert_eq!(refused.is_none(), moved, "{refused:?}");
    refused
}

/// Moves the raised tool 1 mm into the board.
fn lowered(bench: &mut Bench) {
    let down_mm = bench.status().work_mm[2] + 1.0;
    assert_eq!(jog(bench, 2, (-down_mm * 1e3) as i32, false), None);
    assert!(bench.status().work_mm[2] < -0.9);
}

const LOW: Option<&str> = Some("control.tip_low");

/// Presses STOP twice in a hole: the tool stays there.
fn held_in_a_hole() -> Bench {
    let mut bench = Bench::open_at(&Memory::default(), 1.0);
    bench.home();
    bench.ask(&Ask::SetZero);
    bench.turn(Duration::from_millis(200));
    bench.start(&holes(4), 0);
    bench.until(|status| status.state == State::ToolChange);
    bench.ask(&Ask::ToolChanged);
    bench.until(|status| status.stage == Some(annulus_core::steps::Stage::Drill) && status.work_mm[2] < -1.0);
    bench
}

#[test]
fn xy_waits_until_the_tool_is_lifted_out_of_a_hole() {
    let mut bench = held_in_a_hole();
    bench.ask(&Ask::Stop);
    bench.until(|status| status.state == State::Ready);
    assert_eq!(bench.status().lift_first_mm, None, "STOP lifted it");
    lowered(&mut bench);
    let lift_mm = bench.status().lift_first_mm.expect("it is in the board");
    assert_eq!(jog(&mut bench, 0, 1_000, false).as_deref(), LOW);
    assert_eq!(jog(&mut bench, 1, -1_000, false).as_deref(), LOW);
    jog(&mut bench, 2, (lift_mm * 1e3).ceil() as i32, false);
    assert_eq!(bench.status().lift_first_mm, None);
    assert_eq!(jog(&mut bench, 0, 1_000, false), None);
    // The user insists.
    lowered(&mut bench);
    assert_eq!(jog(&mut bench, 0, 1_000, true), None);
}

#[test]
fn lost_position_with_a_low_tool_still_locks_xy() {
    let mut bench = held_in_a_hole();
    bench.ask(&Ask::Stop);
    bench.until(|status| status.state == State::Ready);
    lowered(&mut bench);
    let lift_mm = bench.status().lift_first_mm.expect("it is in the board");
    // Stopping the homing at once loses the position.
    bench.ask(&Ask::Home);
    bench.ask(&Ask::Stop);
    bench.until(|status| status.state == State::NotHomed);
    let left_mm = bench.status().lift_first_mm;
    assert!(left_mm.is_some_and(|left_mm| left_mm > 0.5 && left_mm <= lift_mm), "{left_mm:?} of {lift_mm}");
    assert_eq!(jog(&mut bench, 0, 1_000, false).as_deref(), LOW);
    jog(&mut bench, 2, (lift_mm * 1e3).ceil() as i32, false);
    assert_eq!(jog(&mut bench, 0, 1_000, false), None);
}

#[test]
fn fresh_machine_jogs_before_homing() {
    let mut bench = Bench::open_at(&Memory::default(), 1.0);
    bench.turn(Duration::from_millis(200));
    assert_eq!(bench.status().lift_first_mm, None);
    assert_eq!(jog(&mut bench, 0, 1_000, false), None);
}

#[test]
fn job_interrupted_by_a_restart_locks_xy_until_homed() {
    let files = Memory::default();
    let bench = drilling(&files, &holes(20), 3);
    drop(bench);
    let mut bench = Bench::open(&files);
    bench.turn(Duration::from_millis(200));
    assert_eq!(jog(&mut bench, 0, 1_000, false).as_deref(), LOW);
    bench.home();
    assert_eq!(jog(&mut bench, 0, 1_000, false), None);
}
