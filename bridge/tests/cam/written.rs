//! Tests that written files are proved: files of `annulus cam` and handwritten G-code, against a raster of
//! the copper painted here, independent of the product. Also jobs that isolate nothing, and fixes that end
//! when they open no more gaps.

use super::{answer, codes};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// Three pads of 2 mm in a row, each with a hole. The board is 12 by 6 mm with its zero at the corner.
const PADS: [(f64, f64); 3] = [(2.0, 3.0), (6.0, 3.0), (10.0, 3.0)];
const OUTLINE: &str = "%FSLAX34Y34*%\n%MOMM*%\n%TF.FileFunction,Profile,NP*%\n%ADD10C,0.1*%\nD10*\n\
    X0Y0D02*\nX120000Y0D01*\nX120000Y60000D01*\nX0Y60000D01*\nX0Y0D01*\nM02*\n";

fn board(home: &Path, pads: &[(f64, f64)], size: f64) {
    let flash =
        |(x, y): &(f64, f64)| format!("X{}Y{}D03*\n", (x * 1e4).round() as i64, (y * 1e4).round() as i64);
    let flashes: String = pads.iter().map(flash).collect();
    let copper = format!(
        "%FSLAX34Y34*%\n%MOMM*%\n%TF.FileFunction,Copper,L1,Top*%\n%ADD10R,{size}X{size}*%\nD10*\n{flashes}M02*\n"
    );
    let holes: String = PADS.iter().map(|(x, y)| format!("X{x:.3}Y{y:.3}\n")).collect();
    fs::create_dir_all(home.join("board")).unwrap();
    fs::write(home.join("board/top.gbr"), copper).unwrap();
    fs::write(home.join("board/edge.gbr"), OUTLINE).unwrap();
    fs::write(home.join("board/holes.drl"), format!("M48\nMETRIC\nT1C0.8\n%\nG90\nT1\n{holes}M30\n"))
        .unwrap();
}

/// Pad area within `half` of any of these vertical lines, mm², by counting squares of 10 µm.
fn lost_by_raster(lines: &[f64], half: f64) -> f64 {
    let step = 0.01;
    let cells = |length: f64| (length / step).round() as usize;
    let mut count = 0_u32;
    for row in 0..cells(6.0) {
        for column in 0..cells(12.0) {
            let (x, y) = ((column as f64 + 0.5) * step, (row as f64 + 0.5) * step);
            let copper = PADS.iter().any(|(px, py)| (x - px).abs() < 1.0 && (y - py).abs() < 1.0);
            let hole = PADS.iter().any(|(px, py)| (x - px) * (x - px) + (y - py) * (y - py) < 0.41 * 0.41);
            count += u32::from(copper && !hole && lines.iter().any(|line| (x - line).abs() < half));
        }
    }
    f64::from(count) * step * step
}

/// Vertical cuts over the whole board, 0.1 mm deep.
fn cuts(lines: &[f64]) -> String {
    let cut = |x: &f64| format!("G0 X{x:.3} Y-1\nG0 Z0.5\nG1 Z-0.1 F60\nG1 Y7 F300\nG0 Z5\n");
    let cuts: String = lines.iter().map(cut).collect();
    format!("(tool 1: end mill 0.4)\nG21 G90\nM3 S10000\nG0 Z5\n{cuts}M5\nM2\n")
}

fn drilled(told: &Value) -> [u64; 3] {
    ["missing", "doubled", "shifted"].map(|key| told["drilled"][key].as_u64().unwrap())
}

#[test]
fn copper_lost_to_handwritten_g_code_agrees_with_a_raster() {
    let folder = tempfile::tempdir().unwrap();
    let home = folder.path();
    board(home, &PADS, 2.0);
    // Lines between the pads, and what they remove from the pads.
    for (lines, good) in [([4.0, 8.0], true), ([4.0, 9.1], false), ([5.4, 8.0], false), ([6.0, 8.0], false)] {
        fs::write(home.join("cut.nc"), cuts(&lines)).unwrap();
        let (exit, told) = answer(home, "prove board cut.nc");
        assert_eq!(exit, i32::from(!good), "{lines:?}: {told}");
        let (found, exact) = (told["copper_lost_mm2"].as_f64().unwrap(), lost_by_raster(&lines, 0.2));
        assert!((found - exact).abs() < 0.03, "{lines:?}: {found} not {exact} mm²");
        let harm = |code: &&str| matches!(*code, "proof.lost" | "proof.break");
        assert_eq!(codes(&told["findings"]).iter().any(harm), !good, "{told}");
        assert_eq!(drilled(&told), [0, 0, 0], "it drills nothing");
    }
    // One line is missing, and one does not cut through the copper.
    fs::write(home.join("cut.nc"), cuts(&[4.0])).unwrap();
    let (exit, told) = answer(home, "prove board cut.nc");
    assert_eq!((exit, codes(&told["findings"])), (1, vec!["proof.short"]), "{told}");
    fs::write(home.join("cut.nc"), cuts(&[4.0, 8.0]).replace("Z-0.1", "Z-0.02")).unwrap();
    let (exit, told) = answer(home, "prove board cut.nc");
    assert_eq!(exit, 1);
    assert!(codes(&told["findings"]).contains(&"proof.shallow"), "{told}");
    // The same lines with another tool than in the header.
    fs::write(home.join("cut.nc"), cuts(&[4.0, 8.0])).unwrap();
    let (exit, told) = super::answer_of(home, &["prove", "board", "cut.nc", "--tools", "1=end mill 3"]);
    assert_eq!(exit, 1, "{told}");
    let exact = lost_by_raster(&[4.0, 8.0], 1.5);
    assert!((told["copper_lost_mm2"].as_f64().unwrap() - exact).abs() < 0.05, "{exact}: {told}");
}

