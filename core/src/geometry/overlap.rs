//! Shapes laid over each other by weight, and outlines traced, worked on only where edges come near each other.
//!
//! ```text
//!    ┌──────────────────┐     dark ─1, clear ─2 … ─4: the contours 2 and 3 cross one another's list nowhere, so all that is
//!    │ 1   ╭2╮   ╭3╮   ╭┼─╮   asked of them is what lies about them: here they become holes of 1 as they are.
//!    │     ╰─╯   ╰─╯   ╰┼4╯   1 and 4 meet: these two are laid over each other by the overlay, in a box that stands
//!    └──────────────────┘     for what lies about both
//!
//!    ───────────●───▶         what lies about a place: the edges met by a ray to the left, half a nanometre off all
//!       ↓   ↑   ↓             corners, each counted down less up
//! ```
//!
//! Comes in: shapes of the overlay in lists with weights; shapes of one list do not overlap. Goes out: the shapes where the
//! sum of `weight` times winding is above zero. As exact as the overlay. Where finding out would take more than a fixed
//! number of comparisons for each piece, everything is left to the overlay. Knows no boards.

use super::clusters::{Extent, clusters, groups, joined, unite};
use super::sheet::{Edge, Fill, Found, Shape, edges_of, extent_of, extent_of_edges, frame, run, turned};

/// Groups with fewer edges are left to the overlay.
const FEW_EDGES: usize = 1_000;
/// Edges in a row that share a box.
const CHUNK: usize = 16;
/// Boxes nearer than this, in nm, meet: the overlay moves corners by less.
const NEAR_NM: i32 = 8;
/// Comparisons spent on each chunk, on average, before all is left to the overlay.
const MOST_COMPARISONS: usize = 2_000;
/// More rows than this are not made.
const MOST_ROWS: i64 = 1_024;
/// Where places are wound about more often than this by what lies about them, all is left to the overlay.
const MOST_TURNS: i32 = 16;
/// How far the box about contours that meet is from them, in nm.
const FRAME_NM: i32 = 1_000;

/// A closed chain of edges, inside on its left.
struct Contour {
    weight: i32,
    hole: bool,
    edges: Vec<Found>,
}

/// Some edges in a row of one contour.
struct Chunk {
    contour: usize,
    first: usize,
    extent: Extent,
}

/// The edges of contours in level rows.
struct Rows<'a> {
    contours: &'a [Contour],
    chunks: Vec<Chunk>,
    low: i64,
    height: i64,
    rows: Vec<Vec<usize>>,
    /// Comparisons that are left.
    budget: usize,
}

/// Shapes laid over each other: where the sum of `weight` times their windings is above zero. A group of shapes
/// that hang together by their boxes is worked on apart, and stays as it is where all are of one list.
pub(super) fn weighed<const N: usize>(lists: [(i32, Vec<Shape>); N]) -> Vec<Shape> {
    let all: Vec<(i32, Shape)> = lists
        .into_iter()
        .flat_map(|(weight, shapes)| shapes.into_iter().map(move |shape| (weight, shape)))
        .collect();
    let extents: Vec<_> = all.iter().map(|(_, shape)| extent_of(shape)).collect();
    let mut all: Vec<Option<(i32, Shape)>> = all.into_iter().map(Some).collect();
    let mut found = Vec::new();
    for group in clusters(&extents) {
        let group: Vec<(i32, Shape)> =
            group.into_iter().filter_map(|index| all.get_mut(index).and_then(Option::take)).collect();
        let first = group.first().map_or(0, |(weight, _)| *weight);
        if group.iter().any(|(weight, _)| *weight != first) {
            found.extend(laid(group));
        } else if first > 0 {
            found.extend(group.into_iter().map(|(_, shape)| shape));
        }
    }
    found
}

