//! The board as programs cut it out, against its outline (N8 N10).
//!
//! ```text
//!      ┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄        way of the middle of the bit, half its width from the edge
//!    ┌──────────────────┐
//!    │                ┄┄│┄┄┄   a way that goes deep where there is neither hole nor slot bites into the board
//!    └──────────────────┘
//! ```
//!
//! Comes in: boards as they lie with what goes deep in them. Goes out: places. Does not look at copper; contours within a board and
//! tabs are looked at in `held`.

use super::deep::{Deep, Swept};
use super::drilled::{DrillingProof, Layer};
use super::edges::{Edge, Edges, Spot, spots};
use crate::board::Board;
use crate::geometry::Point;
use crate::job::{Asked, Cutter};
use crate::units::Length;

/// Places along a way or an edge are this far apart, in mm.
const STEP_MM: f64 = 0.25;
/// A cut keeps to the edge within this, in mm.
const SLACK_MM: f64 = 0.05;
/// A way so near to most of the edge, in mm beyond the tool, is meant for it.
const MEANT_MM: f64 = 1.0;
/// A way on the line keeps to it within this, in mm.
const ON_LINE_MM: f64 = 0.03;
/// So much of what is asked for of a contour must be cut: bits do not come into every corner.
const MOST_SHARE: f64 = 0.7;
/// So much of a contour where nobody says how it is held.
const HALF_SHARE: f64 = 0.4;

/// Tells the contours that are not cut, and the toolpaths that bite into the board.
pub(super) fn cut_out(layers: &[Layer<'_>], asked: &Asked, out: &mut DrillingProof) {
    let edges = layers.iter().map(|layer| {
        let mills = layer.legs.iter().filter(|leg| leg.bit.cutter == Cutter::Mill);
        edges(layer.board, &Swept::of(mills), asked)
    });
    if let Some((missing, cut)) = edges.min_by_key(|(missing, cut)| (missing.len(), u32::MAX - cut)) {
        (out.edges_missing, out.edges_cut) = (missing, cut);
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

/// The outer contours along which too little is cut, and how many are cut.
fn edges(board: &Board, swept: &Swept, asked: &Asked) -> (Vec<Point>, u32) {
    let (mut missing, mut cut) = (Vec::new(), 0);
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
            None => continue,
        };
        if count(SLACK_MM, asked.cut_out.map_or(asked.thickness, |edge| edge.depth)) < least {
            missing.push(first.point());
        } else {
            cut += 1;
        }
    }
    (missing, cut)
}

/// Places along a way, so far apart.
pub(super) fn along(spots: &[Spot], step_mm: f64) -> Vec<Spot> {
    let (mut places, mut left) = (Vec::new(), 0.0);
    for (from, to) in spots.iter().zip(spots.iter().skip(1)) {
        let length = from.distance(*to);
        while left < length {
            places.push(from.towards(*to, left / length));
            left += step_mm;
        }
        left -= length;
    }
    places
}

/// Whether all within `half` around a place lies in a hole or a slot.
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
    Edge { from, to, island: 0, ring: 0, along_mm: 0.0 }
}

/// What is within the outline of a board.
pub(super) struct Body {
    /// None where there is no outline.
    edges: Option<Edges>,
}

impl Body {
    pub(super) fn of(board: &Board) -> Self {
        Self { edges: (!board.outline.is_empty()).then(|| Edges::of(&board.outline)) }
    }

    /// How far a tool of this half width goes into the board at a place, and how far the place is from the edge, in mm.
    fn bite(&self, spot: Spot, half: f64) -> Option<(f64, f64)> {
        let edges = self.edges.as_ref()?;
        let inside = edges.island_at(spot).is_some();
        let off = edges.nearest(spot, half + MEANT_MM, &|_| true).map_or(half + MEANT_MM, |(off, ..)| off);
        Some((if inside { half + off } else { half - off }, off))
    }

    /// Whether a leg goes into the board; it does where there is no outline.
    pub(super) fn is_bitten(&self, leg: &Deep<'_>) -> bool {
        let half = leg.bit.diameter.mm() / 2.0;
        let bites = |spot: &Spot| self.bite(*spot, half).is_none_or(|(bite, _)| bite > SLACK_MM);
        leg.stretches.iter().any(|(from, to, _)| bites(from) || bites(to))
    }

    /// The first place where a leg goes into the board, but for where `is_open` says that it is meant to.
    fn first_bite(&self, leg: &Deep<'_>, is_open: impl Fn(Spot, f64) -> bool, asked: &Asked) -> Option<Spot> {
        let half = leg.bit.diameter.mm() / 2.0;
        let on_line = asked.cut_out.is_none_or(|edge| edge.on_line);
        let bites = |spot: &Spot| {
            let bite = self.bite(*spot, half).filter(|(bite, _)| *bite > SLACK_MM);
            let meant = |off: f64| (on_line && off <= ON_LINE_MM) || is_open(*spot, half);
            bite.is_some_and(|(_, off)| !meant(off))
        };
        let deep = leg.stretches.iter().filter(|(.., depth)| *depth * 2 >= asked.thickness);
        let mut places = deep.flat_map(|(from, to, _)| [along(&[*from, *to], STEP_MM), vec![*to]].concat());
        places.find(|spot| bites(spot))
    }
}
