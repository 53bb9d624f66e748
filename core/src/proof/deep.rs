//! Deep cuts of programs: by drills, and by mills below the copper.
//!
//! ```text
//!   ●        a drill cycle      ◎ a circle, any number of turns    ╭───╮  any other path
//!                                                                  ╰── ┄
//! ```

use super::edges::{Edge, Edges, Spot, around, spots};
use super::replay::replay;
use crate::board::COPPER_THICKNESS;
use crate::geometry::{Bounds, Point};
use crate::job::{Bit, Cutter, Program};
use crate::units::Length;

/// A path within this distance of a circle, in mm, is round.
const ROUND_MM: f64 = 0.02;
/// A mill's path counts from the board's thickness divided by this on: above it, copper is milled.
const DEEP: i64 = 4;

/// A straight piece of a path, and its depth.
type Stretch = (Spot, Spot, Length);

pub(super) struct Deep<'a> {
    pub(super) bit: &'a Bit,
    pub(super) lowest: Length,
    pub(super) stretches: Vec<Stretch>,
    /// `None` if it is no hole.
    pub(super) round: Option<Round>,
}

/// A round hole that a leg makes, or a ring of one.
#[derive(Clone, Copy)]
pub(super) struct Round {
    pub(super) at: Point,
    pub(super) wide_mm: f64,
    /// The tool only moves down and up.
    pub(super) stroke: bool,
}

/// The legs of `programs` that cut deep into a board of this thickness, and whether anything is cut.
pub(super) fn legs(programs: &[Program], thickness: Length) -> (Vec<Deep<'_>>, bool) {
    let (mut legs, mut cuts) = (Vec::<Deep<'_>>::new(), false);
    for (index, program) in (0..).zip(programs) {
        let mut known = None;
        for cut in replay(program, index, COPPER_THICKNESS).cuts {
            cuts |= cut.depth > Length::ZERO || cut.through.is_some();
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
    (legs, cuts)
}

/// Ends the last leg: keeps it if it cuts deep, and determines if it is round.
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

pub(super) struct Swept {
    edges: Edges,
    /// Half the width of the tool and the depth, by edge.
    tools: Vec<(f64, Length)>,
    widest: f64,
}

impl Swept {
    /// Cuts of drills and mills; a V-bit makes no board edge.
    pub(super) fn of<'a>(legs: impl Iterator<Item = &'a Deep<'a>>) -> Self {
        let (mut edges, mut tools) = (Vec::new(), Vec::new());
        for leg in legs.filter(|leg| !matches!(leg.bit.cutter, Cutter::Vee { .. })) {
            for &(from, to, depth) in &leg.stretches {
                edges.push(Edge { from, to, island: 0, ring: 0 });
                tools.push((leg.bit.diameter.mm() / 2.0, depth));
            }
        }
        let widest = tools.iter().map(|(half, _)| *half).fold(0.0, f64::max);
        Self { edges: Edges::loose(edges), tools, widest }
    }

    /// True if `spot` is cut at least to `depth`, with tools wider by this slack on each side.
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
