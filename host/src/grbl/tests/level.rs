//! Tests of a height map from the page: measured, followed, refused if it does not fit, forgotten.

use super::*;
use annulus_core::geometry::Bounds;
use annulus_core::job::touched;
use annulus_core::level::{ProbeGrid, key_of};
use annulus_core::units::Length;
use annulus_core::wire::{ArmedJob, HeightMapReport};

/// True height of the board: tilted, bowed, and level with the work zero at the work zero.
fn bowed(x: f64, y: f64) -> f64 {
    let (x, y) = (x - ZERO[0], y - ZERO[1]);
    ZERO[2] + 0.004 * x - 0.003 * y + 0.000_2 * x * (40.0 - x)
}

pub(super) fn one_bit(count: usize) -> Program {
    drilled::holes(&hobby_3018(), count, 4, |_| 800)
}

pub(super) fn wish(program: &Program) -> Ask {
    let bounds: Bounds = touched(program).unwrap();
    let grid = ProbeGrid::over(bounds, Length::from_mm(6.0), Length::from_mm(1.0)).unwrap();
    Ask::Survey { grid, job: key_of(program), clear_um: 1_000, depth_um: 2_000, now_s: 1_764_000_000 }
}

impl Bench {
    fn report(&self) -> HeightMapReport {
        let mut told = self.heard.iter().rev();
        let report =
            told.find_map(|tell| if let Tell::HeightMap(report) = tell { Some(report) } else { None });
        report.map(|report| report.as_ref().clone()).unwrap_or_default()
    }

    fn survey(&mut self, program: &Program) {
        assert_eq!(self.refused(&wish(program)), None);
        self.state(State::Jogging);
        self.state(State::Ready);
        (0..500).for_each(|_| self.millisecond());
    }

    fn unlock(&mut self) {
        self.ask(&Ask::Unlock);
        (0..500).for_each(|_| self.millisecond());
    }

    fn warned(&mut self, key: &str, from_leg: u32) -> Vec<String> {
        assert_eq!(self.fails(key, from_leg), Vec::<String>::new());
        let armed = self.heard.iter().rev().find_map(|tell| match tell {
            Tell::Armed(ArmedJob { checks, .. }) => Some(checks.clone()),
            _ => None,
        });
        let warned = armed.unwrap().into_iter().filter(|row| row.verdict == RowVerdict::Warn);
        warned.map(|row| row.finding.code).filter(|code| code.starts_with("level.")).collect()
    }
}

#[test]
fn surveyed_board_is_followed_by_the_job() {
    let (files, program) = (Memory::default(), one_bit(10));
    let mut bench = Bench::ready(&files);
    bench.board.surface = Some(bowed);
    let key = bench.upload(&program);
    assert_eq!((bench.report().grid, bench.warned(&key, 0)), (None, vec![]));
    // The tool touches the board: the contact reports that before it is lifted.
    bench.survey(&program);
    let report = bench.report();
    let grid = report.grid.unwrap();
    assert_eq!((report.goes, report.done, report.heights.len()), (false, report.of, grid.count()));
    assert_eq!((report.refused, report.job), (None, key_of(&program)));
    for (index, height) in report.heights.iter().enumerate() {
        let place = grid.nth(index);
        let wanted = bowed(place.x.mm() + ZERO[0], place.y.mm() + ZERO[1]) - ZERO[2];
        assert!((height.unwrap().mm() - wanted).abs() < 0.004, "{index}: {height:?} not {wanted}");
    }
    assert_eq!(bench.warned(&key, 0), ["level.follows"]);
    bench.board.cuts.clear();
    bench.start(&key, 0);
    assert_eq!(bench.finish(), (Ending::Done, 10));
    for bottom in bottoms(&program) {
        let at = [bottom[0] + ZERO[0], bottom[1] + ZERO[1]];
        let cuts =
            bench.board.cuts.iter().filter(|cut| (0..2).all(|axis| (cut[axis] - at[axis]).abs() < NEAR));
        let lowest = cuts.map(|cut| cut[2] - bowed(cut[0], cut[1])).fold(f64::MAX, f64::min);
        assert!((lowest - bottom[2]).abs() < 0.02, "{lowest} not {}", bottom[2]);
    }
}

