//! Clears areas: rings around the copper that stays, then toolpaths through the remaining pieces.
//!
//! ```text
//!   ▓▓▓▓▓▓▓▓▓▓▓▓    copper that stays
//!   ────────────    1st ring: the tool touches that copper
//!   ────────────    each further ring at the stepover, as far as it is on the board
//!   ░░░▒▒▒▒▒▒░░░    beyond the last ring: the remaining piece ▒, also at the board's edge, is cut
//!   ────────────    along its own edges, or if small by one touch at its centre
//! ```
//!
//! Toolpaths are 1 µm nearer to the copper than half the width. Remains thinner than 4 µm count as cleared.

use super::cut::{self, Area};
use super::narrow::{NEARER, half, is_fragment};
use crate::geometry::{
    CombineRule, Exposure, Island, Path, Point, Region, combine, grow, island_area_mm2, paint, path_bounds,
    rectangle, sweep, union,
};
use crate::units::Length;

const MOST_RINGS: usize = 4_000;
const MOST_SEGMENTS: usize = 4_000_000;
const MOST_ROUNDS: usize = 8;
/// Half of the width that counts as cleared.
const CRUMB: Length = Length::from_um(2);
const DUST_MM2: f64 = 1e-4;
/// Margin of the area for rings beyond the area to clear.
const BESIDE: Length = Length::from_um(5);
/// Segments swept at once.
const STRETCH: usize = 500;
/// Length of a toolpath for a single point, in mm.
const DOT_MM: f64 = 0.02;

pub(super) struct Field<'a> {
    pub(super) kept: &'a Region,
    pub(super) board: &'a Region,
    /// How far the tool centre may leave the board.
    pub(super) margin: Length,
}

#[derive(Default)]
pub(super) struct Filled {
    pub(super) paths: Vec<Path>,
    /// Area cleared: outlines, inside on the left, that may overlap.
    pub(super) swept: Vec<Path>,
}

pub(super) enum Stopped {
    Cancelled,
    TooMany,
}

/// Clears `wanted` as far as a tool that cuts `width` reaches; `None`: the whole board. Rings are `step`
/// apart.
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
    // The unreachable area: the area closed to the tool's centre, shrunk by half the width.
    let beyond = combine(&frame(&around, width), &around, CombineRule::Difference);
    let unreached = grow(&combine(&first, &beyond, CombineRule::Union), -near);
    let mut reached = combine(wanted.unwrap_or(field.board), &unreached, CombineRule::Difference);
    if wanted.is_some() {
        reached = whole(pieces(&reached));
    }
    if reached.is_empty() {
        return Ok(Filled::default());
    }
    // Rings after the first are needed next to the area only if the previous one left something.
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

fn frame(region: &Region, width: Length) -> Region {
    let bounds = region.bounds().map(|bounds| bounds.grown(width + width));
    bounds.map_or_else(Region::default, |bounds| union(&[rectangle(bounds)]))
}

pub(super) fn without(region: &Region, swept: &[Path]) -> Region {
    let there = Exposure { clear: false, outlines: region.paths().cloned().collect() };
    paint(&[there, Exposure { clear: true, outlines: swept.to_vec() }])
}

/// Outlines of the swept area of `paths`, by stretches: a stretch has far fewer outlines than segments.
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

/// Rings outwards from the edges of `region`: the first clipped to the first of `zones`, all others to the
/// second.
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

/// Toolpaths that clear a piece or its edges, within the area open to the centre of a tool of this radius. A
/// single touch if sufficient, else a path around the piece.
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

fn pieces(region: &Region) -> Vec<Island> {
    let solid = grow(&grow(region, -CRUMB), CRUMB);
    solid.islands.into_iter().filter(|island| island_area_mm2(island) > DUST_MM2).collect()
}

fn whole(islands: Vec<Island>) -> Region {
    Region { islands }
}
