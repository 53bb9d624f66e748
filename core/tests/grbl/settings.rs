//! Tests of controller settings that a job depends on: motors that are switched off when idle, and reports
//! in inches.

use super::survey::found;
use super::{Bench, Faults, ZERO, job, text};
use annulus_core::control::Ending;
use annulus_core::grbl::{EngineAction, EngineAsk, EnginePhase, EngineStart, read};
use std::sync::Arc;

#[test]
fn released_motors_give_a_warning_before_a_job() {
    for (ms, told) in [(25.0, true), (0.0, true), (254.0, true), (255.0, false)] {
        let mut bench = Bench::new(1, Faults::default());
        bench.board.settings.push((1, ms));
        assert!(bench.ready());
        bench.start_as(job(0));
        let codes = found(&bench);
        assert_eq!(codes.contains(&"grbl.motors_let_go".to_owned()), told, "{ms}: {codes:?}");
        assert_eq!(bench.engine().phase, EnginePhase::Running, "{ms}");
    }
}

const PROBE: EngineAsk = EngineAsk::Probe { depth_mm: 40.0, mm_per_min: 300.0, plate_mm: 0.0, up_mm: 2.0 };

#[test]
fn position_is_correct_with_reports_in_inches() {
    let mut bench = Bench::new(1, Faults::default());
    bench.board.zeros[0] = ZERO;
    bench.board.settings.retain(|(number, _)| *number != 13);
    bench.board.settings.push((13, 1.0));
    bench.board.rarely_tells_zero = true;
    // The greeting arrives later than the first status query: the first report arrives before the settings.
    bench.until(1_000, |_| false);
    bench.plug();
    let near = |bench: &Bench, place: [f64; 3]| {
        let at = bench.engine().place();
        at.is_none_or(|at| (0..3).all(|axis| (at[axis] - place[axis]).abs() < 0.01))
    };
    // From the greeting on, the position is never given in the wrong unit.
    for _ in 0..3_000 {
        bench.tick();
        let machine = bench.board.at;
        let place: [f64; 3] = std::array::from_fn(|axis| machine[axis] - ZERO[axis]);
        assert!(near(&bench, place), "{:?} is not {place:?}", bench.engine().place());
    }
    assert!(bench.engine().place().is_some());
    bench.asked(EngineAsk::Home);
    bench.phases(EnginePhase::Ready);
    // The unit is switched forth and back, with a report at any time between.
    for (value, wait_ms) in [0.0, 1.0].into_iter().cycle().zip((0..200).step_by(3)) {
        bench.until(wait_ms, |_| false);
        bench.asked(EngineAsk::Set { number: 13, value });
        for _ in 0..600 {
            bench.tick();
            let machine = bench.board.at;
            let place: [f64; 3] = std::array::from_fn(|axis| machine[axis] - ZERO[axis]);
            assert!(near(&bench, place), "$13={value}: {:?} is not {place:?}", bench.engine().place());
        }
    }
    bench.until(3_000, |_| false);
    assert!(bench.engine().place().is_some());
}

#[test]
fn job_completes_with_reports_in_inches() {
    fn board(_: f64, _: f64) -> f64 {
        ZERO[2]
    }
    let mut bench = Bench::new(1, Faults::default());
    bench.board.surface = Some(board);
    bench.board.settings.retain(|(number, _)| *number != 13);
    bench.board.settings.push((13, 1.0));
    bench.board.rarely_tells_zero = true;
    assert!(bench.ready());
    assert_eq!(found(&bench), Vec::<String>::new());
    bench.asked(EngineAsk::SetZero { axes: [true, true, false], height_mm: 0.0 });
    assert!(bench.until(2_000, |bench| bench.told.contains(&EngineAction::ZeroSet)), "{:?}", bench.words());
    bench.until(3_000, |bench| bench.engine().place().is_some());
    bench.asked(EngineAsk::ZeroAt { place_mm: ZERO.map(Some) });
    assert!(bench.until(2_000, |bench| bench.told.contains(&EngineAction::ZeroSet)), "{:?}", bench.words());
    bench.until(3_000, |bench| bench.engine().place().is_some());
    // The reports round this feed by more than a millimetre per minute.
    let slow = text().replace("F600", "F14");
    let routine = Arc::new(read("board", &[("board.nc".to_owned(), slow)]).unwrap());
    bench.start_as(EngineStart { routine, ..job(0) });
    for _ in 0..2 {
        bench.phases(EnginePhase::ToolChange);
        bench.until(3_000, |bench| bench.engine().place().is_some());
        bench.asked(EngineAsk::Jog { axis: 2, um: 3_000, mm_per_min: 1_000.0, anyway: false });
        bench.phases(EnginePhase::ToolChange);
        bench.asked(PROBE);
        assert!(
            bench.until(60_000, |bench| bench.told.contains(&EngineAction::ZeroSet)),
            "{:?}",
            bench.words()
        );
        bench.phases(EnginePhase::ToolChange);
        assert_eq!(bench.tool_ready(), Vec::<String>::new());
    }
    assert!(bench.until(600_000, |bench| bench.ended().is_some()), "{:?}", bench.words());
    assert_eq!((bench.ended(), found(&bench)), (Some(Ending::Done), Vec::new()), "{:?}", bench.words());
}
