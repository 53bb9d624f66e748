//! Tests of injected faults of the virtual drill: the effects agree with the table and the manual. Also of
//! a board that is not flat, measured and followed on the drill itself.

use annulus_core::virtual_drill::faults::FAULTS;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// Twelve holes within 40 by 30 mm.
fn board() -> String {
    let holes = (0..12).map(|hole| format!("X{}.0Y{}.0\n", 5 + hole % 4 * 13, 5 + hole / 4 * 15));
    format!("M48\nMETRIC\nT1C0.8\n%\nT1\n{}M30\n", holes.collect::<String>())
}

fn annulus(home: &Path, arguments: &str) -> (i32, serde_json::Value) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
    command.args(arguments.split_whitespace()).args(["--time-scale", "2000", "--json"]);
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

/// A board with three hole sizes and a machine with a magazine. Returns the arguments of the run.
fn with_magazine(home: &Path) -> String {
    let sizes = "M48\nMETRIC\nT1C0.6\nT2C0.8\nT3C1.0\n%\n";
    let holes = |tool: u32| {
        let hole = |at: u32| format!("X{}.0Y{}.0\n", 5 + 9 * at, 5 * tool);
        format!("T{tool}\n{}", (0..3).map(hole).collect::<String>())
    };
    fs::write(home.join("three.drl"), format!("{sizes}{}{}{}M30\n", holes(1), holes(2), holes(3))).unwrap();
    fs::write(home.join("changer.toml"), "schema = 1\n[rack]\nchange = \"magazine\"\n").unwrap();
    "run three.drl --machine changer.toml --assume-magazine-loaded".to_owned()
}

#[test]
fn magazine_fetches_each_tool_and_the_estimate_counts_changes() {
    let folder = folder();
    let home = folder.path();
    let run = with_magazine(home);
    let (exit, object) = annulus(home, &run);
    assert_eq!(
        (exit, &object["drilled"]["missing"], &object["drilled"]["broken"]),
        (0, &0.into(), &0.into()),
        "{object}"
    );
    let record = fs::read_to_string(home.join("home").join("drilled.txt")).unwrap();
    let mut tools: Vec<&str> = record.lines().map(|line| line.rsplit(' ').next().unwrap()).collect();
    tools.sort_unstable();
    assert_eq!(
        tools,
        ["D0.6000", "D0.6000", "D0.6000", "D0.8000", "D0.8000", "D0.8000", "D1.0000", "D1.0000", "D1.0000"]
    );
    // The predicted time includes the changes.
    let simulated = |machine: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
        command.args(["simulate", "three.drl", "--machine", machine, "--json"]).current_dir(home);
        let output = command.env("ANNULUS_HOME", home.join("home")).output().unwrap();
        let object: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        [&object["total_time_s"], &object["time_s"]["change"]].map(|seconds| seconds.as_f64().unwrap())
    };
    let (by_itself, by_hand) = (simulated("changer.toml"), simulated("virtual"));
    assert!(by_itself[1] > by_hand[1] + 30.0, "{by_itself:?} {by_hand:?}");
    assert!(
        (by_itself[0] - by_hand[0] - (by_itself[1] - by_hand[1])).abs() < 0.01,
        "{by_itself:?} {by_hand:?}"
    );
    // With an empty magazine it is refused before anything moves.
    fs::remove_dir_all(home.join("home")).unwrap();
    let (exit, object) = annulus(home, "run three.drl --machine changer.toml");
    assert_eq!((exit, &object["error"]["code"]), (1, &"magazine.spindle_unknown".into()), "{object}");
}

#[test]
fn every_fault_gives_the_code_in_table_and_manual() {
    let manual = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/manual/faults.md"));
    let manual = manual.unwrap();
    for row in FAULTS {
        let folder = folder();
        let what = match row.name {
            "contact-early" => {
                let tolerance = "schema = 1\n[stroke]\ncontact_tolerance = 0.1\n";
                fs::write(folder.path().join("looks.toml"), tolerance).unwrap();
                "run board.drl --machine looks.toml".to_owned()
            }
            // Contact faults show when the board is probed, magazine faults when tools are changed.
            name if name.starts_with("contact-") => "level board.drl".to_owned(),
            _ if row.seen.is_some_and(|code| code.starts_with("magazine.")) => with_magazine(folder.path()),
            _ => "run board.drl".to_owned(),
        };
        let (exit, object) = annulus(folder.path(), &format!("{what} --fault {}", row.name));
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
fn height_map_drills_every_hole_of_an_uneven_board() {
    let folder = folder();
    let home = folder.path();
    let (exit, object) = annulus(home, "run board.drl --height-map saved --fault board-not-flat");
    assert_eq!((exit, &object["error"]["code"]), (1, &"level.none_kept".into()), "{object}");
    let (exit, map) = annulus(home, "level board.drl --spacing 8 --fault board-not-flat");
    assert_eq!(exit, 0, "{map}");
    let span = map["highest_um"].as_f64().unwrap() - map["lowest_um"].as_f64().unwrap();
    assert!(span > 400.0, "{map}");
    let (exit, object) = annulus(home, "run board.drl --fault board-not-flat");
    assert_eq!((exit, &object["error"]["code"]), (1, &"control.board_differs".into()), "{object}");
    assert!(object["drilled"]["missing"].as_u64() >= Some(1), "{object}");
    let (exit, object) = annulus(home, "run board.drl --height-map saved --restart --fault board-not-flat");
    assert_eq!((exit, &object["drilled"]["missing"]), (0, &0.into()), "{object}");
    // Another board does not follow it.
    fs::write(home.join("other.drl"), board()).unwrap();
    let (exit, object) = annulus(home, "run other.drl --height-map saved --fault board-not-flat");
    assert_eq!((exit, &object["error"]["code"]), (1, &"level.other_job".into()), "{object}");
}
