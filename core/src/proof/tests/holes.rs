//! Holes, slots and edges of a board with hand-made programs: a good set has no errors, every fault in it is
//! counted.

use super::*;
use crate::board::Slot;
use crate::job::{Asked, AskedEdge};

/// A board of 20 by 10 mm: holes of 0.8 at (4, 3) and 3.0 at (8, 5), holes of 0.8 and 1.2 at (12, 5), a slot
/// of 1.0 from (15, 3) to (15, 6).
fn holed() -> Board {
    let hole = |x: f64, y: f64, diameter: f64| Hole {
        at: Point::from_mm(x, y),
        diameter: Some(Length::from_mm(diameter)),
        plated: None,
        source: 0,
        tool_code: 1,
        line: 1,
    };
    let slot = Slot {
        path: vec![Point::from_mm(15.0, 3.0), Point::from_mm(15.0, 6.0)],
        width: Some(Length::from_mm(1.0)),
        plated: None,
        source: 0,
        tool_code: 2,
        line: 1,
    };
    let outer = rectangle(bounds((0.0, 0.0, 20.0, 10.0)));
    Board {
        holes: vec![hole(4.0, 3.0, 0.8), hole(8.0, 5.0, 3.0), hole(12.0, 5.0, 0.8), hole(12.0, 5.0, 1.2)],
        slots: vec![slot],
        outline: Region { islands: vec![Island { outer, holes: Vec::new() }] },
        ..Board::default()
    }
}

pub(super) fn drill(diameter: f64, depth: f64, places: &[(f64, f64)]) -> Program {
    let stroke = |at: &(f64, f64)| Toolpath { mark: Mark::Hole(0), ..way(&[*at], depth) };
    let strokes: Vec<Toolpath> = places.iter().map(stroke).collect();
    program(bit(diameter, Cutter::Drill), &strokes)
}

/// Circles of a mill around one point, by the diameters of their centre lines, as chords.
fn rings(tool: f64, depth: f64, at: (f64, f64), wide: &[f64]) -> Program {
    let ring = |wide: &f64| {
        let point = |step: i32| {
            let turn = f64::from(step) / 60.0 * std::f64::consts::TAU;
            (at.0 + wide / 2.0 * libm::cos(turn), at.1 + wide / 2.0 * libm::sin(turn))
        };
        way(&(0..=60).map(point).collect::<Vec<_>>(), depth)
    };
    program(mill(tool), &wide.iter().map(ring).collect::<Vec<_>>())
}

fn slot(tool: f64, depth: f64) -> Program {
    program(mill(tool), &[way(&[(15.0, 3.0), (15.0, 6.0)], depth)])
}

/// Around the board, the tool centre at this distance from the edge.
pub(super) fn around(tool: f64, away: f64, depth: f64) -> Program {
    program(mill(tool), &[contour((0.0, 0.0, 20.0, 10.0), away, depth)])
}

/// Two drills, a hole in two rings, the slot, the edge.
fn whole() -> Vec<Program> {
    vec![
        drill(0.8, 2.2, &[(4.0, 3.0), (12.0, 5.0)]),
        drill(1.2, 2.2, &[(12.0, 5.0)]),
        rings(1.5, 2.1, (8.0, 5.0), &[0.75, 1.5]),
        slot(1.0, 2.1),
        around(1.5, 0.75, 2.1),
    ]
}

pub(super) fn planned() -> Asked {
    let nothing = Asked::nothing(Length::from_mm(1.6));
    let edge = AskedEdge {
        depth: nothing.thickness,
        on_line: false,
        spared: Length::from_mm(4.0),
        zones: false,
        bit: Length::from_mm(1.5),
        bites: false,
        tabs: 0,
        tabs_together: false,
        tab_width: Length::from_mm(2.0),
    };
    Asked { holes: Some(true), slots: Some(true), cut_out: Some(edge), ..nothing }
}

/// Missing, doubled, shifted, wrong size, shallow, slots missing, edges missing, bites, repeated toolpaths.
fn counts(programs: &[Program], asked: &Asked) -> [usize; 9] {
    let board = holed();
    let found = crate::proof::drilled(&[SideRun { board: &board, programs, pins: 0..0 }], asked);
    [
        found.missing.len(),
        found.doubled.len(),
        found.shifted.len(),
        found.wrong_size.len(),
        found.shallow.len(),
        found.slots_missing.len(),
        found.edges_missing.len(),
        found.bitten.len(),
        found.repeated as usize,
    ]
}

