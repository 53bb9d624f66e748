//! Small boards with one change each.

use super::*;
use crate::geometry::{circle, rectangle, union};
use crate::units::Length;

fn hole(x: f64, y: f64, mm: f64) -> Hole {
    Hole {
        at: Point::from_mm(x, y),
        diameter: Some(Length::from_mm(mm)),
        plated: Some(true),
        source: 0,
        tool_code: 1,
        line: 1,
    }
}

fn slot(from: (f64, f64), to: (f64, f64)) -> Slot {
    Slot {
        path: vec![Point::from_mm(from.0, from.1), Point::from_mm(to.0, to.1)],
        width: Some(Length::from_mm(1.0)),
        plated: None,
        source: 0,
        tool_code: 2,
        line: 9,
    }
}

/// Positions of holes and pads: only the zero offset maps them onto each other.
const PLACES: [(f64, f64); 8] =
    [(3.0, 4.0), (5.5, 4.0), (8.0, 9.0), (21.0, 7.0), (23.0, 18.5), (12.0, 16.0), (30.0, 3.0), (33.0, 11.0)];

fn copper_of(places: &[(f64, f64)], names: impl Fn(Point) -> Option<String>) -> Copper {
    let pads: Vec<_> =
        places.iter().map(|(x, y)| circle(Point::from_mm(*x, *y), Length::from_mm(1.6))).collect();
    let region = union(&pads);
    let nets = region.islands.iter().map(|island| names(island.outer.start)).collect();
    Copper { face: Face::Top, region, nets, source: 1, ..Copper::default() }
}

fn net_of(at: Point) -> Option<String> {
    Some(format!("N{:.0}", at.x.mm()))
}

fn board() -> Board {
    let outline = Bounds { min: Point::from_mm(0.0, 0.0), max: Point::from_mm(40.0, 20.0) };
    Board {
        holes: PLACES.iter().map(|(x, y)| hole(*x, *y, 0.8)).collect(),
        slots: vec![slot((15.0, 2.0), (18.0, 2.0))],
        outline: union(&[rectangle(outline)]),
        copper: vec![copper_of(&PLACES, net_of)],
        ..Board::default()
    }
}

fn keys(before: &Board, now: &Board) -> String {
    changes(before, now)
        .lines()
        .iter()
        .map(|(key, _)| key.replace("changes.", ""))
        .collect::<Vec<_>>()
        .join(" ")
}

fn with(change: impl FnOnce(&mut Board)) -> Board {
    let mut board = board();
    change(&mut board);
    board
}

#[test]
fn every_change_is_reported_alone() {
    let wider = Bounds { min: Point::from_mm(0.0, 0.0), max: Point::from_mm(45.0, 20.0) };
    let rows: [(&str, Board); 13] = [
        ("", board()),
        ("holes_added", with(|board| board.holes.push(hole(10.0, 10.0, 0.8)))),
        (
            "holes_gone",
            with(|board| {
                board.holes.remove(2);
            }),
        ),
        ("holes_moved", with(|board| board.holes[2].at = Point::from_mm(9.0, 9.0))),
        ("holes_added holes_gone", with(|board| board.holes[2].at = Point::from_mm(27.0, 15.0))),
        ("holes_resized", with(|board| board.holes[2].diameter = Some(Length::from_mm(1.0)))),
        ("holes_replated", with(|board| board.holes[2].plated = Some(false))),
        ("", with(|board| board.holes[2].plated = None)),
        ("slots_resized", with(|board| board.slots[0].width = Some(Length::from_mm(1.4)))),
        ("slots_gone", with(|board| board.slots.clear())),
        ("copper_top", with(|board| board.copper = vec![copper_of(&PLACES[..7], net_of)])),
        ("outline", with(|board| board.outline = union(&[rectangle(wider)]))),
        ("nets_renamed", with(|board| board.copper[0].nets[3] = Some("VCC".to_owned()))),
    ];
    for (row, (expected, now)) in rows.iter().enumerate() {
        let found = keys(&board(), now);
        let expected = if *expected == "copper_top" { "copper_top nets_gone" } else { expected };
        assert_eq!(found, expected, "row {row}");
        assert_eq!(changes(&board(), now).is_none(), expected.is_empty(), "row {row}");
    }
}

