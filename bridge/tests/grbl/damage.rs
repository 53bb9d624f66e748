//! Lines that are damaged on their way, to the board and from it. Nothing is left out, and whatever came out wrong was told by the end of
//! the same run, before anything else was cut: a job that says that it is done has cut nothing but what was wanted.

use super::bench::Bench;
use super::firmware::{Board, instrument, long, long_instrument, settings};
use super::jobs;
use super::judge::{Dip, Log, Verdict};
use super::sender::Desk;

/// Interruptions after which a job is given up.
const ROUNDS: usize = 40;

/// A run of the command: at which edge of the pins it was over, all in all, and whether it ended by a stop.
#[derive(Clone, Copy, Debug)]
struct Round {
    edges: u64,
    stopped: bool,
}

/// What came out wrong and was not told by the stop of its own run, with nothing right behind it: all of that, by the edge of each.
fn untold<'a>(rounds: &[Round], log: &'a Log, verdict: &Verdict) -> Vec<&'a Dip> {
    let is_wrong = |dip: &Dip| verdict.wrong.iter().any(|wrong| wrong.edge == dip.edge);
    let mut first = 0;
    let mut found = Vec::new();
    for round in rounds {
        let dips = log.dips.iter().filter(|dip| (first + 1..=round.edges).contains(&dip.edge));
        let mut dips = dips.skip_while(|dip| !is_wrong(dip)).peekable();
        // It was noticed at the look behind it, or before.
        let told = round.stopped.then(|| dips.next()).flatten();
        found.extend(dips.filter(|dip| told.is_none() || !is_wrong(dip)));
        first = round.edges;
    }
    found
}

#[test]
fn what_is_wrong_is_told_by_the_stop_of_its_own_run_alone() {
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
    // Another one is cut behind it before that; or the run that made it says that it is done.
    assert_eq!(edges(&stops, &[10]), [20]);
    assert_eq!(edges(&stops, &[120]), [120]);
    assert!(edges(&[round(100, true), round(200, true)], &[20, 120]).is_empty());
}

#[test]
fn a_damaged_line_stops_the_job_and_nothing_is_left_out() {
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
fn a_line_of_noise_is_nobody_and_is_not_waited_for_without_end() {
    let Some(instrument) = long_instrument() else { return };
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
