//! The laws a path must keep, from its closed forms alone (N14): at every moment no axis faster, harder or jerkier than
//! it may, every piece from where and as fast as the one before ended, rest at both ends.
//!
//! Comes in: a path, limits of X, Y and Z, the share of the acceleration that was to be used. Goes out: what is broken,
//! if anything. Does not know how it was planned.
//!
//! Greatest speed, acceleration and jerk of a span are among its numbers. A line gives an axis its share of each. On an
//! arc of radius r an axis sees at most |v|·(its greatest share) of the speed, √(a² + (v²/r)²) of the acceleration and
//! √((j + v³/r²)² + (3va/r)²) of the jerk, with the greatest v, a, j of the span.

use super::{Curve, Path, Place, Planned};
use crate::motion::profile::{Limits, Span};
use crate::remark::{Remark, Weight};

/// Room for rounding, as a share of the limit.
const ROUNDING: f64 = 1e-9;

/// Places that should be the same may differ by so much: a thousandth of a nanometre for each metre.
const SAME: f64 = 1e-9;

/// The first broken law, with the number of the piece in the chain, from 1.
pub fn laws(path: &Path, axes: &[Limits; 3], share: f64) -> Result<(), Remark> {
    let (mut at, mut speed, mut now) = (path.start, 0.0, 0.0);
    for planned in &path.pieces {
        let remark = |code: &str| Remark::new(Weight::Loss, code).with("piece", planned.source + 1);
        let joined = near(planned.curve.at(0.0), at) && planned.start_s == now && whole(planned);
        let (from, to) = end_speeds(planned);
        if !joined || (from - speed).abs() > ROUNDING * (from + speed) + SAME {
            return Err(remark("motion.path_broken"));
        }
        let over =
            |axis: &usize| planned.spans.iter().any(|span| too_much(planned, span, axes, *axis, share));
        if let Some(axis) = (0..3).find(over) {
            return Err(remark("motion.path_over_limit").with("axis", ["x", "y", "z"][axis]));
        }
        (at, speed, now) = (planned.curve.end(), to, now + planned.duration_s());
    }
    if speed > SAME {
        return Err(Remark::new(Weight::Loss, "motion.path_broken").with("piece", path.pieces.len()));
    }
    Ok(())
}

fn near(a: Place, b: Place) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME + SAME * b.abs())
}

/// Whether the spans of a piece follow each other and go all of its way.
fn whole(planned: &Planned) -> bool {
    let (mut s, mut t, mut speed) = (0.0, 0.0, None);
    for span in &planned.spans {
        let (from, to) = ends(span);
        let smooth = speed.is_none_or(|speed: f64| (from - speed).abs() <= ROUNDING * (from + speed) + SAME);
        if !smooth || span.start_mm != s || span.start_s != t {
            return false;
        }
        (s, t, speed) = (span.end_mm(), span.end_s(), Some(to));
    }
    (s - planned.curve.length_mm()).abs() <= SAME + SAME * s
}

/// Speeds at the ends of a span.
fn ends(span: &Span) -> (f64, f64) {
    let (low, high) = (span.low_mm_per_s, span.low_mm_per_s + span.ramp.rise_mm_per_s);
    if span.falls { (high, low) } else { (low, high) }
}

fn end_speeds(planned: &Planned) -> (f64, f64) {
    let first = planned.spans.first().map_or(0.0, |span| ends(span).0);
    (first, planned.spans.last().map_or(0.0, |span| ends(span).1))
}

fn too_much(planned: &Planned, span: &Span, axes: &[Limits; 3], axis: usize, share: f64) -> bool {
    let of_way = planned.curve.greatest_share(axis);
    let own = &axes[axis];
    let v = span.low_mm_per_s + span.ramp.rise_mm_per_s;
    let (a, j) = (span.ramp.acceleration_mm_per_s2, span.ramp.jerk_mm_per_s3);
    let (acceleration, jerk) = match planned.curve {
        Curve::Line { .. } => (a * of_way, j * of_way),
        Curve::Arc { .. } if axis > 1 => (0.0, 0.0),
        Curve::Arc { radius_mm, .. } => {
            let (pull, turning) = (v * v / radius_mm, v * v * v / (radius_mm * radius_mm));
            let changing = 3.0 * v * a / radius_mm;
            (libm::sqrt(a * a + pull * pull), libm::sqrt((j + turning) * (j + turning) + changing * changing))
        }
    };
    let over = |value: f64, limit: f64| value.is_nan() || value > limit * (1.0 + ROUNDING);
    over(v * of_way, own.speed) || over(acceleration, own.acceleration * share) || over(jerk, own.jerk)
}
