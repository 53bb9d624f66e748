//! Tests of features that programs omit or make in the wrong position, and of the final sentence of a
//! proof. Runs `annulus prove` and `annulus cam` as real processes.

use super::{BOARD, CAM, answer_of, codes, folder};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/proof/ring")
}

fn text(home: &Path, arguments: &[&str]) -> (i32, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
    command.args(arguments).current_dir(home).env("ANNULUS_HOME", home.join("home"));
    let output = command.output().unwrap();
    (output.status.code().unwrap(), String::from_utf8_lossy(&output.stdout).into_owned())
}

/// A handwritten program with an end mill of 1 mm: the words between start and end.
fn milled(words: &str) -> String {
    format!("G21 G90 G17\nT1 M6 (end mill 1.0)\nM3 S10000\nG0 Z1\n{words}\nG0 Z1\nM5\nM30\n")
}

#[test]
fn misplaced_holes_and_idle_programs_are_problems() {
    let folder = tempfile::tempdir().unwrap();
    let home = folder.path();
    let ring = |x: f64, y: f64, radius: f64| {
        let turn = |deep: u32| format!("G1 Z-{}\nG2 I{radius} F200", f64::from(deep) * 0.25);
        let turns: Vec<String> = (1..=7).map(turn).collect();
        milled(&format!("G0 X{} Y{y}\n{}", x - radius, turns.join("\n")))
    };
    let own = |name: &str| fs::read_to_string(data().join("nc").join(name)).unwrap();
    let rows: [(&str, &str, String, &[&str]); 17] = [
        ("board", "as wanted", own("ring.nc"), &[]),
        ("board", "as a helix", own("ring-helix.nc"), &[]),
        ("board", "9 mm, 0.5 mm aside", own("ring-wrong-r.nc"), &["prove.shifted"]),
        ("board", "8 mm, 1 mm above", ring(20.0, 16.0, 3.5), &["prove.shifted"]),
        ("board", "10 mm, 0.4 mm aside", own("shift04.nc"), &["prove.shifted", "prove.into_board"]),
        ("board", "9 mm in its place", own("small.nc"), &["prove.wrong_size"]),
        ("board", "11 mm in its place", own("large.nc"), &["prove.wrong_size", "prove.into_board"]),
        ("board", "not through", own("shallow.nc"), &["prove.shallow"]),
        ("board", "a line through the board", own("line.nc"), &["prove.into_board"]),
        ("board", "nothing", own("nothing.nc"), &["prove.makes_nothing"]),
        ("board", "15 mm beside the board", ring(60.0, 15.0, 4.5), &["prove.outside_board"]),
        ("board", "in the air", milled("G0 X15.5 Y15\nG1 Z0.5 F50\nG2 I4.5 F200"), &["prove.makes_nothing"]),
        ("board", "a line in the hole", milled("G0 X18 Y15\nG1 Z-2 F50\nX22 F200"), &["prove.makes_nothing"]),
        ("board", "a scratch", milled("G0 X5 Y5\nG1 Z-0.1 F50\nX9 F200"), &["prove.makes_nothing"]),
        ("board", "the edge", milled("G0 X-0.5 Y-0.5\nG1 Z-2 F50\nX40.5 F200\nY30.5\nX-0.5\nY-0.5"), &[]),
        ("board2", "one of two too small", own("two-one-small.nc"), &["prove.wrong_size"]),
        ("board2", "one of two", ring(12.0, 15.0, 4.5), &["prove.missing"]),
    ];
    for (board, what, program, wanted) in rows {
        fs::write(home.join("tried.nc"), program).unwrap();
        let board = data().join(board);
        let (exit, told) =
            answer_of(home, &["prove", board.to_str().unwrap(), "tried.nc", "--tools", "1=end mill 1.0"]);
        let said = codes(&told["diagnostics"]);
        let errors: Vec<&str> = said.iter().copied().filter(|code| !is_note(code)).collect();
        assert_eq!((errors.as_slice(), exit), (wanted, i32::from(!wanted.is_empty())), "{what}: {told}");
        // Only missing features are named, with their position.
        let left = |code: &str| said.contains(&code);
        let left_out = [["prove.makes_nothing"], ["prove.into_board"], ["prove.outside_board"]];
        let hole = left_out.iter().any(|codes| wanted == codes) || what == "the edge";
        assert_eq!((left("prove.holes_left"), left("prove.edge_left")), (hole, what != "the edge"), "{what}");
    }
    let accepted =
        ["prove", data().join("board").to_str().unwrap(), "air.nc", "--accept", "prove.makes_nothing"]
            .map(str::to_owned)
            .into_iter()
            .chain(["--tools".to_owned(), "1=end mill 1.0".to_owned()])
            .collect::<Vec<_>>();
    fs::write(home.join("air.nc"), milled("G0 X5 Y5")).unwrap();
    assert_eq!(answer_of(home, &accepted.iter().map(String::as_str).collect::<Vec<_>>()).0, 0);
}

