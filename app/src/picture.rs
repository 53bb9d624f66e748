//! Turns a board, its plan and its travel into a scene. The only module that knows both boards and pictures.
//!
//! ```text
//!        outline closed      ╭───╮
//!        ──────────────▶  ╭──╯ ○ │ filled; inner rings are cut-outs     none or open ─▶ a plate instead
//!                         ╰──────╯
//! ```

use crate::toolpaths::{self, ToolpathPiece, Toolpaths, Travel};
use crate::view::{
    Colour, Cutting, Disc, HoleState, Line, Palette, Plate, Scene, SceneSlot, UNORDERED, Width,
};
use annulus_core::board::changes::{BoardChanges, Fate};
use annulus_core::board::{Board, Hole, Slot};
use annulus_core::cam::work::{Operation, OperationKind, POINT_DEG, Work};
use annulus_core::geometry::{Bounds, Path, Point, Region};
use annulus_core::job::{Bit, Cutter, Program};
use annulus_core::machine::Machine;
use annulus_core::units::Length;
use geo::{Area, Contains, LineString, Polygon, TriangulateEarcut};

/// Margin around the outermost holes of a board without an outline.
const MARGIN: Length = Length::from_um(4_000);
const CORNER_MM: f32 = 1.5;
/// Diameter for holes whose file gives none.
const UNSIZED: Length = Length::from_um(800);
const MOST_RINGS: usize = 1_000;
const CHORD_ERROR_MM: f64 = 0.005;
const TRAVEL_PX: f32 = 1.25;
/// Diameter of a problem's dot, CSS pixels.
const FINDING_PX: f32 = 8.0;
/// Radius of the ring around the selected problem, and its number of segments.
const RING_MM: f32 = 0.9;
const RING_STEPS: u16 = 40;
/// Share of the tool's colour in a swath; the rest is the board's colour.
const SWATH_SHARE: f32 = 0.45;

/// Origin of the picture in file coordinates: the lower left corner of the body.
pub fn origin(body: Option<Bounds>) -> Point {
    body.map_or_else(Point::default, |bounds| bounds.min)
}

/// Converts file coordinates to mm in the picture.
pub fn place(origin: Point, at: Point) -> [f32; 2] {
    [(at.x - origin.x).mm() as f32, (at.y - origin.y).mm() as f32]
}

/// The toolpaths of `program` in mm in the picture of a board with this `body`.
pub fn program_in(program: &Program, body: Option<Bounds>) -> Toolpaths {
    let corner = origin(body);
    toolpaths::toolpaths(program, Point::new(corner.x - program.origin.x, corner.y - program.origin.y))
}

/// Bounds of the board: its outline, or its holes and copper with a margin.
pub fn body(board: &Board) -> Option<Bounds> {
    body_with(board, [])
}

/// Like [`body`], but without an outline it also includes `places`.
pub fn body_with(board: &Board, places: impl IntoIterator<Item = Point>) -> Option<Bounds> {
    let places = Bounds::around(places);
    let inside = || {
        let copper = board.copper.iter().filter_map(|copper| copper.region.bounds());
        let boxes = board.bounds().into_iter().chain(copper).chain(places);
        boxes.reduce(|a, b| a.with(b.min).with(b.max)).map(|bounds| bounds.grown(MARGIN))
    };
    board.outline.bounds().or_else(inside)
}

/// The distinct sizes of holes and slots, ascending. The index decides the colour.
pub fn sizes(board: &Board) -> Vec<Length> {
    let holes = board.holes.iter().map(|hole| hole.diameter.unwrap_or(UNSIZED));
    let mut sizes: Vec<_> =
        holes.chain(board.slots.iter().map(|slot| slot.width.unwrap_or(UNSIZED))).collect();
    sizes.sort_unstable();
    sizes.dedup();
    sizes
}

