//! A layer of copper for measuring: pads on a 2 mm grid, each with a crooked track.
//!
//! Comes in: nothing, the layer is always the same. Goes out: outlines. Knows no clock.

use annulus_core::chance::Chance;
use annulus_core::geometry::{Path, Point, circle, stroke};
use annulus_core::units::Length;

/// Rows and columns of pads: 1,122 islands.
const GRID: (u32, u32) = (34, 33);

/// The outlines of 1,122 pads with a track of five pieces each.
pub fn outlines() -> Vec<Path> {
    let mut chance = Chance::new(7);
    let mut outlines = Vec::new();
    for pad in 0..GRID.0 * GRID.1 {
        let (x, y) = (f64::from(pad % GRID.0) * 2.0, f64::from(pad / GRID.0) * 2.0);
        outlines.push(circle(Point::from_mm(x, y), Length::from_mm(1.0 + 0.3 * chance.unit())));
        let bends = (0..6).map(|bend| {
            let along = f64::from(bend);
            Point::from_mm(x + 0.2 * along * chance.unit(), y + 0.25 * along)
        });
        let track = Path::through(&bends.collect::<Vec<_>>()).unwrap_or_default();
        outlines.extend(stroke(&track, Length::from_mm(0.25)));
    }
    outlines
}
