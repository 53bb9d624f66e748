//! Tests of a station with a simulated GRBL controller and a simulated clock: the page's requests, and the
//! tool's real motion.

// Shared with the engine's own tests.
#[allow(dead_code)]
#[path = "../../../core/tests/grbl/automaton/mod.rs"]
mod automaton;

mod changer;
mod checked;
mod command;
mod draft;
mod height;
mod host;
mod ledger;
mod level;
mod mill;
mod opening;
mod overrides;
mod park;
mod setter;

use super::PageStation;
use crate::files::{File, Files};
use crate::tests as drilled;
use annulus_core::control::{Ending, State, Trust};
use annulus_core::job::{Command, Mark, Program};
use annulus_core::machine::{Value, hobby_3018};
use annulus_core::magazine::{Held, Seen};
use annulus_core::wire::{ArmedJob, Ask, InterruptedJob, JobEnd, RowVerdict, Status, Tell, program};
use automaton::Automaton;
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::rc::Rc;
use std::time::Duration;

thread_local! {
    static NOW: Cell<Duration> = const { Cell::new(Duration::ZERO) };
}

/// A hole counts as made if the tool came this close to its bottom, mm.
const NEAR: f64 = 0.02;
const ZERO: [f64; 3] = [-150.0, -120.0, -40.0];

/// Files that outlive a station; they can be full.
#[derive(Clone, Default)]
struct Memory(Rc<RefCell<Kept>>);

type Kept = (BTreeMap<File, Vec<u8>>, bool);

impl Files for Memory {
    fn read(&mut self, file: File) -> Result<Vec<u8>, String> {
        Ok(self.0.borrow().0.get(&file).cloned().unwrap_or_default())
    }

    fn write(&mut self, file: File, bytes: &[u8]) -> Result<(), String> {
        let mut disk = self.0.borrow_mut();
        if disk.1 {
            return Err("there is no room".to_owned());
        }
        disk.0.insert(file, bytes.to_vec());
        Ok(())
    }

    fn append(&mut self, _: File, _: &[u8]) -> Result<(), String> {
        Err("nothing is appended".to_owned())
    }
}

struct Bench {
    files: Memory,
    station: PageStation<Memory>,
    board: Automaton,
    heard: Vec<Tell>,
    ms: u64,
}

impl Bench {
    fn plug(files: &Memory, board: Automaton) -> Self {
        let station = PageStation::open(files.clone(), 1.0, || NOW.get()).unwrap();
        let mut bench = Self { files: files.clone(), station, board, heard: Vec::new(), ms: 0 };
        bench.station.connect();
        let hello =
            Ask::Hello { proto: 1, min: 1, app: String::new(), session: String::new(), proof: String::new() };
        bench.ask(&hello);
        bench.ask(&Ask::TakeControl { force: false });
        bench.until(|status| matches!(status.state, State::NotHomed | State::Ready));
        // Until the first report.
        (0..1_000).for_each(|_| bench.millisecond());
        bench
    }

    /// Unplugs the cable and power-cycles the controller, then reconnects.
    fn replug(mut self) -> Self {
        self.station.unplugged();
        self.turn();
        assert!(self.station.is_over());
        self.board.power_up();
        Self::plug(&self.files, self.board)
    }

    fn ask(&mut self, ask: &Ask) {
        self.station.hear(&serde_json::to_string(ask).unwrap());
        self.turn();
    }

    fn refused(&mut self, ask: &Ask) -> Option<String> {
        self.heard.retain(|tell| !matches!(tell, Tell::Refused { .. }));
        self.ask(ask);
        self.heard.iter().find_map(|tell| match tell {
            Tell::Refused { why } => Some(why.code.clone()),
            _ => None,
        })
    }

    fn turn(&mut self) {
        self.station.advance();
        let frames = self.station.frames();
        self.heard.extend(frames.iter().map(|frame| serde_json::from_str::<Tell>(frame).unwrap()));
        let written = self.station.written();
        if !written.is_empty() {
            self.board.hear(&written);
            self.station.carried();
        }
    }

