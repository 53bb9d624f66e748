//! Tests of the keys at a terminal while a job runs: pause, resume, slower, faster. Input from a pipe is
//! not taken for keys.

use super::bench::{Bench, ZERO_AT};
use super::firmware::{eventually, instrument};
use super::jobs;
use super::judge::Verdict;
use super::sender::MOST;
use rustix::termios::{LocalModes, OptionalActions, tcgetattr, tcsetattr};
use serialport::{SerialPort, TTYPort};
use std::fs::OpenOptions;
use std::io::Write;
use std::os::unix::fs::OpenOptionsExt;
use std::time::Duration;

/// Keeps the opened terminal from becoming this process's controlling terminal.
const NOT_MINE: i32 = 0o400;

#[test]
fn keys_pause_and_slow_a_job_and_the_terminal_is_restored() {
    let Some(instrument) = instrument() else { return };
    let mut bench = Bench::new(instrument, jobs::board(), &[]);
    let (mut hand, slave) = TTYPort::pair().unwrap();
    let name = slave.name().unwrap();
    let terminal = OpenOptions::new().read(true).write(true).custom_flags(NOT_MINE).open(&name).unwrap();
    let mut modes = tcgetattr(&terminal).unwrap();
    modes.local_modes |= LocalModes::ICANON | LocalModes::ECHO;
    tcsetattr(&terminal, OptionalActions::Now, &modes).unwrap();
    let words = format!("run job.nc {ZERO_AT} --equal-tool-lengths --unattended-tool-change 0.1");
    let sender = bench.desk.start_at(&bench.board, &words, terminal.try_clone().unwrap().into());
    bench.desk.says("Keys: + and -");
    let done = |bench: &Bench, count: u64| {
        eventually("so many sections", MOST, || {
            bench.desk.journal()["done"].as_u64().is_some_and(|done| done >= count)
        });
    };
    done(&bench, 2);
    hand.write_all(b"--+").unwrap();
    bench.desk.says("Feed override: 90 %.");
    hand.write_all(b"[r").unwrap();
    bench.desk.says("Spindle override: 90 %.");
    bench.desk.says("Rapid override: 50 %.");
    hand.write_all(b" ").unwrap();
    bench.desk.says("Pause.");
    bench.board.rests();
    let before = bench.board.snapshot()["edges_total"].clone();
    std::thread::sleep(Duration::from_millis(700));
    assert_eq!(bench.board.snapshot()["edges_total"], before, "it is paused");
    hand.write_all(b"0 ").unwrap();
    bench.desk.says("Resume.");
    bench.desk.says("Rapid override: 100 %.");
    let (exit, object) = bench.desk.answer(sender);
    assert_eq!(exit, 0, "{object} {}", bench.desk.said());
    let modes = tcgetattr(&terminal).unwrap().local_modes;
    assert!(modes.contains(LocalModes::ICANON | LocalModes::ECHO), "{modes:?}");
    assert_eq!(bench.judged().0, Verdict::default());
}

#[test]
fn tool_change_takes_typed_lines_at_a_terminal() {
    let Some(instrument) = instrument() else { return };
    let bench = Bench::new(instrument, jobs::board(), &[]);
    let (mut hand, slave) = TTYPort::pair().unwrap();
    let name = slave.name().unwrap();
    let terminal = OpenOptions::new().read(true).write(true).custom_flags(NOT_MINE).open(&name).unwrap();
    let sender = bench.desk.start_at(
        &bench.board,
        &format!("run job.nc {ZERO_AT} --equal-tool-lengths"),
        terminal.into(),
    );
    bench.desk.says("Type: ");
    // Here, keys of a running job are normal characters of a line.
    hand.write_all(b"wobble -\n").unwrap();
    bench.desk.says("Type x, y or z and mm; zero; probe; or go.");
    hand.write_all(b"gp\x7fo\n").unwrap();
    eventually("the first hole", MOST, || bench.desk.journal()["holes"].as_u64() > Some(0));
    sender.stop();
    let (exit, object) = bench.desk.answer(sender);
    assert_eq!(exit, 130, "{object} {}", bench.desk.said());
}

#[test]
fn input_from_a_pipe_is_not_read_as_keys() {
    let Some(instrument) = instrument() else { return };
    let bench = Bench::new(instrument, jobs::board(), &[]);
    let words = format!("run job.nc {ZERO_AT} --equal-tool-lengths --unattended-tool-change 0.1");
    let mut sender = bench.desk.start(&bench.board, &words);
    eventually("two sections", MOST, || bench.desk.journal()["done"].as_u64() >= Some(2));
    sender.types("---");
    sender.types(" ");
    let (exit, object) = bench.desk.answer(sender);
    assert_eq!(exit, 0, "{object} {}", bench.desk.said());
    let said = bench.desk.said();
    assert!(!said.contains("override:") && !said.contains("Pause") && !said.contains("Keys:"), "{said}");
}
