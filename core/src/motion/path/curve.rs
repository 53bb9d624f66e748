//! One piece of a path: a straight line in space, or an arc in XY. With a linear change of height, the arc is
//! a helix.
//!
//! ```text
//! y ^     ,--- to           ψ: the angle from an axis; over [mπ, (m+1)π] the coordinate is monotonic,
//!   |   ,'  ψ  \            so every position occurs once there
//!   |  /____.   |           and acos finds it
//!   | from  centre
//!   +--------------> x
//! ```
//!
//! A helix of radius r, angle φ and height h has the length L = √((rφ)² + h²). Its XY projection, an arc, has
//! the share rφ/L of the length, its height h/L.

use crate::diagnostic::Diagnostic;
use crate::error;
use core::f64::consts::{FRAC_PI_2, PI, TAU};
use serde::{Deserialize, Serialize};

/// Greatest difference of an arc's radii at start and end, because coordinates in files are rounded.
const ARC_MISMATCH_MM: f64 = 5e-3;

/// Smallest plausible radius: a nanometre.
const LEAST_RADIUS_MM: f64 = 1e-6;

/// An arc that deviates less from its chord is treated as a line.
const FLAT_MM: f64 = 1e-7;

/// A position in mm: X, Y, Z.
pub type PathPoint = [f64; 3];

/// A line or an arc with known length.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Curve {
    Line {
        from: PathPoint,
        to: PathPoint,
        length_mm: f64,
    },
    Arc {
        /// X and Y in mm.
        center: [f64; 2],
        /// In mm, above 0.
        radius_mm: f64,
        /// Angle of the start, from the centre.
        from_rad: f64,
        /// Swept angle; positive is counter-clockwise.
        sweep_rad: f64,
        /// Change of height, linear along the length, mm.
        rise_mm: f64,
        to: PathPoint,
    },
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    libm::sqrt(a.iter().zip(b).map(|(a, b)| (b - a) * (b - a)).sum())
}

pub(super) fn line(from: PathPoint, to: PathPoint) -> Curve {
    Curve::Line { from, to, length_mm: distance(&from, &to) }
}

/// An arc or a helix around `center`, as one or two pieces. Its end is exact: if the radii at both ends
/// differ, the centre is moved onto the perpendicular bisector of the ends.
pub(super) fn arc(
    from: PathPoint,
    end: PathPoint,
    center: [f64; 2],
    ccw: bool,
) -> Result<Vec<Curve>, Diagnostic> {
    let (start, to) = ([from[0], from[1]], [end[0], end[1]]);
    let (r0, r1) = (distance(&start, &center), distance(&to, &center));
    if !(r0 >= LEAST_RADIUS_MM && r1 >= LEAST_RADIUS_MM && (r0 - r1).abs() <= ARC_MISMATCH_MM) {
        return Err(error!("motion.bad_arc", start = r0, end = r1, ..));
    }
    let angle = |at: [f64; 2]| libm::atan2(at[1] - center[1], at[0] - center[0]);
    let turn = angle(to) - angle(start);
    let turn = if ccw { turn } else { -turn };
    let turn = if start == to {
        TAU
    } else if turn > 0.0 {
        turn
    } else {
        turn + TAU
    };
    let exact = (r0 - r1).abs() <= 1e-12 * r0;
    if exact || turn <= 1.5 * PI {
        return Ok(vec![one_arc(from, end, center, turn, ccw, exact)]);
    }
    // The chord determines the direction in which the centre moves, so a nearly full circle is split into two
    // arcs.
    let middle_rad = angle(start) + if ccw { 0.5 * turn } else { -0.5 * turn };
    let radius = 0.5 * (r0 + r1);
    let height = 0.5 * (from[2] + end[2]);
    let middle =
        [center[0] + radius * libm::cos(middle_rad), center[1] + radius * libm::sin(middle_rad), height];
    let half = 0.5 * turn;
    Ok(vec![one_arc(from, middle, center, half, ccw, false), one_arc(middle, end, center, half, ccw, false)])
}