#[test]
fn height_map_survives_reload_until_forgotten() {
    let (files, program) = (Memory::default(), one_bit(6));
    let mut bench = Bench::ready(&files);
    bench.board.surface = Some(bowed);
    bench.survey(&program);
    let before = bench.report();
    let mut again = bench.replug();
    again.ask(&Ask::Home);
    again.state(State::Ready);
    (0..500).for_each(|_| again.millisecond());
    let key = again.upload(&program);
    assert_eq!(again.report().heights, before.heights);
    assert_eq!(again.fails(&key, 0), ["grbl.no_height"]);
    // Setting Z zero elsewhere on the board gives the map's height there, not 0.
    for (axis, mm) in [(0, 12.0), (1, 9.0)] {
        let place = again.status().unwrap().work_mm[usize::from(axis)];
        again.jog(axis, mm - place);
    }
    let at = again.status().unwrap().machine_mm;
    again.jog(2, bowed(at[0], at[1]) - at[2]);
    assert_eq!(again.refused(&Ask::SetHeight), None);
    (0..500).for_each(|_| again.millisecond());
    let height_mm = again.status().unwrap().work_mm[2];
    assert!((height_mm - (bowed(at[0], at[1]) - ZERO[2])).abs() < 0.02, "{height_mm}");
    assert_eq!(again.warned(&key, 0), ["level.follows"]);
    // A job with another zero in its files does not follow the map, and its height was not set with it.
    let mut other = program.clone();
    other.origin.x += Length::from_mm(1.0);
    let other = again.upload(&other);
    assert_eq!(again.fails(&other, 0), ["level.other_height"]);
    // After the zero moved, the map no longer fits.
    again.jog(2, 3.0);
    again.jog(0, 1.0);
    assert_eq!(again.refused(&Ask::SetZero), None);
    (0..500).for_each(|_| again.millisecond());
    assert_eq!(again.fails(&key, 0), ["level.other_zero"]);
    assert_eq!(again.report().refused.unwrap().code, "level.other_zero");
    assert_eq!(again.refused(&Ask::ForgetHeightMap), None);
    // The map is deleted; the Z zero still refers to it.
    assert_eq!((again.report().grid, again.fails(&key, 0)), (None, vec!["level.other_height".to_owned()]));
    assert_eq!(again.refused(&Ask::SetHeight), None);
    (0..500).for_each(|_| again.millisecond());
    assert!(again.status().unwrap().work_mm[2].abs() < 0.02);
    assert_eq!(again.warned(&key, 0), Vec::<String>::new());
    assert_eq!(again.replug().report().grid, None);
}

#[test]
fn height_set_off_the_map_does_not_fit_its_job() {
    let (files, program) = (Memory::default(), one_bit(6));
    let mut bench = Bench::ready(&files);
    bench.board.surface = Some(bowed);
    bench.survey(&program);
    let mut other = program.clone();
    other.origin.x += Length::from_mm(1.0);
    let (key, other) = (bench.upload(&program), bench.upload(&other));
    // At the map's starting point the height is that of the board itself: valid for both jobs.
    assert_eq!(
        (bench.warned(&key, 0), bench.warned(&other, 0)),
        (vec!["level.follows".to_owned()], vec!["level.not_used".to_owned()])
    );
    // The other job starts, and its tool change sets the height again: for a board without a map.
    bench.start(&other, 0);
    bench.state(State::ToolChange);
    let at = bench.status().unwrap().work_mm[2];
    bench.jog(2, 0.25 - at);
    assert_eq!(bench.refused(&Ask::SetHeight), None);
    (0..500).for_each(|_| bench.millisecond());
    assert!(bench.status().unwrap().work_mm[2].abs() < 0.02);
    bench.ask(&Ask::Stop);
    bench.state(State::Ready);
    (0..500).for_each(|_| bench.millisecond());
    assert_eq!(bench.fails(&key, 0), ["level.other_height"]);
    assert_eq!(bench.refused(&Ask::SetHeight), None);
    (0..500).for_each(|_| bench.millisecond());
    assert_eq!(bench.warned(&key, 0), ["level.follows"]);
}

#[test]
fn unknown_position_refuses_a_height() {
    let mut bench = Bench::plug(&Memory::default(), Automaton::new([-20.0, -30.0, -10.0]));
    bench.ask(&Ask::Unlock);
    bench.state(State::Ready);
    (0..500).for_each(|_| bench.millisecond());
    for ask in [Ask::SetHeight, Ask::Probe { depth_um: 1_000, plate_um: 0 }] {
        assert_eq!(bench.refused(&ask).as_deref(), Some("control.not_homed"), "{ask:?}");
    }
}

