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

/// `count` holes of one diameter.
pub(crate) fn holes(count: usize) -> Program {
    planned::holes(&hobby_3018(), count, 4, |_| 800)
}

/// Serves the controller at `port`.
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

/// Takes control, which the page may have already, and homes.
pub(crate) fn home(page: &mut Page) -> Status {
    page.ask(&Ask::ReleaseControl);
    assert!(page.take_control(true));
    page.ask(&Ask::AcknowledgeAlarm);
    page.ask(&Ask::Home);
    until_status(page, |status| status.state == State::Ready && status.trust == Trust::Trusted)
}

/// Homes, jogs to `zero` in machine coordinates, mm, and sets the work zero there.
pub(crate) fn set_zero(page: &mut Page, zero: [f64; 3]) {
    let homed = home(page);
    for (axis, to) in zero.into_iter().enumerate() {
        let distance_um = ((to - homed.machine_mm[axis]) * 1e3).round() as i32;
        page.ask(&Ask::Jog { axis: axis as u8, distance_um, anyway: false });
        let is_there =
            |status: &Status| status.state == State::Ready && (status.machine_mm[axis] - to).abs() < 0.01;
        loop {
            page.ask(&Ask::JogOn);
            if is_there(&until_status(page, |_| true)) {
                break;
            }
        }
    }
    let near = |mm: f64| mm.abs() < 0.01;
    page.ask(&Ask::SetZero);
    until_status(page, |status| status.work_mm[..2].iter().all(|mm| near(*mm)));
    // The engine asks the controller once more.
    sleep(Duration::from_millis(500));
    page.ask(&Ask::SetHeight);
    until_status(page, |status| near(status.work_mm[2]));
    sleep(Duration::from_millis(500));
}

/// Uploads a program. Returns its key.
pub(crate) fn upload(bridge: &Running, page: &Page, program: &Program) -> String {
    let bytes = program::encode(program);
    let job = program::key(&bytes);
    assert_eq!(bridge.job((&page.session, &page.key), "PUT", &job, &bytes).status, 200);
    job
}

/// Arms and starts the job.
pub(crate) fn start(page: &mut Page, job: &str, from_leg: u32) {
    page.ask(&Ask::Arm { job: job.to_owned(), from_leg });
    let armed = page.until(|tell| matches!(tell, Tell::Armed(_) | Tell::Refused { .. }));
    let Tell::Armed(ArmedJob { stream_digest, checks, .. }) = armed else { panic!("{armed:?}") };
    assert!(checks.iter().all(|row| row.verdict != RowVerdict::Fail), "{checks:?}");
    let codes: Vec<&str> = checks.iter().map(|row| row.finding.code.as_str()).collect();
    assert!(codes.contains(&"grbl.bridge_feeds") && !codes.contains(&"grbl.page_feeds"), "{codes:?}");
    page.ask(&Ask::Start { job: job.to_owned(), stream_digest, from_leg });
}

/// Confirms tools until `done` holes are drilled.
pub(crate) fn drills(page: &mut Page, done: u32) -> Status {
    loop {
        let status = until_status(page, |status| {
            status.state == State::ToolChange || (status.job.is_some() && status.holes_done >= done)
        });
        if status.state != State::ToolChange {
            return status;
        }
        page.ask(&Ask::ToolChanged);
    }
}

/// Confirms tools until the job ends.
pub(crate) fn ends(page: &mut Page) -> JobEnd {
    let changes = |tell: &Tell| matches!(tell, Tell::Status(status) if status.state == State::ToolChange);
    loop {
        match page.until(|tell| matches!(tell, Tell::Ended(_)) || changes(tell)) {
            Tell::Ended(end) => return end,
            _ => page.ask(&Ask::ToolChanged),
        }
    }
}

/// The interrupted job that is offered.
pub(crate) fn offer(page: &mut Page) -> InterruptedJob {
    match page.until(|tell| matches!(tell, Tell::Interrupted(_))) {
        Tell::Interrupted(offer) => offer,
        other => panic!("{other:?}"),
    }
}
