//! Which segments of paths come near to a place, found without a copy of the paths.
//!
//! ```text
//!   ┌──────────┐
//!   │┌──┐ ┌─┐  │     A box around each segment, a box around sixteen of these, and so on. What does not meet a large box
//!   ││/\│ │╲│  │     meets none of the small ones in it.
//!   │└──┘ └─┘  │
//!   └──────────┘
//! ```
//!
//! Takes 25 bytes for each segment.

use super::clusters::{Extent, NOTHING};
use super::{Bounds, Path, PathSegment, Point, segment_bounds};
use crate::units::Length;

const EACH: usize = 16;

/// The number of a path, and the number of a segment in it.
type Number = (u32, u32);

pub struct Segments<'a> {
    paths: &'a [Path],
    numbers: Vec<Number>,
    /// The boxes of the segments, then the boxes of [`EACH`] of these, up to at most [`EACH`] boxes.
    levels: Vec<Vec<Extent>>,
}

fn extent(bounds: Bounds) -> Extent {
    let held = |length: Length| length.nm().clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32;
    [bounds.min.x, bounds.min.y, bounds.max.x, bounds.max.y].map(held)
}

fn meets([left, low, right, high]: Extent, other: Extent) -> bool {
    left <= other[2] && other[0] <= right && low <= other[3] && other[1] <= high
}

fn around(boxes: &[Extent]) -> Extent {
    boxes.iter().fold(NOTHING, |all, own| {
        [all[0].min(own[0]), all[1].min(own[1]), all[2].max(own[2]), all[3].max(own[3])]
    })
}

fn middle([left, low, right, high]: Extent) -> [i64; 2] {
    [(left, right), (low, high)].map(|(from, to)| i64::from(from) + i64::from(to))
}

impl<'a> Segments<'a> {
    pub fn of(paths: &'a [Path]) -> Self {
        let mut boxed: Vec<(Extent, Number)> =
            Vec::with_capacity(paths.iter().map(|path| path.segments.len()).sum());
        for (number, path) in (0..).zip(paths) {
            let pieces = (0..).zip(path.pieces());
            boxed
                .extend(pieces.map(|(segment, (from, piece))| {
                    (extent(segment_bounds(from, piece)), (number, segment))
                }));
        }
        let strips = boxed.len().div_ceil(EACH).isqrt() + 1;
        boxed.sort_unstable_by_key(|(own, number)| (middle(*own)[0], *number));
        for strip in boxed.chunks_mut(strips * EACH) {
            strip.sort_unstable_by_key(|(own, number)| (middle(*own)[1], *number));
        }
        let (mut level, numbers): (Vec<Extent>, Vec<Number>) = boxed.into_iter().unzip();
        let mut levels = Vec::new();
        while level.len() > EACH {
            let next = level.chunks(EACH).map(around).collect();
            levels.push(std::mem::replace(&mut level, next));
        }
        levels.push(level);
        Self { paths, numbers, levels }
    }

    /// The segments whose boxes meet `bounds`, in order: each with the number of its path, its own there, and its start.
    pub fn meeting(&self, bounds: Bounds) -> impl Iterator<Item = (u32, u32, Point, PathSegment)> {
        let room = extent(bounds);
        let mut met = vec![0];
        for level in self.levels.iter().rev() {
            let below = met.into_iter().flat_map(|at| at * EACH..(at + 1) * EACH);
            met = below.filter(|at| level.get(*at).is_some_and(|own| meets(*own, room))).collect();
        }
        let mut found: Vec<Number> = met.into_iter().filter_map(|at| self.numbers.get(at).copied()).collect();
        found.sort_unstable();
        found.into_iter().filter_map(|(path, segment)| {
            let (from, piece) = self.segment(path as usize, segment as usize)?;
            Some((path, segment, from, piece))
        })
    }

    fn segment(&self, path: usize, segment: usize) -> Option<(Point, PathSegment)> {
        let path = self.paths.get(path)?;
        let before = segment.checked_sub(1).and_then(|before| path.segments.get(before));
        Some((before.map_or(path.start, |before| before.to()), *path.segments.get(segment)?))
    }
}

#[cfg(test)]
mod tests {
    use super::super::circle;
    use super::*;

    #[test]
    fn segments_meeting_a_box_are_found_in_order() {
        let at = |number: u32, each: f64| f64::from(number * 7919 % 500) * each;
        let ring = |number: u32| {
            let centre = Point::from_mm(at(number, 0.1), at(number / 3, 0.07));
            circle(centre, Length::from_mm(0.3 + at(number, 0.001)))
        };
        let long = Path::through(&[Point::from_mm(-1.0, -1.0), Point::from_mm(50.0, 40.0)]).unwrap();
        for count in [0, 1, 16, 17, 300, 3_000] {
            let mut paths: Vec<Path> = (0..count).map(ring).collect();
            paths.push(long.clone());
            let segments = Segments::of(&paths);
            for look in 0..40 {
                let bounds =
                    Bounds::of(Point::from_mm(at(look, 0.1), at(look + 3, 0.1))).grown(Length::from_mm(0.4));
                let found: Vec<_> = segments.meeting(bounds).collect();
                let all = (0..).zip(&paths).flat_map(|(number, path)| {
                    (0..)
                        .zip(path.pieces())
                        .map(move |(segment, (from, piece))| (number, segment, from, piece))
                });
                let expected: Vec<_> =
                    all.filter(|(.., from, piece)| segment_bounds(*from, *piece).meets(bounds)).collect();
                assert_eq!(found, expected, "{count} rings, look {look}");
            }
        }
    }
}
