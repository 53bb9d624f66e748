//! Speed planning of a path: limits of pieces and corners, and the speeds reachable in between.
//!
//! ```text
//! corner speed    ·    ·  ·      ·      1. limits of every piece, then of every corner
//!                                       2. neighbours with similar limits become one run
//! backward   <──/‾‾‾\──/‾\────────      3. from the end: no faster than braking permits
//! forward    ──/‾‾‾\──/‾\───────>       4. from the start: no faster than acceleration permits
//! ```
//!
//! Maths. The speed reachable over a length ℓ from speed v is v + Δ with (v + Δ/2)·t(Δ) = ℓ, with the time t
//! of a rise by Δ (`docs/motion-profiles.md` C2.5). A quadratic if the full acceleration is reached, else a
//! cubic in √Δ.

use super::bounds::{PathRules, Pulls, along, corner, pulls, turn};
use super::curve::{self, Curve, PathPoint};
use super::{PathRun, PlannedPath, PlannedPiece};
use crate::diagnostic::Diagnostic;
use crate::motion::profile::{Limits, MotionLaw, Span};
use crate::{code, error};

/// Shorter pieces are skipped: a thousandth of a nanometre.
const NOTHING_MM: f64 = 1e-9;

/// Least plausible feed: a nanometre per second.
const LEAST_FEED_MM_PER_S: f64 = 1e-6;

const FARTHEST_MM: f64 = 1e9;

/// Shares of its highest speed that are tried for an arc with a slow end, in addition to 1.
const SLOWER_SHARE: [f64; 4] = [0.85, 0.7, 0.6, 0.5];

/// Pieces form one run while their common speed is at least this share of what each could reach alone.
const ALIKE_SHARE: f64 = 0.8;

const HALVINGS: u32 = 60;

/// Consecutive pieces, at rest at both ends.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chain {
    /// In mm.
    pub start: PathPoint,
    pub pieces: Vec<WantedPiece>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WantedPiece {
    pub to: To,
    /// Highest speed along the piece, mm/s; infinite for the axes' limit.
    pub feed_mm_per_s: f64,
}

/// Target and shape of a piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum To {
    /// Straight to a position, mm.
    Line(PathPoint),
    /// In XY around `center`, mm; a full circle if it ends at its start. The height changes linearly.
    Arc { to: PathPoint, center: [f64; 2], ccw: bool },
}

struct Limited {
    source: u32,
    curve: Curve,
    limits: Limits,
}