#[test]
fn survey_probes_as_deep_as_allowed() {
    let program = one_bit(6);
    let mut bench = Bench::ready(&Memory::default());
    bench.board.cuts.clear();
    assert_eq!(bench.refused(&wish(&program)), None);
    bench.state(State::Jogging);
    bench.state(State::Ready);
    let lowest = bench.board.cuts.iter().map(|place| place[2] - ZERO[2]).fold(0.0, f64::min);
    assert!((lowest + 2.0).abs() < 0.02, "{lowest}");
}

#[test]
fn interrupted_job_resumes_only_with_its_height_map() {
    let (files, program) = (Memory::default(), one_bit(8));
    let mut bench = Bench::ready(&files);
    bench.board.surface = Some(bowed);
    bench.survey(&program);
    let key = bench.upload(&program);
    bench.start(&key, 0);
    bench.state(State::ToolChange);
    bench.ask(&Ask::ToolChanged);
    bench.until(|status| status.holes_done == 3);
    let mut again = bench.replug();
    again.ask(&Ask::Home);
    again.state(State::Ready);
    (0..500).for_each(|_| again.millisecond());
    let (job, next_leg, _) = again.offer().unwrap();
    assert_eq!(again.warned(&job, next_leg), ["level.follows"]);
    assert_eq!(again.refused(&Ask::ForgetHeightMap), None);
    assert_eq!(again.fails(&job, next_leg), ["level.other_map"]);
    let start = Ask::Start { job, stream_digest: String::new(), from_leg: next_leg };
    assert_eq!(again.refused(&start).as_deref(), Some("level.other_map"));
}

#[test]
fn job_without_homing_resumes_but_does_not_restart_with_its_map() {
    let program = one_bit(8);
    let mut board = Automaton::new(ZERO);
    board.settings.retain(|(number, _)| *number != 22);
    let mut bench = Bench::plug(&Memory::default(), board);
    bench.board.surface = Some(bowed);
    bench.unlock();
    bench.set_zero();
    bench.survey(&program);
    let key = bench.upload(&program);
    assert_eq!(bench.warned(&key, 0), ["level.follows"]);
    bench.start(&key, 0);
    bench.state(State::ToolChange);
    bench.ask(&Ask::ToolChanged);
    bench.until(|status| status.holes_done == 3);
    let mut again = bench.replug();
    again.unlock();
    // The user lifts the tool and sets what looks like the old work zero: nothing can verify that.
    again.jog(2, 8.0);
    again.set_zero();
    let (job, next_leg, _) = again.offer().unwrap();
    assert_eq!(again.warned(&job, next_leg), ["level.follows"]);
    assert_eq!(again.fails(&job, 0), ["level.other_zero"], "another board may lie there");
    let start = Ask::Start { job, stream_digest: String::new(), from_leg: 0 };
    assert_eq!(again.refused(&start).as_deref(), Some("level.other_zero"));
}

#[test]
fn survey_needs_a_height_and_stops() {
    let (files, program) = (Memory::default(), one_bit(6));
    let mut bench = Bench::plug(&files, Automaton::new([-20.0, -30.0, -10.0]));
    bench.ask(&Ask::Home);
    bench.state(State::Ready);
    assert_eq!(bench.refused(&wish(&program)).as_deref(), Some("grbl.no_height"));
    let mut bench = Bench::ready(&Memory::default());
    bench.board.surface = Some(bowed);
    assert_eq!(bench.refused(&wish(&program)), None);
    bench.state(State::Jogging);
    while bench.report().done < 2 {
        bench.millisecond();
    }
    bench.ask(&Ask::Pause);
    bench.state(State::Paused);
    bench.ask(&Ask::Resume);
    bench.state(State::Jogging);
    bench.ask(&Ask::Stop);
    bench.state(State::Ready);
    (0..500).for_each(|_| bench.millisecond());
    assert_eq!((bench.report().grid, bench.report().goes), (None, false));
    let place = bench.board.place();
    (0..2_000).for_each(|_| bench.millisecond());
    assert_eq!(bench.board.place(), place);
}
