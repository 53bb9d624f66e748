//! Briefing of a job with both sides: size of the blank, position of the zero.

use super::*;
use crate::cam::briefing;
use crate::job::SideBriefing;

#[test]
fn both_sides_share_one_blank_with_a_margin() {
    let machine = virtual_drill();
    let mut board = coupon();
    board.copper[0].face = Face::Bottom;
    board.copper.push(Copper { face: Face::Top, ..board.copper[0].clone() });
    let mut work = Work::default_for(&board, &machine);
    let mut briefed = briefing::briefing("coupon", &work, &machine);
    for face in work.faces() {
        work.setup.face = face;
        let (planned, _) = planned(&board, &work);
        let program = lower_work(&planned, &work, &machine);
        briefing::add_side(&mut briefed, face, &work, (&planned, &program), &[]);
    }
    // Pins of 3 mm are 4 mm outside the board of 30 x 20 mm, the cut is 1.5 mm wide, and 5 mm stay around
    // everything.
    let boxes: Vec<Bounds> = briefed.sides.iter().filter_map(|side| side.blank).collect();
    assert_eq!(boxes.len(), 2);
    for found in boxes {
        let corners = [found.min.x, found.min.y, found.max.x, found.max.y].map(Length::mm);
        let wanted = [-5.5 - 5.0, -1.5 - 5.0, 35.5 + 5.0, 21.5 + 5.0];
        let off = corners.iter().zip(wanted).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 0.01, "{corners:?} {wanted:?}");
    }
    // An area that only one side needs is needed for the other side too, flipped.
    let tool = briefed.sides[0].tools.clone();
    briefed.sides = vec![SideBriefing {
        side: "bottom".to_owned(),
        blank: Some(Bounds::of(at(-20.0, 0.0)).with(at(30.0, 20.0))),
        tools: tool,
    }];
    let (planned, _) = planned(&board, &work);
    let program = lower_work(&planned, &work, &machine);
    briefing::add_side(&mut briefed, Face::Top, &work, (&planned, &program), &[]);
    let [bottom, top] = [0, 1].map(|side| briefed.sides[side].blank.unwrap());
    assert_eq!((bottom.min.x, top.max.x), (mm(-20.0), mm(50.0)));
    assert_eq!(bottom.max.x - bottom.min.x, top.max.x - top.min.x);
}

#[test]
fn zero_without_outline_is_reported_and_equal_on_both_sides() {
    let machine = virtual_drill();
    let mut board = Board { outline: Region::default(), ..coupon() };
    board.holes.push(hole(25.0, 1.0, 0.8));
    board.copper[0].face = Face::Bottom;
    board.copper.push(Copper { face: Face::Top, ..board.copper[0].clone() });
    let mut work = Work::default_for(&board, &machine);
    let mut told = Vec::new();
    for face in [Face::Top, Face::Bottom] {
        work.setup.face = face;
        let (planned, diagnostics) = planned(&board, &work);
        assert_eq!(planned.origin, board.extent().unwrap().min, "{face:?}");
        assert!(diagnostics.iter().any(|diagnostic| diagnostic.code == "cam.zero_without_outline"));
        let mut briefed = briefing::briefing("coupon", &work, &machine);
        let program = lower_work(&planned, &work, &machine);
        briefing::add_side(&mut briefed, face, &work, (&planned, &program), &[]);
        told.extend(briefed.zero);
    }
    assert_eq!(told, ["copper", "copper"]);
    let (planned, diagnostics) = planned(&coupon(), &Work::default_for(&coupon(), &machine));
    assert_eq!(planned.origin, at(0.0, 0.0));
    assert!(diagnostics.iter().all(|diagnostic| diagnostic.code != "cam.zero_without_outline"));
}