fn one_arc(from: PathPoint, to: PathPoint, center: [f64; 2], turn: f64, ccw: bool, exact: bool) -> Curve {
    let mut center = center;
    if !exact {
        let chord = [to[0] - from[0], to[1] - from[1]];
        let squared = chord[0] * chord[0] + chord[1] * chord[1];
        let middle = [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])];
        let beside = (middle[0] - center[0]) * chord[0] + (middle[1] - center[1]) * chord[1];
        center = [center[0] + beside / squared * chord[0], center[1] + beside / squared * chord[1]];
    }
    let radius_mm = distance(&[from[0], from[1]], &center);
    let angle = |at: PathPoint| libm::atan2(at[1] - center[1], at[0] - center[0]);
    let from_rad = angle(from);
    let mut sweep_rad = turn;
    if !exact {
        let again = if ccw { angle(to) - from_rad } else { from_rad - angle(to) };
        sweep_rad = if again > 0.0 { again } else { again + TAU };
    }
    if sweep_rad < 1.0 && radius_mm * (1.0 - libm::cos(0.5 * sweep_rad)) < FLAT_MM {
        return line(from, to);
    }
    let rise_mm = to[2] - from[2];
    Curve::Arc {
        center,
        radius_mm,
        from_rad,
        sweep_rad: if ccw { sweep_rad } else { -sweep_rad },
        rise_mm,
        to,
    }
}

impl Curve {
    pub fn length_mm(&self) -> f64 {
        match *self {
            Self::Line { length_mm, .. } => length_mm,
            Self::Arc { radius_mm, sweep_rad, rise_mm, .. } => {
                let turned = radius_mm * sweep_rad.abs();
                libm::sqrt(turned * turned + rise_mm * rise_mm)
            }
        }
    }

    /// Length of the XY projection of an arc, as a share of its length: 1 without a rise. 1 for lines, too.
    pub(super) fn level_share(&self) -> f64 {
        match *self {
            Self::Line { .. } => 1.0,
            Self::Arc { radius_mm, sweep_rad, .. } => radius_mm * sweep_rad.abs() / self.length_mm(),
        }
    }

    pub(super) fn cut(&self, from_mm: f64, to_mm: f64) -> Self {
        let (start, end) = (self.at(from_mm), self.at(to_mm));
        match *self {
            Self::Line { .. } => line(start, end),
            Self::Arc { center, radius_mm, from_rad, sweep_rad, .. } => {
                let turned = libm::copysign((to_mm - from_mm) * self.level_share() / radius_mm, sweep_rad);
                let from_rad = self.angle_at(from_rad, radius_mm, sweep_rad, from_mm);
                let rise_mm = end[2] - start[2];
                Self::Arc { center, radius_mm, from_rad, sweep_rad: turned, rise_mm, to: end }
            }
        }
    }

    pub(super) fn shifted(&self, by: PathPoint) -> Self {
        let moved = |place: PathPoint| core::array::from_fn(|axis| place[axis] + by[axis]);
        match *self {
            Self::Line { from, to, length_mm } => Self::Line { from: moved(from), to: moved(to), length_mm },
            Self::Arc { center, radius_mm, from_rad, sweep_rad, rise_mm, to } => {
                let center = [center[0] + by[0], center[1] + by[1]];
                Self::Arc { center, radius_mm, from_rad, sweep_rad, rise_mm, to: moved(to) }
            }
        }
    }

    pub fn end(&self) -> PathPoint {
        match *self {
            Self::Line { to, .. } | Self::Arc { to, .. } => to,
        }
    }

    fn angle_at(&self, from_rad: f64, radius_mm: f64, sweep_rad: f64, s_mm: f64) -> f64 {
        from_rad + libm::copysign(s_mm * self.level_share() / radius_mm, sweep_rad)
    }

    /// Position at length `s_mm`: exactly the end at the whole length and beyond.
    pub fn at(&self, s_mm: f64) -> PathPoint {
        let length = self.length_mm();
        if s_mm >= length {
            return self.end();
        }
        let s = s_mm.max(0.0);
        match *self {
            Self::Line { from, to, .. } => {
                let share = s / length;
                core::array::from_fn(|axis| from[axis] + (to[axis] - from[axis]) * share)
            }
            Self::Arc { center, radius_mm, from_rad, sweep_rad, rise_mm, to } => {
                let angle = self.angle_at(from_rad, radius_mm, sweep_rad, s);
                let (x, y) = (radius_mm * libm::cos(angle), radius_mm * libm::sin(angle));
                [center[0] + x, center[1] + y, to[2] - rise_mm * (1.0 - s / length)]
            }
        }
    }

    pub fn tangent(&self, s_mm: f64) -> PathPoint {
        match *self {
            Self::Line { from, to, length_mm } => {
                core::array::from_fn(|axis| (to[axis] - from[axis]) / length_mm)
            }
            Self::Arc { radius_mm, from_rad, sweep_rad, rise_mm, .. } => {
                let angle = self.angle_at(from_rad, radius_mm, sweep_rad, s_mm);
                let way = libm::copysign(self.level_share(), sweep_rad);
                [-way * libm::sin(angle), way * libm::cos(angle), rise_mm / self.length_mm()]
            }
        }
    }

