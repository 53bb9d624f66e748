//! Compares the engine with the one before its phases became activities: both get the same random events, and
//! must do the same after each. A simulated controller answers what was sent, over a line with faults; a user
//! does what is likely in the phase, and sometimes anything.
//!
//! Faults of the old engine that today's can't have: a command that started while `$X` was unanswered was
//! forgotten with its answer (left out here); a job that had ended left its phase behind, in which Resume moved
//! nothing, a tool could be confirmed, and the step of its measurement was still shown (left out); after a report
//! off the path had ended the job, the position check could still send `$G`, and a job started after another zero
//! was stored than requested (both fixed in the copy).

use super::automaton::{Automaton, Counts};
use super::old_engine;
use super::setter::{self, surface};
use super::{ZERO, changer, job};
use annulus_core::chance::Chance;
use annulus_core::control::Trust;
use annulus_core::geometry::{Bounds, Point};
use annulus_core::grbl::{
    BoardHeight, CheckNews, Controller, EngineAction, EngineAsk, EngineEvent, EnginePhase, EngineStart,
    OverrideOf, Routine, SurveyNews, SurveyStart, WrittenLine, read, step,
};
use annulus_core::level::ProbeGrid;
use annulus_core::units::Length;
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

const EVENTS: (usize, usize) = (200_000, 1_000_000);
const EVENTS_OF_ONE: usize = 5_000;
const SHOWN: usize = 40;

/// What the events must lead to at least once.
const REACHED: &str = "Closed, Greeting, Ready, Locked, Homing, Jogging, Probing, Surveying, Checking, Holding, Held, \
    Stopping, parks, zero, fetched, survey true, survey false, check true, check false, held at the machine, \
    Running in a job, Holding in a job, Held in a job, ToolChange in a job, Jogging in a job, Probing in a job, \
    Measuring in a job, Changing in a job, Stopping in a job, step Ready, step Up, step Over, step Near, step Touch, \
    step Back, step Again, step Same, step Lift, step Zero, ended Done, ended Stopped, ended StoppedAfterHole, \
    ended Alarm";

fn routine() -> Arc<Routine> {
    let hole = |x: i32| format!("G0 X{x} Y4\nG0 Z0.5\nG1 Z-0.3 F600\nG0 Z2\n");
    let change = |tool: i32| format!("M5\nG0 Z8\nG0 X0 Y0\n(MSG, tool {tool})\nM0\nM3 S9000\n");
    let text = ["G21 G17 G90 G94\n", &change(1), &hole(0), &hole(1), &change(2), &hole(2), &hole(3)].concat();
    Arc::new(read("two", &[("two.nc".to_owned(), text + "M5\nG0 Z8\nG0 X0 Y0\nM2\n")]).unwrap())
}

fn survey() -> SurveyStart {
    let at = |mm: i64| Length::from_mm(mm as f64);
    let bounds = Bounds::of(Point::new(at(0), at(0))).with(Point::new(at(4), at(3)));
    let grid = ProbeGrid::over(bounds, at(4), at(0)).unwrap();
    SurveyStart { grid, clear_mm: 1.0, depth_mm: 2.0, mm_per_min: 300.0, over_mm_per_min: 900.0 }
}

/// What others read of an engine. `$in_job`: a phase of a job is not that of one which has ended.
macro_rules! seen {
    ($engine:expr, $in_job:expr) => {{
        let engine = $engine;
        (
            (engine.phase, engine.trust, engine.height(), engine.zero_mm, engine.place(), engine.line()),
            (engine.stands(), engine.parks(), engine.changing(), engine.lift_first_mm()),
            engine.measuring().filter(|_| $in_job),
            (engine.survey().map(|survey| survey.progress()), engine.routine().map(Arc::as_ptr).is_some()),
            (engine.sent_lines, engine.answered_lines, engine.job_zero_mm(), engine.modes.clone()),
            ([0, 1, 2].map(|axis| engine.room_mm(axis)), engine.status.clone()),
        )
    }};
}

