//! Gerber drill layers next to drill programs: holes that only the layer has are not drilled, which is an
//! error to accept.
//!
//! ```text
//!   board-PTH.drl        ● ● ● ●        drilled
//!   board-NPTH-drl.gbr           ◌      in no program: reported
//! ```

use super::Board;
use super::split::distance_mm;
use crate::artwork::{Artwork, FileKind, FileRead, Role};
use crate::diagnostic::Diagnostic;
use crate::error;
use crate::geometry::{PathSegment, Point};
use crate::units::Length;
use std::collections::{BTreeMap, BTreeSet};

/// Holes this near to each other are the same.
const SAME: Length = Length::from_um(50);
/// Slots are looked up in squares of this side.
const SQUARE: Length = Length::from_um(1_000);
/// Most squares along a leg of a slot.
const MOST_SQUARES: f64 = 10_000.0;
/// Holes of a layer that are compared at most.
const MOST_POINTS: usize = 200_000;

/// Reports drill layers with holes that no file among `used` has.
pub(super) fn unused(board: &Board, artwork: &Artwork, used: &[usize]) -> Vec<Diagnostic> {
    let files = || used.iter().filter_map(|&index| artwork.files.get(index));
    if !files().any(FileRead::is_program_with_holes) {
        return Vec::new();
    }
    let rows = artwork.files.iter().enumerate();
    let layers = rows.filter(|(index, file)| {
        let is_layer = file.kind == FileKind::Gerber && file.role == Role::Drill;
        is_layer && !used.contains(index) && !files().any(|other| other.fingerprint == file.fingerprint)
    });
    let layers: Vec<&FileRead> = layers.map(|(_, file)| file).collect();
    if layers.is_empty() {
        return Vec::new();
    }
    let targets = DrillTargets::of(board, files());
    layers.into_iter().filter_map(|layer| missing(layer, &targets)).collect()
}

/// The report about one layer; `None` if the targets include all its holes.
fn missing(layer: &FileRead, targets: &DrillTargets) -> Option<Diagnostic> {
    let drill = layer.drill.as_ref()?;
    let all = || drill.centres().map(|(at, _)| at).take(MOST_POINTS);
    let mut missing = all().filter(|at| !targets.has(*at));
    let first = missing.next()?;
    let mm = |length: Length| format!("{:.3}", length.mm());
    let error = error!("board.holes_in_layer_only", ..).at(&layer.name, 0, 0);
    let error =
        error.with("file", &layer.name).with("count", missing.count() + 1).with("holes", all().count());
    Some(error.with("x", mm(first.x)).with("y", mm(first.y)))
}

/// Holes and slots of the board, as in the files and with each shift that puts holes onto the copper.
struct DrillTargets {
    cells: BTreeMap<(i64, i64), Vec<Point>>,
    slots: BTreeMap<(i64, i64), Vec<(Point, Point)>>,
}

impl DrillTargets {
    fn of<'a>(board: &Board, files: impl Iterator<Item = &'a FileRead>) -> Self {
        let shifts = files.filter_map(|file| file.evidence.as_ref()?.shift_mm);
        let mut shifts: Vec<Point> = shifts.map(|(x, y)| Point::from_mm(x, y)).collect();
        shifts.push(Point::default());
        shifts.sort_unstable();
        shifts.dedup();
        let mut targets = Self { cells: BTreeMap::new(), slots: BTreeMap::new() };
        for by in shifts {
            let moved = |at: Point| Point::new(at.x + by.x, at.y + by.y);
            for at in board.holes.iter().map(|hole| moved(hole.at)) {
                targets.cells.entry(cell(at, SAME)).or_default().push(at);
            }
            let legs = board.slots.iter().flat_map(|slot| slot.path.array_windows());
            for [from, to] in legs {
                let leg = (moved(*from), moved(*to));
                for square in squares(leg) {
                    targets.slots.entry(square).or_default().push(leg);
                }
            }
        }
        targets
    }

    fn has(&self, at: Point) -> bool {
        let is_hole = |hole: &Point| hole.distance_mm(at) <= SAME.mm();
        let is_on =
            |&(from, to): &(Point, Point)| distance_mm((from, PathSegment::Line { to }), at) <= SAME.mm();
        around(cell(at, SAME)).filter_map(|cell| self.cells.get(&cell)).flatten().any(is_hole)
            || around(cell(at, SQUARE)).filter_map(|cell| self.slots.get(&cell)).flatten().any(is_on)
    }
}

fn cell(at: Point, side: Length) -> (i64, i64) {
    (at.x.nm().div_euclid(side.nm()), at.y.nm().div_euclid(side.nm()))
}

fn around((x, y): (i64, i64)) -> impl Iterator<Item = (i64, i64)> {
    (-1..=1).flat_map(move |dx| (-1..=1).map(move |dy| (x + dx, y + dy)))
}

/// The squares along a leg, at places half a square apart: a place near the leg is in one of these or next to it.
fn squares((from, to): (Point, Point)) -> BTreeSet<(i64, i64)> {
    let steps = libm::ceil(2.0 * from.distance_mm(to) / SQUARE.mm()).clamp(1.0, MOST_SQUARES);
    let (dx, dy) = ((to.x - from.x).mm(), (to.y - from.y).mm());
    let at = |step: u32| {
        let part = f64::from(step) / steps;
        Point::from_mm(from.x.mm() + part * dx, from.y.mm() + part * dy)
    };
    (0..=steps as u32).map(|step| cell(at(step), SQUARE)).collect()
}
