//! Tests that a line refused in check mode is reported with its program, if the board has several programs.

use super::pty::Board;
use serde_json::Value;
use std::fs;
use std::process::Command;

fn program(line: &str) -> String {
    format!("G21 G90\nG0 Z2\nG0 X1 Y1\nM3 S9000\n{line}\nG1 Z-0.5 F600\nG0 Z2\nM5\nM2\n")
}

#[test]
fn refused_line_is_reported_with_its_program() {
    let board = Board::without_mist();
    let folder = tempfile::tempdir().unwrap();
    for (name, line) in [("first.nc", "M8"), ("second.nc", "M7"), ("third.nc", "M8")] {
        fs::write(folder.path().join(name), program(line)).unwrap();
    }
    let check = |names: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
        command.args(["grbl", "check"]).args(names).args(["--port", &board.port, "--json"]);
        let output = command.current_dir(folder.path()).env("ANNULUS_HOME", folder.path()).output().unwrap();
        let object: Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
        (output.status.code(), object, String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (exit, object, said) = check(&["first.nc", "second.nc", "third.nc"]);
    assert_eq!((exit, &object["error"]["code"]), (Some(1), &"grbl.check_refused".into()), "{object} {said}");
    let told: Vec<_> = object["refused"].as_array().into_iter().flatten().collect();
    assert!(!told.is_empty() && told.iter().all(|why| why["file"] == "second.nc"), "{object}");
    assert_eq!((&told[0]["line"], &object["error"]["place"]["file"]), (&5.into(), &"second.nc".into()));
    assert!(said.contains("second.nc, line 5: "), "{said}");
    // With a single program the line is enough.
    let (_, object, said) = check(&["second.nc"]);
    assert!(said.contains("Line 5: ") && object["error"]["place"].is_null(), "{object} {said}");
}
