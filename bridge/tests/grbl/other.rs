//! Tests that an interrupted job survives other boards, one only measured and one refused; and that a job
//! with a height map resumes with it.

use super::bench::{START, ZERO_AT};
use super::firmware::{Board, eventually, instrument, long_instrument, settings};
use super::sender::{Desk, MOST};
use std::fs;

fn write(desk: &Desk, name: &str, holes: usize) {
    let all: String =
        (0..holes).map(|hole| format!("X{}.0Y{}.0\n", 2 + hole % 3 * 4, 3 + hole / 3 * 4)).collect();
    let text = format!("M48\nMETRIC\nT1C0.8\n%\nT1\n{all}M30\n");
    fs::write(desk.path().join(name), text).unwrap();
}

/// Runs this command until three holes are done, then kills the process.
fn broken_off(desk: &Desk, board: &Board, words: &str) {
    let mut sender = desk.start(board, words);
    eventually("three holes", MOST, || desk.journal()["holes"].as_u64().is_some_and(|holes| holes >= 3));
    sender.kill();
    board.rests();
}

#[test]
fn other_board_refused_leaves_an_interrupted_job_resumable() {
    let Some(instrument) = instrument() else { return };
    let desk = Desk::new("");
    write(&desk, "board.drl", 6);
    write(&desk, "other.drl", 9);
    let board = Board::new(instrument, &settings(true), START, &[]);
    broken_off(
        &desk,
        &board,
        &format!("run board.drl {ZERO_AT} --equal-tool-lengths --unattended-tool-change 0.1"),
    );
    let (exit, object) = desk
        .run(&board, &format!("run board.drl {ZERO_AT} --equal-tool-lengths --unattended-tool-change 0.1"));
    assert_eq!((exit, &object["error"]["code"]), (1, &"grbl.interrupted".into()), "{object} {}", desk.said());
    let (exit, object) = desk.run(&board, &format!("level other.drl {ZERO_AT}"));
    assert_eq!((exit, &object["error"]["code"]), (1, &"level.no_board".into()), "{object} {}", desk.said());
    let (exit, object) = desk
        .run(&board, &format!("run other.drl {ZERO_AT} --equal-tool-lengths --unattended-tool-change 0.1"));
    assert_eq!((exit, &object["error"]["code"]), (1, &"grbl.forgets".into()), "{object} {}", desk.said());
    let (exit, object) = desk.run(&board, "resume --equal-tool-lengths --unattended-tool-change 0.1");
    assert_eq!((exit, &object["holes_done"]), (0, &6.into()), "{object} {}", desk.said());
    // A completed job does not block others.
    let (exit, object) = desk
        .run(&board, &format!("run other.drl {ZERO_AT} --equal-tool-lengths --unattended-tool-change 0.1"));
    assert_eq!((exit, &object["holes_done"]), (0, &9.into()), "{object} {}", desk.said());
}

#[test]
fn resumed_job_uses_its_height_map() {
    let Some(instrument) = long_instrument() else { return };
    let desk = Desk::new("");
    write(&desk, "board.drl", 6);
    write(&desk, "other.drl", 9);
    let board = Board::new(instrument, &settings(true), START, &["--probe-z", "-19.9,0.02,-0.01"]);
    let (exit, object) = desk.run(&board, &format!("level board.drl {ZERO_AT} --spacing 5"));
    assert_eq!(exit, 0, "{object} {}", desk.said());
    broken_off(
        &desk,
        &board,
        &format!(
            "run board.drl {ZERO_AT} --height-map saved --equal-tool-lengths --unattended-tool-change 0.1"
        ),
    );
    // Measuring another board is stopped: that gives no map, and is no job.
    let sender = desk.start(&board, &format!("level other.drl {ZERO_AT} --spacing 2"));
    desk.says("4 of ");
    sender.stop();
    let (exit, object) = desk.answer(sender);
    assert_eq!((exit, &object["error"]["code"]), (130, &"level.stopped".into()), "{object} {}", desk.said());
    board.rests();
    let (exit, object) = desk.run(&board, "resume --equal-tool-lengths --unattended-tool-change 0.1");
    assert_eq!((exit, &object["holes_done"]), (0, &6.into()), "{object} {}", desk.said());
    assert!(object["largest_correction_um"].as_f64().is_some_and(|um| um > 100.0), "{object}");
}