    fn millisecond(&mut self) {
        NOW.set(NOW.get() + Duration::from_millis(1));
        self.ms += 1;
        self.board.tick();
        let said = self.board.said();
        if !said.is_empty() {
            self.station.bytes(said);
            self.turn();
        } else if self.ms.is_multiple_of(10) {
            self.turn();
        }
        if self.ms.is_multiple_of(1000) {
            self.ask(&Ask::Ping { stamp: 0.0 });
        }
    }

    fn status(&self) -> Option<&Status> {
        let mut told = self.heard.iter().rev();
        told.find_map(|tell| if let Tell::Status(status) = tell { Some(status.as_ref()) } else { None })
    }

    fn until(&mut self, what: impl Fn(&Status) -> bool) -> Status {
        for _ in 0..400_000 {
            self.millisecond();
            if let Some(status) = self.status().filter(|status| what(status)) {
                return status.clone();
            }
        }
        panic!("waited in vain: {:?}", self.status());
    }

    fn state(&mut self, state: State) -> Status {
        self.until(|status| status.state == state)
    }

    fn jog(&mut self, axis: u8, distance_mm: f64) {
        self.ask(&Ask::Jog { axis, distance_um: (distance_mm * 1e3) as i32, anyway: false });
        self.state(State::Jogging);
        while self.status().is_some_and(|status| status.state == State::Jogging) {
            (0..50).for_each(|_| self.millisecond());
            self.ask(&Ask::JogOn);
        }
    }

    /// Homes, sets the work zero, and touches the board with the tool.
    fn ready(files: &Memory) -> Self {
        Self::ready_with(files, Automaton::new([-20.0, -30.0, -10.0]))
    }

    fn ready_with(files: &Memory, board: Automaton) -> Self {
        let mut bench = Self::plug(files, board);
        bench.ask(&Ask::Home);
        bench.state(State::Ready);
        for axis in 0..3 {
            let at = bench.status().unwrap().machine_mm[usize::from(axis)];
            bench.jog(axis, ZERO[usize::from(axis)] - at);
        }
        bench.set_zero();
        bench
    }

    fn set_zero(&mut self) {
        for ask in [Ask::SetZero, Ask::SetHeight] {
            assert_eq!(self.refused(&ask), None);
            (0..500).for_each(|_| self.millisecond());
        }
    }

    fn upload(&mut self, program: &Program) -> String {
        let bytes = program::encode(program);
        let key = program::key(&bytes);
        self.station.upload(&key, bytes).unwrap();
        key
    }

    fn fails(&mut self, key: &str, from_leg: u32) -> Vec<String> {
        self.heard.retain(|tell| !matches!(tell, Tell::Armed(_)));
        self.ask(&Ask::Arm { job: key.to_owned(), from_leg });
        let armed = self.heard.iter().find_map(|tell| match tell {
            Tell::Armed(ArmedJob { stream_digest, checks, .. }) => Some((stream_digest, checks)),
            _ => None,
        });
        let (digest, checks) = armed.unwrap_or_else(|| panic!("{:?}", self.heard.last()));
        assert_eq!(digest, "");
        let fails = checks.iter().filter(|row| row.verdict == RowVerdict::Fail);
        fails.map(|row| row.finding.code.clone()).collect()
    }

    fn start(&mut self, key: &str, from_leg: u32) {
        assert_eq!(self.fails(key, from_leg), Vec::<String>::new());
        let start = Ask::Start { job: key.to_owned(), stream_digest: String::new(), from_leg };
        assert_eq!(self.refused(&start), None);
    }

    /// Touches off every tool and continues, until the job ends.
    fn finish(&mut self) -> (Ending, u32) {
        loop {
            let status = self.until(|status| status.state == State::ToolChange || status.job.is_none());
            if status.job.is_none() {
                break;
            }
            if self.refused(&Ask::ToolChanged).is_some() {
                let height_mm = self.status().unwrap().work_mm[2];
                self.jog(2, -height_mm);
                self.ask(&Ask::SetHeight);
                (0..500).for_each(|_| self.millisecond());
                assert_eq!(self.refused(&Ask::ToolChanged), None);
            }
            self.until(|status| status.state != State::ToolChange);
        }
        let ended = self.heard.iter().rev().find_map(|tell| match tell {
            Tell::Ended(JobEnd { ending, holes_done, .. }) => Some((*ending, *holes_done)),
            _ => None,
        });
        ended.unwrap()
    }

