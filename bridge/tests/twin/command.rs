//! Tests of `annulus run` on a machine on a card. The twin at its wires judges the holes.

use super::{SPINDLE, Twin, driven, number, text, wired};
use crate::server::client::PATIENCE;
use crate::server::drill;
use annulus_core::geometry::Point;
use annulus_core::job::{Bit, Command, Cutter, Leg, Mark, Program};
use annulus_core::machine::{Machine, Value};
use annulus_core::units::Length;
use annulus_core::virtual_drill::Faults;
use annulus_core::wire::program;
use rustix::termios::{LocalModes, OptionalActions, tcgetattr, tcsetattr};
use serialport::{SerialPort, TTYPort};
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::os::unix::fs::OpenOptionsExt;
use std::process::{Child, Stdio};
use std::thread;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Keeps the opened terminal from becoming this process's controlling terminal.
const NOT_MINE: i32 = 0o400;
/// Longest wait for a message; homing takes long on a busy computer.
const MOST: Duration = Duration::from_secs(3 * PATIENCE.as_secs());

/// Steps per mm of Z for a probe: a step of 0.1 mm into the board breaks a tool that stands still.
const FINE: f64 = 40.0;

/// Holes 3 mm apart, the second with another tool.
fn two_tools(machine: &Machine, holes: u32) -> Program {
    let at = (0..holes).map(|hole| Point::from_mm(f64::from(hole) * 3.0, 1.0));
    let mut program = drill::holes(machine, vec![drill::spin_up(50_000)], (at, 10_000), drill::back());
    let diameter = Length::from_um(1_000);
    let name = "1.0 mm".to_owned();
    program.bits.push(Bit { diameter, name, cutter: Cutter::Drill, handling: Default::default() });
    let commands = vec![
        Command::Spindle { rpm: 0 },
        Command::AwaitBit { bit: 1 },
        Command::Spindle { rpm: 20_000 },
        Command::Dwell { us: 50_000 },
    ];
    program.legs.insert(2, Leg { mark: Mark::ToolChange(1), commands });
    program
}

/// A command at a terminal; killed at the end of the test.
struct Typist(Child);

