//! The area inside the outline of a board, and how far a tool cuts into it.

use super::deep::Deep;
use super::edges::{Edges, Spot};
use crate::board::Board;
use crate::job::Asked;

pub(super) const STEP_MM: f64 = 0.25;
pub(super) const SLACK_MM: f64 = 0.05;
/// A path that follows most of the edge within this distance, in mm beyond the tool, is meant for it.
pub(super) const MEANT_MM: f64 = 1.0;
const ON_LINE_MM: f64 = 0.03;
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

pub(super) struct Body {
    /// `None` without an outline.
    edges: Option<Edges>,
}

impl Body {
    pub(super) fn of(board: &Board) -> Self {
        Self { edges: (!board.outline.is_empty()).then(|| Edges::of(&board.outline)) }
    }

    /// How far a tool of this half width cuts into the board at a point, and the point's distance from the
    /// edge, in mm, measured up to [`MEANT_MM`] beyond the tool. `None` without an outline.
    pub(super) fn bite(&self, spot: Spot, half: f64) -> Option<(f64, f64)> {
        let edges = self.edges.as_ref()?;
        let inside = edges.island_at(spot).is_some();
        let off = edges.nearest(spot, half + MEANT_MM, &|_| true).map_or(half + MEANT_MM, |(off, ..)| off);
        Some((if inside { half + off } else { half - off }, off))
    }

    pub(super) fn is_unknown(&self) -> bool {
        self.edges.is_none()
    }

    /// True if a leg cuts into the board; always true without an outline.
    pub(super) fn is_bitten(&self, leg: &Deep<'_>) -> bool {
        let half = leg.bit.diameter.mm() / 2.0;
        let bites = |spot: &Spot| self.bite(*spot, half).is_none_or(|(bite, _)| bite > SLACK_MM);
        leg.stretches.iter().any(|(from, to, _)| bites(from) || bites(to))
    }

    /// The first point where a leg cuts into the board, except where `is_open` allows it.
    pub(super) fn first_bite(
        &self,
        leg: &Deep<'_>,
        is_open: impl Fn(Spot, f64) -> bool,
        asked: &Asked,
    ) -> Option<Spot> {
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
