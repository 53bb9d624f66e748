//! Tests of the GRBL engine with a simulated controller: streams, sync points, stops, resets, pulled cables,
//! lost and damaged characters. The seed of a failing property is printed.

mod alarms;
mod automaton;
mod changer;
mod check;
mod comparison;
mod contact;
mod depth;
mod height;
mod home;
mod jog;
#[allow(dead_code, unreachable_pub)]
mod old_engine;
mod opening;
mod overrides;
mod park;
mod place;
mod polling;
mod room;
mod setter;
mod settings;
mod stands;
mod survey;

use annulus_core::chance::Chance;
use annulus_core::control::{Ending, Trust};
use annulus_core::grbl::{
    Controller, EngineAction, EngineAsk, EngineEvent, EnginePhase, EngineStart, Routine, SectionKind, read,
    step,
};
use automaton::Automaton;
use std::sync::Arc;

const ZERO: [f64; 3] = [-150.0, -150.0, -30.0];
/// A hole counts as made if the tool came this near to its bottom, in mm.
const NEAR: f64 = 0.02;

/// Holes in a grid and a toolpath, with a tool change between.
fn text() -> String {
    let mut text = "G21 G17 G90 G94\nM5\nG0 Z8\nG0 X0 Y0\n(MSG, tool 1)\nM0\nM3 S9000\n".to_owned();
    for hole in 0..9 {
        let (x, y) = (hole % 3 * 4, hole / 3 * 4);
        text += &format!("G0 X{x} Y{y}\nG0 Z0.5\nG1 Z-1.7 F600\nG0 Z2\n");
        if hole == 4 {
            text += "M5\nG0 Z8\nG0 X0 Y0\n(MSG, tool 2)\nM0\nM3 S9000\n";
        }
    }
    text + "G0 X0 Y14\nG1 Z-0.1 F300\nG1 X10 F1200\nG1 X14 Y18\nG0 Z2\nM5\nG0 Z8\nG0 X0 Y0\nM2\n"
}

fn bottoms() -> Vec<[f64; 3]> {
    let mut all: Vec<[f64; 3]> =
        (0..9).map(|hole| [f64::from(hole % 3 * 4), f64::from(hole / 3 * 4), -1.7]).collect();
    all.extend([[0.0, 14.0, -0.1], [10.0, 14.0, -0.1], [14.0, 18.0, -0.1]]);
    all
}

fn routine() -> Arc<Routine> {
    Arc::new(read("board", &[("board.nc".to_owned(), text())]).unwrap())
}

fn job(from: usize) -> EngineStart {
    let (routine, accepted) = (routine(), Vec::new());
    EngineStart {
        routine,
        from,
        zero_mm: None,
        same_length: false,
        setter: None,
        changer: None,
        spin_up_s: 0.1,
        accepted,
    }
}

#[derive(Clone, Copy, Default)]
struct Faults {
    /// Probability that a byte to the controller is lost, or has one bit changed.
    lost: f64,
    damaged: f64,
    back: f64,
}

struct Bench {
    board: Automaton,
    engine: Option<Controller>,
    now_ms: u64,
    chance: Chance,
    faults: Faults,
    open: bool,
    told: Vec<EngineAction>,
    done: usize,
    questions: Vec<u64>,
    damaged: u32,
    instead: Option<(&'static [u8], &'static [u8])>,
    /// Text that is received once in place of a text of the controller.
    heard_instead: Option<(&'static str, &'static str)>,
    /// Until then the controller and its end of the cable freeze, as with a stalled USB hub.
    asleep_until_ms: u64,
    on_the_way_until_ms: u64,
    /// Bytes written meanwhile, and bytes that the controller sent meanwhile.
    kept_back: Vec<u8>,
    said_meanwhile: Vec<u8>,
}

impl Bench {
    fn new(seed: u64, faults: Faults) -> Self {
        let board = Automaton::new([-20.0, -30.0, -10.0]);
        let (engine, chance) = (Some(Controller::default()), Chance::new(seed));
        Self {
            board,
            engine,
            now_ms: 0,
            chance,
            faults,
            open: false,
            told: Vec::new(),
            done: 0,
            questions: Vec::new(),
            damaged: 0,
            instead: None,
            heard_instead: None,
            asleep_until_ms: 0,
            on_the_way_until_ms: 0,
            kept_back: Vec::new(),
            said_meanwhile: Vec::new(),
        }
    }

