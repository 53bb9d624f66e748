//! Tests of a tool-change macro entered in the page: the user is not asked, and the page shows the current
//! tool.

use super::{Bench, Memory, holes};
use crate::grbl::tests::Automaton;
use annulus_core::control::{Ending, State};
use annulus_core::grbl::CHANGER_KEY;
use annulus_core::machine::Value;
use annulus_core::wire::{ArmedJob, Ask, ControllerReport, JobEnd, RowVerdict, Tell};

pub(super) fn lines(text: &str) -> Ask {
    let lines = text.lines().map(str::to_owned).collect();
    Ask::Configure { changes: vec![(CHANGER_KEY.to_owned(), Value::Texts(lines))] }
}

#[test]
fn tool_changer_runs_its_lines_without_asking() {
    let mut board = Automaton::new([-20.0, -30.0, -10.0]);
    board.rack = Some(|_| 0.0);
    let mut bench = Bench::ready_with(&Memory::default(), board);
    for bad in ["$H", "M6 !"] {
        assert_eq!(bench.refused(&lines(bad)), Some("changer.bad_line".to_owned()), "{bad}");
    }
    assert_eq!(bench.refused(&lines(&"M5\n".repeat(40))), Some("changer.too_many".to_owned()));
    let program = holes(10);
    let key = bench.upload(&program);
    assert_eq!(bench.refused(&lines("G53 G0 Z-1\nM6 T{tool}\nG53 G0 X-200")), None);
    bench.start(&key, 0);
    let told = bench.heard.iter().any(|tell| match tell {
        Tell::Armed(ArmedJob { checks, .. }) => {
            checks.iter().any(|row| row.finding.code == "changer.lengths" && row.verdict == RowVerdict::Warn)
        }
        _ => false,
    });
    assert!(told, "that nobody measures them is a row to be read");
    let rows = |bench: &Bench| {
        let checks = bench.heard.iter().filter_map(|tell| match tell {
            Tell::Armed(ArmedJob { checks, .. }) => Some(checks.iter().map(|row| row.finding.code.clone())),
            _ => None,
        });
        checks.flatten().collect::<Vec<_>>()
    };
    let says = |code: &str| rows(&bench).contains(&code.to_owned());
    assert!(says("changer.fetches_first") && !says("grbl.height_of_first"), "{:?}", rows(&bench));
    bench.until(|status| status.changing == Some([2, 3]) && status.state == State::ToolChange);
    assert!(bench.refused(&Ask::ToolChanged).is_some());
    bench.until(|status| status.job.is_none());
    assert_eq!(bench.made(&program), (vec![1; 10], 0));
    assert!(bench.heard.iter().any(|tell| matches!(tell, Tell::Ended(JobEnd { ending: Ending::Done, .. }))));
    // By their numbers in the tool list.
    assert_eq!(bench.board.fetched, [6, 8]);
    // The macro is saved until it is deleted.
    let bench = bench.replug();
    let told = |bench: &Bench| {
        bench.heard.iter().rev().find_map(|tell| match tell {
            Tell::Controller(ControllerReport { changer, .. }) => Some(changer.len()),
            _ => None,
        })
    };
    assert_eq!(told(&bench), Some(3));
    let mut bench = bench;
    assert_eq!(bench.refused(&lines("")), None);
    assert_eq!(told(&bench), Some(0));
}
