//! The copper of a board as layers of the picture.
//!
//! Comes in: the board, its box. Goes out: rows with triangles, the lower side first. Knows no files.

use super::mesh::mesh;
use super::messages::LayerRow;
use crate::picture;
use annulus_core::board;
use annulus_core::geometry::Bounds;

/// What is to be seen of the copper, the lower side first.
pub(super) fn layers(board: &board::Board, body: Option<Bounds>) -> Vec<LayerRow> {
    let origin = picture::origin(body);
    let row = |copper: &board::Copper| LayerRow {
        file: None,
        role: "copper".to_owned(),
        side: Some(face_word(copper.face).to_owned()),
        islands: copper.region.islands.len() as u32,
        mesh: mesh(&copper.region, origin),
    };
    let mut sides: Vec<&board::Copper> = board.copper.iter().collect();
    sides.sort_by_key(|copper| std::cmp::Reverse(copper.face));
    sides.into_iter().map(row).collect()
}

fn face_word(face: board::Face) -> &'static str {
    match face {
        board::Face::Top => "top",
        board::Face::Bottom => "bottom",
    }
}
