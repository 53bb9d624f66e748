//! Tests of the mill profile: saved, reported, compared before a job.

use super::*;
use annulus_core::machine::{MILL_KEY, Machine, virtual_drill};
use annulus_core::wire::{ArmedJob, ControllerReport, PreflightRow};

fn say(name: &str) -> Ask {
    Ask::Configure { changes: vec![(MILL_KEY.to_owned(), Value::Text(name.to_owned()))] }
}

impl Bench {
    fn mill(&self) -> Option<String> {
        let mut told = self.heard.iter().rev();
        told.find_map(|tell| {
            if let Tell::Controller(ControllerReport { mill, .. }) = tell { Some(mill.clone()) } else { None }
        })
        .flatten()
    }

    fn unlike(&mut self, key: &str) -> Vec<String> {
        self.ask(&Ask::Arm { job: key.to_owned(), from_leg: 0 });
        let armed = self.heard.iter().rev().find_map(|tell| match tell {
            Tell::Armed(ArmedJob { checks, .. }) => Some(checks.clone()),
            _ => None,
        });
        let of_mill = |row: &PreflightRow| row.finding.argument(&["machine"]).is_some();
        let rows = armed.unwrap().into_iter().filter(of_mill);
        rows.inspect(|row| assert_eq!(row.verdict, RowVerdict::Warn)).map(|row| row.finding.code).collect()
    }
}

#[test]
fn controller_unlike_the_chosen_machine_gives_warnings() {
    let files = Memory::default();
    let mut bench = Bench::ready(&files);
    let key = bench.upload(&drilled::holes(&hobby_3018(), 3, 4, |_| 800));
    assert_eq!((bench.mill(), bench.unlike(&key)), (None, vec![]));
    assert_eq!(bench.refused(&say("shapeoko-9")).as_deref(), Some("grbl.no_such_mill"));
    assert_eq!(bench.refused(&say("shapeoko-3")), None);
    assert_eq!(bench.mill().as_deref(), Some("shapeoko-3"));
    let unlike = bench.unlike(&key);
    assert!(unlike.iter().any(|code| code == "grbl.other_scale"), "{unlike:?}");
    assert!(unlike.iter().any(|code| code == "grbl.other_travel"), "{unlike:?}");
    // The choice is saved, and can be undone.
    let mut again = bench.replug();
    assert_eq!(again.mill().as_deref(), Some("shapeoko-3"));
    assert_eq!(again.refused(&say("")), None);
    assert_eq!(again.mill(), None);
}

impl Bench {
    /// The rows about feeds and the planned machine for the job `key`.
    fn planned_rows(&mut self, key: &str) -> Vec<(String, RowVerdict)> {
        self.ask(&Ask::Arm { job: key.to_owned(), from_leg: 0 });
        let armed = self.heard.iter().rev().find_map(|tell| match tell {
            Tell::Armed(ArmedJob { job, checks, .. }) if job == key => Some(checks.clone()),
            _ => None,
        });
        let codes = [
            "preflight.same_machine",
            "preflight.planned_for_other",
            "preflight.other_machine",
            "job.plunge_fast",
            "job.spindle_fast",
            "grbl.broken_bits_unseen",
        ];
        let rows = armed.unwrap().into_iter().map(|row| (row.finding.code, row.verdict));
        rows.filter(|(code, _)| codes.contains(&code.as_str())).collect()
    }
}

#[test]
fn planned_machine_is_compared_with_the_connected_one() {
    let files = Memory::default();
    let mut bench = Bench::ready(&files);
    let told = |rows: &[(&str, RowVerdict)]| -> Vec<(String, RowVerdict)> {
        rows.iter().map(|(code, verdict)| ((*code).to_owned(), *verdict)).collect()
    };
    let settings = bench.heard.iter().rev().find_map(|tell| match tell {
        Tell::Machine { settings, .. } => Some(settings.clone()),
        _ => None,
    });
    let own = annulus_core::machine::apply(&virtual_drill(), &settings.unwrap()).unwrap();
    let key = bench.upload(&drilled::holes(&own, 3, 4, |_| 800));
    // The controller does not detect a broken tool: the row must not show OK.
    let unseen = ("grbl.broken_bits_unseen", RowVerdict::Note);
    assert_eq!(bench.planned_rows(&key), told(&[("preflight.same_machine", RowVerdict::Pass), unseen]));
    // The same feeds on another machine. The controller's values are no valid machine, so `own` is the
    // default 3018.
    let other = Machine { settle_ms: own.settle_ms + 1.0, ..own };
    let key = bench.upload(&drilled::holes(&other, 3, 4, |_| 800));
    assert_eq!(bench.planned_rows(&key), told(&[("preflight.planned_for_other", RowVerdict::Warn), unseen]));
    // The virtual drill plunges six times as fast.
    let key = bench.upload(&drilled::holes(&virtual_drill(), 3, 4, |_| 800));
    let rows = bench.planned_rows(&key);
    assert_eq!(rows[0], ("preflight.other_machine".to_owned(), RowVerdict::Fail), "{rows:?}");
    assert!(rows.contains(&("job.plunge_fast".to_owned(), RowVerdict::Warn)), "{rows:?}");
}
