//! Rounded corners with overlong lines or arcs: several lengths, radii and angles.

use super::outline::Stroke;
use super::trace::trace;
use crate::geometry::{PathSegment, Point, path_area_mm2};
use crate::units::Length;
use std::f64::consts::PI;

/// A rectangle of 40 × 28 mm with rounded corners, rotated by `turn` rad. Its lines run past the arcs by
/// `line` mm, its arcs past the lines by `arc` mm.
fn rounded(radius: f64, line: f64, arc: f64, turn: f64, step_mm: f64) -> Vec<(Stroke, Length)> {
    let (sin, cos) = turn.sin_cos();
    let round = |value: f64| (value / step_mm).round() * step_mm;
    let at = |x: f64, y: f64| Point::from_mm(round(x * cos - y * sin), round(x * sin + y * cos));
    let (left, right, low, high) = (radius, 40.0 - radius, radius, 28.0 - radius);
    let lines = [
        [(left - line, 0.0), (right + line, 0.0)],
        [(40.0, low - line), (40.0, high + line)],
        [(right + line, 28.0), (left - line, 28.0)],
        [(0.0, high + line), (0.0, low - line)],
    ];
    let mut strokes: Vec<Stroke> =
        lines.map(|[a, b]| (at(a.0, a.1), PathSegment::Line { to: at(b.0, b.1) })).to_vec();
    let past = arc / radius;
    for (x, y, from) in [(right, low, 1.5), (right, high, 0.0), (left, high, 0.5), (left, low, 1.0)] {
        let on = |angle: f64| at(x + radius * libm::cos(angle), y + radius * libm::sin(angle));
        let (from, to) = (on(from * PI - past), on((from + 0.5) * PI + past));
        strokes.push((from, PathSegment::Arc { to, centre: at(x, y), clockwise: false }));
    }
    strokes.into_iter().map(|stroke| (stroke, Length::from_um(150))).collect()
}

#[test]
fn overlong_ends_at_rounded_corners_are_trimmed() {
    let lengths = [0.0, 0.004, 0.01, 0.012, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.45];
    for radius in [0.5, 1.0, 3.0, 8.0] {
        // Longer lines nearly meet in a sharp corner, which is then a second edge.
        for length in lengths.into_iter().filter(|length| *length < 0.7 * radius) {
            for (turn, step) in [(0.0, 1e-4), (0.0, 2.54e-3), (0.23, 1e-4), (0.7, 1e-6), (1.0, 1e-3)] {
                for (line, arc) in [(length, 0.0), (0.0, length), (length, length)] {
                    let row = format!("r {radius}, line +{line}, arc +{arc}, turn {turn}, step {step}");
                    let traced = trace(&rounded(radius, line, arc, turn, step), Vec::new(), &|_| false);
                    assert_eq!(traced.open.len(), 0, "{row}: {:?}", traced.open);
                    assert_eq!(traced.pieces.len(), 1, "{row}");
                    let area = path_area_mm2(&traced.pieces[0].rim).abs();
                    let whole = 40.0 * 28.0 - (4.0 - PI) * radius * radius;
                    assert!((area - whole).abs() < 1.0, "{row}: {area} of {whole}");
                    // Up to 15 µm, rounding decides whether an end is trimmed or joined.
                    let is_certain = length == 0.0 || length > 0.015;
                    assert!(!is_certain || traced.trimmed.is_empty() == (length == 0.0), "{row}");
                }
            }
        }
    }
}
