//! Tests that page and command line agree, on all sides of real boards and on misaligned layers. Also of
//! files that are next to a board.

use super::{BOARD, CAM, answer, codes, folder};
use annulus_app::engine::messages::{Answer, Request, Settings, ToExport, ToPlan, ToProve, ToRead};
use annulus_app::engine::{Cache, perform};
use annulus_core::machine::virtual_drill;
use annulus_core::project::saved::SaidOfFiles;
use std::fs;
use std::path::Path;

/// The page's worker on `files`: written files, and problems of the board.
fn page(files: &[(String, Vec<u8>)], aligned: bool, target: &str) -> (Vec<(String, String)>, Vec<String>) {
    let mut cache = Cache::default();
    let mut ask = |request| perform(request, &mut cache, &mut |_, _| {}).unwrap();
    let machine = Settings::of(&virtual_drill());
    let said = SaidOfFiles { aligned, ..SaidOfFiles::default() };
    let wanted = ToRead { files: files.to_vec(), said, machine: Some(machine.clone()), ..ToRead::default() };
    let Answer::Read(reading) = ask(Request::Read(wanted)) else { panic!() };
    let accept = vec!["plan.no_bit".to_owned()];
    let plan = ToPlan { board_key: 0, machine, work: reading.work, loaded: None, accept, laid: None };
    let mut read = Vec::new();
    for face in plan.work.faces() {
        let mut own = plan.clone();
        own.work.setup.face = face;
        let Answer::Planned(planned) = ask(Request::Plan(own.clone())) else { panic!() };
        let prove = ToProve { board_key: 0, program: planned.program, work: own.work };
        let Answer::Proved(proved) = ask(Request::Prove(prove)) else { panic!() };
        read.extend(proved.findings.into_iter().map(|finding| finding.id));
    }
    let wanted = ToExport { plan, read, target: target.to_owned(), text: None, lines_only_mm: None };
    let Answer::Exported(exported) = ask(Request::Export(wanted)) else { panic!() };
    assert_eq!(exported.unread, [], "all of it was read");
    let mut written: Vec<_> = exported.files().map(|file| (file.name.clone(), file.text.clone())).collect();
    written.push(("run-sheet.html".to_owned(), exported.sheet("en").html()));
    (written, reading.diagnostics.into_iter().map(|diagnostic| diagnostic.code).collect())
}

#[test]
fn real_boards_give_the_same_bytes_on_page_and_command_line() {
    let corpus = std::env::var_os("ANNULUS_CORPUS").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/corpus"),
        std::path::PathBuf::from,
    );
    if !corpus.is_dir() {
        assert!(std::env::var_os("ANNULUS_NOTHING_SKIPPED").is_none(), "no corpus");
        println!("skipped: no corpus");
        return;
    }
    let out = tempfile::tempdir().unwrap();
    let take = "--to grbl --accept short,gap,break,gone,lost,hit,ring,sliver,shallow,remnant,plan.no_bit";
    for name in ["kicad/2013-clockblock", "easyeda/easytrace-tht"] {
        let folder = corpus.join(name);
        let mut names: Vec<_> = fs::read_dir(&folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort_unstable();
        let files: Vec<_> =
            names.iter().map(|name| (name.clone(), fs::read(folder.join(name)).unwrap())).collect();
        let (exit, told) = answer(out.path(), &format!("cam {} {take} -o out", folder.display()));
        assert_eq!(exit, 0, "{name}: {told}");
        let (page, _) = page(&files, false, "grbl");
        assert_eq!(page.len(), told["files"].as_array().unwrap().len() + 1, "{name}");
        for (file, text) in &page {
            let written = fs::read_to_string(out.path().join("out").join(file)).unwrap();
            assert!(*text == written, "{name}: {file}: {} {}", text.len(), written.len());
        }
        fs::remove_dir_all(out.path().join("out")).unwrap();
    }
}

#[test]
fn align_moves_shifted_layers_as_the_page_does() {
    let folder = folder();
    let home = folder.path();
    // The holes as if exported with another zero point: 5 mm off in X.
    let text = fs::read_to_string(home.join(BOARD[0])).unwrap();
    let moved = |line: &str| {
        let (x, y) = line.strip_prefix('X')?.split_once('Y')?;
        Some(format!("X{:.3}Y{y}", x.parse::<f64>().ok()? + 5.0))
    };
    let lines: Vec<String> =
        text.lines().map(|line| moved(line).unwrap_or_else(|| line.to_owned())).collect();
    assert_ne!(lines.join("\n"), text);
    fs::write(home.join(BOARD[0]), lines.join("\n")).unwrap();
    let files = BOARD.map(|name| (name.to_owned(), fs::read(home.join(name)).unwrap()));
    let mut both = Vec::new();
    for (flag, aligned) in [("", false), ("--align-layers", true)] {
        let take = format!("--accept short,gap,break,gone,lost,hit,ring,sliver --to grbl -o out{aligned}");
        let (exit, told) = answer(home, &format!("{CAM} {take} {flag}"));
        assert_eq!(exit, 0, "{told}");
        let codes = codes(&told["diagnostics"]);
        assert_eq!(codes.contains(&"board.holes_shifted"), !aligned, "{codes:?}");
        let (page, diagnostics) = page(&files, aligned, "grbl");
        let out = home.join(format!("out{aligned}"));
        assert_eq!(fs::read_dir(&out).unwrap().count(), page.len());
        for (name, text) in &page {
            assert!(fs::read_to_string(out.join(name)).unwrap() == *text, "{name}");
        }
        let written = page;
        let told = |code: &str| diagnostics.iter().any(|diagnostic| diagnostic == code);
        assert_eq!((told("board.holes_shifted"), told("board.moved")), (!aligned, aligned));
        both.push(written);
    }
    assert_ne!(both[0], both[1]);
}

#[test]
fn unrelated_files_are_ignored_but_a_second_copper_is_refused() {
    let folder = folder();
    let home = folder.path();
    let board = home.join("board");
    fs::create_dir_all(board.join("old")).unwrap();
    for name in BOARD {
        fs::copy(home.join(name), board.join(name)).unwrap();
    }
    fs::write(board.join("photo.png"), [[0x89_u8, 0x50, 0xFF, 0x03]; 64].concat()).unwrap();
    fs::write(board.join("zero"), b"").unwrap();
    let take = "--accept short,gap,break,gone,lost,hit,ring,sliver --to grbl -o out";
    let (exit, told) = answer(home, &format!("cam board {take}"));
    assert_eq!(exit, 0, "{told}");
    fs::write(board.join("more.drl"), b"").unwrap();
    let (exit, told) = answer(home, &format!("cam board {take}"));
    assert_eq!((exit, &told["error"]["code"]), (1, &"refused.empty".into()), "{told}");
    fs::remove_file(board.join("more.drl")).unwrap();
    // The same copper without one pad, first in its own folder, then next to the requested files.
    let copper = fs::read_to_string(home.join(BOARD[1])).unwrap();
    let flash = copper.lines().rfind(|line| line.ends_with("D03*")).unwrap();
    for (place, command, stops) in
        [("board/old/sensor-top.gbr", "cam board", true), ("more-top.gbr", CAM, false)]
    {
        fs::write(home.join(place), copper.replacen(&format!("{flash}\n"), "", 1)).unwrap();
        let (exit, told) = answer(home, &format!("{command} {take}"));
        assert_eq!(exit, i32::from(stops), "{place}: {told}");
        assert_eq!(stops, told["error"]["code"] == "board.two_coppers", "{place}: {told}");
    }
}
