//! A job that the firmware itself reads in its check mode: no pin moves, what it refuses is told with its line, and the job runs afterwards.

use super::bench::START;
use super::firmware::{Board, instrument, settings};
use super::jobs;
use super::judge;
use super::sender::Desk;

/// Where the carriage stands when it is turned on, mm.
const HERE: [f64; 3] = [-100.0, -100.0, -60.0];

#[test]
fn a_job_is_read_without_a_step_and_runs_afterwards() {
    let Some(instrument) = instrument() else { return };
    let job = jobs::board();
    let mut board = Board::new(instrument, &settings(false), HERE, &[]);
    let desk = Desk::new(&job.text);
    let (exit, object) = desk.run(&board, "check job.nc");
    assert_eq!(exit, 0, "{object} {}", desk.said());
    let lines = object["lines"].as_u64().unwrap();
    assert!(lines > 60, "{object}");
    assert_eq!((&object["lines_read"], &object["lines_refused"]), (&lines.into(), &0.into()), "{object}");
    assert_eq!(object["bits_per_s"], 115_200, "{object}");
    assert_eq!(board.snapshot()["edges_total"], 0);
    let (exit, object) = desk.run(&board, "run job.nc --zero-here --same-length --confirm-tools 0.1");
    assert_eq!(exit, 0, "{object} {}", desk.said());
    board.end();
    let log = judge::read(&board.edges(), 0);
    assert_eq!(judge::compare(&log, &job.wanted([0; 3]), 0), judge::Verdict::default());
}

#[test]
fn a_line_that_the_firmware_refuses_is_told_with_its_line() {
    let Some(instrument) = instrument() else { return };
    // GRBL is compiled without mist.
    let text = jobs::board().text.replacen("M3 S9000\n", "M3 S9000\nM7\nM9\n", 1);
    let mut board = Board::new(instrument, &settings(false), HERE, &[]);
    let desk = Desk::new(&text);
    let (exit, object) = desk.run(&board, "check job.nc");
    assert_eq!(
        (exit, &object["error"]["code"]),
        (1, &"grbl.check_refused".into()),
        "{object} {}",
        desk.said()
    );
    let refused = object["refused"].as_array().unwrap();
    let told: Vec<_> = refused.iter().map(|why| (why["code"].as_str(), why["line"].as_u64())).collect();
    assert_eq!(told, [(Some("grbl.error_20"), Some(8))], "{object}");
    assert_eq!(object["lines_read"], object["lines"], "the others are read all the same");
    assert_eq!(board.end()["edges_total"], 0);
}

#[test]
fn a_place_past_the_end_of_travel_is_found_where_soft_limits_are_on() {
    let Some(instrument) = instrument() else { return };
    let board = Board::new(instrument, &settings(true), START, &[]);
    let desk = Desk::new(&jobs::board().text);
    // Locked as it is turned on: that it would lock itself anywhere is said.
    let (exit, object) = desk.run(&board, "check job.nc");
    assert_eq!(
        (exit, &object["error"]["code"]),
        (1, &"grbl.check_not_homed".into()),
        "{object} {}",
        desk.said()
    );
    assert_eq!(board.snapshot()["edges_total"], 0);
    // The work zero is at the end of all travels: everything lies past it.
    let (exit, object) = desk.run(&board, "check job.nc --home");
    assert_eq!((exit, &object["error"]["code"]), (1, &"grbl.alarm_2".into()), "{object} {}", desk.said());
    assert!(object["lines_read"].as_u64() < object["lines"].as_u64(), "{object}");
}