/// The same controller, port and user for both engines.
struct World {
    seed: u64,
    chance: Chance,
    board: Automaton,
    old: Option<old_engine::Controller>,
    new: Option<Controller>,
    now_ms: u64,
    is_open: bool,
    /// Probability that a byte is lost or changed, to the controller and back.
    faults: [f64; 2],
    /// One tick of this many brings something that nobody asked for.
    calm: usize,
    stalled_until_ms: u64,
    next_tick_ms: u64,
    kept: Vec<u8>,
    events: usize,
    last_phase: Option<EnginePhase>,
    shown: VecDeque<(u64, EngineEvent, Vec<EngineAction>)>,
    reached: BTreeMap<String, usize>,
    routine: Arc<Routine>,
}

impl World {
    fn new(seed: u64, routine: &Arc<Routine>) -> Self {
        let mut chance = Chance::new(seed);
        let mut board = Automaton::new([-20.0, -30.0, -10.0]);
        let mut some = |of: usize| chance.below(of) == 0;
        board.surface = (!some(8)).then_some(surface as fn(f64, f64) -> f64);
        board.rack = (!some(3)).then_some((|tool| f64::from(tool % 3) * 0.5) as fn(u32) -> f64);
        (board.refuses_jogs, board.checks, board.has_mist) = (some(16), !some(8), !some(3));
        (board.hides_pins, board.reports_waiting, board.rarely_tells_zero) = (some(12), some(2), some(2));
        board.coast_ms = if some(2) { 3 } else { 0 };
        board.deaf_after_cancel = some(4);
        board.counts = if some(6) { Counts::Up } else { Counts::Down };
        if some(4) {
            board.settings.retain(|(number, _)| *number != 22);
        }
        for (number, one_in) in [(13, 5), (20, 8), (21, 2), (1, 2)] {
            if some(one_in) {
                board.settings.retain(|(known, _)| *known != number);
                board.settings.push((number, 1.0));
            }
        }
        let faults = match chance.below(4) {
            0 => [2e-4, 2e-4],
            1 => [0.0, 5e-4],
            _ => [0.0, 0.0],
        };
        let calm = if chance.below(2) == 0 { 8_000 } else { 400 };
        Self {
            seed,
            chance,
            board,
            old: Some(old_engine::Controller::default()),
            new: Some(Controller::default()),
            now_ms: 0,
            is_open: false,
            faults,
            calm,
            stalled_until_ms: 0,
            next_tick_ms: 0,
            kept: Vec::new(),
            events: 0,
            last_phase: None,
            shown: VecDeque::new(),
            reached: BTreeMap::new(),
            routine: Arc::clone(routine),
        }
    }

    fn some(&mut self, of: usize) -> bool {
        self.chance.below(of) == 0
    }

    fn reach(&mut self, what: String) {
        *self.reached.entry(what).or_default() += 1;
    }

    fn engine(&self) -> &Controller {
        self.new.as_ref().unwrap()
    }

    fn event(&mut self, event: EngineEvent) {
        self.events += 1;
        let (old, wanted) = old_engine::step(self.old.take().unwrap(), self.now_ms, event.clone());
        let (new, actions) = step(self.new.take().unwrap(), self.now_ms, event.clone());
        self.shown.push_back((self.now_ms, event, actions.clone()));
        if self.shown.len() > SHOWN {
            self.shown.pop_front();
        }
        let in_job = !old.outlives_its_job();
        let are_same =
            wanted == actions && seen!(&old, in_job) == seen!(&new, in_job) && old.info == new.info;
        if !are_same {
            for (ms, event, actions) in &self.shown {
                println!("{ms} {} → {actions:?}", told(event));
            }
            println!("old: {wanted:?}\n{:?}\nnew: {:?}", seen!(&old, in_job), seen!(&new, in_job));
            panic!("seed {}, event {}", self.seed, self.events);
        }
        if self.last_phase.replace(new.phase) != Some(new.phase) {
            let job = if new.routine().is_some() { " in a job" } else { "" };
            self.reach(format!("{:?}{job}", new.phase));
        }
        if let Some(step) = new.measuring() {
            self.reach(format!("step {step:?}"));
        }
        if new.stands() {
            self.reach("held at the machine".to_owned());
        }
        if new.parks() {
            self.reach("parks".to_owned());
        }
        (self.old, self.new) = (Some(old), Some(new));
        for action in actions {
            self.act(action);
        }
    }

