//! Pulls cables, resets controllers, stops jobs and kills processes at random moments of a job and of its
//! resumption. No cut may be missing or misplaced, and each interruption repeats at most the current
//! section.

use super::bench::{Bench, ZERO_AT};
use super::firmware::{Instrument, SPEED, instrument, long};
use super::jobs;
use super::sender::Sender;
use annulus_core::chance::Chance;
use std::time::{Duration, Instant};

/// Number of interruptions, normally and with `cargo xtask test --long`.
const COUNT: [u64; 2] = [4, 200];
const A_JOB: u64 = 4;
/// Approximate duration of a job in seconds of controller time: homing, holes, three changes.
const JOB_S: f64 = 22.0;

/// Lets a job run for a while, then disturbs it. Returns how, or `None` if it ended first.
fn disturbed(bench: &Bench, chance: &mut Chance, mut sender: Sender) -> Option<&'static str> {
    let wait = Duration::from_secs_f64((1.0 + chance.unit() * JOB_S) / SPEED);
    let since = Instant::now();
    while since.elapsed() < wait && !sender.ended() {
        std::thread::sleep(Duration::from_millis(5));
    }
    if sender.ended() {
        let (exit, object) = bench.desk.answer(sender);
        assert_eq!(exit, 0, "{object} {}", bench.desk.said());
        return None;
    }
    let how = ["pulled", "reset", "stopped", "killed"][chance.below(4)];
    match how {
        "pulled" => bench.board.plug(false),
        "reset" => bench.board.reset(),
        "stopped" => sender.stop(),
        _ => sender.kill(),
    }
    if how != "killed" {
        bench.desk.answer(sender);
    }
    if how == "pulled" {
        // Sooner or later the user plugs it in, perhaps while the controller still moves.
        std::thread::sleep(Duration::from_secs_f64(chance.unit() * 2.0 / SPEED));
        bench.board.plug(true);
    }
    Some(how)
}

/// One job with its interruptions, judged at the end. Returns their number.
fn job(instrument: &Instrument, seed: u64) -> u64 {
    let mut bench = Bench::new(instrument, jobs::board(), &[]);
    let mut chance = Chance::new(seed);
    let (mut count, mut hows, mut done) = (0, Vec::new(), false);
    let next = |bench: &Bench| {
        // A job without progress may be restarted; one with progress is resumed.
        let journal = bench.desk.journal();
        let begun = journal["holes"].as_u64() > Some(0) || journal["toolpaths"].as_u64() > Some(0);
        let words = if begun { "resume".to_owned() } else { format!("run job.nc {ZERO_AT}") };
        format!("{words} --equal-tool-lengths --unattended-tool-change 0.1")
    };
    while count < A_JOB && !done {
        let sender = bench.desk.start(&bench.board, &next(&bench));
        let how = disturbed(&bench, &mut chance, sender);
        hows.extend(how);
        // The job may have ended during the disturbance.
        done = how.is_none() || bench.desk.journal()["ended"] == true;
        count += u64::from(how.is_some());
    }
    if !done {
        let (exit, object) = bench.desk.run(&bench.board, &next(&bench));
        assert_eq!(exit, 0, "seed {seed} {hows:?}: {object} {}", bench.desk.said());
    }
    let (verdict, _) = bench.judged();
    let told = format!("seed {seed} {hows:?}: {verdict:?}");
    assert!(verdict.left_out.is_empty() && verdict.wrong.is_empty(), "{told}");
    assert!(verdict.repeated as u64 <= count, "{told}");
    println!("{told}");
    count
}

#[test]
fn random_interruptions_leave_every_hole_in_its_position() {
    let Some(instrument) = instrument() else { return };
    let wanted = COUNT[usize::from(long())];
    let (mut count, mut seed) = (0, 0);
    while count < wanted {
        count += job(instrument, seed);
        seed += 1;
    }
    println!("{count} interruptions of {seed} jobs");
}
