//! Cuts by time: the moves of a timeline as tip paths below the surface, each with its seconds.
//!
//! ```text
//! move   |--- part: Path ---------------|  |- part: down -|     times are those of the played stream
//! paths  |line |arc     |line           |  |vertical plunge|
//! ```
//!
//! Upward moves, and moves above the surface, cut nothing and are omitted.

use super::cuts::{CutShape, Way};
use crate::job::Stage;
use crate::machine::AXES;
use crate::motion::path::Curve;
use crate::motion::{AxisMove, Motion, MotorPath, Move};
use crate::units::TICK_HZ;

/// A path of the tip in the board, with its times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swept {
    pub way: Way,
    /// Start time, s.
    pub from_s: f64,
    pub to_s: f64,
    /// XY moves at rapid speed.
    pub rapid: bool,
    /// Index of the part in the move, and the range of its path, mm.
    part: u32,
    stretch_mm: Option<(f64, f64)>,
}

pub(super) fn start_s(planned: &Move) -> f64 {
    planned.start_tick as f64 / TICK_HZ as f64
}

/// The cuts of `planned`, in order of time.
pub fn swept(planned: &Move, mm_per_step: &[f64; AXES]) -> Vec<Swept> {
    let mut found = Vec::new();
    for (number, part) in (0..).zip(&planned.parts) {
        match &part.motion {
            Motion::Path(route) => along(planned, (number, part), route, &mut found),
            Motion::Line(_) | Motion::TableSteps(_) => {
                found.extend(straight(planned, (number, part), mm_per_step));
            }
        }
    }
    found
}

/// The lowest tip of all spindles, `t_s` seconds after the start of a move.
fn tip(planned: &Move, t_s: f64, mm_per_step: &[f64; AXES]) -> [f64; 3] {
    let steps = planned.at(t_s);
    let mm = |axis: usize| steps[axis] * mm_per_step[axis];
    [mm(0), mm(1), (2..AXES).map(mm).fold(f64::INFINITY, f64::min)]
}

fn straight(planned: &Move, (number, part): (u32, &AxisMove), mm_per_step: &[f64; AXES]) -> Option<Swept> {
    let [first, last] = [part.start_s(), part.end_s()];
    let (from, to) = (tip(planned, first, mm_per_step), tip(planned, last, mm_per_step));
    // While backlash is removed, motors turn but axes don't move.
    let rapid = (part.moves(0) || part.moves(1)) && part.stage != Stage::Mill;
    // A plunge may start while XY is still settling, but XY is at rest once the tip is in the board.
    let from = if rapid { from } else { [to[0], to[1], from[2]] };
    let cuts = if rapid { from[2].min(to[2]) < 0.0 } else { to[2] < 0.0 && to[2] < from[2] };
    // While spindles move next to it, XY is above the board; their plunges are separate parts.
    let to = if rapid { [to[0], to[1], from[2]] } else { to };
    let begin = start_s(planned);
    cuts.then_some(Swept {
        way: Way { from_mm: from, to_mm: to, shape: CutShape::Line },
        from_s: begin + first,
        to_s: begin + last,
        rapid,
        part: number,
        stretch_mm: None,
    })
    .filter(|found| found.way.from_mm[2].min(found.way.to_mm[2]) < 0.0)
}

fn along(planned: &Move, (number, part): (u32, &AxisMove), route: &MotorPath, found: &mut Vec<Swept>) {
    let (path, begin) = (&route.path, start_s(planned) + part.start_s());
    let mut from = path.start;
    let mut from_s = 0.0;
    for (index, piece) in path.pieces.iter().enumerate() {
        let (to, to_s) = (piece.curve.end(), path.start_of_piece_s(index + 1));
        if from[2] < 0.0 || to[2] < 0.0 {
            let shape = match piece.curve {
                Curve::Line { .. } => CutShape::Line,
                Curve::Arc { center, radius_mm, from_rad, sweep_rad, .. } => {
                    CutShape::Arc { center, radius_mm, from_rad, turn_rad: sweep_rad }
                }
            };
            let before_mm = path.runs.get(piece.run as usize).map_or(0.0, |run| run.start_mm);
            let start_mm = before_mm + piece.start_mm;
            found.push(Swept {
                way: Way { from_mm: from, to_mm: to, shape },
                from_s: begin + from_s,
                to_s: begin + to_s,
                rapid: false,
                part: number,
                stretch_mm: Some((start_mm, piece.curve.length_mm())),
            });
        }
        (from, from_s) = (to, to_s);
    }
}

impl Swept {
    /// Completed share at second `t_s`, 0 … 1; `planned` is its move.
    pub fn share(&self, planned: &Move, t_s: f64) -> f64 {
        if t_s >= self.to_s {
            return 1.0;
        }
        let Some(part) = planned.parts.get(self.part as usize).filter(|_| t_s > self.from_s) else {
            return 0.0;
        };
        let within_s = t_s - start_s(planned);
        let share = match (&part.motion, self.stretch_mm) {
            (Motion::Path(route), Some((start_mm, length_mm))) if length_mm > 0.0 => {
                (route.path.position_mm(within_s - part.start_s()) - start_mm) / length_mm
            }
            _ => part.share(within_s),
        };
        share.clamp(0.0, 1.0)
    }
}

/// Time at which a cutting tip is nearest to a position in XY, in seconds, and its distance then, mm.
pub fn nearest<'a>(
    moves: impl IntoIterator<Item = &'a Move>,
    mm_per_step: &[f64; AXES],
    at_mm: [f64; 2],
) -> Option<(f64, f64)> {
    let mut best: Option<(f64, f64)> = None;
    for found in moves.into_iter().flat_map(|planned| swept(planned, mm_per_step)) {
        let pieces: u32 = if found.way.shape == CutShape::Line { 1 } else { 24 };
        for piece in 0..pieces {
            let ends = [piece, piece + 1].map(|end| f64::from(end) / f64::from(pieces));
            let [a, b] = ends.map(|share| found.way.at(share));
            let (way, off) = ([b[0] - a[0], b[1] - a[1]], [at_mm[0] - a[0], at_mm[1] - a[1]]);
            let squared = way[0] * way[0] + way[1] * way[1];
            let along = (way[0] * off[0] + way[1] * off[1]) / squared;
            let share = if squared > 0.0 { along.clamp(0.0, 1.0) } else { 1.0 };
            let (x, y) = (off[0] - share * way[0], off[1] - share * way[1]);
            let away_mm = libm::sqrt(x * x + y * y);
            if best.is_none_or(|(_, nearest)| away_mm < nearest) {
                let done = ends[0] + (ends[1] - ends[0]) * share;
                best = Some((found.from_s + (found.to_s - found.from_s) * done, away_mm));
            }
        }
    }
    best
}
