//! Tests that files of `annulus cam` pass the proof with their own job, and fail with one changed word.
//! Uses the sample, and boards of the corpus if present.

use super::{BOARD, answer, answer_of, codes, folder};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// Counts other than those of copper; all zero if nothing is wrong.
fn counts(told: &Value) -> Vec<(&str, u64)> {
    let of = |part: &str, keys: &[&'static str]| -> Vec<(&'static str, u64)> {
        keys.iter().map(|key| (*key, told[part][key].as_u64().unwrap_or(u64::MAX))).collect()
    };
    let holes = of("drilled", &["missing", "doubled", "shifted", "wrong_size", "shallow", "slots_missing"]);
    let edge = of("cut_out", &["missing", "into_board", "inner_missing", "tabs_missing", "loose"]);
    let all = [holes, edge].concat();
    all.into_iter().filter(|(_, count)| *count > 0).collect()
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> =
        entries.filter(|path| path.extension().is_some_and(|end| end == "nc")).collect();
    files.sort_unstable();
    files
}

fn prove(home: &Path, board: &str, files: &[PathBuf], rest: &[&str]) -> (i32, Value) {
    let files: Vec<&str> = files.iter().map(|file| file.to_str().unwrap()).collect();
    answer_of(home, &[&["prove", board], files.as_slice(), rest].concat())
}

/// The sample in `board`, its GRBL files in `out`, and its job.
fn sample(home: &Path) -> Vec<PathBuf> {
    fs::create_dir(home.join("board")).unwrap();
    for name in BOARD {
        fs::rename(home.join(name), home.join("board").join(name)).unwrap();
    }
    let cam = "cam board --machine hobby --fix-gaps --to grbl -o out --save-job job.toml";
    let (exit, told) = answer(home, cam);
    assert_eq!(exit, 0, "{told}");
    files(&home.join("out"))
}

fn no_deeper(text: &str, depth: f64) -> String {
    let word = |word: &str| match word.strip_prefix("Z-").and_then(|deep| deep.parse::<f64>().ok()) {
        Some(deep) if deep > depth => format!("Z-{depth}"),
        _ => word.to_owned(),
    };
    let line = |line: &str| line.split(' ').map(word).collect::<Vec<_>>().join(" ") + "\n";
    text.lines().map(line).collect()
}

#[test]
fn own_files_prove_with_and_without_their_job() {
    let folder = folder();
    let home = folder.path();
    let files = sample(home);
    for rest in [&["--job", "job.toml"][..], &[]] {
        let (exit, told) = prove(home, "board", &files, rest);
        assert_eq!((exit, counts(&told), &told["toolpaths_repeated"]), (0, vec![], &0.into()), "{told}");
        assert!(told["copper_lost_mm2"].as_f64().unwrap() < 0.5, "{told}");
    }
    // The same job as Annulus' own program.
    let (exit, told) =
        answer(home, "cam board --job job.toml --machine hobby --fix-gaps --to program -o own");
    assert_eq!(exit, 0, "{told}");
    let (exit, told) = answer(home, "prove board own/board-top.program --job job.toml");
    assert_eq!((exit, counts(&told)), (0, vec![]), "{told}");
    assert!(told["copper_lost_mm2"].is_number(), "{told}");
    // A board without copper: holes and edge are still proved.
    fs::remove_file(home.join("board").join(BOARD[1])).unwrap();
    let holes = &files[1..];
    let (exit, told) = prove(home, "board", holes, &[]);
    assert_eq!(
        (exit, counts(&told), codes(&told["diagnostics"]).contains(&"prove.no_copper")),
        (0, vec![], true)
    );
    assert_eq!(
        prove(home, "board", &holes[1..], &[]).1["drilled"]["missing"].as_u64().map(|some| some > 0),
        Some(true)
    );
}

