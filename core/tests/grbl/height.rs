//! Tests of the board's height for the fitted tool: only a tool that was touched off may cut. A zero that
//! was refused, damaged or touched wrongly does not count. Every interruption of a tool change ends the
//! job.

use super::survey::found;
use super::{Bench, Faults, ZERO, job};
use annulus_core::control::{Ending, Trust};
use annulus_core::grbl::{BoardHeight, EngineAction, EngineAsk, EngineEvent, EnginePhase, EngineStart};

/// Physical height of a plate of 1.5 mm on the board, less half of the distance that a probe moves in a
/// millisecond.
fn plate(_: f64, _: f64) -> f64 {
    ZERO[2] + 1.5 - 0.002_5
}

const TOUCH: EngineAsk = EngineAsk::Probe { depth_mm: 40.0, mm_per_min: 300.0, plate_mm: 1.5, up_mm: 2.0 };

fn ready() -> Bench {
    let mut bench = Bench::new(1, Faults::default());
    assert!(bench.ready());
    bench
}

impl Bench {
    pub(super) fn asked(&mut self, ask: EngineAsk) {
        self.told.clear();
        self.event(EngineEvent::Ask(ask));
    }

    pub(super) fn phases(&mut self, phase: EnginePhase) {
        let so = self.until(600_000, |bench| bench.engine().phase == phase);
        assert!(so, "never {phase:?}: {:?}", self.words());
        self.until(1_000, |bench| bench.engine().place().is_some());
    }

    pub(super) fn tool_ready(&mut self) -> Vec<String> {
        self.asked(EngineAsk::ToolReady);
        found(self)
    }

    /// Sets zero of Z as if the tool touched the board at its true zero.
    fn touch_off(&mut self) {
        let height_mm = self.engine().place().unwrap()[2];
        self.asked(EngineAsk::SetZero { axes: [false, false, true], height_mm });
        assert!(self.until(2_000, |bench| bench.told.contains(&EngineAction::ZeroSet)), "{:?}", self.words());
        self.until(1_000, |bench| bench.engine().place().is_some());
    }

    /// Runs the job to its end, touching off each tool.
    fn finish(&mut self) -> Option<Ending> {
        let mut ended = None;
        while ended.is_none() {
            let so =
                |bench: &Bench| bench.ended().is_some() || bench.engine().phase == EnginePhase::ToolChange;
            assert!(self.until(600_000, so), "{:?}", self.words());
            ended = self.ended();
            if ended.is_none() {
                self.touch_off();
                assert_eq!(self.tool_ready(), Vec::<String>::new());
            }
        }
        ended
    }

    fn second_change(&mut self) {
        self.start_as(job(0));
        self.phases(EnginePhase::ToolChange);
        assert_eq!(self.tool_ready(), Vec::<String>::new(), "the first is the one that zero was set with");
        self.phases(EnginePhase::ToolChange);
        assert_eq!(self.done, 6);
    }
}

#[test]
fn tool_without_touch_off_cuts_nothing() {
    let mut bench = ready();
    bench.second_change();
    let cuts = bench.board.cuts.len();
    assert_eq!(bench.tool_ready(), ["grbl.height_first"]);
    bench.until(5_000, |_| false);
    assert_eq!((bench.engine().phase, bench.board.cuts.len()), (EnginePhase::ToolChange, cuts));
    assert_eq!(bench.finish(), Some(Ending::Done));
    assert_eq!((bench.missing(), bench.wrong()), (vec![], vec![]));
}

#[test]
fn next_job_requires_touch_off_of_its_first_tool() {
    let mut bench = ready();
    bench.second_change();
    assert_eq!(bench.finish(), Some(Ending::Done));
    bench.start_as(job(0));
    bench.phases(EnginePhase::ToolChange);
    assert_eq!(bench.tool_ready(), ["grbl.height_first"]);
    assert_eq!(bench.finish(), Some(Ending::Done));
    // If touched off between two jobs, the height belongs to the fitted tool.
    bench.touch_off();
    bench.start_as(job(0));
    bench.phases(EnginePhase::ToolChange);
    assert_eq!(bench.tool_ready(), Vec::<String>::new());
}

