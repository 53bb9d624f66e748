//! The program's lines: when they are written, and how lines and seconds map to each other.

use super::compare;
use super::story::Story;
use crate::engine::messages::Timed;
use crate::keys::Tab;
use crate::model::lines::{WrittenProgram, row_now};
use crate::model::{FrameEvent, ListingEvent, Model, PlayEvent, TemplateEvent, update};
use annulus_core::geometry::Point;
use annulus_core::job::{Command, Leg, Mark, Program};
use annulus_core::machine::virtual_drill;
use annulus_core::motion::timeline;
use annulus_core::post::{self, Manner};
use annulus_core::units::Length;
use std::sync::Arc;

#[test]
fn program_is_written_only_while_its_lines_are_shown() {
    const PLANNED: &str = "open certain plan prove time";
    let rows = [
        ("show-lines", "| "),
        ("simulate", "| "),
        ("simulate show-lines", "writing | lines"),
        ("show-lines simulate", "writing | lines"),
        ("simulate show-lines lines", "written | "),
        ("simulate show-lines lines show-steps show-lines", "written | "),
        ("simulate show-lines lines-refused", "refused | "),
        ("simulate show-lines lines-gone", "writing | read lines"),
        ("simulate show-lines lines-gone certain lines", "written | "),
        ("simulate show-lines lines-gone certain lines-gone", "refused | "),
        // After a cancel, the list is written when it is shown again.
        ("simulate show-lines lines-stopped", "| "),
        ("simulate show-lines lines-stopped show-steps show-lines", "writing | lines"),
        // Another postprocessor, another plan.
        ("simulate show-lines lines marlin", "writing | lines"),
        ("simulate show-lines marlin lines", "writing | lines"),
        ("simulate show-lines lines edit", "| plan keep-rests"),
        ("simulate show-lines lines edit plan prove time", "writing | lines"),
    ];
    compare(
        &rows,
        |words| Story::told(&format!("{PLANNED} {words}")),
        |story| {
            let lines = &story.model.lines;
            let facts = [
                (lines.is_on_the_way(), "writing "),
                (lines.written.is_some(), "written "),
                (!lines.refused.is_empty(), "refused "),
            ];
            let facts: String = facts.iter().filter(|(on, _)| *on).map(|(_, word)| *word).collect();
            format!("{facts}| {}", story.out())
        },
    );
}

pub(super) fn program() -> Program {
    let um = Length::from_um;
    let up = Command::Retract { to: um(2_000) };
    let plunge = Command::Plunge { to: um(-200), feed_um_per_s: 5_000, gate: None };
    let mill = |x, y| Command::Mill { to: Point::from_mm(x, y), height: um(-200), feed_um_per_s: 10_000 };
    let mut way = vec![Command::Rapid { to: Point::from_mm(5.0, 5.0) }, plunge];
    way.extend([mill(25.0, 5.0), mill(25.0, 15.0), mill(5.0, 15.0), up]);
    Program {
        name: "lines".to_owned(),
        machine: String::new(),
        origin: Point::default(),
        bits: Vec::new(),
        accepted: Vec::new(),
        safe_height: um(2_000),
        spindles: 1,
        legs: vec![
            Leg { mark: Mark::Prepare, commands: vec![Command::Spindle { rpm: 0 }] },
            Leg { mark: Mark::Toolpath(0), commands: way },
            Leg { mark: Mark::Finish, commands: vec![Command::Spindle { rpm: 0 }] },
        ],
    }
}

#[test]
fn line_and_playback_time_select_each_other() {
    let (machine, program) = (virtual_drill(), program());
    let mut model = Model::default();
    let timed = Timed { timeline: timeline(&program, &machine).unwrap(), ..Timed::default() };
    model.board.timed = Some(Arc::new(timed));
    update(&mut model, PlayEvent::Frame.into());
    update(&mut model, ListingEvent::Show { on: true }.into());
    assert_eq!(row_now(&model), None, "nothing is written");
    let files = post::write("grbl", &program, &Manner::on(&machine)).unwrap().unwrap();
    let written = Arc::new(WrittenProgram::of(&files));
    model.lines.written = Some(written.clone());
    let row = |text: &str| {
        let found =
            (0..written.len()).find(|row| written.row(*row).is_some_and(|(_, line)| line.starts_with(text)));
        found.unwrap_or_else(|| panic!("no line {text}"))
    };
    let name = written.row(0).unwrap();
    assert!(name.0.is_none() && name.1.ends_with(".nc"), "{name:?}");
    assert_eq!(written.row(1).unwrap().0, Some(1));
    assert_eq!(written.row(written.len()), None);
    for (text, place) in [("G1 X25.0000 Y5.0000", [5.0, 5.0]), ("G1 X25.0000 Y15.0000", [25.0, 5.0])] {
        update(&mut model, ListingEvent::Press { row: row(text) }.into());
        let now = model.play.playback.as_ref().unwrap().at(model.play.at_s).unwrap();
        assert_eq!(row_now(&model), Some(row(text)));
        let away = (now.position_mm[0] - place[0]).abs() + (now.position_mm[1] - place[1]).abs();
        assert!(away < 0.05 && now.position_mm[2] < 0.0, "{text}: {now:?}");
        // The line is current because of the time and not because of the press.
        let at_s = model.play.at_s + 0.05;
        update(&mut model, PlayEvent::Hold { at_s }.into());
        assert_eq!(row_now(&model), Some(row(text)));
    }
    // A press in the view marks the line that cuts there.
    update(&mut model, PlayEvent::At { place_mm: [12.0, 15.1] }.into());
    assert_eq!(row_now(&model), Some(row("G1 X5.0000 Y15.0000")));
    update(&mut model, ListingEvent::Walk { by: -1 }.into());
    assert_eq!(row_now(&model), Some(row("G1 X25.0000 Y15.0000")));
    update(&mut model, ListingEvent::Walk { by: i64::MIN / 2 }.into());
    assert_eq!(row_now(&model), Some(0));
    update(&mut model, ListingEvent::Press { row: 1_000_000 }.into());
    assert_eq!(row_now(&model), Some(0), "there is no such row");
    update(&mut model, ListingEvent::Show { on: false }.into());
    assert_eq!(row_now(&model), None);
}

impl Story {
    pub(super) fn lines_event(word: &str) -> Option<crate::model::Event> {
        Some(match word {
            "simulate" => FrameEvent::Show { tab: Tab::Simulate }.into(),
            "show-lines" => ListingEvent::Show { on: true }.into(),
            "show-steps" => ListingEvent::Show { on: false }.into(),
            "marlin" => TemplateEvent::Target { name: "marlin".to_owned() }.into(),
            _ => return None,
        })
    }
}
