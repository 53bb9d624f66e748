//! Chains of holes: XY and spindles move together, from the bottom of one hole to the bottom of the next.
//!
//! ```text
//! height ^  |‾‾‾‾\                 from the top: the first of a chain
//!        |  |     \__|‾\           from the bottom: all others
//!        |           |/ \__| …     each ends at rest at the bottom, so a chain can stop after any hole
//!        +-----------------------> t
//! ```
//!
//! The strokes of a spindle are planned once per bit and then only triggered. Down follows the machine's
//! downward law, fast and then at feed; up follows the upward law. [`coordination`](super::coordination) has
//! the rules for the release of XY and the trigger of a stroke. Spindles with their own depth or margin go
//! down on their own schedule. All rise at once when the last is down, and XY starts when the last one is
//! clear.

use super::coordination::{SpindleRules, SpindleTimes, stroke};
use super::limits::{REST_TICKS, line, lines, mm_per_step, shape, start_tick};
use super::profile::{self, Limits, Stroke, two_speeds};
use super::timeline::{AxisMove, Motion};
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::job::{Command, Leg, Mark, Stage};
use crate::machine::{AXES, DriveKind, Machine, OwnStroke, Steps, StrokeEnd};
use crate::units::{Length, TICK_HZ};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hole {
    pub(super) to: Point,
    pub(super) bottom: Length,
    pub(super) top: Length,
    feed_um_per_s: u32,
    dwell_us: u32,
    lift_mm_per_s: f64,
}

impl Hole {
    pub(super) fn lifted(self, lift_mm_per_s: f64) -> Self {
        Self { lift_mm_per_s, ..self }
    }
}

/// Spindle axes with identical strokes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Alike {
    axes: Vec<usize>,
    own: OwnStroke,
}

/// A chain at the bottom of a hole: the upward strokes and times of each group of spindles.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Low {
    ways: Vec<(Stroke, SpindleTimes)>,
    top_steps: i64,
}

/// Parts of the move to the next hole, not yet in the timeline.
pub(super) struct NextHole {
    pub(super) parts: Vec<AxisMove>,
    pub(super) to: Steps,
    pub(super) duration_ticks: u64,
}

