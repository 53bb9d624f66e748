//! A line of a person's wish that a controller never heard: what was asked for is asked for again, and nobody waits for ever.

use super::pty::Board;
use serde_json::Value;
use std::fs::{self, File};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const JOB: &str = "G21 G17 G90 G94\nM5\nG0 Z2\nG0 X1 Y1\nM3 S9000\nG0 Z0.5\nG1 Z-0.5 F600\nG0 Z2\nM5\nM2\n";

#[test]
fn a_zero_that_was_not_heard_is_set_again() {
    let board = Board::that_swallows(115_200, b"G21G10");
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("job.nc"), JOB).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
    command.args(["grbl", "run", "job.nc", "--json", "--port", &board.port, "--spin-up", "0"]);
    command.args(["--zero-at", "-100,-100,-20", "--same-length", "--confirm-tools", "0"]);
    let said = folder.path().join("said.txt");
    let answer = folder.path().join("answer.json");
    command.current_dir(folder.path()).env("ANNULUS_HOME", folder.path().join("home")).stdin(Stdio::null());
    command.stdout(File::create(&answer).unwrap()).stderr(File::create(&said).unwrap());
    let (mut child, since) = (command.spawn().unwrap(), Instant::now());
    let exit = loop {
        match child.try_wait().unwrap() {
            Some(exit) => break exit.code(),
            None if since.elapsed() > Duration::from_secs(120) => {
                let _ = child.kill();
                panic!("it waits for ever: {}", fs::read_to_string(&said).unwrap());
            }
            None => std::thread::sleep(Duration::from_millis(20)),
        }
    };
    let (said, answer) = (fs::read_to_string(&said).unwrap(), fs::read_to_string(&answer).unwrap());
    let object: Value = serde_json::from_str(&answer).unwrap_or_default();
    assert!(said.contains("grbl.answer_missing"), "it was swallowed: {said}");
    assert_eq!((exit, &object["holes_done"]), (Some(0), &1.into()), "{object} {said}");
}
