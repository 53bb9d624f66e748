//! A path of lines and arcs run through without a stop: looked ahead along, so that every corner is met slowly enough.
//!
//! ```text
//! v ^   ____       ____________
//!   |  /    \     /            \        each piece: up to a speed, steady, down to the speed of its end;
//!   | /      \___/              \       no acceleration along the path where pieces meet
//!   |/        corner             \
//!   +----------------------------> t
//! ```
//!
//! Comes in: a [`Chain`] from rest to rest in mm, limits of X, Y and Z, [`Rules`]. Goes out: a [`Path`], from which place,
//! speed and acceleration of every axis at any second follow in closed form, the second at any length, and for every
//! axis the seconds at which it is half-way between two steps. Does not know programs, nor how steps are stored.

mod crossings;
mod curve;
mod laws;
mod plan;

pub use crossings::{Sweep, sweeps};
pub use curve::{Curve, Place};
pub use laws::laws;
pub use plan::{Chain, Piece, Rules, To, plan};

use super::profile::Span;
use serde::{Deserialize, Serialize};

/// A planned path from rest to rest.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Path {
    /// Where it starts.
    pub start: Place,
    /// Its pieces, in order and without a gap.
    pub pieces: Vec<Planned>,
}

/// A piece with its times.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Planned {
    /// Which piece of the chain it is, or is a part of.
    pub source: u32,
    /// Where it goes.
    pub curve: Curve,
    /// Second at which it begins, from the start of the path.
    pub start_s: f64,
    /// Length of the path before it, mm.
    pub start_mm: f64,
    /// Rise, steady run, fall; times and lengths counted from the piece's beginning. None of them is empty.
    pub spans: Vec<Span>,
}

impl Planned {
    /// How long it takes.
    pub fn duration_s(&self) -> f64 {
        self.spans.last().map_or(0.0, Span::end_s)
    }

    /// The span at second `t` of the piece.
    fn span(&self, t: f64) -> Option<&Span> {
        self.spans.iter().rev().find(|span| t >= span.start_s).or(self.spans.first())
    }

    /// The second of the piece at which its length `s_mm` is done.
    fn time_at(&self, s_mm: f64) -> f64 {
        let span = self.spans.iter().rev().find(|span| s_mm >= span.start_mm).or(self.spans.first());
        span.map_or(0.0, |span| span.time_at(s_mm))
    }
}

/// Place along the path, speed and acceleration along it, and the piece, at one second.
struct Now<'a> {
    planned: &'a Planned,
    s_mm: f64,
    speed: f64,
    acceleration: f64,
}

impl Path {
    /// How long it takes.
    pub fn duration_s(&self) -> f64 {
        self.pieces.last().map_or(0.0, |last| last.start_s + last.duration_s())
    }

    /// How long it is.
    pub fn length_mm(&self) -> f64 {
        self.pieces.last().map_or(0.0, |last| last.start_mm + last.curve.length_mm())
    }

    /// Where it ends.
    pub fn end(&self) -> Place {
        self.pieces.last().map_or(self.start, |last| last.curve.end())
    }

    fn now(&self, t: f64) -> Option<Now<'_>> {
        let after = self.pieces.partition_point(|planned| planned.start_s <= t);
        let planned = self.pieces.get(after.saturating_sub(1))?;
        let since = t - planned.start_s;
        let span = planned.span(since)?;
        Some(Now {
            planned,
            s_mm: span.position_mm(since),
            speed: span.speed(since),
            acceleration: span.acceleration(since),
        })
    }

    fn runs(&self, t: f64) -> Option<Now<'_>> {
        if t > 0.0 && t < self.duration_s() { self.now(t) } else { None }
    }

    /// The place at second `t`: exactly the start before it begins and exactly the end afterwards.
    pub fn at(&self, t: f64) -> Place {
        if t <= 0.0 {
            return self.start;
        }
        self.runs(t).map_or(self.end(), |now| now.planned.curve.at(now.s_mm))
    }

    /// Length done at second `t`, mm.
    pub fn position_mm(&self, t: f64) -> f64 {
        let done = if t <= 0.0 { 0.0 } else { self.length_mm() };
        self.runs(t).map_or(done, |now| now.planned.start_mm + now.s_mm)
    }

    /// Speed along the path at second `t`, mm/s.
    pub fn speed(&self, t: f64) -> f64 {
        self.runs(t).map_or(0.0, |now| now.speed)
    }

    /// Speed of every axis at second `t`, mm/s, with its sign.
    pub fn velocity(&self, t: f64) -> Place {
        self.runs(t)
            .map_or([0.0; 3], |now| now.planned.curve.tangent(now.s_mm).map(|share| share * now.speed))
    }

    /// Acceleration of every axis at second `t`, mm/s²: along the path, and on arcs also towards the centre.
    pub fn acceleration(&self, t: f64) -> Place {
        self.runs(t).map_or([0.0; 3], |now| {
            let (along, across) =
                (now.planned.curve.tangent(now.s_mm), now.planned.curve.curvature(now.s_mm));
            let squared = now.speed * now.speed;
            core::array::from_fn(|axis| along[axis] * now.acceleration + across[axis] * squared)
        })
    }

    /// The second at which the length `s_mm` is done: 0 before the start, the duration after the end.
    pub fn time_at_length(&self, s_mm: f64) -> f64 {
        if s_mm >= self.length_mm() {
            return self.duration_s();
        }
        let after = self.pieces.partition_point(|planned| planned.start_mm <= s_mm);
        let planned = self.pieces.get(after.saturating_sub(1));
        planned.map_or(0.0, |planned| planned.start_s + planned.time_at((s_mm - planned.start_mm).max(0.0)))
    }
}
