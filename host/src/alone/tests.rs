//! Tests of the drill without threads, with a simulated clock: no waiting, and every run is identical.

mod clamp;
mod deaths;
mod depth;
mod foot;
mod homing;
mod park;
mod pause;
mod port;
mod refused;
mod tool_length;
mod touch;
mod wired;
mod world;

use super::*;
use crate::tests as drilled;
use annulus_core::chance::Chance;
use annulus_core::control::{Ending, State, Trust};
use annulus_core::job::Program;
use annulus_core::machine::virtual_drill;
use annulus_core::units::Length;
use annulus_core::virtual_drill::tally;
use annulus_core::wire::{ArmedJob, Ask, Control, InterruptedJob, JobEnd, RowVerdict, Status, Tell, program};
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::rc::Rc;
use world::World;

thread_local! {
    static NOW: Cell<Duration> = const { Cell::new(Duration::ZERO) };
}

fn now() -> Duration {
    NOW.get()
}

/// Files in memory that outlive a drill. They can be full, or torn: the write after a given number is
/// incomplete, and later ones are lost.
#[derive(Clone, Default)]
struct Memory(Rc<RefCell<Disk>>);

#[derive(Default)]
struct Disk {
    files: BTreeMap<File, Vec<u8>>,
    full: bool,
    left: Option<u32>,
}

impl Disk {
    fn room(&mut self, length: usize) -> usize {
        match &mut self.left {
            _ if self.full => 0,
            None => length,
            Some(0) => 0,
            Some(left) => {
                *left -= 1;
                if *left == 0 { length / 2 } else { length }
            }
        }
    }
}

impl Files for Memory {
    fn read(&mut self, file: File) -> Result<Vec<u8>, String> {
        Ok(self.0.borrow().files.get(&file).cloned().unwrap_or_default())
    }

    fn write(&mut self, file: File, bytes: &[u8]) -> Result<(), String> {
        let mut disk = self.0.borrow_mut();
        let room = disk.room(bytes.len());
        if room > 0 || bytes.is_empty() {
            disk.files.insert(file, bytes[..room].to_vec());
        }
        if room == bytes.len() { Ok(()) } else { Err("full".to_owned()) }
    }

    fn append(&mut self, file: File, bytes: &[u8]) -> Result<(), String> {
        let mut disk = self.0.borrow_mut();
        if disk.full {
            return Err("full".to_owned());
        }
        disk.files.entry(file).or_default().extend_from_slice(bytes);
        Ok(())
    }
}

/// A drill, its page, and the page's received messages.
struct Bench {
    drill: Alone<Memory>,
    heard: Vec<Tell>,
    /// The adapter and machine at its port; `None` for the virtual drill.
    world: Option<World>,
}

impl Bench {
    fn open(files: &Memory) -> Self {
        Self::open_at(files, 200.0)
    }

    fn open_at(files: &Memory, speed: f64) -> Self {
        Self::of(Alone::open(files.clone(), speed, 7, now).unwrap(), None)
    }

    fn of(drill: Alone<Memory>, world: Option<World>) -> Self {
        let mut bench = Self { drill, heard: Vec::new(), world };
        bench.drill.connect();
        let hello =
            Ask::Hello { proto: 1, min: 1, app: String::new(), session: String::new(), proof: String::new() };
        bench.ask(&hello);
        bench.ask(&Ask::TakeControl { force: false });
        bench
    }

    fn ask(&mut self, ask: &Ask) {
        self.drill.hear(&serde_json::to_string(ask).unwrap());
        self.turn(Duration::ZERO);
    }

    fn turn(&mut self, after: Duration) {
        NOW.set(NOW.get() + after);
        if let Some(world) = &mut self.world {
            world.go_on();
        }
        self.drill.advance();
        let frames = self.drill.frames();
        self.heard.extend(frames.iter().map(|frame| serde_json::from_str::<Tell>(frame).unwrap()));
    }

    fn status(&self) -> &Status {
        let told = self.heard.iter().rev();
        let mut told =
            told.filter_map(|tell| if let Tell::Status(status) = tell { Some(status) } else { None });
        told.next().unwrap()
    }

    /// Takes turns until the status satisfies `what`; the page keeps its session alive.
    fn until(&mut self, what: impl Fn(&Status) -> bool) -> Status {
        for turn in 0..200_000 {
            self.turn(TURN);
            if turn % 100 == 0 {
                self.ask(&Ask::Ping { stamp: 0.0 });
            }
            if what(self.status()) {
                return self.status().clone();
            }
        }
        panic!("waited in vain: {:?}", self.status());
    }

