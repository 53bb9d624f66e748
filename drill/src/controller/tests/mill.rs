//! The mill that a person said the controller is: kept, told, compared before a job.

use super::*;
use annulus_core::machine::MILL_KEY;
use annulus_core::wire::PreflightRow;

fn say(name: &str) -> Ask {
    Ask::Configure { changes: vec![(MILL_KEY.to_owned(), Value::Text(name.to_owned()))] }
}

impl Bench {
    /// The mill that was told last.
    fn mill(&self) -> Option<String> {
        let mut told = self.heard.iter().rev();
        told.find_map(|tell| if let Tell::Controller { mill, .. } = tell { Some(mill.clone()) } else { None })
            .flatten()
    }

    /// What is said of the mill before the job `key`.
    fn unlike(&mut self, key: &str) -> Vec<String> {
        self.ask(&Ask::Arm { job: key.to_owned(), from_leg: 0 });
        let armed = self.heard.iter().rev().find_map(|tell| match tell {
            Tell::Armed { checks, .. } => Some(checks.clone()),
            _ => None,
        });
        let of_mill = |row: &PreflightRow| row.finding.argument(&["machine"]).is_some();
        let rows = armed.unwrap().into_iter().filter(of_mill);
        rows.inspect(|row| assert_eq!(row.verdict, RowVerdict::Warn)).map(|row| row.finding.code).collect()
    }
}

#[test]
fn a_controller_that_is_not_as_the_mill_that_it_is_said_to_be_is_told_of_before_a_job() {
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
    // It is kept, and can be taken back.
    let mut again = bench.replug();
    assert_eq!(again.mill().as_deref(), Some("shapeoko-3"));
    assert_eq!(again.refused(&say("")), None);
    assert_eq!(again.mill(), None);
}
