//! Holes that programs make where the board has none.
//!
//! ```text
//!    ◯● next to a hole: extra     ┌─●─●─●─┐ a row across the edge: mouse-bites      ● extra
//! ```

use super::body::SLACK_MM;
use super::cut_out::is_open;
use super::deep::{Round, Swept};
use super::edges::Spot;
use super::sides::Layer;
use crate::geometry::{Bounds, Point};
use crate::job::{Asked, Cutter};
use std::collections::BTreeSet;

/// Mouse-bites form a row: each has this many others within this distance, in mm.
const ROW: (usize, f64) = (2, 3.0);
/// Sizes and positions within this, in mm, are equal.
const EQUAL_MM: f64 = 0.05;

/// Holes at least half through the board where it has none. `judged`: numbers of the legs that make its
/// holes.
pub(super) fn extra_holes(layer: &Layer<'_>, judged: &BTreeSet<usize>, asked: &Asked) -> Vec<Point> {
    let board = layer.board;
    // A board without any hole was read without its drill file.
    if board.holes.is_empty() && board.slots.is_empty() {
        return Vec::new();
    }
    // Without an outline, only holes between the drawn features count: pins and panel copies are outside them.
    let drawn = layer.body.is_unknown().then(|| drawn_bounds(layer)).flatten();
    let cuts_board = |round: &Round| match drawn {
        Some(bounds) => bounds.contains(round.at),
        None => bite(layer, round).is_none_or(|(bite, _)| bite > SLACK_MM),
    };
    let legs = layer.legs.iter().enumerate().filter(|(number, _)| !judged.contains(number));
    let through = legs.filter(|(_, leg)| leg.lowest * 2 >= asked.thickness);
    let rounds = through.filter_map(|(_, leg)| leg.round);
    let rounds = rounds.filter(|round| round.stroke || layer.body.is_unknown());
    let extra: Vec<Round> = rounds
        .filter(|round| {
            cuts_board(round)
                && !is_open(board, asked, Spot::of(round.at), round.wide_mm / 2.0)
                && !is_mouse_bite(layer, asked, round)
        })
        .collect();
    if extra.is_empty() {
        return Vec::new();
    }
    // A hole where a mill cuts as well, for example at its entry, removes nothing more.
    let mills = layer.legs.iter().filter(|leg| leg.bit.cutter == Cutter::Mill);
    let milled = Swept::of(mills.filter(|leg| !leg.round.is_some_and(|round| round.stroke)));
    let is_milled =
        |round: &Round| milled.cover(Spot::of(round.at), SLACK_MM - round.wide_mm / 2.0, asked.thickness);
    extra.iter().filter(|round| !is_milled(round)).map(|round| round.at).collect()
}

/// How far a hole reaches into the board, and the distance of its centre from the edge, in mm.
fn bite(layer: &Layer<'_>, round: &Round) -> Option<(f64, f64)> {
    layer.body.bite(Spot::of(round.at), round.wide_mm / 2.0)
}

/// True for a mouse-bite. With a job: a hole on the edge, if the job has mouse-bites. Without a job: a hole
/// in a row across the edge.
fn is_mouse_bite(layer: &Layer<'_>, asked: &Asked, round: &Round) -> bool {
    let Some((_, off)) = bite(layer, round) else { return false };
    match asked.cut_out {
        // Holes are on the edge, or half a tool's width from it if two boards share the edge.
        Some(edge) => {
            edge.bites && [0.0, edge.bit.mm() / 2.0].iter().any(|mm| libm::fabs(off - mm) <= SLACK_MM)
        }
        None => asked.holes.is_none() && off <= round.wide_mm / 2.0 && is_in_row(layer, round),
    }
}

/// True if enough holes of one size are near each other across the edge.
fn is_in_row(layer: &Layer<'_>, round: &Round) -> bool {
    let (least, reach_mm) = ROW;
    let first = layer.by_x.partition_point(|(x, _)| (round.at.x - *x).mm() > reach_mm);
    let near = layer.by_x.iter().skip(first).take_while(|(x, _)| (*x - round.at.x).mm() <= reach_mm);
    let near = near.filter_map(|(_, number)| layer.legs.get(*number)?.round);
    let others = near.filter(|other| {
        let away_mm = other.at.distance_mm(round.at);
        let is_alike = other.stroke && libm::fabs(other.wide_mm - round.wide_mm) <= EQUAL_MM;
        let is_across = || bite(layer, other).is_some_and(|(_, off)| off <= other.wide_mm / 2.0);
        is_alike && away_mm > EQUAL_MM && away_mm <= reach_mm && is_across()
    });
    others.take(least).count() == least
}

/// The bounds of everything that is drawn of a board, without its pins.
pub(super) fn drawn_bounds(layer: &Layer<'_>) -> Option<Bounds> {
    let board = layer.board;
    let copper = board.copper.iter().filter_map(|copper| copper.region.bounds());
    let holes = (0..).zip(&board.holes).filter(|(number, _)| !layer.pins.contains(number));
    let points = holes.map(|(_, hole)| hole.at);
    let points = points.chain(board.slots.iter().flat_map(|slot| slot.path.iter().copied()));
    let of_points = points.map(|at| Bounds { min: at, max: at });
    copper.chain(of_points).reduce(|a, b| a.with(b.min).with(b.max))
}