#[test]
fn resumed_job_asks_for_its_tool_before_cutting() {
    let mut bench = ready();
    bench.start_as(job(0));
    bench.phases(EnginePhase::ToolChange);
    bench.tool_ready();
    assert!(bench.until(60_000, |bench| bench.done == 3));
    bench.asked(EngineAsk::Stop);
    bench.phases(EnginePhase::Ready);
    assert_eq!(bench.ended(), Some(Ending::Stopped));
    // The user lifts the tool and fits a longer one.
    bench.asked(EngineAsk::Jog { axis: 2, um: 15_000, mm_per_min: 2_000.0, anyway: false });
    bench.phases(EnginePhase::Ready);
    let (cuts, high) = (bench.board.cuts.len(), bench.board.place()[2]);
    bench.start_as(EngineStart { zero_mm: Some(ZERO), ..job(3) });
    bench.phases(EnginePhase::ToolChange);
    assert!(bench.told.contains(&EngineAction::ToolWanted { tool: 0 }), "{:?}", bench.told);
    let lowest = bench.board.cuts[cuts..].iter().map(|place| place[2]).fold(f64::INFINITY, f64::min);
    assert!(lowest >= high - 0.001, "it does not go down with a bit that nobody knows: {lowest} from {high}");
    assert_eq!(bench.tool_ready(), ["grbl.height_first"]);
    assert_eq!(bench.finish(), Some(Ending::Done));
    assert_eq!((bench.missing(), bench.wrong()), (vec![], vec![]));
}

#[test]
fn equal_tool_lengths_resume_with_the_saved_zero() {
    let mut bench = ready();
    bench.start(0);
    bench.phases(EnginePhase::ToolChange);
    bench.tool_ready();
    assert!(bench.until(60_000, |bench| bench.done == 3));
    bench.unplug();
    bench.plug();
    bench.phases(EnginePhase::Locked);
    bench.asked(EngineAsk::Home);
    assert!(bench.until(5_000, |bench| bench.engine().trust == Trust::Trusted));
    bench.phases(EnginePhase::Ready);
    assert_eq!(bench.engine().height(), BoardHeight::Unknown);
    // A zero of Z that differs from the previous one, and an unknown one.
    let [x, y, z] = ZERO;
    for (zero_mm, code) in [(Some([x, y, z + 0.1]), "grbl.zero_moved"), (None, "grbl.no_height")] {
        bench.start_as(EngineStart { zero_mm, same_length: true, ..job(3) });
        assert_eq!((found(&bench), bench.engine().phase), (vec![code.to_owned()], EnginePhase::Ready));
    }
    bench.start_as(EngineStart { zero_mm: Some(ZERO), same_length: true, ..job(3) });
    assert!(bench.run());
    assert_eq!((bench.ended(), bench.missing(), bench.wrong()), (Some(Ending::Done), vec![], vec![]));
}

#[test]
fn moved_zero_refuses_resume() {
    let mut bench = ready();
    let [x, y, z] = ZERO;
    for zero_mm in [[x + 0.8, y, z], [x, y - 0.8, z]] {
        bench.start_as(EngineStart { zero_mm: Some(zero_mm), ..job(3) });
        assert_eq!(
            (found(&bench), bench.engine().phase),
            (vec!["grbl.zero_moved".to_owned()], EnginePhase::Ready)
        );
    }
    // This zero of Z was set with the fitted tool.
    bench.start_as(EngineStart { zero_mm: Some([x, y, z - 3.0]), ..job(3) });
    assert_eq!((found(&bench), bench.engine().phase), (vec![], EnginePhase::Running));
}

#[test]
fn height_is_the_contact_position_not_the_rest_position() {
    let mut bench = ready();
    bench.board.surface = Some(plate);
    bench.board.coast_ms = 45;
    bench.asked(TOUCH);
    assert_eq!(bench.engine().height(), BoardHeight::Unknown);
    assert!(bench.until(60_000, |bench| bench.told.contains(&EngineAction::ZeroSet)), "{:?}", bench.words());
    bench.phases(EnginePhase::Ready);
    let (zero, place) = (bench.engine().zero_mm.unwrap(), bench.board.place());
    assert!((zero[2] - ZERO[2]).abs() < 0.007, "{zero:?}");
    // The machine coasted, and was then lifted by 2 mm from there.
    assert!((place[2] - (ZERO[2] + 1.5 + 2.0 - 0.225)).abs() < 0.02, "{place:?}");
    assert_eq!((found(&bench), bench.engine().height()), (vec![], BoardHeight::OfThisBit));
}

#[test]
fn misheard_contact_position_sets_no_height() {
    let mut bench = ready();
    bench.board.surface = Some(plate);
    bench.heard_instead = Some(("[PRB:-1.000,-1.000,-28.5", "[PRB:-1.000,-1.000,-29.5"));
    bench.asked(TOUCH);
    bench.phases(EnginePhase::Ready);
    assert!(bench.heard_instead.is_none(), "{:?}", bench.words());
    assert_eq!(found(&bench), ["grbl.zero_not_taken"]);
    assert_eq!((bench.engine().height(), bench.engine().trust), (BoardHeight::Unknown, Trust::Trusted));
}

