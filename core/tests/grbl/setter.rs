//! Tests of tools measured on a tool setter. With any lengths, stops, pulled cables, lost or damaged bytes,
//! no tool may cut with a zero that belongs to another. Only the judge knows the length of each tool; the
//! engine does not.

use super::survey::found;
use super::{Bench, Faults, ZERO, job, text};
use annulus_core::control::{Ending, Trust};
use annulus_core::grbl::{
    BoardHeight, EngineAction, EngineAsk, EngineEvent, EnginePhase, EngineStart, SetterStep, ToolSetter, read,
};
use std::sync::Arc;

const PIN: [f64; 3] = [-250.0, -20.0, -25.0];
pub(super) const STEP_MM: f64 = 0.01;
pub(super) const NOTHING: Vec<String> = Vec::new();

/// The pin, and the board everywhere else: a touch outside the pin looks like a tool of another length.
pub(super) fn surface(x: f64, y: f64) -> f64 {
    if is_at_pin(x, y) { PIN[2] } else { ZERO[2] }
}

fn is_at_pin(x: f64, y: f64) -> bool {
    (x - PIN[0]).abs().max((y - PIN[1]).abs()) < 3.0
}

pub(super) fn setter() -> ToolSetter {
    ToolSetter {
        place_mm: [PIN[0], PIN[1]],
        from_mm: -10.0,
        depth_mm: 40.0,
        fast_mm_per_min: 300.0,
        slow_mm_per_min: 30.0,
    }
}

pub(super) fn start(from: usize) -> EngineStart {
    EngineStart { setter: Some(setter()), ..job(from) }
}

pub(super) fn ready() -> Bench {
    let mut bench = Bench::new(1, Faults::default());
    bench.board.surface = Some(surface);
    assert!(bench.ready());
    bench
}

impl Bench {
    fn steps(&mut self) -> Vec<SetterStep> {
        let mut steps = Vec::new();
        for _ in 0..200_000 {
            let Some(step) = self.engine().measuring() else { return steps };
            if steps.last() != Some(&step) {
                steps.push(step);
            }
            self.tick();
        }
        panic!("for ever: {steps:?}");
    }

    /// Enters the change to the first tool, with the reference tool measured.
    fn reference_is_measured(&mut self) {
        self.start_as(start(0));
        self.phases(EnginePhase::Measuring);
        assert_eq!(self.steps().last(), Some(&SetterStep::Lift));
        self.phases(EnginePhase::ToolChange);
        assert_eq!((self.done, found(self)), (0, vec!["setter.reference".to_owned()]), "{:?}", self.words());
    }

    /// Enters the change to the second tool, with the first one measured.
    fn first_is_measured(&mut self) {
        self.reference_is_measured();
        assert_eq!(self.tool_ready(), NOTHING);
        self.steps();
        self.phases(EnginePhase::ToolChange);
        assert_eq!((self.done, found(self)), (6, NOTHING), "{:?}", self.words());
    }

    /// Waits for the end of a job that needs no further tool.
    pub(super) fn is_over(&mut self) -> Option<Ending> {
        assert!(self.until(600_000, |bench| bench.ended().is_some()), "{:?}", self.words());
        self.ended()
    }

    pub(super) fn off_mm(&self) -> f64 {
        let deepest = |hole: i32| {
            let at = [f64::from(hole % 3 * 4), f64::from(hole / 3 * 4)];
            let there = self.cuts().filter(|cut| (0..2).all(|axis| (cut[axis] - at[axis]).abs() < 0.02));
            there.map(|cut| cut[2]).fold(0.0, f64::min)
        };
        (0..9).map(|hole| (deepest(hole) + 1.7).abs()).fold(0.0, f64::max)
    }

    /// Sets the height as a user does who lowers the tool to the board.
    pub(super) fn touched_off(&mut self) {
        let height_mm = self.board.place()[2] - ZERO[2];
        self.asked(EngineAsk::SetZero { axes: [false, false, true], height_mm });
        self.until(2_000, |bench| bench.told.contains(&EngineAction::ZeroSet));
        self.until(1_000, |bench| bench.engine().place().is_some());
    }
}

