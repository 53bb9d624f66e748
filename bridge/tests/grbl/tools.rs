//! Tests of tool wear at a controller: counted by real holes, even after a kill, and a new tool is
//! requested when a life ends.

use super::bench::{START, ZERO_AT};
use super::firmware::{Board, eventually, instrument, settings};
use super::judge;
use super::sender::{Desk, MOST};
use serde_json::Value;
use std::fs;
use std::process::{Command, Stdio};

/// Six holes of 0.8 mm, and a machine with this single tool.
fn desk(tool: &str) -> Desk {
    let holes: String =
        (0..6).map(|hole| format!("X{}.0Y{}.0\n", 2 + hole % 3 * 4, 3 + hole / 3 * 4)).collect();
    let desk = Desk::new("");
    fs::write(desk.path().join("board.drl"), format!("M48\nMETRIC\nT1C0.8\n%\nT1\n{holes}M30\n")).unwrap();
    let machine = format!("schema = 1\n[rack]\ntools = [\"{tool}\"]\n");
    fs::write(desk.path().join("mill.toml"), machine).unwrap();
    desk
}

/// The answer of `annulus tools` with these arguments, for the single tool.
fn hits(desk: &Desk, words: &str) -> Value {
    let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
    command.args(["tools"]).args(words.split_whitespace()).args(["--machine", "mill.toml", "--json"]);
    let told =
        command.current_dir(desk.path()).env("ANNULUS_HOME", desk.path().join("home")).output().unwrap();
    let object: Value = serde_json::from_slice(&told.stdout).unwrap_or_else(|_| panic!("{told:?}"));
    object["tools"][0]["hits"].clone()
}

const RUN: &str = "run board.drl --machine mill.toml --equal-tool-lengths --unattended-tool-change 0.1";

#[test]
fn worn_tool_is_replaced_between_two_holes() {
    let Some(instrument) = instrument() else { return };
    let desk = desk("T3 drill 0.8 life 4");
    let mut board = Board::new(instrument, &settings(false), [-100.0, -100.0, -60.0], &[]);
    let (exit, object) = desk.run(&board, &format!("{RUN} --zero-here"));
    assert_eq!((exit, &object["holes_done"]), (0, &6.into()), "{object} {}", desk.said());
    let said = desk.said();
    let [before, asked] =
        ["has drilled 0 holes of 4. It wears out before this job", "has drilled 4 holes of 4: it is worn."]
            .map(|words| said.find(&format!("T3 (drill 0.8) {words}")).unwrap_or_else(|| panic!("{said}")));
    let first = said.find("Tool 1").unwrap_or(asked);
    assert!(before < first && first <= asked, "what will be worn is told before anything is asked: {said}");
    let worn = object["worn_tools"].as_array().unwrap();
    assert_eq!((worn.len(), &worn[0]["code"]), (1, &"preflight.tool_wears_out".into()), "{object}");
    let report = board.end();
    assert_eq!((&report["spindle"]["starts"], &report["spindle"]["on"]), (&2.into(), &0.into()), "{report}");
    let log = judge::read(&board.edges(), 0);
    let mut drilled: Vec<_> = log.dips.iter().map(|dip| dip.at).collect();
    drilled.sort_unstable();
    drilled.dedup();
    assert_eq!((drilled.len(), log.dips.len()), (6, 6), "every hole once: {:?}", log.dips);
    assert_eq!(hits(&desk, "list"), 2, "the new one is counted from 0");
    assert_eq!(hits(&desk, "reset 3"), 0);
    assert_eq!(hits(&desk, "list"), 0);
}

#[test]
fn tool_change_without_input_ends_the_job() {
    let Some(instrument) = instrument() else { return };
    let desk = desk("T3 drill 0.8");
    let mut board = Board::new(instrument, &settings(false), [-100.0, -100.0, -60.0], &[]);
    let sender = desk.start_at(&board, "run board.drl --machine mill.toml --zero-here", Stdio::null());
    let (exit, object) = desk.answer(sender);
    assert_eq!((exit, &object["error"]["code"]), (1, &"run.tool_unattended".into()), "{object}");
    assert_eq!((&object["holes_done"], &board.end()["spindle"]["on"]), (&0.into(), &0.into()), "{object}");
}

#[test]
fn resumed_job_counts_every_hole_once_as_wear() {
    let Some(instrument) = instrument() else { return };
    let desk = desk("T3 drill 0.8");
    let board = Board::new(instrument, &settings(true), START, &[]);
    let mut sender = desk.start(&board, &format!("{RUN} {ZERO_AT}"));
    eventually("three holes", MOST, || desk.journal()["holes"].as_u64().is_some_and(|holes| holes >= 3));
    sender.kill();
    let journal = desk.journal();
    assert_eq!(
        (&journal["wear"][0]["hits"], &journal["ended"]),
        (&journal["holes"], &false.into()),
        "{journal}"
    );
    board.rests();
    let (exit, object) = desk.run(&board, "resume --equal-tool-lengths --unattended-tool-change 0.1");
    assert_eq!((exit, &object["holes_done"]), (0, &6.into()), "{object} {}", desk.said());
    assert_eq!(hits(&desk, "list"), 6);
}
