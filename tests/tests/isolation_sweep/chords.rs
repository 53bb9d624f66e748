//! Paths as chords in a grid, and distances between them, for the isolation sweep only. Lengths in mm.

use annulus_core::geometry::{Path, PathSegment, Point};
use std::collections::HashMap;
use std::f64::consts::TAU;

pub(super) type Spot = [f64; 2];
/// A straight part of a path.
pub(super) type Chord = (Spot, Spot);

/// Side of a cell of the grid.
const CELL: f64 = 0.15;
/// Maximum distance of a chord from its arc.
const CHORD_ERROR: f64 = 0.000_05;

fn spot(at: Point) -> Spot {
    [at.x.mm(), at.y.mm()]
}

pub(super) fn apart(a: Spot, b: Spot) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// The point at a share of a chord.
pub(super) fn between((a, b): Chord, share: f64) -> Spot {
    [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share]
}

/// The point `by` to the right of a chord's middle; none if the chord is too short to have a direction.
pub(super) fn beside((a, b): Chord, by: f64) -> Option<Spot> {
    let length = apart(a, b);
    let middle = between((a, b), 0.5);
    let right = [(b[1] - a[1]) / length * by, (a[0] - b[0]) / length * by];
    (length > 1e-5).then_some([middle[0] + right[0], middle[1] + right[1]])
}

/// Chords at least `step` apart along a path, to check samples only.
pub(super) fn spaced(chords: Vec<Chord>, step: f64) -> impl Iterator<Item = Chord> {
    let mut since = step;
    chords.into_iter().filter(move |(a, b)| {
        since += apart(*a, *b);
        let due = since >= step;
        since = if due { 0.0 } else { since };
        due
    })
}

/// The angle of an arc; equal ends are a full circle.
fn turn(from: Spot, to: Spot, centre: Spot, sign: f64) -> f64 {
    let angle = |at: Spot| (at[1] - centre[1]).atan2(at[0] - centre[0]);
    if from == to { TAU } else { (sign * (angle(to) - angle(from))).rem_euclid(TAU) }
}

/// The chords of one segment, none longer than `most`.
fn of_segment(from: Spot, segment: PathSegment, most: f64, out: &mut Vec<Chord>) -> Spot {
    let mut here = from;
    let mut go = |to: Spot| {
        out.push((here, to));
        here = to;
    };
    match segment {
        PathSegment::Line { to } => {
            let line = (from, spot(to));
            let count = (apart(from, line.1) / most) as u32 + 1;
            (1..count).for_each(|look| go(between(line, f64::from(look) / f64::from(count))));
            go(line.1);
        }
        PathSegment::Arc { to, centre, clockwise } => {
            let (to, centre) = (spot(to), spot(centre));
            let sign = if clockwise { -1.0 } else { 1.0 };
            let turn = turn(from, to, centre, sign);
            let (first, last) = (apart(from, centre), apart(to, centre));
            let longest = (8.0 * CHORD_ERROR * first.max(last)).sqrt().min(most).max(1e-4);
            let count = (turn * first.max(last) / longest) as u32 + 1;
            let begin = (from[1] - centre[1]).atan2(from[0] - centre[0]);
            for look in 1..count {
                let share = f64::from(look) / f64::from(count);
                let (angle, radius) = (begin + sign * turn * share, first + (last - first) * share);
                go([centre[0] + radius * angle.cos(), centre[1] + radius * angle.sin()]);
            }
            go(to);
        }
    }
    here
}

/// The chords of a path, none longer than `most`.
pub(super) fn chords(path: &Path, most: f64) -> Vec<Chord> {
    let mut out = Vec::new();
    path.segments.iter().fold(spot(path.start), |from, segment| of_segment(from, *segment, most, &mut out));
    out
}

fn to_chord(at: Spot, (a, b): Chord) -> f64 {
    let (u, v) = ([b[0] - a[0], b[1] - a[1]], [at[0] - a[0], at[1] - a[1]]);
    let square = u[0] * u[0] + u[1] * u[1];
    let share = if square > 0.0 { ((u[0] * v[0] + u[1] * v[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
    apart(at, between((a, b), share))
}

/// The distance between two chords.
fn chord_to_chord(one: Chord, other: Chord) -> f64 {
    let side = |(a, b): Chord, at: Spot| (b[0] - a[0]) * (at[1] - a[1]) - (b[1] - a[1]) * (at[0] - a[0]);
    let across = |one: Chord, other: Chord| side(one, other.0) * side(one, other.1) < 0.0;
    if across(one, other) && across(other, one) {
        return 0.0;
    }
    let ends =
        [to_chord(one.0, other), to_chord(one.1, other), to_chord(other.0, one), to_chord(other.1, one)];
    ends.into_iter().fold(f64::INFINITY, f64::min)
}

fn cell(mm: f64) -> i64 {
    (mm / CELL).floor() as i64
}

fn cells((a, b): Chord, more: f64) -> impl Iterator<Item = (i64, i64)> {
    let range = move |axis: usize| cell(a[axis].min(b[axis]) - more)..=cell(a[axis].max(b[axis]) + more);
    range(0).flat_map(move |column| range(1).map(move |row| (column, row)))
}

/// Chords, listed in every cell and row that they touch.
#[derive(Default)]
pub(super) struct Grid {
    cells: HashMap<(i64, i64), Vec<Chord>>,
    rows: HashMap<i64, Vec<Chord>>,
}

impl Grid {
    /// The chords of closed or open paths.
    pub(super) fn of<'a>(paths: impl Iterator<Item = &'a Path>) -> Self {
        let mut grid = Self::default();
        for chord in paths.flat_map(|path| chords(path, CELL)) {
            cells(chord, 0.0).for_each(|cell| grid.cells.entry(cell).or_default().push(chord));
            for row in cell(chord.0[1].min(chord.1[1]))..=cell(chord.0[1].max(chord.1[1])) {
                grid.rows.entry(row).or_default().push(chord);
            }
        }
        grid
    }

    /// The distance from a chord to the nearest one in the grid; infinity beyond `most`.
    pub(super) fn distance(&self, chord: Chord, most: f64) -> f64 {
        let near = cells(chord, most).filter_map(|cell| self.cells.get(&cell)).flatten();
        let nearest = near.map(|other| chord_to_chord(chord, *other)).fold(f64::INFINITY, f64::min);
        if nearest <= most { nearest } else { f64::INFINITY }
    }

    /// The distance from a point to the nearest chord; infinity beyond `most`.
    pub(super) fn distance_of(&self, at: Spot, most: f64) -> f64 {
        self.distance((at, at), most)
    }

    /// True if a chord is at most this far away.
    pub(super) fn is_near(&self, at: Spot, most: f64) -> bool {
        let mut near = cells((at, at), most).filter_map(|cell| self.cells.get(&cell)).flatten();
        near.any(|chord| to_chord(at, *chord) <= most)
    }

    /// True if a point is inside the closed paths of the grid.
    pub(super) fn contains(&self, at: Spot) -> bool {
        let row = self.rows.get(&cell(at[1])).map(Vec::as_slice).unwrap_or_default();
        let crossed = row.iter().filter(|(a, b)| {
            (a[1] > at[1]) != (b[1] > at[1]) && at[0] < a[0] + (at[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        });
        crossed.count() % 2 == 1
    }
}
