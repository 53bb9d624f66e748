//! Shapes bounded by lines and true arcs, in whole nanometres.
//!
//! ```text
//!  Path     start ─ segment ─ segment ─ …          open, or closed if the last segment ends at the start
//!  Island   one outer path, counter-clockwise, and holes in it, clockwise
//!  Region   islands that do not overlap; an island may be in a hole of another
//!
//!      ┌───────────────┐
//!      │  ╭───╮        │      inside is on the left of every path, of outer ones and of holes
//!      │  │ ○ │  ╭─╮   │
//!      │  ╰───╯  ╰─╯   │
//!      └───────────────┘
//! ```

use super::{Point, chords};
use serde::{Deserialize, Serialize};

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum PathSegment {
    Line {
        to: Point,
    },
    /// Along a circle to a point; a full circle if start and end are equal.
    Arc {
        to: Point,
        centre: Point,
        /// Direction, seen from above.
        clockwise: bool,
    },
}

impl PathSegment {
    pub const fn to(self) -> Point {
        match self {
            Self::Line { to } | Self::Arc { to, .. } => to,
        }
    }
}

#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Path {
    pub start: Point,
    pub segments: Vec<PathSegment>,
}

impl Path {
    /// Straight lines through `points`; `None` for no points.
    pub fn through(points: &[Point]) -> Option<Self> {
        let (&start, rest) = points.split_first()?;
        Some(Self { start, segments: rest.iter().map(|&to| PathSegment::Line { to }).collect() })
    }

    pub fn end(&self) -> Point {
        self.segments.last().map_or(self.start, |last| last.to())
    }

    /// True if it ends at its start and has segments.
    pub fn is_closed(&self) -> bool {
        !self.segments.is_empty() && self.end() == self.start
    }

    /// The start, and the end of every segment.
    pub fn corners(&self) -> impl Iterator<Item = Point> {
        std::iter::once(self.start).chain(self.segments.iter().map(|segment| segment.to()))
    }

    pub fn pieces(&self) -> impl Iterator<Item = (Point, PathSegment)> {
        self.corners().zip(self.segments.iter().copied())
    }

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

    /// A closed path, rotated to start at its leftmost, then lowest corner. An open path is unchanged.
    #[must_use]
    pub fn from_its_left(mut self) -> Self {
        let first = self.corners().take(self.segments.len()).enumerate().min_by_key(|(_, corner)| *corner);
        if let Some((first, start)) = first.filter(|_| self.is_closed()) {
            self.segments.rotate_left(first);
            self.start = start;
        }
        self
    }

    /// The points of the path with arcs cut into chords with an error of at most `error_mm`.
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

/// A connected piece: inside `outer` and in none of `holes`.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Island {
    /// Closed and counter-clockwise.
    pub outer: Path,
    /// Closed and clockwise.
    pub holes: Vec<Path>,
}

impl Island {
    /// The outer path, then the holes.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        std::iter::once(&self.outer).chain(&self.holes)
    }
}

#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Region {
    /// They do not overlap.
    pub islands: Vec<Island>,
}

impl Region {
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        self.islands.iter().flat_map(Island::paths)
    }

    pub fn is_empty(&self) -> bool {
        self.islands.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn reversed_path_has_the_same_length() {
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