#[test]
fn complete_job_has_no_hole_slot_or_edge_problems() {
    assert_eq!(counts(&whole(), &planned()), [0; 9]);
    assert_eq!(counts(&whole(), &Asked::nothing(Length::from_mm(1.6))), [0; 9]);
    // Isolation only: no holes are required.
    let isolating = rings(0.2, 0.1, (4.0, 3.0), &[1.8]);
    assert_eq!(counts(&[isolating], &Asked::nothing(Length::from_mm(1.6))), [0; 9]);
}

/// Number of holes that the board doesn't have: with a job, with a job with mouse-bites, without a job.
#[test]
fn extra_holes_are_reported_even_at_holes_and_edges() {
    let nothing = Asked::nothing(Length::from_mm(1.6));
    let biting = planned().cut_out.map(|edge| AskedEdge { bites: true, ..edge });
    let biting = Asked { cut_out: biting, ..planned() };
    let rows: [(&str, Program, [usize; 3]); 12] = [
        ("where the board has none", drill(0.8, 2.2, &[(16.0, 8.0)]), [1; 3]),
        ("over a hole", drill(0.8, 2.2, &[(4.4, 3.0)]), [1; 3]),
        ("at a large hole", drill(0.8, 2.2, &[(9.9, 5.0)]), [1; 3]),
        ("in a large hole", drill(0.8, 2.2, &[(8.6, 5.0)]), [0; 3]),
        ("in a slot", drill(1.0, 2.2, &[(15.0, 4.0)]), [0; 3]),
        ("at a slot", drill(1.0, 2.2, &[(15.3, 4.0)]), [1; 3]),
        ("not through", drill(0.8, 0.5, &[(16.0, 8.0)]), [0; 3]),
        ("near the edge", drill(0.8, 2.2, &[(10.0, 0.5)]), [1; 3]),
        ("one across the edge", drill(0.5, 2.2, &[(10.0, 0.1)]), [1; 3]),
        ("a row on the edge", drill(0.5, 2.2, &[(9.2, 0.0), (10.0, 0.0), (10.8, 0.0)]), [3, 0, 0]),
        ("along the edge", drill(1.5, 2.2, &[(10.0, -0.74)]), [0; 3]),
        ("outside", drill(3.0, 2.2, &[(10.0, -5.0)]), [0; 3]),
    ];
    for (what, extra, wanted) in rows {
        let programs = [whole(), vec![extra]].concat();
        let found = [&planned(), &biting, &nothing].map(|asked| counts(&programs, asked)[7]);
        assert_eq!(found, wanted, "{what}");
    }
    // A hole where a mill cuts as well removes nothing more.
    let path = program(mill(2.0), &[way(&[(16.0, 8.0), (18.0, 8.0)], 2.1)]);
    let both = [whole(), vec![path, drill(1.0, 2.2, &[(16.0, 8.0)])]].concat();
    assert_eq!(counts(&both, &nothing)[7], 1, "only the path");
}

/// Without a stated size, a hole or a slot takes any tool on its centre line.
#[test]
fn features_without_size_take_any_tool() {
    let mut board = holed();
    board.holes.push(Hole { at: Point::from_mm(16.0, 8.0), diameter: None, ..board.holes[0].clone() });
    board.slots[0].width = None;
    for (at, wanted) in [((16.0, 8.0), 0), ((15.0, 4.0), 0), ((16.4, 8.0), 1), ((15.4, 4.0), 1)] {
        let programs = [whole(), vec![drill(0.8, 2.2, &[at])]].concat();
        let sides = [SideRun { board: &board, programs: &programs, pins: 0..0 }];
        assert_eq!(crate::proof::drilled(&sides, &planned()).bitten.len(), wanted, "{at:?}");
    }
}

