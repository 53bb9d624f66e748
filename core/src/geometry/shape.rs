//! Shapes bounded by lines and true arcs, at rest in whole nanometres.
//!
//! ```text
//!  Path     start ─ segment ─ segment ─ …          open, or closed where the last segment ends at the start
//!  Island   one outer path, counter-clockwise, and holes in it, clockwise
//!  Region   islands that do not overlap; an island may lie in a hole of another
//!
//!      ┌───────────────┐
//!      │  ╭───╮        │      inside is on the left of every path, of outer ones and of holes
//!      │  │ ○ │  ╭─╮   │
//!      │  ╰───╯  ╰─╯   │
//!      └───────────────┘
//! ```
//!
//! Comes in: points. Goes out: paths and regions as plain data. Does not know boards, layers or tools.

use super::{Bounds, Point, chords, measure};
use serde::{Deserialize, Serialize};

/// One piece of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum PathSegment {
    /// Straight to a point.
    Line {
        /// Where it ends.
        to: Point,
    },
    /// Along a circle to a point; a full circle where it ends where it starts.
    Arc {
        /// Where it ends.
        to: Point,
        /// Middle of the circle.
        centre: Point,
        /// Sense of turning, seen from above.
        clockwise: bool,
    },
}

impl PathSegment {
    /// Where it ends.
    pub const fn to(self) -> Point {
        match self {
            Self::Line { to } | Self::Arc { to, .. } => to,
        }
    }
}

/// A chain of segments.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Path {
    /// Where it starts.
    pub start: Point,
    /// Its pieces, in order.
    pub segments: Vec<PathSegment>,
}

impl Path {
    /// The path along straight lines through `points`; none for no points.
    pub fn through(points: &[Point]) -> Option<Self> {
        let (&start, rest) = points.split_first()?;
        Some(Self { start, segments: rest.iter().map(|&to| PathSegment::Line { to }).collect() })
    }

    /// Where it ends.
    pub fn end(&self) -> Point {
        self.segments.last().map_or(self.start, |last| last.to())
    }

    /// Whether it ends where it starts, and goes somewhere between.
    pub fn is_closed(&self) -> bool {
        !self.segments.is_empty() && self.end() == self.start
    }

    /// Its corners: the start and the end of every segment.
    pub fn corners(&self) -> impl Iterator<Item = Point> {
        std::iter::once(self.start).chain(self.segments.iter().map(|segment| segment.to()))
    }

    /// Its segments, each with the place where it starts.
    pub fn pieces(&self) -> impl Iterator<Item = (Point, PathSegment)> {
        self.corners().zip(self.segments.iter().copied())
    }

    /// The same way back.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let back = |(from, segment): (Point, PathSegment)| match segment {
            PathSegment::Line { .. } => PathSegment::Line { to: from },
            PathSegment::Arc { centre, clockwise, .. } => {
                PathSegment::Arc { to: from, centre, clockwise: !clockwise }
            }
        };
        let mut segments: Vec<PathSegment> = self.pieces().map(back).collect();
        segments.reverse();
        Self { start: self.end(), segments }
    }

    /// A closed path, started at its leftmost, then lowest corner. An open one stays as it is.
    #[must_use]
    pub fn from_its_left(&self) -> Self {
        let first = self.corners().take(self.segments.len()).enumerate().min_by_key(|(_, corner)| *corner);
        match first {
            Some((first, start)) if self.is_closed() => {
                let mut segments = self.segments.clone();
                segments.rotate_left(first);
                Self { start, segments }
            }
            _ => self.clone(),
        }
    }

    /// The points of the path with arcs cut into chords that are at most `error_mm` off.
    pub fn flattened(&self, error_mm: f64) -> Vec<Point> {
        let mut points = vec![self.start];
        for (from, segment) in self.pieces() {
            match segment {
                PathSegment::Line { to } => points.push(to),
                PathSegment::Arc { to, centre, clockwise } => {
                    points.extend(chords::arc(from, to, centre, clockwise, error_mm));
                }
            }
        }
        points
    }

    /// Length along it in mm.
    pub fn length_mm(&self) -> f64 {
        let length = |(from, segment): (Point, PathSegment)| match segment {
            PathSegment::Line { to } => from.distance_mm(to),
            PathSegment::Arc { to, centre, clockwise } => {
                from.distance_mm(centre) * chords::turn(from, to, centre, clockwise)
            }
        };
        self.pieces().map(length).sum()
    }
}

/// A connected piece: what is inside `outer` and in none of `holes`.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Island {
    /// Its edge, closed and counter-clockwise.
    pub outer: Path,
    /// The edges of what is missing in it, closed and clockwise.
    pub holes: Vec<Path>,
}

impl Island {
    /// All its edges: the outer one first.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        std::iter::once(&self.outer).chain(&self.holes)
    }
}

/// An area of the plane.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Region {
    /// Its pieces. They do not overlap.
    pub islands: Vec<Island>,
}

impl Region {
    /// All edges of all islands.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        self.islands.iter().flat_map(Island::paths)
    }

    /// Whether there is nothing in it.
    pub fn is_empty(&self) -> bool {
        self.islands.is_empty()
    }

    /// The box around it, arcs bulging included, to a nanometre; none for nothing.
    pub fn bounds(&self) -> Option<Bounds> {
        let boxes = self.islands.iter().map(|island| measure::path_bounds(&island.outer));
        boxes.reduce(|all, next| all.with(next.min).with(next.max))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn a_path_knows_its_length_and_its_way_back() {
        let (a, b, centre) = (Point::from_mm(0.0, 0.0), Point::from_mm(2.0, 0.0), Point::from_mm(1.0, 0.0));
        let arc = PathSegment::Arc { to: a, centre, clockwise: false };
        let path = Path { start: a, segments: vec![PathSegment::Line { to: b }, arc] };
        assert!(path.is_closed());
        assert!((path.length_mm() - 2.0 - PI).abs() < 1e-12);
        let back = path.reversed();
        assert_eq!(back.segments[0], PathSegment::Arc { to: b, centre, clockwise: true });
        assert!((back.length_mm() - path.length_mm()).abs() < 1e-12);
        assert_eq!(back.reversed(), path);
        let top = path.flattened(1e-4).iter().map(|point| point.y).max().unwrap();
        assert!((top.mm() - 1.0).abs() < 1e-4, "{top:?}");
    }
}
