//! Helpers: a page that drives a GRBL controller through the bridge.

use super::client::{Page, Running, annulus};
use annulus_core::control::{State, Trust};
use annulus_core::job::Program;
use annulus_core::machine::hobby_3018;
use annulus_core::wire::{ArmedJob, Ask, InterruptedJob, JobEnd, RowVerdict, Status, Tell, program};
use std::thread::sleep;
use std::time::Duration;
use tempfile::TempDir;

// Shared with the tests of `host`.
#[path = "../../../host/src/tests.rs"]
mod planned;

pub(crate) fn holes(count: usize) -> Program {
    planned::holes(&hobby_3018(), count, 4, |_| 800)
}

pub(crate) fn serve(home: TempDir, port: &str, speed: &str) -> Running {
    let words = [
        "serve",
        "--port",
        "0",
        "--no-open",
        "--machine",
        "3018",
        "--serial-port",
        port,
        "--time-scale",
        speed,
    ];
    let command = annulus(&home, &words);
    Running::of(command, home)
}

pub(crate) fn until_status(page: &mut Page, wanted: impl Fn(&Status) -> bool) -> Status {
    match page.until(|tell| matches!(tell, Tell::Status(status) if wanted(status))) {
        Tell::Status(status) => *status,
        other => panic!("{other:?}"),
    }
}

pub(crate) fn home(page: &mut Page) -> Status {
    page.ask(&Ask::ReleaseControl);
    assert!(page.take_control(true));
    page.ask(&Ask::AcknowledgeAlarm);
    page.ask(&Ask::Home);
    until_status(page, |status| status.state == State::Ready && status.trust == Trust::Trusted)
}

fn jog(page: &mut Page, axis: u8, distance_mm: f64, there: impl Fn(&Status) -> bool) {
    page.ask(&Ask::Jog { axis, distance_um: (distance_mm * 1e3).round() as i32, anyway: false });
    loop {
        page.ask(&Ask::JogOn);
        let status = until_status(page, |_| true);
        if status.state != State::Jogging && there(&status) {
            return;
        }
    }
}

/// Homes, jogs to `zero` in machine coordinates, mm, and sets the work zero there.
pub(crate) fn set_zero(page: &mut Page, zero: [f64; 3]) {
    let homed = home(page);
    for (axis, to) in (0_u8..).zip(zero) {
        let off = |status: &Status| to - status.machine_mm[usize::from(axis)];
        jog(page, axis, off(&homed), |status| off(status).abs() < 0.01);
    }
    let near = |mm: f64| mm.abs() < 0.01;
    page.ask(&Ask::SetZero);
    until_status(page, |status| status.work_mm[..2].iter().all(|mm| near(*mm)));
    // The engine reads the zero back from the controller.
    sleep(Duration::from_millis(500));
    page.ask(&Ask::SetHeight);
    until_status(page, |status| near(status.work_mm[2]));
    sleep(Duration::from_millis(500));
}

pub(crate) fn upload(bridge: &Running, page: &Page, program: &Program) -> String {
    let bytes = program::encode(program);
    let job = program::key(&bytes);
    assert_eq!(bridge.job((&page.session, &page.key), "PUT", &job, &bytes).status, 200);
    job
}

pub(crate) fn start(page: &mut Page, job: &str, from_leg: u32) {
    page.ask(&Ask::Arm { job: job.to_owned(), from_leg });
    let armed = page.until(|tell| matches!(tell, Tell::Armed(_) | Tell::Refused { .. }));
    let Tell::Armed(ArmedJob { stream_digest, checks, .. }) = armed else { panic!("{armed:?}") };
    assert!(checks.iter().all(|row| row.verdict != RowVerdict::Fail), "{checks:?}");
    let codes: Vec<&str> = checks.iter().map(|row| row.finding.code.as_str()).collect();
    assert!(codes.contains(&"grbl.bridge_feeds") && !codes.contains(&"grbl.page_feeds"), "{codes:?}");
    page.ask(&Ask::Start { job: job.to_owned(), stream_digest, from_leg });
}

/// Confirms the tool. Touches it off first if its length is unknown.
fn change_tool(page: &mut Page) {
    let is_over = |tell: &Tell| matches!(tell, Tell::Status(status) if status.state != State::ToolChange);
    page.ask(&Ask::ToolChanged);
    if let Tell::Refused { why } = page.until(|tell| is_over(tell) || matches!(tell, Tell::Refused { .. })) {
        assert_eq!(why.code, "grbl.height_first");
        let height_mm = until_status(page, |_| true).work_mm[2];
        jog(page, 2, -height_mm, |status| status.work_mm[2].abs() < 0.01);
        page.ask(&Ask::SetHeight);
        sleep(Duration::from_millis(500));
        page.ask(&Ask::ToolChanged);
        page.until(is_over);
    }
}

pub(crate) fn drills(page: &mut Page, done: u32) -> Status {
    loop {
        let status = until_status(page, |status| {
            status.state == State::ToolChange || (status.job.is_some() && status.holes_done >= done)
        });
        if status.state != State::ToolChange {
            return status;
        }
        change_tool(page);
    }
}

pub(crate) fn ends(page: &mut Page) -> JobEnd {
    let changes = |tell: &Tell| matches!(tell, Tell::Status(status) if status.state == State::ToolChange);
    loop {
        match page.until(|tell| matches!(tell, Tell::Ended(_)) || changes(tell)) {
            Tell::Ended(end) => return end,
            _ => change_tool(page),
        }
    }
}

pub(crate) fn offer(page: &mut Page) -> InterruptedJob {
    match page.until(|tell| matches!(tell, Tell::Interrupted(_))) {
        Tell::Interrupted(offer) => offer,
        other => panic!("{other:?}"),
    }
}