    fn engine(&self) -> &Controller {
        self.engine.as_ref().unwrap()
    }

    fn event(&mut self, event: EngineEvent) {
        let (engine, actions) = step(self.engine.take().unwrap(), self.now_ms, event);
        self.engine = Some(engine);
        for action in actions {
            match &action {
                EngineAction::Write(bytes) => {
                    self.questions.extend(bytes.iter().filter(|byte| **byte == b'?').map(|_| self.now_ms));
                    let instead = self.instead.filter(|(line, _)| line == bytes).map(|(_, instead)| instead);
                    let bytes = instead.unwrap_or(bytes);
                    let bytes = self.spoiled(bytes, self.faults.lost, self.faults.damaged);
                    if self.open && (self.is_asleep() || self.now_ms < self.on_the_way_until_ms) {
                        self.kept_back.extend(bytes);
                    } else if self.open {
                        self.board.hear(&bytes);
                    }
                }
                EngineAction::Progress { sections: done } => {
                    assert!(*done >= self.done, "what is done stays done");
                    self.done = *done;
                }
                EngineAction::Close => self.open = false,
                _ => {}
            }
            self.told.push(action);
        }
    }

    fn spoiled(&mut self, bytes: &[u8], lost: f64, damaged: f64) -> Vec<u8> {
        let mut out = Vec::new();
        for &byte in bytes {
            if self.chance.unit() < lost {
                self.damaged += 1;
                continue;
            }
            let flips = self.chance.unit() < damaged;
            self.damaged += u32::from(flips);
            out.push(if flips { byte ^ (1 << self.chance.below(8)) } else { byte });
        }
        out
    }

    fn misheard(&mut self, said: Vec<u8>) -> Vec<u8> {
        let text = String::from_utf8_lossy(&said);
        match self.heard_instead.take_if(|(what, _)| text.contains(*what)) {
            Some((what, instead)) => text.replace(what, instead).into_bytes(),
            None => said,
        }
    }

    fn is_asleep(&self) -> bool {
        self.now_ms < self.asleep_until_ms
    }

    fn tick(&mut self) {
        self.now_ms += 1;
        let said = if self.is_asleep() {
            Vec::new()
        } else if self.now_ms < self.on_the_way_until_ms {
            self.board.tick();
            let said = self.board.said();
            self.said_meanwhile.extend(said);
            Vec::new()
        } else if !self.said_meanwhile.is_empty() {
            std::mem::take(&mut self.said_meanwhile)
        } else {
            self.board.hear(&std::mem::take(&mut self.kept_back));
            self.board.tick();
            self.board.said()
        };
        if !self.open {
            return;
        }
        if !said.is_empty() {
            let said = self.misheard(said);
            let (lost, damaged) = (self.faults.back / 2.0, self.faults.back / 2.0);
            let said = self.spoiled(&said, lost, damaged);
            self.event(EngineEvent::Bytes(said));
        } else if self.now_ms.is_multiple_of(10) {
            self.event(EngineEvent::Tick);
        }
    }

    fn plug(&mut self) {
        self.open = true;
        self.board.power_up();
        self.event(EngineEvent::Opened);
    }

    fn unplug(&mut self) {
        self.open = false;
        self.event(EngineEvent::Closed);
    }

    /// Advances time until the condition holds. Returns `false` if it does not within the limit.
    fn until(&mut self, limit_ms: u64, so: impl Fn(&Self) -> bool) -> bool {
        let end = self.now_ms + limit_ms;
        while !so(self) {
            if self.now_ms >= end {
                return false;
            }
            self.tick();
        }
        true
    }

    fn without_switches() -> Self {
        let mut bench = Self::new(1, Faults::default());
        bench.board.settings.retain(|(number, _)| *number != 22);
        bench.plug();
        bench.phases(EnginePhase::Locked);
        bench.asked(EngineAsk::Unlock);
        bench.phases(EnginePhase::Ready);
        bench
    }

