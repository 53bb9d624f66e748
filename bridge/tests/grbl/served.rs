//! Tests of a page that drives the real firmware through the bridge: the page leaves, the cable is pulled,
//! the bridge is killed. The step pins decide what was drilled.

use super::bench::{START, ZERO};
use super::firmware::{Board, Instrument, SPEED, STEPS, instrument, settings};
use super::judge::{self, Wanted};
use super::mill::{drills, ends, holes, home, offer, serve, set_zero, start, until_status, upload};
use annulus_core::control::{Ending, State, Trust};
use annulus_core::job::{Command, Leg, Mark, Program};
use annulus_core::wire::{Ask, JobEnd, Tell};
use tempfile::TempDir;

/// Permitted distance between a hole and its plan, in steps: rounding of position reports, and a reset.
const TOLERANCE: i64 = 10;

fn machine(instrument: &Instrument) -> Board {
    let settings = [settings(true), vec![(30, 10_000.0)]].concat();
    Board::new(instrument, &settings, START, &[])
}

fn bottoms(program: &Program) -> Vec<[f64; 3]> {
    let legs = program.legs.iter().enumerate().filter(|(_, leg)| matches!(leg.mark, Mark::Hole(_)));
    let bottom = |(index, leg): (usize, &Leg)| {
        let place = program.start_of_leg(index + 1);
        let depth = leg.commands.iter().find_map(|command| match command {
            Command::Plunge { to, .. } => Some(to.mm()),
            _ => None,
        });
        [place.x.mm(), place.y.mm(), depth.unwrap()]
    };
    legs.map(bottom).collect()
}

/// Turns the machine off, and compares its holes with the program.
fn judge(mut board: Board, program: &Program) {
    board.end();
    let zero = board.steps_at(ZERO);
    let at = |axis: usize, mm: f64| zero[axis] + (mm * STEPS).round() as i64;
    let holes =
        bottoms(program).iter().map(|hole| core::array::from_fn(|axis| at(axis, hole[axis]))).collect();
    let log = judge::read(&board.edges(), zero[2] - (0.05 * STEPS) as i64);
    let verdict = judge::compare(&log, &Wanted { holes, cuts: Vec::new() }, TOLERANCE);
    assert!(verdict.left_out.is_empty() && verdict.wrong.is_empty() && verdict.repeated <= 1, "{verdict:?}");
}

#[test]
fn job_of_a_page_is_drilled_without_the_page() {
    let Some(instrument) = instrument() else { return };
    let (board, program) = (machine(instrument), holes(8));
    let bridge = serve(TempDir::new().unwrap(), &board.port(), &SPEED.to_string());
    let (mut worker, mut viewer) = (bridge.page(), bridge.page());
    set_zero(&mut worker, ZERO);
    let job = upload(&bridge, &worker, &program);
    start(&mut worker, &job, 0);
    drills(&mut worker, 1);
    drop(worker);
    let JobEnd { ending, holes_done, .. } = ends(&mut viewer);
    assert_eq!((ending, holes_done), (Ending::Done, 8));
    drop(bridge);
    judge(board, &program);
}

#[test]
fn stopped_job_of_a_page_resumes() {
    let Some(instrument) = instrument() else { return };
    let (board, program) = (machine(instrument), holes(8));
    let bridge = serve(TempDir::new().unwrap(), &board.port(), &SPEED.to_string());
    let mut page = bridge.page();
    set_zero(&mut page, ZERO);
    let job = upload(&bridge, &page, &program);
    start(&mut page, &job, 0);
    drills(&mut page, 3);
    page.ask(&Ask::Stop);
    assert_eq!(ends(&mut page).ending, Ending::Stopped);
    let next_leg = offer(&mut page).next_leg;
    let rest = until_status(&mut page, |status| matches!(status.state, State::Ready | State::NotHomed));
    if rest.trust != Trust::Trusted {
        home(&mut page);
    }
    start(&mut page, &job, next_leg);
    assert_eq!(ends(&mut page).ending, Ending::Done);
    drop(bridge);
    judge(board, &program);
}

#[test]
fn pulled_cable_is_opened_again_and_the_job_resumes() {
    let Some(instrument) = instrument() else { return };
    let (board, program) = (machine(instrument), holes(8));
    let bridge = serve(TempDir::new().unwrap(), &board.port(), &SPEED.to_string());
    let mut page = bridge.page();
    set_zero(&mut page, ZERO);
    let job = upload(&bridge, &page, &program);
    start(&mut page, &job, 0);
    drills(&mut page, 2);
    board.plug(false);
    assert_eq!(ends(&mut page).ending, Ending::Alarm);
    board.rests();
    board.plug(true);
    page.until(|tell| matches!(tell, Tell::Controller(_)));
    // The user has not read the alarm yet.
    let back = until_status(&mut page, |_| true);
    assert_eq!((back.alarm.as_ref().unwrap().code.as_str(), back.trust), ("grbl.unplugged", Trust::Lost));
    assert!(back.lift_first_mm.is_some(), "the tool may be in the board: {back:?}");
    let next_leg = offer(&mut bridge.page()).next_leg;
    home(&mut page);
    start(&mut page, &job, next_leg);
    let JobEnd { ending, holes_done, .. } = ends(&mut page);
    assert_eq!((ending, holes_done), (Ending::Done, 8));
    drop(bridge);
    judge(board, &program);
}

#[test]
fn killed_bridge_offers_the_job_of_its_page_again() {
    let Some(instrument) = instrument() else { return };
    let (board, program) = (machine(instrument), holes(8));
    let mut bridge = serve(TempDir::new().unwrap(), &board.port(), &SPEED.to_string());
    let mut page = bridge.page();
    set_zero(&mut page, ZERO);
    let job = upload(&bridge, &page, &program);
    start(&mut page, &job, 0);
    drills(&mut page, 3);
    bridge.child.kill().unwrap();
    bridge.child.wait().unwrap();
    board.rests();
    let bridge = serve(bridge.home.take().unwrap(), &board.port(), &SPEED.to_string());
    let mut page = bridge.page();
    let offered = offer(&mut page);
    assert_eq!(offered.job, job);
    home(&mut page);
    start(&mut page, &job, offered.next_leg);
    let JobEnd { ending, holes_done, .. } = ends(&mut page);
    assert_eq!((ending, holes_done), (Ending::Done, 8));
    drop(bridge);
    judge(board, &program);
}
