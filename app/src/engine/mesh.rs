//! Cuts regions into triangles for the display; the copper of a board as display layers.
//!
//! ```text
//!  island with holes, arcs ─ chords ─▶ rings ─ ear cutting ─▶ corners in mm from `origin`, triangles
//!                                        └──────────────────▶ first corner and length of each ring
//! ```

use super::messages::LayerRow;
use crate::picture::{origin, place};
use crate::view::Mesh;
use annulus_core::artwork::{Role, Side};
use annulus_core::board::{Board, Copper, Face};
use annulus_core::geometry::{Bounds, Path, Point, Region};
use geo::{LineString, Polygon, TriangulateEarcut};

/// Deviation of a chord from its arc, in mm. At a zoom where this is a pixel, a board of 100 mm is 50,000
/// wide.
const CHORD_ERROR_MM: f64 = 0.002;
/// Beyond this many corners, further islands are not displayed; nothing else changes.
const MOST_CORNERS: usize = 8_000_000;

pub(super) fn mesh(region: &Region, origin: Point) -> Mesh {
    let mut mesh = Mesh::default();
    for island in &region.islands {
        let holes = island.holes.iter().map(|hole| ring(hole, origin)).collect();
        let area = Polygon::new(ring(&island.outer, origin), holes);
        let cut = area.earcut_triangles_raw();
        let first = mesh.corners_mm.len();
        if first + cut.vertices.len() > MOST_CORNERS {
            break;
        }
        mesh.corners_mm.extend(cut.vertices.iter().map(|at| at.map(|mm| mm as f32)));
        let corner = |index: usize| (first + index) as u32;
        // The corners are stored ring by ring, without the closing one.
        let mut begin = 0;
        for ring in std::iter::once(area.exterior()).chain(area.interiors()) {
            let count = ring.0.len().saturating_sub(1);
            mesh.rings.push([corner(begin), count as u32]);
            begin += count;
        }
        let triangles = cut.triangle_indices.chunks_exact(3);
        mesh.triangles.extend(triangles.map(|three| [corner(three[0]), corner(three[1]), corner(three[2])]));
    }
    mesh
}

fn ring(path: &Path, origin: Point) -> LineString<f64> {
    let points = path.flattened(CHORD_ERROR_MM);
    points.into_iter().map(|at| place(origin, at).map(f64::from)).collect::<Vec<_>>().into()
}

/// The copper of a board: one layer per side, the lower side first.
pub(super) fn layers(board: &Board, body: Option<Bounds>) -> Vec<LayerRow> {
    let origin = origin(body);
    let row = |copper: &Copper| LayerRow {
        file: None,
        role: Role::Copper,
        side: Some(side(copper.face)),
        islands: copper.region.islands.len() as u32,
        mesh: mesh(&copper.region, origin),
    };
    let mut sides: Vec<&Copper> = board.copper.iter().collect();
    sides.sort_by_key(|copper| std::cmp::Reverse(copper.face));
    sides.into_iter().map(row).collect()
}

fn side(face: Face) -> Side {
    match face {
        Face::Top => Side::Top,
        Face::Bottom => Side::Bottom,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::geometry::{Island, PathSegment};
    use std::f64::consts::PI;

    fn circle(x: f64, y: f64, radius: f64, clockwise: bool) -> Path {
        let (start, centre) = (Point::from_mm(x + radius, y), Point::from_mm(x, y));
        Path { start, segments: vec![PathSegment::Arc { to: start, centre, clockwise }] }
    }

    fn square(side: f64) -> Path {
        let corners = [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side), (0.0, 0.0)];
        Path::through(&corners.map(|(x, y)| Point::from_mm(x, y))).unwrap()
    }

    fn area(mesh: &Mesh) -> f64 {
        let at = |index: u32| mesh.corners_mm[index as usize].map(f64::from);
        let half = |[a, b, c]: [u32; 3]| {
            let (a, b, c) = (at(a), at(b), at(c));
            ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])).abs() / 2.0
        };
        mesh.triangles.iter().copied().map(half).sum()
    }

    #[test]
    fn triangles_cover_the_area_of_their_region() {
        let pour = Island {
            outer: square(20.0),
            holes: vec![circle(5.0, 5.0, 2.0, true), circle(14.0, 14.0, 3.0, true)],
        };
        let pad = Island { outer: circle(14.0, 14.0, 1.0, false), holes: vec![] };
        type Row = (&'static str, Vec<Island>, f64);
        let rows: [Row; 4] = [
            ("nothing", vec![], 0.0),
            ("a pad", vec![pad.clone()], PI),
            ("a pour with holes", vec![pour.clone()], 400.0 - 13.0 * PI),
            ("a pad in a hole of a pour", vec![pour, pad], 400.0 - 12.0 * PI),
        ];
        for (name, islands, expected) in rows {
            let region = Region { islands };
            for origin in [Point::default(), Point::from_mm(-300.0, 120.0)] {
                let found = area(&mesh(&region, origin));
                assert!((found - expected).abs() < 0.2, "{name}: {found} is not {expected}");
                // The signed area within the rings is the same, because holes run the other way.
                let mesh = mesh(&region, origin);
                let corner = |index: u32| mesh.corners_mm[index as usize].map(f64::from);
                let across = |[a, b]: [u32; 2]| {
                    let (a, b) = (corner(a), corner(b));
                    (a[0] * b[1] - b[0] * a[1]) / 2.0
                };
                let round: f64 = mesh.edges().map(across).sum();
                assert!((round - found).abs() < 0.05, "{name}: {round} within the edges, {found} filled");
            }
        }
    }
}
