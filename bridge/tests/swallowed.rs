//! Tests of a requested line that the controller never received: it is sent again, and nothing waits
//! forever.

use super::pty::Board;
use serde_json::Value;
use std::fs::{self, File};
use std::io::Write;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const JOB: &str = "G21 G17 G90 G94\nM5\nG0 Z2\nG0 X1 Y1\nM3 S9000\nG0 Z0.5\nG1 Z-0.5 F600\nG0 Z2\nM5\nM2\n";

/// Runs `annulus grbl run` for `job` with these arguments, at a controller that loses this line; `typed`
/// answers its tool request. Returns exit code, text and JSON object; panics if it never ends.
fn run(swallows: &'static [u8], job: &str, words: &[&str], typed: &str) -> (Option<i32>, String, Value) {
    let board = Board::that_swallows(115_200, swallows);
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("job.nc"), job).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
    command.args(["grbl", "run", "job.nc", "--json", "--port", &board.port, "--spin-up", "0"]);
    command.args(["--zero-at", "-100,-100,-20"]).args(words);
    let (said, answer) = (folder.path().join("said.txt"), folder.path().join("answer.json"));
    let heard = || fs::read_to_string(&said).unwrap_or_default();
    command.current_dir(folder.path()).env("ANNULUS_HOME", folder.path().join("home")).stdin(Stdio::piped());
    command.stdout(File::create(&answer).unwrap()).stderr(File::create(&said).unwrap());
    let (mut child, since) = (command.spawn().unwrap(), Instant::now());
    let mut typed = Some(typed);
    let exit = loop {
        if heard().contains("Type:")
            && let Some(typed) = typed.take()
        {
            writeln!(child.stdin.as_mut().unwrap(), "{typed}").unwrap();
        }
        match child.try_wait().unwrap() {
            Some(exit) => break exit.code(),
            None if since.elapsed() > Duration::from_secs(120) => {
                let _ = child.kill();
                panic!("it waits for ever: {}", heard());
            }
            None => std::thread::sleep(Duration::from_millis(20)),
        }
    };
    let object = serde_json::from_str(&fs::read_to_string(&answer).unwrap()).unwrap_or_default();
    (exit, heard(), object)
}

#[test]
fn lost_zero_command_is_sent_again() {
    let words = ["--equal-tool-lengths", "--unattended-tool-change", "0"];
    let (exit, said, object) = run(b"G21G10", JOB, &words, "");
    assert!(said.contains("grbl.answer_missing"), "it was swallowed: {said}");
    assert_eq!((exit, &object["holes_done"]), (Some(0), &1.into()), "{object} {said}");
}

#[test]
fn lost_line_in_a_tool_change_ends_the_job() {
    let job = JOB.replace("M3 S9000", "(MSG, tool 1)\nM0\nM3 S9000");
    for (swallows, typed) in [(&b"G21G10L20P1Z"[..], "zero"), (b"$J=", "z -0.5"), (b"G91G38.2", "probe 5")] {
        let (exit, said, object) = run(swallows, &job, &[], typed);
        assert!(said.contains("grbl.answer_missing"), "it was swallowed: {said}");
        assert_eq!((exit, &object["holes_done"]), (Some(1), &0.into()), "{typed}: {object} {said}");
    }
}