#[test]
fn rounding_of_files_is_no_change() {
    let nm = Length::from_nm;
    let rounded = with(|board| {
        for (number, hole) in (0..).zip(&mut board.holes) {
            hole.at = Point::new(hole.at.x + nm(1_270 - number * 300), hole.at.y - nm(900));
            hole.diameter = Some(Length::from_mm(0.8) - nm(1_240));
        }
        board.slots[0].path.reverse();
        let places = PLACES.map(|(x, y)| (x + 0.0012, y - 0.0009));
        board.copper = vec![copper_of(&places, net_of)];
    });
    assert_eq!(keys(&board(), &rounded), "");
}

#[test]
fn moved_board_is_one_change() {
    let by = Point::from_mm(101.6, -25.4);
    let mut now = board().placed(&Placement::shifted(by));
    let found = changes(&board(), &now);
    assert_eq!((found.shift, found.lines().len(), found.same), (by, 1, 9), "{:?}", found.lines());
    now.holes[0].diameter = Some(Length::from_mm(1.2));
    now.holes.push(hole(110.0, -12.0, 0.8));
    assert_eq!(keys(&board(), &now), "shift holes_added holes_resized");
    let resized = changes(&board(), &now).holes.into_iter().find(|one| one.fate == Fate::Resized).unwrap();
    assert_eq!(resized.before.unwrap().at, resized.now.unwrap().at, "told in the places of the new files");
    // A wider board is not a shifted board.
    let wider = with(|board| board.holes.push(hole(44.0, 19.0, 0.8)));
    assert_eq!(changes(&board(), &wider).shift, Point::default());
}

#[test]
fn part_moves_with_its_holes_in_crossing_rows() {
    // A row of eight, pitch 2.54 mm, moved by two pitches and up: pins now cover old positions of their
    // neighbours.
    let row = |from: f64, y: f64| (0..8).map(move |pin| hole(from + 2.54 * f64::from(pin), y, 1.0));
    let before = with(|board| board.holes.extend(row(50.0, 30.0)));
    let now = with(|board| board.holes.extend(row(57.62, 41.0)));
    let found = changes(&before, &now);
    let offsets: BTreeSet<(i64, i64)> = found
        .holes
        .iter()
        .map(|one| {
            let (from, to) = (one.before.as_ref().unwrap().at, one.now.as_ref().unwrap().at);
            ((to.x - from.x).nm(), (to.y - from.y).nm())
        })
        .collect();
    assert_eq!((found.holes.len(), offsets), (8, BTreeSet::from([(7_620_000, 11_000_000)])));
}

#[test]
fn another_board_is_distinct_from_a_new_export() {
    let few = with(|board| board.holes.truncate(5));
    assert!(!changes(&board(), &few).may_be_another());
    let other = Board {
        holes: (0..9).map(|at| hole(f64::from(at * at), 50.0 - f64::from(at * 3), 0.9)).collect(),
        ..Board::default()
    };
    let found = changes(&board(), &other);
    assert!(found.may_be_another(), "{:?}", found.lines());
    assert!(!changes(&Board::default(), &board()).may_be_another(), "nothing is no other board");
}

#[test]
fn copper_changes_are_added_and_removed_areas() {
    let bar = rectangle(Bounds { min: Point::from_mm(3.0, 3.8), max: Point::from_mm(5.5, 4.2) });
    let now = with(|board| {
        let pads = board.copper[0].region.paths().cloned().chain([bar]).collect::<Vec<_>>();
        board.copper[0].region = union(&pads);
        board.copper[0].nets =
            board.copper[0].region.islands.iter().map(|one| net_of(one.outer.start)).collect();
    });
    let found = changes(&board(), &now).copper.remove(0);
    assert_eq!((found.islands, found.gone.islands.len()), ([8, 7], 0));
    // Between the rims of the two pads: 2.5 mm minus two radii, 0.4 mm wide, minus the curvature of the rims.
    assert!((0.36..0.40).contains(&found.added_mm2), "{}", found.added_mm2);
}

#[test]
fn every_change_has_its_text() {
    let now = Board { holes: vec![hole(1.0, 2.0, 3.0)], ..Board::default() };
    for (key, args) in changes(&board(), &now).lines() {
        let args: Vec<_> = args.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        let said = crate::locale::text("en", key, &args);
        assert!(!said.contains(key) && !said.contains('{'), "{key}: {said}");
    }
}
