//! Tests of a job that is read in check mode: with a controller that supports it, without one, and with
//! interruptions.

use super::survey::found;
use super::*;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::grbl::CheckNews;

/// A program whose lines 8 and 13 are M7, which some controllers lack.
fn misty() -> Arc<Routine> {
    let text = "G21 G90\nG0 Z8\nG0 X0 Y0\n(MSG, tool 1)\nM0\nM3 S9000\nG4 P60\nM7\nG0 X3 Y4\nG1 Z-1.7 F600\nG0 Z2\n\
                M9\nM7\nG0 X7 Y4\nG1 Z-1.7\nG0 Z2\nM5\nG0 Z8\nM2\n";
    Arc::new(read("misty", &[("misty.nc".to_owned(), text.to_owned())]).unwrap())
}

fn long() -> Arc<Routine> {
    let mut text = "G21 G90\nG0 Z8\nG0 X0 Y0\nM3 S9000\n".to_owned();
    for hole in 0..300 {
        text += &format!("G0 X{} Y{}\nG1 Z-1.7 F600\nG0 Z2\n", hole % 20, hole / 20);
    }
    Arc::new(read("long", &[("long.nc".to_owned(), text + "M5\nG0 Z8\nM2\n")]).unwrap())
}

impl Bench {
    fn check(&mut self, routine: Arc<Routine>) {
        self.told.clear();
        self.event(EngineEvent::Ask(EngineAsk::Check { routine, written: Arc::default() }));
    }

    fn over(&self) -> Option<(u32, u32, u32, Option<Diagnostic>)> {
        self.told.iter().find_map(|action| match action {
            EngineAction::Check(CheckNews::Over { done, of, refused, why }) => {
                Some((*done, *of, *refused, why.clone()))
            }
            _ => None,
        })
    }

    fn why(&self) -> Option<String> {
        self.over().and_then(|(.., why)| why).map(|why| why.code)
    }

    fn stands(&self) -> ([f64; 3], usize) {
        (self.board.place(), self.board.cuts.len())
    }

    fn rests_as_before(&mut self, stood: ([f64; 3], usize)) {
        assert!(self.until(10_000, |bench| {
            bench.engine().phase == EnginePhase::Ready && bench.engine().place().is_some()
        }));
        self.until(1_000, |_| false);
        assert_eq!((self.stands(), self.engine().trust), (stood, Trust::Trusted));
    }
}

impl Bench {
    /// Waits until moves of a long job are being read.
    fn reads_long(&mut self) {
        self.check(long());
        let is_move =
            |told: &EngineAction| matches!(told, EngineAction::Write(bytes) if bytes.starts_with(b"G91"));
        assert!(self.until(5_000, |bench| bench.told.iter().any(is_move)), "{:?}", self.words());
    }
}

#[test]
fn checked_job_runs_without_motion_and_then_for_real() {
    let mut bench = Bench::new(1, Faults::default());
    assert!(bench.ready());
    let stood = bench.stands();
    bench.check(routine());
    assert_eq!(bench.engine().phase, EnginePhase::Checking);
    assert!(bench.until(30_000, |bench| bench.over().is_some()), "{:?}", bench.words());
    let (done, of, refused, why) = bench.over().unwrap();
    assert!(done == of && of > 40, "{done} of {of}");
    assert_eq!((refused, why, bench.board.overrun), (0, None, 0));
    bench.rests_as_before(stood);
    bench.start(0);
    assert!(bench.run());
    assert_eq!((bench.ended(), bench.missing(), bench.wrong()), (Some(Ending::Done), vec![], vec![]));
}