    fn act(&mut self, action: EngineAction) {
        match action {
            EngineAction::Write(bytes) if self.is_open => {
                let bytes = self.spoil(bytes, self.faults[0]);
                self.kept.extend(bytes);
            }
            EngineAction::Close => self.is_open = false,
            EngineAction::Ended(ending) => self.reach(format!("ended {ending:?}")),
            EngineAction::Survey(SurveyNews::Over { survey }) => {
                self.reach(format!("survey {}", survey.is_some()));
            }
            EngineAction::Check(CheckNews::Over { why, .. }) => {
                self.reach(format!("check {}", why.is_none()));
            }
            EngineAction::ToolFetched { .. } => self.reach("fetched".to_owned()),
            EngineAction::ZeroSet => self.reach("zero".to_owned()),
            EngineAction::Found(why) => self.reach(format!("found {}", why.code)),
            _ => {}
        }
    }

    fn spoil(&mut self, bytes: Vec<u8>, fault: f64) -> Vec<u8> {
        if fault == 0.0 {
            return bytes;
        }
        let mut out = Vec::with_capacity(bytes.len());
        for byte in bytes {
            match self.chance.unit() {
                part if part < fault / 2.0 => {}
                part if part < fault => out.push(byte ^ (1 << self.chance.below(8))),
                _ => out.push(byte),
            }
        }
        out
    }

    fn tick(&mut self) {
        self.now_ms += 1;
        let is_stalled = self.now_ms < self.stalled_until_ms;
        if !is_stalled {
            self.board.hear(&std::mem::take(&mut self.kept));
        }
        self.board.tick();
        self.board.cuts.clear();
        if self.is_open && !is_stalled {
            let said = self.board.said();
            if !said.is_empty() {
                let said = self.spoil(said, self.faults[1]);
                self.event(EngineEvent::Bytes(said));
            }
        }
        if self.now_ms >= self.next_tick_ms {
            self.next_tick_ms = self.now_ms + 5 + self.chance.below(16) as u64;
            let is_late = self.some(300);
            self.event(if is_late { EngineEvent::Late } else { EngineEvent::Tick });
            self.user();
            if self.some(self.calm) {
                self.disturb();
            }
        }
    }

    fn disturb(&mut self) {
        let at_machine = ["Hold:0", "Door:0", "Door:1", "Tool", "Sleep"];
        match self.chance.below(14) {
            0 => self.board.power_up(),
            1 => self.board.power_up_unheard(),
            2 => {
                let probes = matches!(self.engine().phase, EnginePhase::Probing | EnginePhase::Measuring);
                let alarm = if probes { 4 + self.chance.below(2) } else { 1 + self.chance.below(9) };
                self.board.is_stopped(alarm as u16);
            }
            3 => self.board.lock_unheard(),
            4..=6 => self.board.held = Some(at_machine[self.chance.below(at_machine.len())]),
            7 => self.board.leaves_check_mode(),
            8 => self.board.shorted = !self.board.shorted,
            9 => {
                self.is_open = false;
                self.event(EngineEvent::Closed);
            }
            10 => self.stalled_until_ms = self.now_ms + 50 + self.chance.below(6_000) as u64,
            // A line is lost.
            11 => self.kept.clear(),
            _ => {
                let line = self.odd_line();
                self.event(EngineEvent::Bytes(format!("{line}\r\n").into_bytes()));
            }
        }
    }

    fn odd_line(&mut self) -> String {
        let states = [
            "Idle", "Run", "Hold:0", "Hold:1", "Jog", "Alarm", "Door:0", "Door:2", "Check", "Home", "Sleep",
            "Tool",
        ];
        let number = self.chance.below(40);
        let at = self.board.at.map(|mm| format!("{mm:.3}")).join(",");
        match self.chance.below(12) {
            0 => "ok".to_owned(),
            1 => format!("error:{number}"),
            2 => format!("ALARM:{}", 1 + number % 10),
            3 => format!("<{}|MPos:{at}|FS:0,0|Pn:P>", states[self.chance.below(states.len())]),
            4 => format!("<{}|MPos:0.000,0.000,0.000|FS:0,0>", states[self.chance.below(states.len())]),
            5 => format!("<{}|MPos:{at}|FS:9000,0|Ov:50,25,110>", states[self.chance.below(states.len())]),
            6 => format!("[PRB:{at}:{}]", number % 2),
            7 => "[MSG:Reset to continue]".to_owned(),
            8 => "Grbl 1.1h ['$' for help]".to_owned(),
            9 => format!("$13={}", number % 2),
            10 => format!("[G54:{at}]"),
            _ => "<Idle|MPos:1.0,x".to_owned(),
        }
    }

