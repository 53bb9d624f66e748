//! Tests of lines damaged on their way to or from the controller. Nothing is left out, and each wrong cut
//! is reported by the end of its run, before the next cut. A job reported as complete has cut exactly what
//! was planned.

use super::bench::Bench;
use super::firmware::{Board, instrument, long, long_instrument, settings};
use super::jobs;
use super::judge::{Dip, Log, Verdict};
use super::sender::Desk;

const ROUNDS: usize = 40;

/// A run of the command: the total number of edges at its end, and whether it ended with a stop.
#[derive(Clone, Copy, Debug)]
struct Round {
    edges: u64,
    stopped: bool,
}

/// Wrong dips that the stop of their own run did not report at once, by their edge.
fn untold<'a>(rounds: &[Round], log: &'a Log, verdict: &Verdict) -> Vec<&'a Dip> {
    let is_wrong = |dip: &Dip| verdict.wrong.iter().any(|wrong| wrong.edge == dip.edge);
    let mut first = 0;
    let mut found = Vec::new();
    for round in rounds {
        let dips = log.dips.iter().filter(|dip| (first + 1..=round.edges).contains(&dip.edge));
        let mut dips = dips.skip_while(|dip| !is_wrong(dip)).peekable();
        // The damage was noticed at the next sync point, or before.
        let told = round.stopped.then(|| dips.next()).flatten();
        found.extend(dips.filter(|dip| told.is_none() || !is_wrong(dip)));
        first = round.edges;
    }
    found
}

#[test]
fn only_the_last_dip_of_a_stopped_run_may_be_wrong() {
    let dip = |edge| Dip { at: [0; 2], lowest: -1, path: Vec::new(), edge };
    let log = Log { dips: [10, 20, 110, 120].map(dip).to_vec(), ..Log::default() };
    let round = |edges, stopped| Round { edges, stopped };
    let edges = |rounds: &[Round], wrong: &[u64]| -> Vec<u64> {
        let wrong = wrong.iter().map(|edge| dip(*edge)).collect();
        let verdict = Verdict { wrong, ..Verdict::default() };
        untold(rounds, &log, &verdict).iter().map(|dip| dip.edge).collect()
    };
    let stops = [round(100, true), round(200, false)];
    assert!(edges(&stops, &[]).is_empty());
    assert!(edges(&stops, &[20]).is_empty());
    // Another one was cut before the stop; or the run reported success.
    assert_eq!(edges(&stops, &[10]), [20]);
    assert_eq!(edges(&stops, &[120]), [120]);
    assert!(edges(&[round(100, true), round(200, true)], &[20, 120]).is_empty());
}

#[test]
fn serial_noise_stops_the_job_and_leaves_no_hole_out() {
    let Some(instrument) = instrument() else { return };
    for seed in 0..if long() { 20 } else { 2 } {
        let seed = seed.to_string();
        let faults = ["--drop-bytes", "2e-4", "--garble", "2e-4", "--tx-faults", "--seed", &seed];
        let mut bench = Bench::new(instrument, jobs::board(), &faults);
        let (mut stops, mut rounds) = (Vec::new(), Vec::new());
        loop {
            let begun = bench.desk.journal()["done"].as_u64().is_some();
            let (exit, object) = if begun { bench.resume() } else { bench.run() };
            bench.board.rests();
            let edges = bench.board.snapshot()["edges_total"].as_u64().unwrap();
            rounds.push(Round { edges, stopped: exit != 0 });
            if exit == 0 {
                break;
            }
            stops.push(object["error"]["code"].to_string());
            assert!(stops.len() < ROUNDS, "seed {seed} never ends: {stops:?}");
        }
        let (log, verdict, report) = bench.read();
        println!(
            "seed {seed}: {} lost, {} damaged, {} wrong, {} made twice, stops {stops:?}",
            report["uart"]["dropped"],
            report["uart"]["garbled"],
            verdict.wrong.len(),
            verdict.repeated
        );
        assert_eq!(verdict.left_out, Vec::<usize>::new(), "seed {seed}: {stops:?}");
        let untold = untold(&rounds, &log, &verdict);
        assert!(untold.is_empty(), "seed {seed}: {stops:?} {rounds:?} {untold:?} of {:?}", verdict.wrong);
    }
}

#[test]
fn heavy_serial_noise_ends_with_no_answer() {
    let Some(instrument) = long_instrument() else { return };
    let job = jobs::board();
    // As at a wrong speed: half of all characters differ.
    let faults = ["--garble", "0.5", "--tx-faults", "--seed", "5"];
    let mut board = Board::new(instrument, &settings(false), [-100.0, -100.0, -60.0], &faults);
    let desk = Desk::new(&job.text);
    for words in ["info", "run job.nc --zero-here --equal-tool-lengths --unattended-tool-change 0"] {
        let (exit, object) = desk.run(&board, words);
        assert_eq!((exit, &object["error"]["code"]), (3, &"grbl.no_answer".into()), "{words}: {object}");
    }
    assert_eq!(board.end()["edges_total"], 0);
}