    /// Connects, homes and sets zero. Returns `false` if faults of the line prevented it.
    fn ready(&mut self) -> bool {
        self.open = false;
        self.event(EngineEvent::Closed);
        self.plug();
        let greeted = self.until(20_000, |bench| {
            matches!(bench.engine().phase, EnginePhase::Ready | EnginePhase::Locked | EnginePhase::Closed)
                && bench.engine().place().is_some()
        });
        self.event(EngineEvent::Ask(EngineAsk::Home));
        greeted
            && self.until(5_000, |bench| {
                bench.engine().trust == Trust::Trusted && bench.engine().phase == EnginePhase::Ready
            })
            && {
                self.until(1_000, |bench| bench.engine().place().is_some());
                self.told.clear();
                self.event(EngineEvent::Ask(EngineAsk::ZeroAt { place_mm: ZERO.map(Some) }));
                self.until(5_000, |bench| {
                    bench.told.contains(&EngineAction::ZeroSet) && bench.engine().place().is_some()
                })
            }
    }

    /// Starts a job whose tools all have the same length.
    fn start(&mut self, from: usize) {
        self.start_as(EngineStart { same_length: true, ..job(from) });
    }

    fn start_as(&mut self, start: EngineStart) {
        self.told.clear();
        self.done = start.from;
        self.event(EngineEvent::Ask(EngineAsk::Start(start)));
    }

    fn ended(&self) -> Option<Ending> {
        self.told
            .iter()
            .find_map(|action| if let EngineAction::Ended(ending) = action { Some(*ending) } else { None })
    }

    /// Runs the job to its end, with a user who changes tools. Returns `false` if it never ends.
    fn run(&mut self) -> bool {
        for _ in 0..200_000 {
            if self.ended().is_some() || self.engine().phase == EnginePhase::Closed {
                return true;
            }
            if self.engine().phase == EnginePhase::Ready {
                return true;
            }
            if self.engine().phase == EnginePhase::ToolChange {
                self.event(EngineEvent::Ask(EngineAsk::ToolReady));
            }
            self.tick();
        }
        false
    }

    fn words(&self) -> (EnginePhase, Trust, Vec<&EngineAction>) {
        let told = self
            .told
            .iter()
            .rev()
            .filter(|action| !matches!(action, EngineAction::Write(bytes) if bytes == b"?"));
        (self.engine().phase, self.engine().trust, told.take(12).collect())
    }

    /// Positions inside the board, in true work coordinates.
    fn cuts(&self) -> impl Iterator<Item = [f64; 3]> {
        self.board
            .cuts
            .iter()
            .map(|place| [0, 1, 2].map(|axis| place[axis] - ZERO[axis]))
            .filter(|place| place[2] < -0.01)
    }

    fn missing(&self) -> Vec<[f64; 3]> {
        let near = |a: &[f64; 3], b: &[f64; 3]| (0..3).all(|axis| (a[axis] - b[axis]).abs() <= NEAR);
        bottoms().into_iter().filter(|bottom| !self.cuts().any(|cut| near(&cut, bottom))).collect()
    }

    /// Positions inside the board at which the job has no cut.
    fn wrong(&self) -> Vec<[f64; 3]> {
        let hole = |place: &[f64; 3]| {
            place[2] >= -1.7 - NEAR
                && (0..9).any(|hole| {
                    (place[0] - f64::from(hole % 3 * 4)).abs() <= NEAR
                        && (place[1] - f64::from(hole / 3 * 4)).abs() <= NEAR
                })
        };
        let path = |place: &[f64; 3]| {
            let flat = (place[1] - 14.0).abs() <= NEAR && (-NEAR..=10.0 + NEAR).contains(&place[0]);
            let slope = (place[1] - 14.0 - (place[0] - 10.0)).abs() <= NEAR
                && (10.0 - NEAR..=14.0 + NEAR).contains(&place[0]);
            place[2] >= -0.1 - NEAR && (flat || slope)
        };
        self.cuts().filter(|place| !hole(place) && !path(place)).collect()
    }
}

#[test]
fn job_runs_as_written() {
    let mut bench = Bench::new(1, Faults::default());
    assert!(bench.ready());
    bench.start(0);
    assert!(bench.run());
    assert_eq!(bench.ended(), Some(Ending::Done), "{:?}", bench.told);
    assert_eq!((bench.missing(), bench.wrong()), (vec![], vec![]));
    assert_eq!((bench.board.overrun, bench.done), (0, routine().sections.len()));
    let place = bench.board.place();
    assert!((0..2).all(|axis| (place[axis] - ZERO[axis]).abs() < 0.001), "{place:?}");
}

