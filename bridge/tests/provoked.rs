//! Faults of the virtual drill, provoked by their names: what is seen is what table and manual say (N20). A board that is not flat is
//! touched and followed on the drill's own outputs (N17).

use annulus_core::virtual_drill::faults::FAULTS;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// Twelve holes of 40 by 30 mm.
fn board() -> String {
    let holes = (0..12).map(|hole| format!("X{}.0Y{}.0\n", 5 + hole % 4 * 13, 5 + hole / 4 * 15));
    format!("M48\nMETRIC\nT1C0.8\n%\nT1\n{}M30\n", holes.collect::<String>())
}

fn annulus(home: &Path, arguments: &str) -> (i32, serde_json::Value) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
    command.args(arguments.split_whitespace()).args(["--speed", "2000", "--json"]);
    let output: Output = command.current_dir(home).env("ANNULUS_HOME", home.join("home")).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    let object = serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text} {output:?}"));
    (output.status.code().unwrap_or(-1), object)
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("board.drl"), board()).unwrap();
    folder
}

#[test]
fn every_fault_is_seen_as_table_and_manual_say() {
    let manual = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/manual/faults.md"));
    let manual = manual.unwrap();
    for row in FAULTS {
        let folder = folder();
        // The contact speaks where the board is touched.
        let verb = if row.name.starts_with("contact-") { "level" } else { "run" };
        let (exit, object) = annulus(folder.path(), &format!("{verb} board.drl --fault {}", row.name));
        let seen = object["error"]["code"].as_str();
        assert_eq!((seen, exit), (row.seen, i32::from(row.seen.is_some())), "{}: {object}", row.name);
        let said = manual.lines().any(|line| {
            line.contains(&format!("`{}`", row.name)) && row.seen.is_none_or(|code| line.contains(code))
        });
        assert!(said, "the manual has no row of {} with {:?}", row.name, row.seen);
    }
    let folder = folder();
    let (exit, object) = annulus(folder.path(), "run board.drl --fault broken-bits");
    assert_eq!((exit, &object["error"]["code"]), (2, &"fault.unknown".into()), "{object}");
}

#[test]
fn a_board_that_is_not_flat_is_touched_and_every_hole_goes_through() {
    let folder = folder();
    let home = folder.path();
    let (exit, object) = annulus(home, "run board.drl --level --fault board-not-flat");
    assert_eq!((exit, &object["error"]["code"]), (1, &"level.none_kept".into()), "{object}");
    let (exit, map) = annulus(home, "level board.drl --grid 8 --fault board-not-flat");
    assert_eq!(exit, 0, "{map}");
    let span = map["highest_um"].as_f64().unwrap() - map["lowest_um"].as_f64().unwrap();
    assert!(span > 400.0, "{map}");
    let (exit, object) = annulus(home, "run board.drl --fault board-not-flat");
    assert_eq!((exit, &object["error"]["code"]), (1, &"control.board_differs".into()), "{object}");
    assert!(object["drilled"]["missing"].as_u64() >= Some(1), "{object}");
    let (exit, object) = annulus(home, "run board.drl --level --from-start --fault board-not-flat");
    assert_eq!((exit, &object["drilled"]["missing"]), (0, &0.into()), "{object}");
    // Another board does not follow it.
    fs::write(home.join("other.drl"), board()).unwrap();
    let (exit, object) = annulus(home, "run other.drl --level --fault board-not-flat");
    assert_eq!((exit, &object["error"]["code"]), (1, &"level.other_job".into()), "{object}");
}
