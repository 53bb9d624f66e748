//! Straight edges of a region in a grid: island at a point, nearest edge, facing edges.
//!
//! ```text
//!   ┌────┬────┬────┐     every cell lists the edges that cross it. The inside is on the left of every
//!   │  ╲ │    │    │     edge, so the first edge to the right of a point shows whether the point is
//!   ├───╲┼────┼────┤     inside, and in which island
//!   │    ╲──x▶│╱   │
//!   └────┴────┴────┘
//! ```

use crate::geometry::{Path, Point, Region};
use crate::units::Length;

const CHORD_ERROR_MM: f64 = 0.001;
const SLACK_MM: f64 = 1e-6;
const MOST_CELLS: f64 = 1_000_000.0;

/// A point in mm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Spot {
    pub(super) x: f64,
    pub(super) y: f64,
}

impl Spot {
    pub(super) fn of(point: Point) -> Self {
        Self { x: point.x.mm(), y: point.y.mm() }
    }

    pub(super) fn point(self) -> Point {
        Point::from_mm(self.x, self.y)
    }

    pub(super) fn minus(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y }
    }

    pub(super) fn towards(self, other: Self, share: f64) -> Self {
        Self { x: self.x + (other.x - self.x) * share, y: self.y + (other.y - self.y) * share }
    }

    pub(super) fn dot(self, other: Self) -> f64 {
        self.x * other.x + self.y * other.y
    }

    pub(super) fn length(self) -> f64 {
        libm::sqrt(self.dot(self))
    }

    pub(super) fn distance(self, other: Self) -> f64 {
        self.minus(other).length()
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    pub(super) from: Spot,
    pub(super) to: Spot,
    pub(super) island: u32,
    pub(super) ring: u32,
}

impl Edge {
    /// The point on it nearest to `spot`, as share of its length.
    pub(super) fn share_near(&self, spot: Spot) -> f64 {
        let way = self.to.minus(self.from);
        let square = way.dot(way);
        if square > 0.0 { (spot.minus(self.from).dot(way) / square).clamp(0.0, 1.0) } else { 0.0 }
    }

    pub(super) fn near(&self, spot: Spot) -> Spot {
        self.from.towards(self.to, self.share_near(spot))
    }

    pub(super) fn length(&self) -> f64 {
        self.from.distance(self.to)
    }

    pub(super) fn middle(&self) -> Spot {
        self.from.towards(self.to, 0.5)
    }

    /// True if its bounds and a box share a point.
    fn meets(&self, low: Spot, high: Spot) -> bool {
        self.from.x.min(self.to.x) <= high.x
            && self.from.x.max(self.to.x) >= low.x
            && self.from.y.min(self.to.y) <= high.y
            && self.from.y.max(self.to.y) >= low.y
    }
}

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ring {
    pub(super) length_mm: f64,
    /// In mm²; negative for a hole.
    pub(super) area_mm2: f64,
    pub(super) first: u32,
    island: u32,
}

/// Storage of the edges. A board has millions of them, so edges of rings share their corners.
#[derive(Clone, Debug)]
enum Stored {
    /// Edges that need not close.
    Loose(Vec<Edge>),
    /// An edge from each corner to the next, except from the last corner of a ring, which repeats its first
    /// one.
    Rings {
        /// Origin of the corners, to the left of all and below.
        zero: Point,
        /// In nm from `zero`.
        corners: Vec<[u32; 2]>,
        /// Of every `EACH`-th corner.
        marks: Vec<Mark>,
    },
}

/// What is known of a corner: to know it of each would take more memory than the corners.
#[derive(Clone, Copy, Debug)]
struct Mark {
    ring: u32,
    length_mm: f64,
    /// The area that this length sweeps, seen from the zero, in mm².
    area_mm2: f64,
}

/// How far flattened arcs may lie outside the box of their path.
const ROUNDING: Length = Length::from_um(2);
const EACH: u32 = 16;

#[derive(Clone, Debug)]
pub(super) struct Edges {
    stored: Stored,
    pub(super) rings: Vec<Ring>,
    low: Spot,
    cell: f64,
    columns: usize,
    rows: usize,
    starts: Vec<u32>,
    items: Vec<u32>,
}

