//! The simulated stock: depth of cut per cell, as a height field.
//!
//! ```text
//!   cell   ┌─┬─┬─┬─┬─┬─┬─┐  surface        side view; every cell stores the greatest
//!          │ │ │▓│▓│▓│ │ │                 depth of a bit over its centre
//!          │ │ │▓│▓│▓│ │ │
//!          └─┴─┴─┴─┴─┴─┴─┘  underside      a cut is a set of rows, a row a range of columns
//! ```
//!
//! Tiles of 64 × 64 cells are allocated when first cut. Copies of a stock share equal tiles, so a copy costs
//! one pointer per tile. End mills are flat cylinders, V-bits are cones with a flat tip, drills are flat or
//! pointed.

use super::cuts::{CutShape, Way};
use crate::diagnostic::Diagnostic;
use crate::geometry::{Bounds, Point};
use crate::job::{Bit, Cutter};
use crate::units::Length;
use crate::warning;
use std::sync::Arc;

/// Cells along each side of a tile.
pub const TILE: usize = 64;

const CELLS_UM: [i64; 6] = [25, 50, 100, 200, 400, 800];

/// Greatest number of cells: 32 MB if all are cut.
const MOST_CELLS: f64 = 16e6;

/// Greatest number of cells along a side: every graphics card supports a texture of this size.
const MOST_ALONG_CELLS: f64 = 4096.0;

/// Greatest height of a piece of a ramp, mm. Each piece is cut at its deepest end.
const RAMP_MM: f64 = 0.005;

const MOST_PIECES: f64 = 100_000.0;

#[derive(Clone, Debug, PartialEq)]
pub struct Stock {
    low_mm: [f64; 2],
    cell_mm: f64,
    cells: [usize; 2],
    thickness_mm: f64,
    /// Slope of a drill's point, mm of height per mm of radius; 0 for flat drills.
    point_slope: f64,
    tiles_across: usize,
    tiles: Vec<Option<Arc<[u16]>>>,
}

/// A square block of cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tile<'a> {
    /// Its first cell (X, Y), counted from the low corner.
    pub first: [usize; 2],
    /// Depths in µm, row by row; cells outside the board stay 0. None if nothing was cut.
    pub depths_um: Option<&'a Arc<[u16]>>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Tool {
    /// Radius of the flat end.
    tip_mm: f64,
    radius_mm: f64,
    /// Slope of the edge, mm of height per mm of radius; 0 for a cylinder.
    slope: f64,
}

impl Tool {
    fn of(bit: &Bit, point_slope: f64) -> Self {
        let radius_mm = 0.5 * bit.diameter.mm();
        match bit.cutter {
            Cutter::Drill if point_slope > 0.0 => Self { tip_mm: 0.0, radius_mm, slope: point_slope },
            Cutter::Drill | Cutter::Mill => Self { tip_mm: radius_mm, radius_mm, slope: 0.0 },
            Cutter::Vee { tip, angle_mdeg } => {
                let half_rad = f64::from(angle_mdeg) * 0.5e-3 * core::f64::consts::PI / 180.0;
                let tip_mm = (0.5 * tip.mm()).clamp(0.0, radius_mm);
                Self { tip_mm, radius_mm, slope: 1.0 / libm::tan(half_rad).max(1e-6) }
            }
        }
    }

    /// Depth of cut at `away_mm` from the axis, with the tip at `depth_mm`.
    fn depth_at(&self, away_mm: f64, depth_mm: f64) -> f64 {
        depth_mm - self.slope * (away_mm - self.tip_mm).max(0.0)
    }

    fn reach_mm(&self, depth_mm: f64) -> f64 {
        if self.slope == 0.0 {
            self.radius_mm
        } else {
            (self.tip_mm + depth_mm / self.slope).min(self.radius_mm)
        }
    }
}

