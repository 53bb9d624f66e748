//! Tests of a command that is suspended during a job, or moved to the background: after a while it must
//! neither continue unasked nor freeze. Also tests what it prints if the controller hangs.

use super::progress::progress;
use super::pty::Board;
use rustix::process::{Pid, Signal, kill_process};
use rustix::termios::{LocalModes, OptionalActions, tcgetattr, tcsetattr};
use serde_json::Value;
use serialport::{SerialPort, TTYPort};
use std::fmt::Write as _;
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Keeps the opened terminal from becoming this process's controlling terminal.
const NOT_MINE: i32 = 0o400;
const MOST: Duration = Duration::from_secs(90);

/// A user at a terminal, a controller, and a job of a dozen holes.
struct Desk {
    board: Board,
    folder: tempfile::TempDir,
    hand: TTYPort,
    terminal: File,
}

impl Desk {
    fn new() -> Self {
        Self::at(Board::at(115_200))
    }

    fn at(board: Board) -> Self {
        let mut job = "G21 G17 G90 G94\nM5\nG0 Z2\nG0 X1 Y1\n(MSG, tool 1)\nM0\nM3 S9000\n".to_owned();
        for hole in 0..12 {
            let _ = write!(job, "G0 X{} Y{}\nG0 Z0.5\nG1 Z-0.5 F120\nG0 Z2\n", hole % 4 * 9, hole / 4 * 9);
        }
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("job.nc"), job + "M5\nM2\n").unwrap();
        let (hand, slave) = TTYPort::pair().unwrap();
        let name = slave.name().unwrap();
        let terminal = OpenOptions::new().read(true).write(true).custom_flags(NOT_MINE).open(&name).unwrap();
        let mut modes = tcgetattr(&terminal).unwrap();
        modes.local_modes |= LocalModes::ICANON | LocalModes::ECHO | LocalModes::ISIG;
        tcsetattr(&terminal, OptionalActions::Now, &modes).unwrap();
        Self { board, folder, hand, terminal }
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    /// The command line that runs the job on a machine that homes.
    fn run(&self) -> String {
        self.run_with("--zero-at -100,-100,-20")
    }

    fn run_with(&self, flags: &str) -> String {
        let annulus = env!("CARGO_BIN_EXE_annulus");
        format!("{annulus} grbl run job.nc --json --port {} --spin-up 0 {flags}", self.board.port)
    }

    /// Starts this shell command; `own` gives it its own terminal with job control.
    fn starts(&self, words: &str, own: bool) -> Child {
        let mut command = Command::new(if own { "setsid" } else { "sh" });
        if own {
            command.args(["--ctty", "--wait", "sh"]);
        }
        let at = |name: &str| File::create(self.path().join(name)).unwrap();
        command.args(["-c", words]).current_dir(self.path()).env("ANNULUS_HOME", self.path().join("home"));
        command.stdin(Stdio::from(self.terminal.try_clone().unwrap()));
        command.stdout(at("answer.json")).stderr(at("said.txt")).spawn().unwrap()
    }

    fn said(&self) -> String {
        fs::read_to_string(self.path().join("said.txt")).unwrap_or_default()
    }

    fn until(&self, what: &str, mut so: impl FnMut() -> bool) {
        let since = Instant::now();
        while !so() {
            assert!(since.elapsed() < MOST, "{what}: never, but {} {}", self.said(), self.board.report());
            sleep(Duration::from_millis(10));
        }
    }

    fn heard_count(&self, text: &str) -> usize {
        self.board.heard().matches(text).count()
    }

    fn says(&self, text: &str) {
        self.until(text, || self.said().contains(text));
    }

    fn types(&mut self, text: &str) {
        self.hand.write_all(text.as_bytes()).unwrap();
    }

    fn holes(&self) -> u64 {
        progress(&self.path().join("home"))["holes"].as_u64().unwrap_or_default()
    }

    fn drills(&self, holes: u64) {
        self.until("so many holes", || self.holes() >= holes);
    }

    fn is_held(&self) {
        let report = self.board.report();
        sleep(Duration::from_millis(700));
        assert!(report.contains("<Hold:0|"), "{report}");
        assert_eq!(self.board.report().split('|').nth(1), report.split('|').nth(1));
    }