/// Offset of a point from `zero` to the right and upwards, in nm.
fn offset(zero: Point, at: Point) -> [u32; 2] {
    [at.x - zero.x, at.y - zero.y].map(|by| u32::try_from(by.nm().max(0)).unwrap_or(u32::MAX))
}

fn spot_at(zero: Point, [x, y]: [u32; 2]) -> Spot {
    let by = |nm: u32| Length::from_nm(i64::from(nm));
    Spot::of(Point::new(zero.x + by(x), zero.y + by(y)))
}

pub(super) fn spots(path: &Path) -> Vec<Spot> {
    path.flattened(CHORD_ERROR_MM).into_iter().map(Spot::of).collect()
}

impl Ring {
    fn goes_on(&mut self, from: Spot, to: Spot) {
        self.length_mm += from.distance(to);
        self.area_mm2 += cross(from, to) / 2.0;
    }
}

impl Edges {
    pub(super) fn of(region: &Region) -> Self {
        let (mut corners, mut marks, mut rings) = (Vec::new(), Vec::new(), Vec::new());
        let zero = region.bounds().map_or_else(Point::default, |bounds| bounds.grown(ROUNDING).min);
        for (island, shape) in (0..).zip(&region.islands) {
            for path in shape.paths() {
                let number = rings.len() as u32;
                let mut ring = Ring { first: corners.len() as u32, island, ..Ring::default() };
                let places = path.flattened(CHORD_ERROR_MM);
                let next = places.iter().skip(1).map(Some).chain([None]);
                for (&from, to) in places.iter().zip(next) {
                    if (corners.len() as u32).is_multiple_of(EACH) {
                        let Ring { length_mm, area_mm2, .. } = ring;
                        marks.push(Mark { ring: number, length_mm, area_mm2 });
                    }
                    corners.push(offset(zero, from));
                    if let Some(&to) = to {
                        ring.goes_on(Spot::of(from), Spot::of(to));
                    }
                }
                rings.push(ring);
            }
        }
        corners.shrink_to_fit();
        Self::gridded(Stored::Rings { zero, corners, marks }, rings)
    }

    pub(super) fn loose(edges: Vec<Edge>) -> Self {
        Self::gridded(Stored::Loose(edges), Vec::new())
    }

    /// The edge with that number; not every number has one.
    pub(super) fn edge(&self, number: u32) -> Option<Edge> {
        let at = number as usize;
        match &self.stored {
            Stored::Loose(edges) => edges.get(at).copied(),
            Stored::Rings { zero, corners, marks } => {
                let first = |ring: u32| self.rings.get(ring as usize).map(|ring| ring.first);
                let mut ring = marks.get((number / EACH) as usize)?.ring;
                while first(ring + 1).is_some_and(|first| first <= number) {
                    ring += 1;
                }
                // No edge begins at the last corner of a ring.
                if first(ring + 1) == Some(number + 1) {
                    return None;
                }
                let island = self.rings.get(ring as usize)?.island;
                let spot = |at: usize| corners.get(at).map(|corner| spot_at(*zero, *corner));
                Some(Edge { from: spot(at)?, to: spot(at + 1)?, island, ring })
            }
        }
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (u32, Edge)> + '_ {
        (0..self.numbers()).filter_map(|number| Some((number, self.edge(number)?)))
    }

    pub(super) fn numbers(&self) -> u32 {
        match &self.stored {
            Stored::Loose(edges) => edges.len() as u32,
            Stored::Rings { corners, .. } => corners.len() as u32,
        }
    }

    /// The part of the ring before an edge: its length, and the area it sweeps, seen from the zero.
    fn before(&self, number: u32) -> Option<(f64, f64)> {
        let Stored::Rings { marks, .. } = &self.stored else { return None };
        let ring = self.rings.get(self.edge(number)?.ring as usize)?;
        let mark = number / EACH;
        let (start, mut part) = match mark * EACH <= ring.first {
            true => (ring.first, Ring::default()),
            false => {
                let Mark { length_mm, area_mm2, .. } = *marks.get(mark as usize)?;
                (mark * EACH, Ring { length_mm, area_mm2, ..Ring::default() })
            }
        };
        (start..number)
            .filter_map(|number| self.edge(number))
            .for_each(|edge| part.goes_on(edge.from, edge.to));
        Some((part.length_mm, part.area_mm2))
    }

