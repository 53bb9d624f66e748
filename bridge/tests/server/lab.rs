//! Tests of the Lab's queue and outputs over a real socket.

use super::client::{Page, Running};
use super::work::until_status;
use annulus_core::control::State;
use annulus_core::queue::Mode;
use annulus_core::wire::{Ask, QueuePhase, QueueStatus, Tell};
use tempfile::TempDir;

fn until_queue(page: &mut Page, wanted: impl Fn(&QueueStatus) -> bool) -> QueueStatus {
    match page.until(|tell| matches!(tell, Tell::Queue(status) if wanted(status))) {
        Tell::Queue(status) => *status,
        other => panic!("{other:?}"),
    }
}

#[test]
fn queue_is_visible_to_and_stoppable_by_every_page() {
    let bridge = Running::start_at(TempDir::new().unwrap(), "50");
    let (mut worker, mut viewer) = (bridge.page(), bridge.page());
    let text = "HOME ALL ; first\nREPEAT 900\nMOVE_BY 80 0\n* MOVE_BY -80 0\nEND\n".to_owned();
    viewer.ask(&Ask::Queue { text: text.clone() });
    assert_eq!(viewer.refusal(), "control.needed");
    assert!(worker.take_control(false));
    worker.ask(&Ask::Queue { text: "HOME ALL\nMOVE_BY 99999 0".into() });
    assert_eq!(worker.refusal(), "queue.outside");
    worker.ask(&Ask::Queue { text: text.clone() });
    until_queue(&mut worker, |queue| queue.phase == QueuePhase::Ready && queue.total == 2 + 3 * 900);
    viewer.until(|tell| matches!(tell, Tell::QueueText { text: told } if *told == text));
    worker.ask(&Ask::QueueRun { mode: Mode::Step });
    until_queue(&mut worker, |queue| queue.phase == QueuePhase::Held && queue.row == Some(1));
    worker.ask(&Ask::QueueRun { mode: Mode::ToBreakpoint });
    let held = until_queue(&mut viewer, |queue| queue.phase == QueuePhase::Held && queue.row == Some(3));
    assert!(held.results.iter().any(|(row, result)| *row == 2 && result.turns == 1), "{held:?}");
    worker.ask(&Ask::QueueRun { mode: Mode::ToEnd });
    until_status(&mut viewer, |status| status.command.as_deref() == Some("MOVE_BY"));
    viewer.ask(&Ask::Stop);
    let stopped = until_queue(&mut viewer, |queue| queue.phase == QueuePhase::Stopped);
    assert!(stopped.passed < stopped.total);
    until_status(&mut viewer, |status| status.state == State::Ready);
    let mut newcomer = bridge.page();
    newcomer.until(|tell| matches!(tell, Tell::QueueText { text: told } if *told == text));
    until_queue(&mut newcomer, |queue| queue.whole && queue.phase == QueuePhase::Stopped);
}

#[test]
fn outputs_lock_when_their_page_leaves() {
    let bridge = Running::start_at(TempDir::new().unwrap(), "50");
    let (mut worker, mut viewer) = (bridge.page(), bridge.page());
    let spindle = Ask::Output { name: "spindle".into(), on: true, pulse_ms: None };
    worker.ask(&spindle);
    assert_eq!(worker.refusal(), "control.needed");
    assert!(worker.take_control(false));
    worker.ask(&spindle);
    assert_eq!(worker.refusal(), "control.outputs_locked");
    worker.ask(&Ask::OutputLease { minutes: 5 });
    worker.ask(&spindle);
    viewer.until(
        |tell| matches!(tell, Tell::Outputs(outputs) if outputs.on == 0b1 && outputs.left_s.is_some()),
    );
    drop(worker);
    viewer
        .until(|tell| matches!(tell, Tell::Outputs(outputs) if outputs.on == 0 && outputs.left_s.is_none()));
    let mut watcher = bridge.page_that_may("view");
    watcher.ask(&Ask::OutputLease { minutes: 5 });
    assert_eq!(watcher.refusal(), "control.scope");
}