    fn user(&mut self) {
        use EnginePhase::{
            Changing, Checking, Closed, Greeting, Held, Holding, Homing, Jogging, Locked, Measuring, Probing,
            Ready, Running, Stopping, Surveying, ToolChange,
        };
        let one_in = match self.engine().phase {
            Closed => 20,
            Stopping => 25,
            Greeting | Homing => 150,
            Ready | Locked => 12,
            Held | ToolChange => 15,
            Jogging | Probing => 60,
            Holding => 40,
            Running => 120,
            Surveying | Checking | Measuring | Changing => 250,
        };
        if !self.some(one_in) {
            return;
        }
        if self.engine().phase == Closed {
            self.is_open = true;
            self.kept.clear();
            self.board.said();
            if self.some(2) {
                self.board.power_up();
            }
            let is_spared = self.some(3);
            return self.event(if is_spared { EngineEvent::OpenedSparing } else { EngineEvent::Opened });
        }
        let ask = if self.some(12) { self.any_ask() } else { self.likely_ask() };
        let old = self.old.as_ref().unwrap();
        let is_left_out = match ask {
            EngineAsk::Home | EngineAsk::Start(_) => old.unlocks(),
            EngineAsk::Resume | EngineAsk::ToolReady => old.outlives_its_job(),
            _ => false,
        };
        if !is_left_out {
            self.event(EngineEvent::Ask(ask));
        }
    }

    fn likely_ask(&mut self) -> EngineAsk {
        use EnginePhase::{Held, Homing, Jogging, Locked, Running, Stopping, Surveying, ToolChange};
        let engine = self.engine();
        let is_ready = engine.phase == EnginePhase::Ready;
        let needs_home = engine.trust != Trust::Trusted;
        let needs_height = engine.height() != BoardHeight::OfThisBit;
        let chance = self.chance.below(100);
        match self.engine().phase {
            _ if self.engine().stands() && chance < 60 => EngineAsk::Resume,
            Locked if chance < 70 => EngineAsk::Home,
            Locked => EngineAsk::Unlock,
            Held if chance < 80 => EngineAsk::Resume,
            ToolChange if chance < 30 => EngineAsk::SetZero { axes: [false, false, true], height_mm: 8.0 },
            ToolChange if chance < 40 => self.probe(),
            ToolChange if chance < 85 => EngineAsk::ToolReady,
            ToolChange if chance < 95 => {
                EngineAsk::Jog { axis: 2, um: 20_000, mm_per_min: 500.0, anyway: false }
            }
            Running if chance < 40 => EngineAsk::Hold,
            Surveying if chance < 80 => EngineAsk::Hold,
            Stopping | Homing | Jogging if chance < 40 => EngineAsk::Stop,
            Running if chance < 60 => EngineAsk::ToolBefore { section: self.chance.below(7) },
            _ if is_ready && needs_home && chance < 50 => EngineAsk::Home,
            _ if is_ready && needs_home && chance < 80 => {
                EngineAsk::SetZero { axes: [true; 3], height_mm: 1.0 }
            }
            _ if is_ready && needs_height && chance < 50 => EngineAsk::ZeroAt { place_mm: ZERO.map(Some) },
            _ if is_ready && chance < 75 => self.start(),
            _ if is_ready && chance < 85 => EngineAsk::Survey(survey()),
            _ => self.any_ask(),
        }
    }

    fn probe(&mut self) -> EngineAsk {
        let depth_mm = self.chance.between(1.0, 60.0);
        EngineAsk::Probe { depth_mm, mm_per_min: 900.0, plate_mm: 0.0, up_mm: 2.0 }
    }

    fn start(&mut self) -> EngineAsk {
        let lengths = self.chance.below(5);
        let job = EngineStart { routine: Arc::clone(&self.routine), spin_up_s: 0.05, ..job(0) };
        let job = match lengths {
            0 => EngineStart { same_length: true, ..job },
            1 => job,
            2 => EngineStart { setter: Some(setter::setter()), ..job },
            3 => EngineStart { changer: changer::changer(&changer::FETCHES), ..job },
            _ => EngineStart {
                setter: Some(setter::setter()),
                changer: changer::changer(&changer::FETCHES),
                ..job
            },
        };
        let from = if self.some(4) { self.chance.below(job.routine.sections.len()) } else { 0 };
        let zero_mm = if self.some(2) { self.engine().job_zero_mm() } else { None };
        let accepted = if self.some(2) { vec!["grbl.out_of_travel".to_owned()] } else { Vec::new() };
        EngineAsk::Start(EngineStart { from, zero_mm, accepted, ..job })
    }