/// The shapes of one group laid over each other.
fn laid(group: Vec<(i32, Shape)>) -> Vec<Shape> {
    let size: usize = group.iter().flat_map(|(_, shape)| shape).map(Vec::len).sum();
    let apart = if size < FEW_EDGES { None } else { laid_apart(&group) };
    apart.unwrap_or_else(|| {
        let heavy = group.iter().flat_map(|(weight, shape)| heavy(*weight, edges_of(shape)));
        run(heavy, Fill::Positive)
    })
}

/// Edges as often as they weigh, turned where they weigh less than nothing.
fn heavy(weight: i32, edges: impl Iterator<Item = Edge> + Clone) -> impl Iterator<Item = Edge> {
    let turn = move |edge: Edge| if weight < 0 { turned(edge) } else { edge };
    std::iter::repeat_n(edges, weight.unsigned_abs() as usize).flatten().map(turn)
}

fn laid_apart(group: &[(i32, Shape)]) -> Option<Vec<Shape>> {
    let contours: Vec<Contour> = group
        .iter()
        .flat_map(|&(weight, ref shape)| {
            let contour = move |(index, edges): (usize, &Vec<Found>)| Contour {
                weight,
                hole: index > 0,
                edges: edges.clone(),
            };
            shape.iter().enumerate().map(contour)
        })
        .collect();
    let mut rows = Rows::of(&contours)?;
    let weight = |number: usize| contours.get(number).map(|contour| contour.weight);
    let meeting = rows.meeting(|one, two| weight(one) != weight(two))?;
    let mut found: Vec<Contour> = Vec::new();
    for together in meeting {
        match together.as_slice() {
            &[alone] => found.extend(rows.kept(alone)?),
            several => found.extend(rows.crossed(several, Fill::Positive)?),
        }
    }
    nested(found)
}

/// What is inside of outlines by `fill`: those that meet are laid over each other, group by group. None where that is
/// better done at once.
pub(super) fn traced(outlines: &[&[Edge]], fill: Fill) -> Option<Vec<Shape>> {
    let laid = |edge: &Edge| Found { a: edge.a, b: edge.b, fill: 0, data: edge.data };
    let contour =
        |outline: &&[Edge]| Contour { weight: 1, hole: false, edges: outline.iter().map(laid).collect() };
    let some = outlines.iter().filter(|outline| !outline.is_empty());
    let contours: Vec<Contour> = some.map(contour).collect();
    let mut rows = Rows::of(&contours)?;
    let meeting = rows.meeting(|one, two| one != two)?;
    if meeting.len() < 2 {
        return None;
    }
    let mut found: Vec<Contour> = Vec::new();
    for together in meeting {
        found.extend(rows.crossed(&together, fill)?);
    }
    nested(found)
}

/// The height between two whole nanometres that a contour's longest climb crosses in its middle.
fn level(contour: &Contour) -> Option<f64> {
    let climb = |edge: &&Found| (i64::from(edge.b.y) - i64::from(edge.a.y)).abs();
    let steepest = contour.edges.iter().max_by_key(climb).filter(|edge| climb(edge) > 0)?;
    Some((i64::from(steepest.a.y) + i64::from(steepest.b.y)).div_euclid(2) as f64 + 0.5)
}

/// Where an edge crosses a level, and whether it goes down there.
fn crossed_at(edge: &Found, y: f64) -> Option<(f64, bool)> {
    let (from, to) = (f64::from(edge.a.y), f64::from(edge.b.y));
    if (from < y) == (to < y) {
        return None;
    }
    let (start, end) = (f64::from(edge.a.x), f64::from(edge.b.x));
    Some((start + (end - start) * ((y - from) / (to - from)), to < from))
}

/// A place of a contour: its leftmost one on a level that it crosses.
fn place(contour: &Contour) -> Option<(f64, f64)> {
    let y = level(contour)?;
    let crossings = contour.edges.iter().filter_map(|edge| crossed_at(edge, y));
    crossings.map(|(x, _)| x).min_by(f64::total_cmp).map(|x| (x, y))
}