#[derive(Clone, Debug, Default)]
pub(super) struct DrillCycles {
    known: Vec<Stored>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct StrokeKey {
    top_steps: i64,
    bottom_steps: i64,
    feed_um_per_s: u32,
    lift_mm_per_s: f64,
    margin_ms: f64,
}

#[derive(Clone, Debug)]
struct Stored {
    key: StrokeKey,
    down: Stroke,
    up: Stroke,
    times: SpindleTimes,
}

/// True if XY and spindles of `machine` move together, from bottom to bottom.
pub fn overlaps(machine: &Machine) -> bool {
    let counted = machine.stroke_end == StrokeEnd::Counted && machine.drive == DriveKind::Planned;
    machine.overlap.on && counted
}

/// The hole of `leg` if it fits into a chain: rapid, plunge without a sensor, optional dwell, retract.
pub(super) fn plain_hole(machine: &Machine, leg: &Leg) -> Option<Hole> {
    // A presser foot must be up before XY moves, which rules out overlap.
    let together = machine.overlap.on && machine.drive == DriveKind::Planned && !machine.foot.on;
    if !together || !matches!(leg.mark, Mark::Hole(_)) {
        return None;
    }
    let (to, plunge, dwell_us, top) = match *leg.commands.as_slice() {
        [Command::Rapid { to }, plunge, Command::Retract { to: top }] => (to, plunge, 0, top),
        [Command::Rapid { to }, plunge, Command::Dwell { us }, Command::Retract { to: top }] => {
            (to, plunge, us, top)
        }
        _ => return None,
    };
    let Command::Plunge { to: bottom, feed_um_per_s, gate: None } = plunge else { return None };
    let clear = Length::from_mm(machine.overlap.clear_mm);
    let plain = feed_um_per_s > 0 && bottom < Length::ZERO && top > clear;
    let lift_mm_per_s = f64::INFINITY;
    plain.then_some(Hole { to, bottom, top, feed_um_per_s, dwell_us, lift_mm_per_s })
}

/// Groups spindle axes with identical strokes; without spindles, one empty group.
pub(super) fn alike(machine: &Machine, spindles: &[usize]) -> Vec<Alike> {
    let mut groups: Vec<Alike> = Vec::new();
    for axis in spindles {
        // A longer bit shifts the axis but doesn't change its stroke.
        let own = OwnStroke { longer: Length::ZERO, ..machine.own(*axis) };
        match groups.iter_mut().find(|group| group.own == own) {
            Some(group) => group.axes.push(*axis),
            None => groups.push(Alike { axes: vec![*axis], own }),
        }
    }
    if groups.is_empty() {
        groups.push(Alike { axes: Vec::new(), own: OwnStroke::default() });
    }
    groups
}

impl Alike {
    fn at(&self, steps: Steps, height: i64) -> Steps {
        let mut steps = steps;
        for axis in &self.axes {
            steps[*axis] = height;
        }
        steps
    }
}

impl DrillCycles {
    /// The move to `hole` from rest at `at`, with the motors of X and Y going to `plane`. Starts at the
    /// bottom of a hole if the chain is `low`, else at the top.
    pub(super) fn next_hole(
        &mut self,
        machine: &Machine,
        groups: &[Alike],
        (at, plane, turned): (Steps, Steps, [bool; AXES]),
        hole: Hole,
        low: Option<Low>,
    ) -> Result<(NextHole, Low), Diagnostic> {
        let latency_s = machine.overlap.latency_ms * 1e-3;
        let mut parts = Vec::new();
        let (mut now, mut release_s, mut tops_s) = (at, 0.0, vec![None; groups.len()]);
        if let Some(low) = low {
            let mut clear_s = 0.0_f64;
            for ((group, (up, times)), top_s) in groups.iter().zip(low.ways).zip(&mut tops_s) {
                let above = group.at(now, low.top_steps);
                let begin = start_tick(machine, 0.0, &up, &now, &above);
                let begin_s = begin as f64 / TICK_HZ as f64;
                clear_s = clear_s.max(begin_s + times.leave_s);
                *top_s = Some(begin_s + times.up_s);
                parts.push(part(Stage::Retract, begin, now, above, up));
                now = above;
            }
            release_s = clear_s + latency_s;
        }
        let mut there = now;
        (there[0], there[1]) = (plane[0], plane[1]);
        let mut arrive_s = release_s;
        let release_tick = libm::ceil(release_s * TICK_HZ as f64) as u64;
        for line in lines(machine, Stage::Travel, now, there, f64::INFINITY, turned)? {
            let line = AxisMove { start_tick: line.start_tick + release_tick, ..line };
            arrive_s = line.end_s();
            parts.push(line);
        }
        let settle_s = if there == now { 0.0 } else { machine.settle_ms * 1e-3 };
        let rules = SpindleRules { settle_s, latency_s };
        let (mut to, mut downs, mut ways) = (there, Vec::new(), Vec::new());
        for (group, top_s) in groups.iter().zip(tops_s) {
            let stored = self.stored(machine, group, now, hole)?;
            let stroked = stroke(&stored.times, rules, release_s, arrive_s + settle_s, top_s);
            let below = group.at(to, stored.key.bottom_steps);
            let begin = start_tick(machine, stroked.start_s, &stored.down, &to, &below);
            downs.push(part(Stage::Drill, begin, to, below, stored.down));
            ways.push((stored.up, stored.times));
            to = below;
        }
        // Parts of a move are ordered by start.
        downs.sort_by_key(|down| down.start_tick);
        let end_s = downs.iter().map(AxisMove::end_s).fold(0.0, f64::max);
        parts.append(&mut downs);
        let end_tick = libm::ceil(end_s * TICK_HZ as f64) as u64;
        let dwell_ticks = u64::from(hole.dwell_us) * (TICK_HZ / 1_000_000);
        let low = Low { ways, top_steps: machine.z.scale.steps(hole.top) };
        Ok((NextHole { parts, to, duration_ticks: end_tick + dwell_ticks + REST_TICKS }, low))
    }

