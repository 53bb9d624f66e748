//! Tests of a tool-change macro, as far as stock GRBL allows: moves in machine coordinates. Also of a
//! controller that must not be reset when its port is opened.

use super::bench::{Bench, START, ZERO, ZERO_AT};
use super::firmware::{Board, STEPS, eventually, instrument, settings, steps};
use super::jobs;
use super::judge::{self, Verdict};
use super::sender::{Desk, MOST};
use std::fs;
use std::time::Duration;

const MOVES: &str = "G53 G0 Z-2\nG53 G0 X-100 Y-8\nG4 P0.2\nG53 G0 X-90\n";

fn bench(instrument: &super::firmware::Instrument, lines: &str) -> Bench {
    let bench = Bench::new(instrument, jobs::board(), &[]);
    fs::write(bench.desk.path().join("changer.txt"), lines).unwrap();
    bench
}

#[test]
fn changer_macro_changes_tools_without_questions() {
    let Some(instrument) = instrument() else { return };
    let mut bench = bench(instrument, MOVES);
    let (exit, object) =
        bench.desk.run(&bench.board, &format!("run job.nc {ZERO_AT} --toolchange-macro changer.txt"));
    assert_eq!(exit, 0, "{object} {}", bench.desk.said());
    let said = bench.desk.said();
    assert_eq!(
        (said.matches("the machine changed the tool itself").count(), said.matches("Type: ").count()),
        (3, 0),
        "{said}"
    );
    assert!(object["diagnostics"].to_string().contains("changer.lengths"), "{object}");
    let (verdict, report) = bench.judged();
    assert_eq!(verdict, Verdict::default());
    assert_eq!((&report["spindle"]["starts"], &report["spindle"]["on"]), (&3.into(), &0.into()), "{report}");
}

#[test]
fn bad_changer_lines_end_the_job_before_the_spindle_starts() {
    let Some(instrument) = instrument() else { return };
    for (lines, code) in [
        ("G53 G0 Z-2\nM6", "changer.refused"),
        ("G53 G0 Z-2\nG10 L2 P1 X-30", "changer.moved_zero"),
        ("G53 G0 Z-2\nG92 Y1", "changer.moved_zero"),
    ] {
        let mut bench = bench(instrument, lines);
        let (exit, object) =
            bench.desk.run(&bench.board, &format!("run job.nc {ZERO_AT} --toolchange-macro changer.txt"));
        assert_eq!((exit, &object["error"]["code"]), (1, &code.into()), "{object} {}", bench.desk.said());
        assert_eq!(bench.board.end()["spindle"]["starts"], 0);
    }
}

#[test]
fn interrupt_in_a_changer_macro_stops_the_machine() {
    let Some(instrument) = instrument() else { return };
    let mut bench = bench(instrument, "G53 G0 Z-2\nG53 G1 X-199 F400\nG4 P0.1\n");
    let sender =
        bench.desk.start(&bench.board, &format!("run job.nc {ZERO_AT} --toolchange-macro changer.txt"));
    let before = bench.board.rests();
    eventually("the head on its way", MOST, || steps(&bench.board.snapshot())[0] < before[0] - 20_000);
    sender.stop();
    let (exit, object) = bench.desk.answer(sender);
    assert_eq!((exit, &object["position_trust"]), (130, &"trusted".into()), "{object} {}", bench.desk.said());
    assert!(bench.desk.said().contains("(changer.stopped)"), "{}", bench.desk.said());
    let now = bench.board.snapshot();
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(now["edges_total"], bench.board.snapshot()["edges_total"], "nothing moves after a stop");
    assert_eq!(bench.board.end()["spindle"]["starts"], 0);
}

