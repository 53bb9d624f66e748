//! Laws of paths, checked from closed forms alone: axis limits always hold, pieces join in position and
//! speed, and both ends are at rest.
//!
//! The highest speed, acceleration and jerk of a span are among its numbers. A line gives an axis its share
//! of each, and so does a helix for the height. On an arc of radius r, an axis has at most |v|·(its greatest
//! share) of the speed, √(a² + (v²/r)²) of the acceleration and √((j + v³/r²)² + (3va/r)²) of the jerk. Here
//! v, a, j are the highest of the span; for a helix, XY has its share of them.
//!
//! In a corner, the speed of an axis may jump by √(8·A·d). The squared jump, divided by the shorter side, is
//! limited to 0.6·A. Only in corners, and where a line meets an arc, may a run end with an acceleration.

use super::bounds::PathRules;
use super::bounds::{OF_CORNERS_SHARE, pulls, turn};
use super::{Curve, PathPoint, PathRun, PlannedPath, PlannedPiece};
use crate::code;
use crate::diagnostic::Diagnostic;
use crate::machine::axis_name;
use crate::motion::profile::{Limits, Span};

const ROUNDING_SHARE: f64 = 1e-9;

/// Tolerance of equal positions: a thousandth of a nanometre per metre.
const SAME_SHARE: f64 = 1e-9;

/// The first violation, with the number of the piece in the chain, from 1.
pub fn laws(path: &PlannedPath, axes: &[Limits; 3], rules: &PathRules) -> Result<(), Diagnostic> {
    let axes = &axes
        .map(|axis| Limits { acceleration_mm_per_s2: axis.acceleration_mm_per_s2 * rules.share, ..axis });
    let diagnostic = |code: &str, source: u32| Diagnostic::error(code).with("piece", source + 1);
    let (mut at, mut speed, mut now, mut counted) = (path.start, 0.0, 0.0, 0);
    for (index, run) in path.runs.iter().enumerate() {
        let pieces = path.pieces_of(run);
        let Some(first) = pieces.first() else { return Err(diagnostic(code!("motion.path_broken"), 0)) };
        let (from, to) = end_speeds(run);
        let smooth = (from - speed).abs() <= ROUNDING_SHARE * (from + speed) + SAME_SHARE;
        if !(smooth && run.start_s == now && run.first as usize == counted && whole(run, pieces, index)) {
            return Err(diagnostic(code!("motion.path_broken"), first.source));
        }
        for planned in pieces {
            if !near(planned.curve.at(0.0), at) {
                return Err(diagnostic(code!("motion.path_broken"), planned.source));
            }
            let over = |axis: &usize| run.spans.iter().any(|span| too_much(planned, span, axes, *axis));
            if let Some(axis) = (0..3).find(over) {
                return Err(
                    diagnostic(code!("motion.path_over_limit"), planned.source).with("axis", axis_name(axis))
                );
            }
            at = planned.curve.end();
        }
        (speed, now, counted) = (to, now + run.duration_s(), counted + pieces.len());
    }
    let first = path.runs.first().and_then(|run| run.spans.first()).map_or(0.0, |span| span.end_pulls().0);
    let last = path.runs.last().and_then(|run| run.spans.last()).map_or(0.0, |span| span.end_pulls().1);
    if speed > SAME_SHARE || first != 0.0 || last != 0.0 || counted != path.pieces.len() {
        return Err(diagnostic(
            code!("motion.path_broken"),
            path.pieces.last().map_or(0, |last| last.source),
        ));
    }
    if let Some(source) = path.runs.windows(2).find_map(|pair| pulled(path, pair, axes)) {
        return Err(diagnostic(code!("motion.path_broken"), source));
    }
    let sharp =
        path.pieces.windows(2).find_map(|pair| Some((sharp(path, pair, axes, rules)?, pair[1].source)));
    sharp.map_or(Ok(()), |(axis, source)| {
        Err(diagnostic(code!("motion.path_over_limit"), source).with("axis", axis_name(axis)))
    })
}

/// Greatest change of a path's rate, in parts of the full rate per second, with no axis above its full
/// acceleration. At a rate r with change r′, the acceleration of an axis is r²·a + r′·v, at most share·A +
/// r′·v. Infinite for a path of no length.
pub fn override_change_per_s(path: &PlannedPath, axes: &[Limits; 3], rules: &PathRules) -> f64 {
    let mut least = f64::INFINITY;
    for run in &path.runs {
        let top =
            run.spans.iter().map(|span| span.low_mm_per_s + span.ramp.rise_mm_per_s).fold(0.0, f64::max);
        for planned in path.pieces_of(run) {
            for (axis, own) in axes.iter().enumerate() {
                let speed = top * planned.curve.greatest_share(axis);
                least = least
                    .min((1.0 - rules.share) * own.acceleration_mm_per_s2 / speed.max(f64::MIN_POSITIVE));
            }
        }
    }
    least
}

