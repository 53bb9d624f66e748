//! Tests with a tilted and bowed board: the drill's contact sensor measures it, jobs follow it, and the
//! drilled depths are compared.

use super::*;
use annulus_core::job::{Command, touched};
use annulus_core::level::{ProbeGrid, key_of};
use annulus_core::virtual_drill::UnevenBoard;
use annulus_core::wire::{ArmedJob, HeightMapReport};

/// Allowed error of a hole's depth, mm: two steps, a touch noticed one step late, and interpolation between
/// points.
pub(super) const TOLERANCE_MM: f64 = 0.015;
pub(super) const THICK_MM: f64 = 1.6;

fn deep(depth_mm: f64) -> Program {
    deepened(holes(24), depth_mm)
}

pub(super) fn deepened(mut program: Program, depth_mm: f64) -> Program {
    for command in program.legs.iter_mut().flat_map(|leg| &mut leg.commands) {
        if let Command::Plunge { to, .. } = command {
            *to = Length::from_mm(-depth_mm);
        }
    }
    program
}

pub(super) fn wish(program: &Program) -> Ask {
    let bounds = touched(program).unwrap();
    let grid = ProbeGrid::over(bounds, Length::from_mm(5.0), Length::from_mm(0.5)).unwrap();
    Ask::Survey { grid, job: key_of(program), clear_um: 1_000, depth_um: 2_000, now_s: 1_764_000_000 }
}

/// A homed machine with a board that is not flat; the zero is not at its corner.
fn askew(files: &Memory) -> Bench {
    let mut bench = Bench::open(files);
    bench.ask(&Ask::Provoke { faults: vec!["board-not-flat".to_owned()] });
    bench.home();
    bench
}

fn ready_askew(files: &Memory) -> Bench {
    let mut bench = askew(files);
    bench.ask(&Ask::SetZero);
    bench.turn(Duration::from_millis(200));
    bench
}

impl Bench {
    pub(super) fn report(&self) -> HeightMapReport {
        let mut told = self.heard.iter().rev();
        let report =
            told.find_map(|tell| if let Tell::HeightMap(report) = tell { Some(report) } else { None });
        report.unwrap().as_ref().clone()
    }

    fn by_hand(&mut self, axis: u8, distance_um: i32) {
        self.ask(&Ask::Jog { axis, distance_um, anyway: false });
        for _ in 0..20 {
            self.ask(&Ask::JogOn);
            self.turn(TURN);
        }
        self.until(|status| status.state == State::Ready);
        self.turn(Duration::from_millis(200));
    }

    pub(super) fn survey(&mut self, program: &Program) -> HeightMapReport {
        self.ask(&wish(program));
        assert_eq!(self.status().state, State::Running, "{:?}", self.refused());
        self.until(|status| matches!(status.state, State::Ready | State::Alarm));
        self.report()
    }

    /// Arms the program. Returns its key, whether it follows the map, and the pre-flight codes about that.
    pub(super) fn armed(&mut self, program: &Program, from_leg: u32) -> (String, bool, Vec<String>) {
        let bytes = program::encode(program);
        let key = program::key(&bytes);
        self.drill.upload(&key, bytes).unwrap();
        self.ask(&Ask::Arm { job: key.clone(), from_leg });
        let armed = self.heard.iter().rev().find_map(|tell| match tell {
            Tell::Armed(ArmedJob { levelled, checks, .. }) => Some((*levelled, checks.clone())),
            _ => None,
        });
        let (levelled, checks) = armed.unwrap();
        let codes = checks.into_iter().map(|row| row.finding.code);
        (key, levelled, codes.filter(|code| code.starts_with("level.")).collect())
    }

    /// Drills it. Returns how many holes went through, by the drilled-board record.
    pub(super) fn through(&mut self, files: &Memory, program: &Program) -> usize {
        let recorded =
            || String::from_utf8(files.clone().read(File::Drilled).unwrap()).unwrap().lines().count();
        let before = recorded();
        self.start(program, 0);
        self.finish();
        self.until(|status| matches!(status.state, State::Ready | State::Alarm) && status.stage.is_none());
        self.ask(&Ask::AcknowledgeAlarm);
        recorded() - before
    }
}