    /// Waits until a command ends with exit code 1, and returns its answer.
    fn fails(&self, mut child: Child) -> Value {
        let mut exit = None;
        self.until("its end", || {
            exit = child.try_wait().unwrap();
            exit.is_some()
        });
        let answer = fs::read_to_string(self.path().join("answer.json")).unwrap();
        assert_eq!(exit.and_then(|exit| exit.code()), Some(1), "{answer} {}", self.said());
        serde_json::from_str(&answer).unwrap()
    }

    /// Checks the exit code of the shell and that every hole is done.
    fn is_done(&self, mut child: Child) {
        let mut exit = None;
        self.until("its end", || {
            exit = child.try_wait().unwrap();
            exit.is_some()
        });
        let answer = fs::read_to_string(self.path().join("answer.json")).unwrap();
        let line = answer.lines().find(|line| line.starts_with('{')).unwrap_or_default();
        let object: Value = serde_json::from_str(line).unwrap_or_default();
        assert_eq!(
            (exit.and_then(|exit| exit.code()), &object["holes_done"]),
            (Some(0), &12.into()),
            "{answer} {}",
            self.said()
        );
    }
}

/// Suspends a command for longer than it may continue by itself.
fn stands_still(child: &Child) {
    let process = Pid::from_child(child);
    kill_process(process, Signal::STOP).unwrap();
    sleep(Duration::from_secs(5));
    kill_process(process, Signal::CONT).unwrap();
}

#[test]
fn suspended_command_holds_its_job_until_resumed_by_key() {
    let mut desk = Desk::new();
    let words = format!("exec {} --equal-tool-lengths --unattended-tool-change 0", desk.run());
    let child = desk.starts(&words, false);
    desk.drills(2);
    stands_still(&child);
    desk.says("(grbl.command_stood)");
    desk.until("a hold", || desk.board.report().contains("<Hold:0|"));
    desk.is_held();
    desk.types(" ");
    desk.says("Resume.");
    desk.is_done(child);
    assert_eq!(desk.said().matches("(grbl.command_stood)").count(), 1);
}

#[test]
fn held_job_without_a_terminal_ends_with_the_resume_command() {
    let desk = Desk::new();
    let words =
        format!("exec {} --equal-tool-lengths --unattended-tool-change 0 --yes < /dev/null", desk.run());
    let child = desk.starts(&words, false);
    desk.drills(2);
    stands_still(&child);
    let object = desk.fails(child);
    assert_eq!(object["error"]["code"], "grbl.held_unattended", "{object} {}", desk.said());
    assert_eq!(object["resume_with"], format!("annulus grbl resume --port {}", desk.board.port));
    assert!(desk.said().contains("(grbl.command_stood)") && desk.said().contains("annulus grbl resume"));
    assert!(desk.said().contains("The spindle restarts without a question"), "{}", desk.said());
}

/// Runs the job from a pipe with `flags`, opens the door once `so`, and gives the answer.
fn with_open_door(desk: &Desk, flags: &str, so: impl Fn() -> bool) -> Value {
    let words = format!("exec {} --unattended-tool-change 0 --yes {flags} < /dev/null", desk.run());
    let child = desk.starts(&words, false);
    desk.until("the moment", so);
    desk.board.opens_door();
    desk.fails(child)
}

/// Flags of a job without a user, and no input.
const ALONE: &str = "--equal-tool-lengths --unattended-tool-change 0 --yes < /dev/null";

#[test]
fn frozen_controller_ends_the_job_with_the_resume_command() {
    for (homes, zero, first) in [
        (true, "--zero-at -100,-100,-20", "Resuming homes the machine first"),
        (false, "--zero-here", "Jog the tool to X, Y and Z zero of the board"),
    ] {
        let desk = Desk::at(Board::that_homes(homes));
        let child = desk.starts(&format!("exec {} {ALONE}", desk.run_with(zero)), false);
        desk.drills(2);
        desk.board.freezes();
        let object = desk.fails(child);
        let (code, trust) = (&object["error"]["code"], &object["position_trust"]);
        assert_eq!((code, trust), (&"grbl.no_answer".into(), &"lost".into()), "{object}");
        let (line, said) = (object["resume_with"].as_str().unwrap(), desk.said());
        assert!(said.contains(line) && said.contains(first), "{said}");
    }
}

