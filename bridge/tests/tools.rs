//! Tests of tool wear: a life that ends during a job, and the counts after a killed bridge. The real
//! `annulus` on the virtual drill; holes are counted in the drilled-board record, independent of the
//! journal.

use crate::kill;
use crate::server::client::{Running, output};
use crate::server::work::{home, row_of_holes, until_status};
use annulus_core::chance::Chance;
use annulus_core::control::{Ending, State};
use annulus_core::wire::{ArmedJob, Ask, JobEnd, RowVerdict, Tell, ToolsReport, program};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::time::Duration;
use tempfile::TempDir;

fn home_with(tools: &str) -> TempDir {
    let home = TempDir::new().unwrap();
    let folder = home.path().join("machines");
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("virtual.toml"), format!("schema = 1\n[rack]\ntools = [{tools}]\n")).unwrap();
    home
}

fn listed(home: &TempDir) -> Vec<(u64, u64, bool)> {
    let (code, object, said) = output(home, &["tools", "list", "--json"]);
    assert_eq!(code, 0, "{said}");
    let number = |row: &Value, name: &str| row[name].as_u64().unwrap();
    let rows = object["tools"].as_array().unwrap().iter();
    rows.map(|row| (number(row, "number"), number(row, "hits"), row["worn"] == true)).collect()
}

#[test]
fn worn_tool_is_replaced_by_its_twin_between_two_holes() {
    // T1 and T9 are alike: T9 replaces T1, and once both are worn, a new T1 is requested.
    let home_of_it = home_with("\"T1 drill 0.8 life 5\", \"T9 drill 0.8 life 3\"");
    let bridge = Running::start_at(home_of_it, "20");
    let mut page = bridge.page();
    home(&mut page);
    page.ask(&Ask::SetZero);
    let bytes = program::encode(&row_of_holes(12));
    let job = program::key(&bytes);
    assert_eq!(bridge.job((&page.session, &page.key), "PUT", &job, &bytes).status, 200);
    page.ask(&Ask::Arm { job: job.clone(), from_leg: 0 });
    let armed = page.until(|tell| matches!(tell, Tell::Armed(_)));
    let Tell::Armed(ArmedJob { stream_digest, checks, .. }) = armed else { panic!("{armed:?}") };
    assert!(checks.iter().all(|row| row.verdict != RowVerdict::Fail), "{checks:?}");
    let told = checks.iter().find(|row| row.finding.code == "preflight.tool_wears_out").unwrap();
    assert_eq!(told.verdict, RowVerdict::Pass);
    page.ask(&Ask::Start { job, stream_digest, from_leg: 0 });
    // Holes done, requested tool, and wear of T1 and T9.
    let changes = [(0, 1, [0, 0]), (5, 9, [5, 0]), (8, 1, [5, 3])];
    for (holes, wanted, hits) in changes {
        let report = page.until(|tell| matches!(tell, Tell::Tools(report) if report.wanted.is_some()));
        let Tell::Tools(report) = report else { panic!("{report:?}") };
        let done = |number| report.wear.iter().find(|wear| wear.number == number).map_or(0, |wear| wear.hits);
        assert_eq!((report.wanted, [done(1), done(9)]), (Some(wanted), hits));
        let status = until_status(&mut page, |status| status.state == State::ToolChange);
        assert_eq!((status.holes_done, status.spindle_rpm), (holes, 0));
        if holes > 0 {
            let change = status.change.unwrap();
            assert!(change.is_up && change.is_at_place, "up, and at the change position: {status:?}");
        }
        page.ask(&Ask::ToolChanged);
    }
    let ended = page.until_ended();
    assert!(matches!(ended, Tell::Ended(JobEnd { ending: Ending::Done, holes_done: 12, .. })), "{ended:?}");
    let status = until_status(&mut page, |status| status.state == State::Ready);
    let drilled = status.drilled.unwrap();
    assert_eq!((drilled.missing, drilled.doubled, drilled.shifted, drilled.broken), (0, 0, 0, 0));
    let folder = bridge.home.as_ref().unwrap();
    let record = fs::read_to_string(folder.path().join("drilled.txt")).unwrap();
    assert_eq!((record.lines().count(), record.lines().collect::<BTreeSet<_>>().len()), (12, 12));
    // While it runs, the journal is locked; the page reports a new T9.
    let (code, refused, _) = output(folder, &["tools", "reset", "9", "--json"]);
    assert!(code != 0 && refused["error"]["code"] == "journal.in_use", "{refused}");
    page.ask(&Ask::NewTool { number: 7 });
    assert_eq!(page.refusal(), "control.no_such_tool");
    page.ask(&Ask::NewTool { number: 9 });
    let is_new = |report: &ToolsReport| report.wear.iter().any(|wear| (wear.number, wear.hits) == (9, 0));
    page.until(|tell| matches!(tell, Tell::Tools(report) if is_new(report)));
    let mut bridge = bridge;
    kill_process(Pid::from_child(&bridge.child), Signal::TERM).unwrap();
    bridge.child.wait().unwrap();
    let home = bridge.home.take().unwrap();
    assert_eq!(listed(&home), [(1, 4, false), (9, 0, false)]);
    let (code, ..) = output(&home, &["tools", "reset", "1"]);
    assert_eq!((code, listed(&home)), (0, vec![(1, 0, false), (9, 0, false)]));
    let (code, refused, _) = output(&home, &["tools", "reset", "2", "--json"]);
    assert!(code != 0 && refused["error"]["code"] == "control.no_such_tool", "{refused}");
}

#[test]
fn killed_runs_count_every_hole_once_as_wear() {
    let mut chance = Chance::new(20_261_126);
    let home = TempDir::new().unwrap();
    fs::write(home.path().join("board.annulus-program"), program::encode(&kill::board())).unwrap();
    let (mut kills, mut known) = (0, 0);
    loop {
        let mut child = kill::start(home.path());
        kill::drilled(home.path(), known, &mut child);
        std::thread::sleep(Duration::from_micros(chance.bits() % 20_000));
        let over = child.try_wait().unwrap().is_some();
        let _ = child.kill();
        child.wait().unwrap();
        let record = kill::record(home.path());
        let holes = record.iter().collect::<BTreeSet<_>>().len() as u64;
        let hits: u64 = listed(&home).iter().map(|(_, hits, _)| hits).sum();
        // The current drill cycle may be made but not counted yet; it is then repeated and counted.
        assert!(hits == holes || hits + 1 == holes, "kill {kills}: {hits} hits, {holes} holes");
        known = record.len();
        kills += u32::from(!over);
        if over || hits == u64::from(kill::HOLES) {
            assert_eq!((hits, holes), (u64::from(kill::HOLES), u64::from(kill::HOLES)));
            break;
        }
    }
    assert!(kills >= 3, "the board was done after {kills} kills");
    // The same board twice more, the first time perhaps only its rest: the journal counts on.
    for _ in 0..2 {
        kill::start(home.path()).wait_with_output().unwrap();
    }
    let hits: u64 = listed(&home).iter().map(|(_, hits, _)| hits).sum();
    let boards = hits / u64::from(kill::HOLES);
    assert!(boards >= 2 && hits == boards * u64::from(kill::HOLES), "{hits}");
}
