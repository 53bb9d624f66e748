//! Tests of jobs that are stopped, killed or reset. After a resume every hole is there, none is elsewhere,
//! and at most the current one is drilled twice.

use super::bench::{Bench, ZERO_AT};
use super::firmware::{eventually, instrument, steps};
use super::jobs;
use super::sender::MOST;
use std::time::Duration;

#[derive(Clone, Copy, Debug)]
enum How {
    Stopped,
    /// Ctrl-C twice: a reset in motion, even at the cost of the position.
    AtOnce,
    Killed,
    Reset,
}

fn interrupted(how: How, at: u64) {
    let Some(instrument) = instrument() else { return };
    let mut bench = Bench::new(instrument, jobs::board(), &[]);
    let mut sender = bench.desk.start(
        &bench.board,
        &format!("run job.nc {ZERO_AT} --equal-tool-lengths --unattended-tool-change 0.1"),
    );
    eventually("so many sections", MOST, || {
        bench.desk.journal()["done"].as_u64().is_some_and(|done| done >= at)
    });
    std::thread::sleep(Duration::from_millis(130));
    match how {
        How::Stopped => sender.stop(),
        How::AtOnce => {
            sender.stop();
            bench.desk.says("Stopping.");
            sender.stop();
        }
        How::Killed => sender.kill(),
        How::Reset => bench.board.reset(),
    }
    if !matches!(how, How::Killed) {
        let (exit, object) = bench.desk.answer(sender);
        let trust = object["position_trust"].as_str().unwrap_or_default();
        let good = match how {
            How::Stopped => (exit, trust) == (130, "trusted"),
            // The machine may have stopped before the second one.
            How::AtOnce => exit == 130 && matches!(trust, "lost" | "trusted"),
            _ => (exit, trust) == (1, "lost"),
        };
        assert!(good, "{how:?}: {exit} {object} {}", bench.desk.said());
        if matches!(how, How::Stopped | How::AtOnce) {
            let now = bench.board.snapshot();
            assert_eq!(now["spindle"]["on"], 0, "{now}");
            std::thread::sleep(Duration::from_millis(300));
            let after = bench.board.snapshot();
            assert_eq!(now["edges_total"], after["edges_total"], "nothing moves after a stop");
        }
    }
    bench.board.rests();
    let journal = bench.desk.journal();
    assert!(journal["ended"] == false && journal["done"].as_u64() >= Some(at), "{journal}");
    let again = bench.run();
    assert_eq!(again.1["error"]["code"], "grbl.interrupted", "{how:?}: {}", again.1);
    let (exit, object) = bench.resume();
    assert_eq!(exit, 0, "{how:?}: {object} {}", bench.desk.said());
    let (verdict, _) = bench.judged();
    assert!(
        verdict.left_out.is_empty() && verdict.wrong.is_empty() && verdict.repeated <= 1,
        "{how:?}: {verdict:?}"
    );
}

#[test]
fn stopped_job_has_a_known_position_and_resumes() {
    interrupted(How::Stopped, 3);
}

#[test]
fn job_stopped_by_two_interrupts_resumes() {
    interrupted(How::AtOnce, 7);
}

#[test]
fn job_of_a_killed_process_resumes() {
    interrupted(How::Killed, 5);
}

#[test]
fn controller_reset_is_reported_and_the_job_resumes() {
    interrupted(How::Reset, 10);
}

#[test]
fn interrupt_during_a_tool_change_jog_ends_the_job() {
    let Some(instrument) = instrument() else { return };
    let bench = Bench::new(instrument, jobs::board(), &[]);
    let mut sender = bench.desk.start(&bench.board, &format!("run job.nc {ZERO_AT}"));
    bench.desk.says("Type: ");
    let before = bench.board.rests();
    sender.types("z -10");
    eventually("the head on its way", MOST, || steps(&bench.board.snapshot()) != before);
    sender.stop();
    let (exit, object) = bench.desk.answer(sender);
    assert_eq!((exit, &object["position_trust"]), (130, &"trusted".into()), "{object} {}", bench.desk.said());
    let now = bench.board.snapshot();
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(now["edges_total"], bench.board.snapshot()["edges_total"], "nothing moves after a stop");
}

#[test]
fn resume_reuses_the_options_of_the_run() {
    let Some(instrument) = instrument() else { return };
    let mut bench = Bench::new(instrument, jobs::board(), &[]);
    let mut sender = bench.desk.start(
        &bench.board,
        &format!("run job.nc {ZERO_AT} --equal-tool-lengths --unattended-tool-change 0.1"),
    );
    eventually("three sections", MOST, || bench.desk.journal()["done"].as_u64() >= Some(3));
    sender.kill();
    bench.board.rests();
    // The earlier options are dropped: equal tool lengths are no longer declared.
    let (exit, object) = bench.desk.run(&bench.board, "resume --forget-options --unattended-tool-change 0.1");
    assert_eq!((exit, &object["error"]["code"]), (1, &"grbl.tools_unmeasured".into()), "{object}");
    let (exit, object) = bench.desk.run(&bench.board, "resume --unattended-tool-change 0.1");
    assert_eq!(exit, 0, "{object} {}", bench.desk.said());
    let said = bench.desk.said();
    assert!(said.contains("--spin-up 0.2") && said.contains("--equal-tool-lengths"), "{said}");
    let (verdict, _) = bench.judged();
    assert!(verdict.left_out.is_empty() && verdict.wrong.is_empty(), "{verdict:?}");
}