#[test]
fn holes_missing_doubled_and_shifted_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let home = folder.path();
    board(home, &PADS, 2.0);
    let inches = |x: f64, y: f64| format!("X{:.5} Y{:.5}\n", x / 25.4, y / 25.4);
    let file = |places: &[(f64, f64)]| {
        let places: String = places.iter().map(|(x, y)| inches(*x, *y)).collect();
        format!("G20 G90\nM3 S9000\nG0 Z0.2\nG99 G81 R0.04 Z-0.09 F5 {places}G80\nG0 Z0.2\nM5\nM30\n")
    };
    let [a, b, c] = PADS;
    type Row<'a> = (&'a [(f64, f64)], [u64; 3]);
    let rows: [Row<'_>; 5] = [
        (&[a, b, c], [0, 0, 0]),
        (&[a, c], [1, 0, 0]),
        (&[a, b, b, c], [0, 1, 0]),
        (&[a, (b.0 + 0.3, b.1), c], [0, 0, 1]),
        (&[a, (b.0, b.1 + 2.5), c], [1, 0, 0]),
    ];
    for (places, wanted) in rows {
        fs::write(home.join("drill.nc"), file(places)).unwrap();
        let (exit, told) = super::answer_of(home, &["prove", "board", "drill.nc", "--tools", "1=drill 0.8"]);
        assert_eq!((drilled(&told), exit), (wanted, i32::from(wanted != [0, 0, 0])), "{places:?}: {told}");
    }
    let (exit, told) = answer(home, "prove board drill.nc");
    assert_eq!((exit, &told["error"]["code"]), (1, &"readback.no_tool".into()), "{told}");
}

#[test]
fn job_without_isolation_is_reported_once_and_written() {
    let folder = tempfile::tempdir().unwrap();
    let home = folder.path();
    board(home, &PADS, 2.0);
    let (exit, told) = answer(home, "cam board --set isolate.on=no --to grbl -o out");
    assert_eq!((exit, &told["findings_unread"]), (0, &0.into()), "{told}");
    assert_eq!(codes(&told["programs"][0]["findings"]), ["proof.not_isolated"]);
}

#[test]
fn fixes_change_the_whole_cut_first_then_single_places() {
    let folder = tempfile::tempdir().unwrap();
    let home = folder.path();
    // Gaps of 0.13, 0.135, 0.13 and 0.11 mm between pads of 1 mm; the default cut is 0.143 mm wide.
    let pads: Vec<(f64, f64)> = [1.0, 2.13, 3.265, 4.395, 5.505].map(|x| (x, 3.0)).to_vec();
    board(home, &pads, 1.0);
    let (exit, told) = answer(home, "cam board --to grbl -o out --set drill.on=no");
    assert_eq!((exit, &told["error"]["code"]), (1, &"cam.unread_findings".into()), "{told}");
    let side = &told["programs"][0];
    let gaps = side["groups"].as_array().unwrap().iter().find(|group| group["kind"] == "gap").unwrap();
    assert_eq!((&gaps["count"], &gaps["unread"]), (&4.into(), &4.into()), "{gaps}");
    assert_eq!(
        (&side["whole"]["shallower"]["opens"], &side["whole"]["rest"]),
        (&3.into(), &1.into()),
        "{side}"
    );
    let (exit, told) = answer(home, "cam board --to grbl -o out --set drill.on=no --fix-gaps");
    assert_eq!(exit, 0, "{told}");
    let side = &told["programs"][0];
    let joined = |code: &&str| matches!(*code, "proof.gap" | "proof.short");
    assert!(!codes(&side["findings"]).iter().any(joined), "{side}");
    assert!(side["cured"]["depth_mm"].as_f64().is_some_and(|depth| depth < 0.08), "{side}");
    assert_eq!(side["cured"]["places"], 1, "{side}");
}

#[test]
fn files_that_differ_from_their_program_are_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let home = folder.path();
    board(home, &PADS, 2.0);
    let text = annulus_core::post::shipped().find(|(name, _)| *name == "grbl").unwrap().1;
    let rows = [
        ("GRBL\"", "GRBL of mine\"", None),
        // The user may shift the machine's zero: that is reported, and written.
        ("shift_mm = [0.0, 0.0]", "shift_mm = [0.05, 0.0]", None),
        ("X@X@", "X@X+0.05@", Some("written.shifted")),
        ("G1 X@X@ Y@Y@ Z@Z@", "G1 X@X@ Z@Z@", Some("written.unread")),
        ("M3 S@S@\n", "", Some("written.still")),
        ("G21", "G20", Some("written.missing")),
    ];
    for (from, to, wanted) in rows {
        fs::write(home.join("own.toml"), text.replace(from, to)).unwrap();
        let _ = fs::remove_dir_all(home.join("out"));
        let (exit, told) = answer(home, "cam board --to own.toml -o out");
        assert_eq!(told["error"]["code"].as_str(), wanted, "{from} → {to}: {told}");
        assert_eq!(
            (exit, home.join("out").exists()),
            (i32::from(wanted.is_some()), wanted.is_none()),
            "{from}"
        );
        let moved = codes(&told["diagnostics"]).contains(&"written.moved");
        assert_eq!(moved, from.starts_with("shift"), "{told}");
        if let Some(code) = wanted.filter(|code| *code != "written.missing") {
            let (exit, told) =
                super::answer_of(home, &["cam", "board", "--to", "own.toml", "-o", "out", "--accept", code]);
            assert_eq!(exit, 0, "{told}");
        }
    }
}
