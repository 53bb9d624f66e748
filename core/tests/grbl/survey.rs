//! Tests of probing a board with a simulated controller: heights, hold, stop, refusals, damaged lines.

use super::{Bench, Faults, ZERO, routine};
use annulus_core::align::{BoardFit, FoundHole};
use annulus_core::control::Trust;
use annulus_core::geometry::Point;
use annulus_core::grbl::{
    Course, EngineAction, EngineAsk, EngineEvent, EnginePhase, RoutineAction, Section, SurveyNews,
    SurveyStart, aligned_routine, cut_bounds, level_key, level_routine, read,
};
use annulus_core::level::{HeightMap, ProbeGrid, Survey, TOLERANCE};
use annulus_core::units::Length;

/// Height above work zero at a physical place: bowed and tilted.
fn bow(x: f64, y: f64) -> f64 {
    let (x, y) = (x - ZERO[0], y - ZERO[1]);
    ZERO[2] + 0.02 * x - 0.3 + 0.001 * (14.0 - x) * x + 0.002 * (18.0 - y) * y
}

pub(super) fn start() -> SurveyStart {
    let grid = ProbeGrid::over(cut_bounds(&routine()).unwrap(), Length::from_mm(4.0), Length::from_mm(1.0));
    SurveyStart {
        grid: grid.unwrap(),
        clear_mm: 1.0,
        depth_mm: 3.0,
        mm_per_min: 60.0,
        over_mm_per_min: 800.0,
    }
}

fn survey_of(bench: &Bench) -> Option<Option<Box<Survey>>> {
    bench.told.iter().find_map(|action| {
        if let EngineAction::Survey(SurveyNews::Over { survey }) = action {
            Some(survey.clone())
        } else {
            None
        }
    })
}

pub(super) fn found(bench: &Bench) -> Vec<String> {
    let code = |action: &EngineAction| {
        if let EngineAction::Found(found) = action { Some(found.code.clone()) } else { None }
    };
    bench.told.iter().filter_map(code).collect()
}

fn bench(surface: Option<fn(f64, f64) -> f64>) -> Bench {
    let mut bench = Bench::new(1, Faults::default());
    bench.board.surface = surface;
    assert!(bench.ready());
    bench.told.clear();
    bench
}

fn map(survey: &Survey) -> HeightMap {
    HeightMap {
        grid: *survey.grid(),
        heights: survey.done().unwrap(),
        job: level_key(&routine()),
        zero: [Length::from_mm(ZERO[0]), Length::from_mm(ZERO[1])],
        homed: true,
        measured_s: 0,
    }
}

