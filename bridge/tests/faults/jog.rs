//! Tests that jogging needs continuous permission: after a page disappears, nothing moves on.

use crate::server::client::{Page, Running};
use crate::server::work::{home, until_status};
use annulus_core::chance::Chance;
use annulus_core::control::State;
use annulus_core::machine::virtual_drill;
use annulus_core::wire::{Ask, JOG_GRANT_MS, Status, Tell, auth};
use tempfile::TempDir;

/// How far X may move on one permission: at its jog speed for that time, plus the stopping distance, plus
/// the clock's advance.
fn one_grant_mm() -> f64 {
    let x = virtual_drill().x;
    let speed = x.home_speed_mm_per_s;
    let brakes = speed * speed / (2.0 * x.max_acceleration_mm_per_s2);
    speed * (JOG_GRANT_MS as f64 + 10.0) * 1e-3 + 2.0 * brakes
}

fn rests(status: &Status) -> bool {
    matches!(status.state, State::Ready | State::NotHomed | State::Alarm)
}

#[test]
fn unrenewed_jog_stops_after_150_ms() {
    let bridge = Running::start();
    let mut page = bridge.page();
    home(&mut page);
    let before = until_status(&mut page, rests).machine_mm[0];
    page.ask(&Ask::Jog { axis: 0, distance_um: 200_000, anyway: false });
    until_status(&mut page, |status| status.state == State::Jogging);
    // The page stays alive; it only stops renewing the permission.
    let status = until_status(&mut page, rests);
    let went = status.machine_mm[0] - before;
    assert_eq!(status.state, State::Ready, "{status:?}");
    assert!(went > 0.0 && went <= one_grant_mm(), "{went} mm on one grant of {} mm", one_grant_mm());
}

#[test]
fn renewed_jog_ends_at_its_target() {
    let bridge = Running::start_at(TempDir::new().unwrap(), "3");
    let mut page = bridge.page();
    home(&mut page);
    let before = until_status(&mut page, rests).machine_mm[0];
    let mut left = 60.0;
    // On a computer too busy to renew it once per second, the jog ends early: then request the rest.
    while left > 0.02 {
        page.ask(&Ask::Jog { axis: 0, distance_um: (left * 1e3) as i32, anyway: false });
        until_status(&mut page, |status| status.state == State::Jogging);
        loop {
            page.ask(&Ask::JogOn);
            if let Some(Tell::Status(status)) = page.next()
                && rests(&status)
            {
                left = before + 60.0 - status.machine_mm[0];
                break;
            }
        }
    }
    assert!(left.abs() <= 0.02, "{left} mm are left");
}

#[test]
fn jog_of_a_vanished_page_stops_within_one_grant() {
    let rounds = 1_000;
    let bridge = Running::start();
    let mut first = bridge.page();
    home(&mut first);
    let (session, key) = (first.session.clone(), first.key.clone());
    drop(first);
    let mut chance = Chance::new(20_261_122);
    let (mut before, mut moved, mut furthest) = (None::<f64>, 0, 0.0_f64);
    let mut vanished = None;
    for round in 0..=rounds {
        let mut page =
            Page { session: session.clone(), key: key.clone(), socket: bridge.upgrade(&[]).unwrap() };
        let nonce = page.nonce();
        page.hello(&session, &auth::hello(&key, &nonce));
        // The new page's status follows all requests of the previous page.
        let at = until_status(&mut page, rests).machine_mm[0];
        if let Some(before) = before {
            let went = (at - before).abs();
            assert!(went <= one_grant_mm(), "round {round}: {went} mm with nobody in control");
            moved += usize::from(went > 0.0);
            furthest = furthest.max(went);
        }
        before = Some(at);
        page.ask(&Ask::TakeControl { force: true });
        let distance_um = if at < 150.0 { 140_000 } else { -140_000 };
        page.ask(&Ask::Jog { axis: 0, distance_um, anyway: false });
        // Most disappear within 2 ms, every fourth some time after something started to move.
        let latest_us = if round % 4 == 1 { 60_000 } else { 2_000 };
        std::thread::sleep(std::time::Duration::from_micros(chance.bits() % latest_us));
        // Every other page is cut off with unread data; its last requests may be lost too.
        if round % 2 == 1 {
            page.socket.get_ref().shutdown(std::net::Shutdown::Write).unwrap();
            vanished = Some(page);
        }
    }
    drop(vanished);
    println!("{rounds} vanished, {moved} of them moved something, {furthest:.3} mm at most");
    assert!(moved * 20 >= rounds, "the jogs hardly ever began: {moved} of {rounds}");
}