#[test]
fn holes_have_planned_depth_only_with_the_height_map() {
    let files = Memory::default();
    let (just_through, just_not) = (deep(THICK_MM + TOLERANCE_MM), deep(THICK_MM - TOLERANCE_MM));
    let mut bench = ready_askew(&files);
    assert_eq!(bench.report(), HeightMapReport::default());
    assert!(bench.through(&files, &just_through) < 6, "as it lies");
    let report = bench.survey(&just_through);
    assert_eq!((report.goes, report.refused, bench.status().alarm.clone()), (false, None, None));
    let (grid, zero) = (report.grid.unwrap(), bench.status().zero_mm.unwrap());
    for (index, height) in report.heights.iter().enumerate() {
        let place = grid.nth(index);
        let wanted = UnevenBoard::BOWED.raised_mm(place.x.mm() + zero[0], place.y.mm() + zero[1]);
        assert!((height.unwrap().mm() - wanted).abs() < 0.006, "{index}: {height:?} not {wanted}");
    }
    let (_, levelled, codes) = bench.armed(&just_through, 0);
    assert_eq!((levelled, codes), (true, vec!["level.follows".to_owned()]));
    assert_eq!(bench.through(&files, &just_through), 24);
    assert_eq!(bench.through(&files, &just_not), 0);
    bench.ask(&Ask::ForgetHeightMap);
    assert_eq!(bench.report(), HeightMapReport::default());
    assert!(bench.through(&files, &just_through) < 6, "without its map");
}

#[test]
fn early_contact_is_measured_against_the_height_map() {
    let program = deep(THICK_MM + 0.1);
    let tolerance = || vec![("stroke.contact_tolerance".to_owned(), Value::Number(0.08))];
    for (faults, wanted) in [
        (vec!["board-not-flat"], (Ending::Done, 24, None)),
        (vec!["board-not-flat", "contact-early@6"], (Ending::Alarm, 6, Some("0.25".to_owned()))),
    ] {
        let mut bench = Bench::open(&Memory::default());
        bench.ask(&Ask::Configure { changes: tolerance() });
        bench.ask(&Ask::Provoke { faults: faults.iter().map(|fault| (*fault).to_owned()).collect() });
        bench.home();
        bench.ask(&Ask::SetZero);
        bench.turn(Duration::from_millis(200));
        let report = bench.survey(&program);
        let most = report.heights.iter().flatten().map(|height| height.mm().abs()).fold(0.0, f64::max);
        assert!(most > 0.16, "the board lies twice as far off as the tip may touch: {most}");
        bench.start(&program, 0);
        let (ending, holes) = bench.finish();
        let alarm = bench.status().alarm.clone();
        let early = alarm.filter(|why| why.code == "control.early_contact");
        let above = early.and_then(|why| why.argument(&["mm"]).map(str::to_owned));
        assert_eq!((ending, holes, above), wanted, "{faults:?}: {:?}", bench.status().alarm);
    }
}

#[test]
fn height_map_survives_reload_and_refuses_other_zero_or_job() {
    let (files, program) = (Memory::default(), deep(1.62));
    let mut bench = ready_askew(&files);
    let report = bench.survey(&program);
    drop(bench);
    let mut again = askew(&files);
    assert_eq!(again.report().heights, report.heights);
    assert_eq!(again.armed(&program, 0).2, ["level.follows"]);
    let mut other = program.clone();
    other.origin.x += Length::from_mm(1.0);
    let (_, levelled, codes) = again.armed(&other, 0);
    assert_eq!((levelled, codes), (false, vec!["level.not_used".to_owned()]));
    again.by_hand(0, 500);
    again.ask(&Ask::SetZero);
    assert_eq!(again.armed(&program, 0).2, ["level.other_zero"]);
    assert_eq!(again.report().refused.map(|why| why.code).as_deref(), Some("level.other_zero"));
    again.ask(&Ask::UndoZero);
    assert_eq!(again.armed(&program, 0).2, ["level.follows"]);
    let changes = vec![("stroke.surface".to_owned(), Value::Number(-29.5))];
    again.ask(&Ask::Configure { changes });
    again.home();
    assert_eq!(again.armed(&program, 0).2, ["level.other_height"]);
}