#[test]
fn cuts_outside_the_board_are_measured() {
    let board = holed();
    let rows = [
        ("a ring at its right", rings(1.0, 2.1, (39.5, 5.0), &[8.0]), Some(15.0)),
        ("a scratch at its right", program(mill(1.0), &[way(&[(30.0, 5.0)], 0.1)]), Some(9.5)),
        ("around it", around(1.5, 3.75, 2.1), Some(3.0)),
        ("across it", program(mill(1.0), &[way(&[(-9.0, 5.0), (29.0, 5.0)], 0.1)]), None),
        ("along its edge", around(1.5, 0.75, 2.1), None),
        ("in the air", program(mill(1.0), &[way(&[(30.0, 5.0)], -0.5)]), None),
    ];
    for (what, program, wanted) in rows {
        let run = SideRun { board: &board, programs: &[program], pins: 0..0 };
        let found = crate::proof::drilled(&[run], &Asked::nothing(Length::from_mm(1.6))).outside;
        let off = found.map(|(_, off)| (off.mm() * 100.0).round() / 100.0);
        assert_eq!(off, wanted, "{what}: {found:?}");
        if what == "a ring at its right" {
            assert!(found.unwrap().0.distance_mm(Point::from_mm(35.5, 5.0)) < 0.01, "{found:?}");
        }
    }
}

#[test]
fn hole_slot_and_edge_faults_are_counted() {
    let with = |index: usize, program: Program| {
        let mut programs = whole();
        programs[index] = program;
        programs
    };
    let without = |index: usize| {
        let mut programs = whole();
        programs.remove(index);
        programs
    };
    let twice = |index: usize| {
        let mut programs = whole();
        programs.push(programs[index].clone());
        programs
    };
    let two = [(4.0, 3.0), (12.0, 5.0)];
    let plunged = |depth: f64| program(vee(), &two.map(|at| way(&[at], depth)));
    let rows = [
        ("drill too wide", with(0, drill(1.0, 2.2, &two)), [0, 0, 0, 2, 0, 0, 0, 0, 0]),
        ("drill too thin", with(0, drill(0.4, 2.2, &two)), [0, 0, 0, 2, 0, 0, 0, 0, 0]),
        ("V-bit", with(0, plunged(2.29)), [0, 0, 0, 2, 0, 0, 0, 0, 0]),
        ("not through", with(0, drill(0.8, 0.28, &two)), [0, 0, 0, 0, 2, 0, 0, 0, 0]),
        ("no drill", without(0), [2, 0, 0, 0, 0, 0, 0, 0, 0]),
        ("drill twice", twice(0), [0, 2, 0, 0, 0, 0, 0, 0, 0]),
        ("beside", with(0, drill(0.8, 2.2, &[(4.3, 3.0), two[1]])), [0, 0, 1, 0, 0, 0, 0, 0, 0]),
        ("inner ring alone", with(2, rings(1.5, 2.1, (8.0, 5.0), &[0.75])), [0, 0, 0, 1, 0, 0, 0, 0, 0]),
        ("ring too wide", with(2, rings(1.5, 2.1, (8.0, 5.0), &[0.75, 2.0])), [0, 0, 0, 1, 0, 0, 0, 1, 0]),
        ("ring not through", with(2, rings(1.5, 1.0, (8.0, 5.0), &[0.75, 1.5])), [0, 0, 0, 0, 1, 0, 0, 0, 0]),
        ("rings twice", twice(2), [0, 1, 0, 0, 0, 0, 0, 0, 2]),
        ("no slot", without(3), [0, 0, 0, 0, 0, 1, 0, 0, 0]),
        ("slot of a scratch", with(3, slot(1.0, 0.3)), [0, 0, 0, 0, 0, 1, 0, 0, 0]),
        ("slot not through", with(3, slot(1.0, 1.0)), [0, 0, 0, 0, 1, 0, 0, 0, 0]),
        ("slot too narrow", with(3, slot(0.6, 2.1)), [0, 0, 0, 0, 0, 1, 0, 0, 0]),
        ("slot too wide", with(3, slot(1.5, 2.1)), [0, 0, 0, 0, 0, 0, 0, 1, 0]),
        ("not cut out", without(4), [0, 0, 0, 0, 0, 0, 1, 0, 0]),
        ("edge not through", with(4, around(1.5, 0.75, 0.9)), [0, 0, 0, 0, 0, 0, 1, 0, 0]),
        ("edge by a wide mill", with(4, around(3.0, 0.75, 2.1)), [0, 0, 0, 0, 0, 0, 0, 1, 0]),
        ("edge by a thin mill", with(4, around(0.8, 0.75, 2.1)), [0, 0, 0, 0, 0, 0, 1, 0, 0]),
        ("edge on the inside", with(4, around(1.5, -0.75, 2.1)), [0, 0, 0, 0, 0, 0, 0, 1, 0]),
        ("edge twice", twice(4), [0, 0, 0, 0, 0, 0, 0, 0, 1]),
    ];
    for (fault, programs, wanted) in rows {
        assert_eq!(counts(&programs, &planned()), wanted, "{fault}");
        // Without a job, only a board that is not cut out may be intended.
        if fault != "not cut out" {
            assert_ne!(counts(&programs, &Asked::nothing(Length::from_mm(1.6))), [0; 9], "{fault}, no job");
        }
    }
}