    fn home(&mut self) {
        self.ask(&Ask::Home);
        self.until(|status| matches!(status.state, State::Ready | State::Alarm));
    }

    fn start(&mut self, program: &Program, from_leg: u32) {
        let bytes = program::encode(program);
        let key = program::key(&bytes);
        self.drill.upload(&key, bytes).unwrap();
        self.start_again(&key, from_leg);
    }

    fn start_again(&mut self, key: &str, from_leg: u32) {
        self.ask(&Ask::Arm { job: key.to_owned(), from_leg });
        let armed = self.heard.iter().rev().find_map(|tell| match tell {
            Tell::Armed(ArmedJob { stream_digest, checks, .. }) => {
                Some((stream_digest.clone(), checks.clone()))
            }
            _ => None,
        });
        let (stream_digest, checks) = armed.unwrap();
        assert!(checks.iter().all(|row| row.verdict != RowVerdict::Fail), "{checks:?}");
        self.ask(&Ask::Start { job: key.to_owned(), stream_digest, from_leg });
    }

    /// Confirms every tool change after 30 s, until the job ends.
    fn finish(&mut self) -> (Ending, u32) {
        loop {
            let status = self.until(|status| status.state == State::ToolChange || status.job.is_none());
            if status.state == State::ToolChange {
                (0..30).for_each(|_| self.ping_later(Duration::from_secs(1)));
                assert_eq!(self.status().state, State::ToolChange);
                self.ask(&Ask::ToolChanged);
                continue;
            }
            let ended = self.heard.iter().rev().find_map(|tell| match tell {
                Tell::Ended(JobEnd { ending, holes_done, .. }) => Some((*ending, *holes_done)),
                _ => None,
            });
            return ended.unwrap();
        }
    }

    fn ping_later(&mut self, after: Duration) {
        self.turn(after);
        self.ask(&Ask::Ping { stamp: 0.0 });
    }

    fn offer(&self) -> Option<(String, u32)> {
        self.heard.iter().rev().find_map(|tell| match tell {
            Tell::Interrupted(InterruptedJob { job, next_leg, .. }) => Some((job.clone(), *next_leg)),
            _ => None,
        })
    }

    fn refused(&self) -> Option<&str> {
        self.heard.iter().rev().find_map(|tell| match tell {
            Tell::Refused { why } => Some(why.code.as_str()),
            _ => None,
        })
    }
}

fn holes(count: usize) -> Program {
    drilled::holes(&virtual_drill(), count, 8, |_| 800)
}

fn ready(files: &Memory) -> Bench {
    let mut bench = Bench::open(files);
    bench.home();
    bench.ask(&Ask::SetZero);
    bench.turn(Duration::from_millis(200));
    bench
}

/// A drill in the middle of `program`, with its first tool and at least this many holes.
fn drilling(files: &Memory, program: &Program, holes: u32) -> Bench {
    let mut bench = ready(files);
    bench.start(program, 0);
    bench.until(|status| status.state == State::ToolChange);
    bench.ask(&Ask::ToolChanged);
    bench.until(|status| status.holes_done >= holes);
    bench
}

/// Compares the drilled-board record with the whole program: number of missing holes, and of holes drilled
/// more than once.
fn against(files: &Memory, program: &Program, zero_mm: [f64; 2]) -> (u32, u32) {
    let text = files.clone().read(File::Drilled).unwrap();
    let text = String::from_utf8(text).unwrap();
    let drilled: Vec<_> = text.lines().map(|line| board::drilled(line).unwrap()).collect();
    let found = tally(program, &virtual_drill(), 0..program.legs.len(), zero_mm, &drilled);
    assert_eq!(found.shifted, 0);
    (found.missing, found.doubled)
}

#[test]
fn board_is_drilled_as_programmed() {
    let (files, program) = (Memory::default(), holes(40));
    let mut bench = ready(&files);
    bench.start(&program, 0);
    assert_eq!(bench.finish(), (Ending::Done, 40));
    let status = bench.until(|status| status.state == State::Ready);
    assert_eq!((status.trust, status.spindle_rpm, status.alarm.clone()), (Trust::Trusted, 0, None));
    assert_eq!(against(&files, &program, status.zero_mm.unwrap()), (0, 0));
    assert_eq!(status.drilled.map(|told| (told.missing, told.doubled)), Some((0, 0)));
    // A reopened drill has the zero, and no job.
    let again = Bench::open(&files);
    assert_eq!((again.status().zero_mm, again.offer()), (status.zero_mm, None));
}