#[test]
fn three_second_stall_loses_no_line() {
    for after_ms in (0..6_000).step_by(61) {
        let mut bench = Bench::new(after_ms, Faults::default());
        assert!(bench.ready());
        bench.start(0);
        bench.until(after_ms, |bench| bench.ended().is_some());
        bench.asleep_until_ms = bench.now_ms + 3_000;
        bench.until(3_000, |_| false);
        assert!(bench.run());
        assert_eq!(bench.ended(), Some(Ending::Done), "asleep after {after_ms} ms: {:?}", bench.words());
        assert_eq!((bench.missing(), bench.wrong()), (vec![], vec![]), "asleep after {after_ms} ms");
    }
}

#[test]
fn answers_bunched_by_a_stalled_hub_count_as_one_report() {
    let mut bench = Bench::new(3, Faults::default());
    assert!(bench.ready());
    bench.start(0);
    let mills = |bench: &Bench| {
        bench.engine().place().is_some_and(|[x, y, z]| (3.0..7.0).contains(&x) && y > 13.0 && z < 0.0)
    };
    while !mills(&bench) {
        if bench.engine().phase == EnginePhase::ToolChange {
            bench.event(EngineEvent::Ask(EngineAsk::ToolReady));
        }
        bench.tick();
    }
    bench.asleep_until_ms = bench.now_ms + 10_000;
    let [x, y, z] = bench.board.place();
    let further = if x < 5.0 { x + 2.1 } else { x - 2.1 };
    let answered = |bench: &mut Bench, x: f64, times: usize| {
        let report = format!("<Run|MPos:{x:.3},{y:.3},{z:.3}|FS:2000,9000>\r\n").into_bytes();
        let asked = bench.questions.len();
        assert!(bench.until(2_000, |bench| bench.questions.len() > asked));
        (0..times).for_each(|_| bench.event(EngineEvent::Bytes(report.clone())));
        let too_fast =
            |action: &EngineAction| matches!(action, EngineAction::Found(why) if why.code == "grbl.too_fast");
        bench.told.iter().any(too_fast)
    };
    assert!(
        !answered(&mut bench, x, 3),
        "at the end of a rapid the speed is ahead of the place for a moment"
    );
    assert!(!answered(&mut bench, x, 1), "asked twice in that moment, on a board that is slow to answer");
    assert!(answered(&mut bench, further, 1), "a second moment is believed");
}

#[test]
fn status_is_queried_at_most_ten_times_a_second() {
    let mut bench = Bench::new(1, Faults::default());
    assert!(bench.ready());
    bench.questions.clear();
    bench.start(0);
    assert!(bench.run());
    let gaps: Vec<u64> = bench.questions.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(gaps.len() > 20 && gaps.iter().all(|gap| *gap >= 100), "{:?}", gaps.iter().min());
    assert!(gaps.iter().all(|gap| *gap <= 600), "{:?}", gaps.iter().max());
}

#[test]
fn job_starts_only_with_a_known_position() {
    let mut bench = Bench::new(1, Faults::default());
    bench.plug();
    assert!(bench.until(5_000, |bench| bench.engine().phase == EnginePhase::Locked));
    let code = |bench: &Bench| {
        bench.told.iter().find_map(|action| {
            if let EngineAction::Found(found) = action { Some(found.code.clone()) } else { None }
        })
    };
    bench.start(0);
    assert_eq!(code(&bench), Some("grbl.not_now".to_owned()));
    bench.event(EngineEvent::Ask(EngineAsk::Unlock));
    assert!(bench.until(5_000, |bench| bench.engine().phase == EnginePhase::Ready));
    bench.start(0);
    assert_eq!(code(&bench), Some("grbl.not_homed".to_owned()));
    assert_eq!((bench.engine().phase, bench.board.cuts.len()), (EnginePhase::Ready, 0));
}

