//! Nearest points of lines and arcs.
//!
//! ```text
//!     ╭──╮ q          p and q: an end and its foot on the other piece, or
//!     ╰──╯ ┊ p        two feet on the line of the centres
//!   ━━━━━━━━━━━━
//! ```
//!
//! Exact up to f64 rounding, for pieces that do not cross.

use super::overlay::{Spot, apart, spot};
use super::{PathSegment, Point, chords};
use std::f64::consts::TAU;

#[derive(Clone, Copy, Debug)]
pub(super) struct Bow {
    pub(super) centre: Spot,
    pub(super) radius_nm: f64,
    pub(super) clockwise: bool,
    start_rad: f64,
    pub(super) turn_rad: f64,
}

/// A piece of a path, in nm.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub(super) from: Spot,
    pub(super) to: Spot,
    pub(super) bow: Option<Bow>,
}

impl Piece {
    pub(super) fn of(from: Point, segment: PathSegment) -> Self {
        let bow = match segment {
            PathSegment::Line { .. } => None,
            PathSegment::Arc { to, centre, clockwise } => {
                let (a, b, c) = (spot(from), spot(to), spot(centre));
                let turn = chords::turn(from, to, centre, clockwise);
                let (first, radius) = (if clockwise { b } else { a }, (apart(c, a) + apart(c, b)) / 2.0);
                let start = libm::atan2(first.1 - c.1, first.0 - c.0);
                Some(Bow { centre: c, radius_nm: radius, clockwise, start_rad: start, turn_rad: turn })
            }
        };
        Self { from: spot(from), to: spot(segment.to()), bow }
    }

    pub(super) fn heading(&self, at_end: bool) -> Spot {
        let at = if at_end { self.to } else { self.from };
        self.heading_at(at)
    }

    /// Unit vector along it at a point on it.
    pub(super) fn heading_at(&self, at: Spot) -> Spot {
        let way = match self.bow {
            None => (self.to.0 - self.from.0, self.to.1 - self.from.1),
            Some(bow) => {
                let arm = (at.0 - bow.centre.0, at.1 - bow.centre.1);
                if bow.clockwise { (arm.1, -arm.0) } else { (-arm.1, arm.0) }
            }
        };
        let length = libm::sqrt(way.0 * way.0 + way.1 * way.1).max(1e-9);
        (way.0 / length, way.1 / length)
    }

    pub(super) fn at(&self, share: f64) -> Spot {
        let Some(bow) = self.bow else {
            let mix = |a: f64, b: f64| a + (b - a) * share;
            return (mix(self.from.0, self.to.0), mix(self.from.1, self.to.1));
        };
        let turned = if bow.clockwise { 1.0 - share } else { share };
        let angle = bow.start_rad + bow.turn_rad * turned;
        (bow.centre.0 + bow.radius_nm * libm::cos(angle), bow.centre.1 + bow.radius_nm * libm::sin(angle))
    }

    pub(super) fn nearest(&self, place: Spot) -> Spot {
        let nearer_end =
            || if apart(place, self.from) <= apart(place, self.to) { self.from } else { self.to };
        match self.bow {
            None => {
                let way = (self.to.0 - self.from.0, self.to.1 - self.from.1);
                let squared = way.0 * way.0 + way.1 * way.1;
                let along = (place.0 - self.from.0) * way.0 + (place.1 - self.from.1) * way.1;
                let share = if squared > 0.0 { (along / squared).clamp(0.0, 1.0) } else { 0.0 };
                (self.from.0 + way.0 * share, self.from.1 + way.1 * share)
            }
            Some(bow) => bow.towards(place).unwrap_or_else(nearer_end),
        }
    }
}

impl Bow {
    /// True if the ray from the centre through `place` meets the arc.
    fn covers(&self, place: Spot) -> bool {
        let angle = libm::atan2(place.1 - self.centre.1, place.0 - self.centre.0) - self.start_rad;
        angle - TAU * libm::floor(angle / TAU) <= self.turn_rad
    }

    /// The point of the arc on the ray from the centre through `place`.
    fn towards(&self, place: Spot) -> Option<Spot> {
        let arm = (place.0 - self.centre.0, place.1 - self.centre.1);
        let length = libm::sqrt(arm.0 * arm.0 + arm.1 * arm.1);
        (length > 1e-6 && self.covers(place)).then(|| {
            let share = self.radius_nm / length;
            (self.centre.0 + arm.0 * share, self.centre.1 + arm.1 * share)
        })
    }
}

fn opposite(centre: Spot, place: Spot) -> Spot {
    (2.0 * centre.0 - place.0, 2.0 * centre.1 - place.1)
}

/// Nearest points of a line and an arc inside both, if they exist.
fn line_and_bow(line: &Piece, bow: &Bow, found: &mut Vec<(Spot, Spot)>) {
    let foot = line.nearest(bow.centre);
    if foot != line.from && foot != line.to {
        found.extend(
            [foot, opposite(bow.centre, foot)].into_iter().filter_map(|at| Some((foot, bow.towards(at)?))),
        );
    }
}

fn bow_and_bow(one: &Bow, two: &Bow, found: &mut Vec<(Spot, Spot)>) {
    let ends = |bow: &Bow, other: Spot| [bow.towards(other), bow.towards(opposite(bow.centre, other))];
    for p in ends(one, two.centre).into_iter().flatten() {
        for q in ends(two, one.centre).into_iter().flatten() {
            found.push((p, q));
        }
    }
}

/// For parallel lines, the middle of the section where they face each other.
fn beside_each_other(found: &mut Vec<(Spot, Spot)>) {
    found.sort_by(|a, b| apart(a.0, a.1).total_cmp(&apart(b.0, b.1)));
    if let [one, two, ..] = *found.as_slice()
        && apart(two.0, two.1) - apart(one.0, one.1) <= 1.0
    {
        let middle = |a: Spot, b: Spot| ((a.0 + b.0) / 2.0, (a.1 + b.1) / 2.0);
        found.insert(0, (middle(one.0, two.0), middle(one.1, two.1)));
        found.truncate(1);
    }
}

pub(super) fn nearest_pair(one: &Piece, two: &Piece) -> (Spot, Spot) {
    let mut found = Vec::with_capacity(8);
    found.push((one.from, two.nearest(one.from)));
    found.push((one.to, two.nearest(one.to)));
    found.push((one.nearest(two.from), two.from));
    found.push((one.nearest(two.to), two.to));
    match (&one.bow, &two.bow) {
        (None, None) => beside_each_other(&mut found),
        (None, Some(bow)) => line_and_bow(one, bow, &mut found),
        (Some(bow), None) => {
            let first = found.len();
            line_and_bow(two, bow, &mut found);
            found.iter_mut().skip(first).for_each(|pair| *pair = (pair.1, pair.0));
        }
        (Some(a), Some(b)) => bow_and_bow(a, b, &mut found),
    }
    let mut best = (one.from, two.from);
    let mut least = f64::INFINITY;
    for pair in found {
        let distance = apart(pair.0, pair.1);
        if distance < least {
            (best, least) = (pair, distance);
        }
    }
    best
}
