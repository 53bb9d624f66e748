//! Tests of Ctrl-C before a job has started: it does not start, and the controller is idle, not held, after
//! the command.

use super::pty::Board;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::fs::{self, File};
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

const JOB: &str = "G21 G17 G90 G94\nM5\nG0 Z2\nG0 X1 Y1\nM3 S9000\nG0 Z0.5\nG1 Z-0.5 F600\nG0 Z2\nG0 X21 Y11\nG0 Z0.5\n\
    G1 Z-0.5\nG0 Z2\nM5\nM2\n";
/// Time limit for the command to end, even if the controller must be reset.
const MOST: Duration = Duration::from_secs(30);

/// Runs `annulus grbl` with these arguments and stops it once the controller has received `moment`. Returns
/// exit code, JSON object, and what the controller received later.
fn stopped(board: &Board, words: &str, moment: &str) -> (Option<i32>, Value, String) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("job.nc"), JOB).unwrap();
    let (said, answer) = (folder.path().join("said.txt"), folder.path().join("answer.json"));
    let told = || fs::read_to_string(&said).unwrap_or_default();
    let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
    command.arg("grbl").args(words.split_whitespace()).args(["--port", &board.port, "--json"]);
    command.current_dir(folder.path()).env("ANNULUS_HOME", folder.path().join("home")).stdin(Stdio::null());
    command.stdout(File::create(&answer).unwrap()).stderr(File::create(&said).unwrap());
    let (mut child, mut since, mut before) = (command.spawn().unwrap(), Instant::now(), None);
    let exit = loop {
        let heard = board.heard();
        if before.is_none() && heard.contains(moment) {
            kill_process(Pid::from_child(&child), Signal::INT).unwrap();
            (before, since) = (Some(heard.len()), Instant::now());
        }
        match child.try_wait().unwrap() {
            Some(exit) => break exit.code(),
            None if since.elapsed() > MOST => {
                let _ = child.kill();
                panic!("{words}: never {moment}, or it waits for ever: {}", told());
            }
            None => sleep(Duration::from_millis(2)),
        }
    };
    let before = before.unwrap_or_else(|| panic!("{words} ended before {moment}: {}", told()));
    let object = serde_json::from_str(&fs::read_to_string(&answer).unwrap()).unwrap_or_default();
    (exit, object, board.heard()[before..].to_owned())
}

#[test]
fn stop_before_the_job_prevents_it_and_all_motion() {
    let run = "run job.nc --zero-at -100,-100,-20 --equal-tool-lengths --unattended-tool-change 0";
    let measures = format!("{run} --height-map measure --spacing 5");
    let level = "level job.nc --zero-at -100,-100,-20 --spacing 5 --probe-depth 12";
    let mut wrong = Vec::new();
    for (words, moment, code) in [
        (run, "$H\n", "grbl.not_begun"),
        (run, "G10L2", "grbl.not_begun"),
        (&measures, "G38.3Z", "grbl.not_begun"),
        (level, "$H\n", "level.stopped"),
        (level, "G38.2Z", "level.stopped"),
        (level, "G38.3Z", "level.stopped"),
        ("check job.nc --home", "$H\n", "grbl.check_stopped"),
    ] {
        // The board is at the zero, or 7 mm below the tool's position after homing.
        let board = Board::over(if words == level { |_, _| -8.0 } else { |_, _| -20.0 });
        let (exit, object, behind) = stopped(&board, words, moment);
        let is_told = exit == Some(130) && object["error"]["code"] == code;
        let is_begun = ["M3", "G1X", "G1Z", "$J=", "G38", "$C"].iter().any(|word| behind.contains(word));
        let report = board.report();
        let rests = report.contains("<Idle|") || report.contains("<Alarm|");
        if !is_told || is_begun || !rests {
            wrong.push(format!("{words} {moment:?}: {exit:?} {object} {behind:?} {report}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