    fn offer(&self) -> Option<(String, u32, u32)> {
        self.heard.iter().rev().find_map(|tell| match tell {
            Tell::Interrupted(InterruptedJob { job, next_leg, holes_done, .. }) => {
                Some((job.clone(), *next_leg, *holes_done))
            }
            _ => None,
        })
    }

    /// How often the tool reached each hole's bottom, and how often it was in the board elsewhere.
    fn made(&self, program: &Program) -> (Vec<usize>, usize) {
        let bottoms = bottoms(program);
        let cuts: Vec<[f64; 3]> = self
            .board
            .cuts
            .iter()
            .map(|place| [0, 1, 2].map(|axis| place[axis] - ZERO[axis]))
            .filter(|place| place[2] < -NEAR)
            .collect();
        let beside = |cut: &[f64; 3], bottom: &[f64; 3]| {
            (0..2).all(|axis| (cut[axis] - bottom[axis]).abs() <= NEAR) && cut[2] >= bottom[2] - NEAR
        };
        let times = bottoms
            .iter()
            .map(|bottom| {
                let deep = |cut: &[f64; 3]| beside(cut, bottom) && cut[2] <= bottom[2] + NEAR;
                cuts.iter()
                    .enumerate()
                    .filter(|(at, cut)| deep(cut) && (*at == 0 || !deep(&cuts[at - 1])))
                    .count()
            })
            .collect();
        let elsewhere = cuts.iter().filter(|cut| !bottoms.iter().any(|bottom| beside(cut, bottom))).count();
        (times, elsewhere)
    }
}

fn bottoms(program: &Program) -> Vec<[f64; 3]> {
    let legs = program.legs.iter().enumerate().filter(|(_, leg)| matches!(leg.mark, Mark::Hole(_)));
    legs.map(|(index, leg)| {
        let place = program.start_of_leg(index + 1);
        let depth = leg.commands.iter().find_map(|command| match command {
            Command::Plunge { to, .. } => Some(to.mm()),
            _ => None,
        });
        [place.x.mm(), place.y.mm(), depth.unwrap()]
    })
    .collect()
}

fn holes(count: usize) -> Program {
    drilled::holes(&hobby_3018(), count, 4, |n| if n.is_multiple_of(3) { 1_000 } else { 800 })
}

#[test]
fn two_tool_board_is_drilled_as_programmed() {
    let (files, program) = (Memory::default(), holes(10));
    assert_eq!(program.bits.len(), 2);
    let mut bench = Bench::ready(&files);
    let key = bench.upload(&program);
    bench.start(&key, 0);
    let first = bench.state(State::ToolChange);
    assert!(matches!(program.legs[first.leg.unwrap() as usize].mark, Mark::ToolChange(0)));
    // The first tool is the one that was in when the height was set.
    assert_eq!(bench.refused(&Ask::ToolChanged), None);
    bench.until(|status| status.holes_done > 0);
    let second = bench.state(State::ToolChange);
    assert!(matches!(program.legs[second.leg.unwrap() as usize].mark, Mark::ToolChange(1)));
    assert_eq!(bench.refused(&Ask::ToolChanged).as_deref(), Some("grbl.height_first"));
    assert_eq!(bench.finish(), (Ending::Done, 10));
    let status = bench.state(State::Ready);
    assert_eq!((status.trust, status.spindle_rpm, status.alarm), (Trust::Trusted, 0, None));
    assert_eq!(bench.made(&program), (vec![1; 10], 0));
    // No job is offered, now or after the next connection.
    assert_eq!(bench.offer(), None);
    assert_eq!(bench.replug().offer(), None);
}

#[test]
fn unplugged_job_is_recorded_and_resumed() {
    let (files, program) = (Memory::default(), holes(12));
    let mut bench = Bench::ready(&files);
    let key = bench.upload(&program);
    bench.start(&key, 0);
    bench.state(State::ToolChange);
    bench.ask(&Ask::ToolChanged);
    bench.until(|status| status.holes_done == 3);
    let mut again = bench.replug();
    let (job, next_leg, done) = again.offer().unwrap();
    assert_eq!((&job, done), (&key, 3));
    // The position is lost; after homing, zero is where it was. A restarted job needs its height set again.
    assert_eq!(again.fails(&job, next_leg), ["grbl.not_homed", "preflight.busy"]);
    again.ask(&Ask::Home);
    again.state(State::Ready);
    assert_eq!(again.fails(&job, 0), ["grbl.no_height"]);
    assert_eq!(
        again.refused(&Ask::Arm { job: job.clone(), from_leg: next_leg + 1 }).as_deref(),
        Some("control.leg_not_offered")
    );
    again.start(&job, next_leg);
    assert_eq!(again.finish(), (Ending::Done, 12));
    let (times, elsewhere) = again.made(&program);
    assert!(times.iter().all(|times| (1..=2).contains(times)), "{times:?}");
    assert!(
        times.iter().filter(|times| **times == 2).count() <= 1 && elsewhere == 0,
        "{times:?} {elsewhere}"
    );
}

