//! Tests a whole board by `annulus cam`: isolation, two drills, cut-out, one program per tool. The pins
//! must reach every position of the programs in order, and the last one exactly.

use super::firmware::{Board, STEPS, instrument, settings, steps};
use super::judge;
use super::sender::Desk;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Three pads of 2 mm on a board of 12 by 6 mm. Two have a hole of 0.8 mm, the middle one has 1 mm.
const TOP: &str = "%FSLAX34Y34*%\n%MOMM*%\n%TF.FileFunction,Copper,L1,Top*%\n%ADD10R,2.0X2.0*%\nD10*\n\
    X20000Y30000D03*\nX60000Y30000D03*\nX100000Y30000D03*\nM02*\n";
const EDGE: &str = "%FSLAX34Y34*%\n%MOMM*%\n%TF.FileFunction,Profile,NP*%\n%ADD10C,0.1*%\nD10*\n\
    X0Y0D02*\nX120000Y0D01*\nX120000Y60000D01*\nX0Y60000D01*\nX0Y0D01*\nM02*\n";
const HOLES: &str =
    "M48\nMETRIC\nT1C0.8\nT2C1.0\n%\nG90\nT1\nX2.000Y3.000\nX10.000Y3.000\nT2\nX6.000Y3.000\nM30\n";

fn programs(home: &Path) -> Vec<PathBuf> {
    fs::create_dir(home.join("board")).unwrap();
    for (name, text) in [("top.gbr", TOP), ("edge.gbr", EDGE), ("holes.drl", HOLES)] {
        fs::write(home.join("board").join(name), text).unwrap();
    }
    let mut cam = Command::new(env!("CARGO_BIN_EXE_annulus"));
    cam.args(["cam", "board", "--to", "grbl", "-o", "out"]);
    let told = cam.current_dir(home).env("ANNULUS_HOME", home.join("home")).output().unwrap();
    assert!(told.status.success(), "{told:?}");
    let entries = fs::read_dir(home.join("out")).unwrap().map(|entry| entry.unwrap().path());
    let mut found: Vec<_> = entries.filter(|path| path.extension().is_some_and(|end| end == "nc")).collect();
    found.sort();
    found
}

/// All positions of the programs, mm: their absolute, modal X, Y and Z words.
fn places(texts: &[String]) -> Vec<[f64; 3]> {
    let mut at = [0.0; 3];
    let mut found = Vec::new();
    for line in texts.iter().flat_map(|text| text.lines()).filter(|line| line.starts_with('G')) {
        let mut moves = false;
        for word in line.split(' ') {
            let Some(axis) = "XYZ".find(&word[..1]) else { continue };
            at[axis] = word[1..].parse().unwrap();
            moves = true;
        }
        found.extend(moves.then_some(at));
    }
    found
}

#[test]
fn four_programs_of_a_board_reach_every_position() {
    let Some(instrument) = instrument() else { return };
    let desk = Desk::new("");
    let programs = programs(desk.path());
    assert_eq!(programs.len(), 4, "{programs:?}");
    let texts: Vec<String> = programs.iter().map(|path| fs::read_to_string(path).unwrap()).collect();
    let places = places(&texts);
    assert!(places.len() > 100, "{} places", places.len());
    let mut board = Board::new(instrument, &settings(false), [-100.0, -100.0, -60.0], &[]);
    let names: Vec<String> = programs.iter().map(|path| path.display().to_string()).collect();
    let (exit, object) = desk.run(
        &board,
        &format!("run {} --zero-here --equal-tool-lengths --unattended-tool-change 0.2", names.join(" ")),
    );
    assert_eq!(exit, 0, "{object} {}", desk.said());
    assert_eq!(object["holes_done"], 3, "{object}");
    let report = board.end();
    let in_steps = |place: &[f64; 3]| place.map(|mm| (mm * STEPS).round() as i64);
    let wanted: Vec<_> = places.iter().map(in_steps).collect();
    assert_eq!(judge::not_come_to(&board.edges(), &wanted, 1), None, "of {} places", wanted.len());
    let log = judge::read(&board.edges(), 0);
    assert_eq!((log.end, steps(&report)), (*wanted.last().unwrap(), *wanted.last().unwrap()));
    // Exactly the holes of the drill file are where XY stopped while the tool was in the board.
    let mut drilled: Vec<_> = log.dips.iter().filter(|dip| dip.path.is_empty()).map(|dip| dip.at).collect();
    drilled.sort_unstable();
    assert_eq!(drilled, [[500, 750], [1500, 750], [2500, 750]]);
    assert!(
        log.dips.iter().filter(|dip| dip.path.is_empty()).all(|dip| dip.lowest < -400),
        "through the board"
    );
    assert_eq!(report["spindle"]["starts"], 4, "{report}");
}
