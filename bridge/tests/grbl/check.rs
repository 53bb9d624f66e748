//! Tests of the check mode on the real firmware: no pin moves, refused lines are reported, and the job runs
//! afterwards.

use super::bench::START;
use super::firmware::{Board, instrument, settings};
use super::jobs;
use super::judge;
use super::sender::Desk;
use annulus_core::locale;
use std::process::{Command, Stdio};

const HERE: [f64; 3] = [-100.0, -100.0, -60.0];

#[test]
fn check_reads_every_line_without_motion() {
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
    let (exit, object) =
        desk.run(&board, "run job.nc --zero-here --equal-tool-lengths --unattended-tool-change 0.1");
    assert_eq!(exit, 0, "{object} {}", desk.said());
    board.end();
    let log = judge::read(&board.edges(), 0);
    assert_eq!(judge::compare(&log, &job.wanted([0; 3]), 0), judge::Verdict::default());
}

#[test]
fn check_reports_the_line_that_the_firmware_refuses() {
    let Some(instrument) = instrument() else { return };
    // This GRBL is compiled without mist.
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
fn lines_refused_before_sending_are_refused_by_the_firmware() {
    let Some(instrument) = instrument() else { return };
    let board = Board::new(instrument, &settings(false), HERE, &[]);
    let head = "G21 G90\nG0 Z5\nG0 X0 Y0\nM3 S9000\nG1 Z-1 F100\n";
    for (line, number) in [
        ("G0 X3.5 Y-4 I0.5 J0", 36),
        ("G1 X1 R2", 36),
        ("G1 X1 P2", 36),
        ("G2 X1 Y1 R5 I2", 36),
        ("G2 X1 Y1", 35),
        ("G0 G1 X1", 24),
        ("G90 G91 X1", 21),
        ("M3 M5", 21),
        ("M8 M9", 21),
        ("G1 X1 X2", 25),
        ("G80 X1", 31),
        ("G4", 28),
        ("G64 P0.01", 20),
        ("G81 X1 Z-1 R1", 20),
        ("M98", 20),
        ("M3.4", 23),
        ("F-5", 4),
        ("N10000001 G0 Z5", 27),
        ("T256", 38),
        ("G0 A1", 20),
    ] {
        let desk = Desk::new(&format!("{head}{line}\nG0 Z5\nM2\n"));
        let (exit, object) = desk.run(&board, "check job.nc");
        assert_eq!(exit, 1, "{line}: {object}");
        assert_eq!(object["error"]["place"]["line"], 6, "{line}: {object}");
        let said = object["error"]["message"].as_str().unwrap_or_default();
        assert!(said.contains(&format!("error {number})")), "{line}: {said}");
        assert_eq!(board.answers(&[head, line]), Some(number), "{line}");
    }
}

#[test]
fn reason_of_a_refused_job_is_printed_once() {
    let Some(instrument) = instrument() else { return };
    let mut board = Board::new(instrument, &settings(false), HERE, &[]);
    let desk = Desk::new(&jobs::board().text);
    let output = Command::new(env!("CARGO_BIN_EXE_annulus"))
        .args(["grbl", "run", "job.nc", "--equal-tool-lengths", "--time-scale", "2", "--port", &board.port()])
        .current_dir(desk.path())
        .env("ANNULUS_HOME", desk.path().join("home"))
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let said =
        [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned()).concat();
    let reason = locale::text("en", "grbl.no_zero.message", &[]);
    assert_eq!((output.status.code(), said.matches(&reason).count()), (Some(1), 1), "{said}");
    assert_eq!(board.end()["edges_total"], 0);
}

#[test]
fn firmware_answers_match_the_line_table() {
    let Some(instrument) = instrument() else { return };
    let board = Board::new(instrument, &settings(false), HERE, &[]);
    let rows = include_str!("../../../tests/data/gcode/grbl-lines.tsv");
    for row in rows.lines().filter(|row| !row.starts_with('#')) {
        let [number, _, _, lines] = row.split('\t').collect::<Vec<_>>().try_into().unwrap();
        let found = board.answers(&["T1\nM3 S1000\nG0 X0 Y0 Z1", &lines.replace('|', "\n")]);
        assert_eq!(found.unwrap_or(0).to_string(), number, "{row}");
    }
}

#[test]
fn rapids_in_the_board_are_reported_by_check_and_run() {
    let Some(instrument) = instrument() else { return };
    let board = Board::new(instrument, &settings(false), HERE, &[]);
    let desk = Desk::new("G21 G90\nG0 Z5\nG0 X0 Y0\nM3 S9000\nG1 Z-1 F600\nG0 X1\nG0 Z5\nM5\nM2\n");
    for words in ["check job.nc", "run job.nc --zero-here --equal-tool-lengths"] {
        let (exit, object) = desk.run(&board, words);
        assert_eq!(exit, 0, "{words}: {object} {}", desk.said());
        let said = object["diagnostics"].as_array().unwrap();
        let rapid = said.iter().find(|why| why["code"] == "readback.fast_in_board").unwrap();
        assert_eq!(rapid["line"], 6, "{object}");
        assert!(said.iter().all(|why| why["code"] != "grbl.no_report"), "{object}");
    }
}

#[test]
fn check_finds_positions_beyond_the_soft_limits() {
    let Some(instrument) = instrument() else { return };
    let board = Board::new(instrument, &settings(true), START, &[]);
    let desk = Desk::new(&jobs::board().text);
    // Locked at power-on: the answer warns that the check would lock it again.
    let (exit, object) = desk.run(&board, "check job.nc");
    assert_eq!(
        (exit, &object["error"]["code"]),
        (1, &"grbl.check_not_homed".into()),
        "{object} {}",
        desk.said()
    );
    assert_eq!(board.snapshot()["edges_total"], 0);
    // The work zero is at the end of all travels: everything is beyond it.
    let (exit, object) = desk.run(&board, "check job.nc --home");
    assert_eq!((exit, &object["error"]["code"]), (1, &"grbl.alarm_2".into()), "{object} {}", desk.said());
    assert!(object["lines_read"].as_u64() < object["lines"].as_u64(), "{object}");
}
