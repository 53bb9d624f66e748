//! Shared by the tests of interruptions: a machine with limit switches, a job, and the judge.

use super::firmware::{Board, Instrument, STEPS, settings};
use super::jobs::Job;
use super::judge::{self, Log, Verdict};
use super::sender::Desk;
use serde_json::Value;

pub(crate) const ZERO: [f64; 3] = [-40.0, -40.0, -20.0];
pub(crate) const ZERO_AT: &str = "--zero-at -40,-40,-20";
pub(crate) const START: [f64; 3] = [-6.0, -5.0, -4.0];
/// How far past its switch the carriage may be when it is found, plus a step of a reset, in steps.
const TOLERANCE: i64 = 7;

/// The machine, the user's desk, and the job.
pub(crate) struct Bench {
    pub(crate) board: Board,
    pub(crate) desk: Desk,
    pub(crate) job: Job,
}

impl Bench {
    pub(crate) fn new(instrument: &Instrument, job: Job, options: &[&str]) -> Self {
        let board = Board::new(instrument, &settings(true), START, options);
        let desk = Desk::new(&job.text);
        Self { board, desk, job }
    }

    pub(crate) fn run(&self) -> (i32, Value) {
        self.desk.run(
            &self.board,
            &format!("run job.nc {ZERO_AT} --equal-tool-lengths --unattended-tool-change 0.1"),
        )
    }

    pub(crate) fn resume(&self) -> (i32, Value) {
        self.desk.run(&self.board, "resume --equal-tool-lengths --unattended-tool-change 0.1")
    }

    /// Turns the machine off. Returns the verdict on the job, and the last report.
    pub(crate) fn judged(&mut self) -> (Verdict, Value) {
        let (_, verdict, report) = self.read();
        (verdict, report)
    }

    pub(crate) fn read(&mut self) -> (Log, Verdict, Value) {
        let report = self.board.end();
        let zero = self.board.steps_at(ZERO);
        let log = judge::read(&self.board.edges(), zero[2] - (0.05 * STEPS) as i64);
        assert_eq!(report["crash_steps"], serde_json::json!([0, 0, 0]), "{report}");
        assert_eq!(report["uart"]["overrun"], 0, "{report}");
        let verdict = judge::compare(&log, &self.job.wanted(zero), TOLERANCE);
        (log, verdict, report)
    }
}