#[test]
fn each_warning_about_the_machine_is_printed_once() {
    let desk = Desk::at(Board::lets_go_after(25.0));
    let words = format!("exec {} --machine genmitsu-3018-pro {ALONE}", desk.run());
    desk.is_done(desk.starts(&words, false));
    for warning in ["turns the motors off 25 ms", "does not notice if a tool breaks"] {
        assert_eq!(desk.said().matches(warning).count(), 1, "{warning}: {}", desk.said());
    }
}

#[test]
fn open_door_without_a_terminal_ends_the_job() {
    let desk = Desk::new();
    let object = with_open_door(&desk, "--equal-tool-lengths", || desk.holes() >= 2);
    assert_eq!(object["error"]["code"], "grbl.held_unattended", "{object} {}", desk.said());
    assert_eq!(object["resume_with"], format!("annulus grbl resume --port {}", desk.board.port));
    assert!(desk.heard_count("\u{18}") > 0, "a reset switches the spindle off");
    assert!(desk.said().contains("annulus grbl resume"), "{}", desk.said());
}

#[test]
fn open_door_while_a_tool_is_probed_ends_the_job() {
    let desk = Desk::new();
    let object = with_open_door(&desk, "--probe-depth 10", || desk.heard_count("G38.2") > 0);
    assert_eq!(object["error"]["code"], "grbl.held_unattended", "{object} {}", desk.said());
    assert!(object["resume_with"].is_string(), "{object}");
}

#[test]
fn suspended_unattended_tool_change_holds_the_job() {
    let mut desk = Desk::new();
    let words = format!("exec {} --equal-tool-lengths --unattended-tool-change 2", desk.run());
    let child = desk.starts(&words, false);
    desk.says("Tool 1\n");
    stands_still(&child);
    desk.says("(grbl.command_stood)");
    desk.until("a hold", || desk.board.report().contains("<Hold:0|"));
    desk.is_held();
    desk.types(" ");
    desk.is_done(child);
}

#[test]
fn suspended_tool_change_continues_with_go() {
    let mut desk = Desk::new();
    let child = desk.starts(&format!("exec {} --equal-tool-lengths", desk.run()), false);
    desk.says("Type: ");
    stands_still(&child);
    desk.types("go\n");
    desk.is_done(child);
    assert!(!desk.said().contains("(grbl.command_stood)"), "{}", desk.said());
}

#[test]
fn job_moved_to_the_background_continues() {
    let mut desk = Desk::new();
    let words = format!(
        "set -m; {} --equal-tool-lengths --unattended-tool-change 0; stty sane; bg %1; wait %1",
        desk.run()
    );
    let child = desk.starts(&words, true);
    desk.drills(2);
    desk.types("\x1a");
    desk.is_done(child);
}

#[test]
fn job_back_in_the_foreground_reads_its_keys() {
    let mut desk = Desk::new();
    let waits = "while [ ! -f go ]; do sleep 0.1; done";
    let words = format!(
        "set -m; {} --equal-tool-lengths --unattended-tool-change 0; stty sane; bg %1; {waits}; fg %1",
        desk.run()
    );
    let child = desk.starts(&words, true);
    desk.drills(2);
    desk.types("\x1a");
    sleep(Duration::from_secs(2));
    fs::write(desk.path().join("go"), "").unwrap();
    sleep(Duration::from_secs(1));
    desk.types(" ");
    desk.says("Pause.");
    desk.until("a hold", || desk.board.report().contains("<Hold:0|"));
    desk.is_held();
    desk.types(" ");
    desk.is_done(child);
}

#[test]
fn job_started_in_the_background_is_answered_in_foreground() {
    let mut desk = Desk::new();
    let waits = "while [ ! -f go ]; do sleep 0.1; done";
    let words = format!("set -m; {} --equal-tool-lengths & {waits}; fg %1", desk.run());
    let child = desk.starts(&words, true);
    desk.says("Type: ");
    fs::write(desk.path().join("go"), "").unwrap();
    sleep(Duration::from_secs(1));
    desk.types("go\n");
    desk.is_done(child);
}
