//! Compares the board's outline with the programs that cut it out.
//!
//! ```text
//!      ┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄        path of the tool centre, half the tool's width from the edge
//!    ┌──────────────────┐
//!    │                ┄┄│┄┄┄   a deep path outside holes and slots cuts into the board
//!    └──────────────────┘
//! ```

use super::body::{MEANT_MM, SLACK_MM, STEP_MM, along};
use super::deep::Swept;
use super::edges::{Edge, Spot, spots};
use super::sides::{DrillingProof, Layer};
use crate::board::Board;
use crate::geometry::Point;
use crate::job::{Asked, Cutter};
use crate::units::Length;

/// Share of a contour's required length that must be cut: tools don't reach into every corner.
const MOST_SHARE: f64 = 0.7;
/// Share of a contour's length that must be cut, if tabs are unknown.
const HALF_SHARE: f64 = 0.4;

/// Reports contours that are not cut, and toolpaths that cut into the board.
pub(super) fn cut_out(layers: &[Layer<'_>], asked: &Asked, out: &mut DrillingProof) {
    let edges = layers.iter().map(|layer| {
        let mills = layer.legs.iter().filter(|leg| leg.bit.cutter == Cutter::Mill);
        edges(layer.board, &Swept::of(mills), asked)
    });
    if let Some((missing, left, cut)) = edges.min_by_key(|(missing, _, cut)| (missing.len(), u32::MAX - cut))
    {
        (out.edges_missing, out.edges_left, out.edges_cut) = (missing, left, cut);
    }
    for layer in layers {
        let legs = layer.legs.iter().filter(|leg| leg.bit.cutter == Cutter::Mill);
        let milled = legs
            .filter(|leg| !leg.round.is_some_and(|round| round.stroke) && leg.lowest * 2 >= asked.thickness);
        let bites = milled.filter_map(|leg| {
            layer.body.first_bite(leg, |spot, half| is_open(layer.board, asked, spot, half), asked)
        });
        out.bitten.extend(bites.map(Spot::point));
    }
}

/// Outer contours with too little cut, those with nothing required or cut, and the number of cut ones.
fn edges(board: &Board, swept: &Swept, asked: &Asked) -> (Vec<Point>, Vec<Point>, u32) {
    let (mut missing, mut left, mut cut) = (Vec::new(), Vec::new(), 0);
    for island in &board.outline.islands {
        let places = along(&spots(&island.outer), STEP_MM);
        let Some(first) = places.first() else { continue };
        let count = |slack: f64, depth: Length| {
            places.iter().filter(|spot| swept.cover(**spot, slack, depth)).count() as f64
        };
        let all = places.len() as f64;
        let least = match asked.cut_out {
            Some(edge) if edge.zones => 1.0,
            Some(edge) => ((all - edge.spared.mm() / STEP_MM) * MOST_SHARE).max(1.0),
            None if count(MEANT_MM, Length::ZERO) >= all / 2.0 => all * HALF_SHARE,
            None => {
                // A job states what it leaves uncut.
                left.extend(asked.holes.is_none().then(|| first.point()));
                continue;
            }
        };
        if count(SLACK_MM, asked.cut_out.map_or(asked.thickness, |edge| edge.depth)) < least {
            missing.push(first.point());
        } else {
            cut += 1;
        }
    }
    (missing, left, cut)
}

/// True if everything within `half` of a point is in a hole or a slot. One without a size takes every tool on
/// its centre line.
pub(super) fn is_open(board: &Board, asked: &Asked, spot: Spot, half: f64) -> bool {
    let slack = asked.tolerance.mm() / 2.0 + SLACK_MM;
    let within = |width: Option<Length>, distance: f64| {
        distance + half <= width.map_or(half, |width| width.mm() / 2.0) + slack
    };
    let hole = || {
        let mut holes = board.holes.iter();
        holes.any(|hole| within(hole.diameter, Spot::of(hole.at).distance(spot)))
    };
    let slot = || {
        board.slots.iter().any(|slot| {
            let mut pairs = slot.path.iter().zip(slot.path.iter().skip(1));
            pairs.any(|(from, to)| {
                let edge = Edge { from: Spot::of(*from), to: Spot::of(*to), island: 0, ring: 0 };
                within(slot.width, edge.near(spot).distance(spot))
            })
        })
    };
    hole() || slot()
}
