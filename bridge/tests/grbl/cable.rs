//! The cable is pulled in the middle of a job, and plugged in again.

use super::bench::{Bench, ZERO_AT};
use super::firmware::{eventually, instrument};
use super::jobs;
use super::sender::MOST;
use std::time::Duration;

#[test]
fn a_pulled_cable_is_told_written_down_and_the_job_goes_on_after_homing() {
    let Some(instrument) = instrument() else { return };
    let mut bench = Bench::new(instrument, jobs::board(), &[]);
    let sender = bench.desk.start(&bench.board, &format!("run job.nc {ZERO_AT} --confirm-tools 0.1"));
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
