//! The holes that programs make, against those of the board: which are missing, made twice, beside their place, of another size, not
//! through (N8 N9).
//!
//! ```text
//!    ◯ board    ● program      ◉ made      ◯  missing      ◉● twice      ◯ ● shifted: one beside its place, and none on it
//! ```
//!
//! Comes in: boards as they lie, each with its programs; their holes in the same order. Goes out: counts and places. What no hole
//! of the board asks for (pins, mouse-bites) is nobody's fault. Does not look at copper.

use super::cut_out::{self, Body};
use super::deep::{Deep, legs};
use super::held;
use super::repeated;
use super::slots;
use crate::board::Board;
use crate::geometry::Point;
use crate::job::{Asked, Bit, Cutter, Program};
use crate::units::Length;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// A hole is made where one is drilled as near as this to its place, in mm.
const NEAR_MM: f64 = 0.05;
/// A hole made as near as this to a place where none is made is meant for it, in mm; or as near as the hole is wide.
const BESIDE_MM: f64 = 0.6;
/// Sizes and depths this near, in mm, are one: digits of files.
const EQUAL_MM: f64 = 0.01;

/// A side of a board as it lies, and what is run on it.
pub struct SideRun<'a> {
    /// The board.
    pub board: &'a Board,
    /// Its programs, one after the other.
    pub programs: &'a [Program],
    /// The holes for pins among its holes.
    pub pins: Range<u32>,
}

/// What became of the holes of a board, its slots and its edge.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DrillingProof {
    /// Holes that nothing makes; none where they are not asked for.
    pub missing: Vec<Point>,
    /// Holes that are made more than once with one tool.
    pub doubled: Vec<Point>,
    /// Holes that are made beside their place.
    pub shifted: Vec<Point>,
    /// Holes that are made with a tool farther from their size than asked for, or with a V-bit.
    pub wrong_size: Vec<Point>,
    /// Holes and slots that do not go as deep as asked for.
    pub shallow: Vec<Point>,
    /// Slots that are not cleared over their length and width.
    pub slots_missing: Vec<Point>,
    /// Contours of the outline along which the board is not cut off.
    pub edges_missing: Vec<Point>,
    /// Contours within a board that are not cut, or not along most of what the bit comes to.
    pub inner_missing: Vec<Point>,
    /// Contours that are left with fewer tabs, or narrower ones, than the job says.
    pub tabs_missing: Vec<Point>,
    /// Contours along which nothing is left: the board comes loose there.
    pub loose: Vec<Point>,
    /// Contours along which it is.
    pub edges_cut: u32,
    /// Swept that cut deep into the board where it has no hole, no slot and no edge.
    pub bitten: Vec<Point>,
    /// Toolpaths that two programs have alike.
    pub repeated: u32,
}

/// A leg that makes a hole to its size.
struct Fit {
    tool: Tool,
    /// How wide, in steps of [`EQUAL_MM`].
    steps: i64,
    depth: Length,
}

/// What is done to one hole.
#[derive(Default)]
struct Done {
    fits: Vec<Fit>,
    /// Something narrower is made there, or with a V-bit: the rings within a milled hole are.
    narrower: bool,
    /// Something wider is made there.
    wider: bool,
}

/// What makes tools alike: the cutter and its diameter in nm.
type Tool = (u8, i64);

/// The form of a drill.
const DRILL: u8 = 0;

fn tool(bit: &Bit) -> Tool {
    let form = match bit.cutter {
        Cutter::Drill => DRILL,
        Cutter::Mill => 1,
        Cutter::Vee { .. } => 2,
    };
    (form, bit.diameter.nm())
}

/// Compares holes, slots and the edge of boards with what their programs do.
pub fn drilled(sides: &[SideRun<'_>], asked: &Asked) -> DrillingProof {
    let layers: Vec<Layer<'_>> = sides.iter().map(|side| Layer::of(side, asked)).collect();
    let repeated = sides.iter().map(|side| repeated::repeated(side.programs)).sum();
    let mut out = DrillingProof { repeated, ..DrillingProof::default() };
    let any = holes(&layers, asked, &mut out);
    slots::slots(&layers, (asked, any), &mut out);
    cut_out::cut_out(&layers, asked, &mut out);
    held::held(&layers, asked, &mut out);
    out
}

/// A side with what is done deep in it.
pub(super) struct Layer<'a> {
    pub(super) board: &'a Board,
    pins: &'a Range<u32>,
    pub(super) body: Body,
    pub(super) legs: Vec<Deep<'a>>,
    rounds: Places,
}

impl<'a> Layer<'a> {
    fn of(side: &'a SideRun<'a>, asked: &Asked) -> Self {
        let legs = legs(side.programs, asked.thickness);
        let rounds = Places::of(legs.iter().map(|leg| leg.round.map(|round| round.at)));
        Self { board: side.board, pins: &side.pins, body: Body::of(side.board), legs, rounds }
    }
}