impl Stock {
    /// An uncut board over `bounds` in work coordinates, with the finest cells that fit the limits. Fails if
    /// it has no area, or is too large to show.
    pub fn new(bounds: Bounds, thickness: Length) -> Result<Self, Diagnostic> {
        let size = [bounds.max.x - bounds.min.x, bounds.max.y - bounds.min.y];
        let count = |cell_um: i64| {
            let cell_nm = Length::from_um(cell_um).nm();
            size.map(|size| (size.nm().saturating_add(cell_nm - 1) / cell_nm) as f64)
        };
        let fits = |cell_um: &i64| {
            let [x, y] = count(*cell_um);
            x >= 1.0 && y >= 1.0 && x.max(y) <= MOST_ALONG_CELLS && x * y <= MOST_CELLS
        };
        let Some(cell_um) = CELLS_UM.into_iter().find(fits) else {
            let diagnostic = warning!("sim.no_stock", ..);
            return Err(diagnostic.with("width", size[0].mm()).with("height", size[1].mm()));
        };
        let cells = count(cell_um).map(|cells| cells as usize);
        let tiles = cells.map(|cells| cells.div_ceil(TILE));
        Ok(Self {
            low_mm: [bounds.min.x.mm(), bounds.min.y.mm()],
            cell_mm: cell_um as f64 * 1e-3,
            cells,
            thickness_mm: thickness.mm(),
            point_slope: 0.0,
            tiles_across: tiles[0],
            tiles: vec![None; tiles[0] * tiles[1]],
        })
    }

    /// Sets the point angle of drills; 180° is flat.
    #[must_use]
    pub fn with_points(mut self, point_deg: f64) -> Self {
        let half_rad = point_deg.clamp(1.0, 180.0) * 0.5 * core::f64::consts::PI / 180.0;
        self.point_slope = if point_deg < 180.0 { 1.0 / libm::tan(half_rad) } else { 0.0 };
        self
    }

    pub fn thickness_mm(&self) -> f64 {
        self.thickness_mm
    }

    pub fn cell_mm(&self) -> f64 {
        self.cell_mm
    }

    pub fn cells(&self) -> [usize; 2] {
        self.cells
    }

    pub fn low_mm(&self) -> [f64; 2] {
        self.low_mm
    }

    /// Bounds of all cells, in work coordinates.
    pub fn bounds(&self) -> Bounds {
        let size = self.cells.map(|cells| cells as f64 * self.cell_mm);
        let [x, y] = self.low_mm;
        Bounds::of(Point::from_mm(x, y)).with(Point::from_mm(x + size[0], y + size[1]))
    }

    /// The board after a flip, mirrored along X or else along Y, with its low corner at `low`. Depths are
    /// still measured from the cut side.
    #[must_use]
    pub fn flipped(&self, mirror_x: bool, low: Point) -> Self {
        let [columns, rows] = self.cells;
        let tiles = vec![None; self.tiles.len()];
        let mut turned = Self { low_mm: [low.x.mm(), low.y.mm()], tiles, ..self.clone() };
        for tile in self.tiles() {
            for (index, depth) in tile.depths_um.iter().flat_map(|depths| depths.iter().enumerate()) {
                let [x, y] = [tile.first[0] + index % TILE, tile.first[1] + index / TILE];
                if *depth > 0 && x < columns && y < rows {
                    let (x, y) = if mirror_x { (columns - 1 - x, y) } else { (x, rows - 1 - y) };
                    turned.lower(y, x, x, |_| *depth);
                }
            }
        }
        turned
    }