#[test]
fn injected_faults_act_and_can_be_cleared() {
    let (files, program) = (Memory::default(), holes(12));
    let mut bench = ready(&files);
    let provoke = |bench: &mut Bench, words: &[&str]| {
        bench.heard.retain(|tell| !matches!(tell, Tell::Refused { .. }));
        bench.ask(&Ask::Provoke { faults: words.iter().map(|word| (*word).to_owned()).collect() });
        bench.turn(Duration::from_millis(200));
        let told = bench.heard.iter().rev().find_map(|tell| match tell {
            Tell::Machine { faults, .. } => Some(faults.clone().unwrap().join(" ")),
            _ => None,
        });
        (told.unwrap(), bench.refused().map(str::to_owned))
    };
    let refused = |code: &str| Some(code.to_owned());
    assert_eq!(provoke(&mut bench, &["broken-bits"]), (String::new(), refused("fault.unknown")));
    assert_eq!(bench.status().trust, Trust::Trusted, "nothing was changed");
    assert_eq!(provoke(&mut bench, &["stuck-switch"]), ("stuck-switch@0".to_owned(), None));
    assert_eq!((bench.status().state, bench.status().trust), (State::NotHomed, Trust::Lost));
    bench.home();
    assert_eq!(bench.status().alarm.as_ref().map(|why| why.code.as_str()), Some("control.sensor_stuck"));
    assert_eq!(provoke(&mut bench, &[]), ("stuck-switch@0".to_owned(), refused("control.alarm_unread")));
    bench.until(|status| status.stage.is_none());
    bench.ask(&Ask::AcknowledgeAlarm);
    assert_eq!(
        provoke(&mut bench, &["broken-bit@3", "bouncing-switch"]),
        ("broken-bit@3 bouncing-switch@0".to_owned(), None)
    );
    bench.home();
    bench.start(&program, 0);
    bench.until(|status| status.state == State::ToolChange);
    assert_eq!(provoke(&mut bench, &[]).1, refused("control.busy"), "a job is in work");
    bench.finish();
    assert_eq!(bench.status().drilled.map(|told| told.missing), Some(9));
    bench.ask(&Ask::AcknowledgeAlarm);
    assert_eq!(provoke(&mut bench, &[]), (String::new(), None));
    bench.home();
    bench.start(&program, 0);
    bench.finish();
    assert_eq!(bench.status().drilled.map(|told| told.missing), Some(0));
}

#[test]
fn stop_in_mid_job_stops_and_the_job_can_be_resumed() {
    let (files, program) = (Memory::default(), holes(30));
    let mut bench = drilling(&files, &program, 9);
    bench.ask(&Ask::Stop);
    let status = bench.until(|status| status.state == State::Ready);
    assert_eq!((status.trust, status.spindle_rpm), (Trust::Trusted, 0));
    let (key, leg) = bench.offer().unwrap();
    bench.start_again(&key, leg);
    assert_eq!(bench.finish().0, Ending::Done);
    let (missing, doubled) = against(&files, &program, status.zero_mm.unwrap());
    assert!(missing == 0 && doubled <= 1, "{missing} missing, {doubled} twice");
}

#[test]
fn closing_at_any_moment_repeats_at_most_one_hole_each_time() {
    let program = holes(16);
    for seed in 0..12 {
        let mut chance = Chance::new(seed);
        let files = Memory::default();
        let mut bench = ready(&files);
        let zero_mm = bench.status().zero_mm.unwrap();
        bench.start(&program, 0);
        let (mut closed, mut done) = (0, false);
        while !done {
            // Every second time, interrupt the page in the middle of a write.
            if closed % 2 == 1 {
                files.0.borrow_mut().left = Some(1 + chance.below(8) as u32);
            }
            for _ in 0..chance.below(400) {
                if bench.status().state == State::ToolChange {
                    bench.ask(&Ask::ToolChanged);
                }
                bench.turn(TURN);
                if files.0.borrow().left == Some(0) {
                    break;
                }
                done |= bench
                    .heard
                    .iter()
                    .any(|tell| matches!(tell, Tell::Ended(JobEnd { ending: Ending::Done, .. })));
            }
            if done && files.0.borrow().left != Some(0) {
                break;
            }
            closed += 1;
            drop(bench);
            files.0.borrow_mut().left = None;
            bench = Bench::open(&files);
            assert_eq!(bench.status().trust, Trust::Lost, "nobody knows where it stands");
            assert_eq!(bench.status().alarm, None, "seed {seed}: one of the slots is whole");
            let Some((key, leg)) = bench.offer() else {
                // The job was complete; only its last record was missing.
                assert!(done, "seed {seed}: forgotten");
                break;
            };
            done = false;
            bench.home();
            assert_eq!(bench.status().zero_mm, Some(zero_mm), "seed {seed}");
            bench.start_again(&key, leg);
        }
        let (missing, doubled) = against(&files, &program, zero_mm);
        assert_eq!(missing, 0, "seed {seed}");
        assert!(doubled <= closed, "seed {seed}: {doubled} twice, closed {closed} times");
    }
}

