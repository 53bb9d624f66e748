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
use super::drilled::BESIDE_MM;
use super::edges::{Edge, Spot, spots};
use super::sides::{DrillingProof, Layer};
use crate::board::Board;
use crate::geometry::{Bounds, Point};
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
        out.bitten.extend(extra_holes(layer, asked));
    }
}

/// Holes through the board where it has none. Holes beside a hole of the board are judged with it, and those
/// at the edge may be mouse-bites.
fn extra_holes(layer: &Layer<'_>, asked: &Asked) -> Vec<Point> {
    let board = layer.board;
    if board.holes.is_empty() && board.slots.is_empty() {
        return Vec::new();
    }
    let reach_mm = |width: Option<Length>| width.map_or(0.0, |width| width.mm() / 2.0) + BESIDE_MM;
    let mut holes: Vec<(Point, f64)> =
        board.holes.iter().map(|hole| (hole.at, reach_mm(hole.diameter))).collect();
    holes.sort_by_key(|(at, _)| at.x);
    let widest_mm = holes.iter().map(|(_, reach)| *reach).fold(0.0, f64::max);
    let is_beside_hole = |spot: Point| {
        let first = holes.partition_point(|(at, _)| (spot.x - at.x).mm() > widest_mm);
        let near = holes.iter().skip(first).take_while(|(at, _)| (at.x - spot.x).mm() <= widest_mm);
        near.into_iter().any(|(at, reach)| at.distance_mm(spot) <= *reach)
    };
    // Without an outline, pins and the copies of a panel lie beside the board.
    let drawn = layer.body.is_unknown().then(|| drawn_bounds(layer)).flatten();
    let is_on_board = |at: Point, half: f64| match drawn {
        Some(bounds) => bounds.contains(at),
        None => layer.body.is_well_inside(Spot::of(at), half),
    };
    let unsized_slots: Vec<&[Point]> =
        board.slots.iter().filter(|slot| slot.width.is_none()).map(|slot| slot.path.as_slice()).collect();
    let is_in_unsized = |spot: Spot, half: f64| {
        let mut legs = unsized_slots.iter().flat_map(|path| path.iter().zip(path.iter().skip(1)));
        legs.any(|(from, to)| {
            edge(Spot::of(*from), Spot::of(*to)).near(spot).distance(spot) <= half + BESIDE_MM
        })
    };
    let through = layer.legs.iter().filter(|leg| leg.lowest * 2 >= asked.thickness);
    let rounds = through.filter_map(|leg| leg.round.filter(|round| round.stroke || layer.body.is_unknown()));
    let extra = rounds.filter(|round| {
        let (spot, half) = (Spot::of(round.at), round.wide_mm / 2.0);
        is_on_board(round.at, half)
            && !is_beside_hole(round.at)
            && !is_in_unsized(spot, half)
            && !is_open(board, asked, spot, half)
    });
    extra.map(|round| round.at).collect()
}

/// The bounds of everything that is drawn of a board, without its pins.
fn drawn_bounds(layer: &Layer<'_>) -> Option<Bounds> {
    let board = layer.board;
    let copper = board.copper.iter().filter_map(|copper| copper.region.bounds());
    let holes = (0..).zip(&board.holes).filter(|(number, _)| !layer.pins.contains(number));
    let points = holes.map(|(_, hole)| hole.at);
    let points = points.chain(board.slots.iter().flat_map(|slot| slot.path.iter().copied()));
    let of_points = points.map(|at| Bounds { min: at, max: at });
    copper.chain(of_points).reduce(|a, b| a.with(b.min).with(b.max))
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

/// True if everything within `half` of a point is in a hole or a slot.
fn is_open(board: &Board, asked: &Asked, spot: Spot, half: f64) -> bool {
    let slack = asked.tolerance.mm() / 2.0 + SLACK_MM;
    let within = |width: Length, distance: f64| distance + half <= width.mm() / 2.0 + slack;
    let hole = || {
        let mut sized = board.holes.iter().filter_map(|hole| Some((Spot::of(hole.at), hole.diameter?)));
        sized.any(|(at, width)| within(width, at.distance(spot)))
    };
    let slot = || {
        let mut sized = board.slots.iter().filter_map(|slot| Some((&slot.path, slot.width?)));
        sized.any(|(path, width)| {
            let pairs = path.iter().zip(path.iter().skip(1));
            let mut edges = pairs.map(|(from, to)| edge(Spot::of(*from), Spot::of(*to)));
            edges.any(|edge| within(width, edge.near(spot).distance(spot)))
        })
    };
    hole() || slot()
}

fn edge(from: Spot, to: Spot) -> Edge {
    Edge { from, to, island: 0, ring: 0 }
}
