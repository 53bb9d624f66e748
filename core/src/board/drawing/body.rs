//! Simplified shape of an element, for hit tests, distances and display.
//!
//! ```text
//!  circle: one point       track: two points       square, octagon: a ring of points
//!      (●)  radius           (●═══════●) radius         ▢  no radius
//! ```

use super::{Drawing, Entry, PadShape, Thing};
use crate::geometry::{Bounds, Path, PathSegment, Placement, Point, circle, stroke};
use crate::units::Length;
use std::f64::consts::PI;

/// All points within `radius` of the lines through `points`; if closed, also the area inside.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Body {
    /// At least one point.
    pub points: Vec<Point>,
    /// The last point connects to the first; the inside belongs to the body.
    pub closed: bool,
    pub radius: Length,
}

impl Body {
    pub fn disc(at: Point, diameter: Length) -> Self {
        Self { points: vec![at], closed: false, radius: Length::from_nm(diameter.nm() / 2) }
    }

    /// The body of an element; `None` for groups and imported objects.
    pub fn of(drawing: &Drawing, entry: &Entry) -> Option<Self> {
        Some(match &entry.thing {
            Thing::Node { at } => Self::disc(*at, Length::ZERO),
            Thing::Track { from, to, width, .. } => Self {
                points: vec![drawing.at(*from)?, drawing.at(*to)?],
                closed: false,
                radius: Length::from_nm(width.nm() / 2),
            },
            Thing::Pad { node, shape, size, turn_mdeg, .. } => {
                let at = drawing.at(*node)?;
                match corners(*shape, *size, *turn_mdeg) {
                    None => Self::disc(at, *size),
                    Some(corners) => {
                        let points = corners.into_iter().map(|corner| shifted(corner, at)).collect();
                        Self { points, closed: true, radius: Length::ZERO }
                    }
                }
            }
            Thing::Hole { node, diameter, .. } => Self::disc(drawing.at(*node)?, *diameter),
            Thing::Group { .. } | Thing::Imported { .. } => return None,
        })
    }

    #[must_use]
    pub fn moved(mut self, by: Point) -> Self {
        self.points.iter_mut().for_each(|point| *point = shifted(*point, by));
        self
    }

    #[must_use]
    pub fn placed(mut self, placement: Placement, about: Point) -> Self {
        self.points.iter_mut().for_each(|point| *point = placed_about(*point, placement, about));
        if placement.mirror && self.closed {
            self.points.reverse();
        }
        self
    }

    pub fn bounds(&self) -> Bounds {
        let around = Bounds::around(self.points.iter().copied());
        around.unwrap_or(Bounds::of(Point::default())).grown(self.radius)
    }

    pub fn outline(&self) -> Vec<Path> {
        let Some((first, rest)) = self.points.split_first() else { return Vec::new() };
        if rest.is_empty() {
            return vec![circle(*first, self.radius * 2)];
        }
        let mut segments: Vec<PathSegment> = rest.iter().map(|to| PathSegment::Line { to: *to }).collect();
        if self.closed {
            segments.push(PathSegment::Line { to: *first });
            return vec![Path { start: *first, segments }];
        }
        stroke(&Path { start: *first, segments }, self.radius * 2)
    }

    /// Distance of `at`, in mm; 0 inside.
    pub fn distance_mm(&self, at: Point) -> f64 {
        let at = spot(at);
        if self.closed && self.encloses(at) {
            return 0.0;
        }
        let nearest = self.lines().map(|(a, b)| from_line(at, a, b)).fold(f64::INFINITY, f64::min);
        (nearest - self.radius.mm()).max(0.0)
    }

    /// Distance of two bodies, in mm; 0 or less if they touch.
    pub fn gap_mm(&self, other: &Self) -> f64 {
        let first = |body: &Self| body.points.first().map(|point| spot(*point));
        let inside = |outer: &Self, inner: &Self| {
            outer.closed && first(inner).is_some_and(|point| outer.encloses(point))
        };
        if inside(self, other) || inside(other, self) {
            return 0.0;
        }
        let mut nearest = f64::INFINITY;
        for (a, b) in self.lines() {
            for (c, d) in other.lines() {
                nearest = nearest.min(between_lines((a, b), (c, d)));
            }
        }
        nearest - self.radius.mm() - other.radius.mm()
    }