/// The fastest path along `chain` within the limits of X, Y and Z (`axes`, in this order).
///
/// Refuses, with the number of the piece from 1: non-finite coordinates, arcs without a radius or with ends
/// at different distances from the centre, unusable feeds and limits.
pub fn plan(chain: &Chain, axes: &[Limits; 3], rules: &PathRules) -> Result<PlannedPath, Diagnostic> {
    check(chain, axes, rules)?;
    Ok(along_curves(chain.start, &curves(chain)?, axes, rules))
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Fed {
    pub(super) source: u32,
    pub(super) curve: Curve,
    pub(super) feed_mm_per_s: f64,
}

/// The curves of a chain, without empty ones.
pub(super) fn curves(chain: &Chain) -> Result<Vec<Fed>, Diagnostic> {
    let mut found: Vec<Fed> = Vec::with_capacity(chain.pieces.len());
    let mut at = chain.start;
    for (index, piece) in chain.pieces.iter().enumerate() {
        let source = u32::try_from(index).map_err(|_| error!("motion.too_many_legs"))?;
        let curves = match piece.to {
            To::Line(to) => vec![curve::line(at, to)],
            To::Arc { to, center, ccw } => {
                curve::arc(at, to, center, ccw).map_err(|r| r.with("piece", index + 1))?
            }
        };
        for curve in curves.into_iter().filter(|curve| curve.length_mm() >= NOTHING_MM) {
            at = curve.end();
            found.push(Fed { source, curve, feed_mm_per_s: piece.feed_mm_per_s });
        }
    }
    Ok(found)
}

/// The fastest path from rest at `start` along `curves` to rest.
pub(super) fn along_curves(
    start: PathPoint,
    curves: &[Fed],
    axes: &[Limits; 3],
    rules: &PathRules,
) -> PlannedPath {
    let axes =
        axes.map(|axis| Limits { acceleration_mm_per_s2: axis.acceleration_mm_per_s2 * rules.share, ..axis });
    let limited = |fed: &Fed| Limited {
        source: fed.source,
        curve: fed.curve,
        limits: along(&fed.curve, fed.feed_mm_per_s, &axes, 1.0),
    };
    let mut pieces: Vec<Limited> = curves.iter().map(limited).collect();
    slow_down(&mut pieces, curves, &axes, rules);
    let corners = corners(&pieces, &axes, rules);
    let groups = groups(&pieces, &corners);
    let ends: Vec<usize> =
        std::iter::once(0).chain(groups.iter().map(|group| group.first + group.count)).collect();
    let mut speeds: Vec<f64> = ends.iter().map(|end| corners[*end]).collect();
    let pulls = |end: usize, speed: f64| pulls_at(&pieces, ends[end], speed, &axes);
    for (index, group) in groups.iter().enumerate() {
        speeds[index] = speeds[index].min(group.limits.speed_mm_per_s);
        speeds[index + 1] = speeds[index + 1].min(group.limits.speed_mm_per_s);
    }
    for (index, group) in groups.iter().enumerate().rev() {
        let from = (speeds[index + 1], pulls(index + 1, speeds[index + 1]).before_mm_per_s2);
        speeds[index] = speeds[index].min(reached_pulled(from, &group.limits, group.length_mm));
    }
    for (index, group) in groups.iter().enumerate() {
        let from = (speeds[index], pulls(index, speeds[index]).after_mm_per_s2);
        speeds[index + 1] = speeds[index + 1].min(reached_pulled(from, &group.limits, group.length_mm));
    }
    let ends: Vec<(f64, Pulls)> =
        speeds.into_iter().enumerate().map(|(end, speed)| (speed, pulls(end, speed))).collect();
    assemble(start, &pieces, &groups, &ends)
}

/// Gives every arc with a slow end the one of several speeds with the shortest time.
fn slow_down(pieces: &mut [Limited], curves: &[Fed], axes: &[Limits; 3], rules: &PathRules) {
    let fastest = corners(pieces, axes, rules);
    for (index, (piece, fed)) in pieces.iter_mut().zip(curves).enumerate() {
        let (from, to) = (fastest[index], fastest[index + 1]);
        let Limits { speed_mm_per_s: speed, .. } = piece.limits;
        if matches!(piece.curve, Curve::Line { .. }) || from.min(to) >= speed {
            continue;
        }
        let length_mm = piece.curve.length_mm();
        let takes_s = |limits: Limits| {
            let (from, to) = (from.min(limits.speed_mm_per_s), to.min(limits.speed_mm_per_s));
            let (from, to) =
                (from.min(reached(to, &limits, length_mm)), to.min(reached(from, &limits, length_mm)));
            let group = Group { first: index, count: 1, length_mm, limits, best: 0.0 };
            spans((from, 0.0), (to, 0.0), &group).iter().map(|span| span.duration_s).sum::<f64>()
        };
        let mut best = takes_s(piece.limits);
        for share in SLOWER_SHARE {
            let limits = along(&fed.curve, fed.feed_mm_per_s, axes, share);
            let taken_s = takes_s(limits);
            if taken_s < best {
                (best, piece.limits) = (taken_s, limits);
            }
        }
    }
}

/// Greatest braking before and acceleration after the start of piece `index`, at `speed`; zero at the path's
/// ends.
fn pulls_at(pieces: &[Limited], index: usize, speed: f64, axes: &[Limits; 3]) -> Pulls {
    match (index.checked_sub(1).and_then(|before| pieces.get(before)), pieces.get(index)) {
        (Some(before), Some(after)) => pulls(&before.curve, &after.curve, speed, axes),
        _ => Pulls::default(),
    }
}

fn assemble(start: PathPoint, pieces: &[Limited], groups: &[Group], ends: &[(f64, Pulls)]) -> PlannedPath {
    let mut path = PlannedPath {
        start,
        pieces: Vec::with_capacity(pieces.len()),
        runs: Vec::with_capacity(groups.len()),
    };
    let (mut start_s, mut start_mm) = (0.0, 0.0);
    for (index, (group, ends)) in groups.iter().zip(ends.windows(2)).enumerate() {
        let mut in_run_mm = 0.0;
        for piece in pieces.iter().skip(group.first).take(group.count) {
            let (source, curve) = (piece.source, piece.curve);
            path.pieces.push(PlannedPiece { source, curve, run: index as u32, start_mm: in_run_mm });
            in_run_mm += curve.length_mm();
        }
        let spans =
            spans((ends[0].0, ends[0].1.after_mm_per_s2), (ends[1].0, ends[1].1.before_mm_per_s2), group);
        let run = PathRun { start_s, start_mm, first: group.first as u32, count: group.count as u32, spans };
        start_s += run.duration_s();
        start_mm += run.length_mm();
        path.runs.push(run);
    }
    path
}

struct Group {
    first: usize,
    count: usize,
    length_mm: f64,
    limits: Limits,
    /// The highest speed that any of the pieces could use alone.
    best: f64,
}

/// Groups neighbours, as long as the slowest piece and corner of a group cost little compared with separate
/// runs. Short pieces accelerate together instead of each on its own; long ones between sharp corners stay
/// alone.
fn groups(pieces: &[Limited], corners: &[f64]) -> Vec<Group> {
    let mut found: Vec<Group> = Vec::new();
    for (index, piece) in pieces.iter().enumerate() {
        let length_mm = piece.curve.length_mm();
        let at_ends = corners[index].max(corners[index + 1]).min(piece.limits.speed_mm_per_s);
        let best = reached(at_ends, &piece.limits, 0.5 * length_mm);
        if let Some(group) = found.last_mut() {
            let (a, b) = (group.limits, piece.limits);
            let limits = Limits {
                speed_mm_per_s: a.speed_mm_per_s.min(b.speed_mm_per_s).min(corners[index]),
                acceleration_mm_per_s2: a.acceleration_mm_per_s2.min(b.acceleration_mm_per_s2),
                jerk_mm_per_s3: a.jerk_mm_per_s3.min(b.jerk_mm_per_s3),
            };
            // Common limits must keep at least half of each piece's own.
            let alike = limits.acceleration_mm_per_s2
                >= 0.5 * a.acceleration_mm_per_s2.max(b.acceleration_mm_per_s2)
                && limits.jerk_mm_per_s3 >= 0.5 * a.jerk_mm_per_s3.max(b.jerk_mm_per_s3);
            if alike && limits.speed_mm_per_s >= ALIKE_SHARE * best.max(group.best) {
                group.limits = limits;
                group.best = best.max(group.best);
                group.length_mm += length_mm;
                group.count += 1;
                continue;
            }
        }
        found.push(Group { first: index, count: 1, length_mm, limits: piece.limits, best });
    }
    found
}

pub(super) fn check(chain: &Chain, axes: &[Limits; 3], rules: &PathRules) -> Result<(), Diagnostic> {
    axes.iter().try_for_each(|axis| MotionLaw::SCurve.check(*axis))?;
    let wrong = |code: &str, value: f64| Err(Diagnostic::error(code).with("value", value));
    if !(rules.share > 1e-3 && rules.share <= 1.0) {
        return wrong(code!("motion.bad_share"), rules.share);
    }
    if !(0.0..=1e3).contains(&rules.deviation_mm) {
        return wrong(code!("motion.bad_deviation"), rules.deviation_mm);
    }
    let usable = |places: &[f64]| places.iter().all(|place| place.abs() <= FARTHEST_MM);
    let mut sound = usable(&chain.start);
    for (index, piece) in chain.pieces.iter().enumerate() {
        let feed = piece.feed_mm_per_s;
        if !(LEAST_FEED_MM_PER_S..=f64::INFINITY).contains(&feed) {
            return Err(error!("motion.bad_path_feed", value = feed, piece = index + 1));
        }
        sound &= match piece.to {
            To::Line(to) => usable(&to),
            To::Arc { to, center, .. } => usable(&to) && usable(&center),
        };
        if !sound {
            return Err(error!("motion.bad_place", piece = index + 1));
        }
    }
    Ok(())
}

/// The highest speed at every corner, with rest at both ends: one more value than pieces.
fn corners(pieces: &[Limited], axes: &[Limits; 3], rules: &PathRules) -> Vec<f64> {
    let mut speeds = vec![0.0; pieces.len() + 1];
    for (speed, pair) in speeds.iter_mut().skip(1).zip(pieces.windows(2)) {
        let change = turn(&pair[0].curve, &pair[1].curve);
        let shorter_mm = pair[0].curve.length_mm().min(pair[1].curve.length_mm());
        let cornering = corner(change, shorter_mm, axes, rules);
        *speed = cornering.min(pair[0].limits.speed_mm_per_s).min(pair[1].limits.speed_mm_per_s);
    }
    speeds
}

/// The highest speed at the end of `length` mm that start with `speed`.
fn reached(speed: f64, limits: &Limits, length: f64) -> f64 {
    let Limits { speed_mm_per_s: most, acceleration_mm_per_s2: a, jerk_mm_per_s3: j } = *limits;
    if speed >= most {
        return speed;
    }
    let full = a * a / j;
    let rise = if (speed + 0.5 * full) * 2.0 * (a / j) <= length {
        let half = speed + 0.5 * full;
        let room = 2.0 * a * length - 2.0 * speed * full;
        room / (half + libm::sqrt(half * half + room))
    } else {
        rise_by_jerk(speed, length * libm::sqrt(j))
    };
    // Slightly less, so that rounding never makes the piece too short.
    (speed + rise * (1.0 - 1e-12)).min(most)
}

/// Like [`reached`], with a start acceleration `pull`, which may still rise. By bisection.
fn reached_pulled((speed, pull): (f64, f64), limits: &Limits, length: f64) -> f64 {
    let mut low = reached(speed, limits, length);
    if pull <= 0.0 || low >= limits.speed_mm_per_s {
        return low;
    }
    let fits = |top: f64| Span::pulled(speed, top, pull, *limits).length_mm <= length;
    if fits(limits.speed_mm_per_s) {
        return limits.speed_mm_per_s;
    }
    let mut high = limits.speed_mm_per_s;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if fits(middle) { low = middle } else { high = middle }
    }
    (speed + (low - speed) * (1.0 - 1e-12)).min(limits.speed_mm_per_s)
}