#[test]
fn refused_lines_are_reported_by_program_line() {
    let mut bench = Bench::new(1, Faults::default());
    bench.board.has_mist = false;
    assert!(bench.ready());
    let stood = bench.stands();
    bench.check(misty());
    assert!(bench.until(30_000, |bench| bench.over().is_some()));
    let lines: Vec<(String, u32, String)> = bench
        .told
        .iter()
        .filter_map(|action| match action {
            EngineAction::Check(CheckNews::Refused { why }) => {
                let at = why.place.as_ref().unwrap();
                Some((why.code.clone(), at.line, why.argument(&["line"]).unwrap_or_default().to_owned()))
            }
            _ => None,
        })
        .collect();
    let row = |line| ("grbl.error_20".to_owned(), line, "M7".to_owned());
    assert_eq!(lines, [row(8), row(13)]);
    let (done, of, refused, why) = bench.over().unwrap();
    assert_eq!((done, refused, why), (of, 2, None));
    bench.rests_as_before(stood);
}

#[test]
fn refused_line_names_its_program() {
    let mut bench = Bench::new(1, Faults::default());
    bench.board.has_mist = false;
    assert!(bench.ready());
    let program = |line: &str| format!("G21 G90\nG0 Z2\nG0 X1 Y1\n{line}\nG1 Z-0.5 F600\nG0 Z2\nM9\nM2\n");
    let files = [("a.nc", "M8"), ("b.nc", "M7"), ("c.nc", "M7")];
    let files = files.map(|(name, line)| (name.to_owned(), program(line)));
    bench.check(Arc::new(read("board", &files).unwrap()));
    assert!(bench.until(30_000, |bench| bench.over().is_some()));
    let places = bench.told.iter().filter_map(|action| match action {
        EngineAction::Check(CheckNews::Refused { why }) => why.place.as_ref(),
        _ => None,
    });
    let mut places: Vec<(String, u32)> = places.map(|place| (place.file.clone(), place.line)).collect();
    places.dedup();
    assert_eq!(places, [("b.nc".to_owned(), 4), ("c.nc".to_owned(), 4)]);
}

#[test]
fn missing_check_mode_sends_no_line() {
    // Check mode is missing, or the request was damaged on the way and answered with `ok`.
    for (checks, instead) in [(false, None), (true, Some("$G\n")), (true, Some("\n")), (true, Some("$X\n"))] {
        let mut bench = Bench::new(1, Faults::default());
        bench.board.checks = checks;
        assert!(bench.ready());
        let stood = bench.stands();
        bench.instead = instead.map(|instead| (b"$C\n".as_slice(), instead.as_bytes()));
        bench.check(routine());
        assert!(bench.until(10_000, |bench| bench.over().is_some()), "{instead:?}");
        assert_eq!(bench.why().as_deref(), Some("grbl.no_check_mode"), "{instead:?}");
        assert_eq!(bench.over().map(|(done, ..)| done), Some(0), "{instead:?}");
        let sent = bench.told.iter().filter(
            |action| matches!(action, EngineAction::Write(bytes) if bytes.len() > 1 && bytes != b"$C\n"),
        );
        assert_eq!(sent.count(), 0, "{instead:?}");
        bench.rests_as_before(stood);
    }
}

#[test]
fn stop_ends_the_check_at_any_moment_without_motion() {
    for after_ms in [0, 5, 60, 150, 250, 300, 700] {
        let mut bench = Bench::new(1, Faults::default());
        assert!(bench.ready());
        let stood = bench.stands();
        bench.check(long());
        bench.until(after_ms, |_| false);
        bench.event(EngineEvent::Ask(EngineAsk::Stop));
        assert!(bench.until(10_000, |bench| bench.over().is_some()), "after {after_ms} ms");
        assert_eq!(bench.why().as_deref(), Some("grbl.check_stopped"), "after {after_ms} ms");
        bench.rests_as_before(stood);
    }
}

