//! Tests that the speed of a controller's line is found: a simulated controller reads the speed that its
//! client has set.

use super::pty::Board;
use serde_json::Value;
use std::process::Command;

/// The answer of `annulus grbl info` with these extra arguments.
fn info(board: &Board, words: &[&str]) -> (Option<i32>, Value, String) {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
    command.args(["grbl", "info", "--json", "--port", &board.port]).args(words);
    let output = command.env("ANNULUS_HOME", folder.path()).output().unwrap();
    let object = serde_json::from_slice(&output.stdout).unwrap_or_default();
    (output.status.code(), object, String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn baud_rate_is_detected_and_reported() {
    for bits_per_s in [57_600, 250_000] {
        let board = Board::at(bits_per_s);
        let (exit, object, said) = info(&board, &[]);
        assert_eq!((exit, &object["bits_per_s"]), (Some(0), &bits_per_s.into()), "{object} {said}");
        assert_eq!(object["controller"]["flavour"], "GRBL", "{object}");
        assert!(said.contains("No controller answers at 115200 baud."), "{said}");
    }
}

#[test]
fn given_baud_rate_is_the_only_one_tried() {
    let board = Board::at(57_600);
    let (exit, object, said) = info(&board, &["--baud", "57600"]);
    assert_eq!((exit, &object["bits_per_s"]), (Some(0), &57_600.into()), "{object} {said}");
    let (exit, object, said) = info(&board, &["--baud", "9600"]);
    assert_eq!((exit, &object["error"]["code"]), (Some(3), &"grbl.no_answer".into()), "{object} {said}");
}