/// The board with all holes planned, without travel and layers. `body` is that of the whole board.
pub fn scene(board: &Board, body: Option<Bounds>, palette: &Palette) -> Scene {
    let origin = origin(body);
    let sizes = sizes(board);
    let colour = |size: Length| palette.tool(sizes.partition_point(|other| *other < size));
    let disc = |hole: &Hole| {
        let size = hole.diameter.unwrap_or(UNSIZED);
        Disc {
            centre_mm: place(origin, hole.at),
            radius_mm: size.mm() as f32 / 2.0,
            colour: colour(size),
            state: HoleState::Planned,
            order: UNORDERED,
        }
    };
    let slot = |slot: &annulus_core::board::Slot| {
        let width = slot.width.unwrap_or(UNSIZED);
        SceneSlot {
            path_mm: slot.path.iter().map(|point| place(origin, *point)).collect(),
            width_mm: width.mm() as f32,
            colour: colour(width),
        }
    };
    let outline = rings(&board.outline, origin);
    let filled = fill(&outline);
    Scene {
        plate: body.filter(|_| filled.is_empty()).map(|bounds| plate(origin, bounds)),
        body: filled,
        outline,
        layers: Vec::new(),
        slots: board.slots.iter().map(slot).collect(),
        lines: Vec::new(),
        discs: board.holes.iter().map(disc).collect(),
        wanted_mm: None,
        chosen_mm: None,
    }
}

/// The rings of an outline, in mm from `origin`.
pub fn rings(outline: &Region, origin: Point) -> Vec<Vec<[f32; 2]>> {
    let ring = |path: &Path| {
        let points = path.flattened(CHORD_ERROR_MM);
        let corners = points.len() - usize::from(path.is_closed());
        points.iter().take(corners).map(|point| place(origin, *point)).collect()
    };
    outline.paths().map(ring).collect()
}

/// Triangulates rings by the even-odd rule: a ring inside another is a cut-out, one inside a cut-out is
/// solid.
fn fill(rings: &[Vec<[f32; 2]>]) -> Vec<[f32; 2]> {
    let ring = |ring: &Vec<[f32; 2]>| LineString::from(ring.clone());
    let solid = |ring: LineString<f32>| Polygon::new(ring, Vec::new());
    let mut all: Vec<Polygon<f32>> = rings.iter().map(ring).map(solid).collect();
    all.retain(|ring| ring.unsigned_area() > 0.0);
    // A ring can only be inside a larger one.
    all.sort_by(|a, b| b.unsigned_area().total_cmp(&a.unsigned_area()));
    if all.len() > MOST_RINGS {
        return Vec::new();
    }
    let mut bodies: Vec<Polygon<f32>> = Vec::new();
    for (index, ring) in all.iter().enumerate() {
        let Some(corner) = ring.exterior().points().next() else { continue };
        let depth = all[..index].iter().filter(|outer| outer.contains(&corner)).count();
        let around = bodies.iter_mut().rev().find(|body| depth % 2 == 1 && body.contains(&corner));
        match around {
            Some(body) => body.interiors_push(ring.exterior().clone()),
            None => bodies.push(ring.clone()),
        }
    }
    let triangles = bodies.iter().flat_map(TriangulateEarcut::earcut_triangles_iter);
    triangles.flat_map(|triangle| triangle.to_array().map(|corner| [corner.x, corner.y])).collect()
}

fn plate(origin: Point, bounds: Bounds) -> Plate {
    Plate { min_mm: place(origin, bounds.min), max_mm: place(origin, bounds.max), corner_mm: CORNER_MM }
}

/// The travel of the spindle from `start` through `holes` (indices into the board's holes). Line `n` leads to
/// hole `n` of that order.
pub fn travel(board: &Board, origin: Point, start: Point, holes: &[u32], palette: &Palette) -> Vec<Line> {
    let stops = holes.iter().filter_map(|index| board.holes.get(*index as usize)).map(|hole| hole.at);
    let mut from = place(origin, start);
    let leg = |(number, stop): (usize, Point)| {
        let to = place(origin, stop);
        let a_mm = std::mem::replace(&mut from, to);
        Line { a_mm, b_mm: to, width: Width::Px(TRAVEL_PX), colour: palette.travel, order: number as u32 }
    };
    stops.enumerate().map(leg).collect()
}

/// The travel limits of `machine` as a box. `zero_mm` is the work zero in machine coordinates; `place`
/// converts work coordinates to the picture.
pub fn travel_box(
    machine: &Machine,
    zero_mm: [f64; 2],
    place: impl Fn([f64; 2]) -> [f32; 2],
    palette: &Palette,
) -> Vec<Line> {
    let ends = [&machine.x, &machine.y].map(|axis| [axis.min.mm(), axis.max.mm()]);
    let corner = |x: usize, y: usize| place([ends[0][x] - zero_mm[0], ends[1][y] - zero_mm[1]]);
    let corners = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
    let edge = |at: usize| Line {
        a_mm: corners[at],
        b_mm: corners[(at + 1) % corners.len()],
        width: Width::Px(TRAVEL_PX),
        colour: palette.travel,
        order: UNORDERED,
    };
    (0..corners.len()).map(edge).collect()
}