#[test]
fn resumed_job_drills_with_the_length_offset_of_the_changer() {
    let Some(instrument) = instrument() else { return };
    // Each T word makes the tool 0.1 mm longer than the one before.
    let mut job = jobs::board();
    for (number, name) in (1..).zip(["0.8 mm", "1.0 mm", "V 30"]) {
        let change = format!("(MSG, put in {name})\n");
        job.text = job.text.replace(&change, &format!("{change}T{number}\n"));
    }
    let mut bench = Bench::new(instrument, job, &[]);
    fs::write(bench.desk.path().join("changer.txt"), "G53 G0 Z-2\nG43.1 Z0.{tool}\n").unwrap();
    // Stopped with the first tool, stopped during the change to the second, and killed with the second.
    let mut words = format!("run job.nc {ZERO_AT} --toolchange-macro changer.txt");
    for (sections, stops) in [(4, true), (8, true), (11, false)] {
        let mut sender = bench.desk.start(&bench.board, &words);
        let done = || bench.desk.journal()["done"].as_u64();
        eventually("so many sections", MOST, || done() >= Some(sections));
        if stops {
            sender.stop();
            let (exit, object) = bench.desk.answer(sender);
            assert_eq!((exit, &object["position_trust"]), (130, &"trusted".into()), "{object}");
        } else {
            sender.kill();
        }
        bench.board.rests();
        words = "resume".to_owned();
    }
    let (exit, object) = bench.desk.run(&bench.board, &words);
    assert_eq!((exit, &object["holes_done"]), (0, &12.into()), "{object} {}", bench.desk.said());
    bench.board.end();
    let zero = bench.board.steps_at(ZERO);
    let mut wanted = bench.job.wanted(zero);
    let tenths = |tool: i64| (tool as f64 * 0.1 * STEPS) as i64;
    for (index, hole) in wanted.holes.iter_mut().enumerate() {
        hole[2] += tenths(if index < 7 { 1 } else { 2 });
    }
    wanted.cuts.iter_mut().for_each(|(_, bottom)| *bottom += tenths(3));
    let log = judge::read(&bench.board.edges(), zero[2] + tenths(3) - (0.05 * STEPS) as i64);
    let verdict = judge::compare(&log, &wanted, 7);
    assert!(
        verdict.left_out.is_empty() && verdict.wrong.is_empty() && verdict.repeated <= 3,
        "{verdict:?} {}",
        bench.desk.said()
    );
}

#[test]
fn reset_on_open_never_does_not_reset_the_controller() {
    let Some(instrument) = instrument() else { return };
    let mut board = Board::new(instrument, &settings(true), START, &["--no-dtr-reset"]);
    let desk = Desk::new(&jobs::board().text);
    let banners = |board: &Board| board.snapshot()["resets"]["banners"].as_u64().unwrap();
    let before = banners(&board);
    for (words, more) in [("never", 0), ("auto", 1), ("never", 1)] {
        let (exit, object) = desk.run(&board, &format!("info --reset-on-open {words}"));
        assert_eq!((exit, &object["controller"]["flavour"]), (0, &"GRBL".into()), "{object} {}", desk.said());
        assert_eq!(banners(&board), before + more, "{words}");
    }
    // The controller can be used as usual, and a job resumed.
    let words = format!(
        "run job.nc {ZERO_AT} --equal-tool-lengths --unattended-tool-change 0.1 --reset-on-open never"
    );
    let (exit, object) = desk.run(&board, &words);
    assert_eq!(exit, 0, "{object} {}", desk.said());
    assert_eq!(board.end()["resets"]["banners"].as_u64(), Some(before + 1));
}

#[test]
fn moving_controller_is_not_disturbed_by_opening_the_port() {
    let Some(instrument) = instrument() else { return };
    let mut board = Board::new(instrument, &settings(false), START, &["--no-dtr-reset"]);
    let desk = Desk::new(&jobs::board().text);
    // Some ten seconds of controller time; a busy computer may need more.
    let goes_to = -(60.0 * super::firmware::STEPS) as i64;
    board.jogs("X-60", 400);
    let (exit, object) = desk.run(&board, "info --reset-on-open never");
    assert_eq!((exit, &object["controller"]["flavour"]), (0, &"GRBL".into()), "{object} {}", desk.said());
    assert_eq!(steps(&board.snapshot())[0], goes_to, "it came to the end of its move");
    board.end();
}