#[test]
fn unheard_homing_is_not_trusted() {
    // A changed bit, a lost character, a lost line end: most of these are answered with `ok`.
    for instead in ["$X\n", "$I\n", "$\n", "\n", "H\n", "$L\n", "$H", ""] {
        let mut bench = Bench::new(1, Faults::default());
        bench.plug();
        assert!(bench.until(5_000, |bench| bench.engine().phase == EnginePhase::Locked), "{instead:?}");
        bench.instead = Some((b"$H\n", instead.as_bytes()));
        bench.told.clear();
        bench.event(EngineEvent::Ask(EngineAsk::Home));
        assert_eq!(bench.engine().phase, EnginePhase::Homing);
        assert!(
            bench.until(10_000, |bench| bench.engine().phase != EnginePhase::Homing),
            "{instead:?}: for ever"
        );
        let told = bench.told.iter().any(|action| matches!(action, EngineAction::Found(_)));
        assert_eq!((bench.engine().trust, told), (Trust::Lost, true), "{instead:?}");
        // When asked again, the request arrives.
        bench.instead = None;
        let rests = |bench: &Bench| {
            matches!(bench.engine().phase, EnginePhase::Ready | EnginePhase::Locked)
                && bench.engine().place().is_some()
        };
        assert!(bench.until(10_000, rests), "{instead:?}");
        bench.event(EngineEvent::Ask(EngineAsk::Home));
        assert!(bench.until(10_000, |bench| bench.engine().trust == Trust::Trusted), "{instead:?}");
    }
}

#[test]
fn tool_change_waits_without_a_timeout() {
    let mut bench = Bench::new(1, Faults::default());
    assert!(bench.ready());
    bench.start(0);
    assert!(bench.until(60_000, |bench| bench.engine().phase == EnginePhase::ToolChange));
    let place = bench.board.place();
    // Two hours.
    assert!(!bench.until(7_200_000, |bench| bench.engine().phase != EnginePhase::ToolChange));
    assert_eq!(bench.board.place(), place);
    assert!(bench.run());
    assert_eq!((bench.ended(), bench.missing(), bench.wrong()), (Some(Ending::Done), vec![], vec![]));
}

#[test]
fn replacement_tool_is_changed_between_two_holes() {
    let mut bench = Bench::new(1, Faults::default());
    assert!(bench.ready());
    bench.start(0);
    assert!(bench.until(60_000, |bench| bench.engine().phase == EnginePhase::ToolChange));
    bench.event(EngineEvent::Ask(EngineAsk::ToolReady));
    // The change and one hole are done: the hole in progress, and no further one with this tool.
    assert!(bench.until(60_000, |bench| bench.done == 2));
    bench.event(EngineEvent::Ask(EngineAsk::ToolBefore { section: 3 }));
    assert!(bench.until(60_000, |bench| bench.engine().phase == EnginePhase::ToolChange));
    let place = bench.engine().place().unwrap();
    let is_there = place.iter().zip([0.0, 0.0, 8.0]).all(|(at, wanted)| (at - wanted).abs() <= NEAR);
    assert!(bench.done == 3 && is_there, "{} {place:?}", bench.done);
    let cuts = bench.board.cuts.len();
    assert!(!bench.until(60_000, |bench| bench.engine().phase != EnginePhase::ToolChange));
    assert_eq!(bench.board.cuts.len(), cuts, "nothing is cut meanwhile");
    assert!(bench.run());
    assert_eq!((bench.ended(), bench.missing(), bench.wrong()), (Some(Ending::Done), vec![], vec![]));
    let wanted = |action: &EngineAction| match action {
        EngineAction::ToolWanted { tool } => Some(*tool),
        _ => None,
    };
    assert_eq!(bench.told.iter().filter_map(wanted).collect::<Vec<_>>(), [0, 0, 1]);
}

