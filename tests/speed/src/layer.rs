//! Layers for benchmarks: pads on a 2 mm grid, each with a bent track; heaps of pads; a dense silkscreen.
//! Deterministic.

use annulus_core::chance::Chance;
use annulus_core::geometry::{Path, Point, circle, stroke};
use annulus_core::units::Length;

/// Rows and columns of pads: 1,122 islands.
const GRID: (u32, u32) = (34, 33);

/// The outlines of 1,122 pads, each with a track of five segments.
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

/// A Gerber file of 5,800 overlapping pads, like a zone drawn with many small strokes.
pub fn heap_of_pads() -> String {
    let mut chance = Chance::new(3);
    let mut text = head("C,0.4");
    for _ in 0..5_800 {
        text += &format!("{}D03*\n", place(20.0 * chance.unit(), 15.0 * chance.unit()));
    }
    text + "M02*\n"
}

/// A Gerber file of 74,000 short connected lines, like letters.
pub fn dense_silkscreen() -> String {
    let mut chance = Chance::new(9);
    let mut text = head("C,0.1");
    let mut lines = 0;
    while lines < 74_000 {
        let (mut x, mut y) = (50.0 * chance.unit(), 40.0 * chance.unit());
        text += &format!("{}D02*\n", place(x, y));
        for _ in 0..6 {
            (x, y) = (x + 0.7 * chance.unit() - 0.3, y + 0.6 * chance.unit() - 0.3);
            text += &format!("{}D01*\n", place(x, y));
            lines += 1;
        }
    }
    text + "M02*\n"
}

fn head(aperture: &str) -> String {
    format!("%FSLAX46Y46*%\n%MOMM*%\n%LPD*%\nG01*\n%ADD10{aperture}*%\nD10*\n")
}

fn place(x_mm: f64, y_mm: f64) -> String {
    format!("X{:.0}Y{:.0}", x_mm * 1e6, y_mm * 1e6)
}
