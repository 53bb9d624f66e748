//! Step times of an axis on a path: the times at which the axis is half-way between two steps.
//!
//! ```text
//! x ^       ,-.            a sweep: steps in one direction, between reversals
//!   | k+½ ·/· ·\· · ·
//!   |     /     \          a reversal that is too quick for the motor is omitted with both its steps:
//!   | k-½·       \·        the motor stays, at most half a step and that little off
//!   +--------------> t
//! ```

use super::curve::Stretch;
use super::{PlannedPath, PlannedPiece};

/// Consecutive steps in one direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    /// True if they count up.
    pub forward: bool,
    /// Step of the axis before the sweep, from the zero of the path's coordinates.
    pub from_step: i64,
    pub count: u64,
    axis: usize,
    mm_per_step: f64,
    parts: Vec<Part>,
}

/// Steps of a sweep in one stretch of one piece.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Part {
    piece: usize,
    stretch: Stretch,
    from: i64,
    to: i64,
}

/// Steps of `axis` (0 X, 1 Y, 2 Z) along `path`, in order of time. At a reversal, the last step in one
/// direction and the first one back are at least `turn_s` apart. In total, the axis moves from the step
/// nearest to its start to the step nearest to its end.
pub fn sweeps(path: &PlannedPath, axis: usize, mm_per_step: f64, turn_s: f64) -> Vec<Sweep> {
    if axis > 2 {
        return Vec::new();
    }
    let step = |mm: f64| libm::floor(mm / mm_per_step + 0.5) as i64;
    sweeps_between(path, axis, mm_per_step, turn_s, (step(path.start[axis]), step(path.end()[axis])))
}

/// Like [`sweeps`], with given start and end steps of the axis, which must be nearest to the path's ends.
/// Half-way between two steps, both are valid.
pub fn sweeps_between(
    path: &PlannedPath,
    axis: usize,
    mm_per_step: f64,
    turn_s: f64,
    (first, last): (i64, i64),
) -> Vec<Sweep> {
    let mut found: Vec<Sweep> = Vec::new();
    if axis > 2 || mm_per_step.is_nan() || mm_per_step <= 0.0 {
        return found;
    }
    let step = |mm: f64| libm::floor(mm / mm_per_step + 0.5) as i64;
    let of_piece = |(piece, planned): (usize, &PlannedPiece)| {
        planned.curve.stretches(axis).into_iter().map(move |stretch| (piece, stretch)).collect::<Vec<_>>()
    };
    let mut stretches = path.pieces.iter().enumerate().flat_map(of_piece).peekable();
    while let Some((piece, stretch)) = stretches.next() {
        // Continue from the end of the previous piece, which may differ from this start by rounding.
        let from = found.last().map_or(first, Sweep::to_step);
        let to = if stretches.peek().is_some() { step(stretch.axis_to_mm) } else { last };
        if from != to {
            add(&mut found, Sweep::of(Part { piece, stretch, from, to }, axis, mm_per_step));
            settle(&mut found, path, turn_s);
        }
    }
    found
}

/// Appends a sweep; merges it with the last one if both have one direction.
fn add(found: &mut Vec<Sweep>, next: Sweep) {
    match found.last_mut() {
        Some(last) if last.forward == next.forward => {
            last.count += next.count;
            last.parts.extend(next.parts);
        }
        _ => found.push(next),
    }
}

/// Removes reversals that are too quick.
fn settle(found: &mut Vec<Sweep>, path: &PlannedPath, turn_s: f64) {
    while let Some(mut back) = found.pop() {
        let Some(there) = found.last_mut() else { return found.push(back) };
        let gap_s = back.time_s(path, 1) - there.time_s(path, there.count);
        if there.forward != back.forward && gap_s < turn_s {
            there.drop_last();
            back.drop_first();
            if there.count == 0 {
                found.pop();
            }
            if back.count == 0 {
                return;
            }
            add(found, back);
        } else {
            return found.push(back);
        }
    }
}

impl Sweep {
    fn of(part: Part, axis: usize, mm_per_step: f64) -> Self {
        Self {
            forward: part.to > part.from,
            from_step: part.from,
            count: part.to.abs_diff(part.from),
            axis,
            mm_per_step,
            parts: vec![part],
        }
    }

    pub fn to_step(&self) -> i64 {
        self.after(self.count)
    }

    fn after(&self, steps: u64) -> i64 {
        let steps = steps as i64;
        if self.forward { self.from_step + steps } else { self.from_step - steps }
    }

    /// Time of step `step` (1 … count), in seconds from the start of `path`: when the axis is half-way
    /// between the steps.
    pub fn time_s(&self, path: &PlannedPath, step: u64) -> f64 {
        let to = self.after(step);
        let found = self.parts.partition_point(|part| if self.forward { part.to < to } else { part.to > to });
        let Some(part) = self.parts.get(found) else { return path.duration_s() };
        let Some(planned) = path.pieces.get(part.piece) else { return path.duration_s() };
        let half = if self.forward { -0.5 } else { 0.5 };
        let place = (to as f64 + half) * self.mm_per_step;
        let s_mm = planned.curve.length_at(self.axis, &part.stretch, place);
        path.time_in(planned, s_mm)
    }

    fn drop_last(&mut self) {
        let way = if self.forward { 1 } else { -1 };
        self.count -= 1;
        if let Some(last) = self.parts.last_mut() {
            last.to -= way;
            if last.to == last.from {
                self.parts.pop();
            }
        }
    }

    fn drop_first(&mut self) {
        let way = if self.forward { 1 } else { -1 };
        self.count -= 1;
        self.from_step += way;
        if let Some(first) = self.parts.first_mut() {
            first.from += way;
            if first.from == first.to {
                self.parts.remove(0);
            }
        }
    }
}