    /// Derivative of the direction by length at `s_mm`, 1/mm: towards the centre of an arc, zero on a line.
    pub fn curvature(&self, s_mm: f64) -> PathPoint {
        match *self {
            Self::Line { .. } => [0.0; 3],
            Self::Arc { radius_mm, from_rad, sweep_rad, .. } => {
                let angle = self.angle_at(from_rad, radius_mm, sweep_rad, s_mm);
                let level = self.level_share();
                let bend = level * level / radius_mm;
                [-libm::cos(angle) * bend, -libm::sin(angle) * bend, 0.0]
            }
        }
    }

    /// Greatest share of an axis in the path's direction, 0 … 1.
    pub fn greatest_share(&self, axis: usize) -> f64 {
        match *self {
            Self::Line { .. } => self.tangent(0.0)[axis].abs(),
            Self::Arc { rise_mm, .. } if axis > 1 => rise_mm.abs() / self.length_mm(),
            Self::Arc { .. } => {
                // |sin ψ| is greatest half-way between its zeros, or else at an end.
                let (from, to) = self.psi(axis);
                let (low, high) = (from.min(to), from.max(to));
                let top = libm::ceil((low - FRAC_PI_2) / PI) * PI + FRAC_PI_2;
                let turning = if top <= high { 1.0 } else { libm::sin(low).abs().max(libm::sin(high).abs()) };
                turning * self.level_share()
            }
        }
    }

    /// Start and end angles of an arc from the direction of `axis`.
    fn psi(&self, axis: usize) -> (f64, f64) {
        match *self {
            Self::Arc { from_rad, sweep_rad, .. } => {
                let from = if axis == 0 { from_rad } else { from_rad - FRAC_PI_2 };
                (from, from + sweep_rad)
            }
            Self::Line { .. } => (0.0, 0.0),
        }
    }

    /// Stretches with monotonic or constant `axis`, in order.
    pub(super) fn stretches(&self, axis: usize) -> Vec<Stretch> {
        let length = self.length_mm();
        let stretch = |from_mm: f64, to_mm: f64, half_turn: i32| {
            let (from, to) = (self.at(from_mm)[axis], self.at(to_mm)[axis]);
            Stretch { from_mm, to_mm, axis_from_mm: from, axis_to_mm: to, half_turn }
        };
        let Self::Arc { radius_mm, .. } = *self else { return vec![stretch(0.0, length, 0)] };
        if axis > 1 {
            return vec![stretch(0.0, length, 0)];
        }
        let (from, to) = self.psi(axis);
        let along = radius_mm / self.level_share();
        let way = if to > from { 1 } else { -1 };
        let mut half_turn = libm::floor(from / PI) as i32;
        let mut start_mm = 0.0;
        let mut found = Vec::new();
        // A full circle has at most four boundaries, including its own ends.
        for _ in 0..4 {
            let border = PI * f64::from(if way > 0 { half_turn + 1 } else { half_turn });
            let end_mm = ((border - from).abs() * along).min(length);
            if end_mm > start_mm {
                found.push(stretch(start_mm, end_mm, half_turn));
            }
            if end_mm >= length {
                break;
            }
            (start_mm, half_turn) = (end_mm, half_turn + way);
        }
        found
    }

    pub(super) fn length_at(&self, axis: usize, stretch: &Stretch, value_mm: f64) -> f64 {
        let s = match *self {
            _ if stretch.axis_from_mm == stretch.axis_to_mm => stretch.from_mm,
            Self::Arc { center, radius_mm, .. } if axis < 2 => {
                let within = libm::acos(((value_mm - center[axis]) / radius_mm).clamp(-1.0, 1.0));
                let rest = if stretch.half_turn % 2 == 0 { within } else { PI - within };
                let psi = PI * f64::from(stretch.half_turn) + rest;
                (psi - self.psi(axis).0).abs() * radius_mm / self.level_share()
            }
            Self::Line { .. } | Self::Arc { .. } => {
                let share = (value_mm - stretch.axis_from_mm) / (stretch.axis_to_mm - stretch.axis_from_mm);
                stretch.from_mm + share * (stretch.to_mm - stretch.from_mm)
            }
        };
        s.clamp(stretch.from_mm, stretch.to_mm)
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stretch {
    pub(super) from_mm: f64,
    pub(super) to_mm: f64,
    pub(super) axis_from_mm: f64,
    pub(super) axis_to_mm: f64,
    /// m, with the angle from the axis between mπ and (m+1)π.
    half_turn: i32,
}