#[test]
fn interrupted_job_resumes_only_with_its_height_map() {
    let (files, program) = (Memory::default(), deep(1.62));
    let mut bench = ready_askew(&files);
    bench.survey(&program);
    bench.start(&program, 0);
    bench.until(|status| status.state == State::ToolChange);
    bench.ask(&Ask::ToolChanged);
    bench.until(|status| status.holes_done >= 5);
    drop(bench);
    let mut again = askew(&files);
    let (_, leg) = again.offer().unwrap();
    let (key, levelled, codes) = again.armed(&program, leg);
    assert_eq!((levelled, codes), (true, vec!["level.follows".to_owned()]));
    again.ask(&Ask::ForgetHeightMap);
    assert_eq!(again.armed(&program, leg).2, ["level.other_map"]);
    again.ask(&Ask::Start { job: key, stream_digest: String::new(), from_leg: leg });
    assert_eq!(again.refused(), Some("control.not_armed"));
}

#[test]
fn missing_or_closed_contact_ends_the_survey_without_a_map() {
    let program = deep(1.62);
    let mut bench = Bench::open(&Memory::default());
    bench.ask(&Ask::Provoke { faults: vec!["contact-missing".to_owned()] });
    bench.home();
    bench.ask(&Ask::SetZero);
    let report = bench.survey(&program);
    let ends = |bench: &Bench| bench.status().alarm.as_ref().map(|why| why.code.clone());
    assert_eq!((ends(&bench).as_deref(), report.grid), (Some("level.no_board"), None));
    assert_eq!(bench.status().trust, Trust::Trusted);
    // The tool already touches the board: the contact cannot find the surface.
    let mut bench = ready(&Memory::default());
    let down = bench.status().work_mm[2] + 0.03;
    bench.by_hand(2, (-down * 1e3) as i32);
    bench.ask(&Ask::Probe { depth_um: 5_000, plate_um: 0 });
    bench.until(|status| status.state == State::Alarm);
    assert_eq!(ends(&bench).as_deref(), Some("level.contact_closed"));
    assert_eq!(bench.status().trust, Trust::Trusted);
}

#[test]
fn survey_pauses_lifted_stops_at_once_and_needs_homing() {
    let (files, program) = (Memory::default(), deep(1.62));
    let mut bench = askew(&files);
    bench.ask(&wish(&program));
    assert_eq!(bench.refused(), Some("preflight.no_zero"));
    bench.ask(&Ask::SetZero);
    bench.ask(&wish(&program));
    while bench.report().done < 3 {
        bench.turn(TURN);
    }
    bench.ask(&wish(&program));
    assert_eq!(bench.refused(), Some("control.busy"));
    bench.ask(&Ask::Pause);
    let height = bench.until(|status| status.state == State::Paused).work_mm[2];
    assert!(height > 0.5, "{height}");
    bench.ask(&Ask::QueueRun { mode: annulus_core::queue::Mode::ToEnd });
    assert_eq!(bench.refused(), Some("control.busy"));
    bench.ask(&Ask::Resume);
    let done = bench.report().done;
    while bench.report().done < done + 2 {
        bench.turn(TURN);
    }
    bench.ask(&Ask::Stop);
    let rests = bench.until(|status| status.state == State::Ready).steps;
    assert_eq!((bench.report().grid, bench.report().goes), (None, false));
    assert_eq!(bench.refused(), Some("level.stopped"));
    (0..200).for_each(|_| bench.turn(TURN));
    assert_eq!(bench.status().steps, rests);
    bench.ask(&Ask::Provoke { faults: Vec::new() });
    bench.ask(&wish(&program));
    assert_eq!(bench.refused(), Some("control.not_homed"));
}

