//! Tests that a pause does not wait for a plan.

use crate::server::client::{Page, Running};
use crate::server::work::{home, row_of_holes, until_status};
use annulus_core::control::State;
use annulus_core::wire::{ArmedJob, Ask, RowVerdict, Tell, program};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A page whose job with this many holes is running.
pub(super) fn drilling(bridge: &Running, holes: u32) -> Page {
    let mut page = bridge.page();
    home(&mut page);
    page.ask(&Ask::SetZero);
    let bytes = program::encode(&row_of_holes(holes));
    let job = program::key(&bytes);
    assert_eq!(bridge.job((&page.session, &page.key), "PUT", &job, &bytes).status, 200);
    let asked = Instant::now();
    page.ask(&Ask::Arm { job: job.clone(), from_leg: 0 });
    let armed = page.until(|tell| matches!(tell, Tell::Armed(_) | Tell::Refused { .. }));
    let (took_s, busy_s) = (asked.elapsed().as_secs_f64(), busy_s(bridge));
    println!("{holes} holes armed in {took_s:.2} s, {busy_s:.2} s of a processor since the bridge began");
    let Tell::Armed(ArmedJob { stream_digest, checks, .. }) = armed else { panic!("{armed:?}") };
    assert!(checks.iter().all(|row| row.verdict != RowVerdict::Fail), "{checks:?}");
    page.ask(&Ask::Start { job, stream_digest, from_leg: 0 });
    until_status(&mut page, |status| status.state == State::ToolChange);
    page.ask(&Ask::ToolChanged);
    until_status(&mut page, |status| status.state == State::Running && status.holes_done >= 1);
    page
}

/// The bridge's peak memory, MB; 0 if the system does not report it.
fn most_mb(bridge: &Running) -> u64 {
    let text = std::fs::read_to_string(format!("/proc/{}/status", bridge.child.id())).unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<u64>().ok()).unwrap_or(0) / 1024
}

/// The bridge's processor time, s; 0 if the system does not report it.
fn busy_s(bridge: &Running) -> f64 {
    const TICKS_A_SECOND: f64 = 100.0;
    let text = std::fs::read_to_string(format!("/proc/{}/stat", bridge.child.id())).unwrap_or_default();
    let numbers = text.rsplit(") ").next().unwrap_or_default().split(' ').skip(11).take(2);
    numbers.filter_map(|number| number.parse::<f64>().ok()).sum::<f64>() / TICKS_A_SECOND
}

#[test]
fn pause_does_not_wait_for_a_plan_in_progress() {
    let holes = if std::env::var_os("ANNULUS_LONG").is_some() { 100_000 } else { 10_000 };
    let bridge = Running::start_at(TempDir::new().unwrap(), "5");
    let mut page = drilling(&bridge, holes);
    println!("{} MB at most when armed", most_mb(&bridge));
    let asked = Instant::now();
    page.ask(&Ask::FeedOverride { percent: 150 });
    // Its answer queues after the plan: this refusal shows that the plan is made.
    page.ask(&Ask::FeedOverride { percent: 250 });
    std::thread::sleep(Duration::from_millis(20));
    let pressed = Instant::now();
    page.ask(&Ask::Pause);
    let mut held = None;
    loop {
        match page.next().expect("the page stays in") {
            Tell::Status(status) if matches!(status.state, State::Pausing | State::Paused) => {
                held = held.or_else(|| Some(pressed.elapsed()));
            }
            Tell::Status(_) => page.ask(&Ask::Ping { stamp: 0.0 }),
            Tell::Refused { why } => {
                assert_eq!(why.code, "control.bad_feed_override");
                break;
            }
            _ => {}
        }
    }
    println!("held after {held:?}, planned after {:?}, {} MB at most", asked.elapsed(), most_mb(&bridge));
    assert!(held.is_some(), "the pause waited for the plan");
    page.ask(&Ask::Stop);
    until_status(&mut page, |status| matches!(status.state, State::Ready | State::NotHomed));
}
