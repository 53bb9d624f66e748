//! Splits a chain on a machine with backlash into paths, at the reversals of the axes with backlash.
//!
//! ```text
//! x ^    /\        at rest, the motor removes the backlash while the axis doesn't move;
//!   |   /  \       while counting down, the motor is lower by the backlash
//!   |  /    \
//!   +----------> t
//! ```

use super::PlannedPath;
use super::bounds::PathRules;
use super::curve::{Curve, PathPoint};
use super::plan::{Chain, Fed, along_curves, check, curves};
use crate::diagnostic::Diagnostic;
use crate::motion::profile::Limits;

/// Shorter parts of a curve are not split off: a nanometre.
const SHORTEST_PART_MM: f64 = 1e-6;

/// Shorter motion of an axis doesn't count as a reversal: a nanometre.
const STANDS_MM: f64 = 1e-6;

/// The fastest consecutive paths along `chain`, split at reversals of X or Y if that axis has backlash. No
/// path takes longer than permitted. `play_mm` is the backlash of X and Y.
///
/// Each path has the motor directions of X and Y; true is down. An axis that doesn't move keeps its
/// direction, initially `down`. The paths are in axis coordinates, not motor coordinates.
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

/// Paths along consecutive curves: halves the list until no path takes longer than permitted.
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

/// Parts of a curve without a reversal of an axis with backlash.
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
        // A part that is too short is merged with a neighbour.
        if end - from >= SHORTEST_PART_MM && (end == length || length - end >= SHORTEST_PART_MM) {
            parts.push(Fed { curve: fed.curve.cut(from, end), ..*fed });
            from = end;
        }
    }
    if parts.is_empty() { vec![*fed] } else { parts }
}

/// Directions of X and Y along a curve without reversals; true is down. An axis that doesn't move keeps
/// `before`.
fn going(curve: &Curve, play_mm: [f64; 2], before: [bool; 2]) -> [bool; 2] {
    let (from, to) = (curve.at(0.0), curve.end());
    core::array::from_fn(|axis| {
        let way = to[axis] - from[axis];
        if play_mm[axis] > 0.0 && way.abs() > STANDS_MM { way < 0.0 } else { before[axis] }
    })
}