#[test]
fn changed_words_in_a_file_fail_the_proof() {
    let folder = folder();
    let home = folder.path();
    let files = sample(home);
    let texts: Vec<String> = files.iter().map(|file| fs::read_to_string(file).unwrap()).collect();
    type Change = fn(&str) -> String;
    // The first tab of the last pass cut through, then every tab.
    let tab = |text: &str, most: usize| {
        let (before, last) = text.split_at(text.find("Z-2.1000").unwrap());
        before.to_owned() + &last.replacen("Z-1.0000", "Z-2.1000", most)
    };
    let rows: [(&str, Change, &str); 7] = [
        ("drill-0.8", |text| text.replace("drill 0.8", "drill 1.0"), "wrong_size"),
        ("drill-3.2", |text| text.replace("drill 3.2", "drill 0.4"), "wrong_size"),
        ("drill-0.8", |text| text.replace("drill 0.8", "V-bit 30 deg, tip 0.1"), "wrong_size"),
        ("drill-0.8", |text| no_deeper(text, 0.28), "shallow"),
        ("cut-out", |text| text.replace("mill 1.5", "mill 3"), "into_board"),
        ("cut-out", |text| text.replace("mill 1.5", "mill 0.8"), "missing"),
        ("cut-out", |text| no_deeper(text, 0.3), "missing"),
    ];
    for (name, change, wanted) in rows {
        let index = files.iter().position(|file| file.to_string_lossy().contains(name)).unwrap();
        assert_ne!(change(&texts[index]), texts[index], "{name}: {wanted}");
        fs::write(&files[index], change(&texts[index])).unwrap();
        let (exit, told) = prove(home, "board", &files, &["--job", "job.toml"]);
        let found = counts(&told);
        assert_eq!((exit, found.iter().any(|(key, _)| *key == wanted)), (1, true), "{name}: {told}");
        if told["drilled"]["wrong_size"] != 0 && change(&texts[index]).contains("V-bit") {
            assert!(told["copper_lost_mm2"].as_f64().unwrap() > 10.0, "{told}");
        }
        fs::write(&files[index], &texts[index]).unwrap();
    }
    let index = files.iter().position(|file| file.to_string_lossy().contains("cut-out")).unwrap();
    for (most, wanted) in
        [(1, vec![("tabs_missing", 1)]), (usize::MAX, vec![("tabs_missing", 1), ("loose", 1)])]
    {
        let changed = tab(&texts[index], most);
        assert_ne!(changed, texts[index]);
        fs::write(&files[index], changed).unwrap();
        let (exit, told) = prove(home, "board", &files, &["--job", "job.toml"]);
        assert_eq!((exit, counts(&told)), (1, wanted), "{told}");
        assert!(codes(&told["diagnostics"]).contains(&"prove.tabs_missing"), "{told}");
    }
    fs::write(&files[index], &texts[index]).unwrap();
    // Tools given by the user: for one file that names none, next to others with the same number.
    let nameless = |text: &str| text.replace("tool 3", "tool 1").replace("(tool 1: drill 0.8)", "");
    fs::write(&files[2], nameless(&texts[2])).unwrap();
    let of_one = |size: &str| format!("03-top-drill-0.8.nc:1=drill {size}");
    for (said, exit) in [(of_one("1.2"), 1), (of_one("0.8"), 0), ("nowhere.nc:1=drill 1".to_owned(), 2)] {
        assert_eq!(prove(home, "board", &files, &["--tools", &said]).0, exit, "{said}");
    }
    fs::write(&files[2], &texts[2]).unwrap();
    // A file that is missing or given twice.
    let without = |word: &str| -> Vec<PathBuf> {
        files.iter().filter(|file| !file.to_string_lossy().contains(word)).cloned().collect()
    };
    let said = |given: &[PathBuf], rest: &[&str]| {
        let (exit, told) = prove(home, "board", given, rest);
        assert_eq!(exit, 1, "{told}");
        codes(&told["diagnostics"]).into_iter().map(str::to_owned).collect::<Vec<_>>()
    };
    assert!(said(&without("cut-out"), &["--job", "job.toml"]).contains(&"prove.edge_missing".to_owned()));
    assert!(said(&without("isolate"), &[]).contains(&"prove.not_isolated".to_owned()));
    let twice = [files.as_slice(), &files[..1]].concat();
    assert!(said(&twice, &[]).contains(&"prove.repeated".to_owned()));
}