    fn check(&mut self) -> EngineAsk {
        let line = |number: u32, text: &str| WrittenLine {
            section: 0,
            line: number,
            text: text.to_owned(),
            is_changed: false,
        };
        let written: Arc<[WrittenLine]> = if self.some(3) {
            [line(1, "G21G90"), line(2, "M7"), line(3, "G1X1F100"), line(4, "G99")].into()
        } else {
            Arc::default()
        };
        EngineAsk::Check { routine: Arc::clone(&self.routine), written }
    }

    fn any_ask(&mut self) -> EngineAsk {
        let chance = &mut self.chance;
        let axis = chance.below(4) as u8;
        match chance.below(25) {
            0 => EngineAsk::Home,
            1 => EngineAsk::Unlock,
            2..=4 => EngineAsk::Jog {
                axis,
                um: chance.below(60_000) as i32 - 30_000,
                mm_per_min: chance.between(-10.0, 3_000.0),
                anyway: chance.below(2) == 0,
            },
            5 => EngineAsk::Park { from_low_mm: (chance.below(2) == 0).then_some([20.0, 10.0]) },
            6 => EngineAsk::JogCancel,
            7 => {
                let axes = [0; 3].map(|_| chance.below(2) == 0);
                EngineAsk::SetZero { axes, height_mm: chance.between(0.0, 3.0) }
            }
            8 => EngineAsk::ZeroAt { place_mm: ZERO.map(|mm| (chance.below(4) > 0).then_some(mm)) },
            9 => self.probe(),
            10 => {
                let reach_mm = chance.between(-40.0, 40.0);
                EngineAsk::Edge { axis, reach_mm, mm_per_min: 800.0, radius_mm: 1.0, back_mm: 2.0 }
            }
            11 | 12 => EngineAsk::Survey(survey()),
            13 => self.start(),
            14 => EngineAsk::Hold,
            15 => EngineAsk::Resume,
            16 => EngineAsk::ToolBefore { section: chance.below(8) },
            17 => EngineAsk::ToolReady,
            18 => EngineAsk::NewBit,
            19 => EngineAsk::Stop,
            20 => EngineAsk::StopAfter,
            21 => {
                let of = [OverrideOf::Feed, OverrideOf::Rapid, OverrideOf::Spindle][chance.below(3)];
                let percent = [5, 25, 50, 83, 100, 120][chance.below(6)];
                EngineAsk::Override { of, percent }
            }
            22 | 23 => self.check(),
            _ => {
                let (number, value) = [(13, 0.0), (13, 1.0), (22, 1.0), (110, 6_000.0)][chance.below(4)];
                EngineAsk::Set { number, value }
            }
        }
    }
}

fn told(event: &EngineEvent) -> String {
    match event {
        EngineEvent::Bytes(bytes) => format!("{:?}", String::from_utf8_lossy(bytes)),
        EngineEvent::Ask(EngineAsk::Start(start)) => {
            format!("Start from {} {} {:?} {:?}", start.from, start.same_length, start.setter, start.changer)
        }
        EngineEvent::Ask(EngineAsk::Check { .. }) => "Check".to_owned(),
        event => format!("{event:?}"),
    }
}

#[test]
fn both_engines_do_the_same_after_random_events() {
    let is_long = std::env::var_os("ANNULUS_LONG").is_some();
    let count = if is_long { EVENTS.1 } else { EVENTS.0 };
    let routine = routine();
    let (mut events, mut reached) = (0, BTreeMap::<String, usize>::new());
    for seed in 0.. {
        let mut world = World::new(seed, &routine);
        while world.events < EVENTS_OF_ONE {
            world.tick();
        }
        events += world.events;
        for (what, times) in world.reached {
            *reached.entry(what).or_default() += times;
        }
        if events >= count {
            break;
        }
    }
    println!("{events} events: {reached:#?}");
    let missed: Vec<&str> = REACHED.split(", ").filter(|what| !reached.contains_key(*what)).collect();
    assert_eq!(missed, Vec::<&str>::new());
}
