//! A path of lines and arcs run through without a stop: looked ahead along, so that every corner is met slowly enough.
//!
//! ```text
//! v ^   ____       ____________
//!   |  /    \     /            \        a run is one piece, or many short ones driven alike: up to a speed,
//!   | /      \___/              \       steady, down to the speed of its end; no acceleration where runs meet
//!   |/        corner             \
//!   +----------------------------> t
//! ```
//!
//! Comes in: a [`Chain`] from rest to rest in mm, limits of X, Y and Z, [`PathRules`]. Goes out: a [`PlannedPath`], from which place,
//! speed and acceleration of every axis at any second follow in closed form, the second at any length, and for every
//! axis the seconds at which it is half-way between two steps. Does not know programs, nor how steps are stored.

mod bounds;
mod crossings;
mod curve;
mod laws;
mod plan;
mod turns;

pub use crossings::{Sweep, sweeps, sweeps_between};
pub use curve::{Curve, PathPoint};
pub use laws::{laws, override_change_per_s};
pub use plan::{Chain, PathRules, To, WantedPiece, plan};
pub use turns::turns;

use super::profile::Span;
use serde::{Deserialize, Serialize};

/// A planned path from rest to rest.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlannedPath {
    /// Where it starts.
    pub start: PathPoint,
    /// Its pieces, in order and without a gap.
    pub pieces: Vec<PlannedPiece>,
    /// Its runs, in order and without a gap: every piece is in one.
    pub runs: Vec<PathRun>,
}

/// A piece with its place in a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlannedPiece {
    /// Which piece of the chain it is, or is a part of.
    pub source: u32,
    /// Where it goes.
    pub curve: Curve,
    /// The run that it is in.
    pub run: u32,
    /// Length of the run before it, mm.
    pub start_mm: f64,
}

/// One rise, steady run and fall over one piece, or over many that may be driven alike.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PathRun {
    /// Second at which it begins, from the start of the path.
    pub start_s: f64,
    /// Length of the path before it, mm.
    pub start_mm: f64,
    /// Its first piece.
    pub first: u32,
    /// How many pieces it has, at least one.
    pub count: u32,
    /// Times and lengths counted from the beginning of the run. None of them is empty.
    pub spans: Vec<Span>,
}

impl PathRun {
    /// How long it takes.
    pub fn duration_s(&self) -> f64 {
        self.spans.last().map_or(0.0, Span::end_s)
    }

    /// How long it is.
    pub fn length_mm(&self) -> f64 {
        self.spans.last().map_or(0.0, Span::end_mm)
    }

    /// The span at second `t` of the run.
    fn span(&self, t: f64) -> Option<&Span> {
        self.spans.iter().rev().find(|span| t >= span.start_s).or(self.spans.first())
    }

    /// The second of the run at which its length `s_mm` is done.
    fn time_at(&self, s_mm: f64) -> f64 {
        let span = self.spans.iter().rev().find(|span| s_mm >= span.start_mm).or(self.spans.first());
        span.map_or(0.0, |span| span.time_at(s_mm))
    }
}

/// Curve, length along it, speed and acceleration along it, at one second.
struct Now<'a> {
    curve: &'a Curve,
    s_mm: f64,
    done_mm: f64,
    speed: f64,
    acceleration: f64,
}

impl PlannedPath {
    /// How long it takes.
    pub fn duration_s(&self) -> f64 {
        self.runs.last().map_or(0.0, |last| last.start_s + last.duration_s())
    }

    /// How long it is.
    pub fn length_mm(&self) -> f64 {
        self.runs.last().map_or(0.0, |last| last.start_mm + last.length_mm())
    }

    /// Where it ends.
    pub fn end(&self) -> PathPoint {
        self.pieces.last().map_or(self.start, |last| last.curve.end())
    }

    /// The same somewhere else, by `by` mm.
    #[must_use]
    pub fn shifted(mut self, by: PathPoint) -> Self {
        self.start = core::array::from_fn(|axis| self.start[axis] + by[axis]);
        for planned in &mut self.pieces {
            planned.curve = planned.curve.shifted(by);
        }
        self
    }

    /// The pieces of a run.
    fn pieces_of(&self, run: &PathRun) -> &[PlannedPiece] {
        let first = run.first as usize;
        self.pieces.get(first..first + run.count as usize).unwrap_or_default()
    }

    /// The second at which piece number `piece` of the plan begins; the duration where there is none.
    pub fn start_of_piece_s(&self, piece: usize) -> f64 {
        self.pieces.get(piece).map_or(self.duration_s(), |planned| self.time_in(planned, 0.0))
    }