#[test]
fn unplugging_is_reported() {
    let mut bench = Bench::ready(&Memory::default());
    let key = bench.upload(&holes(8));
    bench.start(&key, 0);
    bench.state(State::ToolChange);
    bench.station.unplugged();
    bench.turn();
    let said: Vec<_> = bench
        .heard
        .iter()
        .filter_map(|tell| match tell {
            Tell::Refused { why } => Some(why.code.as_str()),
            Tell::Ended(JobEnd { ending: Ending::Alarm, .. }) => Some("ended"),
            _ => None,
        })
        .collect();
    assert_eq!(said, ["ended", "grbl.unplugged"]);
    assert_eq!(bench.status().map(|status| status.state), Some(State::NotHomed));
}

#[test]
fn stop_ends_the_job_and_offers_the_rest() {
    let (files, program) = (Memory::default(), holes(10));
    let mut bench = Bench::ready(&files);
    let key = bench.upload(&program);
    bench.start(&key, 0);
    bench.state(State::ToolChange);
    bench.ask(&Ask::ToolChanged);
    bench.until(|status| status.holes_done == 2);
    bench.ask(&Ask::Pause);
    bench.state(State::Paused);
    bench.ask(&Ask::Resume);
    bench.state(State::Running);
    bench.ask(&Ask::Stop);
    assert_eq!(bench.state(State::Ready).trust, Trust::Trusted);
    let (cuts, place) = (bench.board.cuts.len(), bench.board.place());
    (0..3_000).for_each(|_| bench.millisecond());
    assert_eq!((bench.board.cuts.len(), bench.board.place()), (cuts, place), "nothing moves after STOP");
    let (job, next_leg, _) = bench.offer().unwrap();
    bench.start(&job, next_leg);
    bench.ask(&Ask::StopAfterHole);
    assert_eq!(bench.finish().0, Ending::StoppedAfterHole);
    bench.state(State::Ready);
    let (job, next_leg, done) = bench.offer().unwrap();
    bench.start(&job, next_leg);
    assert_eq!(bench.finish(), (Ending::Done, 10), "{done}");
    let (times, elsewhere) = bench.made(&program);
    assert!(times.iter().all(|times| (1..=2).contains(times)) && elsewhere == 0, "{times:?} {elsewhere}");
}

#[test]
fn unrenewed_jog_ends_and_travel_limits_hold() {
    let mut bench = Bench::plug(&Memory::default(), Automaton::new([-20.0, -30.0, -10.0]));
    assert_eq!(
        bench.refused(&Ask::Jog { axis: 0, distance_um: 1_000, anyway: false }).as_deref(),
        Some("control.not_homed")
    );
    bench.ask(&Ask::Home);
    bench.state(State::Ready);
    // Homing left X at its upper limit.
    assert_eq!(
        bench.refused(&Ask::Jog { axis: 0, distance_um: 1_000_000, anyway: false }).as_deref(),
        Some("control.end_of_travel")
    );
    assert_eq!(bench.refused(&Ask::Jog { axis: 0, distance_um: -1_000_000, anyway: false }), None);
    let gone = bench.state(State::Ready).machine_mm[0];
    assert!((-6.0..-1.0).contains(&gone), "it went on without the page: {gone}");
    bench.jog(0, -1_000.0);
    assert!((bench.status().unwrap().machine_mm[0] + 299.0).abs() < 0.01);
}

