//! What programs do deep in the board: by drills, and by mills below the copper.
//!
//! ```text
//!   ●        a stroke           ◎ once round, however often        ╭───╮  any other way
//!                                                                  ╰── ┄
//! ```
//!
//! Comes in: programs. Goes out: [`Deep`] legs, [`Swept`]; mm, depths below the surface in [`Length`]. Does not know the board, nor what marks
//! say: files that are read back have marks of their own.

use super::edges::{Edge, Edges, Spot, around, spots};
use super::replay::replay;
use crate::board::COPPER_THICKNESS;
use crate::geometry::{Bounds, Point};
use crate::job::{Bit, Cutter, Program};
use crate::units::Length;

/// A way is round where it keeps so near to a circle, in mm.
const ROUND_MM: f64 = 0.02;
/// A way of a mill counts from this share of the board's thickness on: above it copper is milled.
const DEEP: i64 = 4;

/// A straight piece of a way, and how deep it is.
type Stretch = (Spot, Spot, Length);

/// A leg of a program that goes deep.
pub(super) struct Deep<'a> {
    pub(super) bit: &'a Bit,
    pub(super) lowest: Length,
    pub(super) stretches: Vec<Stretch>,
    /// None where it is no hole.
    pub(super) round: Option<Round>,
}

/// A round hole that a leg makes, or a ring of one.
#[derive(Clone, Copy)]
pub(super) struct Round {
    pub(super) at: Point,
    /// How wide it is.
    pub(super) wide_mm: f64,
    /// The tool only goes down and up.
    pub(super) stroke: bool,
}

/// The legs of `programs` that go deep into a board of this thickness.
pub(super) fn legs(programs: &[Program], thickness: Length) -> Vec<Deep<'_>> {
    let mut legs: Vec<Deep<'_>> = Vec::new();
    for (index, program) in (0..).zip(programs) {
        let mut known = None;
        for cut in replay(program, index, COPPER_THICKNESS).cuts {
            let Some(bit) = program.bits.get(cut.bit as usize).filter(|_| cut.through.is_some()) else {
                continue;
            };
            if known != Some((cut.leg, cut.bit)) {
                known = Some((cut.leg, cut.bit));
                drop_unless_deep(&mut legs, thickness);
                legs.push(Deep { bit, lowest: Length::ZERO, stretches: Vec::new(), round: None });
            }
            let Some(leg) = legs.last_mut() else { continue };
            leg.lowest = leg.lowest.max(cut.depth);
            let places = spots(&cut.path);
            match places.as_slice() {
                [only] => leg.stretches.push((*only, *only, cut.depth)),
                _ => leg.stretches.extend(
                    places.iter().zip(places.iter().skip(1)).map(|(from, to)| (*from, *to, cut.depth)),
                ),
            }
        }
        drop_unless_deep(&mut legs, thickness);
    }
    legs
}

/// Ends the last leg: it stays where it goes deep, and is round or not.
fn drop_unless_deep(legs: &mut Vec<Deep<'_>>, thickness: Length) {
    let Some(leg) = legs.last_mut().filter(|leg| leg.round.is_none()) else { return };
    leg.round = round(leg);
    let stroke = leg.round.is_some_and(|round| round.stroke);
    let below = leg.lowest * DEEP >= thickness;
    let counts = match leg.bit.cutter {
        Cutter::Drill => true,
        Cutter::Mill => stroke || below,
        Cutter::Vee { .. } => stroke && below,
    };
    if !counts {
        legs.pop();
    }
}

fn round(leg: &Deep<'_>) -> Option<Round> {
    let places = || leg.stretches.iter().flat_map(|(from, to, _)| [*from, *to]);
    let bounds = Bounds::around(places().map(Spot::point))?;
    let (wide, high) = ((bounds.max.x - bounds.min.x).mm(), (bounds.max.y - bounds.min.y).mm());
    let middle = Spot::of(bounds.min).towards(Spot::of(bounds.max), 0.5);
    let farthest = places().map(|spot| spot.distance(middle)).fold(0.0, f64::max);
    let is_round = libm::fabs(wide - high) <= ROUND_MM && farthest <= wide.max(high) / 2.0 + ROUND_MM;
    let tool = leg.bit.width_at(leg.lowest).mm();
    is_round.then_some(Round {
        at: middle.point(),
        wide_mm: wide.max(high) + tool,
        stroke: wide.max(high) <= ROUND_MM,
    })
}

/// Where tools go deep, in a grid.
pub(super) struct Swept {
    edges: Edges,
    /// Half the width of the tool and the depth, by edge.
    tools: Vec<(f64, Length)>,
    widest: f64,
}

impl Swept {
    /// Those of drills and mills; a V-bit makes no edge of a board.
    pub(super) fn of<'a>(legs: impl Iterator<Item = &'a Deep<'a>>) -> Self {
        let (mut edges, mut tools) = (Vec::new(), Vec::new());
        for leg in legs.filter(|leg| !matches!(leg.bit.cutter, Cutter::Vee { .. })) {
            for &(from, to, depth) in &leg.stretches {
                edges.push(Edge { from, to, island: 0, ring: 0, along_mm: 0.0 });
                tools.push((leg.bit.diameter.mm() / 2.0, depth));
            }
        }
        let widest = tools.iter().map(|(half, _)| *half).fold(0.0, f64::max);
        Self { edges: Edges::gridded(edges, Vec::new()), tools, widest }
    }

    /// Whether `spot` is cut away at least to `depth`, or would be by tools so much wider on every side.
    pub(super) fn cover(&self, spot: Spot, slack_mm: f64, depth: Length) -> bool {
        let (low, high) = around(spot, spot, self.widest + slack_mm);
        let mut found = false;
        self.edges.in_box(low, high, &mut |index, edge| {
            found = found
                || self.tools.get(index as usize).is_some_and(|(half, deep)| {
                    *deep >= depth && edge.near(spot).distance(spot) <= half + slack_mm
                });
        });
        found
    }
}
