//! Tests of a probe contact that is closed before anything touches: no downward and no sideways move
//! follows, and no job ends because of it.

use super::survey::found;
use super::{Bench, Faults, ZERO, job};
use annulus_core::control::Trust;
use annulus_core::grbl::{EngineAction, EngineAsk, EngineEvent, EnginePhase, SurveyNews};

const PROBE: EngineAsk = EngineAsk::Probe { depth_mm: 40.0, mm_per_min: 300.0, plate_mm: 0.0, up_mm: 2.0 };

fn board(_: f64, _: f64) -> f64 {
    ZERO[2]
}

fn ready() -> Bench {
    let mut bench = Bench::new(1, Faults::default());
    bench.board.surface = Some(board);
    assert!(bench.ready());
    bench
}

impl Bench {
    /// Closes or opens a short in the probe's wires, and waits until the controller has reported it.
    fn short(&mut self, shorted: bool) {
        self.board.shorted = shorted;
        self.until(500, |_| false);
    }

    fn sent(&self) -> Vec<String> {
        let lines = self.told.iter().filter_map(|action| match action {
            EngineAction::Write(bytes) if bytes != b"?" => Some(String::from_utf8_lossy(bytes).into_owned()),
            _ => None,
        });
        lines.collect()
    }
}

#[test]
fn closed_probe_input_refuses_probing() {
    let edge = EngineAsk::Edge { axis: 0, reach_mm: 5.0, mm_per_min: 100.0, radius_mm: 0.5, back_mm: 2.0 };
    for ask in [PROBE, edge] {
        let mut bench = ready();
        let height = bench.engine().height();
        bench.short(true);
        bench.asked(ask.clone());
        assert_eq!(
            (found(&bench), bench.sent()),
            (vec!["grbl.probe_closed".to_owned()], Vec::new()),
            "{ask:?}"
        );
        assert_eq!((bench.engine().phase, bench.engine().height()), (EnginePhase::Ready, height), "{ask:?}");
        bench.short(false);
        bench.asked(ask.clone());
        assert!(found(&bench).is_empty() && !bench.sent().is_empty(), "{ask:?}");
    }
}

#[test]
fn closed_probe_input_in_a_tool_change_does_not_end_the_job() {
    let mut bench = ready();
    bench.start_as(job(0));
    bench.phases(EnginePhase::ToolChange);
    bench.short(true);
    bench.asked(PROBE);
    bench.until(2_000, |_| false);
    assert_eq!((found(&bench), bench.ended()), (vec!["grbl.probe_closed".to_owned()], None));
    assert_eq!(bench.engine().phase, EnginePhase::ToolChange);
    bench.short(false);
    bench.asked(PROBE);
    assert!(bench.until(20_000, |bench| bench.told.contains(&EngineAction::ZeroSet)), "{:?}", bench.words());
    bench.phases(EnginePhase::ToolChange);
    assert_eq!(bench.tool_ready(), Vec::<String>::new());
    bench.phases(EnginePhase::ToolChange);
    assert_eq!((bench.ended(), bench.done), (None, 6), "on, to the change of the second tool");
}

#[test]
fn touching_tool_is_lifted_before_xy_motion() {
    let jog = |axis, um| EngineAsk::Jog { axis, um, mm_per_min: 300.0, anyway: false };
    let mut bench = ready();
    // Jog down to the board.
    let down = ((ZERO[2] - bench.board.place()[2]) * 1e3) as i32;
    bench.asked(jog(2, down));
    bench.phases(EnginePhase::Ready);
    bench.until(500, |_| false);
    let place = bench.board.place();
    for axis in [0, 1] {
        bench.asked(jog(axis, 3_000));
        bench.until(500, |_| false);
        assert_eq!((found(&bench), bench.sent()), (vec!["grbl.tip_touches".to_owned()], Vec::new()));
        assert_eq!((bench.engine().phase, bench.board.place()), (EnginePhase::Ready, place));
    }
    for (axis, um) in [(2, 1_000), (0, -3_000), (1, -3_000)] {
        bench.asked(jog(axis, um));
        bench.phases(EnginePhase::Ready);
        assert_eq!(found(&bench), Vec::<String>::new(), "{axis}");
    }
    let now = bench.board.place();
    let mut moved = [-3.0, -3.0, 1.0].into_iter().enumerate();
    assert!(moved.all(|(axis, mm)| (now[axis] - place[axis] - mm).abs() < 0.002), "{place:?} {now:?}");
}

#[test]
fn survey_with_closed_probe_input_ends_without_a_lock() {
    for before in [0, 2] {
        let mut bench = ready();
        bench.event(EngineEvent::Ask(EngineAsk::Survey(super::survey::start())));
        let touches = |bench: &Bench| {
            let is_touch =
                |told: &&EngineAction| matches!(told, EngineAction::Survey(SurveyNews::Touched { .. }));
            bench.told.iter().filter(is_touch).count()
        };
        assert!(before == 0 || bench.until(100_000, |bench| touches(bench) == before));
        bench.board.shorted = true;
        let is_over =
            |told: &EngineAction| matches!(told, EngineAction::Survey(SurveyNews::Over { survey: None }));
        assert!(bench.until(20_000, |bench| bench.told.iter().any(is_over)), "{:?}", bench.words());
        assert!(
            bench.until(20_000, |bench| bench.engine().phase == EnginePhase::Ready),
            "{:?}",
            bench.words()
        );
        assert_eq!(found(&bench), ["grbl.probe_closed"], "after {before}: {:?}", bench.words());
        assert_eq!((touches(&bench), bench.engine().trust), (before, Trust::Trusted));
    }
}
