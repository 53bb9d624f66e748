//! Tests that pages drive a GRBL controller through the bridge. The controller is simulated, on a
//! pseudo-terminal.

use super::client::{PATIENCE, Running, output};
use super::mill::{drills, ends, holes, home, offer, serve, set_zero, start, until_status, upload};
use crate::pty::Board;
use annulus_core::control::{Ending, State, Trust};
use annulus_core::grbl::RESET_KEY;
use annulus_core::machine::{RackTool, ToolWear, Value, hobby_3018};
use annulus_core::wire::{Ask, Control, JobEnd, Tell};
use annulus_host::File;
use annulus_host::journal::sealed;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::json;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, Instant};
use tempfile::TempDir;

const ZERO: [f64; 3] = [-20.0, -20.0, -10.0];

fn plunges(board: &Board) -> usize {
    board.heard().lines().filter(|line| line.contains("G1Z-")).count()
}

fn exit_of(bridge: &mut Running) -> Option<i32> {
    let since = Instant::now();
    loop {
        if let Some(exit) = bridge.child.try_wait().unwrap() {
            return exit.code();
        }
        assert!(since.elapsed() < PATIENCE, "the bridge does not end");
        sleep(Duration::from_millis(20));
    }
}

#[test]
fn job_on_a_controller_continues_without_its_page_and_stops() {
    let board = Board::at(115_200);
    let bridge = serve(TempDir::new().unwrap(), &board.port, "1");
    let (mut worker, mut viewer) = (bridge.page(), bridge.page());
    set_zero(&mut worker, ZERO);
    let job = upload(&bridge, &worker, &holes(12));
    start(&mut worker, &job, 0);
    drills(&mut worker, 1);
    drop(worker);
    viewer.until(|tell| matches!(tell, Tell::Control(Control { taken: false, viewers: 1, .. })));
    let seen = until_status(&mut viewer, |status| status.holes_done >= 3);
    assert_eq!(seen.state, State::Running);
    viewer.ask(&Ask::Stop);
    let JobEnd { job: ended, ending, .. } = ends(&mut viewer);
    assert_eq!((&ended, ending), (&job, Ending::Stopped));
    let rest = until_status(&mut viewer, |status| status.state == State::Ready);
    assert_eq!((rest.trust, rest.spindle_rpm), (Trust::Trusted, 0));
    // A later page gets the offer and the program, and finishes the job.
    let mut later = bridge.page();
    let offered = offer(&mut later);
    assert_eq!(offered.job, job);
    assert_eq!(bridge.job((&later.session, &later.key), "GET", &job, b"").status, 200);
    assert!(later.take_control(false));
    start(&mut later, &job, offered.next_leg);
    let JobEnd { ending, holes_done, .. } = ends(&mut later);
    assert_eq!((ending, holes_done), (Ending::Done, 12));
    assert!((12..=13).contains(&plunges(&board)), "{}", board.heard());
}

#[test]
fn killed_bridge_resumes_the_job_of_a_controller() {
    let board = Board::at(115_200);
    let mut bridge = serve(TempDir::new().unwrap(), &board.port, "1");
    let mut page = bridge.page();
    set_zero(&mut page, ZERO);
    let job = upload(&bridge, &page, &holes(6));
    start(&mut page, &job, 0);
    drills(&mut page, 2);
    bridge.child.kill().unwrap();
    bridge.child.wait().unwrap();
    let bridge = serve(bridge.home.take().unwrap(), &board.port, "1");
    let mut page = bridge.page();
    let offered = offer(&mut page);
    assert!(offered.job == job && offered.holes_done >= 2 && offered.holes_total == 6, "{offered:?}");
    home(&mut page);
    start(&mut page, &job, offered.next_leg);
    let JobEnd { ending, holes_done, .. } = ends(&mut page);
    assert_eq!((ending, holes_done), (Ending::Done, 6));
    assert!((6..=7).contains(&plunges(&board)), "{}", board.heard());
}