fn near(a: PathPoint, b: PathPoint) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME_SHARE + SAME_SHARE * b.abs())
}

/// True if the spans of a run are consecutive and cover its pieces.
fn whole(run: &PathRun, pieces: &[PlannedPiece], index: usize) -> bool {
    let (mut s, mut t, mut speed) = (0.0, 0.0, None);
    for (at, span) in run.spans.iter().enumerate() {
        let (from, to) = span.end_speeds();
        let pulls = span.end_pulls();
        if (at > 0 && pulls.0 != 0.0) || (at + 1 < run.spans.len() && pulls.1 != 0.0) {
            return false;
        }
        let smooth = speed
            .is_none_or(|speed: f64| (from - speed).abs() <= ROUNDING_SHARE * (from + speed) + SAME_SHARE);
        if !smooth || span.start_mm != s || span.start_s != t {
            return false;
        }
        (s, t, speed) = (span.end_mm(), span.end_s(), Some(to));
    }
    let mut length = 0.0;
    for planned in pieces {
        if planned.run as usize != index || planned.start_mm != length {
            return false;
        }
        length += planned.curve.length_mm();
    }
    (s - length).abs() <= SAME_SHARE + SAME_SHARE * s
}

/// The piece before which the path brakes or accelerates more than the corner permits, if any. Without a
/// corner, no acceleration is permitted.
fn pulled(path: &PlannedPath, pair: &[PathRun], axes: &[Limits; 3]) -> Option<u32> {
    let [before, after] = pair else { return None };
    let (last, first) = (path.pieces_of(before).last()?, path.pieces_of(after).first()?);
    let braked = -before.spans.last().map_or(0.0, |span| span.end_pulls().1);
    let driven = after.spans.first().map_or(0.0, |span| span.end_pulls().0);
    let speed = path.speed(after.start_s);
    let most = pulls(&last.curve, &first.curve, speed, axes);
    let broken = |pull: f64, most: f64| !(0.0..=most * (1.0 + ROUNDING_SHARE) + SAME_SHARE).contains(&pull);
    (broken(braked, most.before_mm_per_s2) || broken(driven, most.after_mm_per_s2)).then_some(first.source)
}

fn end_speeds(run: &PathRun) -> (f64, f64) {
    let first = run.spans.first().map_or(0.0, |span| span.end_speeds().0);
    (first, run.spans.last().map_or(0.0, |span| span.end_speeds().1))
}

/// The axis that turns too fast between two pieces, if any.
fn sharp(path: &PlannedPath, pair: &[PlannedPiece], axes: &[Limits; 3], rules: &PathRules) -> Option<usize> {
    let [before, after] = pair else { return None };
    let change = turn(&before.curve, &after.curve);
    let speed = path.speed(path.time_in(after, 0.0));
    let shorter_mm = before.curve.length_mm().min(after.curve.length_mm());
    (0..3).find(|axis| {
        let (a, jump) = (axes[*axis].acceleration_mm_per_s2, speed * change[*axis].abs());
        let most = libm::sqrt(8.0 * a * rules.deviation_mm);
        jump > most * (1.0 + ROUNDING_SHARE) + SAME_SHARE
            || jump * speed > OF_CORNERS_SHARE * a * shorter_mm * (1.0 + ROUNDING_SHARE) + SAME_SHARE
    })
}

fn too_much(planned: &PlannedPiece, span: &Span, axes: &[Limits; 3], axis: usize) -> bool {
    let of_way = planned.curve.greatest_share(axis);
    let own = &axes[axis];
    let v = span.low_mm_per_s + span.ramp.rise_mm_per_s;
    let (a, j) = (span.ramp.acceleration_mm_per_s2, span.ramp.jerk_mm_per_s3);
    let (acceleration, jerk) = match planned.curve {
        Curve::Line { .. } => (a * of_way, j * of_way),
        Curve::Arc { .. } if axis > 1 => (a * of_way, j * of_way),
        Curve::Arc { radius_mm, .. } => {
            let level = planned.curve.level_share();
            let (v, a, j) = (v * level, a * level, j * level);
            let (pull, turning) = (v * v / radius_mm, v * v * v / (radius_mm * radius_mm));
            let changing = 3.0 * v * a / radius_mm;
            (libm::sqrt(a * a + pull * pull), libm::sqrt((j + turning) * (j + turning) + changing * changing))
        }
    };
    let over = |value: f64, limit: f64| value.is_nan() || value > limit * (1.0 + ROUNDING_SHARE);
    over(v * of_way, own.speed_mm_per_s)
        || over(acceleration, own.acceleration_mm_per_s2)
        || over(jerk, own.jerk_mm_per_s3)
}