    pub fn tiles(&self) -> impl Iterator<Item = Tile<'_>> {
        self.tiles.iter().enumerate().map(|(index, tile)| Tile {
            first: [index % self.tiles_across * TILE, index / self.tiles_across * TILE],
            depths_um: tile.as_ref(),
        })
    }

    /// Tiles that differ from `before`, a copy of this stock from another time. Compares pointers, not cells.
    pub fn changed<'a>(&'a self, before: &'a Self) -> impl Iterator<Item = Tile<'a>> {
        let same = |(own, other): &(Tile<'_>, Tile<'_>)| match (own.depths_um, other.depths_um) {
            (Some(own), Some(other)) => Arc::ptr_eq(own, other),
            (own, other) => own.is_none() && other.is_none(),
        };
        self.tiles().zip(before.tiles()).filter(move |both| !same(both)).map(|(own, _)| own)
    }

    /// Depth below the surface at a position, mm; none outside the board.
    pub fn depth_mm(&self, place_mm: [f64; 2]) -> Option<f64> {
        let at: [f64; 2] =
            core::array::from_fn(|axis| libm::floor((place_mm[axis] - self.low_mm[axis]) / self.cell_mm));
        let inside = (0..2).all(|axis| at[axis] >= 0.0 && at[axis] < self.cells[axis] as f64);
        inside.then(|| f64::from(self.depth_um(at[0] as usize, at[1] as usize)) * 1e-3)
    }

    /// True if the board is cut through at a position.
    pub fn is_through(&self, place_mm: [f64; 2]) -> bool {
        self.depth_mm(place_mm).is_some_and(|depth| depth >= self.thickness_mm)
    }

    /// Removed material, mm³; cuts below the board don't count.
    pub fn removed_mm3(&self) -> f64 {
        let most = self.thickness_mm * 1e3;
        let depths = self.tiles.iter().flatten().flat_map(|tile| tile.iter());
        let sum_um: f64 = depths.map(|depth| f64::from(*depth).min(most)).sum();
        sum_um * 1e-3 * self.cell_mm * self.cell_mm
    }

    fn depth_um(&self, x: usize, y: usize) -> u16 {
        let tile = self.tiles.get(y / TILE * self.tiles_across + x / TILE).and_then(Option::as_ref);
        tile.and_then(|tile| tile.get(y % TILE * TILE + x % TILE)).copied().unwrap_or(0)
    }

    /// Cuts a part of a path, between two shares from 0 to 1. Returns the number of visited cells.
    pub fn carve(&mut self, way: &Way, bit: &Bit, from_share: f64, to_share: f64) -> u64 {
        let tool = Tool::of(bit, self.point_slope);
        if to_share.is_nan() || from_share.is_nan() || to_share < from_share {
            return 0;
        }
        let falls_mm = (way.at(to_share)[2] - way.at(from_share)[2]).abs();
        let chords = match way.shape {
            CutShape::Line => 1.0,
            // The middle of a chord deviates from its arc by r·(1 − cos(φ/2)), here an eighth of a cell.
            CutShape::Arc { radius_mm, turn_rad, .. } => {
                let off = (1.0 - 0.125 * self.cell_mm / radius_mm.max(1e-9)).clamp(-1.0, 1.0);
                turn_rad.abs() * (to_share - from_share) / (2.0 * libm::acos(off)).max(1e-6)
            }
        };
        // In a vertical plunge only the deepest point matters.
        let ramp =
            if way.from_mm[..2] == way.to_mm[..2] && way.shape == CutShape::Line { 0.0 } else { falls_mm };
        let pieces = libm::ceil(chords.max(ramp / RAMP_MM).clamp(1.0, MOST_PIECES));
        let share = |piece: f64| from_share + (to_share - from_share) * piece / pieces;
        let (mut at, mut looked) = (way.at(from_share), 0);
        for piece in 1..=pieces as u32 {
            let next = way.at(share(f64::from(piece)));
            looked += self.sweep(&tool, [at[0], at[1]], [next[0], next[1]], -at[2].min(next[2]));
            at = next;
        }
        looked
    }

    /// Cuts along a straight line from `a` to `b` with the tip at `depth_mm`; returns the number of visited
    /// cells.
    fn sweep(&mut self, tool: &Tool, a: [f64; 2], b: [f64; 2], depth_mm: f64) -> u64 {
        if depth_mm.is_nan() || depth_mm <= 0.0 {
            return 0;
        }
        let reach = tool.reach_mm(depth_mm);
        let (low, high) = (a[1].min(b[1]) - reach, a[1].max(b[1]) + reach);
        let Some((first, last)) = self.span(1, low, high) else { return 0 };
        let (deepest, mut looked) = (to_um(depth_mm), (last - first) as u64);
        for row in first..=last {
            let y = self.middle(1, row);
            let Some((from_mm, to_mm)) = across(a, b, reach, y) else { continue };
            let Some((from, to)) = self.span(0, from_mm, to_mm) else { continue };
            looked += (to - from) as u64;
            if tool.slope == 0.0 {
                self.lower(row, from, to, |_| deepest);
            } else {
                let (low_x, cell) = (self.low_mm[0], self.cell_mm);
                self.lower(row, from, to, |column| {
                    let x = low_x + (column as f64 + 0.5) * cell;
                    to_um(tool.depth_at(distance(a, b, [x, y]), depth_mm))
                });
            }
        }
        looked
    }

    /// Centre of a column (axis 0) or row (axis 1), mm.
    fn middle(&self, axis: usize, index: usize) -> f64 {
        self.low_mm[axis] + (index as f64 + 0.5) * self.cell_mm
    }

    /// First and last cell along `axis` with centres between two positions.
    fn span(&self, axis: usize, from_mm: f64, to_mm: f64) -> Option<(usize, usize)> {
        let cell = |mm: f64| (mm - self.low_mm[axis]) / self.cell_mm - 0.5;
        let first = libm::ceil(cell(from_mm)).max(0.0);
        let last = libm::floor(cell(to_mm)).min(self.cells[axis] as f64 - 1.0);
        (first <= last).then_some((first as usize, last as usize))
    }

    /// Lowers the cells of a row, from column `from` to column `to`, to their depth unless they are deeper
    /// already.
    fn lower(&mut self, row: usize, from: usize, to: usize, depth_um: impl Fn(usize) -> u16) {
        let mut column = from;
        while column <= to {
            let end = (column / TILE * TILE + TILE - 1).min(to);
            let index = row / TILE * self.tiles_across + column / TILE;
            if let Some(tile) = self.tiles.get_mut(index) {
                let tile = tile.get_or_insert_with(|| Arc::from(vec![0; TILE * TILE]));
                let start = row % TILE * TILE;
                // `make_mut` copies a tile that other stocks share.
                let cells = Arc::make_mut(tile).iter_mut().skip(start + column % TILE).take(end - column + 1);
                for (cell, column) in cells.zip(column..) {
                    *cell = (*cell).max(depth_um(column));
                }
            }
            column = end + 1;
        }
    }
}

