//! The height of the board, for the bit that is in: who was touched off cuts, nobody else; a zero that was refused, damaged or touched
//! wrongly is none; what stops a tool change ends the job.

use super::survey::found;
use super::{Bench, Faults, ZERO, job};
use annulus_core::control::{Ending, Trust};
use annulus_core::controller::{BoardHeight, EngineAction, EngineAsk, EngineEvent, EnginePhase, EngineStart};

/// The physical height of a plate of 1.5 mm on the board; half of what a touch goes in a millisecond off a place that it comes to.
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

    /// Says that the tool is in; why that was refused.
    pub(super) fn tool_ready(&mut self) -> Vec<String> {
        self.asked(EngineAsk::ToolReady);
        found(self)
    }

    /// Zero of Z as if the tip touched the board at its own zero.
    fn touch_off(&mut self) {
        let height_mm = self.engine().place().unwrap()[2];
        self.asked(EngineAsk::SetZero { axes: [false, false, true], height_mm });
        assert!(self.until(2_000, |bench| bench.told.contains(&EngineAction::ZeroSet)), "{:?}", self.words());
        self.until(1_000, |bench| bench.engine().place().is_some());
    }

    /// Goes on to the end, each tool touched off.
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

    /// In the change to the second tool.
    fn second_change(&mut self) {
        self.start_as(job(0));
        self.phases(EnginePhase::ToolChange);
        assert_eq!(self.tool_ready(), Vec::<String>::new(), "the first is the one that zero was set with");
        self.phases(EnginePhase::ToolChange);
        assert_eq!(self.done, 6);
    }
}

