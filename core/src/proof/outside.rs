//! Programs with all their cuts outside the board: another zero, or another board.
//!
//! ```text
//!    ┌───────┐             ╭─────╮
//!    │ board │◀───────────▶│ cut │     the shortest distance is reported, with its position
//!    └───────┘             ╰─────╯
//! ```

use super::body::{STEP_MM, along};
use super::edges::{Edges, Spot, spots};
use super::extra::drawn_bounds;
use super::replay::replay;
use super::sides::{Layer, SideRun};
use crate::board::COPPER_THICKNESS;
use crate::geometry::{Island, Point, Region, rectangle};
use crate::units::Length;

/// A cut nearer than this, in mm, may follow the edge of the board.
const LEAST_MM: f64 = 0.1;
/// Cuts farther away than this, in mm, are not measured.
const FARTHEST_MM: f64 = 10_000.0;

/// The cut nearest to the board and its distance from it, if all cuts are outside.
pub(super) fn outside(sides: &[SideRun<'_>], layers: &[Layer<'_>]) -> Option<(Point, Length)> {
    let mut nearest: Option<(f64, Spot)> = None;
    for (side, layer) in sides.iter().zip(layers) {
        let body = Edges::of(&body(layer)?);
        let replays =
            (0..).zip(side.programs).map(|(index, program)| replay(program, index, COPPER_THICKNESS));
        let cuts = replays.flat_map(|replayed| replayed.cuts);
        for cut in cuts.filter(|cut| cut.depth > Length::ZERO || cut.through.is_some()) {
            let (half, path) = (cut.surface.mm() / 2.0, spots(&cut.path));
            for spot in along(&path, STEP_MM).into_iter().chain(path.iter().copied()) {
                if body.island_at(spot).is_some() {
                    return None;
                }
                let reach = nearest.map_or(FARTHEST_MM, |(gap, _)| gap + half);
                let Some((off, ..)) = body.nearest(spot, reach, &|_| true) else { continue };
                if off - half < LEAST_MM {
                    return None;
                }
                if nearest.is_none_or(|(gap, _)| off - half < gap) {
                    nearest = Some((off - half, spot));
                }
            }
        }
    }
    nearest.map(|(gap, spot)| (spot.point(), Length::from_mm(gap)))
}

/// The board without its cut-outs; without an outline, the box around everything drawn.
fn body(layer: &Layer<'_>) -> Option<Region> {
    let body = layer.board.body();
    if !body.is_empty() {
        return Some(body);
    }
    let outer = rectangle(drawn_bounds(layer)?.grown(Length::from_mm(LEAST_MM)));
    Some(Region { islands: vec![Island { outer, holes: Vec::new() }] })
}
