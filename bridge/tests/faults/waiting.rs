//! Tests of a slow user: half a minute at a tool change, before Start, at an alarm, in a pause. The page is
//! closed and reopened in between. The real `annulus serve`, real sockets, in real time.

use crate::server::client::{Page, Running, annulus};
use crate::server::work::{home, until_status};
use annulus_core::control::{Ending, State, Trust};
use annulus_core::wire::{ArmedJob, Ask, JobEnd, RowVerdict, Status, Tell, program};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};
use tempfile::TempDir;

const PERSON: Duration = Duration::from_secs(30);

const MOMENT: Duration = Duration::from_secs(5);

const BOARD: &str = "M48\nMETRIC\nT1C0.8\nT2C1.0\n%\nT1\nX5.0Y5.0\nX10.0Y5.0\nT2\nX3.0Y3.0\nX8.0Y8.0\nM30\n";

/// Watches for this time and keeps control alive, as an open page does.
fn look_on(page: &mut Page, how_long: Duration) -> Status {
    let since = Instant::now();
    loop {
        let status = until_status(page, |_| true);
        page.ask(&Ask::Ping { stamp: 0.0 });
        if since.elapsed() >= how_long {
            return status;
        }
    }
}

/// A running bridge, its page, and the board's program planned by `annulus plan`.
struct Shop {
    bridge: Running,
    page: Page,
    bytes: Vec<u8>,
}

impl Shop {
    fn new() -> Self {
        Self::at(TempDir::new().unwrap())
    }

    fn at(folder: TempDir) -> Self {
        fs::write(folder.path().join("board.drl"), BOARD).unwrap();
        let path = |name: &str| folder.path().join(name).display().to_string();
        let planned = annulus(&folder, &["plan", &path("board.drl"), "-o", &path("board.program")]).output();
        assert!(planned.unwrap().status.success());
        let bytes = fs::read(folder.path().join("board.program")).unwrap();
        let bridge = Running::start_at(folder, "20");
        let page = bridge.page();
        Self { bridge, page, bytes }
    }

    fn homed() -> Self {
        let mut shop = Self::new();
        home(&mut shop.page);
        shop.page.ask(&Ask::SetZero);
        shop
    }

    fn arm(&mut self) -> (String, String) {
        let job = program::key(&self.bytes);
        let page = (self.page.session.clone(), self.page.key.clone());
        assert_eq!(self.bridge.job((&page.0, &page.1), "PUT", &job, &self.bytes).status, 200);
        self.page.ask(&Ask::Arm { job: job.clone(), from_leg: 0 });
        let armed = self.page.until(|tell| matches!(tell, Tell::Armed(_) | Tell::Refused { .. }));
        let Tell::Armed(ArmedJob { stream_digest, checks, .. }) = armed else { panic!("{armed:?}") };
        assert!(checks.iter().all(|row| row.verdict != RowVerdict::Fail), "{checks:?}");
        (job, stream_digest)
    }

    fn start(&mut self) {
        let (job, stream_digest) = self.arm();
        self.page.ask(&Ask::Start { job, stream_digest, from_leg: 0 });
    }

    /// Waits for the tool change after this many holes, and confirms it at once.
    fn change(&mut self, after_holes: u32) {
        self.until_change(after_holes);
        self.page.ask(&Ask::ToolChanged);
        until_status(&mut self.page, |status| status.state != State::ToolChange);
    }

    fn until_change(&mut self, after_holes: u32) -> Status {
        until_status(&mut self.page, |status| {
            status.alarm.is_some() || status.state == State::ToolChange && status.holes_done == after_holes
        })
    }

    fn done(mut self) {
        let end = self.page.until(|tell| matches!(tell, Tell::Ended(_)));
        assert!(matches!(end, Tell::Ended(JobEnd { ending: Ending::Done, holes_done: 4, .. })), "{end:?}");
        let status = until_status(&mut self.page, |status| status.state != State::Stopping);
        assert_eq!((status.state, status.alarm, status.trust), (State::Ready, None, Trust::Trusted));
    }
}

fn at_a_tool_change() {
    let mut shop = Shop::homed();
    shop.start();
    shop.change(0);
    shop.until_change(2);
    look_on(&mut shop.page, PERSON);
    shop.page.ask(&Ask::ToolChanged);
    shop.done();
}

fn with_the_page_closed_and_opened() {
    let mut shop = Shop::homed();
    shop.start();
    shop.change(0);
    shop.until_change(2);
    let newcomer = {
        let Shop { bridge, page, bytes } = shop;
        drop(page);
        thread::sleep(PERSON);
        let page = bridge.page();
        Shop { bridge, page, bytes }
    };
    let mut shop = newcomer;
    assert!(shop.page.take_control(false));
    let status = until_status(&mut shop.page, |_| true);
    assert_eq!((status.state, status.alarm), (State::ToolChange, None));
    shop.page.ask(&Ask::ToolChanged);
    shop.done();
}