/// Index of an operation's kind, which decides its colour.
pub fn kind(operation: &Operation) -> usize {
    let word = operation.action.word();
    OperationKind::WORDS.iter().position(|kind| *kind == word).unwrap_or(0)
}

/// Toolpaths as lines: swaths as wide as the cut, their center lines, and the travel if wanted. Each line's
/// order is its stop number. `colour` gives a stop's colour.
pub fn toolpaths(
    toolpaths: &Toolpaths,
    palette: &Palette,
    colour: impl Fn(u32) -> Colour,
    with_travel: bool,
) -> Vec<Line> {
    let line = |a_mm, b_mm, width, colour, order| Line { a_mm, b_mm, width, colour, order };
    let swath = |cut: &ToolpathPiece| {
        let tint = colour(cut.stop).mixed(palette.plate, SWATH_SHARE);
        line(cut.a_mm, cut.b_mm, Width::Mm(cut.width_mm), tint, cut.stop)
    };
    let middle = |cut: &ToolpathPiece| line(cut.a_mm, cut.b_mm, Width::Px(1.0), colour(cut.stop), cut.stop);
    let travel =
        |travel: &Travel| line(travel.a_mm, travel.b_mm, Width::Px(TRAVEL_PX), palette.travel, travel.stop);
    let wide = toolpaths.cuts.iter().filter(|cut| cut.width_mm > 0.0);
    let travels = toolpaths.travels.iter().filter(|_| with_travel).map(travel);
    wide.map(swath).chain(toolpaths.cuts.iter().map(middle)).chain(travels).collect()
}

/// The nearest of `places` within 45° of the direction `way` from `from_mm`. With four directions, every
/// position can be reached.
pub fn beside(places: impl Iterator<Item = [f64; 2]>, from_mm: [f64; 2], way: [i8; 2]) -> Option<usize> {
    let way = way.map(f64::from);
    let ranked = places.enumerate().filter_map(|(index, [x, y])| {
        let (dx, dy) = (x - from_mm[0], y - from_mm[1]);
        let (along, across) = (dx * way[0] + dy * way[1], (dx * way[1] - dy * way[0]).abs());
        (along > 1e-6 && across <= along).then_some((along + 2.0 * across, index))
    });
    ranked.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).map(|(_, index)| index)
}

/// Changes of holes and slots by new exports: a ring around an added one, a cross over a removed one, a
/// line from the old position of a moved one to its ring.
pub fn changed(changes: &BoardChanges, origin: Point, palette: &Palette) -> Vec<Line> {
    let holes = changes.holes.iter().map(|hole| {
        let at = |hole: &Hole| place(origin, hole.at);
        (hole.fate, hole.before.as_ref().map(at), hole.now.as_ref().map(at))
    });
    let slots = changes.slots.iter().map(|slot| {
        let at = |slot: &Slot| place(origin, slot.path.first().copied().unwrap_or_default());
        (slot.fate, slot.before.as_ref().map(at), slot.now.as_ref().map(at))
    });
    holes.chain(slots).flat_map(|(fate, before, now)| mark(fate, before, now, palette)).collect()
}

fn mark(fate: Fate, before: Option<[f32; 2]>, now: Option<[f32; 2]>, palette: &Palette) -> Vec<Line> {
    let line = |a_mm, b_mm, colour| Line { a_mm, b_mm, width: Width::Px(2.5), colour, order: UNORDERED };
    let cross = |[x, y]: [f32; 2]| {
        let by = RING_MM * 0.7;
        [(-by, -by, by, by), (-by, by, by, -by)]
            .map(|(a, b, c, d)| line([x + a, y + b], [x + c, y + d], palette.failed))
    };
    match (fate, before, now) {
        (Fate::Gone, Some(before), _) => cross(before).to_vec(),
        (Fate::Added, _, Some(now)) => ring(now, palette.done).collect(),
        (Fate::Moved, Some(before), Some(now)) => {
            std::iter::once(line(before, now, palette.current)).chain(ring(now, palette.current)).collect()
        }
        (_, _, Some(now)) => ring(now, palette.current).collect(),
        _ => Vec::new(),
    }
}

