//! X and Y must not jog while the tool is, or may be, in the board. A double click on STOP counts as one
//! press.

use super::survey::found;
use super::{Bench, Faults, job};
use annulus_core::control::{Ending, Trust};
use annulus_core::grbl::{EngineAsk, EngineEvent, EnginePhase, EngineStart};

/// In the first hole of a job, with the tool at least half a millimetre deep.
fn cutting() -> Bench {
    let mut bench = Bench::new(1, Faults::default());
    assert!(bench.ready());
    bench.start_as(EngineStart { same_length: true, ..job(0) });
    bench.phases(EnginePhase::ToolChange);
    bench.asked(EngineAsk::ToolReady);
    assert!(bench.until(60_000, |bench| bench.engine().place().is_some_and(|place| place[2] < -0.5)));
    bench
}

fn stopped() -> Bench {
    let mut bench = cutting();
    bench.asked(EngineAsk::Stop);
    bench.phases(EnginePhase::Ready);
    assert!(bench.engine().place().unwrap()[2] < -0.5, "STOP leaves the tip where it is");
    bench
}

fn jog(bench: &mut Bench, axis: u8, um: i32, anyway: bool) -> Vec<String> {
    let before = bench.board.place();
    bench.asked(EngineAsk::Jog { axis, um, mm_per_min: 600.0, anyway });
    bench.until(4_000, |_| false);
    let (refused, moved) = (found(bench), bench.board.place() != before);
    assert_eq!(refused.is_empty(), moved, "{refused:?}");
    refused
}

fn lift(bench: &mut Bench) {
    let lift_mm = bench.engine().lift_first_mm().expect("the tip is low");
    assert_eq!(jog(bench, 2, (lift_mm * 1e3).ceil() as i32, false), Vec::<String>::new());
    assert_eq!(bench.engine().lift_first_mm(), None);
}

const LOW: [&str; 1] = ["control.tip_low"];

#[test]
fn xy_waits_until_the_tool_is_out_of_the_board() {
    let mut bench = stopped();
    for axis in 0..2 {
        assert_eq!(jog(&mut bench, axis, -1_000, false), LOW);
    }
    assert_eq!(jog(&mut bench, 0, -1_000, true), Vec::<String>::new(), "a person insists");
    assert_eq!(jog(&mut bench, 2, 200, false), Vec::<String>::new(), "Z is free");
    assert_eq!(jog(&mut bench, 0, -1_000, false), LOW, "not far enough");
    lift(&mut bench);
    for axis in 0..2 {
        assert_eq!(jog(&mut bench, axis, -1_000, false), Vec::<String>::new());
    }
}

#[test]
fn controller_reset_in_a_hole_still_locks_xy() {
    for homes in [false, true] {
        let mut bench = cutting();
        bench.board.power_up();
        bench.phases(EnginePhase::Locked);
        assert_eq!(bench.engine().trust, Trust::Lost);
        bench.asked(if homes { EngineAsk::Home } else { EngineAsk::Unlock });
        bench.phases(EnginePhase::Ready);
        if homes {
            assert_eq!(bench.engine().lift_first_mm(), None, "Z is all the way up");
            continue;
        }
        assert_eq!(jog(&mut bench, 0, 1_000, false), LOW);
        lift(&mut bench);
        assert_eq!(jog(&mut bench, 0, 1_000, false), Vec::<String>::new());
    }
}

#[test]
fn unplugging_in_a_hole_still_locks_xy() {
    let mut bench = cutting();
    bench.unplug();
    bench.plug();
    bench.phases(EnginePhase::Locked);
    bench.asked(EngineAsk::Unlock);
    bench.phases(EnginePhase::Ready);
    assert_eq!(jog(&mut bench, 0, 1_000, false), LOW);
}

#[test]
fn machine_without_known_zero_jogs_freely() {
    let mut bench = Bench::without_switches();
    bench.until(1_000, |bench| bench.engine().place().is_some());
    assert_eq!(bench.engine().lift_first_mm(), None);
    assert_eq!(jog(&mut bench, 0, 1_000, false), Vec::<String>::new());
}

#[test]
fn double_stop_preserves_the_position() {
    for (gap_ms, trust) in [(20, Trust::Trusted), (120, Trust::Trusted)] {
        let mut bench = cutting();
        bench.asked(EngineAsk::Stop);
        bench.until(gap_ms, |_| false);
        bench.event(EngineEvent::Ask(EngineAsk::Stop));
        bench.phases(EnginePhase::Ready);
        assert_eq!((bench.engine().trust, bench.ended()), (trust, Some(Ending::Stopped)), "{gap_ms} ms");
    }
}
