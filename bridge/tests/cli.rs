//! The other commands as real processes: what scripts rely on, and who stops listening (N24).

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const BOARD: &str =
    "M48\nMETRIC,TZ\nT1C0.8\nT2C1.0\n%\nT1\nX5.0Y5.0\nX10.0Y5.0\nX10.0Y9.0\nT2\nX3.0Y3.0\nM30\n";

fn annulus(home: &Path, arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
    command.args(arguments.split_whitespace()).current_dir(home).env("ANNULUS_HOME", home.join("home"));
    command
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("board.drl"), BOARD).unwrap();
    folder
}

#[test]
fn nobody_has_to_be_reading() {
    let folder = folder();
    for (arguments, exit) in [
        ("inspect board.drl", 0),
        ("inspect board.drl --json", 0),
        ("plan board.drl", 0),
        ("plan missing.drl --json", 3),
        ("plan --wrong --json", 2),
        ("run board.drl --speed 2000", 0),
    ] {
        let (nobody, out) = std::io::pipe().unwrap();
        let (no_person, err) = std::io::pipe().unwrap();
        drop((nobody, no_person));
        let status = annulus(folder.path(), arguments).stdout(out).stderr(err).status().unwrap();
        assert_eq!(status.code(), Some(exit), "{arguments}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_under_the_answer_is_said() {
    let folder = folder();
    let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let mut command = annulus(folder.path(), "inspect board.drl --json");
    let Output { status, stderr, .. } = command.stdout(full).stderr(Stdio::piped()).output().unwrap();
    assert_eq!(status.code(), Some(3));
    assert!(String::from_utf8_lossy(&stderr).contains("could not be printed"));
}
