//! `annulus run` as a real process: a board from a drill file, a full disk, corrupted files (A11, N16, N24).

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const BOARD: &str =
    "M48\nMETRIC,TZ\nT1C0.8\nT2C1.0\n%\nT1\nX5.0Y5.0\nX10.0Y5.0\nX10.0Y9.0\nT2\nX3.0Y3.0\nM30\n";

fn annulus(home: &Path, arguments: &str) -> Output {
    // Through a shell, so that its limits can be set: no size of a file above so many blocks of 512 bytes.
    let (limit, rest) = arguments.split_once('|').unwrap_or(("", arguments));
    let line = format!("{limit} exec {} {rest}", env!("CARGO_BIN_EXE_annulus"));
    let mut shell = Command::new("sh");
    shell.args(["-c", &line]).current_dir(home).env("ANNULUS_HOME", home.join("home"));
    shell.output().unwrap()
}

fn json(output: &Output) -> serde_json::Value {
    let text = String::from_utf8_lossy(&output.stdout);
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text} {output:?}"))
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("board.drl"), BOARD).unwrap();
    folder
}

#[test]
fn a_board_is_drilled_from_its_file() {
    let folder = folder();
    let output = annulus(folder.path(), "run board.drl --speed 2000 --json");
    let object = json(&output);
    assert_eq!(output.status.code(), Some(0), "{object}");
    assert_eq!((object["ok"].as_bool(), object["holes_done"].as_u64()), (Some(true), Some(4)), "{object}");
    assert_eq!((&object["stopped_because"], &object["position_trust"]), (&"done".into(), &"trusted".into()));
    assert_eq!(object["stream_digest"].as_str().map(str::len), Some(64));
    let record = fs::read_to_string(folder.path().join("home/drilled.txt")).unwrap();
    assert_eq!(record.lines().count(), 4);
}

#[test]
fn a_full_disk_is_refused_before_anything_moves() {
    let folder = folder();
    let output = annulus(folder.path(), "trap '' XFSZ; ulimit -f 4; |run board.drl --speed 2000 --json");
    let object = json(&output);
    assert_eq!((output.status.code(), object["ok"].as_bool()), (Some(3), Some(false)), "{object}");
    assert_eq!(object["error"]["code"], "journal.cannot_open", "{object}");
    let drilled = fs::read_to_string(folder.path().join("home/drilled.txt")).unwrap_or_default();
    assert_eq!(drilled, "");
    // With room again it works.
    assert_eq!(annulus(folder.path(), "run board.drl --speed 2000 --json").status.code(), Some(0));
}

#[test]
fn a_corrupted_machine_file_is_refused_with_its_place_and_kept() {
    let folder = folder();
    let file = folder.path().join("home/machines/virtual.toml");
    fs::create_dir_all(file.parent().unwrap()).unwrap();
    let text = "schema = 1\n[x]\nmax_speed = \"fast\"\n";
    fs::write(&file, text).unwrap();
    let output = annulus(folder.path(), "run board.drl --json");
    let error = &json(&output)["error"];
    assert_eq!((output.status.code(), &error["code"]), (Some(1), &"machine.setting_kind".into()));
    assert_eq!((&error["place"]["line"], &error["place"]["column"]), (&3.into(), &13.into()));
    assert_eq!(fs::read_to_string(&file).unwrap(), text);
}

#[test]
fn a_corrupted_journal_is_moved_aside_and_the_board_drilled() {
    let folder = folder();
    fs::create_dir_all(folder.path().join("home")).unwrap();
    fs::write(folder.path().join("home/journal.redb"), [7_u8; 9_000]).unwrap();
    let output = annulus(folder.path(), "run board.drl --speed 2000 --json");
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("journal was damaged"), "{said}");
    let kept = fs::read(folder.path().join("home/journal.damaged-1")).unwrap();
    assert_eq!(kept, [7_u8; 9_000]);
}
