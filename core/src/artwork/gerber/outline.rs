//! Closed contours from the centre lines of an outline layer.
//!
//! Comes in: tracks. Goes out: polygons, or nothing where the lines do not close. Does not paint.

use super::Track;
use crate::geometry::Point;
use crate::units::Length;
use std::collections::BTreeMap;

/// Ends this close belong together.
const JOIN: Length = Length::from_um(10);
/// Contours of more strokes than this are left alone.
const MOST_TRACKS: usize = 20_000;

/// The closed polygons that the tracks make. Empty if any end is left over or meets more than one other.
pub fn contour(tracks: &[Track]) -> Vec<Vec<Point>> {
    let mut rows: Vec<(Point, Point)> =
        tracks.iter().map(|track| (track.from, track.to)).filter(|(a, b)| !near(*a, *b)).collect();
    rows.sort_unstable_by_key(|&(a, b)| (a.min(b), a.max(b)));
    rows.dedup_by_key(|&mut (a, b)| (a.min(b), a.max(b)));
    if rows.is_empty() || rows.len() > MOST_TRACKS {
        return Vec::new();
    }
    let mut ends: BTreeMap<(i64, i64), Vec<(usize, bool)>> = BTreeMap::new();
    for (index, &(from, to)) in rows.iter().enumerate() {
        ends.entry(cell(from)).or_default().push((index, true));
        ends.entry(cell(to)).or_default().push((index, false));
    }
    let mut used = vec![false; rows.len()];
    let mut polygons = Vec::new();
    for start in 0..rows.len() {
        if used[start] {
            continue;
        }
        match walk(start, &rows, &ends, &mut used) {
            Some(polygon) => polygons.push(polygon),
            None => return Vec::new(),
        }
    }
    polygons
}

fn walk(
    start: usize,
    rows: &[(Point, Point)],
    ends: &BTreeMap<(i64, i64), Vec<(usize, bool)>>,
    used: &mut [bool],
) -> Option<Vec<Point>> {
    let (first, mut at) = rows[start];
    used[start] = true;
    let mut polygon = vec![first];
    while !near(at, first) {
        polygon.push(at);
        let mut meets = around(at).filter_map(|cell| ends.get(&cell)).flatten().filter(|&&(index, from)| {
            let (a, b) = rows[index];
            !used[index] && near(if from { a } else { b }, at)
        });
        let &(next, from) = meets.next()?;
        if meets.next().is_some() {
            return None;
        }
        used[next] = true;
        at = if from { rows[next].1 } else { rows[next].0 };
    }
    (polygon.len() >= 3).then_some(polygon)
}

fn near(a: Point, b: Point) -> bool {
    (a.x - b.x).abs() <= JOIN && (a.y - b.y).abs() <= JOIN
}

fn cell(point: Point) -> (i64, i64) {
    (point.x.nm().div_euclid(JOIN.nm()), point.y.nm().div_euclid(JOIN.nm()))
}

fn around(point: Point) -> impl Iterator<Item = (i64, i64)> {
    let (x, y) = cell(point);
    (-1..=1).flat_map(move |dx| (-1..=1).map(move |dy| (x + dx, y + dy)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(a: (f64, f64), b: (f64, f64)) -> Track {
        let point = |(x, y)| Point::from_mm(x, y);
        Track { from: point(a), to: point(b), half_width: Length::ZERO }
    }

    #[test]
    fn strokes_in_any_order_close() {
        let mut tracks = vec![
            track((0.0, 0.0), (10.0, 0.0)),
            track((10.0, 5.0), (0.0, 5.0)),
            track((10.0, 0.0), (10.0, 5.0)),
            track((0.0, 0.004), (0.0, 5.0)),
        ];
        let polygons = contour(&tracks);
        assert_eq!(polygons.len(), 1);
        assert_eq!(polygons[0].len(), 4);
        tracks.pop();
        assert!(contour(&tracks).is_empty(), "an open line is no outline");
    }
}