#[test]
fn hidden_page_loses_only_time() {
    let (files, program) = (Memory::default(), holes(12));
    let mut bench = drilling(&files, &program, 0);
    // Called once a minute: each turn grants only its maximum and control lapses, but the job continues.
    let mut turns = 0;
    while bench.status().job.is_some() {
        bench.turn(Duration::from_secs(60));
        turns += 1;
        assert!(turns < 10_000);
    }
    assert_eq!((bench.status().alarm.clone(), &bench.status().slips), (None, &Vec::new()));
    let done =
        bench.heard.iter().any(|tell| matches!(tell, Tell::Ended(JobEnd { ending: Ending::Done, .. })));
    assert!(done);
    assert_eq!(against(&files, &program, bench.status().zero_mm.unwrap()), (0, 0));
    assert!(
        bench
            .heard
            .iter()
            .any(|tell| matches!(tell, Tell::Control(Control { yours: false, taken: false, .. })))
    );
}

#[test]
fn jog_ends_when_the_page_stops_renewing_it() {
    let mut bench = Bench::open_at(&Memory::default(), 1.0);
    bench.home();
    let from = bench.status().steps[0];
    bench.ask(&Ask::Jog { axis: 0, distance_um: 50_000, anyway: false });
    let status = bench.until(|status| status.state != State::Jogging);
    assert_eq!(status.state, State::Ready);
    let (went, far) = (status.steps[0] - from, virtual_drill().x.scale.steps(Length::from_mm(50.0)));
    assert!(went > 0 && went < far, "{went} of {far}");
}

#[test]
fn full_store_stops_the_job_until_there_is_room() {
    let (files, program) = (Memory::default(), holes(30));
    let mut bench = drilling(&files, &program, 5);
    files.0.borrow_mut().full = true;
    let status = bench.until(|status| status.state == State::Alarm && status.spindle_rpm == 0);
    let code = status.alarm.unwrap().code;
    assert!(["journal.cannot_write", "control.record_unwritable"].contains(&code.as_str()), "{code}");
    files.0.borrow_mut().full = false;
    bench.ask(&Ask::AcknowledgeAlarm);
    bench.until(|status| status.state != State::Alarm);
    let (key, leg) = bench.offer().unwrap();
    bench.start_again(&key, leg);
    assert_eq!(bench.finish().0, Ending::Done);
}

#[test]
fn damaged_journal_is_set_aside_and_reported_until_accepted() {
    let files = Memory::default();
    drop(ready(&files));
    for slot in [File::Slot(false), File::Slot(true)] {
        files.0.borrow_mut().files.insert(slot, b"no journal".to_vec());
    }
    for _ in 0..2 {
        let bench = Bench::open(&files);
        assert_eq!(bench.status().alarm.as_ref().unwrap().code, "journal.damaged");
    }
    assert_eq!(files.clone().read(File::Aside).unwrap(), b"no journalno journal");
    Bench::open(&files).ask(&Ask::AcknowledgeAlarm);
    assert_eq!(Bench::open(&files).status().alarm, None);
}

#[test]
fn settings_are_saved_except_hardware() {
    let files = Memory::default();
    let mut bench = Bench::open(&files);
    let changes = vec![("stroke.feed".to_owned(), Value::Number(9.0))];
    bench.ask(&Ask::Configure { changes });
    assert_eq!(bench.refused(), None);
    let feed = |bench: &Bench| {
        bench.heard.iter().rev().find_map(|tell| match tell {
            Tell::Machine { settings, .. } => {
                settings.iter().find(|(key, _)| key == "stroke.feed").map(|(_, value)| value.clone())
            }
            _ => None,
        })
    };
    assert_eq!(feed(&Bench::open(&files)), Some(Value::Number(9.0)));
    let changes = vec![("machine.output".to_owned(), Value::Text("card".to_owned()))];
    bench.ask(&Ask::Configure { changes });
    assert_eq!(bench.refused(), Some("control.in_file_only"));
}

