//! The straight edges of a region in a grid: whose copper is here, which edge is nearest, which edges face each other.
//!
//! ```text
//!   ┌────┬────┬────┐     every cell lists the edges that cross it; inside is on the left of every edge, so the
//!   │  ╲ │    │    │     first edge met to the right of a place says whether the place is inside, and of what
//!   ├───╲┼────┼────┤
//!   │    ╲──x▶│╱   │
//!   └────┴────┴────┘
//! ```
//!
//! Comes in: a [`Region`]. Goes out: islands, edges and distances in mm. Does not know nets or tools.

use crate::geometry::{Path, Point, Region};

/// Chords are at most this far from their arcs, in mm.
const CHORD_ERROR_MM: f64 = 0.001;
/// More than what rounding does to a place, in mm.
const SLACK_MM: f64 = 1e-6;
/// Not more cells than this.
const MOST_CELLS: f64 = 1_000_000.0;

/// A place in mm.
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

    /// The place at `share` of the way to `other`.
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

/// A straight edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    pub(super) from: Spot,
    pub(super) to: Spot,
    /// The island that it bounds.
    pub(super) island: u32,
    /// The ring that it is part of, counted over the region.
    pub(super) ring: u32,
    /// Length of the ring before it, in mm.
    pub(super) along_mm: f64,
}

impl Edge {
    /// The place on it nearest to `spot`, as share of its length.
    pub(super) fn share_near(&self, spot: Spot) -> f64 {
        let way = self.to.minus(self.from);
        let square = way.dot(way);
        if square > 0.0 { (spot.minus(self.from).dot(way) / square).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// The place on it nearest to `spot`.
    pub(super) fn near(&self, spot: Spot) -> Spot {
        self.from.towards(self.to, self.share_near(spot))
    }

    pub(super) fn length(&self) -> f64 {
        self.from.distance(self.to)
    }

    /// The place half way along it.
    pub(super) fn middle(&self) -> Spot {
        self.from.towards(self.to, 0.5)
    }

    /// Whether its box and another one have a place in common.
    fn meets(&self, low: Spot, high: Spot) -> bool {
        self.from.x.min(self.to.x) <= high.x
            && self.from.x.max(self.to.x) >= low.x
            && self.from.y.min(self.to.y) <= high.y
            && self.from.y.max(self.to.y) >= low.y
    }
}

/// A closed chain of edges.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ring {
    /// In mm.
    pub(super) length_mm: f64,
    /// In mm²; below zero for the edge of a hole.
    pub(super) area_mm2: f64,
}

/// The edges of a region.
#[derive(Clone, Debug)]
pub(super) struct Edges {
    pub(super) edges: Vec<Edge>,
    pub(super) rings: Vec<Ring>,
    /// Twice the area that the edges of a ring before each sweep, seen from the zero; empty for edges that need not close.
    swept: Vec<f64>,
    low: Spot,
    cell: f64,
    columns: usize,
    rows: usize,
    /// Where the list of each cell starts in `items`.
    starts: Vec<u32>,
    items: Vec<u32>,
}

/// A path as places, arcs as chords.
pub(super) fn spots(path: &Path) -> Vec<Spot> {
    path.flattened(CHORD_ERROR_MM).into_iter().map(Spot::of).collect()
}

impl Edges {
    pub(super) fn of(region: &Region) -> Self {
        let mut edges = Vec::new();
        let (mut rings, mut swept) = (Vec::new(), Vec::new());
        for (island, shape) in (0..).zip(&region.islands) {
            for path in shape.paths() {
                let ring = rings.len() as u32;
                let (mut along, mut area) = (0.0, 0.0);
                let spots = spots(path);
                for (&from, &to) in spots.iter().zip(spots.iter().skip(1)) {
                    edges.push(Edge { from, to, island, ring, along_mm: along });
                    swept.push(2.0 * area);
                    along += from.distance(to);
                    area += cross(from, to) / 2.0;
                }
                rings.push(Ring { length_mm: along, area_mm2: area });
            }
        }
        Self { swept, ..Self::gridded(edges, rings) }
    }

    /// The area between a ring from one place of it on to another, by the numbers of their edges, and the straight way back.
    pub(super) fn area_between(&self, (first, from): (u32, Spot), (last, to): (u32, Spot)) -> f64 {
        let edge = |number: u32| self.edges.get(number as usize);
        let (Some(one), Some(other)) = (edge(first), edge(last)) else { return 0.0 };
        let before = |number: u32| self.swept.get(number as usize).copied().unwrap_or_default();
        let whole = before(last) - before(first) - cross(one.from, one.to);
        (cross(from, one.to) + whole + cross(other.from, to) + cross(to, from)) / 2.0
    }