#[test]
fn unsupported_requests_are_refused_and_settings_saved() {
    let mut bench = Bench::ready(&Memory::default());
    let number = |key: &str| vec![(key.to_owned(), Value::Number(1.0))];
    let rows = [
        (Ask::Queue { text: "home".to_owned() }, Some("grbl.no_queue")),
        (Ask::OutputLease { minutes: 1 }, Some("grbl.no_outputs")),
        (Ask::Configure { changes: number("x.max_speed") }, Some("grbl.set_there")),
        (Ask::Configure { changes: number("card.start_stop_rate") }, Some("control.in_file_only")),
        (Ask::Configure { changes: number("stroke.feed") }, None),
        (Ask::FeedOverride { percent: 5 }, Some("control.bad_feed_override")),
        (Ask::Pause, Some("grbl.not_now")),
        (
            Ask::Start { job: "0".to_owned(), stream_digest: String::new(), from_leg: 0 },
            Some("control.not_armed"),
        ),
    ];
    for (ask, code) in rows {
        assert_eq!(bench.refused(&ask).as_deref(), code, "{ask:?}");
    }
    // The settings are saved.
    let bench = bench.replug();
    let feed = bench.heard.iter().find_map(|tell| match tell {
        Tell::Machine { settings, .. } => settings.iter().find(|(key, _)| key == "stroke.feed").cloned(),
        _ => None,
    });
    assert_eq!(feed.unwrap().1, Value::Number(1.0));
}

#[test]
fn magazine_and_foot_are_refused_but_their_advice_works() {
    let mut bench = Bench::ready(&Memory::default());
    let set = |changes: &[(&str, Value)]| {
        let changes = changes.iter().map(|(key, value)| ((*key).to_owned(), value.clone()));
        Ask::Configure { changes: changes.collect() }
    };
    let word = |word: &str| Value::Text(word.to_owned());
    let settings = bench.heard.iter().rev().find_map(|tell| match tell {
        Tell::Machine { settings, .. } => Some(settings.clone()),
        _ => None,
    });
    let settings: BTreeMap<String, Value> = settings.unwrap().into_iter().collect();
    let past = |key: &str, mm: f64| match &settings[key] {
        Value::Number(at) => at + mm,
        other => panic!("{key}: {other:?}"),
    };
    let near = |key: &str| Value::Number(past(key, 5.0));
    let places = |key: &str| Value::Numbers([20.0, 50.0].map(|mm| past(key, mm)).to_vec());
    let magazine = [
        ("rack.change", word("magazine")),
        ("magazine.x", places("x.min")),
        ("magazine.y", places("y.min")),
        ("magazine.height", near("z.min")),
        ("magazine.pause_x", near("x.min")),
        ("magazine.pause_y", near("y.min")),
    ];
    let rows = [
        (Ask::Stock { places: vec![], spindle: Held::Nothing }, Some("grbl.no_magazine")),
        (Ask::ToolSeen { seen: Seen::InPlace }, Some("grbl.no_magazine")),
        (Ask::OpenClamp, Some("grbl.no_magazine")),
        (set(&magazine), Some("grbl.no_magazine")),
        // Its advice is followed, in one change.
        (set(&[&magazine[1..], &[("rack.change", word("manual"))]].concat()), None),
        (set(&[("foot.on", word("yes")), ("overlap.on", word("no"))]), Some("grbl.no_foot")),
        (set(&[("foot.on", word("no")), ("overlap.on", word("no"))]), None),
        (set(&[("x.index", word("yes"))]), Some("grbl.no_index")),
    ];
    for (ask, code) in rows {
        assert_eq!(bench.refused(&ask).as_deref(), code, "{ask:?} {:?}", bench.heard.last());
    }
    // The job then runs with manual tool changes.
    let key = bench.upload(&holes(4));
    bench.start(&key, 0);
    assert_eq!(bench.finish(), (Ending::Done, 4));
}

#[test]
fn unwritable_journal_refuses_the_start() {
    let files = Memory::default();
    let mut bench = Bench::ready(&files);
    let key = bench.upload(&holes(4));
    assert_eq!(bench.fails(&key, 0), Vec::<String>::new());
    files.0.borrow_mut().1 = true;
    let start = Ask::Start { job: key, stream_digest: String::new(), from_leg: 0 };
    assert_eq!(bench.refused(&start).as_deref(), Some("journal.cannot_write"));
    (0..3_000).for_each(|_| bench.millisecond());
    assert_eq!(bench.status().map(|status| status.state), Some(State::Ready));
    assert!(bench.board.cuts.iter().all(|place| place[2] >= ZERO[2] - NEAR));
}