    pub(super) fn depth_mm(&self, at: Point) -> f64 {
        let at = spot(at);
        let nearest = self.lines().map(|(a, b)| from_line(at, a, b)).fold(f64::INFINITY, f64::min);
        if self.closed { nearest + self.radius.mm() } else { self.radius.mm() - nearest }
    }

    /// Its lines in mm; a point is a line of zero length.
    fn lines(&self) -> impl Iterator<Item = (Spot, Spot)> + '_ {
        let count = self.points.len();
        let lines = if self.closed || count == 1 { count } else { count.saturating_sub(1) };
        (0..lines).filter_map(move |at| {
            let (a, b) = (self.points.get(at)?, self.points.get((at + 1) % count)?);
            Some((spot(*a), spot(*b)))
        })
    }

    fn encloses(&self, (x, y): Spot) -> bool {
        let crossings = self
            .lines()
            .filter(|(a, b)| (a.1 > y) != (b.1 > y) && x < a.0 + (y - a.1) / (b.1 - a.1) * (b.0 - a.0));
        crossings.count() % 2 == 1
    }
}

/// A position in mm.
type Spot = (f64, f64);

fn spot(point: Point) -> Spot {
    (point.x.mm(), point.y.mm())
}

pub(super) fn shifted(point: Point, by: Point) -> Point {
    Point::new(point.x + by.x, point.y + by.y)
}

pub(super) fn placed_about(at: Point, placement: Placement, about: Point) -> Point {
    shifted(placement.point(shifted(at, Point::new(-about.x, -about.y))), about)
}

pub(super) fn path_about(path: &Path, placement: Placement, about: Point) -> Path {
    let home = Placement::shifted(Point::new(-about.x, -about.y)).path(path);
    Placement::shifted(about).path(&placement.path(&home))
}

fn from_line((x, y): Spot, a: Spot, b: Spot) -> f64 {
    let along = (b.0 - a.0, b.1 - a.1);
    let length = along.0 * along.0 + along.1 * along.1;
    let share = if length > 0.0 { ((x - a.0) * along.0 + (y - a.1) * along.1) / length } else { 0.0 };
    let share = share.clamp(0.0, 1.0);
    let (dx, dy) = (x - a.0 - share * along.0, y - a.1 - share * along.1);
    libm::sqrt(dx * dx + dy * dy)
}

/// Distance of two line segments; 0 if they cross.
fn between_lines((a, b): (Spot, Spot), (c, d): (Spot, Spot)) -> f64 {
    let side = |p: Spot, q: Spot, r: Spot| (q.0 - p.0) * (r.1 - p.1) - (q.1 - p.1) * (r.0 - p.0);
    if side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0 {
        return 0.0;
    }
    let ends = [from_line(a, c, d), from_line(b, c, d), from_line(c, a, b), from_line(d, a, b)];
    ends.into_iter().fold(f64::INFINITY, f64::min)
}

/// Corners of a pad about the origin, counter-clockwise; `None` for a round pad.
pub(super) fn corners(shape: PadShape, size: Length, turn_mdeg: i32) -> Option<Vec<Point>> {
    let half = size.nm() / 2;
    let short = libm::round(half as f64 * libm::tan(PI / 8.0)) as i64;
    let quarter: &[(i64, i64)] = match shape {
        PadShape::Circle => return None,
        PadShape::Square => &[(half, half)],
        PadShape::Octagon => &[(half, short), (short, half)],
    };
    let turned = |quarters: i32| Placement { rotation_mdeg: quarters * 90_000, ..Placement::default() };
    let point = |(x, y): (i64, i64)| Point::new(Length::from_nm(x), Length::from_nm(y));
    let placement = Placement { rotation_mdeg: turn_mdeg, ..Placement::default() };
    let all =
        (0..4).flat_map(|quarters| quarter.iter().map(move |corner| turned(quarters).point(point(*corner))));
    Some(all.map(|corner| placement.point(corner)).collect())
}