fn ring(place: [f32; 2], colour: Colour) -> impl Iterator<Item = Line> {
    let on_ring = move |step: u16| {
        let angle = f64::from(step) * std::f64::consts::TAU / f64::from(RING_STEPS);
        let (sine, cosine) = (libm::sin(angle) as f32, libm::cos(angle) as f32);
        [place[0] + RING_MM * cosine, place[1] + RING_MM * sine]
    };
    (0..RING_STEPS).map(move |step| {
        let (a_mm, b_mm) = (on_ring(step), on_ring(step + 1));
        Line { a_mm, b_mm, width: Width::Px(2.5), colour, order: UNORDERED }
    })
}

/// A problem at `place`: a dot, and a ring if it is the selected one.
pub fn finding(place: [f32; 2], shown: bool, colour: Colour, palette: &Palette) -> Vec<Line> {
    let line = |a_mm, b_mm, width, colour| Line { a_mm, b_mm, width, colour, order: UNORDERED };
    let mut marks = vec![
        line(place, place, Width::Px(FINDING_PX + 2.5), palette.bore),
        line(place, place, Width::Px(FINDING_PX), colour),
    ];
    if shown {
        marks.extend(ring(place, colour));
    }
    marks
}

/// A tool in the picture with its tip at `tip_mm`. A drill's point angle is its own if the operation has one,
/// else the usual one.
pub fn cutting(bit: &Bit, work: Option<&Work>, tip_mm: [f32; 3]) -> Cutting {
    let radius_mm = 0.5 * bit.diameter.mm();
    // Rise of the cutting edge per mm of radius, from the full point angle.
    let slope = |degrees: f64| 1.0 / libm::tan((0.5 * degrees).to_radians()).max(1e-6);
    let (end_mm, slope) = match bit.cutter {
        Cutter::Mill => (radius_mm, 0.0),
        Cutter::Drill => match work.and_then(|work| point_deg(work, bit.diameter)).unwrap_or(POINT_DEG) {
            degrees if degrees >= 180.0 => (radius_mm, 0.0),
            degrees => (0.0, slope(degrees)),
        },
        Cutter::Vee { tip, angle_mdeg } => (0.5 * tip.mm(), slope(f64::from(angle_mdeg) * 1e-3)),
    };
    Cutting { tip_mm, end_mm: end_mm as f32, radius_mm: radius_mm as f32, slope: slope as f32 }
}