#[test]
fn programs_of_both_sides_are_proved_each_on_its_side() {
    let folder = folder();
    let home = folder.path();
    fs::create_dir(home.join("board")).unwrap();
    for name in BOARD {
        fs::rename(home.join(name), home.join("board").join(name)).unwrap();
    }
    let top = fs::read_to_string(home.join("board").join(BOARD[1])).unwrap();
    assert!(top.contains("Copper,L1,Top"));
    fs::write(home.join("board/sensor-bottom.gbr"), top.replace("Copper,L1,Top", "Copper,L2,Bot")).unwrap();
    let cam = "cam board --machine hobby --fix-gaps --to program -o own --save-job job.toml";
    let (exit, told) = answer(home, cam);
    assert_eq!(exit, 0, "{told}");
    let (top, bottom) = ("own/board-top.program", "own/board-bottom.program");
    let (exit, told) = answer(home, &format!("prove board {top} {bottom} --job job.toml"));
    assert_eq!((exit, counts(&told)), (0, vec![]), "{told}");
    assert_eq!(told["sides"].as_array().map(Vec::len), Some(2), "{told}");
    // One of them, on the side in its name; on the other side it is another board.
    let missing = |told: &Value| told["findings"].as_array().map(Vec::len);
    let (_, alone) = answer(home, &format!("prove board {bottom} --job job.toml"));
    let (_, said) = answer(home, &format!("prove board {bottom} --side bottom --job job.toml"));
    assert_eq!(missing(&alone), missing(&said), "{alone}");
}

/// A double-sided board with a window: pins, and an inner contour.
fn two_sides_and_a_window(home: &Path) {
    fs::create_dir(home.join("board")).unwrap();
    for name in BOARD {
        fs::rename(home.join(name), home.join("board").join(name)).unwrap();
    }
    let change = |from: &str, to: &str, old: &str, new: &str| {
        let text = fs::read_to_string(home.join("board").join(from)).unwrap();
        assert!(text.contains(old), "{from}: {old}");
        fs::write(home.join("board").join(to), text.replace(old, new)).unwrap();
    };
    change(BOARD[1], "sensor-bottom.gbr", "Copper,L1,Top", "Copper,L2,Bot");
    let corners = ["X2000000Y16000000D02", "X5000000Y16000000D01", "X5000000Y20500000D01"];
    let window = [&corners[..], &["X2000000Y20500000D01", "X2000000Y16000000D01", "M02"]].concat();
    change(BOARD[2], BOARD[2], "M02*", &(window.join("*\n") + "*"));
}