#[test]
fn stop_with_late_answers_leaves_check_mode_at_rest() {
    for after_ms in (0..700).step_by(23) {
        for (late_ms, lost) in [(0, false), (80, false), (400, false), (0, true), (80, true)] {
            let told = format!("after {after_ms} ms, {late_ms} ms late, lost {lost}");
            let mut bench = Bench::new(1, Faults::default());
            assert!(bench.ready());
            let stood = bench.stands();
            bench.check(long());
            bench.until(after_ms, |_| false);
            bench.heard_instead = lost.then_some(("ok", "k"));
            bench.on_the_way_until_ms = bench.now_ms + late_ms;
            bench.event(EngineEvent::Ask(EngineAsk::Stop));
            assert!(bench.until(10_000, |bench| bench.over().is_some()), "{told}");
            assert_eq!(bench.why().as_deref(), Some("grbl.check_stopped"), "{told}");
            let refused =
                |action: &&EngineAction| matches!(action, EngineAction::Check(CheckNews::Refused { .. }));
            assert_eq!(bench.told.iter().filter(refused).count(), 0, "{told}");
            bench.heard_instead = None;
            bench.rests_as_before(stood);
            // Check mode is off, the machine is unlocked, and every answer belongs to its line.
            bench.start(0);
            assert!(bench.run(), "{told}");
            assert_eq!((bench.ended(), bench.missing()), (Some(Ending::Done), vec![]), "{told}");
        }
    }
}

#[test]
fn stop_after_lost_check_mode_holds_first_and_reports() {
    let mut bench = Bench::new(1, Faults::default());
    assert!(bench.ready());
    let cuts = bench.board.cuts.len();
    bench.reads_long();
    bench.board.leaves_check_mode();
    assert!(bench.until(5_000, |bench| bench.board.cuts.len() > cuts), "it moves");
    bench.event(EngineEvent::Ask(EngineAsk::Stop));
    assert!(bench.until(20_000, |bench| bench.over().is_some()), "{:?}", bench.words());
    assert_eq!(bench.why().as_deref(), Some("grbl.check_left"));
    assert_eq!(found(&bench), ["grbl.check_left"], "no alarm of a reset in motion");
    bench.until(2_000, |_| false);
    assert_eq!((bench.engine().phase, bench.engine().trust), (EnginePhase::Ready, Trust::Trusted));
}

#[test]
fn reset_or_unplugging_during_a_check_loses_the_position() {
    for (unplugged, code) in [(false, "grbl.check_reset"), (true, "grbl.check_unplugged")] {
        let mut bench = Bench::new(1, Faults::default());
        assert!(bench.ready());
        bench.check(long());
        bench.until(500, |_| false);
        assert_eq!(bench.engine().phase, EnginePhase::Checking);
        let cuts = bench.board.cuts.len();
        if unplugged {
            bench.unplug();
        } else {
            bench.board.power_up();
        }
        assert!(bench.until(10_000, |bench| bench.over().is_some()));
        assert_eq!((bench.why().as_deref(), bench.engine().trust), (Some(code), Trust::Lost));
        bench.until(5_000, |_| false);
        assert_eq!(bench.board.cuts.len(), cuts, "nothing is run");
    }
}

#[test]
fn lost_check_mode_is_held_and_reset() {
    let mut bench = Bench::new(1, Faults::default());
    assert!(bench.ready());
    bench.reads_long();
    bench.board.leaves_check_mode();
    assert!(bench.until(20_000, |bench| bench.over().is_some()), "{:?}", bench.words());
    assert_eq!(bench.why().as_deref(), Some("grbl.check_left"));
    let stands = bench.stands();
    bench.until(5_000, |_| false);
    assert_eq!(bench.stands(), stands, "at rest");
    assert_eq!(bench.engine().phase, EnginePhase::Ready);
}

#[test]
fn check_without_homing_is_refused_with_soft_limits() {
    let mut bench = Bench::new(1, Faults::default());
    bench.board.settings.push((20, 1.0));
    bench.plug();
    assert!(bench.until(5_000, |bench| bench.engine().phase == EnginePhase::Locked));
    bench.check(routine());
    assert_eq!(found(&bench), ["grbl.not_now"], "it is locked");
    bench.event(EngineEvent::Ask(EngineAsk::Unlock));
    assert!(bench.until(5_000, |bench| {
        bench.engine().phase == EnginePhase::Ready && bench.engine().place().is_some()
    }));
    bench.check(routine());
    assert_eq!(
        (found(&bench), bench.engine().phase),
        (vec!["grbl.check_not_homed".to_owned()], EnginePhase::Ready)
    );
}
