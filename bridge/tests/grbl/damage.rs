//! Lines that are damaged on their way, to the board and from it. Nothing is left out, and whatever came out wrong was told: a job that
//! says that it is done has cut nothing but what was wanted.

use super::bench::Bench;
use super::firmware::{Board, instrument, long, settings};
use super::jobs;
use super::sender::Desk;

/// Interruptions after which a job is given up.
const ROUNDS: usize = 40;

#[test]
fn a_damaged_line_stops_the_job_and_nothing_is_left_out() {
    let Some(instrument) = instrument() else { return };
    for seed in 0..if long() { 20 } else { 2 } {
        let seed = seed.to_string();
        let faults = ["--drop-bytes", "2e-4", "--garble", "2e-4", "--tx-faults", "--seed", &seed];
        let mut bench = Bench::new(instrument, jobs::board(), &faults);
        let (mut exit, mut object) = bench.run();
        let mut stops = Vec::new();
        while exit != 0 {
            stops.push(object["error"]["code"].to_string());
            assert!(stops.len() < ROUNDS, "seed {seed} never ends: {stops:?}");
            let begun = bench.desk.journal()["done"].as_u64().is_some();
            (exit, object) = if begun { bench.resume() } else { bench.run() };
        }
        let (verdict, report) = bench.judged();
        println!(
            "seed {seed}: {} lost, {} damaged, {} wrong, {} made twice, stops {stops:?}",
            report["uart"]["dropped"],
            report["uart"]["garbled"],
            verdict.wrong.len(),
            verdict.repeated
        );
        assert_eq!(verdict.left_out, Vec::<usize>::new(), "seed {seed}: {stops:?}");
        assert!(verdict.wrong.len() <= stops.len(), "seed {seed}: {stops:?} {:?}", verdict.wrong);
    }
}

#[test]
fn a_line_of_noise_is_nobody_and_is_not_waited_for_without_end() {
    let Some(instrument) = instrument() else { return };
    let job = jobs::board();
    // As at a wrong speed: half of all characters are others.
    let faults = ["--garble", "0.5", "--tx-faults", "--seed", "5"];
    let mut board = Board::new(instrument, &settings(false), [-100.0, -100.0, -60.0], &faults);
    let desk = Desk::new(&job.text);
    for words in ["info", "run job.nc --zero-here --same-length --confirm-tools 0"] {
        let (exit, object) = desk.run(&board, words);
        assert_eq!((exit, &object["error"]["code"]), (3, &"grbl.no_answer".into()), "{words}: {object}");
    }
    assert_eq!(board.end()["edges_total"], 0);
}