/// The full point angle of a drill: its own, else the one common to its drilling operation.
fn point_deg(work: &Work, diameter: Length) -> Option<f64> {
    let drills = || work.operations.iter().filter(|one| one.on).filter_map(|one| one.action.drill());
    let own = drills().flat_map(|drill| &drill.points).find(|(size, _)| *size == diameter);
    own.map(|(_, degrees)| *degrees).or_else(|| drills().next().map(|drill| drill.point_deg))
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::geometry::{Island, Region};
    use annulus_core::job::Handling;

    fn seen(board: &Board) -> Scene {
        scene(board, body(board), &Palette::DARK)
    }

    fn hole(x: f64, y: f64, um: Option<i64>) -> Hole {
        let diameter = um.map(Length::from_um);
        Hole { at: Point::from_mm(x, y), diameter, plated: None, source: 0, tool_code: 1, line: 1 }
    }

    fn board() -> Board {
        Board {
            holes: vec![
                hole(1000.0, 500.0, Some(900)),
                hole(1010.0, 520.0, Some(600)),
                hole(1010.0, 500.0, None),
            ],
            slots: vec![Slot {
                path: vec![Point::from_mm(1002.0, 510.0), Point::from_mm(1004.0, 510.0)],
                width: Some(Length::from_um(900)),
                plated: None,
                source: 0,
                tool_code: 2,
                line: 9,
            }],
            ..Board::default()
        }
    }

    #[test]
    fn travel_box_is_placed_from_work_zero_and_not_fitted() {
        let mut machine = annulus_core::machine::virtual_drill();
        let mm = |mm: i64| Length::from_um(mm * 1_000);
        ((machine.x.min, machine.x.max), (machine.y.min, machine.y.max)) =
            ((mm(0), mm(300)), (mm(-10), mm(200)));
        let place = |[x, y]: [f64; 2]| [x as f32 + 1.0, y as f32 + 2.0];
        let lines = travel_box(&machine, [40.0, 30.0], place, &Palette::DARK);
        let corners: Vec<_> = lines.iter().map(|line| line.a_mm).collect();
        assert_eq!(corners, [[-39.0, -38.0], [261.0, -38.0], [261.0, 172.0], [-39.0, 172.0]]);
        assert!(lines.iter().zip(lines.iter().cycle().skip(1)).all(|(line, next)| line.b_mm == next.a_mm));
        let mut scene = seen(&board());
        let before = scene.bounds_mm();
        scene.lines.extend(lines);
        assert_eq!(scene.bounds_mm(), before);
    }

    #[test]
    fn drill_picture_uses_the_configured_point() {
        let mut operation = Operation::usual("drill", annulus_core::board::Face::Top).unwrap();
        let OperationKind::Drill(drill) = &mut operation.action else { panic!() };
        (drill.point_deg, drill.points) =
            (90.0, vec![(Length::from_um(1_000), 180.0), (Length::from_um(600), 120.0)]);
        let work = Work { operations: vec![operation], ..Work::default() };
        let bit = |um: i64, cutter: Cutter| Bit {
            diameter: Length::from_um(um),
            name: String::new(),
            cutter,
            handling: Handling::default(),
        };
        let rows = [
            ("as all drills", bit(800, Cutter::Drill), Some(&work), (0.0, 1.0)),
            ("its own", bit(600, Cutter::Drill), Some(&work), (0.0, 0.577_35)),
            ("flat", bit(1_000, Cutter::Drill), Some(&work), (0.5, 0.0)),
            ("nothing said", bit(800, Cutter::Drill), None, (0.0, 0.466_307_66)),
            ("a cylinder", bit(2_000, Cutter::Mill), Some(&work), (1.0, 0.0)),
        ];
        for (name, bit, work, (end_mm, slope)) in rows {
            let found = cutting(&bit, work, [1.0, 2.0, 3.0]);
            assert!(
                (found.end_mm - end_mm).abs() < 1e-5 && (found.slope - slope).abs() < 1e-5,
                "{name}: {found:?}"
            );
            assert_eq!(
                (found.tip_mm, found.radius_mm),
                ([1.0, 2.0, 3.0], bit.diameter.mm() as f32 / 2.0),
                "{name}"
            );
        }
    }

    #[test]
    fn picture_coordinates_start_at_the_board_corner() {
        let scene = seen(&board());
        assert_eq!(scene.plate.map(|plate| (plate.min_mm, plate.max_mm)), Some(([0.0, 0.0], [18.0, 28.0])));
        assert_eq!(scene.discs[0].centre_mm, [4.0, 4.0]);
        assert_eq!(scene.discs[1].centre_mm, [14.0, 24.0]);
        assert_eq!(scene.discs[0].radius_mm, 0.45);
        assert_eq!(scene.slots[0].path_mm, [[6.0, 14.0], [8.0, 14.0]]);
    }

    #[test]
    fn equal_hole_sizes_share_a_colour() {
        let palette = Palette::DARK;
        let scene = seen(&board());
        assert_eq!(scene.discs[1].colour, palette.tool(0), "0.6 mm is the smallest");
        assert_eq!(scene.discs[2].colour, palette.tool(1), "no size stands for 0.8 mm");
        assert_eq!(scene.discs[0].colour, palette.tool(2));
        assert_eq!(scene.slots[0].colour, scene.discs[0].colour);
    }

    #[test]
    fn board_outline_defines_its_body() {
        let square = [(990.0, 490.0), (1050.0, 490.0), (1050.0, 540.0), (990.0, 540.0)];
        let corners: Vec<Point> = square.iter().map(|(x, y)| Point::from_mm(*x, *y)).collect();
        let outer = Path::through(&corners).unwrap();
        let outline = Region { islands: vec![Island { outer, holes: Vec::new() }] };
        let scene = seen(&Board { outline, ..board() });
        assert_eq!(scene.plate, None);
        assert_eq!(scene.outline[0][2], [60.0, 50.0]);
        assert_eq!(area(&scene.body), 60.0 * 50.0);
    }

    fn area(triangles: &[[f32; 2]]) -> f32 {
        let half = |t: &[[f32; 2]]| {
            ((t[1][0] - t[0][0]) * (t[2][1] - t[0][1]) - (t[2][0] - t[0][0]) * (t[1][1] - t[0][1])).abs()
                / 2.0
        };
        triangles.chunks(3).map(half).sum()
    }

    fn square(corner: f32, side: f32) -> Vec<[f32; 2]> {
        let far = corner + side;
        vec![[corner, corner], [far, corner], [far, far], [corner, far]]
    }

    #[test]
    fn only_the_area_between_rings_is_filled() {
        let notched = vec![[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [6.0, 10.0], [6.0, 4.0], [0.0, 4.0]];
        type Row = (&'static str, Vec<Vec<[f32; 2]>>, f32);
        let rows: [Row; 6] = [
            ("a corner is missing", vec![notched], 64.0),
            ("a window", vec![square(2.0, 4.0), square(0.0, 10.0)], 84.0),
            ("an island in the window", vec![square(0.0, 10.0), square(2.0, 4.0), square(3.0, 1.0)], 85.0),
            ("two boards", vec![square(0.0, 10.0), square(20.0, 2.0)], 104.0),
            ("a line is no body", vec![vec![[0.0, 0.0], [5.0, 0.0]]], 0.0),
            ("nothing", vec![], 0.0),
        ];
        for (name, rings, expected) in rows {
            assert_eq!(area(&fill(&rings)), expected, "{name}");
        }
    }

    #[test]
    fn travel_lines_follow_the_hole_order() {
        let board = board();
        let corner = origin(body(&board));
        let lines = travel(&board, corner, corner, &[1, 0, 7], &Palette::DARK);
        assert_eq!(lines.len(), 2, "a hole that is not there has no line");
        assert_eq!((lines[0].a_mm, lines[0].b_mm, lines[0].order), ([0.0, 0.0], [14.0, 24.0], 0));
        assert_eq!((lines[1].a_mm, lines[1].b_mm, lines[1].order), ([14.0, 24.0], [4.0, 4.0], 1));
    }

    #[test]
    fn arrow_keys_reach_every_hole_nearest_first() {
        let places = [[0.0, 0.0], [10.0, 0.0], [20.0, 1.0], [10.0, 9.0], [10.0, -30.0]];
        let rows = [
            ([0.0, 0.0], [1, 0], Some(1)),
            ([10.0, 0.0], [1, 0], Some(2)),
            ([10.0, 0.0], [0, 1], Some(3)),
            ([10.0, 0.0], [0, -1], Some(4)),
            ([20.0, 1.0], [1, 0], None),
            ([20.0, 1.0], [-1, 0], Some(1)),
        ];
        for (from, way, expected) in rows {
            assert_eq!(beside(places.into_iter(), from, way), expected, "{from:?} {way:?}");
        }
        let mut seen = std::collections::BTreeSet::from([0_usize]);
        let mut open = vec![0_usize];
        while let Some(at) = open.pop() {
            let ways = [[1, 0], [-1, 0], [0, 1], [0, -1]];
            let next = ways.into_iter().filter_map(|way| beside(places.into_iter(), places[at], way));
            open.extend(next.filter(|next| seen.insert(*next)));
        }
        assert_eq!(seen.len(), places.len());
    }

    #[test]
    fn each_kind_of_change_has_its_own_marker_shape() {
        let palette = Palette::DARK;
        let [a, b] = [[1.0, 2.0], [4.0, 6.0]];
        let shape = |fate, before, now| {
            let marks = mark(fate, before, now, &palette);
            (marks.len(), marks.first().map(|line| line.colour))
        };
        let ring = usize::from(RING_STEPS);
        assert_eq!(shape(Fate::Gone, Some(a), None), (2, Some(palette.failed)));
        assert_eq!(shape(Fate::Added, None, Some(b)), (ring, Some(palette.done)));
        assert_eq!(shape(Fate::Moved, Some(a), Some(b)), (ring + 1, Some(palette.current)));
        assert_eq!(shape(Fate::Resized, Some(a), Some(a)), (ring, Some(palette.current)));
        let way = mark(Fate::Moved, Some(a), Some(b), &palette)[0];
        assert_eq!((way.a_mm, way.b_mm), (a, b), "from where it lay to where it lies");
    }

    #[test]
    fn empty_board_gives_an_empty_scene() {
        assert_eq!(seen(&Board::default()), Scene::default());
    }
}
