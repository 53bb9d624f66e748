//! Tests of a station whose client is the command line.

use super::{Automaton, Memory, NOW};
use crate::files::{File, Files};
use crate::grbl::{Attended, AttendedJob, Setup, Station, Told};
use annulus_core::error;
use annulus_core::grbl::{EngineAsk, ResetOnOpen};
use std::sync::Arc;
use std::time::Duration;

/// Runs station and controller for `ms`. Returns the notices.
fn run(station: &mut Station<Memory>, board: &mut Automaton, ms: u64) -> Vec<Told> {
    let mut told = Vec::new();
    for _ in 0..ms {
        NOW.set(NOW.get() + Duration::from_millis(1));
        board.tick();
        let said = board.said();
        if !said.is_empty() {
            station.bytes(said);
        }
        station.advance();
        let written = station.written();
        if !written.is_empty() {
            board.hear(&written);
            station.carried();
        }
        told.extend(station.notices());
    }
    told
}

#[test]
fn command_hears_everything_in_order_and_writes_no_job() {
    let mut files = Memory::default();
    let command = Some((Attended::new(AttendedJob::default()), ResetOnOpen::Usual));
    let (tickets, named, in_page) = (Arc::default(), None, false);
    let setup = Setup { speed: 1.0, time: || NOW.get(), tickets, named, in_page, command };
    let mut station = Station::open(files.clone(), setup).unwrap();
    let told = run(&mut station, &mut Automaton::new([-20.0, -30.0, -10.0]), 5_000);
    assert!(told.iter().any(|told| matches!(told, Told::Greeted(_))), "{told:?}");
    // Nothing is held.
    station.command(EngineAsk::Resume);
    let told = station.notices();
    let [.., Told::Found(why), Told::Handled] = told.as_slice() else { panic!("{told:?}") };
    assert_eq!(why.code, "grbl.not_now");
    station.notice(Told::Found(error!("grbl.port_lost", port = "P", reason = "R")));
    station.unplugged();
    let told = station.notices();
    assert!(matches!(told.first(), Some(Told::Found(why)) if why.code == "grbl.port_lost"), "{told:?}");
    assert!(station.is_over());
    assert_eq!(files.read(File::Done(true)), Ok(Vec::new()));
}