#[test]
fn stop_ends_motion_and_preserves_the_position() {
    for seed in 0..200 {
        let mut bench = Bench::new(seed, Faults::default());
        assert!(bench.ready());
        bench.start(0);
        let moment = bench.now_ms + 200 + bench.chance.below(20_000) as u64;
        while bench.now_ms < moment && bench.ended().is_none() {
            if bench.engine().phase == EnginePhase::ToolChange {
                bench.event(EngineEvent::Ask(EngineAsk::ToolReady));
            }
            bench.tick();
        }
        bench.event(EngineEvent::Ask(EngineAsk::Stop));
        let asked = bench.board.place();
        assert!(bench.until(15_000, |bench| bench.ended().is_some()), "seed {seed}");
        let far = |a: [f64; 3], b: [f64; 3]| (0..3).map(|axis| (a[axis] - b[axis]).abs()).fold(0.0, f64::max);
        // The simulated controller stops at once; nothing may follow.
        assert!(far(asked, bench.board.place()) < 0.2, "seed {seed}");
        bench.until(1_000, |_| false);
        assert!(far(asked, bench.board.place()) < 0.2, "seed {seed}");
        assert_eq!(bench.engine().trust, Trust::Trusted, "seed {seed}");
        let from = bench.done;
        if bench.ended() == Some(Ending::Done) {
            continue;
        }
        assert!(bench.until(5_000, |bench| bench.engine().phase == EnginePhase::Ready));
        bench.start(from);
        assert!(bench.run());
        let found = (bench.ended(), bench.missing(), bench.wrong());
        assert_eq!(found, (Some(Ending::Done), vec![], vec![]), "seed {seed}");
    }
}

#[test]
fn resets_and_unplugging_leave_no_hole_out() {
    for seed in 0..200 {
        let mut bench = Bench::new(seed, Faults::default());
        let mut disturbances = 3;
        let mut rounds = 0;
        loop {
            rounds += 1;
            assert!(rounds < 20, "seed {seed} never ends: {:?}", bench.words());
            assert!(bench.ready(), "seed {seed} is never ready: {:?}", bench.words());
            bench.start(bench.done);
            let moment = bench.now_ms + 200 + bench.chance.below(15_000) as u64;
            while bench.now_ms < moment && bench.ended().is_none() && disturbances > 0 {
                if bench.engine().phase == EnginePhase::ToolChange {
                    bench.event(EngineEvent::Ask(EngineAsk::ToolReady));
                }
                bench.tick();
            }
            if bench.ended().is_none() && disturbances > 0 {
                disturbances -= 1;
                if bench.chance.below(2) == 0 {
                    bench.board.power_up();
                } else {
                    bench.unplug();
                    // The controller executes what it has received.
                    let wait = bench.chance.below(5_000) as u64;
                    bench.until(wait, |_| false);
                }
                bench.until(500, |_| false);
                assert_eq!(bench.engine().trust, Trust::Lost, "seed {seed}: never guessed");
                continue;
            }
            assert!(bench.run(), "seed {seed}");
            if bench.ended() == Some(Ending::Done) {
                break;
            }
        }
        assert_eq!((bench.missing(), bench.wrong()), (vec![], vec![]), "seed {seed}");
    }
}

#[test]
fn damaged_characters_never_go_unnoticed() {
    let (mut jobs, mut stops, mut spoiled, mut wrongs) = (0, 0, 0, 0);
    for seed in 0..400 {
        let mut bench = Bench::new(
            seed,
            Faults { lost: 5e-4, damaged: 5e-4, back: if seed % 3 == 0 { 2e-4 } else { 0.0 } },
        );
        let mut rounds = 0;
        loop {
            rounds += 1;
            assert!(rounds < 60, "seed {seed} never ends: {:?}", bench.words());
            if !bench.ready() {
                continue;
            }
            let before = bench.wrong().len();
            bench.start(bench.done);
            assert!(bench.run(), "seed {seed}");
            let wrong = bench.wrong().len() > before;
            wrongs += u32::from(wrong);
            match bench.ended() {
                Some(Ending::Done) => {
                    assert!(!wrong, "seed {seed}: cut in the wrong place, and nobody was told");
                    break;
                }
                _ => stops += 1,
            }
        }
        jobs += 1;
        spoiled += bench.damaged;
        assert_eq!(bench.missing(), Vec::<[f64; 3]>::new(), "seed {seed}: left out");
    }
    println!("{jobs} jobs, {spoiled} characters spoiled, {stops} stops, {wrongs} wrong cuts, all told");
    assert!(stops > 100);
}

#[test]
fn sections_have_their_kinds() {
    let kinds: Vec<SectionKind> = routine().sections.iter().map(|section| section.kind).collect();
    assert_eq!(kinds.len(), 13);
    assert_eq!(
        (kinds[0], kinds[6], kinds[11], kinds[12]),
        (SectionKind::Change(0), SectionKind::Change(1), SectionKind::Toolpath(1), SectionKind::Finish)
    );
}