/// Δ from x³ + 2·speed·x = y for x = √Δ. The left side is increasing and convex, so Newton steps approach the
/// root from above. They start where one of the two terms alone would reach y.
fn rise_by_jerk(speed: f64, y: f64) -> f64 {
    let mut x = libm::cbrt(y);
    if speed > 0.0 {
        x = x.min(0.5 * y / speed);
    }
    for _ in 0..12 {
        let next = x - (x * x * x + 2.0 * speed * x - y) / (3.0 * x * x + 2.0 * speed);
        if next >= x {
            break;
        }
        x = next;
    }
    x * x
}

/// Rise, constant speed and fall of a group between its end speeds; empty spans are omitted.
fn spans((from, pull_from): (f64, f64), (to, pull_to): (f64, f64), group: &Group) -> Vec<Span> {
    let (limits, length) = (group.limits, group.length_mm);
    let rise = |top| Span::pulled(from, top, pull_from, limits);
    let fall = |top| Span::pulled(top, to, pull_to, limits);
    let needed = |top| rise(top).length_mm + fall(top).length_mm;
    let mut top = limits.speed_mm_per_s.max(from).max(to);
    if needed(top) > length {
        let mut high = top;
        top = from.max(to);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (top + high);
            if needed(middle) <= length {
                top = middle;
            } else {
                high = middle;
            }
        }
    }
    let (rise, fall) = (rise(top), fall(top));
    let steady_mm = length - rise.length_mm - fall.length_mm;
    let steady = if steady_mm > 0.0 { Span::steady(top, steady_mm) } else { Span::default() };
    let mut spans: Vec<Span> = Vec::with_capacity(3);
    for span in [rise, steady, fall].into_iter().filter(|span| span.duration_s > 0.0) {
        let placed = spans.last().map_or(span, |before| span.after(before));
        spans.push(placed);
    }
    spans
}