#[test]
fn plate_sets_the_board_height_and_the_map_follows() {
    let (files, program) = (Memory::default(), deep(1.62));
    let mut bench = ready_askew(&files);
    bench.ask(&Ask::Probe { depth_um: 0, plate_um: 0 });
    assert_eq!(bench.refused(), Some("touch.bad"));
    // From the top, 30 mm above the board: further than the probe may search.
    bench.ask(&Ask::Probe { depth_um: 5_000, plate_um: 0 });
    let status = bench.until(|status| status.state == State::Alarm);
    assert_eq!((status.alarm.unwrap().code.as_str(), status.trust), ("level.no_board", Trust::Trusted));
    bench.until(|status| status.stage.is_none());
    bench.ask(&Ask::AcknowledgeAlarm);
    bench.survey(&program);
    bench.by_hand(0, 12_000);
    let (at, before) = (bench.status().work_mm, virtual_drill().process.surface);
    let surface = |bench: &Bench| {
        let told = bench.heard.iter().rev().find_map(|tell| match tell {
            Tell::Machine { settings, .. } => {
                settings.iter().find(|(key, _)| key == "stroke.surface").map(|(_, value)| value.clone())
            }
            _ => None,
        });
        let Some(Value::Number(mm)) = told else { panic!("{told:?}") };
        mm
    };
    // The touch agrees with the map: the surface stays, less the plate.
    bench.ask(&Ask::Probe { depth_um: 45_000, plate_um: 1_500 });
    bench.until(|status| status.state == State::Ready);
    assert!((surface(&bench) - (before.mm() - 1.5)).abs() < 0.006, "{} {at:?}", surface(&bench));
    assert_eq!(
        (bench.status().trust, bench.armed(&program, 0).2),
        (Trust::Trusted, vec!["level.follows".to_owned()])
    );
    bench.ask(&Ask::ForgetHeightMap);
    bench.ask(&Ask::Probe { depth_um: 45_000, plate_um: 0 });
    bench.until(|status| status.state == State::Ready);
    let zero = bench.status().zero_mm.unwrap();
    let lies = UnevenBoard::BOWED.raised_mm(at[0] + zero[0], at[1] + zero[1]);
    assert!((surface(&bench) - (before.mm() + lies)).abs() < 0.006, "{}", surface(&bench));
}

#[test]
fn edges_are_found_from_either_side_with_the_tool_radius() {
    let mut bench = ready(&Memory::default());
    let machine = virtual_drill();
    // The virtual drill's board ends 0.2 mm inside its travel.
    for (axis, settings) in [(0_usize, &machine.x), (1, &machine.y)] {
        for up in [true, false] {
            bench.ask(&Ask::SetZero);
            let end = if up { settings.min } else { settings.max };
            // Move the other axis over the board.
            let over = 50.0 - bench.status().machine_mm[1 - axis];
            bench.by_hand(1 - axis as u8, (over * 1_000.0) as i32);
            let way = end.mm() - bench.status().machine_mm[axis];
            bench.by_hand(axis as u8, (way * 1_000.0) as i32);
            assert!((bench.status().machine_mm[axis] - end.mm()).abs() < 0.02);
            bench.by_hand(2, -31_000);
            assert!(bench.status().work_mm[2] < -0.5, "{:?}", bench.status().work_mm);
            let before = bench.status().zero_mm.unwrap();
            bench.ask(&Ask::Edge { axis: axis as u8, up, reach_um: 5_000, tool_um: 800 });
            let status = bench.until(|status| matches!(status.state, State::Ready | State::Alarm));
            bench.turn(Duration::from_millis(200));
            assert_eq!(status.alarm, None);
            let zero = bench.status().zero_mm.unwrap();
            let edge = if up { end.mm() + 0.2 + 0.4 } else { end.mm() - 0.2 - 0.4 };
            assert!((zero[axis] - edge).abs() < 0.03, "axis {axis} up {up}: {} not {edge}", zero[axis]);
            assert!((zero[1 - axis] - before[1 - axis]).abs() < 1e-9, "the other axis stays");
            assert!(bench.status().work_mm[2] > 1.0, "the tip is up");
        }
    }
    // Away from an edge nothing is found, and the zero stays.
    let zero = bench.status().zero_mm;
    bench.ask(&Ask::Edge { axis: 0, up: false, reach_um: 3_000, tool_um: 800 });
    let status = bench.until(|status| status.state == State::Alarm);
    assert_eq!((status.alarm.unwrap().code.as_str(), status.zero_mm), ("touch.no_edge", zero));
}