#[test]
fn ended_bridge_stops_the_controller() {
    let board = Board::at(115_200);
    let mut bridge = serve(TempDir::new().unwrap(), &board.port, "1");
    let mut page = bridge.page();
    set_zero(&mut page, ZERO);
    let job = upload(&bridge, &page, &holes(12));
    start(&mut page, &job, 0);
    drills(&mut page, 1);
    kill_process(Pid::from_child(&bridge.child), Signal::TERM).unwrap();
    assert_eq!(exit_of(&mut bridge), Some(0));
    let report = board.report();
    sleep(Duration::from_millis(500));
    assert!(!report.contains("<Run"), "{report}");
    assert_eq!(board.report().split('|').nth(1), report.split('|').nth(1), "nothing moves");
}

#[test]
fn stop_at_a_lost_port_stops_the_controller_that_returns() {
    let (board, home) = (Board::at(115_200), TempDir::new().unwrap());
    // Annulus must not reset the controller: only STOP may hold what another program started.
    let settings = [(RESET_KEY.to_owned(), Value::Text("never".to_owned()))];
    fs::create_dir(home.path().join("grbl")).unwrap();
    fs::write(home.path().join("grbl").join(File::ControllerSettings.name()), sealed(&settings)).unwrap();
    let link = home.path().join("port");
    symlink(&board.port, &link).unwrap();
    let bridge = serve(home, link.to_str().unwrap(), "1");
    let mut page = bridge.page();
    // The controller hangs, and its port is gone.
    fs::remove_file(&link).unwrap();
    board.freezes();
    until_status(&mut page, |status| status.alarm.as_ref().is_some_and(|why| why.code == "grbl.no_answer"));
    page.ask(&Ask::Stop);
    // The bridge has read STOP when it answers the next frame.
    page.ask(&Ask::Ping { stamp: 1.0 });
    page.until(|tell| *tell == Tell::Pong { stamp: 1.0 });
    let busy = Board::busy();
    assert!(busy.report().contains("<Run"));
    symlink(&busy.port, &link).unwrap();
    let since = Instant::now();
    while !busy.heard().contains('!') {
        assert!(since.elapsed() < PATIENCE, "no STOP: {:?}", busy.heard());
        sleep(Duration::from_millis(20));
    }
    let heard = busy.heard();
    assert!(heard.split('!').next().unwrap().chars().all(|byte| byte == '?'), "{heard:?}");
    page.until(|tell| matches!(tell, Tell::Controller(_)));
    assert!(!busy.report().contains("<Run"));
}

#[test]
fn jog_of_a_controller_ends_with_its_page() {
    let board = Board::at(115_200);
    let bridge = serve(TempDir::new().unwrap(), &board.port, "1");
    let (mut worker, mut viewer) = (bridge.page(), bridge.page());
    home(&mut worker);
    worker.ask(&Ask::Jog { axis: 0, distance_um: -200_000, anyway: false });
    until_status(&mut worker, |status| status.state == State::Jogging);
    drop(worker);
    let rest = until_status(&mut viewer, |status| status.state == State::Ready);
    assert!(rest.machine_mm[0] > -50.0, "went all the way: {rest:?}");
}

/// Saves the wear of `tool`, after a job that has ended.
fn worn(home: &TempDir, tool: &RackTool) -> ToolWear {
    let wear = ToolWear { hits: 17, ..ToolWear::new(&hobby_3018().name, tool) };
    let kept = json!({
        "key": "k", "name": "n", "files": [], "done": 3, "holes": 3, "toolpaths": 0, "zero": null, "ended": true,
        "wear": [wear],
    });
    fs::write(home.path().join("controller.json"), kept.to_string()).unwrap();
    wear
}