    /// Length of a ring from its first edge to a point on it, in mm.
    pub(super) fn along_mm(&self, number: u32, spot: Spot) -> f64 {
        let (Some((before, _)), Some(edge)) = (self.before(number), self.edge(number)) else { return 0.0 };
        before + edge.from.distance(spot)
    }

    /// Area between a ring section, from one point to another, and the straight line back.
    pub(super) fn area_between(&self, (first, from): (u32, Spot), (last, to): (u32, Spot)) -> f64 {
        let (Some(one), Some(other)) = (self.edge(first), self.edge(last)) else { return 0.0 };
        let swept = |number: u32| self.before(number).map_or(0.0, |(_, area)| 2.0 * area);
        let whole = swept(last) - swept(first) - cross(one.from, one.to);
        (cross(from, one.to) + whole + cross(other.from, to) + cross(to, from)) / 2.0
    }

    fn gridded(stored: Stored, rings: Vec<Ring>) -> Self {
        let mut grid = Self {
            stored,
            rings,
            low: Spot::default(),
            cell: 1.0,
            columns: 1,
            rows: 1,
            starts: Vec::new(),
            items: Vec::new(),
        };
        let ends = || grid.iter().flat_map(|(_, edge)| [edge.from, edge.to]);
        let low =
            ends().reduce(|low, at| Spot { x: low.x.min(at.x), y: low.y.min(at.y) }).unwrap_or_default();
        let high = ends().fold(low, |high, at| Spot { x: high.x.max(at.x), y: high.y.max(at.y) });
        let count = grid.iter().count().max(1) as f64;
        let (width, height) = (high.x - low.x, high.y - low.y);
        let fair = libm::sqrt(width * height / count);
        let cell =
            fair.clamp(0.05, 5.0).max(libm::sqrt(width * height / MOST_CELLS)).max((width + height) / 1e5);
        (grid.low, grid.cell) = (low, cell);
        (grid.columns, grid.rows) = ((width / cell) as usize + 1, (height / cell) as usize + 1);
        grid.starts = vec![0; grid.columns * grid.rows + 1];
        grid.fill();
        grid
    }

    /// Counts first, then writes, so it iterates twice.
    fn fill(&mut self) {
        let mut counts = vec![0_u32; self.columns * self.rows + 1];
        for (_, edge) in self.iter() {
            self.cells_of(&edge, &mut |cell| {
                if let Some(count) = counts.get_mut(cell) {
                    *count += 1;
                }
            });
        }
        let mut sum = 0;
        for (start, count) in self.starts.iter_mut().zip(&counts) {
            *start = sum;
            sum += count;
        }
        let mut next = self.starts.clone();
        let mut items = vec![0_u32; sum as usize];
        for (index, edge) in self.iter() {
            self.cells_of(&edge, &mut |cell| {
                if let Some(place) = next.get_mut(cell) {
                    if let Some(item) = items.get_mut(*place as usize) {
                        *item = index;
                    }
                    *place += 1;
                }
            });
        }
        self.items = items;
    }

    fn column(&self, x: f64) -> usize {
        ((x - self.low.x) / self.cell).clamp(0.0, (self.columns - 1) as f64) as usize
    }

    fn row(&self, y: f64) -> usize {
        ((y - self.low.y) / self.cell).clamp(0.0, (self.rows - 1) as f64) as usize
    }

    /// Calls `each` with every cell that `edge` may cross: row by row, from entry to exit.
    fn cells_of(&self, edge: &Edge, each: &mut impl FnMut(usize)) {
        let (below, above) =
            if edge.from.y <= edge.to.y { (edge.from, edge.to) } else { (edge.to, edge.from) };
        let (first, last) = (self.row(below.y), self.row(above.y));
        let rise = above.y - below.y;
        for row in first..=last {
            let x_at = |y: f64| {
                let share = if rise > 0.0 { ((y - below.y) / rise).clamp(0.0, 1.0) } else { 0.0 };
                below.x + (above.x - below.x) * share
            };
            let floor = self.low.y + row as f64 * self.cell;
            let (a, b) =
                if first == last { (below.x, above.x) } else { (x_at(floor), x_at(floor + self.cell)) };
            // Slightly wider, because of rounding at the borders of cells.
            let (left, right) = (self.column(a.min(b) - 1e-9), self.column(a.max(b) + 1e-9));
            (left..=right).for_each(|column| each(row * self.columns + column));
        }
    }

