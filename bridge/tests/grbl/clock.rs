//! Compares the time predicted before a job with the time between the first and the last edge of a pin.

use super::firmware::{Board, instrument, long, settings};
use super::jobs;
use super::judge;
use super::sender::Desk;

#[test]
fn job_time_is_within_5_percent_of_the_estimate() {
    let Some(instrument) = instrument() else { return };
    // 2,000 lines, or 500.
    let (toolpaths, wanted) = if long() { (28, 1_950..=2_100) } else { (7, 490..=600) };
    let job = jobs::winding(toolpaths);
    let lines = job.text.lines().count();
    assert!(wanted.contains(&lines), "{lines} lines");
    let mut board = Board::new(instrument, &settings(false), [-100.0, -100.0, -60.0], &[]);
    let desk = Desk::new(&job.text);
    let (exit, object) = desk.run(&board, "run job.nc --zero-here");
    assert_eq!(exit, 0, "{object} {}", desk.said());
    let report = board.end();
    let log = judge::read(&board.edges(), 0);
    assert_eq!(log.end, job.end_steps([0; 3]));
    let spent_s = log.seconds.last().unwrap() - log.seconds.first().unwrap();
    let told_s = object["estimated_s"].as_f64().unwrap();
    println!(
        "{lines} lines, {spent_s:.1} s on the board, {told_s:.1} s told; {} s waited for",
        report["slip_s"]
    );
    assert!((told_s / spent_s - 1.0).abs() < 0.05, "{told_s} s told, {spent_s} s taken");
}