    fn stored(
        &mut self,
        machine: &Machine,
        group: &Alike,
        top: Steps,
        hole: Hole,
    ) -> Result<Stored, Diagnostic> {
        let scale = machine.z.scale;
        let key = StrokeKey {
            top_steps: scale.steps(hole.top),
            bottom_steps: scale.steps(group.own.height(hole.bottom, hole.bottom)),
            feed_um_per_s: hole.feed_um_per_s,
            lift_mm_per_s: hole.lift_mm_per_s,
            margin_ms: group.own.margin_ms,
        };
        if let Some(known) = self.known.iter().find(|known| known.key == key) {
            return Ok(known.clone());
        }
        let (high, low) = (group.at(top, key.top_steps), group.at(top, key.bottom_steps));
        let mm = mm_per_step(machine)[2];
        let (height_mm, depth_mm) = (key.top_steps as f64 * mm, -key.bottom_steps as f64 * mm);
        let down = down(machine, height_mm, depth_mm, f64::from(hole.feed_um_per_s) * 1e-3)?;
        let up = Stroke::One(line(machine, &low, &high, hole.lift_mm_per_s)?);
        let times = times(machine, &group.own, &down, &up, height_mm);
        if self.known.len() >= AXES {
            self.known.clear();
        }
        let stored = Stored { key, down, up, times };
        self.known.push(stored.clone());
        Ok(stored)
    }
}

/// Times of the strokes of a spindle with the differences `own`. The margin makes XY rest before the tip is
/// below the clear height, not only before contact (C2.3, invariants I1 and I2).
fn times(machine: &Machine, own: &OwnStroke, down: &Stroke, up: &Stroke, height_mm: f64) -> SpindleTimes {
    let overlap = &machine.overlap;
    let times = SpindleTimes::of(down, up, height_mm, overlap.clear_mm);
    let low_s = times.contact_s - down.time_at(height_mm - overlap.clear_mm) - machine.settle_ms * 1e-3;
    SpindleTimes {
        dwell_top_s: overlap.dwell_top_ms * 1e-3,
        margin_s: ((overlap.margin_ms + own.margin_ms) * 1e-3).max(low_s),
        ..times
    }
}

/// Times and strokes (down and up) of the spindle on `axis`, from the safe height to the bottom of a hole
/// through the machine's board and back.
pub fn own(machine: &Machine, axis: usize) -> Result<(SpindleTimes, Stroke, Stroke), Diagnostic> {
    let process = &machine.process;
    in_hole(machine, axis, -(process.board_thickness + process.breakthrough), process.feed_mm_per_s)
}

/// Like [`own`], for a hole with its common bottom at `bottom` over the board's surface, at this feed.
pub fn in_hole(
    machine: &Machine,
    axis: usize,
    bottom: Length,
    feed_mm_per_s: f64,
) -> Result<(SpindleTimes, Stroke, Stroke), Diagnostic> {
    let process = &machine.process;
    let (scale, spindle) = (machine.z.scale, machine.own(axis));
    let (top, bottom) = (scale.steps(process.safe_height), scale.steps(spindle.height(bottom, bottom)));
    let mm = mm_per_step(machine)[2];
    let (height_mm, depth_mm) = (top as f64 * mm, -bottom as f64 * mm);
    let (mut low, mut high) = (Steps::default(), Steps::default());
    (low[2], high[2]) = (bottom, top);
    let down = down(machine, height_mm, depth_mm, feed_mm_per_s)?;
    let up = Stroke::One(line(machine, &low, &high, f64::INFINITY)?);
    let times = SpindleTimes {
        dwell_bottom_s: process.dwell_bottom_ms * 1e-3,
        ..times(machine, &spindle, &down, &up, height_mm)
    };
    Ok((times, down, up))
}

/// Times of the machine's own strokes of all spindles.
pub fn own_times(machine: &Machine) -> Result<Vec<SpindleTimes>, Diagnostic> {
    machine.spindle_axes().map(|axis| Ok(own(machine, axis)?.0)).collect()
}

/// Abort horizon of the machine's downward stroke `down`: the latest time after its start, in s, at which Z
/// can still stop with the tip clear of the board (C2.3). Uses the lower of Z's limits in both directions.
pub fn last_stop_s(machine: &Machine, down: &Stroke) -> Result<f64, Diagnostic> {
    let (own, limits) = (Limits::of_axis(machine, &machine.z), Limits::of_down(machine));
    let limits = Limits {
        acceleration_mm_per_s2: limits.acceleration_mm_per_s2.min(own.acceleration_mm_per_s2),
        jerk_mm_per_s3: limits.jerk_mm_per_s3.min(own.jerk_mm_per_s3),
        ..limits
    };
    let process = &machine.process;
    let height_mm = machine.z.scale.steps(process.safe_height) as f64 * mm_per_step(machine)[2];
    profile::point_of_no_return_s(down, height_mm, machine.overlap.clear_mm.min(height_mm), limits)
}

/// The downward stroke: fast to the feed height, then at feed; all at feed if the distance is too short for
/// two speeds.
pub fn down(
    machine: &Machine,
    height_mm: f64,
    depth_mm: f64,
    feed_mm_per_s: f64,
) -> Result<Stroke, Diagnostic> {
    let limits = Limits::of_down(machine);
    let length_mm = height_mm + depth_mm;
    let law = shape(machine, machine.motion.down, length_mm, limits)?;
    if feed_mm_per_s < limits.speed_mm_per_s {
        let slow_mm = machine.process.feed_height.mm().min(height_mm);
        // If the way is too short for two speeds, all of it is at feed.
        if let Ok(stroke) = two_speeds(law, height_mm - slow_mm, depth_mm + slow_mm, feed_mm_per_s, limits) {
            return Ok(stroke);
        }
    }
    Ok(Stroke::One(profile::plan(law, length_mm, limits.slowed(feed_mm_per_s))?))
}

fn part(stage: Stage, start_tick: u64, from: Steps, to: Steps, stroke: Stroke) -> AxisMove {
    AxisMove { stage, start_tick, from, to, motion: Motion::Line(stroke) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::virtual_drill;

    #[test]
    fn margin_and_settling_apply_beyond_the_lift_time() {
        // 0.3 mm at 12 mm/s.
        let rows = [((5.0, 10.0), 25.0), ((0.0, 0.0), 25.0), ((20.0, 10.0), 30.0), ((5.0, 40.0), 45.0)];
        for ((margin_ms, settle_ms), wanted_ms) in rows {
            let mut machine = virtual_drill();
            (machine.overlap.margin_ms, machine.settle_ms) = (margin_ms, settle_ms);
            let waits_ms = settle_ms + 1e3 * own(&machine, 2).expect("a stroke").0.margin_s;
            assert!((waits_ms - wanted_ms).abs() < 0.1, "{margin_ms} {settle_ms}: {waits_ms}");
        }
    }
}
