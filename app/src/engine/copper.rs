//! The copper of a board as display layers.

use super::mesh::mesh;
use super::messages::LayerRow;
use crate::picture;
use annulus_core::artwork::{Role, Side};
use annulus_core::board;
use annulus_core::geometry::Bounds;

/// One layer per side, the lower side first.
pub(super) fn layers(board: &board::Board, body: Option<Bounds>) -> Vec<LayerRow> {
    let origin = picture::origin(body);
    let row = |copper: &board::Copper| LayerRow {
        file: None,
        role: Role::Copper,
        side: Some(side(copper.face)),
        islands: copper.region.islands.len() as u32,
        mesh: mesh(&copper.region, origin),
    };
    let mut sides: Vec<&board::Copper> = board.copper.iter().collect();
    sides.sort_by_key(|copper| std::cmp::Reverse(copper.face));
    sides.into_iter().map(row).collect()
}

fn side(face: board::Face) -> Side {
    match face {
        board::Face::Top => Side::Top,
        board::Face::Bottom => Side::Bottom,
    }
}