/// A depth in µm; zero above the surface.
fn to_um(depth_mm: f64) -> u16 {
    libm::round(depth_mm * 1e3).clamp(0.0, f64::from(u16::MAX)) as u16
}

/// The x range, at height `y`, within `reach` of the line from `a` to `b`.
fn across(a: [f64; 2], b: [f64; 2], reach: f64, y: f64) -> Option<(f64, f64)> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut seen = |from: f64, to: f64| (low, high) = (low.min(from), high.max(to));
    for end in [a, b] {
        let beside = y - end[1];
        if beside.abs() <= reach {
            let half = libm::sqrt((reach - beside) * (reach + beside));
            seen(end[0] - half, end[0] + half);
        }
    }
    let way = [b[0] - a[0], b[1] - a[1]];
    let length = libm::sqrt(way[0] * way[0] + way[1] * way[1]);
    // Corners of the rectangle around the line; its ends are half circles.
    if length > 0.0 {
        let aside = [-way[1] / length * reach, way[0] / length * reach];
        let corner = |at: [f64; 2], side: f64| [at[0] + side * aside[0], at[1] + side * aside[1]];
        let corners = [corner(a, 1.0), corner(b, 1.0), corner(b, -1.0), corner(a, -1.0)];
        for (from, to) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            let rise = to[1] - from[1];
            let share = (y - from[1]) / rise;
            if rise != 0.0 && (0.0..=1.0).contains(&share) {
                let x = from[0] + share * (to[0] - from[0]);
                seen(x, x);
            }
        }
    }
    (low <= high).then_some((low, high))
}

fn distance(a: [f64; 2], b: [f64; 2], at: [f64; 2]) -> f64 {
    let (way, off) = ([b[0] - a[0], b[1] - a[1]], [at[0] - a[0], at[1] - a[1]]);
    let squared = way[0] * way[0] + way[1] * way[1];
    let share =
        if squared > 0.0 { ((way[0] * off[0] + way[1] * off[1]) / squared).clamp(0.0, 1.0) } else { 0.0 };
    let [x, y] = [off[0] - share * way[0], off[1] - share * way[1]];
    libm::sqrt(x * x + y * y)
}
