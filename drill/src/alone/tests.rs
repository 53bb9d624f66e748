//! The drill without threads in a time of its own: nothing here waits, and every run is the same run.

mod clamp;
mod deaths;
mod foot;
mod park;
mod port;
mod refused;
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
use annulus_core::wire::{Ask, RowVerdict, Status, Tell, program};
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

/// Files in memory that outlive a drill. They can be full, and can be torn: the write after so many is half made, and no later
/// one is made at all.
#[derive(Clone, Default)]
struct Memory(Rc<RefCell<Disk>>);

#[derive(Default)]
struct Disk {
    files: BTreeMap<File, Vec<u8>>,
    full: bool,
    left: Option<u32>,
}

impl Disk {
    /// How much of what is to be written is.
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

/// A drill, its page, and what the page heard.
struct Bench {
    drill: Alone<Memory>,
    heard: Vec<Tell>,
    /// What is at its port, where it is no virtual drill.
    world: Option<World>,
}

impl Bench {
    fn open(files: &Memory) -> Self {
        Self::open_at(files, 200.0)
    }

    fn open_at(files: &Memory, speed: f64) -> Self {
        Self::of(Alone::open(files.clone(), speed, 7, now).unwrap(), None)
    }

    /// A page that says hello and takes control.
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

    /// A turn after so long.
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

    /// Takes turns until the status is so; the page lives meanwhile.
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

    /// Brings the program, has it checked, and starts it.
    fn start(&mut self, program: &Program, from_leg: u32) {
        let bytes = program::encode(program);
        let key = program::key(&bytes);
        self.drill.upload(&key, bytes).unwrap();
        self.start_again(&key, from_leg);
    }

    fn start_again(&mut self, key: &str, from_leg: u32) {
        self.ask(&Ask::Arm { job: key.to_owned(), from_leg });
        let armed = self.heard.iter().rev().find_map(|tell| match tell {
            Tell::Armed { stream_digest, checks, .. } => Some((stream_digest.clone(), checks.clone())),
            _ => None,
        });
        let (stream_digest, checks) = armed.unwrap();
        assert!(checks.iter().all(|row| row.verdict != RowVerdict::Fail), "{checks:?}");
        self.ask(&Ask::Start { job: key.to_owned(), stream_digest, from_leg });
    }

