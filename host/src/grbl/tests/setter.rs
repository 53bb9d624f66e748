//! Tests of a tool setter on a controller: chosen once and saved, announced before a job, shown while
//! measuring. Every hole must have its planned depth with any tool.

use super::*;
use annulus_core::grbl::{LENGTH_KEY, SETTER_KEY, SetterStep, ToolLengths, ToolSetter};
use annulus_core::wire::{ArmedJob, ControllerReport, JobEnd};
use std::collections::BTreeSet;

/// A pin on the left, 20 mm above the board.
pub(super) const SETTER: ToolSetter = ToolSetter {
    place_mm: [-250.0, -20.0],
    from_mm: -5.0,
    depth_mm: 40.0,
    fast_mm_per_min: 300.0,
    slow_mm_per_min: 30.0,
};

pub(super) fn surface(x: f64, y: f64) -> f64 {
    let (x, y) = (x + 250.0, y + 20.0);
    if x * x + y * y < 9.0 { ZERO[2] + 20.0 } else { ZERO[2] }
}

pub(super) fn on(word: &str) -> Ask {
    Ask::Configure { changes: vec![(LENGTH_KEY.to_owned(), Value::Text(word.to_owned()))] }
}

pub(super) fn at(numbers: &[f64]) -> Ask {
    Ask::Configure { changes: vec![(SETTER_KEY.to_owned(), Value::Numbers(numbers.to_vec()))] }
}

impl Bench {
    fn lengths(&self) -> ToolLengths {
        let mut told = self.heard.iter().rev();
        let told = told.find_map(|tell| {
            if let Tell::Controller(ControllerReport { lengths, .. }) = tell { Some(lengths) } else { None }
        });
        *told.unwrap()
    }

    fn setter_row(&mut self, key: &str) -> Option<(String, RowVerdict)> {
        self.fails(key, 0);
        let armed = self.heard.iter().rev().find_map(|tell| match tell {
            Tell::Armed(ArmedJob { checks, .. }) => Some(checks.clone()),
            _ => None,
        });
        let is_its = |code: &str| code.starts_with("setter.") && code != "setter.reference";
        let row = armed.unwrap().into_iter().find(|row| is_its(&row.finding.code));
        row.map(|row| (row.finding.code, row.verdict))
    }
}

#[test]
fn tool_setter_choice_is_saved_and_shown_before_a_job() {
    let files = Memory::default();
    let mut bench = Bench::ready(&files);
    let key = bench.upload(&holes(3));
    assert_eq!((bench.lengths(), bench.setter_row(&key)), (ToolLengths::default(), None));
    for wrong in [on("guess"), at(&[]), at(&[-250.0, -20.0, -5.0, 40.0, 300.0]), at(&[0.0; 6])] {
        assert_eq!(bench.refused(&wrong).as_deref(), Some("setter.bad"), "{wrong:?}");
    }
    assert_eq!(bench.refused(&on("setter")), None);
    assert_eq!(bench.setter_row(&key), Some(("setter.no_place".to_owned(), RowVerdict::Fail)));
    assert_eq!(bench.refused(&at(&SETTER.numbers())), None);
    assert_eq!(bench.setter_row(&key), Some(("setter.measures".to_owned(), RowVerdict::Pass)));
    let far = ToolSetter { place_mm: [-250.0, 20.0], ..SETTER };
    assert_eq!(bench.refused(&at(&far.numbers())), None);
    assert_eq!(bench.setter_row(&key), Some(("setter.no_room".to_owned(), RowVerdict::Fail)));
    assert_eq!(bench.refused(&at(&SETTER.numbers())), None);
    // Other settings stay, and this one stays with them.
    let thick = vec![("stroke.board_thickness".to_owned(), Value::Number(1.2))];
    assert_eq!(bench.refused(&Ask::Configure { changes: thick }), None);
    let mut again = bench.replug();
    assert_eq!(again.lengths(), ToolLengths { on_setter: true, setter: Some(SETTER) });
    assert_eq!(again.refused(&on("board")), None);
    assert_eq!(again.lengths().in_force(), None);
}

#[test]
fn every_tool_is_measured_during_its_change() {
    let (files, program) = (Memory::default(), holes(10));
    let mut bench = Bench::ready(&files);
    bench.board.surface = Some(surface);
    for ask in [at(&SETTER.numbers()), on("setter")] {
        assert_eq!(bench.refused(&ask), None);
    }
    let key = bench.upload(&program);
    assert!(bench.ticks(&key, 0).contains(&"setter.reference".to_owned()));
    bench.start(&key, 0);
    // The tool that zero was set with is measured before any tool is requested.
    bench.until(|status| status.measuring.is_some());
    for longer_mm in [1.2, 3.7] {
        let now = bench.until(|status| status.state == State::ToolChange && status.measuring.is_none());
        bench.board.tool_mm = longer_mm;
        bench.heard = vec![Tell::Status(Box::new(now))];
        assert_eq!(bench.refused(&Ask::ToolChanged), None);
        bench.until(|status| status.state == State::Running);
        let steps: BTreeSet<String> = bench
            .heard
            .iter()
            .filter_map(|tell| if let Tell::Status(status) = tell { status.measuring } else { None })
            .map(|step| format!("{step:?}"))
            .collect();
        // Steps shorter than two status reports may be missed.
        for step in [SetterStep::Up, SetterStep::Near, SetterStep::Touch, SetterStep::Again, SetterStep::Lift]
        {
            assert!(steps.contains(&format!("{step:?}")), "{longer_mm}: {steps:?}");
        }
        let named = bench.heard.iter().all(|tell| match tell {
            Tell::Status(status) => status.measuring.is_none() || status.state == State::ToolChange,
            _ => true,
        });
        assert!(named, "it is a change of tools all along");
    }
    bench.until(|status| status.job.is_none());
    assert_eq!(bench.made(&program), (vec![1; 10], 0));
    assert!(bench.heard.iter().any(|tell| matches!(tell, Tell::Ended(JobEnd { ending: Ending::Done, .. }))));
}