#[test]
fn features_outside_the_job_are_not_required() {
    let asked = planned();
    let without = |index: usize| {
        let mut programs = whole();
        programs.remove(index);
        programs
    };
    assert_eq!(counts(&without(0), &Asked { holes: Some(false), ..asked }), [0; 9]);
    assert_eq!(counts(&without(3), &Asked { slots: Some(false), ..asked }), [0; 9]);
    assert_eq!(counts(&without(4), &Asked { cut_out: None, ..asked }), [0; 9]);
    // Holes that a job only marks.
    let mut marked = whole();
    marked[0] = drill(0.8, 0.3, &[(4.0, 3.0), (12.0, 5.0)]);
    marked[1] = drill(1.2, 0.3, &[(12.0, 5.0)]);
    assert_eq!(counts(&marked, &Asked { drilled: Length::from_mm(0.3), ..asked }), [0; 9]);
}

/// Without a job, features that nothing makes are listed; features made in the wrong place are missing.
#[test]
fn features_missing_without_a_job_are_listed() {
    let board = holed();
    let nothing = Asked::nothing(Length::from_mm(1.6));
    let found = |programs: &[Program]| {
        let run = SideRun { board: &board, programs, pins: 0..0 };
        crate::proof::drilled(&[run], &nothing)
    };
    let half = program(mill(1.0), &[way(&[(15.0, 3.0), (15.0, 4.5)], 2.1)]);
    let rows = [
        ("nothing", Vec::new(), [4, 1, 1], [0, 0, 0, 0], false),
        (
            "in the air",
            vec![program(mill(1.0), &[way(&[(1.0, 1.0), (9.0, 1.0)], -0.5)])],
            [4, 1, 1],
            [0; 4],
            false,
        ),
        (
            "a ring beside the middle",
            vec![rings(1.0, 2.1, (8.5, 5.0), &[1.0])],
            [0, 0, 1],
            [3, 1, 1, 0],
            true,
        ),
        ("a ring in no hole", vec![rings(1.0, 2.1, (8.0, 9.0), &[0.5])], [4, 1, 1], [0; 4], true),
        ("half of a slot", vec![half], [4, 0, 1], [0, 0, 1, 0], true),
        ("the edge", vec![around(1.5, 0.75, 2.1)], [4, 1, 0], [0; 4], true),
        ("holes", vec![drill(0.8, 2.2, &[(4.0, 3.0)])], [0, 0, 1], [3, 0, 1, 1], true),
    ];
    for (what, programs, left, wrong, cuts) in rows {
        let found = found(&programs);
        assert_eq!([found.holes_left.len(), found.slots_left.len(), found.edges_left.len()], left, "{what}");
        let counts = [found.missing.len(), found.shifted.len(), found.slots_missing.len()];
        assert_eq!((counts.as_slice(), found.made as usize), (&wrong[..3], wrong[3]), "{what}");
        assert_eq!(found.cuts, cuts, "{what}");
    }
    // A job states what it leaves out: nothing is listed.
    let run = SideRun { board: &board, programs: &[], pins: 0..0 };
    let planned = Asked { holes: Some(false), slots: Some(false), ..nothing };
    let found = crate::proof::drilled(&[run], &planned);
    assert_eq!([found.holes_left.len(), found.slots_left.len(), found.edges_left.len()], [0; 3]);
}
