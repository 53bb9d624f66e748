//! Areas that a bit takes away as a whole (N7): rings round what stays, then toolpaths through what the rings leave.
//!
//! ```text
//!   ▓▓▓▓▓▓▓▓▓▓▓▓    what stays
//!   ────────────    1st ring: the bit touches what stays
//!   ────────────    every next one further by the stepover, as far as it lies on the board
//!   ░░░▒▒▒▒▒▒░░░    beyond the last ring no further one fits: what is left there ▒ and at the edge of the board is
//!   ────────────    followed along its own edges, or where it is small touched once in its middle
//! ```
//!
//! Comes in: what stays, the board, a bit's width, what wider bits left. Goes out: paths of the bit's middle. Toolpaths come
//! 1 µm nearer to what stays than half the width. What is thinner than 4 µm counts as taken. Does not know operations.

use super::cut::{self, Area};
use super::narrow::{NEARER, half, is_fragment};
use crate::geometry::{
    CombineRule, Exposure, Island, Path, Point, Region, combine, grow, island_area_mm2, paint, path_bounds,
    rectangle, sweep, union,
};
use crate::units::Length;

/// More rings than this are not made.
const MOST_RINGS: usize = 4_000;
/// More segments than this are not made.
const MOST_SEGMENTS: usize = 4_000_000;
/// So often what is left is looked for.
const MOST_ROUNDS: usize = 8;
/// Half of the width of what counts as taken.
const CRUMB: Length = Length::from_um(2);
/// Pieces up to this, in mm², go with the chips.
const DUST_MM2: f64 = 1e-4;
/// Rings are wanted this much beside what they are to take.
const BESIDE: Length = Length::from_um(5);
/// So many segments are swept at once.
const STRETCH: usize = 500;
/// Toolpaths of this many mm stand for a single place.
const DOT_MM: f64 = 0.02;

/// What is to be filled.
pub(super) struct Field<'a> {
    /// What stays.
    pub(super) kept: &'a Region,
    /// All that there is.
    pub(super) board: &'a Region,
    /// How far the bit's middle may leave the board.
    pub(super) margin: Length,
}

/// What one bit does.
#[derive(Default)]
pub(super) struct Filled {
    /// The toolpaths of its middle, inside of rings on the left.
    pub(super) paths: Vec<Path>,
    /// What it takes: outlines, inside on the left, that may overlap.
    pub(super) swept: Vec<Path>,
}

/// Why nothing was filled.
pub(super) enum Stopped {
    /// Nobody wants it any more.
    Cancelled,
    /// More rings than anybody wants.
    TooMany,
}