    /// Sees to tool changes, each after 30 s, until the job ended.
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
                Tell::Ended { ending, holes_done, .. } => Some((*ending, *holes_done)),
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
            Tell::Interrupted { job, next_leg, .. } => Some((job.clone(), *next_leg)),
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

/// Homed and with its work zero, on these files.
fn ready(files: &Memory) -> Bench {
    let mut bench = Bench::open(files);
    bench.home();
    bench.ask(&Ask::SetZero);
    bench.turn(Duration::from_millis(200));
    bench
}

/// In the middle of `program`, its first bit in, with so many holes at least.
fn drilling(files: &Memory, program: &Program, holes: u32) -> Bench {
    let mut bench = ready(files);
    bench.start(program, 0);
    bench.until(|status| status.state == State::ToolChange);
    bench.ask(&Ask::ToolChanged);
    bench.until(|status| status.holes_done >= holes);
    bench
}

/// What the drilled-board record has against the whole program: holes missing, and drilled more than once.
fn against(files: &Memory, program: &Program, zero_mm: [f64; 2]) -> (u32, u32) {
    let text = files.clone().read(File::Drilled).unwrap();
    let text = String::from_utf8(text).unwrap();
    let drilled: Vec<_> = text.lines().map(|line| board::drilled(line).unwrap()).collect();
    let found = tally(program, &virtual_drill(), 0..program.legs.len(), zero_mm, &drilled);
    assert_eq!(found.shifted, 0);
    (found.missing, found.doubled)
}

#[test]
fn a_board_is_drilled_as_the_program_says_and_a_person_may_be_slow() {
    let (files, program) = (Memory::default(), holes(40));
    let mut bench = ready(&files);
    bench.start(&program, 0);
    assert_eq!(bench.finish(), (Ending::Done, 40));
    let status = bench.until(|status| status.state == State::Ready);
    assert_eq!((status.trust, status.spindle_rpm, status.alarm.clone()), (Trust::Trusted, 0, None));
    assert_eq!(against(&files, &program, status.zero_mm.unwrap()), (0, 0));
    assert_eq!(status.drilled.map(|told| (told.missing, told.doubled)), Some((0, 0)));
    // The next one knows the zero, and of no job.
    let again = Bench::open(&files);
    assert_eq!((again.status().zero_mm, again.offer()), (status.zero_mm, None));
}

#[test]
fn faults_are_provoked_on_demand_and_mended_again() {
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
fn stop_in_mid_job_rests_and_the_job_is_taken_up() {
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
fn closed_at_any_moment_no_hole_is_left_out_and_at_most_one_is_made_twice_each_time() {
    let program = holes(16);
    for seed in 0..12 {
        let mut chance = Chance::new(seed);
        let files = Memory::default();
        let mut bench = ready(&files);
        let zero_mm = bench.status().zero_mm.unwrap();
        bench.start(&program, 0);
        let (mut closed, mut done) = (0, false);
        while !done {
            // Every second time it is in the middle of a write that the page goes.
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
                done |=
                    bench.heard.iter().any(|tell| matches!(tell, Tell::Ended { ending: Ending::Done, .. }));
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
                // It was over, and only its end was still to be said.
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
fn a_page_that_is_hidden_for_long_loses_time_and_nothing_else() {
    let (files, program) = (Memory::default(), holes(12));
    let mut bench = drilling(&files, &program, 0);
    // Called once a minute: no more passes than one turn may have, and control lapses; the job goes on.
    let mut turns = 0;
    while bench.status().job.is_some() {
        bench.turn(Duration::from_secs(60));
        turns += 1;
        assert!(turns < 10_000);
    }
    assert_eq!((bench.status().alarm.clone(), &bench.status().slips), (None, &Vec::new()));
    let done = bench.heard.iter().any(|tell| matches!(tell, Tell::Ended { ending: Ending::Done, .. }));
    assert!(done);
    assert_eq!(against(&files, &program, bench.status().zero_mm.unwrap()), (0, 0));
    assert!(bench.heard.iter().any(|tell| matches!(tell, Tell::Control { yours: false, taken: false, .. })));
}

#[test]
fn a_move_by_hand_rests_when_the_page_says_no_more() {
    let mut bench = Bench::open_at(&Memory::default(), 1.0);
    bench.home();
    let from = bench.status().steps[0];
    bench.ask(&Ask::Jog { axis: 0, distance_um: 50_000 });
    let status = bench.until(|status| status.state != State::Jogging);
    assert_eq!(status.state, State::Ready);
    let (went, far) = (status.steps[0] - from, virtual_drill().x.scale.steps(Length::from_mm(50.0)));
    assert!(went > 0 && went < far, "{went} of {far}");
}

#[test]
fn a_full_store_stops_the_job_with_a_sentence_and_it_goes_on_once_there_is_room() {
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
fn a_journal_that_cannot_be_believed_is_put_aside_and_told_until_it_is_read() {
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
fn settings_stay_and_hardware_is_not_among_them() {
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
fn a_drill_that_is_built_otherwise_must_be_homed_and_no_other() {
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
fn nothing_is_done_for_who_did_not_say_hello_or_has_no_control() {
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

/// What tools have done, by their numbers, as it was told last.
fn hits(bench: &Bench) -> Vec<(u32, u64)> {
    let told = bench.heard.iter().rev();
    let mut told = told.filter_map(|tell| if let Tell::Tools(report) = tell { Some(report) } else { None });
    let mut hits: Vec<_> = told.next().unwrap().wear.iter().map(|wear| (wear.number, wear.hits)).collect();
    hits.sort_unstable();
    hits
}

#[test]
fn a_worn_tool_is_changed_between_two_holes_and_what_tools_did_outlives_the_page() {
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
    // The page goes, and another one comes: 4 of the first, 2 or 3 of the second.
    let mut again = Bench::open(&files);
    let (number, before) = hits(&again)[0];
    assert!(number == 4 && (2..=4).contains(&before), "{before}");
    again.home();
    let (key, leg) = again.offer().unwrap();
    again.start_again(&key, leg);
    // It asks for the bit of the job that is taken up, then for a new one once four holes are made with it.
    assert_eq!(again.finish(), (Ending::Done, 11));
    let status = again.until(|status| status.state == State::Ready);
    assert_eq!(against(&files, &program, status.zero_mm.unwrap()).0, 0);
    assert_eq!(hits(&again), [(4, 3)], "4, 4 and 3");
    // The person says that a new one is in.
    again.ask(&Ask::NewTool { number: 4 });
    again.turn(Duration::from_millis(200));
    assert_eq!(hits(&again), [(4, 0)]);
    assert_eq!(hits(&Bench::open(&files)), [(4, 0)]);
    again.ask(&Ask::NewTool { number: 1 });
    assert_eq!(again.refused(), Some("control.no_such_tool"));
}
