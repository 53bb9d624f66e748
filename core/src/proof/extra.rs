//! Holes that programs make where the board has none.
//!
//! ```text
//!    ◯ board    ● made beside it: judged with that hole    ┌──●──┐ at the edge: a mouse-bite    ●  extra
//! ```

use super::cut_out::{edge, is_open};
use super::edges::Spot;
use super::sides::{BESIDE_MM, Layer};
use crate::geometry::{Bounds, Point};
use crate::job::Asked;
use crate::units::Length;

/// Holes through the board where it has none. Holes beside a hole of the board are judged with it, and those
/// at the edge may be mouse-bites.
pub(super) fn extra_holes(layer: &Layer<'_>, asked: &Asked) -> Vec<Point> {
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
    // Without an outline, only holes between the drawn features count: pins and panel copies are outside them.
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