    /// Edges that need not close, in a grid.
    pub(super) fn gridded(edges: Vec<Edge>, rings: Vec<Ring>) -> Self {
        let ends = || edges.iter().flat_map(|edge| [edge.from, edge.to]);
        let low = ends().fold(Spot { x: f64::MAX, y: f64::MAX }, |low, at| Spot {
            x: low.x.min(at.x),
            y: low.y.min(at.y),
        });
        let high = ends().fold(low, |high, at| Spot { x: high.x.max(at.x), y: high.y.max(at.y) });
        let low = if edges.is_empty() { Spot::default() } else { low };
        let (width, height) = ((high.x - low.x).max(0.0), (high.y - low.y).max(0.0));
        let fair = libm::sqrt(width * height / (edges.len().max(1) as f64));
        let cell =
            fair.clamp(0.05, 5.0).max(libm::sqrt(width * height / MOST_CELLS)).max((width + height) / 1e5);
        let (columns, rows) = ((width / cell) as usize + 1, (height / cell) as usize + 1);
        let mut grid = Self {
            edges,
            rings,
            swept: Vec::new(),
            low,
            cell,
            columns,
            rows,
            starts: vec![0; columns * rows + 1],
            items: Vec::new(),
        };
        grid.fill();
        grid
    }

    /// Counts first, then writes: two walks over all edges.
    fn fill(&mut self) {
        let mut counts = vec![0_u32; self.columns * self.rows + 1];
        for edge in &self.edges {
            self.cells_of(edge, &mut |cell| {
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
        for (index, edge) in (0..).zip(&self.edges) {
            self.cells_of(edge, &mut |cell| {
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

    /// Calls `each` with every cell that `edge` may cross: row by row, from where it enters the row to where it leaves.
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
            // A little wider, for what rounding does at the borders of cells.
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

    /// For every cell the island that all edges in it bound; none where there are several, or no edges.
    pub(super) fn owners(&self) -> Vec<Option<u32>> {
        let owner = |cell| {
            let mut islands = self.items_in(cell).filter_map(|index| self.edges.get(index as usize));
            let first = islands.next()?.island;
            islands.all(|edge| edge.island == first).then_some(first)
        };
        (0..self.columns * self.rows).map(owner).collect()
    }

    /// Longer than any way between two of its places, in mm.
    pub(super) fn extent(&self) -> f64 {
        (self.columns + self.rows) as f64 * self.cell
    }

    /// The island that `spot` is in.
    pub(super) fn island_at(&self, spot: Spot) -> Option<u32> {
        self.right_of(spot).filter(|edge| edge.to.y > edge.from.y).map(|edge| edge.island)
    }

    /// The first edge straight to the right of `spot`.
    pub(super) fn right_of(&self, spot: Spot) -> Option<&Edge> {
        let outside =
            |value: f64, low: f64, count: usize| value < low || value > low + count as f64 * self.cell;
        if outside(spot.x, self.low.x, self.columns) || outside(spot.y, self.low.y, self.rows) {
            return None;
        }
        let row = self.row(spot.y);
        for column in self.column(spot.x)..self.columns {
            let border = self.low.x + (column + 1) as f64 * self.cell;
            let mut first: Option<(f64, &Edge)> = None;
            for edge in self.items_of(row, column).filter_map(|index| self.edges.get(index as usize)) {
                if (edge.from.y <= spot.y) == (edge.to.y <= spot.y) {
                    continue;
                }
                let share = (spot.y - edge.from.y) / (edge.to.y - edge.from.y);
                let x = edge.from.x + (edge.to.x - edge.from.x) * share;
                if x > spot.x && first.is_none_or(|(nearest, _)| x < nearest) {
                    first = Some((x, edge));
                }
            }
            // What is met beyond this cell may not be the first.
            if let Some((_, edge)) = first.filter(|(x, _)| *x <= border || column + 1 == self.columns) {
                return Some(edge);
            }
        }
        None
    }

    /// Calls `each` with every edge that may come into the box; an edge may come more than once.
    pub(super) fn in_box(&self, low: Spot, high: Spot, each: &mut impl FnMut(u32, &Edge)) {
        for row in self.row(low.y)..=self.row(high.y) {
            for column in self.column(low.x)..=self.column(high.x) {
                for index in self.items_of(row, column) {
                    if let Some(edge) = self.edges.get(index as usize).filter(|edge| edge.meets(low, high)) {
                        each(index, edge);
                    }
                }
            }
        }
    }

    /// Calls `each` with every edge that has a place ahead of the middle of an edge, farther than `done` mm and at most `radius` mm
    /// away, in those cells alone for which `wanted` holds; with others too, and with an edge more than once.
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
        // From the place to the two sides of a row or column of cells.
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
                    if let Some(edge) = self.edges.get(index as usize).filter(|edge| edge.meets(low, high)) {
                        each(index, edge);
                    }
                }
            }
        }
    }

    /// Whether the straight way between two places crosses an edge farther than `margin_mm` mm from both.
    pub(super) fn cross(&self, from: Spot, to: Spot, margin_mm: f64) -> bool {
        let way = Edge { from, to, island: 0, ring: 0, along_mm: 0.0 };
        let mut met = false;
        self.cells_of(&way, &mut |cell| {
            let mut items = self.items_in(cell).filter_map(|index| self.edges.get(index as usize));
            met = met
                || items.any(|edge| {
                    let at = crossing(&way, edge);
                    at.is_some_and(|at| at.distance(from) > margin_mm && at.distance(to) > margin_mm)
                });
        });
        met
    }

    /// The size of a cell, in mm.
    pub(super) fn cell(&self) -> f64 {
        self.cell
    }

    /// The nearest edge for which `wanted` holds, at most `reach_mm` mm away: its distance and the place on it.
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

/// Twice the area of the triangle of two places and the zero.
fn cross(a: Spot, b: Spot) -> f64 {
    a.x * b.y - b.x * a.y
}

/// The box around two places, grown by `margin_mm`.
pub(super) fn around(a: Spot, b: Spot, margin_mm: f64) -> (Spot, Spot) {
    (
        Spot { x: a.x.min(b.x) - margin_mm, y: a.y.min(b.y) - margin_mm },
        Spot { x: a.x.max(b.x) + margin_mm, y: a.y.max(b.y) + margin_mm },
    )
}

/// The two places of two straight edges that are nearest to each other, and how far apart they are in mm.
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

    /// A square of 10 with a square hole of 6 in which a round island of diameter 2 lies.
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
    fn places_are_found_in_nested_islands() {
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
    fn a_cell_is_owned_by_the_one_island_whose_edges_are_in_it() {
        let edges = Edges::of(&nested());
        let owners = edges.owners();
        for (cell, owner) in owners.iter().enumerate() {
            let found: std::collections::BTreeSet<u32> =
                edges.items_in(cell).map(|index| edges.edges[index as usize].island).collect();
            assert_eq!(*owner, found.first().copied().filter(|_| found.len() == 1), "{found:?}");
        }
        assert!(owners.contains(&Some(0)) && owners.contains(&Some(1)));
        // Without the cells of the pour, what is found is the island in it and what shares a cell with that.
        let mut seen = [0, 0];
        let wanted = |cell: usize| owners[cell] != Some(0);
        let side = edges.edges[0];
        edges.ahead(&side, (-1.0, 20.0), &wanted, &mut |_, edge| seen[edge.island as usize] += 1);
        assert!(seen[1] > 0 && seen[0] < seen[1], "{seen:?}");
    }

    #[test]
    fn all_that_lies_ahead_is_found_and_less_is_looked_at_than_is_there() {
        let edges = Edges::of(&nested());
        let mut looked = 0;
        for of in &edges.edges {
            let (middle, along) = (of.middle(), of.to.minus(of.from));
            for (done, radius) in [(-1.0, 0.2), (0.2, 1.0), (1.0, 3.0), (3.0, 20.0)] {
                let mut found = std::collections::BTreeSet::new();
                edges.ahead(of, (done, radius), &|_| true, &mut |index, _| {
                    found.insert(index);
                });
                looked += found.len();
                for (index, edge) in (0..).zip(&edges.edges) {
                    let at = edge.near(middle);
                    let (way, distance) = (at.minus(middle), at.distance(middle));
                    let ahead = along.x * way.y - along.y * way.x >= 0.0;
                    let wanted = ahead && distance > done && distance <= radius;
                    assert!(!wanted || found.contains(&index), "{of:?} {done} {radius} {edge:?}");
                }
            }
        }
        let all = edges.edges.len() * edges.edges.len() * 4;
        assert!(looked * 2 < all, "{looked} of {all}");
    }

    #[test]
    fn the_nearest_edge_is_found_however_far() {
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