#[test]
fn worn_tool_is_replaced_between_two_holes() {
    let (files, program) = (Memory::default(), holes(10));
    let mut bench = Bench::ready(&files);
    let lines = ["T1 drill 0.8 life 4", "T2 drill 1 life 100"].map(str::to_owned).to_vec();
    let changes = vec![("rack.tools".to_owned(), Value::Texts(lines))];
    assert_eq!(bench.refused(&Ask::Configure { changes }), None);
    let key = bench.upload(&program);
    bench.start(&key, 0);
    let told = |bench: &Bench| {
        let mut told = bench.heard.iter().rev();
        let report =
            told.find_map(|tell| if let Tell::Tools(report) = tell { Some(report.clone()) } else { None });
        let report = report.unwrap();
        let hits = |number| report.wear.iter().find(|wear| wear.number == number).map_or(0, |wear| wear.hits);
        (report.wanted, hits(1), hits(2))
    };
    // Until the tool change between the holes of T1.
    loop {
        bench.state(State::ToolChange);
        (0..50).for_each(|_| bench.millisecond());
        if let (Some(1), 4, _) = told(&bench) {
            break;
        }
        if bench.refused(&Ask::ToolChanged).is_some() {
            let height_mm = bench.status().unwrap().work_mm[2];
            bench.jog(2, -height_mm);
            bench.ask(&Ask::SetHeight);
            (0..500).for_each(|_| bench.millisecond());
            assert_eq!(bench.refused(&Ask::ToolChanged), None);
        }
        bench.until(|status| status.state != State::ToolChange);
    }
    let status = bench.status().unwrap();
    assert!(status.work_mm[2] > 0.0 && status.spindle_rpm == 0, "{status:?}");
    assert_eq!(
        bench.refused(&Ask::ToolChanged).as_deref(),
        Some("grbl.height_first"),
        "it is another length"
    );
    assert_eq!(bench.finish(), (Ending::Done, 10));
    assert_eq!(bench.made(&program), (vec![1; 10], 0));
    (0..50).for_each(|_| bench.millisecond());
    assert_eq!(told(&bench), (None, 2, 4), "the new one is counted from 0");
}

#[test]
fn holes_count_per_tool_and_a_worn_one_gives_a_warning() {
    let (files, program) = (Memory::default(), holes(10));
    let mut bench = Bench::ready(&files);
    let lines = ["T1 drill 0.8 life 6", "T2 drill 1 life 100"].map(str::to_owned).to_vec();
    assert_eq!(
        bench.refused(&Ask::Configure { changes: vec![("rack.tools".to_owned(), Value::Texts(lines))] }),
        None
    );
    let key = bench.upload(&program);
    bench.start(&key, 0);
    assert_eq!(bench.finish(), (Ending::Done, 10));
    let hits = |bench: &Bench| {
        let told = bench.heard.iter().rev();
        let mut told =
            told.filter_map(|tell| if let Tell::Tools(report) = tell { Some(report) } else { None });
        let mut hits: Vec<_> =
            told.next().unwrap().wear.iter().map(|wear| (wear.number, wear.hits)).collect();
        hits.sort_unstable();
        hits
    };
    assert_eq!(hits(&bench), [(1, 6), (2, 4)]);
    let mut again = bench.replug();
    assert_eq!(hits(&again), [(1, 6), (2, 4)], "over the cable");
    again.ask(&Ask::Home);
    again.state(State::Ready);
    again.set_zero();
    let worn = |bench: &mut Bench| {
        bench.fails(&key, 0);
        let armed = bench.heard.iter().find_map(|tell| match tell {
            Tell::Armed(ArmedJob { checks, .. }) => Some(checks.clone()),
            _ => None,
        });
        armed.unwrap().iter().filter(|row| row.finding.code == "preflight.tool_worn").count()
    };
    again.upload(&program);
    assert_eq!(worn(&mut again), 1);
    assert_eq!(again.refused(&Ask::NewTool { number: 1 }), None);
    assert_eq!((hits(&again), worn(&mut again)), (vec![(1, 0), (2, 4)], 0));
}
