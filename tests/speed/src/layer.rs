//! A layer of copper for measuring: pads on a 2 mm grid, each with a crooked track.
//!
//! Comes in: nothing, the layer is always the same. Goes out: outlines. Knows no clock.

use annulus_core::geometry::{Path, Point, circle, stroke};
use annulus_core::units::Length;

/// Rows and columns of pads: 1,122 islands.
const GRID: (u32, u32) = (34, 33);

/// The outlines of 1,122 pads with a track of five pieces each.
pub fn outlines() -> Vec<Path> {
    let mut seed = 7_u64;
    let mut chance = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((seed >> 33) as f64) / f64::from(1_u32 << 31)
    };
    let mut outlines = Vec::new();
    for pad in 0..GRID.0 * GRID.1 {
        let (x, y) = (f64::from(pad % GRID.0) * 2.0, f64::from(pad / GRID.0) * 2.0);
        outlines.push(circle(Point::from_mm(x, y), Length::from_mm(1.0 + 0.3 * chance())));
        let bends = (0..6).map(|bend| {
            let along = f64::from(bend);
            Point::from_mm(x + 0.2 * along * chance(), y + 0.25 * along)
        });
        let track = Path::through(&bends.collect::<Vec<_>>()).unwrap_or_default();
        outlines.extend(stroke(&track, Length::from_mm(0.25)));
    }
    outlines
}
