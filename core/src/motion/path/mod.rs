//! Paths of lines and arcs without stops, with look-ahead so that every corner is slow enough.
//!
//! ```text
//! v ^   ____       ____________
//!   |  /    \     /            \        a run is one piece, or several short ones with common limits: rise,
//!   | /      \___/              \       constant speed, fall to its end speed; no acceleration between runs
//!   |/        corner             \
//!   +----------------------------> t
//! ```

mod bounds;
mod crossings;
mod curve;
mod laws;
mod plan;
mod turns;

pub use bounds::PathRules;
pub use crossings::{Sweep, sweeps, sweeps_between};
pub use curve::{Curve, PathPoint};
pub use laws::{laws, override_change_per_s};
pub use plan::{Chain, To, WantedPiece, plan};
pub use turns::turns;

use super::profile::Span;
use serde::{Deserialize, Serialize};

/// A planned path from rest to rest.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlannedPath {
    pub start: PathPoint,
    /// In order, without gaps.
    pub pieces: Vec<PlannedPiece>,
    /// In order, without gaps: every piece is in one run.
    pub runs: Vec<PathRun>,
}

/// A piece with its location in a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlannedPiece {
    /// Index of its piece in the chain, whole or in part.
    pub source: u32,
    pub curve: Curve,
    /// Index of its run.
    pub run: u32,
    /// Length of the run before the piece, mm.
    pub start_mm: f64,
}

/// One rise, constant speed and fall over one piece, or over several with common limits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PathRun {
    /// Start time from the start of the path, s.
    pub start_s: f64,
    /// Length of the path before the run, mm.
    pub start_mm: f64,
    pub first: u32,
    /// Number of pieces, at least one.
    pub count: u32,
    /// Times and lengths are counted from the start of the run. None is empty.
    pub spans: Vec<Span>,
}

impl PathRun {
    pub fn duration_s(&self) -> f64 {
        self.spans.last().map_or(0.0, Span::end_s)
    }

    pub fn length_mm(&self) -> f64 {
        self.spans.last().map_or(0.0, Span::end_mm)
    }

    fn span(&self, t: f64) -> Option<&Span> {
        self.spans.iter().rev().find(|span| t >= span.start_s).or(self.spans.first())
    }

    fn time_at(&self, s_mm: f64) -> f64 {
        let span = self.spans.iter().rev().find(|span| s_mm >= span.start_mm).or(self.spans.first());
        span.map_or(0.0, |span| span.time_at(s_mm))
    }
}

/// Curve, length along it, speed and acceleration along it, at one time.
struct Now<'a> {
    curve: &'a Curve,
    s_mm: f64,
    done_mm: f64,
    speed: f64,
    acceleration: f64,
}

impl PlannedPath {
    pub fn duration_s(&self) -> f64 {
        self.runs.last().map_or(0.0, |last| last.start_s + last.duration_s())
    }

    pub fn length_mm(&self) -> f64 {
        self.runs.last().map_or(0.0, |last| last.start_mm + last.length_mm())
    }

    pub fn end(&self) -> PathPoint {
        self.pieces.last().map_or(self.start, |last| last.curve.end())
    }

    /// Shifts the path by `by` mm.
    #[must_use]
    pub fn shifted(mut self, by: PathPoint) -> Self {
        self.start = core::array::from_fn(|axis| self.start[axis] + by[axis]);
        for planned in &mut self.pieces {
            planned.curve = planned.curve.shifted(by);
        }
        self
    }

    fn pieces_of(&self, run: &PathRun) -> &[PlannedPiece] {
        let first = run.first as usize;
        self.pieces.get(first..first + run.count as usize).unwrap_or_default()
    }

    /// Start time of piece `piece`; the duration if it doesn't exist.
    pub fn start_of_piece_s(&self, piece: usize) -> f64 {
        self.pieces.get(piece).map_or(self.duration_s(), |planned| self.time_in(planned, 0.0))
    }

    /// Index of the chain's piece at second `t`, counted from the first one of this path.
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

    /// Start time of the chain's piece `wanted`, counted from the first one of this path; the duration if all
    /// pieces are before it.
    pub fn start_of_wanted_s(&self, wanted: u32) -> f64 {
        let source = self.pieces.first().map_or(0, |first| first.source).saturating_add(wanted);
        self.start_of_piece_s(self.pieces.partition_point(|piece| piece.source < source))
    }

    fn time_in(&self, planned: &PlannedPiece, s_mm: f64) -> f64 {
        let run = self.runs.get(planned.run as usize);
        run.map_or(0.0, |run| run.start_s + run.time_at(planned.start_mm + s_mm))
    }

    /// State at second `t`, if anything moves then.
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

    /// Position at second `t`: exactly the start before the path, exactly the end after it.
    pub fn at(&self, t: f64) -> PathPoint {
        if t <= 0.0 {
            return self.start;
        }
        self.moving(t).map_or(self.end(), |now| now.curve.at(now.s_mm))
    }

    pub fn position_mm(&self, t: f64) -> f64 {
        let done = if t <= 0.0 { 0.0 } else { self.length_mm() };
        self.moving(t).map_or(done, |now| now.done_mm)
    }

    /// Speed along the path at second `t`, mm/s.
    pub fn speed(&self, t: f64) -> f64 {
        self.moving(t).map_or(0.0, |now| now.speed)
    }

    /// Signed speed of each axis at second `t`, mm/s.
    pub fn velocity(&self, t: f64) -> PathPoint {
        self.moving(t).map_or([0.0; 3], |now| now.curve.tangent(now.s_mm).map(|share| share * now.speed))
    }

    /// Acceleration of each axis at second `t`, mm/s²: tangential, and on arcs also centripetal.
    pub fn acceleration(&self, t: f64) -> PathPoint {
        self.moving(t).map_or([0.0; 3], |now| {
            let (along, across) = (now.curve.tangent(now.s_mm), now.curve.curvature(now.s_mm));
            let squared = now.speed * now.speed;
            core::array::from_fn(|axis| along[axis] * now.acceleration + across[axis] * squared)
        })
    }

    /// Time in seconds at length `s_mm`: 0 before the start, the duration after the end.
    pub fn time_at_length(&self, s_mm: f64) -> f64 {
        if s_mm >= self.length_mm() {
            return self.duration_s();
        }
        let run = self.runs.get(self.runs.partition_point(|run| run.start_mm <= s_mm).saturating_sub(1));
        run.map_or(0.0, |run| run.start_s + run.time_at((s_mm - run.start_mm).max(0.0)))
    }
}