#[test]
fn every_tool_cuts_at_the_height_of_the_first() {
    use SetterStep::{Again, Back, Lift, Near, Over, Ready, Same, Touch, Up, Zero};
    for (first_mm, longer_mm) in
        [(0.0, -4.0), (0.0, -0.37), (5.1, 0.0), (-2.2, 0.013), (0.0, 2.5), (3.0, 6.0)]
    {
        let mut bench = ready();
        bench.start_as(start(0));
        bench.phases(EnginePhase::Measuring);
        // Zero was set with a probe pin, and no tool may be requested before that is measured.
        assert!(!bench.told.iter().any(|told| matches!(told, EngineAction::ToolWanted { .. })));
        assert_eq!(bench.steps(), [Ready, Up, Over, Near, Touch, Back, Again, Same, Lift]);
        bench.phases(EnginePhase::ToolChange);
        bench.board.tool_mm = first_mm;
        assert_eq!(bench.tool_ready(), NOTHING);
        assert_eq!(bench.steps(), [Ready, Up, Over, Near, Touch, Back, Again, Same, Lift, Zero]);
        bench.phases(EnginePhase::ToolChange);
        let cuts = bench.board.cuts.len();
        bench.board.tool_mm = longer_mm;
        assert_eq!(bench.tool_ready(), NOTHING);
        assert_eq!(bench.steps(), [Ready, Up, Over, Near, Touch, Back, Again, Same, Lift, Zero]);
        assert_eq!(
            (bench.engine().phase, bench.engine().height()),
            (EnginePhase::Running, BoardHeight::OfThisBit)
        );
        let zero = bench.engine().zero_mm.unwrap();
        assert!((zero[2] - ZERO[2] - longer_mm).abs() <= STEP_MM, "{longer_mm}: {zero:?}");
        // No tool may go deeper than to the pin.
        let below = |place: &&[f64; 3]| is_at_pin(place[0], place[1]) && place[2] < PIN[2] - 0.02;
        assert_eq!(bench.board.cuts[cuts..].iter().filter(below).count(), 0, "{longer_mm}");
        assert_eq!(bench.is_over(), Some(Ending::Done), "{:?}", bench.words());
        assert!(bench.off_mm() <= STEP_MM, "{longer_mm}: {}", bench.off_mm());
        assert_eq!((bench.missing(), bench.wrong()), (vec![], vec![]), "{longer_mm}");
    }
}

#[test]
fn invalid_tool_setter_refuses_the_start() {
    let bench = ready();
    let codes = |setter: ToolSetter| -> Vec<String> {
        let found = bench.engine().check(&EngineStart { setter: Some(setter), ..job(0) });
        let said = |code: &String| code.starts_with("setter.") && code != "setter.reference";
        found.into_iter().map(|why| why.code).filter(said).collect()
    };
    let good = setter();
    assert_eq!(codes(good), NOTHING);
    for (setter, code) in [
        (ToolSetter { place_mm: [5.0, -20.0], ..good }, "setter.no_room"),
        (ToolSetter { place_mm: [-250.0, -301.0], ..good }, "setter.no_room"),
        (ToolSetter { from_mm: -0.5, ..good }, "setter.no_room"),
        (ToolSetter { from_mm: -290.0, ..good }, "setter.no_room"),
        (ToolSetter { depth_mm: f64::NAN, ..good }, "setter.bad"),
        (ToolSetter { slow_mm_per_min: 0.0, ..good }, "setter.bad"),
    ] {
        assert_eq!(codes(setter), [code], "{setter:?}");
    }
    // Irrelevant if no tool is measured.
    let far = ToolSetter { place_mm: [5.0, -20.0], ..good };
    let alike = EngineStart { setter: Some(far), same_length: true, ..job(0) };
    assert!(bench.engine().check(&alike).is_empty());
    let mut bench = Bench::without_switches();
    bench.asked(EngineAsk::SetZero { axes: [true; 3], height_mm: 0.0 });
    assert!(bench.until(2_000, |bench| bench.told.contains(&EngineAction::ZeroSet)));
    bench.until(1_000, |bench| bench.engine().place().is_some());
    bench.start_as(start(0));
    assert!(found(&bench).contains(&"setter.no_homing".to_owned()), "{:?}", found(&bench));
    assert_eq!(bench.engine().phase, EnginePhase::Ready);
}