impl<'a> Rows<'a> {
    /// None where the rows would be too full.
    fn of(contours: &'a [Contour]) -> Option<Self> {
        let mut chunks = Vec::new();
        for (contour, Contour { edges, .. }) in contours.iter().enumerate() {
            for (number, some) in edges.chunks(CHUNK).enumerate() {
                chunks.push(Chunk { contour, first: number * CHUNK, extent: extent_of_edges(some) });
            }
        }
        let low = chunks.iter().map(|chunk| i64::from(chunk.extent[1])).min()?;
        let high = chunks.iter().map(|chunk| i64::from(chunk.extent[3])).max()?;
        let count = (libm::sqrt(chunks.len() as f64) as i64 * 2).clamp(1, MOST_ROWS);
        let height = (high - low) / count + 1;
        let mut budget = chunks.len().saturating_mul(MOST_COMPARISONS);
        let mut rows = vec![Vec::new(); count as usize];
        for (number, Chunk { extent: [_, bottom, _, top], .. }) in chunks.iter().enumerate() {
            let row = |y: i32, by: i32| ((i64::from(y) + i64::from(by) - low).max(0) / height) as usize;
            let (first, last) = (row(*bottom, -NEAR_NM), row(*top, NEAR_NM));
            for list in rows.iter_mut().take(last + 1).skip(first) {
                budget = budget.checked_sub(1)?;
                list.push(number);
            }
        }
        for row in &mut rows {
            row.sort_by_key(|&number| chunks.get(number).map(|chunk| chunk.extent[0]));
        }
        Some(Self { contours, chunks, low, height, rows, budget })
    }

    /// The contours that meet others with which they `count`, gathered; the others alone.
    fn meeting(&mut self, count: impl Fn(usize, usize) -> bool) -> Option<Vec<Vec<usize>>> {
        let mut parents: Vec<usize> = (0..self.contours.len()).collect();
        for row in &self.rows {
            let mut open: Vec<&Chunk> = Vec::new();
            for chunk in row.iter().filter_map(|&number| self.chunks.get(number)) {
                let [left, low, _, high] = chunk.extent;
                open.retain(|other| other.extent[2].saturating_add(NEAR_NM) >= left);
                self.budget = self.budget.checked_sub(open.len())?;
                for other in &open {
                    let [_, bottom, _, top] = other.extent;
                    let near = bottom.saturating_sub(NEAR_NM) <= high && low <= top.saturating_add(NEAR_NM);
                    if near && count(other.contour, chunk.contour) {
                        unite(&mut parents, other.contour, chunk.contour);
                    }
                }
                open.push(chunk);
            }
        }
        Some(groups(&mut parents))
    }

    /// Calls `each` with every crossing to the left of a place: the contour, where, and whether its edge goes down.
    fn left_of(&mut self, (x, y): (f64, f64), each: &mut impl FnMut(usize, f64, bool)) -> Option<()> {
        let level = libm::floor(y) as i32;
        let row = self.rows.get(((i64::from(level) - self.low).max(0) / self.height) as usize)?;
        let here = row.iter().filter_map(|&number| self.chunks.get(number));
        for chunk in here.take_while(|chunk| f64::from(chunk.extent[0]) < x) {
            self.budget = self.budget.checked_sub(1)?;
            let [_, bottom, _, top] = chunk.extent;
            if bottom > level || level >= top {
                continue;
            }
            let edges = self.contours.get(chunk.contour)?.edges.iter().skip(chunk.first).take(CHUNK);
            for (at, down) in edges.filter_map(|edge| crossed_at(edge, y)).filter(|(at, _)| *at < x) {
                each(chunk.contour, at, down);
            }
        }
        Some(())
    }

    /// The sum of weights at a place, of those contours that are `counted`.
    fn about(&mut self, at: (f64, f64), counted: impl Fn(usize, &Contour) -> bool) -> Option<i32> {
        let (mut sum, contours) = (0_i32, self.contours);
        self.left_of(at, &mut |number, _, down| {
            if let Some(contour) = contours.get(number).filter(|contour| counted(number, contour)) {
                sum = sum.saturating_add(if down { contour.weight } else { -contour.weight });
            }
        })?;
        Some(sum)
    }

