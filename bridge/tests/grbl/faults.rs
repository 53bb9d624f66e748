//! Tests of broken switches and probes on the real firmware. The controller's alarm is reported with its
//! number; a contact that is already closed is reported before anything moves down.

use super::bench::ZERO_AT;
use super::firmware::{Board, instrument, settings};
use super::jobs;
use super::sender::Desk;

const START: [f64; 3] = [-6.0, -5.0, -4.0];

#[test]
fn faulty_switches_and_probe_raise_their_alarms() {
    let Some(instrument) = instrument() else { return };
    let run = format!("run job.nc {ZERO_AT} --equal-tool-lengths --unattended-tool-change 0");
    let level = format!("level job.nc {ZERO_AT}");
    let rows: [(&[&str], &str, &str); 3] = [
        // A switch that is never on, one that is always on, and a probe clip that touches the tool.
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