#[test]
fn surveyed_board_is_followed_by_the_job() {
    let mut bench = bench(Some(bow));
    bench.event(EngineEvent::Ask(EngineAsk::Survey(start())));
    assert!(bench.until(600_000, |bench| survey_of(bench).is_some()), "{:?}", bench.words());
    assert!(bench.until(5_000, |bench| bench.engine().phase == EnginePhase::Ready), "{:?}", bench.words());
    assert_eq!(found(&bench), Vec::<String>::new());
    let survey = survey_of(&bench).unwrap().unwrap();
    let map = map(&survey);
    for (index, height) in map.heights.iter().enumerate() {
        let place = map.grid.nth(index);
        let wanted = bow(place.x.mm() + ZERO[0], place.y.mm() + ZERO[1]) - ZERO[2];
        assert!((height.mm() - wanted).abs() < 0.003, "{index}: {height:?} not {wanted}");
    }
    let (levelled, correction) = level_routine(&routine(), &map, TOLERANCE).unwrap();
    assert!(correction.largest().mm() > 0.2, "{correction:?}");
    assert_eq!(levelled.levelled, Some(map.key()));
    assert_eq!(level_routine(&levelled, &map, TOLERANCE).unwrap_err().code, "level.twice");
    // The same sections, each beginning where the previous one ends.
    assert_eq!(levelled.sections.len(), routine().sections.len());
    assert_eq!((levelled.counted(99), &levelled.key), (routine().counted(99), &routine().key));
    for (before, section) in levelled.sections.iter().zip(levelled.sections.iter().skip(1)) {
        let entry = |section: &Section| {
            let last = section.actions.iter().take(section.approach).rev();
            let mut moves = last
                .filter_map(|action| if let RoutineAction::Go(step) = action { Some(step.to) } else { None });
            moves.next()
        };
        assert_eq!(entry(section).unwrap_or(before.end()), section.entry, "{:?}", section.kind);
    }
    // When run, every bottom must be as deep below the board as planned.
    bench.told.clear();
    let start = annulus_core::grbl::EngineStart {
        routine: std::sync::Arc::new(levelled),
        from: 0,
        zero_mm: None,
        same_length: true,
        setter: None,
        changer: None,
        spin_up_s: 0.1,
        accepted: Vec::new(),
    };
    bench.board.cuts.clear();
    bench.event(EngineEvent::Ask(EngineAsk::Start(start)));
    assert!(bench.run(), "{:?}", bench.words());
    assert_eq!(bench.ended(), Some(annulus_core::control::Ending::Done), "{:?}", bench.words());
    let deep = |place: &[f64; 3]| bow(place[0], place[1]) - place[2];
    for hole in 0..9 {
        let at = [ZERO[0] + f64::from(hole % 3 * 4), ZERO[1] + f64::from(hole / 3 * 4)];
        let there = |place: &&[f64; 3]| (place[0] - at[0]).abs() < 0.02 && (place[1] - at[1]).abs() < 0.02;
        let depth = bench.board.cuts.iter().filter(there).map(deep).fold(0.0, f64::max);
        // At the corner the surface extends beyond the grid.
        assert!((depth - 1.7).abs() < 0.025, "hole {hole}: {depth}");
    }
    let path = |place: &&[f64; 3]| {
        let (x, y) = (place[0] - ZERO[0], place[1] - ZERO[1]);
        (0.05..9.9).contains(&x) && (y - 14.0).abs() < 0.01 && deep(place) > 0.0
    };
    let depths: Vec<f64> = bench.board.cuts.iter().filter(path).map(deep).collect();
    assert!(depths.len() > 100 && depths.iter().all(|depth| (depth - 0.1).abs() < 0.025), "{depths:?}");
}

#[test]
fn survey_pauses_resumes_and_stops() {
    let mut bench = bench(Some(bow));
    bench.event(EngineEvent::Ask(EngineAsk::Survey(start())));
    let touches = |bench: &Bench| {
        bench
            .told
            .iter()
            .filter(|told| matches!(told, EngineAction::Survey(SurveyNews::Touched { .. })))
            .count()
    };
    assert!(bench.until(100_000, |bench| touches(bench) == 3));
    bench.event(EngineEvent::Ask(EngineAsk::Hold));
    assert!(bench.until(20_000, |bench| bench.engine().phase == EnginePhase::Held));
    let place = bench.board.place();
    assert!(place[2] > bow(place[0], place[1]) + 0.9, "the tip is up");
    let before = touches(&bench);
    bench.until(30_000, |_| false);
    assert_eq!((bench.board.place(), touches(&bench)), (place, before));
    bench.event(EngineEvent::Ask(EngineAsk::Resume));
    assert!(bench.until(100_000, |bench| touches(bench) == before + 2));
    bench.event(EngineEvent::Ask(EngineAsk::Stop));
    assert!(bench.until(20_000, |bench| bench.engine().phase == EnginePhase::Ready), "{:?}", bench.words());
    assert_eq!((survey_of(&bench), bench.engine().trust), (Some(None), Trust::Trusted));
    let place = bench.board.place();
    bench.until(5_000, |_| false);
    assert_eq!(bench.board.place(), place);
}

