//! Tests of jogs with a simulated controller: how steady they are, and how far they continue without new
//! commands.

use super::{Bench, Faults};
use annulus_core::grbl::{EngineAsk, EngineEvent, EnginePhase};

const FAST: EngineAsk = EngineAsk::Jog { axis: 0, um: -100_000, mm_per_min: 1_000.0, anyway: false };
const SPEED_MM_PER_MS: f64 = 1.0 / 60.0;
/// Maximum distance that the controller may hold: 0.2 s of travel, one segment, and the segments in
/// transit.
const MOST_MM: f64 = 0.25 * 1e3 * SPEED_MM_PER_MS;

fn moving() -> (Bench, f64) {
    let mut bench = Bench::new(1, Faults::default());
    assert!(bench.ready());
    bench.until(500, |_| false);
    let from = bench.board.place()[0];
    bench.event(EngineEvent::Ask(FAST));
    assert!(bench.until(100, |bench| bench.board.place()[0] != from));
    (bench, from)
}

/// Advances only the controller.
fn left_alone(bench: &mut Bench, ms: u32) {
    (0..ms).for_each(|_| bench.board.tick());
}

#[test]
fn jog_speed_is_constant_until_its_end() {
    let (mut bench, from) = moving();
    let (mut before, mut ms) = (bench.board.place()[0], 0);
    while bench.engine().phase == EnginePhase::Jogging && before > from - 100.0 + 0.02 {
        bench.tick();
        ms += 1;
        let now = bench.board.place()[0];
        assert!((before - now - SPEED_MM_PER_MS).abs() < 1e-6, "it falters {} mm on its way", from - now);
        before = now;
    }
    assert!((5_950..6_010).contains(&ms), "{ms} ms");
    assert!(bench.until(1_000, |bench| bench.engine().phase == EnginePhase::Ready));
    assert!((bench.board.place()[0] - from + 100.0).abs() < 1e-6);
    assert_eq!(bench.board.overrun, 0);
}

#[test]
fn unplugged_jog_ends_soon() {
    for after_ms in [3, 50, 200, 1_000, 3_000] {
        let (mut bench, _) = moving();
        bench.until(after_ms, |_| false);
        let from = bench.board.place()[0];
        bench.unplug();
        left_alone(&mut bench, 20_000);
        let way = from - bench.board.place()[0];
        assert!(way <= MOST_MM, "pulled after {after_ms} ms it went on for {way} mm");
        assert!(way >= 0.1 * 1e3 * SPEED_MM_PER_MS, "there is some ahead, {after_ms} ms: {way} mm");
    }
}

#[test]
fn cancelled_jog_stops_within_50_ms_of_travel() {
    let (mut bench, _) = moving();
    bench.until(777, |_| false);
    let from = bench.board.place()[0];
    bench.event(EngineEvent::Ask(EngineAsk::JogCancel));
    assert!(bench.until(1_000, |bench| bench.engine().phase == EnginePhase::Ready));
    bench.until(1_000, |_| false);
    let way = from - bench.board.place()[0];
    assert!(way <= 0.05 * 1e3 * SPEED_MM_PER_MS, "it went on for {way} mm");
}

#[test]
fn jog_continues_to_its_end_after_a_late_computer() {
    // The controller had stopped at the end of the last segment it received.
    let (mut bench, from) = moving();
    bench.until(1_000, |_| false);
    left_alone(&mut bench, 1_500);
    assert!(bench.until(20_000, |bench| bench.engine().phase == EnginePhase::Ready));
    assert!((bench.board.place()[0] - from + 100.0).abs() < 1e-6);
}

#[test]
fn refused_jog_segment_ends_the_jog() {
    let (mut bench, from) = moving();
    bench.until(300, |_| false);
    bench.board.refuses_jogs = true;
    assert!(bench.until(2_000, |bench| bench.engine().phase == EnginePhase::Ready));
    let rests = bench.board.place()[0];
    assert!((1.0..2.0 * MOST_MM + 5.0).contains(&(from - rests)), "{}", from - rests);
    let said: Vec<String> = super::survey::found(&bench);
    assert_eq!(said.iter().filter(|code| *code == "grbl.error_15").count(), 1, "{said:?}");
    bench.until(1_000, |_| false);
    assert_eq!(bench.board.place()[0], rests);
    // The next jog is a separate one.
    bench.board.refuses_jogs = false;
    let height = bench.board.place()[2];
    bench.event(EngineEvent::Ask(EngineAsk::Jog { axis: 2, um: -500, mm_per_min: 300.0, anyway: false }));
    assert!(bench.until(2_000, |bench| bench.engine().phase == EnginePhase::Ready));
    assert!((height - bench.board.place()[2] - 0.5).abs() < 1e-6 && bench.board.place()[0] == rests);
}

#[test]
fn cancelled_jog_leaves_the_controller_listening() {
    let (mut bench, _) = moving();
    bench.board.deaf_after_cancel = true;
    for _ in 0..3 {
        bench.until(300, |_| false);
        bench.event(EngineEvent::Ask(EngineAsk::JogCancel));
        assert!(bench.until(1_000, |bench| bench.engine().phase == EnginePhase::Ready));
        let from = bench.board.place()[0];
        bench.event(EngineEvent::Ask(FAST));
        assert!(bench.until(300, |bench| bench.board.place()[0] != from), "the next jog moves at once");
    }
    let said = super::survey::found(&bench);
    assert!(said.is_empty(), "{said:?}");
}
