//! The board of the machine's job, opened by a page that was loaded during the job.

use super::line::status;
use super::story::Story;
use crate::keys::Tab;
use crate::model::job_board::{outline, to_restore};
use crate::model::{FrameEvent, Job, KeepEvent, Offer};
use annulus_core::board::{Board, Hole};
use annulus_core::control::State;
use annulus_core::geometry::{Bounds, Island, Point, Region, rectangle};
use annulus_core::job::{Command, Leg, Mark, Program};
use annulus_core::units::Length;
use std::sync::Arc;

/// A program for the side `name` that drills these positions; its work zero is at 1, 1.
fn program(name: &str, holes: &[(f64, f64)]) -> Program {
    let leg = |(index, &(x, y)): (u32, &(f64, f64))| Leg {
        mark: Mark::Hole(index),
        commands: vec![Command::Rapid { to: Point::from_mm(x - 1.0, y - 1.0) }],
    };
    Program {
        name: name.to_owned(),
        machine: String::new(),
        origin: Point::from_mm(1.0, 1.0),
        bits: Vec::new(),
        spindles: 1,
        safe_height: Length::from_um(2_000),
        legs: (0..).zip(holes).map(leg).collect(),
        accepted: Vec::new(),
    }
}

/// A page just opened on screen `tab` while the machine has the job "k"; `kept`: the saved boards, and
/// whether another tab has them open.
fn reloaded(tab: Tab, kept: &[(&str, bool)]) -> Story {
    let mut story = Story::told("begin");
    story.send(FrameEvent::Show { tab });
    let program = program("clock-bottom", &[]);
    let (bytes, key, stream_digest) = (Vec::new(), "k".to_owned(), String::new());
    story.model.start.fetched = Some(Arc::new(Job { program, bytes, key, stream_digest }));
    story.model.link.status = Some(status(State::Running, Some("k")).into());
    let offers = (0..).zip(kept).map(|(place, (name, elsewhere))| Offer {
        place,
        name: (*name).to_owned(),
        at_ms: 1.0,
        elsewhere: *elsewhere,
    });
    story.send(KeepEvent::Found { offers: offers.collect() });
    story
}

#[test]
fn machine_job_reopens_its_board_on_the_machine_screen() {
    let is_asked = |story: &Story| story.out().split_whitespace().any(|word| word.starts_with("take:"));
    let rows = [
        (Tab::Machine, ("clock", false), true),
        (Tab::Machine, ("clock", true), false),
        (Tab::Machine, ("clock-b", false), false),
        (Tab::Machine, ("robot", false), false),
        (Tab::Cam, ("clock", false), false),
    ];
    for (tab, kept, is_opened) in rows {
        let mut story = reloaded(tab, &[("other", false), kept]);
        assert_eq!(is_asked(&story), is_opened, "{tab:?} {kept:?}: {}", story.out());
        story.send(FrameEvent::Grid);
        assert!(!is_asked(&story), "once");
    }
    let mut story = reloaded(Tab::Machine, &[("clock", false)]);
    story.send(KeepEvent::Taken { place: 0, files: Some(vec![1]), job: None, own: true });
    story.tell("opened");
    story.tell("certain");
    assert!(story.model.board.document.is_some());
    assert_eq!(story.model.frame.tab, Tab::Machine);
    // A board that the user opens is shown as usual.
    story.tell("open-other");
    story.tell("certain");
    assert_eq!(story.model.frame.tab, Tab::Board);
}

#[test]
fn interrupted_job_offers_its_board_on_the_machine_screen() {
    let offer =
        |(place, name): (u32, &str)| Offer { place, name: name.to_owned(), at_ms: 1.0, elsewhere: false };
    let kept = [(3, "robot"), (1, "clock")].map(offer);
    let found = |broken_off| to_restore(broken_off, &kept).map(|offer| offer.place);
    let rows = [
        (None, Some(3)),
        (Some("clock-top"), Some(1)),
        (Some("robot-bottom"), Some(3)),
        (Some("x-top"), Some(3)),
    ];
    for (broken_off, place) in rows {
        assert_eq!(found(broken_off), place, "{broken_off:?}");
    }
    assert_eq!(to_restore(Some("clock-top"), &[]), None);
    for tab in [Tab::Machine, Tab::Cam] {
        let mut story = Story::told("begin");
        story.send(FrameEvent::Show { tab });
        story.send(KeepEvent::Found { offers: kept.to_vec() });
        story.send(KeepEvent::Restore { offer: kept[1].clone() });
        story.send(KeepEvent::Taken { place: 1, files: Some(vec![1]), job: None, own: true });
        story.tell("opened");
        story.tell("certain");
        assert!(story.model.board.document.is_some());
        let stays = if tab == Tab::Machine { Tab::Machine } else { Tab::Board };
        assert_eq!(story.model.frame.tab, stays);
    }
}

#[test]
fn outline_matches_program_name_origin_and_holes() {
    let mm = |x: f64, y: f64| Point::from_mm(x, y);
    let outer = rectangle(Bounds { min: mm(0.0, 0.0), max: mm(50.0, 30.0) });
    let outline_of = Region { islands: vec![Island { outer, holes: Vec::new() }] };
    let hole = |at| Hole { at, diameter: None, plated: None, source: 0, tool_code: 0, line: 0 };
    let holes = [(5.0, 5.0), (5.0, 25.0), (45.0, 5.0)];
    let holes_of = holes.iter().map(|(x, y)| hole(mm(*x, *y))).collect();
    let board = Board { name: "clock".to_owned(), holes: holes_of, outline: outline_of, ..Board::default() };
    let rows = [
        ("clock-top", mm(1.0, 1.0), holes.as_slice(), true),
        ("clock-top", mm(1.0, 1.0), &holes[1..], true),
        ("clock-top", mm(1.0, 1.0), &[(5.0, 25.0005)], true),
        ("clock-top", mm(1.0, 1.0), &[], true),
        ("clock-top", mm(1.0, 1.0), &[(5.0, 6.0)], false),
        ("clock-top", mm(2.0, 1.0), &holes, false),
        ("clock-side", mm(1.0, 1.0), &holes, false),
        ("robot-top", mm(1.0, 1.0), &holes, false),
    ];
    for (name, origin, drilled, is_it) in rows {
        let found = outline(&program(name, drilled), &board, origin);
        assert_eq!(found, Some(&board.outline).filter(|_| is_it), "{name} {origin:?} {drilled:?}");
    }
}
