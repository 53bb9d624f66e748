//! Tests of the tool change height on a machine with little room above the board. Tools are changed as high
//! as Z can go without reaching its switch, with a warning before the job.

use super::*;
use annulus_core::diagnostic::Severity;
use std::cell::Cell;

const PULL_OFF_MM: f64 = 1.0;

/// The job of the other tests with a tool change height of 20 mm, as exported files have.
fn high() -> Arc<Routine> {
    let text = text().replace("G0 Z8\n", "G0 Z20\n");
    Arc::new(read("board", &[("board.nc".to_owned(), text)]).unwrap())
}

fn ready_at(zero_mm: f64) -> Bench {
    let mut bench = Bench::new(1, Faults::default());
    bench.board.settings.retain(|(number, _)| ![21, 27].contains(number));
    bench.board.settings.extend([(21, 1.0), (27, PULL_OFF_MM)]);
    assert!(bench.ready());
    bench.told.clear();
    bench.event(EngineEvent::Ask(EngineAsk::ZeroAt { place_mm: [None, None, Some(zero_mm)] }));
    assert!(bench.until(5_000, |bench| bench.told.contains(&EngineAction::ZeroSet)), "{:?}", bench.told);
    bench.until(1_000, |bench| bench.engine().place().is_some());
    bench
}

fn start() -> EngineStart {
    EngineStart { routine: high(), same_length: true, ..job(0) }
}

fn told(bench: &Bench) -> Vec<(String, Severity)> {
    let found = bench.engine().check(&start()).into_iter();
    let of_room = |code: &str| ["grbl.change_lower", "grbl.out_of_travel"].contains(&code);
    found.map(|found| (found.code, found.severity)).filter(|(code, _)| of_room(code)).collect()
}

/// Highest Z of the whole job in machine coordinates, and the ending.
fn highest_mm(bench: &mut Bench) -> (f64, Option<Ending>) {
    bench.start_as(start());
    let highest = Cell::new(f64::NEG_INFINITY);
    for _ in 0..100 {
        let so = |bench: &Bench| {
            // Before the first hole the tool is at its position after homing.
            if bench.done > 1 {
                highest.set(highest.get().max(bench.board.at[2]));
            }
            bench.ended().is_some() || bench.engine().phase == EnginePhase::ToolChange
        };
        assert!(bench.until(600_000, so));
        if let Some(ending) = bench.ended() {
            return (highest.get(), Some(ending));
        }
        bench.until(500, |_| false);
        bench.event(EngineEvent::Ask(EngineAsk::ToolReady));
        bench.until(5_000, |bench| bench.engine().phase != EnginePhase::ToolChange);
    }
    (highest.get(), None)
}

#[test]
fn tool_change_height_uses_the_available_travel() {
    for (zero_mm, highest, lower) in [
        (-30.0, -10.0, false),
        (-21.0, -1.0, false),
        (-20.0, -1.0, true),
        (-10.0, -1.0, true),
        (-3.0, -1.0, true),
    ] {
        let mut bench = ready_at(zero_mm);
        let expected: &[_] = if lower { &[("grbl.change_lower".to_owned(), Severity::Warning)] } else { &[] };
        assert_eq!(told(&bench), expected, "{zero_mm}");
        let (found, ending) = highest_mm(&mut bench);
        assert_eq!(ending, Some(Ending::Done), "{zero_mm}: {:?}", bench.told);
        assert!((found - highest).abs() < 0.011, "{zero_mm}: {found} not {highest}");
    }
}

#[test]
fn job_without_travel_for_its_cuts_is_refused() {
    // 2 mm between holes, 1 mm of pull-off.
    for zero_mm in [-2.9, -1.5] {
        let mut bench = ready_at(zero_mm);
        assert_eq!(told(&bench), [("grbl.out_of_travel".to_owned(), Severity::Error)], "{zero_mm}");
        bench.start_as(start());
        assert_eq!(bench.engine().phase, EnginePhase::Ready);
    }
}
