//! Runs `annulus grbl` as a separate process, always waiting for its end, within a limit.

use super::firmware::{Board, SPEED};
use super::progress::progress;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::fs::{self, File};
use std::io::Write;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

pub(crate) const MOST: Duration = Duration::from_secs(300);

/// A folder with a job, and the product's files.
pub(crate) struct Desk {
    folder: tempfile::TempDir,
}

impl Desk {
    pub(crate) fn new(text: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("job.nc"), text).unwrap();
        Self { folder }
    }

    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }

    pub(crate) fn journal(&self) -> Value {
        progress(&self.path().join("home"))
    }

    pub(crate) fn start(&self, board: &Board, words: &str) -> Sender {
        self.start_at(board, words, Stdio::piped())
    }

    pub(crate) fn start_at(&self, board: &Board, words: &str, typed: Stdio) -> Sender {
        let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
        command.arg("grbl").args(words.split_whitespace()).arg("--port").arg(board.port()).arg("--json");
        if !words.starts_with("info") {
            command.args(["--time-scale", &SPEED.to_string()]);
        }
        // A resumed job has it from its start.
        if !["info", "check", "resume"].iter().any(|word| words.starts_with(word)) {
            command.args(["--spin-up", "0.2"]);
        }
        let out = |name: &str| File::create(self.path().join(name)).unwrap();
        let child = command
            .current_dir(self.path())
            .env("ANNULUS_HOME", self.path().join("home"))
            .stdin(typed)
            .stdout(out("answer.json"))
            .stderr(out("said.txt"))
            .spawn()
            .unwrap();
        Sender { child }
    }

    pub(crate) fn said(&self) -> String {
        fs::read_to_string(self.path().join("said.txt")).unwrap_or_default()
    }

    pub(crate) fn says(&self, text: &str) {
        let since = Instant::now();
        while !self.said().contains(text) {
            assert!(since.elapsed() < Duration::from_secs(60), "never said {text}, but {}", self.said());
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Waits for the end of a process. Returns exit code and JSON object.
    pub(crate) fn answer(&self, mut sender: Sender) -> (i32, Value) {
        let child = &mut sender.child;
        let mut exit = None;
        let since = Instant::now();
        while exit.is_none() {
            let waits = since.elapsed() < MOST;
            assert!(waits, "annulus does not end within {MOST:?}; it said: {}", self.said());
            std::thread::sleep(Duration::from_millis(5));
            exit = child.try_wait().unwrap();
        }
        let text = fs::read_to_string(self.path().join("answer.json")).unwrap();
        let object = serde_json::from_str(text.trim()).unwrap_or(Value::Null);
        (exit.and_then(|exit| exit.code()).unwrap_or(-1), object)
    }

    pub(crate) fn run(&self, board: &Board, words: &str) -> (i32, Value) {
        let sender = self.start(board, words);
        self.answer(sender)
    }
}

pub(crate) struct Sender {
    child: Child,
}

impl Sender {
    pub(crate) fn types(&mut self, line: &str) {
        // In one piece, as a terminal sends it.
        self.child.stdin.as_mut().unwrap().write_all(format!("{line}\n").as_bytes()).unwrap();
    }

    pub(crate) fn stop(&self) {
        kill_process(Pid::from_child(&self.child), Signal::INT).unwrap();
    }

    pub(crate) fn kill(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    pub(crate) fn ended(&mut self) -> bool {
        self.child.try_wait().unwrap().is_some()
    }
}

impl Drop for Sender {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