    /// Which piece of the chain is driven at second `t`, counted from the first one of this path.
    pub fn wanted_at(&self, t: f64) -> u32 {
        let t = t.min(self.duration_s()).max(0.0);
        let begun = self.runs.partition_point(|run| run.start_s <= t).saturating_sub(1);
        let Some(run) = self.runs.get(begun) else { return 0 };
        let since = t - run.start_s;
        let done_mm = run.span(since).map_or(0.0, |span| span.position_mm(since));
        let pieces = self.pieces_of(run);
        let begun = pieces.partition_point(|piece| piece.start_mm <= done_mm).saturating_sub(1);
        let first = self.pieces.first().map_or(0, |first| first.source);
        pieces.get(begun).map_or(0, |piece| piece.source.saturating_sub(first))
    }

    /// The second at which piece `wanted` of the chain begins, counted from the first one of this path; the duration where all of
    /// them are before it.
    pub fn start_of_wanted_s(&self, wanted: u32) -> f64 {
        let source = self.pieces.first().map_or(0, |first| first.source).saturating_add(wanted);
        self.start_of_piece_s(self.pieces.partition_point(|piece| piece.source < source))
    }

    /// The second at which the length `s_mm` of a piece is done.
    fn time_in(&self, planned: &PlannedPiece, s_mm: f64) -> f64 {
        let run = self.runs.get(planned.run as usize);
        run.map_or(0.0, |run| run.start_s + run.time_at(planned.start_mm + s_mm))
    }

    /// What is driven at second `t`, if anything moves then.
    fn now(&self, t: f64) -> Option<Now<'_>> {
        let run = self.runs.get(self.runs.partition_point(|run| run.start_s <= t).saturating_sub(1))?;
        let since = t - run.start_s;
        let span = run.span(since)?;
        let s_mm = span.position_mm(since);
        let pieces = self.pieces_of(run);
        let planned = pieces.get(pieces.partition_point(|piece| piece.start_mm <= s_mm).saturating_sub(1))?;
        Some(Now {
            curve: &planned.curve,
            s_mm: s_mm - planned.start_mm,
            done_mm: run.start_mm + s_mm,
            speed: span.speed(since),
            acceleration: span.acceleration(since),
        })
    }

    fn moving(&self, t: f64) -> Option<Now<'_>> {
        if t > 0.0 && t < self.duration_s() { self.now(t) } else { None }
    }

    /// The place at second `t`: exactly the start before it begins and exactly the end afterwards.
    pub fn at(&self, t: f64) -> PathPoint {
        if t <= 0.0 {
            return self.start;
        }
        self.moving(t).map_or(self.end(), |now| now.curve.at(now.s_mm))
    }

    /// Length done at second `t`, mm.
    pub fn position_mm(&self, t: f64) -> f64 {
        let done = if t <= 0.0 { 0.0 } else { self.length_mm() };
        self.moving(t).map_or(done, |now| now.done_mm)
    }

    /// Speed along the path at second `t`, mm/s.
    pub fn speed(&self, t: f64) -> f64 {
        self.moving(t).map_or(0.0, |now| now.speed)
    }

    /// Speed of every axis at second `t`, mm/s, with its sign.
    pub fn velocity(&self, t: f64) -> PathPoint {
        self.moving(t).map_or([0.0; 3], |now| now.curve.tangent(now.s_mm).map(|share| share * now.speed))
    }

    /// Acceleration of every axis at second `t`, mm/s²: along the path, and on arcs also towards the centre.
    pub fn acceleration(&self, t: f64) -> PathPoint {
        self.moving(t).map_or([0.0; 3], |now| {
            let (along, across) = (now.curve.tangent(now.s_mm), now.curve.curvature(now.s_mm));
            let squared = now.speed * now.speed;
            core::array::from_fn(|axis| along[axis] * now.acceleration + across[axis] * squared)
        })
    }

    /// The second at which the length `s_mm` is done: 0 before the start, the duration after the end.
    pub fn time_at_length(&self, s_mm: f64) -> f64 {
        if s_mm >= self.length_mm() {
            return self.duration_s();
        }
        let run = self.runs.get(self.runs.partition_point(|run| run.start_mm <= s_mm).saturating_sub(1));
        run.map_or(0.0, |run| run.start_s + run.time_at((s_mm - run.start_mm).max(0.0)))
    }
}
