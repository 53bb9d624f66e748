//! Switches and a probe that do not work, on the firmware itself: the controller's own alarm, said with its number (N20); a contact that
//! is closed from the beginning is said before anything goes down.

use super::bench::ZERO_AT;
use super::firmware::{Board, instrument, settings};
use super::jobs;
use super::sender::Desk;

/// Where the carriage is before it is homed.
const START: [f64; 3] = [-6.0, -5.0, -4.0];

#[test]
fn switches_and_a_probe_that_do_not_work_are_told_with_their_alarm() {
    let Some(instrument) = instrument() else { return };
    let run = format!("run job.nc {ZERO_AT} --same-length --confirm-tools 0");
    let level = format!("level job.nc {ZERO_AT}");
    let rows: [(&[&str], &str, &str); 3] = [
        // A switch that is never on, one that is always on, and a probe whose clip touches the bit.
        (&["--ends", "none,none,none"], &run, "grbl.alarm_9"),
        (&["--limits-nc"], &run, "grbl.alarm_8"),
        (&["--probe-z", "500"], &level, "grbl.probe_closed"),
    ];
    for (options, words, code) in rows {
        let mut board = Board::new(instrument, &settings(true), START, options);
        let desk = Desk::new(&jobs::board().text);
        let (exit, object) = desk.run(&board, words);
        assert_eq!((exit, &object["error"]["code"]), (1, &code.into()), "{object} {}", desk.said());
        let report = board.end();
        assert_eq!(report["spindle"]["starts"], 0, "{code}: {report}");
    }
}