#[test]
fn tool_setter_contact_too_early_or_missing_sets_nothing() {
    fn hangs(x: f64, y: f64) -> f64 {
        if is_at_pin(x, y) { -5.0 } else { ZERO[2] }
    }
    fn chip(x: f64, y: f64) -> f64 {
        if is_at_pin(x, y) { -10.2 } else { ZERO[2] }
    }
    for pin in [hangs, chip] {
        let mut bench = ready();
        bench.reference_is_measured();
        bench.board.surface = Some(pin);
        assert_eq!(bench.tool_ready(), NOTHING);
        bench.steps();
        bench.phases(EnginePhase::ToolChange);
        assert_eq!((found(&bench), bench.ended()), (vec!["setter.early".to_owned()], None));
        assert!(bench.board.place()[2] > -1.001, "the tip is up: {:?}", bench.board.place());
        // The chip has been removed.
        bench.board.surface = Some(surface);
        assert_eq!(bench.tool_ready(), NOTHING);
        bench.steps();
        assert_eq!(bench.engine().phase, EnginePhase::Running, "{:?}", bench.words());
    }
    fn always(_: f64, _: f64) -> f64 {
        1e9
    }
    type Row = (&'static str, Option<fn(f64, f64) -> f64>);
    let rows: [Row; 2] = [("setter.early", Some(always)), ("grbl.alarm_5", None)];
    for (code, pin) in rows {
        let mut bench = ready();
        // Controllers that report their pins are tested below.
        bench.board.hides_pins = true;
        bench.reference_is_measured();
        bench.board.surface = pin;
        assert_eq!(bench.tool_ready(), NOTHING);
        assert_eq!(bench.is_over(), Some(Ending::Alarm));
        assert_eq!((found(&bench), bench.engine().trust), (vec![code.to_owned()], Trust::Trusted));
        assert_eq!(bench.done, 0);
    }
}

#[test]
fn closed_tool_setter_measures_nothing_and_the_job_continues() {
    // At the start, over the setter, and after the first touch (a sticking pin).
    for step in [SetterStep::Ready, SetterStep::Over, SetterStep::Back] {
        let mut bench = ready();
        bench.reference_is_measured();
        let place = bench.board.place();
        assert_eq!(bench.tool_ready(), NOTHING);
        assert!(bench.until(100_000, |bench| bench.engine().measuring() == Some(step)), "{step:?}");
        bench.board.shorted = true;
        bench.steps();
        bench.phases(EnginePhase::ToolChange);
        assert_eq!((found(&bench), bench.ended()), (vec!["setter.closed".to_owned()], None), "{step:?}");
        let now = bench.board.place();
        assert!(now[2] > -1.001, "{step:?}: the tip is up: {now:?}");
        assert!(step != SetterStep::Ready || now[..2] == place[..2], "it did not go aside: {now:?}");
        bench.board.shorted = false;
        bench.until(500, |_| false);
        assert_eq!(bench.tool_ready(), NOTHING, "{step:?}");
        bench.steps();
        assert_eq!(bench.engine().phase, EnginePhase::Running, "{step:?}: {:?}", bench.words());
    }
}

#[test]
fn reference_tool_is_measured_at_the_start_or_the_job_ends() {
    fn chip(x: f64, y: f64) -> f64 {
        if is_at_pin(x, y) { -10.2 } else { ZERO[2] }
    }
    type Row = (fn(f64, f64) -> f64, bool, &'static str);
    let rows: [Row; 2] = [(chip, false, "setter.early"), (surface, true, "setter.closed")];
    for (pin, shorted, code) in rows {
        let mut bench = ready();
        (bench.board.surface, bench.board.shorted) = (Some(pin), shorted);
        bench.start_as(start(0));
        assert_eq!(bench.is_over(), Some(Ending::Alarm), "{code}");
        assert_eq!(found(&bench), ["setter.reference", code]);
        assert!(bench.board.place()[2] > -1.001, "{code}: the tip is up: {:?}", bench.board.place());
        assert!(!bench.told.iter().any(|told| matches!(told, EngineAction::ToolWanted { .. })), "{code}");
        assert_eq!((bench.done, bench.engine().trust), (0, Trust::Trusted), "{code}");
        bench.phases(EnginePhase::Ready);
    }
    // A program that begins without a change has its tool fitted. The tool is measured before the job
    // continues, or not even that if no other tool follows.
    let begins = text().replacen("(MSG, tool 1)\nM0\n", "", 1);
    let alone = begins.replacen("(MSG, tool 2)\nM0\n", "", 1);
    for (text, measured, changes) in [(begins, true, 1), (alone, false, 0)] {
        let mut bench = ready();
        let routine = Arc::new(read("board", &[("board.nc".to_owned(), text)]).unwrap());
        bench.start_as(EngineStart { routine, ..start(0) });
        let mut steps = Vec::new();
        let is_over = |bench: &Bench| bench.ended().is_some() || bench.engine().measuring().is_some();
        for _ in 0..3 {
            assert!(
                bench.until(600_000, |bench| is_over(bench)
                    || bench.engine().phase == EnginePhase::ToolChange)
            );
            steps.push(bench.steps().len());
            if bench.engine().phase == EnginePhase::ToolChange {
                bench.event(EngineEvent::Ask(EngineAsk::ToolReady));
            }
            bench.tick();
        }
        assert_eq!(steps[0] > 0, measured, "{changes}");
        assert!(bench.until(600_000, |bench| bench.ended().is_some()));
        let wanted = bench.told.iter().filter(|told| matches!(told, EngineAction::ToolWanted { .. })).count();
        assert_eq!((bench.ended(), wanted), (Some(Ending::Done), changes), "{:?}", bench.words());
        assert!(bench.off_mm() <= STEP_MM, "{}", bench.off_mm());
    }
}

#[test]
fn damaged_setter_lines_measure_nothing() {
    type Row = (&'static [u8], &'static [u8], &'static str);
    let rows: [Row; 7] = [
        (b"G21G17G90G94\n", b"G20G17G90G94\n", "grbl.modes_differ"),
        (b"G90G53G0Z-1\n", b"G90G53G0Z-4\n", "setter.elsewhere"),
        (b"G90G53G0X-250Y-20\n", b"G90G53G0X-150Y-20\n", "setter.elsewhere"),
        (b"G91G38.3Z-9F300\n", b"G91G38.3Z-12F300\n", "setter.elsewhere"),
        (b"G91G38.3Z-9F300\n", b"G91G38.3X-10F300\n", "setter.elsewhere"),
        (b"G91G38.2Z-40F300\n", b"G91G38.2Z-40F\n", "grbl.error_2"),
        (b"$#\n", b"$G\n", "level.no_answer"),
    ];
    for (line, instead, code) in rows {
        let mut bench = ready();
        bench.first_is_measured();
        bench.board.tool_mm = 3.3;
        bench.instead = Some((line, instead));
        assert_eq!(bench.tool_ready(), NOTHING);
        bench.steps();
        bench.phases(EnginePhase::ToolChange);
        assert_eq!((found(&bench), bench.ended()), (vec![code.to_owned()], None), "{:?}", bench.words());
        bench.instead = None;
        assert_eq!(bench.tool_ready(), NOTHING, "{code}");
        assert_eq!(bench.is_over(), Some(Ending::Done), "{code}: {:?}", bench.words());
        assert!(bench.off_mm() <= STEP_MM, "{code}: {}", bench.off_mm());
    }
    // The first result only determines where to touch again; the second one is the height.
    for (heard, instead) in [("-25.000:1]", "-26.000:1]"), ("[PRB:-250.000", "[PRB:-210.000")] {
        let mut bench = ready();
        bench.first_is_measured();
        bench.heard_instead = Some((heard, instead));
        assert_eq!(bench.tool_ready(), NOTHING);
        bench.steps();
        if bench.heard_instead.take().is_none() {
            bench.phases(EnginePhase::ToolChange);
            assert_eq!(bench.tool_ready(), NOTHING);
        }
        assert_eq!(bench.is_over(), Some(Ending::Done), "{:?}", bench.words());
        assert!(bench.off_mm() <= STEP_MM, "{heard}: {}", bench.off_mm());
    }
}

#[test]
fn stop_in_any_measuring_step_allows_a_correct_resume() {
    use SetterStep::{Again, Back, Lift, Near, Over, Ready, Same, Touch, Up, Zero};
    for step in [Ready, Up, Over, Near, Touch, Back, Again, Same, Lift, Zero] {
        for after_ms in [0, 40, 900] {
            let mut bench = ready();
            bench.first_is_measured();
            bench.board.tool_mm = 1.7;
            assert_eq!(bench.tool_ready(), NOTHING);
            assert!(bench.until(200_000, |bench| bench.engine().measuring() == Some(step)), "{step:?}");
            bench.until(after_ms, |bench| bench.engine().measuring() != Some(step));
            bench.asked(EngineAsk::Stop);
            assert_eq!(bench.is_over(), Some(Ending::Stopped), "{step:?}: {:?}", bench.words());
            let place = bench.board.place();
            bench.phases(EnginePhase::Ready);
            bench.until(3_000, |_| false);
            assert_eq!((bench.board.place(), bench.engine().trust), (place, Trust::Trusted), "{step:?}");
            // Another tool is fitted, and the setter still has the reference.
            bench.start_as(start(bench.done));
            bench.phases(EnginePhase::ToolChange);
            bench.board.tool_mm = 4.2;
            assert_eq!(bench.tool_ready(), NOTHING);
            assert_eq!(bench.is_over(), Some(Ending::Done), "{step:?}: {:?}", bench.words());
            assert!(bench.off_mm() <= STEP_MM, "{step:?}: {}", bench.off_mm());
        }
    }
}

#[test]
fn tool_is_not_measured_without_a_reference() {
    // For another board, the job is restarted with the last tool of the previous one.
    let mut bench = ready();
    bench.first_is_measured();
    bench.tool_ready();
    assert_eq!(bench.is_over(), Some(Ending::Done));
    bench.board.tool_mm = 2.0;
    bench.start_as(start(0));
    bench.phases(EnginePhase::ToolChange);
    assert_eq!(bench.tool_ready(), ["setter.no_reference"]);
    assert_eq!(bench.engine().phase, EnginePhase::ToolChange);
    // After touching off, this tool is the reference.
    bench.touched_off();
    assert_eq!(bench.tool_ready(), NOTHING);
    assert!(!bench.steps().is_empty());
    bench.phases(EnginePhase::ToolChange);
    // The user sets zero during the change: this tool becomes the new reference.
    bench.board.tool_mm = 0.6;
    bench.touched_off();
    assert_eq!(bench.tool_ready(), NOTHING);
    assert!(!bench.steps().is_empty());
    assert_eq!(bench.is_over(), Some(Ending::Done));
    assert!(bench.off_mm() <= STEP_MM, "{}", bench.off_mm());
}

#[test]
fn job_resumed_after_unplugging_measures_the_zero_tool() {
    let mut bench = ready();
    bench.start_as(start(0));
    bench.phases(EnginePhase::ToolChange);
    assert_eq!(bench.tool_ready(), NOTHING);
    assert!(bench.until(100_000, |bench| bench.done == 3));
    assert!(bench.ready());
    // The height is known for this tool, and other tools follow.
    bench.start_as(start(3));
    bench.phases(EnginePhase::ToolChange);
    assert_eq!(bench.tool_ready(), NOTHING);
    assert!(!bench.steps().is_empty());
    bench.phases(EnginePhase::ToolChange);
    bench.board.tool_mm = 2.9;
    assert_eq!(bench.tool_ready(), NOTHING);
    assert_eq!(bench.is_over(), Some(Ending::Done), "{:?}", bench.words());
    assert!(bench.off_mm() <= STEP_MM && bench.missing().is_empty());
}

impl Bench {
    /// The user at the machine: keeps the tool if the height belongs to it, fits another one if not, and
    /// confirms. If this is refused for lack of a reference, the user touches off.
    fn attends(&mut self) {
        if self.engine().height() != BoardHeight::OfThisBit {
            self.board.tool_mm = self.chance.unit() * 6.0;
        }
        self.event(EngineEvent::Ask(EngineAsk::ToolReady));
        self.until(300, |bench| bench.engine().phase != EnginePhase::ToolChange);
        if found(self).last().is_some_and(|code| code == "setter.no_reference")
            && self.engine().phase == EnginePhase::ToolChange
        {
            self.touched_off();
        }
    }

    /// A tool inside the board must have its own zero of Z.
    fn judge(&self, seed: u64) {
        let in_board = self.board.place()[2] < ZERO[2] - 0.001;
        if in_board && self.engine().phase == EnginePhase::Running {
            let off_mm = self.board.zeros[0][2] - ZERO[2] - self.board.tool_mm;
            assert!(off_mm.abs() <= STEP_MM, "seed {seed}: {off_mm} mm off, {:?}", self.words());
        }
    }

    fn goes_on(&mut self, seed: u64, until_ms: u64) {
        let is_over = |bench: &Self| {
            bench.ended().is_some()
                || matches!(bench.engine().phase, EnginePhase::Closed | EnginePhase::Ready)
        };
        while self.now_ms < until_ms && !is_over(self) {
            if self.engine().phase == EnginePhase::ToolChange && self.engine().place().is_some() {
                self.attends();
            }
            self.tick();
            self.judge(seed);
        }
    }
}

#[test]
fn no_tool_cuts_with_the_zero_of_another() {
    let (mut measured, mut stops) = (0, 0);
    for seed in 0..45 {
        let faults = match seed % 3 {
            0 => Faults::default(),
            1 => Faults { lost: 4e-4, damaged: 4e-4, back: 0.0 },
            _ => Faults { lost: 2e-4, damaged: 2e-4, back: 2e-4 },
        };
        let mut bench = Bench::new(seed, faults);
        bench.board.surface = Some(surface);
        let (mut disturbances, mut rounds, mut again) = (3, 0, false);
        loop {
            rounds += 1;
            assert!(rounds < 80, "seed {seed} never ends: {:?}", bench.words());
            if !again {
                // Zero is set with the first tool.
                bench.board.tool_mm = 0.0;
                if !bench.ready() {
                    continue;
                }
            }
            bench.start_as(start(bench.done));
            let moment = bench.now_ms + 200 + bench.chance.below(60_000) as u64;
            bench.goes_on(seed, if disturbances > 0 { moment } else { bench.now_ms + 2_000_000 });
            measured += bench.told.iter().filter(|told| matches!(told, EngineAction::ZeroSet)).count();
            again = false;
            if bench.ended().is_none() && disturbances > 0 && bench.engine().phase != EnginePhase::Closed {
                disturbances -= 1;
                match bench.chance.below(3) {
                    0 => bench.board.power_up(),
                    1 => bench.unplug(),
                    _ => bench.event(EngineEvent::Ask(EngineAsk::Stop)),
                }
                bench.until(15_000, |bench| bench.ended().is_some());
                bench.until(2_000, |_| false);
                let engine = bench.engine();
                again = engine.phase == EnginePhase::Ready && engine.trust == Trust::Trusted;
            }
            if bench.ended() == Some(Ending::Done) {
                break;
            }
            stops += 1;
        }
        assert_eq!(bench.missing(), Vec::<[f64; 3]>::new(), "seed {seed}: left out");
        if seed % 3 == 0 {
            assert_eq!(bench.wrong(), Vec::<[f64; 3]>::new(), "seed {seed}");
        }
    }
    println!("{measured} zeros by setter or hand, {stops} stops, none in the board with another tool's");
    assert!(measured > 45 && stops > 45, "{measured} {stops}");
}