#[test]
fn tool_wear_of_the_command_line_is_shown() {
    let (board, folder) = (Board::at(115_200), TempDir::new().unwrap());
    let wear = worn(&folder, &RackTool::read("T3 drill 0.8").unwrap());
    let bridge = serve(folder, &board.port, "1");
    let mut page = bridge.page();
    let Tell::Tools(report) = page.until(|tell| matches!(tell, Tell::Tools(_))) else { panic!() };
    assert_eq!(report.wear, [wear]);
}

/// The files of the ledger and their contents.
fn ledger(home: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let files = fs::read_dir(home.join("grbl")).unwrap().map(|file| file.unwrap().path());
    let mut files: Vec<_> = files.map(|path| (path.clone(), fs::read(path).unwrap())).collect();
    files.sort();
    files
}

#[test]
fn ledger_of_a_served_controller_is_locked_until_serve_ends() {
    let (board, other, mut home) = (Board::at(115_200), Board::at(115_200), TempDir::new().unwrap());
    let tool = hobby_3018().rack.swap_remove(0);
    worn(&home, &tool);
    let job = home.path().join("job.nc").display().to_string();
    fs::write(&job, "G21 G90\nG0 Z2\nG0 X1 Y1\nM3 S9000\nG1 Z-0.5 F600\nG0 Z2\nM5\nM2\n").unwrap();
    let (number, port) = (tool.number.to_string(), other.port.as_str());
    // Each command, and its error after `serve` has ended.
    let rows: [(&[&str], Option<&str>); 4] = [
        (&["grbl", "run", &job, "--port", "/nowhere", "--json"], Some("grbl.port_unopened")),
        (&["grbl", "level", &job, "--port", "/nowhere", "--json"], Some("grbl.port_unopened")),
        (&["grbl", "resume", "--port", "/nowhere", "--json"], Some("grbl.nothing_interrupted")),
        (&["tools", "reset", &number, "--machine", "3018", "--json"], None),
    ];
    for signal in [Signal::TERM, Signal::KILL] {
        let mut bridge = serve(home, &board.port, "1");
        let folder = bridge.home.take().unwrap();
        let before = ledger(folder.path());
        for (words, _) in rows {
            let (exit, object, said) = output(&folder, words);
            let refused = (exit, object["error"]["code"].as_str());
            assert_eq!(refused, (3, Some("journal.in_use")), "{words:?} {object} {said}");
        }
        // Commands that only read.
        for words in [&["tools", "list"][..], &["grbl", "info", "--port", port]] {
            let (exit, object, said) = output(&folder, words);
            assert_eq!(exit, 0, "{words:?} {object} {said}");
        }
        assert_eq!(ledger(folder.path()), before);
        kill_process(Pid::from_child(&bridge.child), signal).unwrap();
        bridge.child.wait().unwrap();
        for (words, code) in rows {
            let (_, object, said) = output(&folder, words);
            assert_eq!(object["error"]["code"].as_str(), code, "{signal:?} {words:?} {object} {said}");
        }
        home = folder;
    }
}

#[test]
fn unsuitable_serial_ports_are_refused_before_serving() {
    let (board, home) = (Board::at(57_600), TempDir::new().unwrap());
    let port = board.port.as_str();
    let rows: [(&[&str], i32, &str); 4] = [
        (&["--serial-port", "/nowhere"], 3, "grbl.port_unopened"),
        (&["--serial-port", port, "--baud", "9600"], 3, "grbl.no_answer"),
        (&["--serial-port", port, "--machine", "virtual"], 2, "run.port_of_virtual"),
        (&["--serial-port", port, "--machine", "nowhere"], 3, "machine.no_such"),
    ];
    for (words, exit, code) in rows {
        let all = [&["serve", "--port", "0", "--no-open", "--json"][..], words].concat();
        let (found, object, said) = output(&home, &all);
        assert_eq!((found, &object["error"]["code"]), (exit, &code.into()), "{words:?} {object} {said}");
    }
    assert_eq!(output(&home, &["serve", "--no-open", "--baud", "9600"]).0, 2);
}