fn is_note(code: &str) -> bool {
    code.ends_with("_left") || ["prove.no_copper", "prove.loose", "gcode.others_refuse"].contains(&code)
}

#[test]
fn proof_ends_with_a_summary_sentence() {
    let folder = folder();
    let home = folder.path();
    let cam: Vec<&str> =
        CAM.split(' ').chain("--fix-gaps --to grbl -o out --save-job job.toml".split(' ')).collect();
    let (exit, said) = text(home, &cam);
    let proved = said.lines().find(|line| line.starts_with("Proved: ")).unwrap_or_default().to_owned();
    assert_eq!(exit, 0, "{said}");
    let (nets, gap) = proved
        .strip_prefix("Proved: ")
        .and_then(|rest| rest.strip_suffix(" mm"))
        .and_then(|rest| rest.split_once(" nets isolated, smallest gap "))
        .unwrap_or_else(|| panic!("{said}"));
    let (isolated, all) = nets.split_once(" of ").unwrap();
    assert!(isolated == all && all.parse::<u32>().unwrap() > 2, "{proved}");
    // The finest cut of the sample is the shallowest one of its V-bit.
    assert!((0.1..0.15).contains(&gap.parse::<f64>().unwrap()), "{proved}");
    // Proving the files gives the same sentence.
    fs::create_dir(home.join("board")).unwrap();
    for name in BOARD {
        fs::rename(home.join(name), home.join("board").join(name)).unwrap();
    }
    let files = fs::read_dir(home.join("out")).unwrap().map(|file| file.unwrap().path());
    let files: Vec<String> = files.map(|file| file.display().to_string()).collect();
    let files = files.iter().map(String::as_str).filter(|file| file.ends_with(".nc"));
    let prove: Vec<&str> = ["prove", "board", "--job", "job.toml"].into_iter().chain(files).collect();
    let (exit, said) = text(home, &prove);
    assert!(exit == 0 && said.contains(&proved), "{said}");
    // Without accepting the problem, it is not proved.
    let uncured: Vec<&str> = "cam board --to grbl -o other".split(' ').collect();
    let (exit, said) = text(home, &uncured);
    let unread =
        format!("Not proved: {} of {all} nets isolated, 1 open problem", all.parse::<u32>().unwrap() - 2);
    assert!(exit == 1 && said.contains(&unread) && !said.contains("\nProved"), "{said}");
    // Without copper there is nothing to prove.
    fs::remove_file(home.join("board").join(BOARD[1])).unwrap();
    for line in ["prove board OUT", "cam board --to grbl -o third"] {
        let words: Vec<&str> = line.split(' ').collect();
        let hole = || prove.iter().copied().find(|file| file.contains("drill")).unwrap();
        let words: Vec<&str> =
            words.into_iter().map(|word| if word == "OUT" { hole() } else { word }).collect();
        let (exit, said) = text(home, &words);
        assert!(said.contains("Nothing to prove: no copper layer is open.\n"), "{line}: {exit} {said}");
        assert!(!said.contains("Proved"), "{said}");
    }
}
