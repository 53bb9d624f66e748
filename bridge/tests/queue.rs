//! Tests of `annulus queue` as a real process: check, run, step, refusals.

use serde_json::Value;
use std::fs;
use std::process::{Command, Stdio};
use tempfile::TempDir;

const FOUR: &str = "; four holes\nSPINDLE 20000\nREPEAT 2\n  MOVE_BY 40 0\n  CALL hole\n  MOVE_TO 5 10\n  CALL hole\nEND\nSUB hole\n\
      KMD_WIERTLO_DOL\n  KMD_WIERTLO_GORA\nEND\n";

/// Exit code, JSON object, and text for the user.
fn annulus(home: &TempDir, arguments: &str) -> (i32, Value, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
    command.args(arguments.split_whitespace()).arg("--json").current_dir(home).stdin(Stdio::null());
    let output = command.env("ANNULUS_HOME", home.path().join("home")).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    let object = serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text} {output:?}"));
    (output.status.code().unwrap_or(-1), object, String::from_utf8_lossy(&output.stderr).into_owned())
}

fn with(text: &str) -> TempDir {
    let home = TempDir::new().unwrap();
    fs::write(home.path().join("q.txt"), text).unwrap();
    home
}

#[test]
fn queue_is_checked_and_run_on_two_machines() {
    let home = with(FOUR);
    for machine in ["virtual", "lab"] {
        let (exit, object, _) = annulus(&home, &format!("queue check q.txt --machine {machine}"));
        assert_eq!((exit, object["ok"].as_bool(), object["rows_done"].as_u64()), (0, Some(true), Some(24)));
        assert_eq!((&object["strokes"], &object["rows"]), (&4.into(), &12.into()), "{object}");
        assert!(object["text"].as_str().unwrap().contains("    DRILL_DOWN\n"), "{object}");
        let (exit, object, _) =
            annulus(&home, &format!("queue run q.txt --machine {machine} --time-scale 2000"));
        assert_eq!(
            (exit, &object["ended"], &object["rows_done"]),
            (0, &"done".into(), &24.into()),
            "{object}"
        );
        assert_eq!(object["position_trust"], "trusted");
        let row = &object["rows"][8];
        assert_eq!((&row["row"], &row["text"], &row["turns"]), (&10.into(), &"DRILL_DOWN".into(), &4.into()));
        assert!(row["ms"].as_f64().unwrap() > 100.0, "{row}");
        let x_mm = object["position_mm"][0].as_f64().unwrap();
        assert!((x_mm - 5.0).abs() < 0.2, "{object}");
    }
    let record = fs::read_to_string(home.path().join("home/drilled.txt")).unwrap();
    assert_eq!(record.lines().count(), 8);
}

#[test]
fn wrong_queue_is_refused_with_every_line_and_no_motion() {
    let home = with("FLY\nWAIT 1\nWAIT x\n");
    for what in ["check", "run"] {
        let (exit, object, text) = annulus(&home, &format!("queue {what} q.txt"));
        assert_eq!((exit, object["ok"].as_bool()), (1, Some(false)));
        let lines: Vec<_> =
            object["findings"].as_array().unwrap().iter().map(|row| row["line"].clone()).collect();
        assert_eq!(lines, [1, 3]);
        let place = &object["error"]["place"];
        assert_eq!(
            (&place["file"], &place["line"], &place["column"]),
            (&"q.txt".into(), &1.into(), &1.into())
        );
        assert!(text.contains("not a whole number"), "{text}");
    }
    let home = with("MOVE_TO 10 10\nREPEAT 30\nMOVE_BY 1000 0\nEND\n");
    let (exit, object, _) = annulus(&home, "queue run q.txt");
    assert_eq!((exit, &object["error"]["code"]), (1, &"queue.outside".into()), "{object}");
    assert_eq!(
        (&object["error"]["place"]["line"], &object["error"]["place"]["file"]),
        (&3.into(), &"q.txt".into())
    );
    assert!(!home.path().join("home/drilled.txt").exists(), "the drill was not even opened");
    let (exit, object, _) = annulus(&home, "queue check nothing.txt");
    assert_eq!((exit, &object["error"]["code"]), (3, &"files.missing".into()));
}

#[test]
fn failed_row_ends_a_stepped_queue() {
    let home = with("MOVE_BY 8 8\nWAIT_INPUT CONTACT ON 30\nMOVE_BY 8 8\n");
    let (exit, object, text) = annulus(&home, "queue run q.txt --step --time-scale 2000");
    assert_eq!((exit, &object["ended"]), (1, &"failed".into()), "{object}");
    assert_eq!(object["error"]["code"], "queue.input_timeout");
    let states: Vec<_> = object["rows"].as_array().unwrap().iter().map(|row| row["state"].clone()).collect();
    assert_eq!(states, ["done", "refused", "waiting"]);
    assert!(text.contains("MOVE_BY 8 8") && text.contains("done"), "{text}");
}

#[test]
fn queue_without_a_terminal_ends_at_its_breakpoint() {
    let home = with("MOVE_TO 5 5\n*MOVE_TO 10 5\nMOVE_TO 0 0\n");
    let (exit, object, _) = annulus(&home, "queue run q.txt --time-scale 2000");
    assert_eq!((exit, &object["error"]["code"]), (1, &"queue.at_breakpoint".into()), "{object}");
    assert_eq!((&object["ended"], &object["rows_done"]), (&"held".into(), &1.into()), "{object}");
}