/// Fills `wanted` as far as a bit that cuts `width` reaches; none for the whole board. Every ring is further by `step`.
pub(super) fn fill(
    field: &Field<'_>,
    wanted: Option<&Region>,
    (width, step): (Length, Length),
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Filled, Stopped> {
    let near = half(width) - NEARER;
    let first = grow(field.kept, near);
    let around = grow(field.board, field.margin.min(half(width)));
    let open = combine(&around, &first, CombineRule::Difference);
    // What the bit does not reach is what is closed to its middle, shrunk again by half of its width.
    let beyond = combine(&frame(&around, width), &around, CombineRule::Difference);
    let unreached = grow(&combine(&first, &beyond, CombineRule::Union), -near);
    let mut reached = combine(wanted.unwrap_or(field.board), &unreached, CombineRule::Difference);
    if wanted.is_some() {
        reached = whole(pieces(&reached));
    }
    if reached.is_empty() {
        return Ok(Filled::default());
    }
    // A ring after the first is wanted beside the area only where the one before leaves something.
    let beside = [half(width), (step - half(width)).max(Length::ZERO) + BESIDE];
    let area = if wanted.is_some() { &reached } else { field.board };
    let zones = beside.map(|by| combine(&grow(area, by), &around, CombineRule::Intersection));
    let mut paths = rings(first, step, &zones, go_on)?;
    let mut swept = outlines(&paths, width);
    let mut rest = pieces(&without(&reached, &swept));
    let open = Area::of(&open);
    for _ in 0..MOST_ROUNDS {
        if !go_on() {
            return Err(Stopped::Cancelled);
        }
        let more: Vec<Path> = rest.iter().flat_map(|piece| through(piece, &open, near)).collect();
        if more.is_empty() {
            break;
        }
        let taken = outlines(&more, width);
        rest = pieces(&without(&whole(rest), &taken));
        swept.extend(taken);
        paths.extend(more);
    }
    Ok(Filled { paths, swept })
}

/// A box that reaches beyond `region` by several times `width`.
fn frame(region: &Region, width: Length) -> Region {
    let bounds = region.bounds().map(|bounds| bounds.grown(width + width));
    bounds.map_or_else(Region::default, |bounds| union(&[rectangle(bounds)]))
}

/// `region` without what was swept.
pub(super) fn without(region: &Region, swept: &[Path]) -> Region {
    let there = Exposure { clear: false, outlines: region.paths().cloned().collect() };
    paint(&[there, Exposure { clear: true, outlines: swept.to_vec() }])
}

/// The outlines of what a bit sweeps along `paths`, stretch by stretch: a stretch has far fewer outlines than segments.
fn outlines(paths: &[Path], width: Length) -> Vec<Path> {
    let mut out = Vec::new();
    for path in paths {
        let mut start = path.start;
        for segments in path.segments.chunks(STRETCH) {
            let stretch = Path { start, segments: segments.to_vec() };
            start = stretch.end();
            out.extend(sweep(&[stretch], width).paths().cloned());
        }
    }
    out
}

/// The rings from the edges of `region` on: the first as far as it lies in the first of `zones`, all others in the second.
fn rings(
    mut region: Region,
    step: Length,
    zones: &[Region; 2],
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Vec<Path>, Stopped> {
    let mut paths: Vec<Path> = Vec::new();
    let mut segments = 0;
    let [first, next] = zones;
    let mut area = Area::of(first);
    for number in 0..MOST_RINGS {
        if !go_on() {
            return Err(Stopped::Cancelled);
        }
        let ring: Vec<Path> = region.paths().flat_map(|path| cut::parts(path, &area, true)).collect();
        segments += ring.iter().map(|path| path.segments.len()).sum::<usize>();
        let covered = ring.is_empty() && is_fragment(&combine(next, &region, CombineRule::Difference));
        paths.extend(ring);
        if covered {
            return Ok(paths);
        }
        if segments > MOST_SEGMENTS {
            break;
        }
        region = grow(&region, step);
        if number == 0 {
            area = Area::of(next);
        }
    }
    Err(Stopped::TooMany)
}

/// The toolpaths that take a piece, or what is near its edges, where the middle of a bit of this radius may go: round it, or
/// one touch where that is enough.
fn through(piece: &Island, open: &Area, radius: Length) -> Vec<Path> {
    let bounds = path_bounds(&piece.outer);
    let middle = Point::new(
        bounds.min.x + half(bounds.max.x - bounds.min.x),
        bounds.min.y + half(bounds.max.y - bounds.min.y),
    );
    if bounds.min.distance_mm(middle) < radius.mm() && open.contains(middle) {
        let end = |by: f64| Point::from_mm(middle.x.mm() + by, middle.y.mm());
        return Path::through(&[end(-DOT_MM / 2.0), end(DOT_MM / 2.0)]).into_iter().collect();
    }
    piece.paths().flat_map(|path| cut::parts(path, open, true)).collect()
}

/// The pieces of `region` that are worth a way.
fn pieces(region: &Region) -> Vec<Island> {
    let solid = grow(&grow(region, -CRUMB), CRUMB);
    solid.islands.into_iter().filter(|island| island_area_mm2(island) > DUST_MM2).collect()
}

fn whole(islands: Vec<Island>) -> Region {
    Region { islands }
}