#[test]
fn failed_touch_off_leaves_the_tool_unknown() {
    for (line, instead) in [
        // Refused by the controller, and written to another coordinate system.
        (b"G91G38.2Z-40F300\n".as_slice(), b"G91G38.2Z-40F\n".as_slice()),
        (b"G21G10L2P1Z-29.505\n", b"G21G10L2P2Z-29.505\n"),
    ] {
        let mut bench = ready();
        bench.board.surface = Some(plate);
        bench.second_change();
        bench.instead = Some((line, instead));
        // Half a millimetre from the true zero of Z.
        bench.asked(EngineAsk::Probe { depth_mm: 40.0, mm_per_min: 300.0, plate_mm: 1.0, up_mm: 2.0 });
        bench.until(100, |_| false);
        bench.phases(EnginePhase::ToolChange);
        let told = format!("{:?}", bench.words());
        assert_eq!(bench.tool_ready(), ["grbl.height_first"], "{told}");
        bench.instead = None;
        assert_eq!(bench.finish(), Some(Ending::Done));
    }
}

#[test]
fn continue_after_set_zero_waits_for_the_controller() {
    let zero = |bench: &Bench| {
        let height_mm = bench.engine().place().unwrap()[2];
        EngineAsk::SetZero { axes: [false, false, true], height_mm }
    };
    let mut bench = ready();
    bench.second_change();
    let ask = zero(&bench);
    bench.event(EngineEvent::Ask(ask.clone()));
    assert_eq!(bench.tool_ready(), Vec::<String>::new(), "it is not refused");
    assert_eq!(bench.engine().phase, EnginePhase::ToolChange, "and waits");
    bench.phases(EnginePhase::Running);
    assert_eq!(bench.engine().height(), BoardHeight::OfThisBit);
    // A zero that the controller does not accept does not count.
    let mut bench = ready();
    bench.second_change();
    bench.instead = Some((b"G21G10L20P1Z8\n", b"G21G10L20P1Z2\n"));
    bench.event(EngineEvent::Ask(ask.clone()));
    bench.asked(EngineAsk::ToolReady);
    bench.until(3_000, |_| false);
    let told = format!("{:?}", bench.words());
    assert_eq!(found(&bench), ["grbl.zero_not_taken", "grbl.height_first"], "{told}");
    assert_eq!(bench.engine().phase, EnginePhase::ToolChange);
    // STOP must also end the job.
    bench.instead = None;
    bench.event(EngineEvent::Ask(ask));
    bench.event(EngineEvent::Ask(EngineAsk::ToolReady));
    bench.asked(EngineAsk::Stop);
    assert!(bench.until(20_000, |bench| bench.ended().is_some()), "{:?}", bench.words());
    let cuts = bench.board.cuts.len();
    bench.until(10_000, |_| false);
    assert_eq!((bench.ended(), bench.board.cuts.len()), (Some(Ending::Stopped), cuts));
}

#[test]
fn moved_xy_zero_ends_the_job() {
    let mut bench = ready();
    bench.second_change();
    let place = bench.engine().place().unwrap();
    assert!((place[2] - 8.0).abs() < 0.001, "{place:?}");
    bench.instead = Some((b"G21G10L20P1Z8\n", b"G21G10L20P1X8\n"));
    bench.asked(EngineAsk::SetZero { axes: [false, false, true], height_mm: 8.0 });
    assert!(bench.until(20_000, |bench| bench.ended().is_some()), "{:?}", bench.words());
    assert_eq!((bench.ended(), found(&bench)), (Some(Ending::Alarm), vec!["grbl.zero_not_taken".to_owned()]));
    assert_eq!(bench.engine().height(), BoardHeight::Unknown);
}

#[test]
fn unhomed_machine_with_switches_refuses_zero() {
    let mut bench = Bench::new(1, Faults::default());
    bench.plug();
    bench.phases(EnginePhase::Locked);
    bench.asked(EngineAsk::Unlock);
    bench.phases(EnginePhase::Ready);
    let plane = EngineAsk::SetZero { axes: [true, true, false], height_mm: 0.0 };
    let place = EngineAsk::ZeroAt { place_mm: [Some(1.0), None, None] };
    let edge = EngineAsk::Edge { axis: 0, reach_mm: 5.0, mm_per_min: 100.0, radius_mm: 0.5, back_mm: 2.0 };
    for ask in [plane.clone(), place, TOUCH, edge] {
        bench.asked(ask.clone());
        assert_eq!(found(&bench), ["grbl.not_homed"], "{ask:?}");
        bench.until(1_000, |_| false);
        assert_eq!((bench.engine().phase, bench.board.cuts.len()), (EnginePhase::Ready, 0), "{ask:?}");
    }
    bench.asked(EngineAsk::Home);
    bench.phases(EnginePhase::Ready);
    bench.asked(plane);
    assert!(bench.until(2_000, |bench| bench.told.contains(&EngineAction::ZeroSet)), "{:?}", bench.words());
}

