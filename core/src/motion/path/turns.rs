//! A chain on a machine with play: cut into paths at the turns of the axes that have it.
//!
//! ```text
//! x ^    /\        the motor takes the play up at rest, while the axis stands; on the way down in its
//!   |   /  \      numbers it stands lower by the play
//!   |  /    \
//!   +----------> t
//! ```
//!
//! Comes in: a [`Chain`], the play of X and Y in mm. Goes out: paths of the axes, from rest to rest. Does not know motors.

use super::PlannedPath;
use super::curve::{Curve, PathPoint};
use super::plan::{Chain, Fed, PathRules, along_curves, check, curves};
use crate::diagnostic::Diagnostic;
use crate::motion::profile::Limits;

/// Parts of a curve shorter than this are not cut off it: a nanometre.
const SHORTEST_PART_MM: f64 = 1e-6;

/// An axis that goes less far than this does not turn: a nanometre.
const STANDS_MM: f64 = 1e-6;

/// The fastest paths along `chain`, cut where an axis of the plane that has play turns: paths that follow each other, in each of
/// which no such axis turns, and none of which takes longer than it may. `play_mm` is the play of X and Y.
///
/// With every path comes, for X and Y, which way the motor goes: down where it is true. What stands keeps the way of
/// before, at first `down`. The paths are where the axes are, not the motors.
pub fn turns(
    chain: &Chain,
    (play_mm, down): ([f64; 2], [bool; 2]),
    axes: &[Limits; 3],
    rules: &PathRules,
) -> Result<Vec<([bool; 2], PlannedPath)>, Diagnostic> {
    check(chain, axes, rules)?;
    let mut found: Vec<([bool; 2], PlannedPath)> = Vec::new();
    let (mut start, mut one_way, mut down_now) = (chain.start, Vec::<Fed>::new(), down);
    let mut drive = |start: PathPoint, one_way: &[Fed], down_now: [bool; 2]| {
        let mut paths = Vec::new();
        in_time(start, one_way, (axes, rules), &mut paths);
        let end = paths.last().map_or(start, PlannedPath::end);
        found.extend(paths.into_iter().map(|path| (down_now, path)));
        end
    };
    for piece in curves(chain)?.iter().flat_map(|fed| monotone(fed, play_mm)) {
        let next = going(&piece.curve, play_mm, down_now);
        if next != down_now && !one_way.is_empty() {
            start = drive(start, &one_way, down_now);
            one_way.clear();
        }
        down_now = next;
        one_way.push(piece);
    }
    if !one_way.is_empty() {
        drive(start, &one_way, down_now);
    }
    Ok(found)
}

/// The paths along curves that go on from each other: halves of halves, until none takes longer than it may.
fn in_time(start: PathPoint, curves: &[Fed], how: (&[Limits; 3], &PathRules), paths: &mut Vec<PlannedPath>) {
    let (axes, rules) = how;
    let path = along_curves(start, curves, axes, rules);
    let halves = match curves {
        _ if path.duration_s() <= rules.longest_s => None,
        [] => None,
        [alone] => {
            let length = alone.curve.length_mm();
            let half = |from: f64, to: f64| vec![Fed { curve: alone.curve.cut(from, to), ..*alone }];
            (length > 2.0 * SHORTEST_PART_MM).then(|| [half(0.0, length / 2.0), half(length / 2.0, length)])
        }
        many => Some(<[&[Fed]; 2]>::from(many.split_at(many.len() / 2)).map(<[Fed]>::to_vec)),
    };
    let Some([first, second]) = halves else { return paths.push(path) };
    in_time(start, &first, how, paths);
    let middle = paths.last().map_or(start, PlannedPath::end);
    in_time(middle, &second, how, paths);
}

/// The parts of a curve in which no axis with play turns.
fn monotone(fed: &Fed, play_mm: [f64; 2]) -> Vec<Fed> {
    let length = fed.curve.length_mm();
    let played = (0..2).filter(|axis| play_mm[*axis] > 0.0);
    let mut ends: Vec<f64> =
        played.flat_map(|axis| fed.curve.stretches(axis)).map(|stretch| stretch.to_mm).collect();
    ends.push(length);
    ends.sort_by(f64::total_cmp);
    let mut from = 0.0;
    let mut parts = Vec::with_capacity(ends.len());
    for end in ends {
        // A part too short to drive is driven with the one before or after it.
        if end - from >= SHORTEST_PART_MM && (end == length || length - end >= SHORTEST_PART_MM) {
            parts.push(Fed { curve: fed.curve.cut(from, end), ..*fed });
            from = end;
        }
    }
    if parts.is_empty() { vec![*fed] } else { parts }
}

/// Which way X and Y go along a curve in which none of them turns; true is down. One that stands goes on as `before`.
fn going(curve: &Curve, play_mm: [f64; 2], before: [bool; 2]) -> [bool; 2] {
    let (from, to) = (curve.at(0.0), curve.end());
    core::array::from_fn(|axis| {
        let way = to[axis] - from[axis];
        if play_mm[axis] > 0.0 && way.abs() > STANDS_MM { way < 0.0 } else { before[axis] }
    })
}