#[test]
fn missing_pins_and_inner_contours_fail_the_proof() {
    let folder = folder();
    let home = folder.path();
    two_sides_and_a_window(home);
    let (exit, told) =
        answer(home, "cam board --machine hobby --fix-gaps --to grbl -o out --save-job job.toml");
    assert_eq!(exit, 0, "{told}");
    let files = files(&home.join("out"));
    let (exit, told) = prove(home, "board", &files, &["--job", "job.toml"]);
    assert_eq!((exit, counts(&told)), (0, vec![]), "{told}");
    let texts: Vec<String> = files.iter().map(|file| fs::read_to_string(file).unwrap()).collect();
    let (pins, edge) = (&texts[0], texts.last().unwrap());
    assert!(pins.contains("drill 3)") && edge.contains("end mill 1.5)"), "{files:?}");
    // The inner contour comes first, then the outline.
    let around = edge.find("\nG0 X-0.7490").unwrap();
    let within = edge.find("\nG0 X2.7490").unwrap();
    let (head, rest) = edge.split_at(within);
    let (inner, round) = rest.split_at(around - within);
    let last = files.len() - 1;
    let rows = [
        (0, pins.replacen("X64.0000", "X64.3000", 1), ("shifted", 1), "prove.shifted"),
        (0, pins.replacen("G1 Z-8.2995", "G1 Z-0.5000", 1), ("shallow", 1), "prove.shallow"),
        (last, format!("{head}{round}"), ("inner_missing", 1), "prove.inner_missing"),
        (
            last,
            format!("{head}{}{round}", no_deeper(inner, 1.0)),
            ("inner_missing", 1),
            "prove.inner_missing",
        ),
        (
            last,
            format!("{head}{}{round}", inner.replace("Y19.7510", "Y18.0000")),
            ("inner_missing", 1),
            "prove.inner_missing",
        ),
    ];
    for (index, text, wanted, code) in rows {
        assert_ne!(text, texts[index], "{code}");
        fs::write(&files[index], text).unwrap();
        let (exit, told) = prove(home, "board", &files, &["--job", "job.toml"]);
        assert_eq!((exit, counts(&told)), (1, vec![wanted]), "{told}");
        assert!(codes(&told["diagnostics"]).contains(&code), "{told}");
        fs::write(&files[index], &texts[index]).unwrap();
    }
    let (exit, told) = prove(home, "board", &files[1..], &["--job", "job.toml"]);
    assert_eq!((exit, counts(&told)), (1, vec![("missing", 2)]), "{told}");
}

/// Boards of the corpus: with ring-milled holes, two holes at one position, slots. Every run tests the
/// first two.
const BOARDS: [&str; 4] =
    ["eagle/pcb-tools-board", "proteus/yawdamper", "horizon/usbkvm", "kicad/2013-clockblock"];

#[test]
fn files_of_real_boards_are_proved_with_their_job() {
    let corpus = std::env::var_os("ANNULUS_CORPUS")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/corpus"), PathBuf::from);
    if !corpus.is_dir() {
        assert!(std::env::var_os("ANNULUS_NOTHING_SKIPPED").is_none(), "no corpus");
        println!("skipped: no corpus");
        return;
    }
    let some = if std::env::var_os("ANNULUS_LONG").is_some() { BOARDS.len() } else { 2 };
    for name in &BOARDS[..some] {
        let folder = tempfile::tempdir().unwrap();
        let home = folder.path();
        let board = corpus.join(name).to_str().unwrap().to_owned();
        // One of two holes at the same position is an error that must be accepted.
        let accept = "drill.holes_inside,drill.holes_overlap";
        let cam = format!(
            "cam {board} --machine hobby --fix-gaps --to grbl -o out --save-job job.toml --accept {accept}"
        );
        let (exit, told) = answer(home, &cam);
        assert_eq!(exit, 0, "{name}: {told}");
        let files = files(&home.join("out"));
        let (exit, told) = prove(home, &board, &files, &["--job", "job.toml", "--accept", accept]);
        assert_eq!((exit, counts(&told)), (0, vec![]), "{name}: {told}");
        // Without the file that mills slots, and with slots that are scratches.
        if name.contains("usbkvm") {
            let is_slots = |file: &&PathBuf| file.to_string_lossy().contains("mill-holes");
            let rest: Vec<PathBuf> = files.iter().filter(|file| !is_slots(file)).cloned().collect();
            for job in [&["--job", "job.toml"][..], &[]] {
                let (exit, told) = prove(home, &board, &rest, job);
                let missing = told["drilled"]["slots_missing"].as_u64();
                assert_eq!((exit, missing > Some(0)), (1, true), "{told}");
            }
            for file in files.iter().filter(is_slots) {
                fs::write(file, no_deeper(&fs::read_to_string(file).unwrap(), 0.3)).unwrap();
            }
            let (exit, told) = prove(home, &board, &files, &["--job", "job.toml"]);
            assert_eq!((exit, told["drilled"]["slots_missing"].as_u64() > Some(0)), (1, true), "{told}");
        }
    }
}