/// Compares the holes. Whether any is made.
fn holes(layers: &[Layer<'_>], asked: &Asked, out: &mut DrillingProof) -> bool {
    let Some(first) = layers.first() else { return false };
    let drills = |leg: &Deep<'_>| leg.bit.cutter == Cutter::Drill && leg.round.is_some();
    let mut any = layers.iter().flat_map(|layer| &layer.legs).any(drills);
    let mut taken: Vec<BTreeSet<usize>> = vec![BTreeSet::new(); layers.len()];
    let own = Places::of(first.board.holes.iter().map(|hole| Some(hole.at)));
    let (mut open, mut pins_begun) = (Vec::new(), false);
    for (number, hole) in first.board.holes.iter().enumerate() {
        let Some(wide) = hole.diameter else { continue };
        let mates =
            || own.near(hole.at).filter_map(|other| Some((other, first.board.holes.get(other)?.diameter?)));
        // Files tell some holes twice.
        if mates().any(|(other, size)| other < number && size == wide) {
            continue;
        }
        let sizes: Vec<Length> = mates().map(|(_, size)| size).collect();
        let mut done = Done::default();
        for (layer, taken) in layers.iter().zip(&mut taken) {
            let Some(at) = layer.board.holes.get(number).map(|hole| hole.at) else { continue };
            for index in layer.rounds.near(at) {
                taken.insert(index);
                if let Some(leg) = layer.legs.get(index) {
                    done.look(leg, (wide, &sizes), &layer.body, asked);
                }
            }
        }
        any |= !done.fits.is_empty();
        pins_begun |= !done.fits.is_empty() && first.pins.contains(&(number as u32));
        if !done.judge(hole.at, asked, out) {
            open.push((number, hole.at));
        }
    }
    // Nobody asks for pins of files without a job; where one of them is made, the others are.
    let pins = asked.pins || asked.holes.is_none() && pins_begun;
    for (number, at) in open {
        let pin = first.pins.contains(&(number as u32));
        if !(if pin { pins } else { asked.holes.unwrap_or(any) }) {
            continue;
        }
        let mut beside = layers.iter().zip(&mut taken);
        let beside = beside.any(|(layer, taken)| take_beside(layer, number, taken));
        if beside { out.shifted.push(at) } else { out.missing.push(at) }
    }
    any
}

impl Done {
    /// Notes what a leg does to a hole this wide, at whose place are holes of these `sizes`, its own among them.
    fn look(&mut self, leg: &Deep<'_>, (wide, sizes): (Length, &[Length]), body: &Body, asked: &Asked) {
        let Some(round) = leg.round else { return };
        let vee = matches!(leg.bit.cutter, Cutter::Vee { .. });
        let fits = |size: &Length| {
            !vee && libm::fabs(round.wide_mm - size.mm()) <= asked.tolerance.mm() + EQUAL_MM / 2.0
        };
        if fits(&wide) {
            let steps = libm::round(round.wide_mm / EQUAL_MM) as i64;
            self.fits.push(Fit { tool: tool(leg.bit), steps, depth: leg.lowest });
        } else if !sizes.iter().any(fits) {
            let widest = sizes.iter().max().copied().unwrap_or(wide);
            if vee || round.wide_mm < widest.mm() {
                self.narrower = true;
            } else if round.stroke || body.is_bitten(leg) {
                self.wider |= wide == widest;
            }
        }
    }

    /// Says of a hole at `at` what was done to it. Whether anything was.
    fn judge(&self, at: Point, asked: &Asked, out: &mut DrillingProof) -> bool {
        if self.wider || (self.fits.is_empty() && self.narrower) {
            out.wrong_size.push(at);
            return true;
        }
        let Some(deepest) = self.fits.iter().max_by_key(|fit| fit.depth) else { return false };
        let least = if deepest.tool.0 == DRILL { asked.drilled } else { asked.milled };
        if (least - deepest.depth).mm() > EQUAL_MM {
            out.shallow.push(at);
        }
        let mut times: BTreeMap<(Tool, i64), u32> = BTreeMap::new();
        for fit in self.fits.iter().filter(|fit| (deepest.depth - fit.depth).mm() <= EQUAL_MM) {
            *times.entry((fit.tool, fit.steps)).or_default() += 1;
        }
        if times.values().any(|times| *times > 1) {
            out.doubled.push(at);
        }
        true
    }
}

/// Takes the nearest of the holes made beside the place of a hole, if there is one.
fn take_beside(layer: &Layer<'_>, hole: usize, taken: &mut BTreeSet<usize>) -> bool {
    let Some(hole) = layer.board.holes.get(hole) else { return false };
    let reach = hole.diameter.map_or(0.0, Length::mm).max(BESIDE_MM);
    let free = layer.legs.iter().enumerate().filter(|(index, _)| !taken.contains(index));
    let distances = free.filter_map(|(index, leg)| {
        let round = leg.round.filter(|round| round.wide_mm <= 2.0 * reach)?;
        Some((index, round.at.distance_mm(hole.at)))
    });
    let nearest = distances.min_by(|a, b| a.1.total_cmp(&b.1));
    let Some((index, _)) = nearest.filter(|(_, distance)| *distance <= reach) else { return false };
    taken.insert(index)
}

/// Places in cells, to find those of one place.
struct Places {
    cells: BTreeMap<(i64, i64), Vec<(usize, Point)>>,
}

impl Places {
    fn of(points: impl Iterator<Item = Option<Point>>) -> Self {
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

    /// The numbers of those at `at`.
    fn near(&self, at: Point) -> impl Iterator<Item = usize> {
        let (x, y) = Self::cell(at);
        let cells = (x - 1..=x + 1).flat_map(move |x| (y - 1..=y + 1).map(move |y| (x, y)));
        let here = cells.filter_map(|cell| self.cells.get(&cell)).flatten();
        here.filter(move |(_, place)| place.distance_mm(at) <= NEAR_MM).map(|(index, _)| *index)
    }
}