fn before_start() {
    let mut shop = Shop::homed();
    let (job, stream_digest) = shop.arm();
    look_on(&mut shop.page, PERSON);
    shop.page.ask(&Ask::Start { job, stream_digest, from_leg: 0 });
    shop.change(0);
    shop.change(2);
    shop.done();
}

fn in_a_pause() {
    let mut shop = Shop::homed();
    shop.start();
    shop.until_change(0);
    // Requested in a tool change, the pause holds after that leg.
    shop.page.ask(&Ask::ToolChanged);
    shop.page.ask(&Ask::Pause);
    until_status(&mut shop.page, |status| status.state == State::Paused);
    look_on(&mut shop.page, PERSON);
    shop.page.ask(&Ask::Resume);
    shop.change(2);
    shop.done();
}

fn at_an_alarm() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("journal.redb"), [7; 9_000]).unwrap();
    let mut shop = Shop::at(folder);
    let status = look_on(&mut shop.page, PERSON);
    assert_eq!(status.alarm.unwrap().code, "journal.damaged");
    assert!(shop.page.take_control(false));
    shop.page.ask(&Ask::AcknowledgeAlarm);
    until_status(&mut shop.page, |status| status.state == State::NotHomed);
    shop.page.ask(&Ask::Home);
    until_status(&mut shop.page, |status| status.state == State::Ready);
    shop.page.ask(&Ask::SetZero);
    shop.start();
    shop.change(0);
    shop.change(2);
    shop.done();
}

#[test]
fn waits_of_half_a_minute_raise_no_alarm() {
    let rows = [at_a_tool_change, with_the_page_closed_and_opened, before_start, in_a_pause, at_an_alarm];
    let all = rows.map(thread::spawn);
    for (row, ended) in all.into_iter().map(thread::JoinHandle::join).enumerate() {
        assert!(ended.is_ok(), "row {row}");
    }
}

#[test]
fn stop_in_a_tool_change_raises_no_alarm() {
    let mut shop = Shop::homed();
    shop.start();
    shop.change(0);
    shop.until_change(2);
    look_on(&mut shop.page, MOMENT);
    shop.page.ask(&Ask::Stop);
    let end = shop.page.until(|tell| matches!(tell, Tell::Ended(_)));
    assert!(matches!(end, Tell::Ended(JobEnd { ending: Ending::Stopped, holes_done: 2, .. })), "{end:?}");
    let status = until_status(&mut shop.page, |status| status.state != State::Stopping);
    assert_eq!((status.state, status.alarm, status.trust), (State::Ready, None, Trust::Trusted));
}

fn run(home: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
    command.args(["run", "board.drl", "--time-scale", "2000", "--json"]).args(arguments).current_dir(home);
    command.env("ANNULUS_HOME", home.join("home")).stdout(Stdio::piped()).stderr(Stdio::null());
    command
}

#[test]
fn unattended_tool_changes_wait_the_given_seconds() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("board.drl"), BOARD).unwrap();
    let since = Instant::now();
    let output = run(folder.path(), &["--unattended-tool-change", "2.5"]).output().unwrap();
    let object: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((output.status.code(), object["holes_done"].as_u64()), (Some(0), Some(4)), "{object}");
    assert!(since.elapsed() >= Duration::from_secs(5), "two changes of 2.5 s each");
    for wrong in ["-1", "x", "1e9"] {
        let refused = run(folder.path(), &["--unattended-tool-change", wrong]).output().unwrap();
        let object: serde_json::Value = serde_json::from_slice(&refused.stdout).unwrap();
        assert_eq!((refused.status.code(), &object["error"]["code"]), (Some(2), &"cli.usage".into()));
    }
}

#[test]
#[cfg(unix)]
fn interrupt_in_a_tool_change_stops_and_the_job_resumes() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("board.drl"), BOARD).unwrap();
    let mut child = run(folder.path(), &["--unattended-tool-change", "3600"]).spawn().unwrap();
    // The command stops at the start of the job and asks for the first tool.
    while !folder.path().join("home/drilled.txt").exists() {
        assert!(child.try_wait().unwrap().is_none(), "it ended too early");
        thread::sleep(Duration::from_millis(10));
    }
    thread::sleep(MOMENT);
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    let output = child.wait_with_output().unwrap();
    let object: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        (output.status.code(), &object["stopped_because"]),
        (Some(130), &"stopped".into()),
        "{object}"
    );
    assert_eq!(
        (&object["error"]["code"], &object["position_trust"]),
        (&"run.stopped".into(), &"trusted".into())
    );
    let output = run(folder.path(), &[]).output().unwrap();
    let object: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((output.status.code(), object["holes_done"].as_u64()), (Some(0), Some(4)), "{object}");
}
