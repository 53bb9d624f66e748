//! Edges that two boards share: cut once, with the tool centre on the edge.
//!
//! ```text
//!   ┌─────╥─────┐     ║ shared: the tool removes half of its width from each board
//!   │  1  ║  2  │
//!   └─────╨─────┘
//! ```

use super::cut::{Area, parts};
use crate::geometry::{Path, Region, grow, sweep};
use crate::units::Length;

const NEAR: Length = Length::from_um(5);
/// Shared edges end this far from the outside: an edge there is not shared.
const INSIDE: Length = Length::from_um(25);
/// A shared edge is found on both boards: within this distance the second is a repetition.
const SAME: Length = Length::from_um(60);
const LEAST_MM: f64 = 0.1;
const MOST_BOARDS: usize = 500;

pub(super) fn joints(outline: &Region) -> Vec<Path> {
    if !(2..=MOST_BOARDS).contains(&outline.islands.len()) {
        return Vec::new();
    }
    let within = grow(&grow(outline, NEAR), -INSIDE);
    let inside = Area::of(&within);
    let mut found: Vec<Path> = Vec::new();
    for island in &outline.islands {
        let own = island.paths().flat_map(|path| parts(path, &inside, true));
        let known = (!found.is_empty()).then(|| Area::of(&sweep(&found, SAME)));
        let fresh = own.flat_map(|part| match &known {
            Some(known) => parts(&part, known, false),
            None => vec![part],
        });
        let fresh: Vec<Path> = fresh.filter(|part| part.length_mm() >= LEAST_MM).collect();
        found.extend(fresh);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Bounds, Island, Point, rectangle};

    fn board(x: f64, y: f64, width: f64, height: f64) -> Island {
        let low = Point::from_mm(x, y);
        let outer = rectangle(Bounds::of(low).with(Point::from_mm(x + width, y + height)));
        Island { outer, holes: Vec::new() }
    }

    #[test]
    fn shared_edges_are_found_once() {
        let frame = Island {
            holes: vec![board(0.0, 0.0, 10.0, 10.0).outer.reversed()],
            ..board(-5.0, -5.0, 20.0, 20.0)
        };
        for (islands, length_mm) in [
            (vec![board(0.0, 0.0, 10.0, 10.0), board(10.0, 0.0, 5.0, 10.0)], 10.0),
            (vec![board(0.0, 0.0, 10.0, 10.0), board(11.0, 0.0, 5.0, 10.0)], 0.0),
            (vec![board(0.0, 0.0, 10.0, 10.0), board(10.0, 10.0, 5.0, 10.0)], 0.0),
            // A long edge of one board, two short ones of others.
            (
                vec![board(0.0, 0.0, 10.0, 20.0), board(10.0, 0.0, 5.0, 10.0), board(10.0, 10.0, 5.0, 10.0)],
                25.0,
            ),
            (
                vec![
                    board(0.0, 0.0, 10.0, 10.0),
                    board(10.0, 0.0, 10.0, 10.0),
                    board(0.0, 10.0, 10.0, 10.0),
                    board(10.0, 10.0, 10.0, 10.0),
                ],
                40.0,
            ),
            (vec![frame, board(0.0, 0.0, 10.0, 10.0)], 40.0),
        ] {
            let count = islands.len();
            let found: f64 = joints(&Region { islands }).iter().map(Path::length_mm).sum();
            assert!((found - length_mm).abs() < 0.4, "{count} boards: {found} not {length_mm}");
        }
    }
}