impl Drop for Typist {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A machine on a card, and a board of two holes.
struct Desk {
    home: TempDir,
    machine: Machine,
    twin: Twin,
}

impl Desk {
    fn new(more: &[(&'static str, Value)]) -> Self {
        let (home, machine, _, twin) = wired(more, Faults::default());
        let desk = Self { home, machine, twin };
        desk.save("board", 2);
        desk
    }

    fn save(&self, name: &str, holes: u32) {
        let bytes = program::encode(&two_tools(&self.machine, holes));
        fs::write(self.home.path().join(name), bytes).unwrap();
    }

    fn command(&self, words: &str) -> std::process::Command {
        let words: Vec<_> = words.split_whitespace().chain(["--json"]).collect();
        let mut command = driven(&self.home, &words);
        command.current_dir(self.home.path()).stdin(Stdio::null());
        command
    }

    fn run(&self, words: &str) -> (i32, serde_json::Value, String) {
        self.annulus(&format!("run --machine card.toml {words}"))
    }

    fn annulus(&self, words: &str) -> (i32, serde_json::Value, String) {
        let output = self.command(words).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        let object = serde_json::from_slice(&output.stdout).unwrap_or_default();
        (output.status.code().unwrap_or(-1), object, said)
    }

    /// Positions of the holes, in tenths of a millimetre of machine coordinates.
    fn holes(&self) -> Vec<[i64; 2]> {
        let holes = self.twin.seen.lock().unwrap().holes();
        holes.iter().map(|hole| [hole.x_mm, hole.y_mm].map(|mm| (mm * 10.0).round() as i64)).collect()
    }

    /// Starts `run` with more words at a new terminal. `said.txt` receives its messages.
    fn at_a_terminal(&self, words: &str) -> (Typist, TTYPort) {
        let (hand, slave) = TTYPort::pair().unwrap();
        let name = slave.name().unwrap();
        let terminal = OpenOptions::new().read(true).write(true).custom_flags(NOT_MINE).open(&name).unwrap();
        let mut modes = tcgetattr(&terminal).unwrap();
        modes.local_modes |= LocalModes::ICANON | LocalModes::ISIG;
        tcsetattr(&terminal, OptionalActions::Now, &modes).unwrap();
        let at = |name: &str| File::create(self.home.path().join(name)).unwrap();
        let mut command = self.command(&format!("run --machine card.toml {words}"));
        command.stdin(terminal).stdout(at("answer.json")).stderr(at("said.txt"));
        (Typist(command.spawn().unwrap()), hand)
    }

    fn said(&self) -> String {
        fs::read_to_string(self.home.path().join("said.txt")).unwrap()
    }

    /// Waits until `said.txt` contains `text` this many times.
    fn says(&self, text: &str, count: usize) {
        let since = Instant::now();
        loop {
            let said = self.said();
            if said.matches(text).count() >= count {
                return;
            }
            assert!(since.elapsed() < MOST, "{text}: never, but {said}");
            thread::sleep(Duration::from_millis(20));
        }
    }
}

#[test]
fn run_drills_a_board_on_a_card() {
    let desk = Desk::new(&[]);
    let (exit, object, said) = desk.run("board --zero-at 2,3 --yes --unattended-tool-change 0");
    assert_eq!((exit, &object["driven_by"]), (0, &"card".into()), "{object} {said}");
    assert_eq!((&object["holes_done"], &object["position_trust"]), (&2.into(), &"trusted".into()));
    assert_eq!(object["resume_with"], serde_json::Value::Null);
    assert!(said.contains("Card: 2 holes drilled."), "{said}");
    assert_eq!(desk.holes(), [[20, 40], [50, 40]]);
    // The zero is saved for the next board.
    let (exit, object, said) = desk.run("board --yes --unattended-tool-change 0");
    assert_eq!(exit, 0, "{object} {said}");
    assert_eq!(desk.holes()[2..], [[20, 40], [50, 40]]);
}

#[test]
fn run_on_a_card_needs_zero_and_consent() {
    let desk = Desk::new(&[]);
    let stands = desk.twin.seen.lock().unwrap().drill.real();
    for (words, exit, code) in [
        ("board", 2, "run.needs_yes"),
        ("board --zero-at 2,3", 2, "run.needs_yes"),
        ("board --yes", 1, "run.no_zero"),
        ("board --yes --zero-here", 2, "run.zero_here_homes"),
        ("board --yes --zero-at 2,3,-8", 2, "run.zero_at_plane"),
        ("board --yes --zero-at 2,99", 2, "run.zero_outside"),
        ("board --yes --zero-at 2,3 --probe-depth 3", 2, "run.flag_of_controller"),
        ("board --yes --zero-at 2,3 --fault broken-bit", 2, "run.fault_is_virtual"),
        ("board --yes --zero-at 2,3 --speed 3", 2, "control.speed_is_real"),
    ] {
        let (found, object, said) = desk.run(words);
        assert_eq!((found, &object["error"]["code"]), (exit, &code.into()), "{words}: {object} {said}");
    }
    assert_eq!(desk.twin.seen.lock().unwrap().drill.real(), stands);
}

#[test]
fn tool_change_without_a_terminal_ends_with_the_resume_line() {
    let desk = Desk::new(&[]);
    desk.save("other", 3);
    let (exit, object, said) = desk.run("board --zero-at 2,3 --yes");
    assert_eq!((exit, &object["error"]["code"]), (1, &"run.tool_unattended".into()), "{object} {said}");
    assert_eq!((&object["holes_done"], desk.holes().len()), (&1.into(), 1));
    assert_eq!(desk.twin.seen.lock().unwrap().bytes[3] & SPINDLE, 0, "the spindle is off");
    let line = object["resume_with"].as_str().unwrap();
    assert_eq!(line, "annulus run --machine card.toml board --yes --json");
    assert!(said.contains(&format!("To resume the job: {line}")), "{said}");

    let (exit, object, _) = desk.run("other --yes");
    assert_eq!((exit, &object["error"]["code"]), (1, &"run.forgets".into()), "{object}");
    let (exit, object, _) = desk.run("board --yes --zero-at 2,3");
    assert_eq!((exit, &object["error"]["code"]), (1, &"run.zero_of_interrupted".into()), "{object}");

    let words = line.trim_start_matches("annulus ").trim_end_matches(" --json");
    let (exit, object, said) = desk.annulus(&format!("{words} --unattended-tool-change 0"));
    assert_eq!((exit, &object["holes_done"]), (0, &2.into()), "{object} {said}");
    assert!(said.contains("interrupted after 1 hole"), "{said}");
    assert_eq!(desk.holes(), [[20, 40], [50, 40]]);
}

#[test]
fn terminal_confirms_motion_and_measures_tools() {
    let desk = Desk::new(&[("change.lengths", text("touch"))]);
    let stands = desk.twin.seen.lock().unwrap().drill.real();
    let (mut child, mut hand) = desk.at_a_terminal("board --zero-at 2,3");
    desk.says("Press Enter to move the machine", 1);
    thread::sleep(Duration::from_millis(500));
    assert_eq!(desk.twin.seen.lock().unwrap().drill.real(), stands, "nothing moves before the answer");
    hand.write_all(b"\n").unwrap();
    let (since, mut is_asked) = (Instant::now(), false);
    while !desk.said().contains("must not cut yet") {
        assert!(since.elapsed() < MOST, "{}", desk.said());
        // The pre-flight may have warnings.
        if !is_asked && desk.said().contains("Press Enter to start the job") {
            hand.write_all(b"\n").unwrap();
            is_asked = true;
        }
        thread::sleep(Duration::from_millis(20));
    }
    let mut types = |typed: &str, says: &str, count: usize| {
        hand.write_all(typed.as_bytes()).unwrap();
        desk.says(says, count);
    };
    types("\n", "(control.length_first)", 1);
    types("fly\n", "Commands: x, y or z", 1);
    // No tool was measured yet.
    types("same\n", "(control.no_length_yet)", 1);
    let z_mm = desk.machine.z.scale.length(desk.twin.seen.lock().unwrap().drill.real()[2]).mm();
    types(&format!("z {:.3}\n", desk.machine.process.surface.mm() - z_mm), "must not cut yet", 2);
    types("zero\n", "the machine moves back and the spindle starts", 1);
    types("\n", "must not cut yet", 3);
    assert_eq!(desk.holes().len(), 1, "the second tool is requested after the first hole");
    types("same\n", "the machine moves back and the spindle starts", 2);
    types("\n", "Card: 2 holes drilled.", 1);
    assert_eq!(child.0.wait().unwrap().code(), Some(0));
    assert_eq!(desk.holes(), [[20, 40], [50, 40]]);
}

#[test]
fn typed_probe_measures_a_tool() {
    let desk = Desk::new(&[("change.lengths", text("touch")), ("z.scale", number(FINE))]);
    let (mut child, mut hand) = desk.at_a_terminal("board --zero-at 2,3 --yes");
    desk.says("must not cut yet", 1);
    hand.write_all(b"p 12\n").unwrap();
    desk.says("the machine moves back and the spindle starts", 1);
    hand.write_all(b"\n").unwrap();
    desk.says("must not cut yet", 2);
    assert_eq!(desk.holes().len(), 1, "the second tool is requested after the first hole");
    hand.write_all(b"p 12\n").unwrap();
    desk.says("the machine moves back and the spindle starts", 2);
    hand.write_all(b"\n").unwrap();
    desk.says("Card: 2 holes drilled.", 1);
    assert_eq!(child.0.wait().unwrap().code(), Some(0));
    assert_eq!(desk.holes(), [[20, 40], [50, 40]]);
}

#[test]
fn level_and_queue_drive_a_card_after_consent() {
    let desk = Desk::new(&[("z.scale", number(FINE))]);
    let corners = [(0.0, 0.0), (6.0, 0.0), (6.0, 6.0), (0.0, 6.0)];
    let at = corners.into_iter().map(|(x, y)| Point::from_mm(x, y));
    let square = drill::holes(&desk.machine, vec![drill::spin_up(50_000)], (at, 10_000), drill::back());
    fs::write(desk.home.path().join("square"), program::encode(&square)).unwrap();
    let queue = "SPINDLE 20000\nMOVE_TO 3 4\nDRILL_DOWN\nDRILL_UP\n";
    fs::write(desk.home.path().join("queue.txt"), queue).unwrap();
    let stands = desk.twin.seen.lock().unwrap().drill.real();
    let level = "level --machine card.toml square --spacing 3 --margin 0.5";
    let run = "queue run --machine card.toml queue.txt";
    for (words, exit, code) in [
        (level.to_owned(), 2, "run.needs_yes"),
        (run.to_owned(), 2, "run.needs_yes"),
        (format!("{level} --yes"), 1, "run.no_zero"),
        (format!("{level} --yes --zero-at 2,99"), 2, "run.zero_outside"),
        (format!("{level} --yes --zero-at 2,3 --fault late"), 2, "run.fault_is_virtual"),
        (format!("{run} --yes --fault late"), 2, "run.fault_is_virtual"),
    ] {
        let (found, object, said) = desk.annulus(&words);
        assert_eq!((found, &object["error"]["code"]), (exit, &code.into()), "{words}: {object} {said}");
    }
    assert_eq!(desk.twin.seen.lock().unwrap().drill.real(), stands, "nothing moved");

    let (exit, object, said) = desk.annulus(&format!("{level} --yes --zero-at 2,3"));
    assert_eq!((exit, &object["columns"], &object["rows"]), (0, &3.into(), &3.into()), "{object} {said}");
    let (exit, object, said) = desk.run("square --yes --height-map saved");
    assert_eq!((exit, &object["holes_done"]), (0, &4.into()), "{object} {said}");
    assert_eq!(desk.holes(), [[20, 30], [80, 30], [80, 90], [20, 90]]);

    let (exit, object, said) = desk.annulus(&format!("{run} --yes"));
    assert_eq!(
        (exit, &object["ended"], &object["rows_done"]),
        (0, &"done".into(), &4.into()),
        "{object} {said}"
    );
    assert_eq!(desk.holes().len(), 5);
}
