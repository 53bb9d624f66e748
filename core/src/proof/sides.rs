//! The sides of a board with their deep cuts, and what the comparison with the board finds.

use super::body::Body;
use super::deep::{Deep, legs};
use crate::board::Board;
use crate::geometry::Point;
use crate::job::{Asked, Program};
use crate::units::Length;
use std::collections::BTreeMap;
use std::ops::Range;

/// A hole drilled within this distance of its position, in mm, is in place.
const NEAR_MM: f64 = 0.05;

/// A side of a board as placed, and its programs.
pub struct SideRun<'a> {
    pub board: &'a Board,
    /// In order of execution.
    pub programs: &'a [Program],
    pub pins: Range<u32>,
}

/// Comparison of the holes, slots and edges of a board with its programs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DrillingProof {
    pub missing: Vec<Point>,
    /// Holes that are made more than once with one tool.
    pub doubled: Vec<Point>,
    /// Holes that are made next to their position.
    pub shifted: Vec<Point>,
    /// Holes made with a tool outside the size tolerance, or with a V-bit.
    pub wrong_size: Vec<Point>,
    /// Holes and slots that are less deep than required.
    pub shallow: Vec<Point>,
    /// Slots that are not cleared over their length and width.
    pub slots_missing: Vec<Point>,
    /// Contours of the outline along which the board is not cut out.
    pub edges_missing: Vec<Point>,
    /// Inner contours that are not cut, or not along most of what the tool can reach.
    pub inner_missing: Vec<Point>,
    pub tabs_missing: Vec<Point>,
    /// Contours without any tab, so that the board gets loose.
    pub loose: Vec<Point>,
    /// Outer contours that are cut out.
    pub edges_cut: u32,
    /// Deep cuts and holes in the board, outside its holes, slots and edges.
    pub bitten: Vec<Point>,
    /// Toolpaths that occur in two programs.
    pub repeated: u32,
    /// Holes that nothing makes, if no job requires them.
    pub holes_left: Vec<Point>,
    /// Slots that nothing clears, if no job requires them.
    pub slots_left: Vec<Point>,
    /// Contours of the outline that nothing cuts, if no job requires cutting out.
    pub edges_left: Vec<Point>,
    /// Number of holes and slots made, to any depth.
    pub made: u32,
    /// The cut nearest to the board and its distance from it, if nothing of the board is made and all cuts are
    /// outside.
    pub outside: Option<(Point, Length)>,
    /// False if the programs cut nothing.
    pub cuts: bool,
}

/// A hole made within this distance of an empty position, in mm, or within the hole's width, is meant for it.
pub(super) const BESIDE_MM: f64 = 0.6;

pub(super) struct Layer<'a> {
    pub(super) board: &'a Board,
    pub(super) pins: &'a Range<u32>,
    pub(super) body: Body,
    pub(super) legs: Vec<Deep<'a>>,
    pub(super) rounds: Places,
    /// The round ones from left to right.
    pub(super) by_x: Vec<(Length, usize)>,
    /// True if anything is cut, even shallowly.
    pub(super) cuts: bool,
}

impl<'a> Layer<'a> {
    pub(super) fn of(side: &'a SideRun<'a>, asked: &Asked) -> Self {
        let (legs, cuts) = legs(side.programs, asked.thickness);
        let rounds = Places::of(legs.iter().map(|leg| leg.round.map(|round| round.at)));
        let at_x = |(index, leg): (usize, &Deep<'_>)| Some((leg.round?.at.x, index));
        let mut by_x: Vec<(Length, usize)> = legs.iter().enumerate().filter_map(at_x).collect();
        by_x.sort_unstable();
        Self { board: side.board, pins: &side.pins, body: Body::of(side.board), legs, rounds, by_x, cuts }
    }
}

pub(super) struct Places {
    cells: BTreeMap<(i64, i64), Vec<(usize, Point)>>,
}

impl Places {
    pub(super) fn of(points: impl Iterator<Item = Option<Point>>) -> Self {
        let mut cells: BTreeMap<(i64, i64), Vec<(usize, Point)>> = BTreeMap::new();
        for (index, at) in points.enumerate().filter_map(|(index, at)| Some((index, at?))) {
            cells.entry(Self::cell(at)).or_default().push((index, at));
        }
        Self { cells }
    }

    fn cell(at: Point) -> (i64, i64) {
        let size = Length::from_mm(NEAR_MM).nm();
        (at.x.nm().div_euclid(size), at.y.nm().div_euclid(size))
    }

    pub(super) fn near(&self, at: Point) -> impl Iterator<Item = usize> {
        let (x, y) = Self::cell(at);
        let cells = (x - 1..=x + 1).flat_map(move |x| (y - 1..=y + 1).map(move |y| (x, y)));
        let here = cells.filter_map(|cell| self.cells.get(&cell)).flatten();
        here.filter(move |(_, place)| place.distance_mm(at) <= NEAR_MM).map(|(index, _)| *index)
    }
}