    /// A contour that meets none of another list: as it is, turned round, or gone. None where the budget is used up.
    fn kept(&mut self, number: usize) -> Option<Option<Contour>> {
        let contours = self.contours;
        let contour = contours.get(number)?;
        let Some(at) = place(contour) else { return Some(None) };
        let others = self.about(at, |_, other| other.weight != contour.weight)?;
        let (outside, inside) = (others > 0, others.saturating_add(contour.weight) > 0);
        if outside == inside {
            return Some(None);
        }
        let back = |edge: &Found| Found { a: edge.b, b: edge.a, fill: edge.fill, data: edge.data };
        let edges =
            if inside { contour.edges.clone() } else { contour.edges.iter().rev().map(back).collect() };
        Some(Some(Contour { weight: 1, hole: contour.hole == inside, edges }))
    }

    /// Contours that meet, laid over each other.
    fn crossed(&mut self, numbers: &[usize], fill: Fill) -> Option<Vec<Contour>> {
        let all = self.contours;
        let contours: Vec<&Contour> = numbers.iter().filter_map(|&number| all.get(number)).collect();
        // What is flat has no inside.
        let Some(at) = contours.iter().find_map(|contour| place(contour)) else { return Some(Vec::new()) };
        let about = self.about(at, |number, _| numbers.binary_search(&number).is_err())?;
        if about.abs() > MOST_TURNS {
            return None;
        }
        let ours = contours.iter().flat_map(|contour| {
            heavy(
                contour.weight,
                contour.edges.iter().map(|edge| Edge { a: edge.a, b: edge.b, data: edge.data }),
            )
        });
        let extent = contours.iter().map(|contour| extent_of_edges(&contour.edges)).reduce(joined)?;
        let (sides, [left, ..]) = frame(extent, FRAME_NM)?;
        let shapes = run(ours.chain(heavy(about, sides.into_iter())), fill);
        let is_frame = |edges: &[Found]| edges.iter().any(|edge| edge.a.x == left);
        let contours = shapes.into_iter().flat_map(|shape| shape.into_iter().enumerate());
        let wanted = contours.filter(|(_, edges)| !is_frame(edges));
        Some(wanted.map(|(index, edges)| Contour { weight: 1, hole: index > 0, edges }).collect())
    }
}

/// How large the box of a contour is, in nm².
fn room(contour: &Contour) -> i128 {
    let [left, low, right, high] = extent_of_edges(&contour.edges).map(i128::from);
    (right - left) * (high - low)
}