    fn items_of(&self, row: usize, column: usize) -> impl Iterator<Item = u32> + '_ {
        self.items_in(row * self.columns + column)
    }

    fn items_in(&self, cell: usize) -> impl Iterator<Item = u32> + '_ {
        let start = self.starts.get(cell).copied().unwrap_or(0) as usize;
        let end = self.starts.get(cell + 1).copied().unwrap_or(0) as usize;
        self.items.get(start..end).unwrap_or_default().iter().copied()
    }

    /// For every cell the island of all its edges; `None` if there are several, or no edges.
    pub(super) fn owners(&self) -> Vec<Option<u32>> {
        let owner = |cell| {
            let mut islands = self.items_in(cell).filter_map(|index| self.edge(index));
            let first = islands.next()?.island;
            islands.all(|edge| edge.island == first).then_some(first)
        };
        (0..self.columns * self.rows).map(owner).collect()
    }

    /// Longer than any distance of two of its points, in mm.
    pub(super) fn extent(&self) -> f64 {
        (self.columns + self.rows) as f64 * self.cell
    }

    pub(super) fn island_at(&self, spot: Spot) -> Option<u32> {
        self.right_of(spot).filter(|edge| edge.to.y > edge.from.y).map(|edge| edge.island)
    }

    /// The first edge exactly to the right of `spot`.
    pub(super) fn right_of(&self, spot: Spot) -> Option<Edge> {
        let outside =
            |value: f64, low: f64, count: usize| value < low || value > low + count as f64 * self.cell;
        if outside(spot.x, self.low.x, self.columns) || outside(spot.y, self.low.y, self.rows) {
            return None;
        }
        let row = self.row(spot.y);
        for column in self.column(spot.x)..self.columns {
            let border = self.low.x + (column + 1) as f64 * self.cell;
            let mut first: Option<(f64, Edge)> = None;
            for edge in self.items_of(row, column).filter_map(|index| self.edge(index)) {
                if (edge.from.y <= spot.y) == (edge.to.y <= spot.y) {
                    continue;
                }
                let share = (spot.y - edge.from.y) / (edge.to.y - edge.from.y);
                let x = edge.from.x + (edge.to.x - edge.from.x) * share;
                if x > spot.x && first.is_none_or(|(nearest, _)| x < nearest) {
                    first = Some((x, edge));
                }
            }
            // An intersection beyond this cell may not be the first.
            if let Some((_, edge)) = first.filter(|(x, _)| *x <= border || column + 1 == self.columns) {
                return Some(edge);
            }
        }
        None
    }

    /// Calls `each` with every edge that may reach into the box, possibly more than once.
    pub(super) fn in_box(&self, low: Spot, high: Spot, each: &mut impl FnMut(u32, &Edge)) {
        for row in self.row(low.y)..=self.row(high.y) {
            for column in self.column(low.x)..=self.column(high.x) {
                for index in self.items_of(row, column) {
                    if let Some(edge) = self.edge(index).filter(|edge| edge.meets(low, high)) {
                        each(index, &edge);
                    }
                }
            }
        }
    }

    /// Calls `each` with every edge that has a point ahead of an edge's middle. The distance is above `done`
    /// mm and up to `radius` mm; only cells for which `wanted` is true are searched. May include other edges
    /// and repetitions.
    pub(super) fn ahead(
        &self,
        of: &Edge,
        (done, radius): (f64, f64),
        wanted: &impl Fn(usize) -> bool,
        each: &mut impl FnMut(u32, &Edge),
    ) {
        let (middle, along) = (of.middle(), of.to.minus(of.from));
        let (done, radius) = (done - SLACK_MM, radius + SLACK_MM);
        let behind = -SLACK_MM * along.length();
        let (low, high) = around(middle, middle, radius);
        // Distances from the point to the two sides of a row or column of cells.
        let sides = |low: f64, number: usize, middle: f64| {
            let from = low + number as f64 * self.cell - middle;
            (from, from + self.cell)
        };
        for row in self.row(low.y)..=self.row(high.y) {
            let (floor, ceiling) = sides(self.low.y, row, middle.y);
            let (near, far) = (floor.max(-ceiling).max(0.0), ceiling.max(-floor));
            let reach = libm::sqrt((radius * radius - near * near).max(0.0));
            let most = (along.x * floor).max(along.x * ceiling);
            for column in self.column(middle.x - reach)..=self.column(middle.x + reach) {
                let cell = row * self.columns + column;
                if self.starts.get(cell) == self.starts.get(cell + 1) || !wanted(cell) {
                    continue;
                }
                let (left, right) = sides(self.low.x, column, middle.x);
                let across = right.max(-left);
                let is_done = done > 0.0 && across * across + far * far < done * done;
                if is_done || most - (along.y * left).min(along.y * right) < behind {
                    continue;
                }
                for index in self.items_in(cell) {
                    if let Some(edge) = self.edge(index).filter(|edge| edge.meets(low, high)) {
                        each(index, &edge);
                    }
                }
            }
        }
    }

    /// True if the straight line between two points crosses an edge farther than `margin_mm` mm from both.
    pub(super) fn cross(&self, from: Spot, to: Spot, margin_mm: f64) -> bool {
        let way = Edge { from, to, island: 0, ring: 0 };
        let mut met = false;
        self.cells_of(&way, &mut |cell| {
            let mut items = self.items_in(cell).filter_map(|index| self.edge(index));
            met = met
                || items.any(|edge| {
                    let at = crossing(&way, &edge);
                    at.is_some_and(|at| at.distance(from) > margin_mm && at.distance(to) > margin_mm)
                });
        });
        met
    }

    /// The size of a cell, in mm.
    pub(super) fn cell(&self) -> f64 {
        self.cell
    }

    /// The nearest edge for which `wanted` is true, within `reach_mm` mm: its distance and the point on it.
    pub(super) fn nearest(
        &self,
        spot: Spot,
        reach_mm: f64,
        wanted: &impl Fn(&Edge) -> bool,
    ) -> Option<(f64, Spot, Edge)> {
        let mut radius = self.cell.min(reach_mm);
        loop {
            let mut best: Option<(f64, Spot, Edge)> = None;
            let (low, high) = around(spot, spot, radius);
            self.in_box(low, high, &mut |_, edge| {
                let near = edge.near(spot);
                let distance = near.distance(spot);
                let better = best.is_none_or(|(nearest, _, _)| distance < nearest);
                if distance <= radius && better && wanted(edge) {
                    best = Some((distance, near, *edge));
                }
            });
            if best.is_some() || radius >= reach_mm {
                return best;
            }
            radius = (radius * 2.0).min(reach_mm);
        }
    }
}