#[test]
fn failed_survey_ends_with_its_problem() {
    fn wall(x: f64, _: f64) -> f64 {
        if x - ZERO[0] > 6.0 { ZERO[2] + 5.0 } else { ZERO[2] }
    }
    fn always(_: f64, _: f64) -> f64 {
        1e9
    }
    type Row = (&'static str, Option<fn(f64, f64) -> f64>);
    let rows: [Row; 3] =
        [("level.no_board", None), ("level.in_the_way", Some(wall)), ("grbl.alarm_4", Some(always))];
    for (code, surface) in rows {
        let mut bench = bench(surface);
        // A controller that reports its pins would be refused at once.
        bench.board.hides_pins = true;
        bench.until(500, |_| false);
        bench.event(EngineEvent::Ask(EngineAsk::Survey(start())));
        assert!(bench.until(100_000, |bench| survey_of(bench).is_some()), "{code} {:?}", bench.words());
        assert_eq!((survey_of(&bench), found(&bench)), (Some(None), vec![code.to_owned()]));
        assert_eq!(bench.engine().trust, Trust::Trusted, "{code}");
    }
    // Beyond the travel, or with invalid numbers: nothing is sent.
    let mut bench = bench(Some(bow));
    let wide = ProbeGrid { low: annulus_core::geometry::Point::from_mm(-200.0, 0.0), ..start().grid };
    for (code, start) in [
        ("level.no_room", SurveyStart { grid: wide, ..start() }),
        ("level.bad_survey", SurveyStart { clear_mm: 0.0, ..start() }),
        ("level.bad_survey", SurveyStart { depth_mm: f64::NAN, ..start() }),
        ("level.bad_survey", SurveyStart { over_mm_per_min: f64::INFINITY, ..start() }),
        ("level.no_grid", SurveyStart { grid: ProbeGrid { columns: 1, rows: 3, ..start().grid }, ..start() }),
        ("level.no_grid", SurveyStart { grid: ProbeGrid { columns: u16::MAX, ..start().grid }, ..start() }),
        (
            "level.no_grid",
            SurveyStart { grid: ProbeGrid { high: start().grid.low, ..start().grid }, ..start() },
        ),
    ] {
        bench.told.clear();
        bench.event(EngineEvent::Ask(EngineAsk::Survey(start)));
        assert_eq!((found(&bench), bench.engine().phase), (vec![code.to_owned()], EnginePhase::Ready));
    }
}

/// Advances millisecond by millisecond until the tool rises.
fn rises(bench: &mut Bench) {
    let mut low = bench.board.place()[2];
    for _ in 0..200_000 {
        bench.tick();
        let height = bench.board.place()[2];
        if height > low + 0.2 && bench.engine().phase == EnginePhase::Jogging {
            return;
        }
        low = low.min(height);
    }
    panic!("it never rises: {:?}", bench.words());
}

#[test]
fn stop_ends_the_lift_after_a_touch() {
    let deep = |_: f64, _: f64| ZERO[2] - 2.0;
    let probe = EngineAsk::Probe { depth_mm: 40.0, mm_per_min: 600.0, plate_mm: 0.0, up_mm: 10.0 };
    let survey = EngineAsk::Survey(SurveyStart { clear_mm: 10.0, ..start() });
    type Row = (EngineAsk, Option<fn(f64, f64) -> f64>);
    let rows: [Row; 2] = [(probe, Some(deep)), (survey, None)];
    for (ask, surface) in rows {
        let mut bench = bench(surface);
        bench.event(EngineEvent::Ask(ask));
        rises(&mut bench);
        let place = bench.board.place();
        bench.event(EngineEvent::Ask(EngineAsk::Stop));
        assert!(
            bench.until(20_000, |bench| bench.engine().phase == EnginePhase::Ready),
            "{:?}",
            bench.words()
        );
        bench.until(3_000, |_| false);
        assert!(bench.board.place()[2] < place[2] + 0.1, "{place:?} and then {:?}", bench.board.place());
        assert_eq!(bench.engine().trust, Trust::Trusted);
    }
}

#[test]
fn stop_before_the_lift_is_obeyed() {
    let mut bench = bench(Some(|_, _| ZERO[2] - 2.0));
    let probe = EngineAsk::Probe { depth_mm: 40.0, mm_per_min: 600.0, plate_mm: 0.0, up_mm: 10.0 };
    bench.event(EngineEvent::Ask(probe));
    assert!(bench.until(100_000, |bench| bench.engine().phase == EnginePhase::Jogging));
    let place = bench.board.place();
    bench.event(EngineEvent::Ask(EngineAsk::Stop));
    assert!(bench.until(20_000, |bench| bench.engine().phase == EnginePhase::Ready), "{:?}", bench.words());
    bench.until(3_000, |_| false);
    assert!(bench.board.place()[2] < place[2] + 0.1, "{place:?} and then {:?}", bench.board.place());
    assert!(bench.told.contains(&EngineAction::ZeroSet), "the board was found");
}

#[test]
fn stop_that_crosses_the_touch_is_obeyed() {
    let probe = || EngineAsk::Probe { depth_mm: 40.0, mm_per_min: 600.0, plate_mm: 0.0, up_mm: 10.0 };
    let mut whole = bench(Some(|_, _| ZERO[2] - 0.5));
    let begin_ms = whole.now_ms;
    whole.event(EngineEvent::Ask(probe()));
    assert!(whole.until(100_000, |bench| bench.engine().phase == EnginePhase::Jogging));
    let touched_ms = whole.now_ms - begin_ms;
    for early_ms in 0..60 {
        let mut bench = bench(Some(|_, _| ZERO[2] - 0.5));
        bench.event(EngineEvent::Ask(probe()));
        bench.until(touched_ms - early_ms, |bench| bench.engine().phase == EnginePhase::Jogging);
        // Both directions have 80 ms of delay, so that the touch and STOP cross.
        bench.on_the_way_until_ms = bench.now_ms + 80;
        let place = bench.board.place();
        bench.event(EngineEvent::Ask(EngineAsk::Stop));
        let ready = bench.until(30_000, |bench| bench.engine().phase == EnginePhase::Ready);
        assert!(ready, "{early_ms} ms before the touch: {:?}", bench.words());
        bench.until(3_000, |_| false);
        let now = bench.board.place();
        assert!(now[2] < place[2] + 0.1, "{early_ms} ms before the touch it rose: {place:?}, {now:?}");
    }
}

#[test]
fn unheard_alarm_loses_the_position() {
    let probe = EngineAsk::Probe { depth_mm: 40.0, mm_per_min: 60.0, plate_mm: 0.0, up_mm: 1.0 };
    let rows: [(Option<EngineAsk>, EnginePhase); 4] = [
        (None, EnginePhase::Ready),
        (Some(EngineAsk::Survey(start())), EnginePhase::Surveying),
        (Some(probe), EnginePhase::Probing),
        (Some(EngineAsk::Jog { axis: 2, um: -5_000, mm_per_min: 60.0, anyway: false }), EnginePhase::Jogging),
    ];
    for (ask, phase) in rows {
        let mut bench = bench(Some(|_, _| ZERO[2] - 9.0));
        bench.until(500, |_| false);
        let surveys = matches!(ask, Some(EngineAsk::Survey(_)));
        ask.into_iter().for_each(|ask| bench.event(EngineEvent::Ask(ask)));
        bench.until(500, |_| false);
        assert_eq!(bench.engine().phase, phase);
        bench.board.lock_unheard();
        assert!(bench.until(20_000, |bench| bench.engine().phase == EnginePhase::Locked), "{phase:?}");
        assert_eq!(bench.engine().trust, Trust::Lost, "{phase:?}");
        assert_eq!(found(&bench), ["grbl.alarm_other"], "{phase:?}");
        assert_eq!(survey_of(&bench), surveys.then_some(None));
        bench.event(EngineEvent::Ask(EngineAsk::Home));
        assert!(bench.until(20_000, |bench| bench.engine().trust == Trust::Trusted), "{phase:?}");
    }
}

#[test]
fn survey_ended_by_unplugging_or_reset_is_reported() {
    for (code, pulled) in [("level.unplugged", true), ("level.reset", false)] {
        let mut bench = bench(Some(bow));
        bench.event(EngineEvent::Ask(EngineAsk::Survey(start())));
        bench.until(3_000, |_| false);
        if pulled {
            bench.unplug();
        } else {
            bench.board.power_up();
        }
        assert!(bench.until(20_000, |bench| survey_of(bench).is_some()), "{:?}", bench.words());
        assert_eq!((survey_of(&bench), found(&bench)), (Some(None), vec![code.to_owned()]));
        assert_eq!(bench.engine().trust, Trust::Lost);
    }
}

#[test]
fn survey_stop_needs_more_than_one_report_of_rest() {
    let mut bench = bench(Some(bow));
    bench.event(EngineEvent::Ask(EngineAsk::Survey(start())));
    bench.until(3_000, |_| false);
    bench.event(EngineEvent::Ask(EngineAsk::Hold));
    assert!(bench.until(100_000, |bench| bench.engine().phase == EnginePhase::Held));
    bench.told.clear();
    // Every feed hold is lost, so that the only sign is a report of rest.
    bench.instead = Some((b"!", b""));
    bench.event(EngineEvent::Ask(EngineAsk::Stop));
    assert!(bench.until(20_000, |bench| bench.engine().phase == EnginePhase::Ready), "{:?}", bench.words());
    let holds = bench.told.iter().filter(|told| **told == EngineAction::Write(b"!".to_vec())).count();
    assert_eq!((holds, bench.engine().trust), (4, Trust::Trusted));
}

#[test]
fn damaged_lines_leave_no_wrong_survey_height() {
    let (mut whole, mut ended) = (0, 0);
    for seed in 0..24 {
        let faults = Faults { lost: 1e-4, damaged: 1e-4, back: 1e-4 };
        let mut bench = Bench::new(seed, faults);
        bench.board.surface = Some(bow);
        if !bench.ready() {
            continue;
        }
        bench.told.clear();
        bench.event(EngineEvent::Ask(EngineAsk::Survey(start())));
        let over = bench.until(600_000, |bench| {
            survey_of(bench).is_some() || bench.engine().phase == EnginePhase::Closed
        });
        assert!(over, "seed {seed}: {:?}", bench.words());
        let Some(survey) = survey_of(&bench).flatten() else {
            ended += 1;
            continue;
        };
        whole += 1;
        let map = map(&survey);
        for (index, height) in map.heights.iter().enumerate() {
            let place = map.grid.nth(index);
            let wanted = bow(place.x.mm() + ZERO[0], place.y.mm() + ZERO[1]) - ZERO[2];
            // A lost feed leaves the previous one in force: this controller stops within a millisecond,
            // about 13 µm.
            assert!((height.mm() - wanted).abs() < 0.02, "seed {seed}: {index}: {height:?} not {wanted}");
        }
    }
    assert!(whole > 2 && ended > 2, "{whole} whole, {ended} ended");
}

#[test]
fn job_follows_a_moved_and_rotated_board() {
    let hole = |planned: [f64; 2], found: [f64; 2]| FoundHole {
        planned: Point::from_mm(planned[0], planned[1]),
        found: Point::from_mm(found[0], found[1]),
    };
    // A rotation by about 0.57 degrees and a shift.
    let fit = BoardFit::of(&[hole([0.0, 0.0], [1.0, -2.0]), hole([100.0, 0.0], [100.995, -1.0])]).unwrap();
    let text =
        "G21 G90\nG0 Z5\nG0 X2 Y3\nM3 S9000\nG1 Z-0.1 F100\nG2 X6 Y3 I2 J0 F300\nG1 X9 Y7\nG0 Z5\nM5\nM2\n";
    let planned = read("arc", &[("arc.nc".to_owned(), text.to_owned())]).unwrap();
    let moved = aligned_routine(&planned, &fit);
    assert_ne!(moved.key, planned.key);
    assert_eq!(aligned_routine(&planned, &fit), moved);
    let place = |[x, y, z]: [Length; 3]| {
        let at = fit.moved(Point::new(x, y));
        [at.x, at.y, z]
    };
    let mut arcs = 0;
    for (before, after) in planned.sections.iter().zip(&moved.sections) {
        assert_eq!(after.entry, place(before.entry));
        for (before, after) in before.actions.iter().zip(&after.actions) {
            let (RoutineAction::Go(before), RoutineAction::Go(after)) = (before, after) else { continue };
            assert_eq!((after.to, after.line), (place(before.to), before.line));
            if let (Course::Arc { centre, ccw }, Course::Arc { centre: moved, ccw: same }) =
                (before.course, after.course)
            {
                let at = fit.moved(Point::new(centre[0], centre[1]));
                assert_eq!((moved, same), ([at.x, at.y], ccw));
                arcs += 1;
            }
        }
    }
    assert_eq!(arcs, 1);
}
