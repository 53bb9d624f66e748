//! Tests that jobs continue and jogs end when the page that started them disappears.

use super::client::{Page, Running};
use super::drill;
use annulus_core::control::{Ending, State};
use annulus_core::geometry::Point;
use annulus_core::job::{Command, Leg, Mark, Program};
use annulus_core::machine::virtual_drill;
use annulus_core::wire::{ArmedJob, Ask, Control, InterruptedJob, JobEnd, RowVerdict, Status, Tell, program};
use tempfile::TempDir;

pub(crate) fn row_of_holes(count: u32) -> Program {
    let machine = virtual_drill();
    let process = &machine.process;
    let feed_um_per_s = (process.feed_mm_per_s * 1e3) as u32;
    let put_in = Leg { mark: Mark::ToolChange(0), commands: vec![Command::AwaitBit { bit: 0 }] };
    let before = vec![put_in, drill::spin_up((process.spin_up_ms * 1e3) as u32)];
    let place = |hole: u32| Point::from_mm(f64::from(hole % 100) * 2.0, 1.0 + f64::from(hole / 100) * 0.15);
    let at = (0..count).map(place);
    drill::holes(&machine, before, (at, feed_um_per_s), vec![Command::Spindle { rpm: 0 }])
}

pub(crate) fn until_status(page: &mut Page, wanted: impl Fn(&Status) -> bool) -> Status {
    match page.until(|tell| matches!(tell, Tell::Status(status) if wanted(status))) {
        Tell::Status(status) => *status,
        other => panic!("{other:?}"),
    }
}

pub(crate) fn jog(page: &mut Page, axis: u8, distance_um: i32, wanted: impl Fn(&Status) -> bool) -> Status {
    page.ask(&Ask::Jog { axis, distance_um, anyway: true });
    loop {
        page.ask(&Ask::JogOn);
        match page.until(|tell| matches!(tell, Tell::Status(_))) {
            Tell::Status(status) if wanted(&status) => return *status,
            _ => {}
        }
    }
}

pub(crate) fn home(page: &mut Page) {
    assert!(page.take_control(false));
    page.ask(&Ask::Home);
    until_status(page, |status| status.state == State::Ready);
}

#[test]
fn closed_tab_leaves_the_job_running_and_stoppable() {
    let bridge = Running::start_at(TempDir::new().unwrap(), "5");
    let (mut worker, mut viewer) = (bridge.page(), bridge.page());
    home(&mut worker);
    worker.ask(&Ask::SetZero);
    let bytes = program::encode(&row_of_holes(100));
    let job = program::key(&bytes);
    assert_eq!(bridge.job((&worker.session, &worker.key), "PUT", &job, &bytes).status, 200);
    worker.ask(&Ask::Arm { job: job.clone(), from_leg: 0 });
    let armed = worker.until(|tell| matches!(tell, Tell::Armed(_) | Tell::Refused { .. }));
    let Tell::Armed(ArmedJob { stream_digest, checks, .. }) = armed else { panic!("{armed:?}") };
    assert!(checks.iter().all(|row| row.verdict != RowVerdict::Fail), "{checks:?}");
    worker.ask(&Ask::Start { job: job.clone(), stream_digest, from_leg: 0 });
    until_status(&mut worker, |status| status.state == State::ToolChange);
    worker.ask(&Ask::ToolChanged);
    until_status(&mut worker, |status| status.holes_done >= 2);
    drop(worker);
    viewer.until(|tell| matches!(tell, Tell::Control(Control { taken: false, viewers: 1, .. })));
    let seen = until_status(&mut viewer, |status| status.holes_done >= 6);
    assert_eq!(seen.state, State::Running);
    viewer.ask(&Ask::Stop);
    let end = viewer.until(|tell| matches!(tell, Tell::Ended(_)));
    assert!(
        matches!(&end, Tell::Ended(JobEnd { job: ended, ending: Ending::Stopped, .. }) if *ended == job),
        "{end:?}"
    );
    until_status(&mut viewer, |status| status.state != State::Running && status.state != State::Stopping);

    let mut newcomer = bridge.page();
    newcomer.until(
        |tell| matches!(tell, Tell::Interrupted(InterruptedJob { job: offered, .. }) if *offered == job),
    );
    let reply = bridge.job((&newcomer.session, &newcomer.key), "GET", &job, b"");
    assert_eq!((reply.status, reply.body), (200, bytes));
}

#[test]
fn jog_ends_when_its_page_closes() {
    let bridge = Running::start();
    let (mut worker, mut viewer) = (bridge.page(), bridge.page());
    home(&mut worker);
    worker.ask(&Ask::Jog { axis: 0, distance_um: 290_000, anyway: false });
    until_status(&mut worker, |status| status.state == State::Jogging);
    drop(worker);
    let rest = until_status(&mut viewer, |status| matches!(status.state, State::Ready | State::NotHomed));
    assert!(rest.machine_mm[0] < 285.0, "went all the way: {rest:?}");
}

#[test]
fn stop_cancels_a_jog_sent_before_it() {
    let bridge = Running::start();
    let mut page = bridge.page();
    home(&mut page);
    page.ask(&Ask::Jog { axis: 0, distance_um: 100_000, anyway: false });
    page.ask(&Ask::Stop);
    let rest = until_status(&mut page, |status| matches!(status.state, State::Ready | State::NotHomed));
    assert!(rest.machine_mm[0] < 95.0, "{rest:?}");
}