#[test]
fn a_tool_that_was_not_touched_off_cuts_nothing() {
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
fn the_first_tool_of_the_next_job_is_another_one_than_the_last_of_this() {
    let mut bench = ready();
    bench.second_change();
    assert_eq!(bench.finish(), Some(Ending::Done));
    bench.start_as(job(0));
    bench.phases(EnginePhase::ToolChange);
    assert_eq!(bench.tool_ready(), ["grbl.height_first"]);
    assert_eq!(bench.finish(), Some(Ending::Done));
    // Touched off between two jobs it is the one that is in.
    bench.touch_off();
    bench.start_as(job(0));
    bench.phases(EnginePhase::ToolChange);
    assert_eq!(bench.tool_ready(), Vec::<String>::new());
}

#[test]
fn a_job_that_goes_on_asks_for_its_tool_before_it_cuts() {
    let mut bench = ready();
    bench.start_as(job(0));
    bench.phases(EnginePhase::ToolChange);
    bench.tool_ready();
    assert!(bench.until(60_000, |bench| bench.done == 3));
    bench.asked(EngineAsk::Stop);
    bench.phases(EnginePhase::Ready);
    assert_eq!(bench.ended(), Some(Ending::Stopped));
    // A person takes the tip up, and puts in a bit that is longer by so much.
    bench.asked(EngineAsk::Jog { axis: 2, um: 15_000, mm_per_min: 2_000.0 });
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
fn where_all_tools_are_alike_a_job_goes_on_with_the_zero_that_it_had() {
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
    // Another zero of Z than it had, and none that is known at all.
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
fn a_zero_that_was_moved_since_is_told_and_nothing_begins() {
    let mut bench = ready();
    let [x, y, z] = ZERO;
    for zero_mm in [[x + 0.8, y, z], [x, y - 0.8, z]] {
        bench.start_as(EngineStart { zero_mm: Some(zero_mm), ..job(3) });
        assert_eq!(
            (found(&bench), bench.engine().phase),
            (vec!["grbl.zero_moved".to_owned()], EnginePhase::Ready)
        );
    }
    // That of Z was set with the bit that is in.
    bench.start_as(EngineStart { zero_mm: Some([x, y, z - 3.0]), ..job(3) });
    assert_eq!((found(&bench), bench.engine().phase), (vec![], EnginePhase::Running));
}

#[test]
fn the_height_is_where_the_probe_met_the_board_and_not_where_it_came_to_rest() {
    let mut bench = ready();
    bench.board.surface = Some(plate);
    bench.board.coast_ms = 45;
    bench.asked(TOUCH);
    assert_eq!(bench.engine().height(), BoardHeight::Unknown);
    assert!(bench.until(60_000, |bench| bench.told.contains(&EngineAction::ZeroSet)), "{:?}", bench.words());
    bench.phases(EnginePhase::Ready);
    let (zero, place) = (bench.engine().zero_mm.unwrap(), bench.board.place());
    assert!((zero[2] - ZERO[2]).abs() < 0.007, "{zero:?}");
    // It coasted, and was lifted by 2 mm from there.
    assert!((place[2] - (ZERO[2] + 1.5 + 2.0 - 0.225)).abs() < 0.02, "{place:?}");
    assert_eq!((found(&bench), bench.engine().height()), (vec![], BoardHeight::OfThisBit));
}

#[test]
fn a_place_of_contact_that_was_misheard_is_no_height() {
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
fn a_touch_that_failed_in_a_change_leaves_the_tool_unknown() {
    for (line, instead) in [
        // Refused by the board, and written elsewhere.
        (b"G91G38.2Z-40F300\n".as_slice(), b"G91G38.2Z-40F\n".as_slice()),
        (b"G21G10L2P1Z-29.505\n", b"G21G10L2P2Z-29.505\n"),
    ] {
        let mut bench = ready();
        bench.board.surface = Some(plate);
        bench.second_change();
        bench.instead = Some((line, instead));
        // Half a millimetre off where zero of Z is.
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
fn whoever_goes_on_right_after_zero_was_set_waits_for_it_and_no_longer() {
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
    // A zero that is not taken is none.
    let mut bench = ready();
    bench.second_change();
    bench.instead = Some((b"G21G10L20P1Z8\n", b"G21G10L20P1Z2\n"));
    bench.event(EngineEvent::Ask(ask.clone()));
    bench.asked(EngineAsk::ToolReady);
    bench.until(3_000, |_| false);
    let told = format!("{:?}", bench.words());
    assert_eq!(found(&bench), ["grbl.zero_not_taken", "grbl.height_first"], "{told}");
    assert_eq!(bench.engine().phase, EnginePhase::ToolChange);
    // STOP is STOP.
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
fn a_line_that_moved_the_zero_of_the_plane_ends_the_job() {
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
fn where_a_machine_could_know_its_place_and_does_not_no_zero_is_set() {
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
fn what_moves_is_held_where_a_board_does_not_answer_any_more() {
    let mut bench = ready();
    bench.start_as(job(0));
    bench.phases(EnginePhase::ToolChange);
    assert_eq!(bench.tool_ready(), Vec::<String>::new());
    bench.phases(EnginePhase::Running);
    bench.told.clear();
    // Its answers are lost, not what is said to it.
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
fn without_switches_a_place_is_known_once_the_board_has_its_zero() {
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
    // Asked for where it is already, and one letter changed: X stays, but zero of Z is elsewhere now.
    bench.asked(EngineAsk::Jog { axis: 2, um: 5_000, mm_per_min: 2_000.0 });
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
fn a_report_that_was_damaged_on_the_way_makes_no_zero() {
    let mut bench = ready();
    bench.event(EngineEvent::Bytes(b"<Idle|MPos:-1.000,-2.000,-3.000|FS:0,0>\r\n".to_vec()));
    bench.asked(EngineAsk::SetZero { axes: [true, true, false], height_mm: 0.0 });
    bench.until(2_000, |_| false);
    assert_eq!(found(&bench), ["grbl.zero_not_taken"]);
}

#[test]
fn stop_in_a_tool_change_ends_the_job_whatever_moves_there() {
    let jog = EngineAsk::Jog { axis: 2, um: 20_000, mm_per_min: 300.0 };
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
