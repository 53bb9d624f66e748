//! Inner contours, tabs and pin holes with hand-made programs: every fault is counted.

use super::holes::{drill, planned};
use super::*;
use crate::job::{Asked, AskedEdge};

/// A board of 30 by 20 mm with a cut-out of 8 by 6 mm, and two pin holes of 3 mm next to it.
fn framed() -> Board {
    let pin = |x: f64| Hole {
        at: Point::from_mm(x, 10.0),
        diameter: Some(Length::from_mm(3.0)),
        plated: None,
        source: 0,
        tool_code: 0,
        line: 0,
    };
    let outer = rectangle(bounds((0.0, 0.0, 30.0, 20.0)));
    let hole = rectangle(bounds((10.0, 7.0, 18.0, 13.0))).reversed();
    Board {
        holes: vec![pin(-5.0), pin(35.0)],
        outline: Region { islands: vec![Island { outer, holes: vec![hole] }] },
        ..Board::default()
    }
}

fn inner(away: f64, depth: f64) -> Program {
    program(mill(1.5), &[contour((10.0, 7.0, 18.0, 13.0), -away, depth)])
}

/// Around the board with a tool of 1.5 mm, with gaps of these widths at the bottom and at the top.
fn tabbed(below: f64, above: f64) -> Program {
    let (low, high, left, right) = (-0.75, 20.75, -0.75, 30.75);
    let ways = [
        way(&[(15.0 + below / 2.0, low), (right, low), (right, high), (15.0 + above / 2.0, high)], 2.1),
        way(&[(15.0 - above / 2.0, high), (left, high), (left, low), (15.0 - below / 2.0, low)], 2.1),
    ];
    program(mill(1.5), &ways)
}

fn pins(places: &[(f64, f64)]) -> Program {
    drill(3.0, 2.5, places)
}

const PINS: [(f64, f64); 2] = [(-5.0, 10.0), (35.0, 10.0)];

fn asked() -> Asked {
    let edge = planned().cut_out.map(|edge| AskedEdge { tabs: 2, ..edge });
    Asked { pins: true, cut_out: edge, ..planned() }
}

/// Missing, shifted, inner contours, tabs, loose.
fn counts(programs: &[Program], asked: &Asked) -> [usize; 5] {
    let board = framed();
    let found = crate::proof::drilled(&[SideRun { board: &board, programs, pins: 0..2 }], asked);
    let DrillingProof { missing, shifted, inner_missing, tabs_missing, loose, .. } = found;
    [missing.len(), shifted.len(), inner_missing.len(), tabs_missing.len(), loose.len()]
}

#[test]
fn inner_contours_pins_and_tabs_are_counted() {
    let good = || [pins(&PINS), inner(0.75, 2.1), tabbed(3.5, 3.5)];
    let with = |at: usize, program: Program| {
        let mut programs = good();
        programs[at] = program;
        programs
    };
    let nobody = Asked::nothing(Length::from_mm(1.6));
    assert_eq!((counts(&good(), &asked()), counts(&good(), &nobody)), ([0; 5], [0; 5]));
    let rows = [
        ("pin missing", with(0, pins(&PINS[..1])), [1, 0, 0, 0, 0], true),
        ("pin shifted", with(0, pins(&[(-5.0, 10.2), PINS[1]])), [0, 1, 0, 0, 0], true),
        ("no pins", with(0, pins(&[])), [2, 0, 0, 0, 0], false),
        ("no contour within", with(1, pins(&[])), [0, 0, 1, 0, 0], true),
        ("contour within a scratch", with(1, inner(0.75, 0.6)), [0, 0, 1, 0, 0], true),
        ("contour within too small", with(1, inner(1.1, 2.1)), [0, 0, 1, 0, 0], true),
        ("one tab", with(2, tabbed(3.5, 0.0)), [0, 0, 0, 1, 0], false),
        ("a narrow tab", with(2, tabbed(3.5, 2.5)), [0, 0, 0, 1, 0], false),
        ("no tab", with(2, tabbed(0.0, 0.0)), [0, 0, 0, 1, 1], false),
    ];
    for (fault, programs, wanted, shows) in rows {
        assert_eq!(counts(&programs, &asked()), wanted, "{fault}");
        assert_eq!(
            counts(&programs, &nobody)[..3] == wanted[..3] && wanted[..3] != [0; 3],
            shows,
            "{fault}, no job"
        );
    }
    // A board without tabs is always reported.
    assert_eq!(counts(&with(2, tabbed(0.0, 0.0)), &nobody), [0, 0, 0, 0, 1]);
    // Two user-placed adjacent tabs are one piece; half of it is one tab.
    let edge = asked().cut_out.map(|edge| AskedEdge { tabs_together: true, ..edge });
    let by_hand = Asked { cut_out: edge, ..asked() };
    assert_eq!(counts(&with(2, tabbed(5.5, 0.0)), &by_hand), [0; 5]);
    assert_eq!(counts(&with(2, tabbed(3.5, 0.0)), &by_hand), [0, 0, 0, 1, 0]);
}

#[test]
fn job_without_cut_out_requires_no_contours() {
    let asked = Asked { cut_out: None, ..asked() };
    assert_eq!(counts(&[pins(&PINS)], &asked), [0; 5]);
}