/// Twice the area of the triangle of two points and the zero.
fn cross(a: Spot, b: Spot) -> f64 {
    a.x * b.y - b.x * a.y
}

pub(super) fn around(a: Spot, b: Spot, margin_mm: f64) -> (Spot, Spot) {
    (
        Spot { x: a.x.min(b.x) - margin_mm, y: a.y.min(b.y) - margin_mm },
        Spot { x: a.x.max(b.x) + margin_mm, y: a.y.max(b.y) + margin_mm },
    )
}

/// Distance of two straight edges in mm, and their nearest points.
pub(super) fn between(one: &Edge, other: &Edge) -> (f64, Spot, Spot) {
    if let Some(at) = crossing(one, other) {
        return (0.0, at, at);
    }
    let pairs = [
        (one.from, other.near(one.from)),
        (one.to, other.near(one.to)),
        (one.near(other.from), other.from),
        (one.near(other.to), other.to),
    ];
    let mut best = (f64::MAX, one.from, other.from);
    for (a, b) in pairs {
        let distance = a.distance(b);
        if distance < best.0 {
            best = (distance, a, b);
        }
    }
    best
}

fn crossing(one: &Edge, other: &Edge) -> Option<Spot> {
    let (u, v) = (one.to.minus(one.from), other.to.minus(other.from));
    let turn = cross(u, v);
    if turn == 0.0 {
        return None;
    }
    let gap = other.from.minus(one.from);
    let (s, t) = (cross(gap, v) / turn, cross(gap, u) / turn);
    let inside = (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t);
    inside.then(|| one.from.towards(one.to, s))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Island, PathSegment};

    fn ring(corners: &[(f64, f64)]) -> Path {
        let points: Vec<Point> =
            corners.iter().chain(corners.first()).map(|&(x, y)| Point::from_mm(x, y)).collect();
        Path::through(&points).unwrap()
    }

    /// A square of 10 with a square hole of 6 and a round island of diameter 2 in it.
    fn nested() -> Region {
        let outer = ring(&[(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)]);
        let hole = ring(&[(2.0, 2.0), (2.0, 8.0), (8.0, 8.0), (8.0, 2.0)]);
        let start = Point::from_mm(6.0, 5.0);
        let round = PathSegment::Arc { to: start, centre: Point::from_mm(5.0, 5.0), clockwise: false };
        let inner = Path { start, segments: vec![round] };
        Region {
            islands: vec![Island { outer, holes: vec![hole] }, Island { outer: inner, holes: Vec::new() }],
        }
    }

    #[test]
    fn points_are_found_in_nested_islands() {
        let edges = Edges::of(&nested());
        let rows = [
            ((1.0, 5.0), Some(0)),
            ((3.0, 5.0), None),
            ((5.0, 5.0), Some(1)),
            ((5.0, 5.9), Some(1)),
            ((5.75, 5.75), None),
            ((9.0, 9.0), Some(0)),
            ((11.0, 5.0), None),
            ((-1.0, 5.0), None),
            ((5.0, -1.0), None),
        ];
        for ((x, y), expected) in rows {
            assert_eq!(edges.island_at(Spot { x, y }), expected, "{x} {y}");
        }
    }

    #[test]
    fn cell_owner_is_the_only_island_with_edges_in_it() {
        let edges = Edges::of(&nested());
        let owners = edges.owners();
        for (cell, owner) in owners.iter().enumerate() {
            let found: std::collections::BTreeSet<u32> =
                edges.items_in(cell).map(|index| edges.edge(index).unwrap().island).collect();
            assert_eq!(*owner, found.first().copied().filter(|_| found.len() == 1), "{found:?}");
        }
        assert!(owners.contains(&Some(0)) && owners.contains(&Some(1)));
        // Without the cells of the pour only, the search finds the inner island and edges that share a cell
        // with it.
        let mut seen = [0, 0];
        let wanted = |cell: usize| owners[cell] != Some(0);
        let side = edges.edge(0).unwrap();
        edges.ahead(&side, (-1.0, 20.0), &wanted, &mut |_, edge| seen[edge.island as usize] += 1);
        assert!(seen[1] > 0 && seen[0] < seen[1], "{seen:?}");
    }

    #[test]
    fn edges_ahead_are_all_found_with_few_checks() {
        let edges = Edges::of(&nested());
        let mut looked = 0;
        for (_, of) in edges.iter() {
            let (middle, along) = (of.middle(), of.to.minus(of.from));
            for (done, radius) in [(-1.0, 0.2), (0.2, 1.0), (1.0, 3.0), (3.0, 20.0)] {
                let mut found = std::collections::BTreeSet::new();
                edges.ahead(&of, (done, radius), &|_| true, &mut |index, _| {
                    found.insert(index);
                });
                looked += found.len();
                for (index, edge) in edges.iter() {
                    let at = edge.near(middle);
                    let (way, distance) = (at.minus(middle), at.distance(middle));
                    let ahead = along.x * way.y - along.y * way.x >= 0.0;
                    let wanted = ahead && distance > done && distance <= radius;
                    assert!(!wanted || found.contains(&index), "{of:?} {done} {radius} {edge:?}");
                }
            }
        }
        let all = edges.iter().count() * edges.iter().count() * 4;
        assert!(looked * 2 < all, "{looked} of {all}");
    }

    #[test]
    fn nearest_edge_is_found_at_any_distance() {
        let edges = Edges::of(&nested());
        let spot = Spot { x: 5.0, y: 5.0 };
        let (distance, _, edge) = edges.nearest(spot, 50.0, &|_| true).unwrap();
        assert!((distance - 1.0).abs() < 2e-3 && edge.island == 1);
        let (distance, at, _) =
            edges.nearest(Spot { x: 30.0, y: 5.0 }, 50.0, &|edge| edge.island == 0).unwrap();
        assert!((distance - 20.0).abs() < 1e-9 && at == Spot { x: 10.0, y: 5.0 });
        assert!(edges.nearest(Spot { x: 30.0, y: 5.0 }, 5.0, &|_| true).is_none());
    }
}