#[test]
fn rebuilt_machine_must_be_homed() {
    let rows = [
        ("machine.spindles", Value::Number(2.0), true),
        ("motion.corner", Value::Number(0.05), true),
        ("x.max_acceleration", Value::Number(300.0), true),
        ("stroke.feed", Value::Number(9.0), false),
        ("overlap.margin", Value::Number(0.4), false),
        ("spindle.spin_up", Value::Number(1500.0), false),
    ];
    for (key, value, rebuilt) in rows {
        let mut bench = Bench::open(&Memory::default());
        bench.home();
        assert_eq!(bench.status().trust, Trust::Trusted, "{key}");
        bench.ask(&Ask::Configure { changes: vec![(key.to_owned(), value)] });
        assert_eq!(bench.refused(), None, "{key}");
        bench.turn(Duration::from_millis(200));
        assert_eq!(bench.status().trust != Trust::Trusted, rebuilt, "{key}");
    }
}

#[test]
fn requests_without_hello_or_control_are_refused() {
    let mut bench = Bench::open(&Memory::default());
    bench.ask(&Ask::ReleaseControl);
    bench.ask(&Ask::Home);
    assert_eq!(bench.refused(), Some("control.needed"));
    bench.drill.connect();
    bench.ask(&Ask::Home);
    assert_eq!(bench.refused(), Some("socket.first_frame"));
    bench.drill.hear("{");
    bench.turn(Duration::ZERO);
    assert_eq!(bench.refused(), Some("socket.malformed"));
    assert!(bench.drill.upload("00", Vec::new()).is_err());
    assert_eq!(bench.drill.job("00"), None);
}

/// Holes by tool number, from the latest tools report.
fn hits(bench: &Bench) -> Vec<(u32, u64)> {
    let told = bench.heard.iter().rev();
    let mut told = told.filter_map(|tell| if let Tell::Tools(report) = tell { Some(report) } else { None });
    let mut hits: Vec<_> = told.next().unwrap().wear.iter().map(|wear| (wear.number, wear.hits)).collect();
    hits.sort_unstable();
    hits
}

#[test]
fn worn_tool_is_changed_mid_job_and_wear_is_saved() {
    let (files, program) = (Memory::default(), holes(11));
    let mut bench = Bench::open(&files);
    let lines = ["T4 drill 0.8 life 4", "T5 mill 1"].map(str::to_owned).to_vec();
    bench.ask(&Ask::Configure { changes: vec![("rack.tools".to_owned(), Value::Texts(lines))] });
    bench.home();
    bench.ask(&Ask::SetZero);
    bench.start(&program, 0);
    for done in [0, 4] {
        let status = bench.until(|status| status.state == State::ToolChange && status.holes_done == done);
        assert_eq!(status.spindle_rpm, 0);
        bench.ask(&Ask::ToolChanged);
    }
    bench.until(|status| status.holes_done >= 6);
    // The page disappears and another one opens the files, after 4 holes with the first tool and 2 or 3
    // with the second.
    let mut again = Bench::open(&files);
    let (number, before) = hits(&again)[0];
    assert!(number == 4 && (2..=4).contains(&before), "{before}");
    again.home();
    let (key, leg) = again.offer().unwrap();
    again.start_again(&key, leg);
    // The resumed job requests its current tool, then a new one after that tool's fourth hole.
    assert_eq!(again.finish(), (Ending::Done, 11));
    let status = again.until(|status| status.state == State::Ready);
    assert_eq!(against(&files, &program, status.zero_mm.unwrap()).0, 0);
    assert_eq!(hits(&again), [(4, 3)], "4, 4 and 3");
    // The user reports a new tool.
    again.ask(&Ask::NewTool { number: 4 });
    again.turn(Duration::from_millis(200));
    assert_eq!(hits(&again), [(4, 0)]);
    assert_eq!(hits(&Bench::open(&files)), [(4, 0)]);
    again.ask(&Ask::NewTool { number: 1 });
    assert_eq!(again.refused(), Some("control.no_such_tool"));
}