/// Contours as shapes: every hole with the outer contour that it lies in, the innermost of these.
fn nested(contours: Vec<Contour>) -> Option<Vec<Shape>> {
    if contours.is_empty() {
        return Some(Vec::new());
    }
    let mut rows = Rows::of(&contours)?;
    let mut owners = Vec::new();
    for (number, hole) in contours.iter().enumerate().filter(|(_, contour)| contour.hole) {
        let mut crossed: Vec<(usize, i32)> = Vec::new();
        rows.left_of(place(hole)?, &mut |other, _, down| crossed.push((other, if down { 1 } else { -1 })))?;
        crossed.sort_unstable();
        let around = crossed.chunk_by(|one, two| one.0 == two.0);
        let around = around.filter(|same| same.iter().map(|(_, turn)| turn).sum::<i32>() > 0);
        let owner = around.filter_map(|same| same.first()).map(|(other, _)| *other);
        let room = |other: &usize| contours.get(*other).map(room);
        owners.push((number, owner.min_by_key(room)?));
    }
    let mut edges: Vec<Option<Contour>> = contours.into_iter().map(Some).collect();
    let mut shapes: Vec<Shape> = vec![Shape::new(); edges.len()];
    for (shape, contour) in shapes.iter_mut().zip(&mut edges) {
        shape.extend(contour.take_if(|contour| !contour.hole).map(|contour| contour.edges));
    }
    for (hole, owner) in owners {
        let hole = edges.get_mut(hole).and_then(Option::take)?;
        shapes.get_mut(owner)?.push(hole.edges);
    }
    shapes.retain(|shape| !shape.is_empty());
    Some(shapes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::combine::{CRUMB_NM, Rule, combine};
    use crate::geometry::sheet::Sheet;
    use crate::geometry::{Bounds, Point, area_mm2, circle, rebuild, rectangle};
    use crate::units::Length;

    /// Round spots and plates by chance, some of them across each other, some in each other.
    fn group(seed: u64) -> (Vec<(i32, Shape)>, Sheet) {
        let mut chance = seed;
        let mut share = || {
            chance = chance.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (chance >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut sheet = Sheet::default();
        let mut group = Vec::new();
        for (weight, count, size) in [(1, 4, 0.5), (-1, 60, 1.6), (2, 60, 0.9)] {
            if weight == 1 {
                let plate = |low: f64, high: f64| {
                    let (min, max) = (Point::from_mm(low, low), Point::from_mm(high, high));
                    rectangle(Bounds { min, max })
                };
                sheet.path(&plate(1.0, 15.0));
                sheet.path(&plate(15.5, 19.0));
            }
            for _ in 0..count {
                let at = Point::from_mm(20.0 * share(), 20.0 * share());
                sheet.path(&circle(at, Length::from_mm(size * (0.2 + share()))));
            }
            group.extend(sheet.trace(Fill::NonZero).into_iter().map(|shape| (weight, shape)));
        }
        (group, sheet)
    }

    #[test]
    fn what_is_worked_on_apart_is_what_the_overlay_makes_of_the_whole() {
        for seed in 1..=20 {
            let (group, sheet) = group(seed);
            let edges = || group.iter().flat_map(|(weight, shape)| heavy(*weight, edges_of(shape)));
            let whole = rebuild::region(&run(edges(), Fill::Positive), &sheet.circles, CRUMB_NM);
            let apart = rebuild::region(&laid_apart(&group).unwrap(), &sheet.circles, CRUMB_NM);
            let holes = |region: &crate::geometry::Region| -> usize {
                region.islands.iter().map(|island| island.holes.len()).sum()
            };
            assert!(holes(&whole) > 3, "seed {seed}");
            assert_eq!(
                (apart.islands.len(), holes(&apart)),
                (whole.islands.len(), holes(&whole)),
                "seed {seed}"
            );
            let off = area_mm2(&combine(&apart, &whole, Rule::Xor));
            assert!(off < 1e-4, "seed {seed}: {off} mm²");
        }
    }

    #[test]
    fn outlines_traced_group_by_group_are_what_the_overlay_makes_of_all() {
        for seed in 1..=10 {
            let (group, sheet) = group(seed);
            for fill in [Fill::NonZero, Fill::EvenOdd, Fill::Positive] {
                let edges = |shape: &Shape| -> Vec<Edge> { edges_of(shape).collect() };
                let all: Vec<Vec<Edge>> = group.iter().map(|(_, shape)| edges(shape)).collect();
                let outlines: Vec<&[Edge]> = all.iter().map(Vec::as_slice).collect();
                let whole = run(all.iter().flatten().copied(), fill);
                let whole = rebuild::region(&whole, &sheet.circles, CRUMB_NM);
                let apart = rebuild::region(&traced(&outlines, fill).unwrap(), &sheet.circles, CRUMB_NM);
                assert_eq!(apart.islands.len(), whole.islands.len(), "seed {seed} {fill:?}");
                let off = area_mm2(&combine(&apart, &whole, Rule::Xor));
                assert!(off < 1e-4, "seed {seed} {fill:?}: {off} mm²");
            }
        }
    }
}
