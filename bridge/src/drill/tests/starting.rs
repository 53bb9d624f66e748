//! Tests that a start waits for the disk without blocking the owner.

use super::disk::Wish;
use super::*;
use annulus_core::wire::{Ask, InterruptedJob};
use std::sync::{Condvar, Mutex};

/// A drill with a pending start while its disk is blocked, and a function that unblocks the disk.
fn starting() -> (Bench, String, Begun, impl Fn()) {
    let disk = Arc::new((Mutex::new(false), Condvar::new()));
    let hold = |held: bool, disk: &(Mutex<bool>, Condvar)| {
        *disk.0.lock().unwrap() = held;
        disk.1.notify_all();
    };
    let slow = Arc::clone(&disk);
    let bench = Bench::on_disk(SPEED, move |wish| {
        let (held, changed) = &*slow;
        // Syncs wait while it is blocked.
        drop(changed.wait_while(held.lock().unwrap(), |held| *held && wish == Wish::Sync).unwrap());
        Ok(())
    });
    bench.home();
    bench.drill.ask(Ask::SetZero).unwrap();
    let (job, stream_digest, _) = bench.arm(&grid(&machine(), 6));
    hold(true, &disk);
    let start = Ask::Start { job: job.clone(), stream_digest, from_leg: 0 };
    let begun = bench.drill.begin(start, Some(bench.drill.ticket()));
    // The owner continues meanwhile.
    assert_eq!(bench.status().state, State::Ready);
    (bench, job, begun, move || hold(false, &disk))
}

#[test]
fn stop_during_a_slow_start_prevents_all_motion() {
    for by_ticket in [true, false] {
        let (bench, job, begun, go_on) = starting();
        if by_ticket {
            bench.drill.stop();
        } else {
            bench.drill.ask(Ask::Stop).unwrap_or_default();
        }
        let before = bench.status().steps;
        go_on();
        assert_eq!(begun.finish().unwrap_err().code, "socket.stopped_meanwhile");
        let status = bench.status();
        assert_eq!((status.state, status.job, status.steps), (State::Ready, None, before));
        let offered = bench.drill.greeting().into_iter().any(
            |tell| matches!(tell, Tell::Interrupted(InterruptedJob { job: key, next_leg: 0, holes_done: 0, .. }) if key == job),
        );
        assert!(offered, "it is what the journal says");
        assert!(bench.record().is_empty());
        // The job can still be started.
        let mut bench = bench;
        bench.start_here(&grid(&machine(), 6));
        assert_eq!(bench.ended(), (Ending::Done, 6));
    }
}

#[test]
fn loss_of_control_during_a_start_cancels_it() {
    let (bench, _, begun, go_on) = starting();
    bench.drill.control_changed();
    go_on();
    assert_eq!(begun.finish().unwrap_err().code, "control.needed");
    assert_eq!(bench.status().job, None);
}

#[test]
fn requests_during_a_start_are_handled_after_it() {
    let (mut bench, job, begun, go_on) = starting();
    let ask = |ask| bench.drill.begin(ask, Some(bench.drill.ticket()));
    let (jog, feed_override) = (
        ask(Ask::Jog { axis: 0, distance_um: 1_000, anyway: false }),
        ask(Ask::FeedOverride { percent: 50 }),
    );
    let forget = ask(Ask::ForgetInterrupted);
    go_on();
    begun.finish().unwrap();
    assert_eq!(jog.finish().unwrap_err().code, "control.busy", "the job runs");
    assert_eq!(forget.finish().unwrap_err().code, "control.busy");
    feed_override.finish().unwrap();
    let status = bench.wait(|status| status.job == Some(job.clone()));
    assert_eq!(status.feed_override_percent, 50);
    assert_eq!(bench.ended(), (Ending::Done, 6));
}

#[test]
fn deep_breakthrough_is_a_warning_before_the_start() {
    let bench = Bench::new(&machine(), Faults::default());
    bench.home();
    bench.drill.ask(Ask::SetZero).unwrap();
    for (breakthrough_mm, wanted) in [(0.5, None), (3.0, None), (3.2, Some(RowVerdict::Warn))] {
        let mut deep = machine();
        deep.process.breakthrough = Length::from_mm(breakthrough_mm);
        let (_, _, checks) = bench.arm(&grid(&deep, 2));
        let row = checks.iter().find(|row| row.finding.code == "preflight.far_below");
        assert_eq!(row.map(|row| row.verdict), wanted, "{breakthrough_mm} mm");
    }
}
