//! Tests of a cable that is pulled during a job and plugged in again.

use super::bench::{Bench, ZERO_AT};
use super::firmware::{Board, eventually, instrument, long_instrument, settings};
use super::jobs;
use super::judge::{self, Verdict};
use super::sender::{Desk, MOST};
use std::time::Duration;

#[test]
fn job_resumes_after_an_unplugged_cable_and_homing() {
    let Some(instrument) = instrument() else { return };
    let mut bench = Bench::new(instrument, jobs::board(), &[]);
    let sender = bench.desk.start(
        &bench.board,
        &format!("run job.nc {ZERO_AT} --equal-tool-lengths --unattended-tool-change 0.1"),
    );
    eventually("four sections", MOST, || bench.desk.journal()["done"].as_u64().is_some_and(|done| done >= 4));
    std::thread::sleep(Duration::from_millis(200));
    bench.board.plug(false);
    let (exit, object) = bench.desk.answer(sender);
    assert_eq!((exit, &object["position_trust"]), (1, &"lost".into()), "{object} {}", bench.desk.said());
    let journal = bench.desk.journal();
    assert!(journal["ended"] == false && journal["done"].as_u64() >= Some(4), "{journal}");
    bench.board.rests();
    bench.board.plug(true);
    assert_eq!(bench.run().1["error"]["code"], "grbl.interrupted");
    let (exit, object) = bench.resume();
    assert_eq!(exit, 0, "{object} {}", bench.desk.said());
    let (verdict, _) = bench.judged();
    assert!(verdict.left_out.is_empty() && verdict.wrong.is_empty() && verdict.repeated <= 1, "{verdict:?}");
}

#[test]
fn unplugged_machine_without_homing_needs_zero_to_resume() {
    let Some(instrument) = long_instrument() else { return };
    let (job, here) = (jobs::board(), [-100.0, -100.0, -60.0]);
    // This controller is not reset when it is plugged in: it stays where it stopped, and sends nothing
    // unasked.
    let mut board = Board::new(instrument, &settings(false), here, &["--no-dtr-reset"]);
    let desk = Desk::new(&job.text);
    let sender =
        desk.start(&board, "run job.nc --zero-here --equal-tool-lengths --unattended-tool-change 0.1");
    eventually("five sections", MOST, || desk.journal()["done"].as_u64().is_some_and(|done| done >= 5));
    board.plug(false);
    let (exit, object) = desk.answer(sender);
    assert_eq!((exit, &object["position_trust"]), (1, &"lost".into()), "{object}");
    let rests = board.rests();
    board.plug(true);
    let (exit, object) = desk.run(&board, "resume --equal-tool-lengths --unattended-tool-change 0.1");
    assert_eq!((exit, &object["error"]["code"]), (1, &"grbl.no_zero".into()), "{object} {}", desk.said());
    assert_eq!(board.rests(), rests, "nothing moves");
    // The user jogs back to the zero of the board.
    board.jog_to([0; 3]);
    let (exit, object) =
        desk.run(&board, "resume --zero-here --equal-tool-lengths --unattended-tool-change 0.1");
    assert_eq!(exit, 0, "{object} {}", desk.said());
    board.end();
    let verdict = judge::compare(&judge::read(&board.edges(), 0), &job.wanted([0; 3]), 0);
    assert!(
        verdict == Verdict { repeated: verdict.repeated, ..Verdict::default() } && verdict.repeated <= 1,
        "{verdict:?}"
    );
}