#[test]
fn unanswering_controller_is_held_before_closing() {
    let mut bench = ready();
    bench.start_as(job(0));
    bench.phases(EnginePhase::ToolChange);
    assert_eq!(bench.tool_ready(), Vec::<String>::new());
    bench.phases(EnginePhase::Running);
    bench.told.clear();
    // The answers are lost, but the requests arrive.
    for _ in 0..8_000 {
        bench.now_ms += 1;
        bench.event(EngineEvent::Tick);
    }
    let close = bench.told.iter().position(|action| *action == EngineAction::Close);
    let held = bench.told.iter().position(|action| *action == EngineAction::Write(b"!".to_vec()));
    assert!(held.is_some() && held < close, "{:?}", bench.words());
    assert_eq!(bench.engine().phase, EnginePhase::Closed);
}

#[test]
fn machine_without_switches_knows_its_position_by_zero() {
    let mut bench = Bench::without_switches();
    let plane = EngineAsk::SetZero { axes: [true, true, false], height_mm: 0.0 };
    bench.instead = Some((b"G21G10L20P1X0Y0\n", b"G21G10L20P1X0Y\n"));
    bench.asked(plane.clone());
    assert_eq!(bench.engine().trust, Trust::Lost, "asked for is not taken");
    bench.until(2_000, |_| false);
    assert_eq!((found(&bench), bench.engine().trust), (vec!["grbl.error_2".to_owned()], Trust::Lost));
    bench.instead = None;
    bench.asked(plane.clone());
    assert!(bench.until(2_000, |bench| bench.told.contains(&EngineAction::ZeroSet)));
    bench.until(1_000, |bench| bench.engine().place().is_some());
    assert_eq!(bench.engine().trust, Trust::Trusted);
    bench.touch_off();
    assert_eq!(bench.engine().height(), BoardHeight::OfThisBit);
    // The zero is requested at its present position, and one letter is damaged: X stays, but zero of Z has
    // moved.
    bench.asked(EngineAsk::Jog { axis: 2, um: 5_000, mm_per_min: 2_000.0, anyway: false });
    bench.phases(EnginePhase::Ready);
    bench.instead = Some((b"G21G10L20P1X0Y0\n", b"G21G10L20P1Z0Y0\n"));
    bench.asked(plane);
    bench.until(2_000, |_| false);
    assert_eq!(
        (found(&bench), bench.engine().height()),
        (vec!["grbl.zero_not_taken".to_owned()], BoardHeight::Unknown)
    );
}

#[test]
fn damaged_report_sets_no_zero() {
    let mut bench = ready();
    bench.event(EngineEvent::Bytes(b"<Idle|MPos:-1.000,-2.000,-3.000|FS:0,0>\r\n".to_vec()));
    let plane = EngineAsk::SetZero { axes: [true, true, false], height_mm: 0.0 };
    bench.asked(plane.clone());
    bench.until(2_000, |_| false);
    assert_eq!(found(&bench), ["grbl.zero_not_taken"]);
    // A Z zero doesn't confirm X and Y: the job is refused until they are set again.
    bench.touch_off();
    let refused =
        |bench: &Bench| bench.engine().check(&job(0)).iter().any(|why| why.code == "grbl.zero_not_taken");
    assert!(refused(&bench));
    bench.asked(plane);
    bench.until(2_000, |_| false);
    assert!(!refused(&bench));
}

#[test]
fn stop_in_a_tool_change_ends_the_job_and_all_motion() {
    let jog = EngineAsk::Jog { axis: 2, um: 20_000, mm_per_min: 300.0, anyway: false };
    for (ask, phase) in
        [(jog, EnginePhase::Jogging), (TOUCH, EnginePhase::Probing), (TOUCH, EnginePhase::Jogging)]
    {
        let mut bench = ready();
        bench.board.surface = Some(plate);
        bench.second_change();
        bench.asked(ask);
        bench.phases(phase);
        bench.until(50, |_| false);
        bench.asked(EngineAsk::Stop);
        assert!(bench.until(20_000, |bench| bench.ended().is_some()), "{phase:?}: {:?}", bench.words());
        let place = bench.board.place();
        bench.phases(EnginePhase::Ready);
        bench.until(5_000, |_| false);
        assert_eq!(bench.board.place(), place, "{phase:?}: nothing moves after a stop");
        assert_eq!(
            (bench.ended(), bench.engine().trust),
            (Some(Ending::Stopped), Trust::Trusted),
            "{phase:?}"
        );
    }
}
